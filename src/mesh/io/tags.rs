//! Map from the tags that a file gives its nodes or elements to indices in file order.

use std::collections::HashMap;

/// Tags below this value, or below a multiple of the number of known tags, are stored in a table; files usually number
/// without gaps.
const TABLE_SIZE_MIN: u64 = 1024;
const TABLE_GROWTH: u64 = 4;
/// An empty table entry.
const EMPTY: u32 = u32::MAX;

/// Indices by tag.
#[derive(Default)]
pub(super) struct Tags {
    table: Vec<u32>,
    others: HashMap<u64, u32>,
    known: u64,
}

impl Tags {
    /// Registers the index of `tag`; returns the index registered before, if any.
    pub(super) fn insert(&mut self, tag: u64, place: u32) -> Option<u32> {
        let before = self.get(tag);
        if before.is_some() {
            return before;
        }
        self.known += 1;
        if tag < TABLE_SIZE_MIN + TABLE_GROWTH * self.known {
            let index = tag as usize;
            if index >= self.table.len() {
                self.table.resize(index + 1, EMPTY);
            }
            self.table[index] = place;
        } else {
            self.others.insert(tag, place);
        }
        None
    }

    /// Index of `tag`.
    pub(super) fn get(&self, tag: u64) -> Option<u32> {
        let in_table = usize::try_from(tag).ok().and_then(|index| self.table.get(index));
        let in_table = in_table.copied().filter(|place| *place != EMPTY);
        in_table.or_else(|| self.others.get(&tag).copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_are_found_whether_they_have_gaps_or_not() {
        let mut tags = Tags::default();
        // 5000 is far from the first tags, and within the range of the table later.
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
