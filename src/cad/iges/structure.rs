//! Displayed entities: roots, groups (402), subfigures (308, 408), solid instances (430) and assemblies (184).

use std::sync::Arc;

use super::curves::CURVES;
use super::file::Fault;
use super::found::{Found, Task};
use super::ownership::Ownership;
use super::reader::{POINTER_DEPTH_MAX, Reader};
use super::surface::SURFACES;
use crate::attributes::{Name, Style};
use crate::raw::RawFace;
use kanagata_geometry::{Affine, Mat3, Vec3};

/// Shell number, placement, and faces with their sense.
type ShellFaces = (Option<usize>, Affine, Vec<(usize, bool)>);

impl Reader<'_, '_> {
    /// Traverses all displayed entities; lengths are multiplied by `scale`.
    ///
    /// # Errors
    /// Only for self-multiplying pointers.
    pub fn walk(&self, scale: f64) -> Result<Found, Fault> {
        let mut owners = self.ownership()?;
        let mut found = Found::default();
        let map = Affine { linear: Mat3::identity() * scale, shift: Vec3::zeros() };
        self.apply_status(&mut owners);
        for entity in 0..self.file.len() {
            if owners.hidden[entity]
                || owners.used[entity]
                || owners.defined[entity]
                || owners.placed[entity]
            {
                continue;
            }
            let entry = self.file.entry(entity);
            if CURVES.contains(&entry.kind) || matches!(entry.kind, 141 | 142) {
                let drawn = entry.kind != 106 || matches!(entry.form, 11 | 12 | 13 | 63);
                let model = !matches!(entry.status[2], 1 | 5);
                found.loose_curves += usize::from(drawn && model);
                continue;
            }
            if entry.kind == 402 {
                continue;
            }
            if entry.kind == 308 {
                self.file.note(
                    entity,
                    "subfigure-unplaced",
                    "a subfigure without an instance; displayed at its definition",
                );
            }
            let (path, style) = (Arc::default(), Style::default());
            let task = Task { entity, map, depth: 0, instance: 0, path, style };
            self.show(task, &owners, &mut found)?;
        }
        Ok(found)
    }

    /// Displays an entity and all it contains, iteratively.
    fn show(&self, task: Task, owners: &Ownership, found: &mut Found) -> Result<(), Fault> {
        let mut stack = vec![task];
        while let Some(task) = stack.pop() {
            let entity = task.entity;
            match self.step(task, owners, found, &mut stack) {
                Err(fault) if fault.code == "work-limit" => return Err(fault),
                Err(fault) => found.record_lost(self, entity, fault),
                Ok(()) => {}
            }
        }
        Ok(())
    }

