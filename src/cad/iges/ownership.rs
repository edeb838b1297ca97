//! Dependencies between entities, so that each is displayed once.

use super::file::Fault;
use super::params::Params;
use super::reader::Reader;
use kanagata_geometry::Affine;

/// Dependencies between entities.
pub(super) struct Ownership {
    /// Geometry of another entity.
    pub used: Vec<bool>,
    /// Members of a subfigure definition.
    pub defined: Vec<bool>,
    /// Definitions and solids placed by an instance.
    pub placed: Vec<bool>,
    /// Surfaces referenced by a curve on a surface (141, 142), which does not make them part of a face.
    pub carries: Vec<bool>,
    /// Excluded from the product by status.
    pub hidden: Vec<bool>,
}

impl Reader<'_, '_> {
    /// Finds the dependencies between entities. Faulty entities have none here; they are reported when displayed.
    pub(super) fn ownership(&self) -> Result<Ownership, Fault> {
        let n = self.file.len();
        let none = || vec![false; n];
        let mut owners = Ownership {
            used: none(),
            defined: none(),
            placed: none(),
            carries: none(),
            hidden: none(),
        };
        let mut definitions = Vec::new();
        for entity in 0..n {
            let kind = self.file.entry(entity).kind;
            match kind {
                308 => definitions.push(entity),
                408 | 430 | 184 => self.mark_placed(entity, &mut owners.placed),
                _ => {
                    self.references(entity, &mut owners.used);
                    if let (141 | 142, Some(surface)) = (kind, self.carrier(entity)) {
                        owners.carries[surface] = true;
                    }
                }
            }
        }
        self.mark_defined(definitions, &mut owners.defined);
        if self.file.is_exhausted() {
            return Err(self.file.fault(
                0,
                "work-limit",
                "too many pointers",
                "a file of bounded size",
            ));
        }
        Ok(owners)
    }

    /// Marks the targets of an instance (408, 430) or an assembly (184).
    fn mark_placed(&self, entity: usize, placed: &mut [bool]) {
        let mut targets = Vec::new();
        if self.file.entry(entity).kind == 184 {
            targets = self.assembly(entity).unwrap_or_default().into_iter().map(|i| i.0).collect();
        } else if let Ok((target, _)) = self.instance(entity, &Affine::identity()) {
            targets.push(target);
        }
        targets.into_iter().filter(|t| *t != entity).for_each(|t| placed[t] = true);
    }

    /// Marks the members of definitions, including those of groups.
    fn mark_defined(&self, definitions: Vec<usize>, defined: &mut [bool]) {
        let mut stack: Vec<usize> = Vec::new();
        for definition in definitions {
            stack.extend(
                self.definition(definition)
                    .unwrap_or_default()
                    .into_iter()
                    .filter(|m| *m != definition),
            );
        }
        while let Some(member) = stack.pop() {
            if defined[member] {
                continue;
            }
            defined[member] = true;
            if self.file.entry(member).kind == 402 {
                stack.extend(self.group(member).unwrap_or_default());
            }
        }
    }

    /// The surface of a boundary (141: TYPE, PREF, surface) or of a curve on a surface (142: CRTN, surface).
    fn carrier(&self, entity: usize) -> Option<usize> {
        let mut p = self.file.params(entity).ok()?;
        let before = if self.file.entry(entity).kind == 141 { 2 } else { 1 };
        (0..before).for_each(|_| p.skip());
        p.pointer_or_none("surface").ok().flatten()
    }

    /// Marks the entities referenced by an entity's geometry.
    fn references(&self, entity: usize, used: &mut [bool]) {
        let kind = self.file.entry(entity).kind;
        // Displaying entities are not owners; forms without reference directions have fewer pointers.
        let other = matches!(kind, 184 | 190..=198 | 308 | 402 | 408 | 430);
        let pattern = POINTERS.iter().find(|p| p.0 == kind && !other);
        if let (Some((_, pattern)), Ok(mut p)) = (pattern, self.file.params(entity)) {
            let mut mark = |target: usize| used[target] |= target != entity;
            let _ = follow(&mut p, pattern, &mut mark);
        }
    }
}

use Field::{Count, Each, Inner, Pointer, Skip};

/// Positions of the pointers in the records of each entity type.
pub(super) const POINTERS: [(u32, &[Field]); 26] = [
    (102, &[Count, Each(&[Pointer])]),
    (108, &[Skip, Skip, Skip, Skip, Pointer]),
    (118, &[Pointer, Pointer]),
    (120, &[Pointer, Pointer]),
    (122, &[Pointer]),
    (130, &[Pointer, Skip, Pointer]),
    (140, &[Skip, Skip, Skip, Skip, Pointer]),
    // 141 and 142 refer to a surface without making it part of a face
    (141, &[Skip, Skip, Skip, Count, Each(&[Pointer, Skip, Inner(&[Pointer])])]),
    (142, &[Skip, Skip, Pointer, Pointer]),
    (143, &[Skip, Pointer, Count, Each(&[Pointer])]),
    (144, &[Pointer, Skip, Count, Pointer, Each(&[Pointer])]),
    (184, &[Count, Each(&[Pointer]), Each(&[Pointer])]),
    (186, &[Pointer, Skip, Count, Each(&[Pointer, Skip])]),
    (190, &[Pointer, Pointer, Pointer]),
    (192, &[Pointer, Pointer, Skip, Pointer]),
    (194, &[Pointer, Pointer, Skip, Skip, Pointer]),
    (196, &[Pointer, Skip, Pointer, Pointer]),
    (198, &[Pointer, Pointer, Skip, Skip, Pointer]),
    (308, &[Skip, Skip, Count, Each(&[Pointer])]),
    (402, &[Count, Each(&[Pointer])]),
    (408, &[Pointer]),
    (430, &[Pointer]),
    (504, &[Count, Each(&[Pointer, Skip, Skip, Skip, Skip])]),
    (508, &[Count, Each(&[Skip, Skip, Skip, Skip, Inner(&[Skip, Pointer])])]),
    (510, &[Pointer, Count, Skip, Each(&[Pointer])]),
    (514, &[Count, Each(&[Pointer, Skip])]),
];

/// Layout of the pointers in a record.
pub(super) enum Field {
    /// Any other field.
    Skip,
    /// A pointer.
    Pointer,
    /// Repeat count of `Each`.
    Count,
    /// Fields repeated `Count` times.
    Each(&'static [Field]),
    /// A count and its repeated fields.
    Inner(&'static [Field]),
}

fn follow(
    p: &mut Params<'_, '_>,
    pattern: &[Field],
    mark: &mut dyn FnMut(usize),
) -> Result<(), Fault> {
    let mut count = 0;
    for field in pattern {
        match field {
            Skip => p.skip(),
            Pointer => p.pointer_or_none("pointer")?.into_iter().for_each(&mut *mark),
            Count => count = p.count("count", 1)?,
            Each(fields) => {
                for _ in 0..count {
                    follow(p, fields, mark)?;
                }
            }
            Inner(fields) => {
                for _ in 0..p.count("count", 1)? {
                    follow(p, fields, mark)?;
                }
            }
        }
    }
    Ok(())
}
