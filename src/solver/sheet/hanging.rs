//! Hanging nodes: columns in the middle of the side of a coarser element, as exact linear constraints.
//!
//! A hanging column `h` lies between two master columns `a` and `b`. At every level `x_h = (x_a + x_b) / 2`, in the
//! reference and in the current position. An element with hanging corners then has eight effective nodes: each hanging
//! corner is replaced by the master that is not a corner of the element. With `x_local = T x_effective` the nodal forces
//! are `T^t f` and the stiffness is `T^t K T`, as for master and slave degrees of freedom in Belytschko, Liu and Moran
//! (2014). The system of equations contains no hanging node.

use rustc_hash::FxHashMap;

/// A column in the middle between two others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HangingColumn {
    /// The column.
    pub column: u32,
    /// The columns at the ends of the side of the coarser element, by ascending number.
    pub masters: [u32; 2],
}

/// The hanging columns of a mesh, by ascending number; no master hangs.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Hanging(Vec<HangingColumn>);

impl Hanging {
    /// From the hanging columns in any order.
    #[must_use]
    pub fn new(mut columns: Vec<HangingColumn>) -> Self {
        columns.iter_mut().for_each(|c| c.masters.sort_unstable());
        columns.sort_unstable_by_key(|c| c.column);
        columns.dedup_by_key(|c| c.column);
        Self(columns)
    }

    /// Whether no column hangs.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The hanging columns, by ascending number.
    #[must_use]
    pub fn columns(&self) -> &[HangingColumn] {
        &self.0
    }

    /// Masters of a column, if it hangs.
    #[must_use]
    pub fn masters(&self, column: u32) -> Option<[u32; 2]> {
        let at = self.0.binary_search_by_key(&column, |c| c.column).ok()?;
        Some(self.0[at].masters)
    }

    /// The hanging column between each pair of masters, whose numbers ascend.
    #[must_use]
    pub fn between(&self) -> FxHashMap<[u32; 2], u32> {
        self.0.iter().map(|c| (c.masters, c.column)).collect()
    }
}
