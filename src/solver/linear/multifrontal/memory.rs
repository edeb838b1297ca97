//! The memory of the factors: a hundred megabytes that every solve walks through.
//!
//! It comes from the system in large pages where there are such. With pages of 4 kB the processor looks up as many
//! addresses as it reads cache lines of a front's columns; a solve takes a sixth longer.

use memmap2::MmapMut;

/// Numbers that begin on a cache line, all zero at first.
#[derive(Debug, Default)]
pub(super) struct Memory {
    place: Place,
    len: usize,
}

#[derive(Debug)]
enum Place {
    /// From the system.
    Mapped(MmapMut),
    /// From the allocator, where the system gives none: from this number on.
    Owned(Vec<f64>, usize),
}

impl Default for Place {
    fn default() -> Self {
        Self::Owned(Vec::new(), 0)
    }
}

/// Numbers worth a large page [bytes].
const LARGE: usize = 1 << 21;

impl Place {
    fn new(len: usize) -> Self {
        let bytes = len * size_of::<f64>();
        if bytes >= LARGE
            && let Ok(mapped) = MmapMut::map_anon(bytes)
        {
            // A wish: where it is not granted, pages are small.
            #[cfg(target_os = "linux")]
            let _ = mapped.advise(memmap2::Advice::HugePage);
            return Self::Mapped(mapped);
        }
        let numbers = vec![0.0_f64; len + 8];
        let from = numbers.as_ptr().align_offset(64).min(8);
        Self::Owned(numbers, from)
    }
}

impl Memory {
    /// Makes room for `len` numbers; what stood in another number of them is forgotten.
    pub(super) fn resize(&mut self, len: usize) {
        if self.len != len {
            *self = Self { place: Place::new(len), len };
        }
    }

    pub(super) fn get(&self) -> &[f64] {
        match &self.place {
            Place::Mapped(bytes) => &bytemuck::cast_slice(bytes)[..self.len],
            Place::Owned(numbers, from) => &numbers[*from..from + self.len],
        }
    }

    pub(super) fn get_mut(&mut self) -> &mut [f64] {
        match &mut self.place {
            Place::Mapped(bytes) => &mut bytemuck::cast_slice_mut(bytes)[..self.len],
            Place::Owned(numbers, from) => &mut numbers[*from..*from + self.len],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_begin_on_a_cache_line_and_at_zero() {
        let mut memory = Memory::default();
        assert!(memory.get().is_empty());
        for len in [1, 1000, LARGE / 8 + 3, 5] {
            memory.resize(len);
            assert_eq!(memory.get().len(), len);
            assert!(memory.get().iter().all(|x| *x == 0.0));
            assert_eq!(memory.get().as_ptr() as usize % 64, 0);
            memory.get_mut()[len - 1] = 2.0;
            memory.resize(len);
            assert_eq!(memory.get()[len - 1], 2.0);
        }
    }
}
