//! Conversion of representation items (solids, shells, sets and single faces) to raw faces.

use super::entity::{Entity, Fault, Outcome};
use super::resolver::{Resolver, Units};
use std::sync::Arc;

use crate::Severity;
use crate::attributes::{BodyKind, Name, name};
use crate::raw::RawFace;

/// A body of an item.
#[derive(Debug)]
pub struct ItemBody {
    pub kind: BodyKind,
    pub name: Option<Name>,
    /// Entity, for messages.
    pub source: String,
}

/// Faces of one item, in its own coordinates. Edge numbers are instance numbers; shells and bodies are numbered from 0.
#[derive(Debug, Default)]
pub struct ItemFaces {
    /// Instance of the item.
    pub entity: u32,
    /// Faces.
    pub faces: Vec<RawFace>,
    /// Bodies, to which the attributes of the faces refer.
    pub bodies: Vec<ItemBody>,
    /// Number of shells.
    pub shells: usize,
    /// Number of curves that bound no face.
    pub loose_curves: usize,
    /// Number of unreadable faces.
    pub failed: usize,
}

/// Category of a representation item.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ItemKind {
    /// Solid, shell, face, or surface.
    Shape,
    /// Curve, wireframe or point set without faces.
    Loose,
    /// Placement of another representation.
    Mapped,
    /// Faceted geometry without exact surfaces.
    Tessellated,
    /// Constructive solid without boundary representation.
    Constructive,
    /// Points, placements, texts, styles.
    Other,
}

/// Category of an item.
#[must_use]
pub fn item_kind(e: Entity) -> ItemKind {
    match e.kind() {
        "MANIFOLD_SOLID_BREP"
        | "BREP_WITH_VOIDS"
        | "FACETED_BREP"
        | "SHELL_BASED_SURFACE_MODEL"
        | "FACE_BASED_SURFACE_MODEL"
        | "GEOMETRIC_SET"
        | "OPEN_SHELL"
        | "CLOSED_SHELL"
        | "ORIENTED_OPEN_SHELL"
        | "ORIENTED_CLOSED_SHELL"
        | "CONNECTED_FACE_SET"
        | "CONNECTED_FACE_SUB_SET"
        | "ADVANCED_FACE"
        | "FACE_SURFACE"
        | "ORIENTED_FACE"
        | "FACE"
        | "SUBFACE"
        | "CURVE_BOUNDED_SURFACE"
        | "RECTANGULAR_TRIMMED_SURFACE" => ItemKind::Shape,
        "MAPPED_ITEM" => ItemKind::Mapped,
        "GEOMETRIC_CURVE_SET"
        | "EDGE_BASED_WIREFRAME_MODEL"
        | "SHELL_BASED_WIREFRAME_MODEL"
        | "TRIMMED_CURVE"
        | "COMPOSITE_CURVE"
        | "POLYLINE"
        | "LINE"
        | "CIRCLE"
        | "ELLIPSE"
        | "EDGE_CURVE" => ItemKind::Loose,
        "CSG_SOLID"
        | "BOOLEAN_RESULT"
        | "BLOCK"
        | "RIGHT_ANGULAR_WEDGE"
        | "SPHERE"
        | "TORUS"
        | "RIGHT_CIRCULAR_CONE"
        | "RIGHT_CIRCULAR_CYLINDER"
        | "EXTRUDED_AREA_SOLID"
        | "REVOLVED_AREA_SOLID"
        | "EXTRUDED_FACE_SOLID"
        | "REVOLVED_FACE_SOLID"
        | "HALF_SPACE_SOLID"
        | "BOXED_HALF_SPACE"
        | "SWEPT_DISK_SOLID"
        | "SOLID_REPLICA"
        | "ELLIPSOID" => ItemKind::Constructive,
        kind if kind.contains("TESSELLATED")
            || kind.starts_with("TRIANGULATED")
            || kind.starts_with("COMPLEX_TRIANGULATED")
            || kind.starts_with("CUBIC_BEZIER_T") =>
        {
            ItemKind::Tessellated
        }
        kind if is_surface(kind) => ItemKind::Shape,
        kind if kind.contains("_CURVE") && !kind.contains("STYLE") => ItemKind::Loose,
        _ => ItemKind::Other,
    }
}

