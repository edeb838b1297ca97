//! Memory of the factors: about a hundred megabytes, traversed by every solve.
//!
//! It is allocated in huge pages where the system supports them. With pages of 4 kB address translation costs as much
//! as reading the columns of a front; a solve takes one sixth longer.

use memmap2::MmapMut;

/// Zero-initialised numbers aligned to a cache line.
#[derive(Debug, Default)]
pub(super) struct Memory {
    place: Allocation,
    len: usize,
}

#[derive(Debug)]
enum Allocation {
    /// Mapped by the system.
    Mapped(MmapMut),
    /// Allocated by the allocator as fallback; the data start at this offset.
    Owned(Vec<f64>, usize),
}

impl Default for Allocation {
    fn default() -> Self {
        Self::Owned(Vec::new(), 0)
    }
}

/// Size from which memory is mapped [bytes]: one huge page.
const HUGE_PAGE_BYTES: usize = 1 << 21;

impl Allocation {
    fn new(len: usize) -> Self {
        let bytes = len * size_of::<f64>();
        if bytes >= HUGE_PAGE_BYTES
            && let Ok(mapped) = MmapMut::map_anon(bytes)
        {
            // Advisory: if it is refused, pages are small.
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
    /// Resizes to `len` numbers; the contents are lost if the length changes.
    pub(super) fn resize(&mut self, len: usize) {
        if self.len != len {
            *self = Self { place: Allocation::new(len), len };
        }
    }

    pub(super) fn get(&self) -> &[f64] {
        match &self.place {
            Allocation::Mapped(bytes) => &bytemuck::cast_slice(bytes)[..self.len],
            Allocation::Owned(numbers, from) => &numbers[*from..from + self.len],
        }
    }

    pub(super) fn get_mut(&mut self) -> &mut [f64] {
        match &mut self.place {
            Allocation::Mapped(bytes) => &mut bytemuck::cast_slice_mut(bytes)[..self.len],
            Allocation::Owned(numbers, from) => &mut numbers[*from..*from + self.len],
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
        for len in [1, 1000, HUGE_PAGE_BYTES / 8 + 3, 5] {
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
