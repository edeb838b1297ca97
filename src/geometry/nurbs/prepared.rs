//! Search structures for point projection: built at the first query, cached, and not part of the value of a curve or
//! surface.

use std::fmt;
use std::sync::OnceLock;

/// A lazily built cache. A clone starts empty, because its owner may be modified; all caches compare equal.
pub(super) struct Prepared<T>(OnceLock<Box<T>>);

impl<T> Prepared<T> {
    /// The cached value, built by `make` at the first call.
    pub fn get(&self, make: impl FnOnce() -> T) -> &T {
        self.0.get_or_init(|| Box::new(make()))
    }
}

impl<T> Default for Prepared<T> {
    fn default() -> Self {
        Self(OnceLock::new())
    }
}

impl<T> Clone for Prepared<T> {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl<T> PartialEq for Prepared<T> {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl<T> fmt::Debug for Prepared<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.get().is_some() { "prepared" } else { "not prepared" })
    }
}
