//! Sparsity pattern of the tangent of a body: CSR, three rows for each node, structurally symmetric.

/// Square matrix pattern in compressed rows; columns are sorted within a row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern {
    /// Start of each row in `col_idx`; length `n + 1`.
    pub row_ptr: Vec<usize>,
    /// Column of each entry.
    pub col_idx: Vec<usize>,
}

impl Pattern {
    /// Number of rows.
    #[must_use]
    pub fn dim(&self) -> usize {
        self.row_ptr.len().saturating_sub(1)
    }

    /// Number of stored entries.
    #[must_use]
    pub fn nnz(&self) -> usize {
        self.col_idx.len()
    }

    /// Matrix-vector product.
    #[must_use]
    pub fn times(&self, values: &[f64], x: &[f64]) -> Vec<f64> {
        let entries = |row: usize| self.row_ptr[row]..self.row_ptr[row + 1];
        let product = |row: usize| entries(row).map(|k| values[k] * x[self.col_idx[k]]).sum();
        (0..self.dim()).map(product).collect()
    }

    /// Index of entry `(row, column)` in the values, if it is stored.
    #[must_use]
    pub fn position(&self, row: usize, column: usize) -> Option<usize> {
        let start = self.row_ptr[row];
        self.col_idx[start..self.row_ptr[row + 1]].binary_search(&column).ok().map(|at| start + at)
    }
}

/// Assembly map of element contributions: for every node its elements, in element order.
#[derive(Debug, Clone)]
pub(crate) struct Gather {
    /// Pattern with three rows and columns for each node.
    pub pattern: Pattern,
    /// Start of each node in `uses`; length nodes + 1.
    pub use_ptr: Vec<usize>,
    /// Element, local node and the positions of the eight nodes of the element among the neighbours of the node.
    pub uses: Vec<NodeUse>,
}

/// One element at a node.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NodeUse {
    pub element: u32,
    pub local: u32,
    pub slots: [u32; 8],
}

impl Gather {
    /// Builds pattern and assembly map of a mesh with `node_count` nodes.
    pub(crate) fn new(node_count: usize, elements: &[[u32; 8]]) -> Self {
        let (use_ptr, mut uses) = uses_by_node(node_count, elements);
        let mut row_ptr = Vec::with_capacity(3 * node_count + 1);
        row_ptr.push(0);
        let mut col_idx = Vec::new();
        let mut neighbours: Vec<u32> = Vec::new();
        for node in 0..node_count {
            let around = &mut uses[use_ptr[node]..use_ptr[node + 1]];
            neighbours.clear();
            neighbours.extend(around.iter().flat_map(|one| elements[one.element as usize]));
            if neighbours.is_empty() {
                neighbours.push(node as u32);
            }
            neighbours.sort_unstable();
            neighbours.dedup();
            for one in around.iter_mut() {
                one.slots = elements[one.element as usize]
                    .map(|other| neighbours.partition_point(|&known| known < other) as u32);
            }
            for _ in 0..3 {
                col_idx.extend(
                    neighbours
                        .iter()
                        .flat_map(|&other| (0..3).map(move |c| 3 * other as usize + c)),
                );
                row_ptr.push(col_idx.len());
            }
        }
        Self { pattern: Pattern { row_ptr, col_idx }, use_ptr, uses }
    }

    /// Elements at a node, in element order.
    pub(crate) fn around(&self, node: usize) -> &[NodeUse] {
        &self.uses[self.use_ptr[node]..self.use_ptr[node + 1]]
    }
}

/// Elements at each node, in element order and without slots, and the start of each node.
fn uses_by_node(node_count: usize, elements: &[[u32; 8]]) -> (Vec<usize>, Vec<NodeUse>) {
    let mut use_ptr = vec![0usize; node_count + 1];
    for &node in elements.iter().flatten() {
        use_ptr[node as usize + 1] += 1;
    }
    for node in 0..node_count {
        use_ptr[node + 1] += use_ptr[node];
    }
    let blank = NodeUse { element: 0, local: 0, slots: [0; 8] };
    let mut uses = vec![blank; use_ptr[node_count]];
    let mut next = use_ptr.clone();
    for (element, nodes) in elements.iter().enumerate() {
        for (local, &node) in nodes.iter().enumerate() {
            let at = &mut next[node as usize];
            uses[*at] = NodeUse { element: element as u32, local: local as u32, slots: [0; 8] };
            *at += 1;
        }
    }
    (use_ptr, uses)
}
