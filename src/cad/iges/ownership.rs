//! Which entities belong to others, so that each is shown once.

use super::file::Fault;
use super::params::Params;
use super::reader::Reader;
use crate::geometry::Affine;

/// Which entities belong to others.
pub(super) struct Ownership {
    /// Geometry of another entity.
    pub used: Vec<bool>,
    /// Members of a subfigure definition.
    pub defined: Vec<bool>,
    /// Definitions and solids that an instance places.
    pub placed: Vec<bool>,
}

impl Reader<'_, '_> {
    /// Finds out which entities belong to others. Faulty entities own nothing here; they are reported when shown.
    pub(super) fn ownership(&self) -> Result<Ownership, Fault> {
        let n = self.file.len();
        let mut owners =
            Ownership { used: vec![false; n], defined: vec![false; n], placed: vec![false; n] };
        let mut definitions = Vec::new();
        for entity in 0..n {
            let kind = self.file.entry(entity).kind;
            match kind {
                308 => definitions.push(entity),
                408 | 430 | 184 => {
                    let mut targets = Vec::new();
                    if kind == 184 {
                        targets = self
                            .assembly(entity)
                            .unwrap_or_default()
                            .into_iter()
                            .map(|i| i.0)
                            .collect();
                    } else if let Ok((target, _)) = self.instance(entity, &Affine::identity()) {
                        targets.push(target);
                    }
                    targets
                        .into_iter()
                        .filter(|t| *t != entity)
                        .for_each(|t| owners.placed[t] = true);
                }
                _ => self.references(entity, &mut owners.used),
            }
        }
        self.mark_defined(definitions, &mut owners.defined);
        if self.file.exhausted() {
            return Err(self.file.fault(
                0,
                "work-limit",
                "too many pointers",
                "a file of bounded size",
            ));
        }
        Ok(owners)
    }

    /// Marks the members of definitions, through groups.
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

    /// Marks what an entity's geometry is made of.
    fn references(&self, entity: usize, used: &mut [bool]) {
        let kind = self.file.entry(entity).kind;
        let pattern: &[Field] = match kind {
            102 => &[Field::Count, Field::Each(&[Field::Pointer])],
            108 => &[Field::Skip, Field::Skip, Field::Skip, Field::Skip, Field::Pointer],
            118 | 120 => &[Field::Pointer, Field::Pointer],
            122 => &[Field::Pointer],
            130 => &[Field::Pointer, Field::Skip, Field::Pointer],
            140 => &[Field::Skip, Field::Skip, Field::Skip, Field::Skip, Field::Pointer],
            // 141 and 142 lie on a surface without making it part of a face
            141 => &[
                Field::Skip,
                Field::Skip,
                Field::Skip,
                Field::Count,
                Field::Each(&[Field::Pointer, Field::Skip, Field::Inner(&[Field::Pointer])]),
            ],
            142 => &[Field::Skip, Field::Skip, Field::Pointer, Field::Pointer],
            143 => &[Field::Skip, Field::Pointer, Field::Count, Field::Each(&[Field::Pointer])],
            144 => &[
                Field::Pointer,
                Field::Skip,
                Field::Count,
                Field::Pointer,
                Field::Each(&[Field::Pointer]),
            ],
            186 => &[
                Field::Pointer,
                Field::Skip,
                Field::Count,
                Field::Each(&[Field::Pointer, Field::Skip]),
            ],
            504 => &[
                Field::Count,
                Field::Each(&[Field::Pointer, Field::Skip, Field::Skip, Field::Skip, Field::Skip]),
            ],
            508 => &[
                Field::Count,
                Field::Each(&[
                    Field::Skip,
                    Field::Skip,
                    Field::Skip,
                    Field::Skip,
                    Field::Inner(&[Field::Skip, Field::Pointer]),
                ]),
            ],
            510 => &[Field::Pointer, Field::Count, Field::Skip, Field::Each(&[Field::Pointer])],
            514 => &[Field::Count, Field::Each(&[Field::Pointer, Field::Skip])],
            _ => return,
        };
        if let Ok(mut p) = self.file.params(entity) {
            let mut mark = |target: usize| used[target] |= target != entity;
            let _ = follow(&mut p, pattern, &mut mark);
        }
    }
}

/// How pointers lie in a record.
enum Field {
    /// Anything else.
    Skip,
    /// A pointer.
    Pointer,
    /// How often `Each` repeats.
    Count,
    /// Fields repeated `Count` times.
    Each(&'static [Field]),
    /// A count and its fields, repeated that often.
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
            Field::Skip => p.skip(),
            Field::Pointer => p.pointer_or_none("pointer")?.into_iter().for_each(&mut *mark),
            Field::Count => count = p.count("count", 1)?,
            Field::Each(fields) => {
                for _ in 0..count {
                    follow(p, fields, mark)?;
                }
            }
            Field::Inner(fields) => {
                for _ in 0..p.count("count", 1)? {
                    follow(p, fields, mark)?;
                }
            }
        }
    }
    Ok(())
}
