//! Cooperative cancellation: a request shared by the thread that receives it and the work that obeys it.
//!
//! Work with state to save runs in a [`Section`]: it polls the request, saves, and leaves the section. Outside any
//! section the process may end at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

#[derive(Debug, Default)]
struct Shared {
    requested: AtomicBool,
    complete: AtomicBool,
    sections: AtomicUsize,
}

/// Handle of one request; clones share it. Initially not requested.
#[derive(Debug, Clone, Default)]
pub struct Cancel(Arc<Shared>);

impl Cancel {
    /// Requests cancellation; irreversible.
    pub fn request(&self) {
        self.0.requested.store(true, Ordering::SeqCst);
    }

    /// True after a request.
    #[must_use]
    pub fn is_requested(&self) -> bool {
        self.0.requested.load(Ordering::Relaxed)
    }

    /// Marks the results as complete: cancellation then loses none.
    pub fn complete(&self) {
        self.0.complete.store(true, Ordering::SeqCst);
    }

    /// True when the results are complete.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.0.complete.load(Ordering::SeqCst)
    }

    /// Starts work that obeys the request itself.
    #[must_use]
    pub fn section(&self) -> Section {
        self.0.sections.fetch_add(1, Ordering::SeqCst);
        Section(self.clone())
    }

    /// True while such work is running.
    #[must_use]
    pub fn is_heeded(&self) -> bool {
        self.0.sections.load(Ordering::SeqCst) > 0
    }
}

/// Work that obeys the request, until dropped.
#[derive(Debug)]
pub struct Section(Cancel);

impl Drop for Section {
    fn drop(&mut self) {
        self.0.0.sections.fetch_sub(1, Ordering::SeqCst);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clones_are_of_one_request_and_sections_are_counted() {
        let cancel = Cancel::default();
        let other = cancel.clone();
        let (outer, inner) = (cancel.section(), other.section());
        assert!(!cancel.is_requested() && other.is_heeded());
        other.request();
        drop(inner);
        assert!(cancel.is_requested() && cancel.is_heeded() && !Cancel::default().is_requested());
        drop(outer);
        assert!(!cancel.is_heeded());
    }
}
