//! Assembly map from the matrix values of the pattern to the storage of the fronts.

use super::fronts::{Front, Symbolic};
use super::pattern::{PatternError, PatternRef};

/// Computes the assembly map of the plan.
pub(super) fn map_entries(
    plan: &mut Symbolic,
    pattern: PatternRef<'_>,
) -> Result<(), PatternError> {
    if pattern.columns.len() > u32::MAX as usize {
        return Err(PatternError("more than 2^32 values"));
    }
    let n = plan.n;
    let mut new_of_old = vec![0u32; n];
    for (new, &old) in plan.old_of_new.iter().enumerate() {
        new_of_old[old as usize] = new as u32;
    }
    let mut front_of = vec![0u32; n];
    for (f, front) in plan.fronts.iter().enumerate() {
        front_of[front.first..front.first + front.pivots].fill(f as u32);
    }
    let Sorted { start, value, at } = by_front(&front_of, &new_of_old, pattern);
    let mut local = vec![u32::MAX; n];
    let mut place = vec![0u32; value.len()];
    for (f, front) in plan.fronts.iter_mut().enumerate() {
        front.entries = start[f]..start[f + 1];
        number(front, &mut local, |k| k);
        for k in front.entries.clone() {
            place[k] = storage_index(front, at[k].map(|new| local[new as usize] as usize))?;
        }
        // Rows of later fronts must not be found here.
        number(front, &mut local, |_| u32::MAX);
    }
    plan.entry_value = value;
    plan.entry_place = place;
    Ok(())
}

/// Index in the storage of a front of its entry at the given row and column.
fn storage_index(front: &Front, [row, column]: [usize; 2]) -> Result<u32, PatternError> {
    let (np, height) = (front.pivots, front.pivots + front.below);
    if row >= height || column >= height {
        return Err(PatternError("a value lies outside its front"));
    }
    let place = if column < np {
        column * height + row
    } else {
        front.panel_len() + (column - np) * np + row
    };
    Ok(place as u32)
}

/// Sets the local numbers of the unknowns of a front.
fn number(front: &Front, local: &mut [u32], to: impl Fn(u32) -> u32) {
    let pivots = front.first as u32..(front.first + front.pivots) as u32;
    for (k, unknown) in (0..).zip(pivots.chain(front.rows.iter().copied())) {
        local[unknown as usize] = to(k);
    }
}

/// Matrix values sorted by the front that eliminates their row or column first.
struct Sorted {
    /// First value of each front; length fronts + 1.
    start: Vec<usize>,
    /// Index of the value in the matrix.
    value: Vec<u32>,
    /// Row and column in the numbering of the plan.
    at: Vec<[u32; 2]>,
}

fn by_front(front_of: &[u32], new_of_old: &[u32], pattern: PatternRef<'_>) -> Sorted {
    let fronts = front_of.iter().max().map_or(0, |f| *f as usize + 1);
    let owner = |row: usize, column: u32| -> usize {
        front_of[new_of_old[row].min(new_of_old[column as usize]) as usize] as usize
    };
    let mut start = vec![0usize; fronts + 1];
    for_each_value(pattern, |_, row, column| start[owner(row, column) + 1] += 1);
    for f in 0..fronts {
        start[f + 1] += start[f];
    }
    let mut next = start.clone();
    let mut value = vec![0u32; pattern.columns.len()];
    let mut at = vec![[0u32; 2]; pattern.columns.len()];
    for_each_value(pattern, |q, row, column| {
        let slot = &mut next[owner(row, column)];
        value[*slot] = q as u32;
        at[*slot] = [new_of_old[row], new_of_old[column as usize]];
        *slot += 1;
    });
    Sorted { start, value, at }
}

fn for_each_value(pattern: PatternRef<'_>, mut visit: impl FnMut(usize, usize, u32)) {
    for row in 0..pattern.row_start.len() - 1 {
        for q in pattern.row_start[row]..pattern.row_start[row + 1] {
            visit(q, row, pattern.columns[q]);
        }
    }
}
