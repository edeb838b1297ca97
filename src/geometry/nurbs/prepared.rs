//! What a curve or surface prepares for closest points: made when first asked for, kept, and no part of its value.

use std::fmt;
use std::sync::OnceLock;

/// Made once. A copy starts without it, as what is copied may be changed; all are equal.
pub(super) struct Prepared<T>(OnceLock<Box<T>>);

impl<T> Prepared<T> {
    /// What was made, by `make` when it is the first time.
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
