//! Entities excluded from the product by the status of their directory entries (IGES 5.3, section 2.2.4.4.9).
//!
//! - digits 1-2, blank status: 01 is not displayed;
//! - digits 3-4, subordinate entity switch: 01 and 03 depend physically on another entity and do not exist without it;
//! - digits 5-6, entity use: 01 annotation, 04 logical or positional, 05 parametric in two dimensions, 06 construction;
//! - digits 7-8, hierarchy: under 00 the blank status applies to all dependent entities, under 01 it does not.

use super::ownership::Ownership;
use super::reader::Reader;
use super::surface::SURFACES;

/// Reason for excluding an entity.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Exclusion {
    Blanked,
    Dependent,
    NoGeometry,
}

impl Exclusion {
    fn code_and_text(self) -> (&'static str, &'static str) {
        match self {
            Self::Blanked => ("entity-blanked", "blanked (status digits 1-2): omitted"),
            Self::Dependent => (
                "entity-dependent",
                "physically dependent on a curve that lies on it (status digits 3-4), part of no face: omitted",
            ),
            Self::NoGeometry => (
                "entity-not-geometry",
                "annotation, reference or construction by its entity use (status digits 5-6): omitted",
            ),
        }
    }
}

impl Reader<'_, '_> {
    /// Marks faces, and entities that contain faces, excluded by status. If no face remains, the status is ignored with
    /// a warning.
    pub(super) fn apply_status(&self, owners: &mut Ownership) {
        let shown = |e: &usize| self.shows_faces(*e) && !owners.used[*e];
        let shown: Vec<usize> = (0..self.file.len()).filter(shown).collect();
        let exclusion: Vec<(usize, Exclusion)> =
            shown.iter().filter_map(|&e| Some((e, self.exclusion(e, owners)?))).collect();
        exclusion.iter().for_each(|(entity, _)| owners.hidden[*entity] = true);
        for &(entity, why) in exclusion.iter().filter(|a| a.1 == Exclusion::Blanked) {
            if self.file.entry(entity).status[3] == 0 {
                self.hide_below(entity, owners);
            }
            debug_assert!(why == Exclusion::Blanked);
        }
        let is_face =
            |e: &&usize| !matches!(self.file.entry(**e).kind, 184 | 308 | 402 | 408 | 430);
        if !exclusion.is_empty() && shown.iter().filter(is_face).all(|&e| owners.hidden[e]) {
            owners.hidden.iter_mut().for_each(|h| *h = false);
            self.file.warn(
                exclusion[0].0,
                "status-passed-over",
                "by their status (blanked, dependent or construction) no face of the file is part of the product: all are used",
            );
            return;
        }
        for (entity, why) in exclusion {
            let (code, text) = why.code_and_text();
            self.file.warn(entity, code, text);
        }
    }

    /// True for a face, a solid or shell, or an entity that contains or places such.
    fn shows_faces(&self, entity: usize) -> bool {
        let kind = self.file.entry(entity).kind;
        SURFACES.contains(&kind)
            || matches!(kind, 143 | 144 | 184 | 186 | 308 | 402 | 408 | 430 | 510 | 514)
    }

    fn exclusion(&self, entity: usize, owners: &Ownership) -> Option<Exclusion> {
        let entry = self.file.entry(entity);
        let [blank, subordinate, entity_use, _] = entry.status;
        let is_surface = SURFACES.contains(&entry.kind);
        if blank == 1 {
            Some(Exclusion::Blanked)
        } else if is_surface && matches!(subordinate, 1 | 3) && owners.carries[entity] {
            Some(Exclusion::Dependent)
        } else if matches!(entity_use, 1 | 4 | 5 | 6) && entry.kind != 402 {
            Some(Exclusion::NoGeometry)
        } else {
            None
        }
    }

    /// Hides the members of a group or subfigure, recursively.
    fn hide_below(&self, entity: usize, owners: &mut Ownership) {
        let members = |e: usize| match self.file.entry(e).kind {
            308 => self.definition(e).unwrap_or_default(),
            402 => self.group(e).unwrap_or_default(),
            _ => Vec::new(),
        };
        let mut stack = members(entity);
        let mut seen = vec![false; self.file.len()];
        while let Some(member) = stack.pop() {
            if !std::mem::replace(&mut seen[member], true) {
                owners.hidden[member] = true;
                stack.extend(members(member));
            }
        }
    }
}
