//! Directory entries: two cards of ten eight-column fields for each entity.

use super::cards::{Card, Cards, number};
use super::token::{self, Delimiters, Token};

/// One directory entry.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Entry {
    /// Entity type number.
    pub kind: u32,
    /// Form number.
    pub form: i32,
    /// Sequence number, the value of pointers to it.
    pub pointer: u32,
    /// Level number, or the negated pointer to a list of levels (406 form 1); 0 for none.
    pub level: i32,
    /// Number of a basic colour, or the negated pointer to a colour (314); 0 for none.
    pub colour: i32,
    /// Label and subscript, empty for none.
    pub label: String,
    /// Transformation matrix (a pointer), 0 for none.
    pub transform: u32,
    /// Status: visibility, subordination, use, hierarchy.
    pub status: [u8; 4],
    /// Its parameter cards, as a range of `Cards::parameter_cards`; empty when not found.
    pub cards: std::ops::Range<usize>,
    /// Line in the file, from 1.
    pub line: usize,
}

/// All directory entries, and the resolution of pointers.
#[derive(Debug, Default)]
pub(super) struct Directory {
    /// Entries in file order.
    pub entries: Vec<Entry>,
    /// Sequence numbers are 1, 3, 5, ... or unreliable: pointer = 2 index + 1.
    by_position: bool,
    /// Number of entries whose parameter cards were not at their pointer.
    pub relocated: usize,
    /// The sequence numbers are unreliable.
    pub renumbered: bool,
    /// Number of unpaired directory cards.
    pub unpaired: usize,
}

impl Directory {
    /// Index of the entry with this pointer.
    pub fn find(&self, pointer: i64) -> Option<usize> {
        let pointer = u32::try_from(pointer.unsigned_abs()).ok()?;
        if self.by_position {
            let index = (pointer.checked_sub(1)? / 2) as usize;
            return (pointer % 2 == 1 && index < self.entries.len()).then_some(index);
        }
        self.entries.binary_search_by_key(&pointer, |e| e.pointer).ok()
    }
}

/// Reads the directory and locates the parameter cards of each entry.
pub(super) fn parse(cards: &Cards<'_>, delimiters: Delimiters) -> Directory {
    let mut directory = Directory::default();
    let mut at = 0;
    let mut starts = Vec::new();
    while let [first, second, ..] = &cards.directory[at.min(cards.directory.len())..] {
        if field(first, 0) != field(second, 0) && paired_later(&cards.directory[at..]) {
            directory.unpaired += 1;
            at += 1;
            continue;
        }
        directory.entries.push(entry(first, second));
        starts.push(number_of(first, 1).unsigned_abs());
        at += 2;
    }
    directory.unpaired += cards.directory.len() - at;
    number_entries(&mut directory);
    locate(&mut directory, cards, &starts, delimiters);
    directory
}

/// True when a card is missing: the next pair is consistent, this one is not.
fn paired_later(cards: &[Card<'_>]) -> bool {
    matches!(cards, [_, a, b, ..] if number_of(a, 0) > 0 && field(a, 0) == field(b, 0))
}

fn field<'a>(card: &Card<'a>, index: usize) -> &'a [u8] {
    let end = card.text.len().min(8 * index + 8);
    card.text.get(8 * index..end).unwrap_or_default().trim_ascii()
}

fn number_of(card: &Card<'_>, index: usize) -> i32 {
    std::str::from_utf8(field(card, index)).ok().and_then(|t| t.parse().ok()).unwrap_or(0)
}

fn entry(first: &Card<'_>, second: &Card<'_>) -> Entry {
    let kind = u32::try_from(number_of(first, 0)).unwrap_or(0);
    let status = first.text.get(64..72.min(first.text.len())).unwrap_or_default();
    let pair = |i: usize| {
        let end = status.len().min(2 * i + 2);
        u8::try_from(number(status.get(2 * i..end).unwrap_or_default())).unwrap_or(0)
    };
    Entry {
        kind,
        form: number_of(second, 4),
        pointer: first.sequence,
        level: number_of(first, 4),
        colour: number_of(second, 2),
        label: label(second),
        transform: number_of(first, 6).unsigned_abs(),
        status: [pair(0), pair(1), pair(2), pair(3)],
        cards: 0..0,
        line: first.line,
    }
}

/// Label of an entity, with its subscript behind a dot.
fn label(second: &Card<'_>) -> String {
    let label = String::from_utf8_lossy(field(second, 7));
    match number_of(second, 8) {
        subscript if subscript > 0 && !label.is_empty() => format!("{label}.{subscript}"),
        _ => label.into_owned(),
    }
}

/// Decides whether the sequence numbers are reliable: increasing and odd.
fn number_entries(directory: &mut Directory) {
    let entries = &mut directory.entries;
    let counted = entries.iter().zip(0u32..).all(|(e, i)| e.pointer == 2 * i + 1);
    let rising = entries.windows(2).all(|w| w[0].pointer < w[1].pointer)
        && entries.iter().all(|e| e.pointer % 2 == 1);
    directory.by_position = counted || !rising;
    directory.renumbered = !counted;
    if directory.by_position {
        for (entry, i) in entries.iter_mut().zip(0u32..) {
            entry.pointer = 2 * i + 1;
        }
    }
}

/// Assigns to each entry the cards from its first parameter card to that of the next entry.
fn locate(directory: &mut Directory, cards: &Cards<'_>, starts: &[u32], delimiters: Delimiters) {
    let tail = &cards.parameter_cards;
    let rising = tail.windows(2).all(|w| w[0].sequence < w[1].sequence || w[1].sequence == 0);
    let begins_with = |card: usize, kind: u32| {
        tail.get(card).is_some_and(|c| {
            let end = cards.parameters.len().min(c.offset + 80);
            let found = token::token(&cards.parameters[c.offset..end], delimiters).1;
            matches!(found, Token::Word(w) if token::integer(w) == Some(i64::from(kind)))
        })
    };
    let mut backs: Vec<(u32, usize)> = tail.iter().enumerate().map(|(i, c)| (c.back, i)).collect();
    backs.sort_unstable();
    let mut firsts = vec![None; directory.entries.len()];
    for ((entry, start), first) in directory.entries.iter().zip(starts).zip(&mut firsts) {
        let by_number =
            rising.then(|| tail.binary_search_by_key(start, |c| c.sequence).ok()).flatten();
        let by_place = (*start as usize).checked_sub(1);
        let candidate = by_number.or(by_place);
        if candidate.is_some_and(|card| begins_with(card, entry.kind)) {
            *first = candidate;
            continue;
        }
        let at = backs.partition_point(|(back, _)| *back < entry.pointer);
        let by_back =
            backs.get(at).filter(|(back, _)| *back == entry.pointer).map(|(_, card)| *card);
        *first = by_place
            .filter(|c| begins_with(*c, entry.kind))
            .or(by_back.filter(|c| begins_with(*c, entry.kind)));
        directory.relocated += usize::from(first.is_some());
    }
    let mut order: Vec<usize> = firsts.iter().flatten().copied().collect();
    order.sort_unstable();
    for (entry, first) in directory.entries.iter_mut().zip(firsts) {
        if let Some(first) = first {
            let next = order.partition_point(|c| *c <= first);
            entry.cards = first..order.get(next).copied().unwrap_or(tail.len());
        }
    }
}