fn is_surface(kind: &str) -> bool {
    kind.contains("B_SPLINE_SURFACE")
        || matches!(
            kind,
            "BEZIER_SURFACE"
                | "UNIFORM_SURFACE"
                | "QUASI_UNIFORM_SURFACE"
                | "SPHERICAL_SURFACE"
                | "TOROIDAL_SURFACE"
                | "DEGENERATE_TOROIDAL_SURFACE"
                | "SURFACE_OF_REVOLUTION"
                | "SURFACE_OF_LINEAR_EXTRUSION"
                | "OFFSET_SURFACE"
                | "SURFACE_REPLICA"
        )
}

impl ItemFaces {
    /// The shells that follow belong to a new body.
    fn begin_body(&mut self, kind: BodyKind, name: Option<Name>, e: Entity) {
        self.bodies.push(ItemBody { kind, name, source: e.place() });
    }

    /// Adds a face of no solid or shell.
    fn extend_loose(&mut self, face: Option<RawFace>, e: Entity) {
        let Some(mut face) = face else { return };
        if self.bodies.last().is_none_or(|b| b.kind != BodyKind::Faces) {
            self.begin_body(BodyKind::Faces, None, e);
        }
        Arc::make_mut(&mut face.attributes).body = self.bodies.len() - 1;
        self.faces.push(face);
    }
}

impl<'t> Resolver<'t> {
    /// All faces of an item of [`ItemKind::Shape`].
    ///
    /// # Errors
    /// Only fatal faults, which reject the entire file; an unreadable face is a diagnostic.
    pub fn item(&self, e: Entity<'t>, units: Units) -> Outcome<ItemFaces> {
        let mut out = ItemFaces { entity: e.index, ..ItemFaces::default() };
        self.shape(e, units, &mut out, 0)?;
        self.pass_on(e, &mut out, 0);
        Ok(out)
    }

    /// Passes layers and colour of `e` on to the faces from `first` on.
    fn pass_on(&self, e: Entity<'t>, out: &mut ItemFaces, first: usize) {
        let style = self.style(e);
        for face in &mut out.faces[first..] {
            Arc::make_mut(&mut face.attributes).inherit(&style);
        }
    }

    /// Records the fault of a sub-entity, which costs only that entity unless it is fatal.
    fn recover<T>(&self, result: Outcome<T>, out: &mut ItemFaces) -> Outcome<Option<T>> {
        match result {
            Ok(value) => Ok(Some(value)),
            Err(fault) if fault.fatal => Err(fault),
            Err(fault) => {
                let fault = self.charged(fault)?;
                out.failed += 1;
                self.diagnostics.borrow_mut().push(fault.into_diagnostic("entity-invalid"));
                Ok(None)
            }
        }
    }

    /// As [`Self::recover`] for the face `e`: the fault of any entity of the face is attributed to the face.
    fn recover_face<T>(
        &self,
        e: Entity<'t>,
        result: Outcome<T>,
        out: &mut ItemFaces,
    ) -> Outcome<Option<T>> {
        let of_face = |mut fault: Box<Fault>| {
            let place = e.place();
            if fault.place != place {
                fault.found = format!("{}: {}", fault.place, fault.found);
                fault.place = place;
            }
            fault
        };
        self.recover(result.map_err(of_face), out)
    }

    /// Surfaces of a geometric set; its curves are counted.
    fn elements(
        &self,
        set: Entity<'t>,
        units: Units,
        out: &mut ItemFaces,
        depth: usize,
    ) -> Outcome<()> {
        for element in self.recover(set.attributes().entities(1), out)?.unwrap_or_default() {
            match item_kind(element) {
                ItemKind::Shape => self.shape(element, units, out, depth + 1)?,
                ItemKind::Loose => out.loose_curves += 1,
                _ => {}
            }
        }
        Ok(())
    }

