//! Faces found so far, their bodies, and the entities still to be displayed.

use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::file::Fault;
use super::reader::Reader;
use crate::attributes::{Body, BodyKind, Name, Style, path_below};
use crate::raw::{LostFace, RawFace};
use kanagata_geometry::Affine;

/// Faces and curves found.
#[derive(Default)]
pub(super) struct Found {
    /// Faces [mm].
    pub faces: Vec<RawFace>,
    /// Bodies of the faces.
    pub bodies: Vec<Body>,
    /// Number of curves that no entity refers to.
    pub loose_curves: usize,
    /// First fault that cost a face.
    pub first_fault: Option<Fault>,
    /// Unreadable faces.
    pub lost: Vec<LostFace>,
    shells: usize,
    /// Total number of sides of all faces.
    sides: usize,
    /// Numbers of shared edges by instance, list and number in the list.
    pub edge_ids: FxHashMap<(usize, usize, usize), usize>,
    /// Number of instances so far.
    pub instances: usize,
    /// Body of the faces of no solid or shell, by instance.
    loose: FxHashMap<usize, usize>,
}

/// An entity to display and its placement.
#[derive(Clone)]
pub(super) struct Task {
    pub entity: usize,
    pub map: Affine,
    pub depth: usize,
    pub instance: usize,
    /// Names of the definitions and instances around it.
    pub path: Arc<[Name]>,
    /// Layers and colour of the entities around it.
    pub style: Style,
}

impl Task {
    /// The task of a contained entity.
    pub fn below(&self, entity: usize, map: Affine, instance: usize) -> Self {
        let (path, style) = (Arc::clone(&self.path), self.style.clone());
        Self { entity, map, depth: self.depth + 1, instance, path, style }
    }

    /// The task within entities of these names and this style.
    pub fn within(mut self, names: &[Option<Name>], style: Style) -> Self {
        self.path = path_below(&self.path, names);
        if !style.layers.is_empty() {
            self.style.layers = style.layers;
        }
        self.style.colour = style.colour.or(self.style.colour);
        self
    }
}

impl Found {
    /// Adds a face of `entity`.
    ///
    /// # Errors
    /// A fault with the code `work-limit` when instances multiply the faces beyond the limit for a file of this size.
    pub fn push(
        &mut self,
        reader: &Reader<'_, '_>,
        entity: usize,
        mut face: RawFace,
        (body, style): (usize, &Style),
    ) -> Result<(), Fault> {
        self.sides += face.sides();
        reader.file.allow_sides(entity, self.sides)?;
        let attributes = Arc::make_mut(&mut face.attributes);
        attributes.body = body;
        attributes.inherit(style);
        self.faces.push(face);
        Ok(())
    }

    /// Adds a face of no solid or shell.
    pub fn push_loose(
        &mut self,
        reader: &Reader<'_, '_>,
        task: &Task,
        face: RawFace,
    ) -> Result<(), Fault> {
        let body = self.body_of(reader, task);
        self.push(reader, task.entity, face, (body, &task.style))
    }

    /// Number of the body of an entity; the faces of no solid or shell of an instance have a common one.
    pub fn body_of(&mut self, reader: &Reader<'_, '_>, task: &Task) -> usize {
        let fresh = self.bodies.len();
        let entry = reader.file.entry(task.entity);
        let kind = match entry.kind {
            186 => BodyKind::Solid,
            514 => BodyKind::Shell,
            _ => BodyKind::Faces,
        };
        let (name, source) = if kind == BodyKind::Faces {
            let number = *self.loose.entry(task.instance).or_insert(fresh);
            if number != fresh {
                return number;
            }
            (None, String::new())
        } else {
            (reader.name_of(task.entity), format!("D{} ({})", entry.pointer, entry.kind))
        };
        self.bodies.push(Body { path: path_below(&task.path, &[name]), kind, source });
        fresh
    }

    pub fn next_shell(&mut self) -> usize {
        self.shells += 1;
        self.shells - 1
    }

    pub fn record_lost(&mut self, reader: &Reader<'_, '_>, entity: usize, fault: Fault) {
        reader.file.skip(entity, &fault);
        let entry = reader.file.entry(entity);
        let source = format!("D{} ({})", entry.pointer, entry.kind);
        let reason = format!("{}; allowed: {}", fault.found, fault.allowed);
        self.lost.push(LostFace { source, reason });
        self.first_fault.get_or_insert(fault);
    }
}
