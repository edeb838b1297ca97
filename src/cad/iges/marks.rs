//! Names of levels and groups.

use rustc_hash::FxHashMap;

use crate::attributes::Name;

/// What entities refer to, read once.
#[derive(Debug, Default)]
pub(super) struct Marks {
    /// The file has name properties (406 form 15).
    pub has_names: bool,
    /// Names of the groups of each member.
    pub groups: FxHashMap<usize, Vec<Name>>,
    /// Layers by level field and groups, shared by the faces on them.
    pub levels: FxHashMap<i32, Vec<Name>>,
}