    fn shape(&self, e: Entity<'t>, units: Units, out: &mut ItemFaces, depth: usize) -> Outcome<()> {
        let spent = self.charge(e, depth, 0);
        if self.recover(spent, out)?.is_none() {
            return Ok(());
        }
        let a = e.attributes();
        match e.kind() {
            "MANIFOLD_SOLID_BREP" | "FACETED_BREP" | "BREP_WITH_VOIDS" => {
                self.solid(e, units, out)?;
            }
            "SHELL_BASED_SURFACE_MODEL" | "FACE_BASED_SURFACE_MODEL" => {
                for shell in self.recover(a.entities(1), out)?.unwrap_or_default() {
                    let named = name(&shell.attributes().text(0)).or_else(|| name(&a.text(0)));
                    out.begin_body(BodyKind::Shell, named, shell);
                    self.shell(shell, units, out)?;
                }
            }
            kind if kind.ends_with("SHELL") || kind.starts_with("CONNECTED_FACE") => {
                out.begin_body(BodyKind::Shell, name(&a.text(0)), e);
                self.shell(e, units, out)?;
            }
            "GEOMETRIC_SET" => self.elements(e, units, out, depth)?,
            "ADVANCED_FACE" | "FACE_SURFACE" | "ORIENTED_FACE" | "FACE" | "SUBFACE" => {
                let face = self.face(e, units, true);
                let read = self.recover_face(e, face, out)?;
                out.extend_loose(read, e);
            }
            _ => {
                let face = self.surface_face(e, units);
                let read = self.recover_face(e, face, out)?;
                out.extend_loose(read, e);
            }
        }
        Ok(())
    }

    /// `MANIFOLD_SOLID_BREP(name, outer)`, `BREP_WITH_VOIDS(name, outer, voids)`.
    fn solid(&self, e: Entity<'t>, units: Units, out: &mut ItemFaces) -> Outcome<()> {
        let a = e.attributes();
        let outer = a.entity(1);
        let of_shell = || outer.as_ref().ok().and_then(|s| name(&s.attributes().text(0)));
        out.begin_body(BodyKind::Solid, name(&a.text(0)).or_else(of_shell), e);
        if let Some(shell) = self.recover(outer, out)? {
            self.shell(shell, units, out)?;
        }
        if e.has("BREP_WITH_VOIDS") {
            let voids = a.entities(a.len().saturating_sub(1));
            for void in self.recover(voids, out)?.unwrap_or_default() {
                self.shell(void, units, out)?;
            }
        }
        Ok(())
    }

    /// `CLOSED_SHELL(name, faces)`, `ORIENTED_CLOSED_SHELL(name, *, element, orientation)`.
    fn shell(&self, e: Entity<'t>, units: Units, out: &mut ItemFaces) -> Outcome<()> {
        let found = self.unoriented_shell(e);
        let Some((shell, oriented)) = self.recover(found, out)? else { return Ok(()) };
        let faces = shell.attributes().entities(1);
        let (number, first) = (out.shells, out.faces.len());
        out.shells += 1;
        for face in self.recover(faces, out)?.unwrap_or_default() {
            let read = self.face(face, units, oriented);
            if let Some(mut face) = self.recover_face(face, read, out)? {
                face.shell = Some(number);
                Arc::make_mut(&mut face.attributes).body = out.bodies.len().saturating_sub(1);
                out.faces.push(face);
            }
        }
        self.pass_on(shell, out, first);
        Ok(())
    }

    fn unoriented_shell(&self, e: Entity<'t>) -> Outcome<(Entity<'t>, bool)> {
        let (mut e, mut oriented) = (e, true);
        let mut depth = 0;
        loop {
            self.charge(e, depth, 0)?;
            match e.kind() {
                "ORIENTED_CLOSED_SHELL" | "ORIENTED_OPEN_SHELL" => {
                    let a = e.attributes();
                    oriented ^= !a.flag(3)?;
                    e = a.entity(2)?;
                }
                kind if kind.ends_with("SHELL") || kind.starts_with("CONNECTED_FACE") => {
                    return Ok((e, oriented));
                }
                kind => return Err(e.fault(format!("a {kind} as a shell"), "a shell")),
            }
            depth += 1;
        }
    }

    /// Reports omitted items, once per category.
    pub fn report_omitted(&self, kind: ItemKind, counted: usize, first: Entity) {
        if counted == 0 {
            return;
        }
        let (code, what) = match kind {
            ItemKind::Tessellated => {
                ("tessellated", "tessellated items hold facets, no exact surfaces")
            }
            ItemKind::Constructive => (
                "constructive-solid",
                "solids by construction (CSG, swept areas) have no faces in the file",
            ),
            _ => return,
        };
        let text = format!("{counted} omitted: {what}; export the model as a B-rep");
        self.note(Severity::Warning, code, first.place(), text);
    }
}
