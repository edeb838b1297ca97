//! The file as a whole: entries, their parameters, places for messages, the budget of work.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;

use super::cards::{self, Cards};
use super::directory::{self, Directory, Entry};
use super::global::{self, Global};
use crate::cad::raw::most_sides;
use crate::cad::{Diagnostic, Severity};

/// Parameters that may be read beyond eight times the file: what instances and shared entities may repeat.
const BUDGET: usize = 12_000_000;
/// What a curve or a face costs, in parameters.
pub(super) const PIECE: usize = 32;

/// Why an entity could not be used. Faults skip what they belong to and become diagnostics.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fault {
    /// Stable name of the kind.
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
    /// Parameters that may still be read: following pointers cannot cost more than this.
    budget: Cell<usize>,
    /// Length of the file [bytes].
    bytes: usize,
    log: RefCell<Log>,
}

#[derive(Default)]
struct Log {
    /// By code and entity type: how often, and the first.
    seen: BTreeMap<(&'static str, u32), (usize, Diagnostic)>,
}

impl<'a> File<'a> {
    /// Sorts cards and reads the global section and the directory.
    pub fn open(bytes: &'a [u8]) -> Self {
        let cards = cards::split(bytes);
        let global = global::parse(&cards.global);
        let directory = directory::parse(&cards, global.delimiters);
        let budget = Cell::new(BUDGET + 8 * cards.parameters.len());
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

    /// `line 12 (D7, entity 128)`, at the byte `offset` of the parameter text where it is known.
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

    /// Spends some of the budget of work.
    ///
    /// # Errors
    /// A fault with the code `work-limit` when it is spent; it stays spent.
    pub fn charge(&self, entity: usize, work: usize) -> Result<(), Fault> {
        let left = self.budget.get().checked_sub(work);
        self.budget.set(left.unwrap_or(0));
        left.map(|_| ()).ok_or_else(|| {
            self.fault(
                entity,
                "work-limit",
                "pointers lead to the same entities again and again",
                format!("at most {BUDGET} parameters read again, beyond eight times the file"),
            )
        })
    }

    /// Fails when faces of `sides` sides in all are more than a file of this size may have.
    ///
    /// # Errors
    /// A fault with the code `work-limit`.
    pub fn allow_sides(&self, entity: usize, sides: usize) -> Result<(), Fault> {
        let most = most_sides(self.bytes);
        if sides <= most {
            return Ok(());
        }
        Err(self.fault(
            entity,
            "work-limit",
            "pointers lead to the same faces again and again",
            format!("faces of at most {most} sides in all in a file of {} bytes", self.bytes),
        ))
    }

    /// True when the budget of work is spent.
    pub fn exhausted(&self) -> bool {
        self.budget.get() == 0
    }

    /// Records a remark on an entity; remarks of one kind on one type are counted, the first is quoted.
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

    /// Records a fault that made `entity` be skipped.
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

    /// All remarks, each kind once, with how often it was met.
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