    fn step(
        &self,
        task: Task,
        owners: &Ownership,
        found: &mut Found,
        stack: &mut Vec<Task>,
    ) -> Result<(), Fault> {
        let Task { entity, map, depth, .. } = task;
        let kind = self.file.entry(entity).kind;
        if depth > 2 * POINTER_DEPTH_MAX {
            let found = "subfigures or groups are cyclic or too deeply nested";
            let allowed = format!("at most {} levels", 2 * POINTER_DEPTH_MAX);
            return Err(self.file.fault(entity, "instance-depth", found, allowed));
        }
        match kind {
            144 => found.push_loose(self, &task, self.trimmed_surface(entity, &map)?)?,
            143 => found.push_loose(self, &task, self.bounded_surface(entity, &map)?)?,
            186 | 514 | 510 => self.show_brep(&task, found)?,
            308 | 402 => stack.extend(self.members_to_show(&task, owners)?),
            408 | 430 => {
                found.instances += 1;
                let (target, placed) = self.instance(entity, &map)?;
                if !owners.hidden[target] {
                    let names = [self.definition_name(target), self.name_of(entity)];
                    let below = task.below(target, placed, found.instances);
                    stack.push(below.within(&names, self.style(entity)));
                }
            }
            184 => self.show_assembly(&task, owners, found, stack)?,
            kind if SURFACES.contains(&kind) => {
                if let Some(face) = self.whole_surface(entity, &map)? {
                    found.push_loose(self, &task, face)?;
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Members of a subfigure definition (308) or group (402) to display, last one first.
    fn members_to_show(&self, task: &Task, owners: &Ownership) -> Result<Vec<Task>, Fault> {
        let Task { entity, map, instance, .. } = *task;
        let definition = self.file.entry(entity).kind == 308;
        let placed = if definition { self.placed(entity, &map)? } else { map };
        let mut members = if definition { self.definition(entity)? } else { self.group(entity)? };
        members.retain(|m| !owners.used[*m] && !owners.hidden[*m]);
        Ok(members.into_iter().rev().map(|m| task.below(m, placed, instance)).collect())
    }

    /// Pushes the items of an assembly (184) onto the stack, each as a separate instance.
    fn show_assembly(
        &self,
        task: &Task,
        owners: &Ownership,
        found: &mut Found,
        stack: &mut Vec<Task>,
    ) -> Result<(), Fault> {
        let placed = self.placed(task.entity, &task.map)?;
        let names = [self.name_of(task.entity)];
        for (item, own) in self.assembly(task.entity)? {
            if owners.hidden[item] {
                continue;
            }
            found.instances += 1;
            let below = task.below(item, placed.after(&own), found.instances);
            stack.push(below.within(&names, self.style(task.entity)));
        }
        Ok(())
    }

    /// An untrimmed surface as a face. Unbounded surfaces are no faces.
    fn whole_surface(&self, entity: usize, map: &Affine) -> Result<Option<RawFace>, Fault> {
        let entry = self.file.entry(entity);
        let boundary = if entry.kind == 108 { self.plane_boundary(entity)? } else { None };
        if let Some(boundary) = boundary {
            let basis = self.surface(entity, map, false)?;
            let pieces = self.pieces(boundary, map)?;
            let edges = super::edges::paired(
                pieces.into_iter().map(|p| p.curve).collect(),
                Vec::new(),
                false,
            );
            return self
                .raw_face(entity, basis, vec![edges], &[Some(true)], false, false)
                .map(Some);
        }
        if matches!(entry.kind, 108 | 190 | 192 | 194) {
            self.file.note(
                entity,
                "surface-unbounded",
                "an unbounded surface without trimming curves is no face",
            );
            return Ok(None);
        }
        let basis = self.surface(entity, map, true)?;
        self.raw_face(entity, basis, Vec::new(), &[], true, super::reader::mirrors(map)).map(Some)
    }

    /// The shells of a solid (186), a shell (514) or a face (510).
    fn shells_of(
        &self,
        entity: usize,
        map: Affine,
        found: &mut Found,
    ) -> Result<Vec<ShellFaces>, Fault> {
        if self.file.entry(entity).kind == 510 {
            return Ok(vec![(None, map, vec![(entity, true)])]);
        }
        let placed = self.placed(entity, &map)?;
        if self.file.entry(entity).kind == 514 {
            return Ok(vec![(Some(found.next_shell()), placed, self.shell(entity)?)]);
        }
        let mut shells = Vec::new();
        for shell in self.solid(entity)? {
            let faces = self.shell(shell.shell)?.into_iter();
            let faces = faces.map(|(f, along)| (f, along != shell.turned)).collect();
            let place = self.placed(shell.shell, &placed)?;
            shells.push((Some(found.next_shell()), place, faces));
        }
        Ok(shells)
    }

    /// Solids, shells and faces. Each unreadable face is skipped individually.
    fn show_brep(&self, task: &Task, found: &mut Found) -> Result<(), Fault> {
        let Task { entity, map, instance, .. } = *task;
        let task = task.clone().within(&[], self.style(entity));
        let shells = self.shells_of(task.entity, map, found)?;
        let body = found.body_of(self, &task);
        for (shell, map, faces) in shells {
            for (face, along) in faces {
                let ids = &mut found.edge_ids;
                let mut edge_id = |list: usize, number: usize| {
                    let next = ids.len();
                    *ids.entry((instance, list, number)).or_insert(next)
                };
                match self.brep_face(face, &map, !along, &mut edge_id) {
                    Ok(raw) => {
                        found.push(self, face, RawFace { shell, ..raw }, (body, &task.style))?;
                    }
                    Err(fault) if fault.code == "work-limit" => return Err(fault),
                    Err(fault) => found.record_lost(self, face, fault),
                }
            }
        }
        Ok(())
    }

    /// Name of a subfigure definition (308: DEPTH, NAME, ..), or of another entity.
    fn definition_name(&self, entity: usize) -> Option<Name> {
        if self.file.entry(entity).kind != 308 {
            return self.name_of(entity);
        }
        let mut p = self.file.params(entity).ok()?;
        p.skip();
        crate::attributes::name(&p.text())
    }

    /// Members of a subfigure definition (308): DEPTH, NAME, N, DE 1 .. DE N.
    pub(super) fn definition(&self, entity: usize) -> Result<Vec<usize>, Fault> {
        let mut p = self.file.params(entity)?;
        p.skip();
        p.skip();
        let count = p.count("number of members", 1)?;
        let members = (0..count).map(|_| p.pointer_or_none("member"));
        Ok(members.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
    }

    /// Members of a group (402, forms 1, 7, 14, 15): N, DE 1 .. DE N.
    pub(super) fn group(&self, entity: usize) -> Result<Vec<usize>, Fault> {
        if !matches!(self.file.entry(entity).form, 1 | 7 | 14 | 15) {
            return Ok(Vec::new());
        }
        let mut p = self.file.params(entity)?;
        let count = p.count("number of members", 1)?;
        let members = (0..count).map(|_| p.pointer_or_none("member"));
        Ok(members.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
    }

    /// Target and placement of an instance: 408 (subfigure DE, X, Y, Z, scale) or 430 (solid DE).
    pub(super) fn instance(&self, entity: usize, map: &Affine) -> Result<(usize, Affine), Fault> {
        let mut p = self.file.params(entity)?;
        let target = p.pointer("what is placed")?;
        let placed = self.placed(entity, map)?;
        if self.file.entry(entity).kind == 430 {
            return Ok((target, placed));
        }
        self.expect_kind(target, &[308], "a subfigure definition (308)")?;
        let shift = p.vec3("translation")?;
        let scale = p.real_or("scale", 1.0)?;
        if scale <= 0.0 {
            return Err(p.fault(format_args!("scale {scale}"), "a scale above 0"));
        }
        Ok((target, placed.after(&Affine { linear: Mat3::identity() * scale, shift })))
    }

    /// Solid assembly (184): N, N items, N matrices (0: none).
    pub(super) fn assembly(&self, entity: usize) -> Result<Vec<(usize, Affine)>, Fault> {
        let mut p = self.file.params(entity)?;
        let count = p.count("number of items", 1)?;
        let items = (0..count).map(|_| p.pointer("item")).collect::<Result<Vec<_>, _>>()?;
        let mut out = Vec::with_capacity(count);
        for item in items {
            let matrix = p.pointer_or_none("matrix")?;
            out.push((item, matrix.map_or(Ok(Affine::identity()), |m| self.matrix(m))?));
        }
        Ok(out)
    }
}
