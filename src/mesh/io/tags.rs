//! Numbers that a file gives its nodes or elements, and which of them in its order each one is.

use std::collections::HashMap;

/// Numbers below this, or below so many times those known, are looked up in a table; files number without gaps as a rule.
const TABLE_LEAST: u64 = 1024;
const TABLE_TIMES: u64 = 4;
/// A place of the table without a number.
const NONE: u32 = u32::MAX;

/// Places by number.
#[derive(Default)]
pub(super) struct Tags {
    table: Vec<u32>,
    others: HashMap<u64, u32>,
    known: u64,
}

impl Tags {
    /// Notes that `tag` is at a place; the place where it was noted before, if it was.
    pub(super) fn insert(&mut self, tag: u64, place: u32) -> Option<u32> {
        let before = self.get(tag);
        if before.is_some() {
            return before;
        }
        self.known += 1;
        if tag < TABLE_LEAST + TABLE_TIMES * self.known {
            let index = tag as usize;
            if index >= self.table.len() {
                self.table.resize(index + 1, NONE);
            }
            self.table[index] = place;
        } else {
            self.others.insert(tag, place);
        }
        None
    }

    /// The place of `tag`.
    pub(super) fn get(&self, tag: u64) -> Option<u32> {
        let in_table = usize::try_from(tag).ok().and_then(|index| self.table.get(index));
        let in_table = in_table.copied().filter(|place| *place != NONE);
        in_table.or_else(|| self.others.get(&tag).copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_are_found_whether_they_have_gaps_or_not() {
        let mut tags = Tags::default();
        // 5000 is far from the first numbers, and within the table's reach later.
        let all = [5000, 1, 2, u64::MAX, 1 << 40, 1023].into_iter().chain(10_000..30_000);
        let all: Vec<u64> = all.collect();
        for (place, tag) in all.iter().enumerate() {
            assert_eq!(tags.insert(*tag, place as u32), None, "{tag}");
        }
        for (place, tag) in all.iter().enumerate() {
            assert_eq!(tags.get(*tag), Some(place as u32), "{tag}");
            assert_eq!(tags.insert(*tag, 7), Some(place as u32), "{tag}");
        }
        assert_eq!([0, 3, 9_999, 30_000, 1 << 41].map(|tag| tags.get(tag)), [None; 5]);
        assert!(tags.table.len() < 120_000);
    }
}
