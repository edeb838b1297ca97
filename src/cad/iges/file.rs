//! The file: entities, their parameters, locations for messages, the work budget.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;

use super::cards::{self, Cards};
use super::directory::{self, Directory, Entry};
use super::global::{self, Global};
use crate::raw::max_sides;
use crate::{Diagnostic, Severity};

/// Parameters that may be read beyond eight times the file, for instances and shared entities. Doubled: twice the
/// longest time of a file with self-multiplying pointers.
const PARAMETER_BUDGET: usize = 12_000_000;
/// Cost of a curve or face, in parameters.
pub(super) const PIECE_COST: usize = 32;

/// The reason why an entity cannot be used. The entity is skipped and the fault becomes a diagnostic.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fault {
    /// Stable code.
    pub code: &'static str,
    /// Line, entry and entity.
    pub place: String,
    /// What was found.
    pub found: String,
    /// What is allowed.
    pub allowed: String,
}

/// A readable IGES file.
pub(super) struct File<'a> {
    /// Global section.
    pub global: Global,
    /// Directory section.
    pub directory: Directory,
    cards: Cards<'a>,
    /// Remaining work budget, in parameters: bounds the cost of following pointers.
    budget: Cell<usize>,
    /// Length of the file [bytes].
    bytes: usize,
    log: RefCell<Log>,
}

#[derive(Default)]
struct Log {
    /// By code and entity type: number of occurrences, and the first one.
    seen: BTreeMap<(&'static str, u32), (usize, Diagnostic)>,
}

impl<'a> File<'a> {
    /// Sorts cards and reads the global section and the directory.
    pub fn open(bytes: &'a [u8]) -> Self {
        let cards = cards::split(bytes);
        let global = global::parse(&cards.global);
        let directory = directory::parse(&cards, global.delimiters);
        let budget = Cell::new(PARAMETER_BUDGET + 8 * cards.parameters.len());
        Self { global, directory, cards, budget, bytes: bytes.len(), log: RefCell::default() }
    }

    /// The cards, for checks of the whole file.
    pub fn cards(&self) -> &Cards<'a> {
        &self.cards
    }

    /// Number of entities.
    pub fn len(&self) -> usize {
        self.directory.entries.len()
    }

    /// The entry with this index.
    pub fn entry(&self, entity: usize) -> &Entry {
        &self.directory.entries[entity]
    }

    /// `line 12 (D7, entity 128)`, at the byte `offset` of the parameter text where known.
    pub fn place(&self, entity: usize, offset: Option<usize>) -> String {
        let entry = self.entry(entity);
        let cards = &self.cards.parameter_cards;
        let card = match offset {
            Some(at) => cards.partition_point(|c| c.offset <= at).checked_sub(1),
            None => (!entry.cards.is_empty()).then_some(entry.cards.start),
        };
        let line = card.and_then(|c| cards.get(c)).map_or(entry.line, |c| c.line);
        format!("line {line} (D{}, entity {})", entry.pointer, entry.kind)
    }

    /// A fault of an entity.
    pub fn fault(
        &self,
        entity: usize,
        code: &'static str,
        found: impl Into<String>,
        allowed: impl Into<String>,
    ) -> Fault {
        Fault {
            code,
            place: self.place(entity, None),
            found: found.into(),
            allowed: allowed.into(),
        }
    }

    /// Consumes `work` of the budget.
    ///
    /// # Errors
    /// A fault with the code `work-limit` when the budget is exhausted; it remains exhausted.
    pub fn charge(&self, entity: usize, work: usize) -> Result<(), Fault> {
        let left = self.budget.get().checked_sub(work);
        self.budget.set(left.unwrap_or(0));
        left.map(|_| ()).ok_or_else(|| {
            self.fault(
                entity,
                "work-limit",
                "pointers refer to the same entities repeatedly",
                format!(
                    "at most {PARAMETER_BUDGET} parameters read again, beyond eight times the file"
                ),
            )
        })
    }

    /// Checks the total number of sides of all faces against the limit for a file of this size.
    ///
    /// # Errors
    /// A fault with the code `work-limit`.
    pub fn allow_sides(&self, entity: usize, sides: usize) -> Result<(), Fault> {
        let limit = max_sides(self.bytes);
        if sides <= limit {
            return Ok(());
        }
        Err(self.fault(
            entity,
            "work-limit",
            "pointers refer to the same faces repeatedly",
            format!("faces of at most {limit} sides in all in a file of {} bytes", self.bytes),
        ))
    }

    /// True when the work budget is exhausted.
    pub fn is_exhausted(&self) -> bool {
        self.budget.get() == 0
    }

    /// Records a note on an entity. Notes of one kind on one entity type are counted and the first is quoted.
    pub fn note(&self, entity: usize, code: &'static str, text: &str) {
        self.record(entity, Severity::Note, code, text);
    }

    /// Records a warning on an entity.
    pub fn warn(&self, entity: usize, code: &'static str, text: &str) {
        self.record(entity, Severity::Warning, code, text);
    }

    fn record(&self, entity: usize, severity: Severity, code: &'static str, text: &str) {
        let kind = self.entry(entity).kind;
        let mut log = self.log.borrow_mut();
        let slot = log.seen.entry((code, kind)).or_insert_with(|| {
            let place = self.place(entity, None);
            (0, Diagnostic { severity, code, place, text: text.to_owned() })
        });
        slot.0 += 1;
    }

    /// Records the fault of a skipped entity.
    pub fn skip(&self, entity: usize, fault: &Fault) {
        let text = format!("{}; allowed: {}; skipped", fault.found, fault.allowed);
        let kind = self.entry(entity).kind;
        let mut log = self.log.borrow_mut();
        let slot = log.seen.entry((fault.code, kind)).or_insert_with(|| {
            let place = fault.place.clone();
            (0, Diagnostic { severity: Severity::Warning, code: fault.code, place, text })
        });
        slot.0 += 1;
    }

    /// All messages, each kind once with its number of occurrences.
    pub fn diagnostics(&self) -> Vec<Diagnostic> {
        let log = self.log.borrow();
        log.seen
            .values()
            .map(|(count, first)| {
                let mut out = first.clone();
                if *count > 1 {
                    out.text = format!("{} ({count} times, the first quoted)", out.text);
                }
                out
            })
            .collect()
    }
}
