//! Where every matrix value goes: the assembly map from the pattern to the fronts' storage.

use super::symbolic::{PatternError, PatternRef, Symbolic};

/// Fills the plan's assembly map.
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
    // Values by the front in which their row or column is eliminated first.
    let mut count = vec![0usize; plan.fronts.len() + 1];
    let owner = |row: usize, column: u32| -> usize {
        front_of[new_of_old[row].min(new_of_old[column as usize]) as usize] as usize
    };
    for_each_value(pattern, |_, row, column| count[owner(row, column) + 1] += 1);
    for f in 0..plan.fronts.len() {
        count[f + 1] += count[f];
    }
    let mut value = vec![0u32; pattern.columns.len()];
    let mut next = count.clone();
    let mut at = vec![[0u32; 2]; pattern.columns.len()];
    for_each_value(pattern, |q, row, column| {
        let slot = &mut next[owner(row, column)];
        value[*slot] = q as u32;
        at[*slot] = [new_of_old[row], new_of_old[column as usize]];
        *slot += 1;
    });
    let mut local = vec![u32::MAX; n];
    let mut place = vec![0u32; value.len()];
    for (f, front) in plan.fronts.iter_mut().enumerate() {
        for k in 0..front.pivots {
            local[front.first + k] = k as u32;
        }
        for (k, &row) in front.rows.iter().enumerate() {
            local[row as usize] = (front.pivots + k) as u32;
        }
        let (np, height) = (front.pivots, front.pivots + front.below);
        front.entries = count[f]..count[f + 1];
        for k in front.entries.clone() {
            let [row, column] = at[k].map(|new| local[new as usize] as usize);
            if row >= height || column >= height {
                return Err(PatternError("a value lies outside its front"));
            }
            let offset = if column < np {
                column * height + row
            } else {
                front.panel_len() + (column - np) * np + row
            };
            place[k] = offset as u32;
        }
        // Rows of later fronts must not be found here.
        for k in 0..front.pivots {
            local[front.first + k] = u32::MAX;
        }
        for &row in &front.rows {
            local[row as usize] = u32::MAX;
        }
    }
    plan.entry_value = value;
    plan.entry_place = place;
    Ok(())
}

fn for_each_value(pattern: PatternRef<'_>, mut visit: impl FnMut(usize, usize, u32)) {
    for row in 0..pattern.row_start.len() - 1 {
        for q in pattern.row_start[row]..pattern.row_start[row + 1] {
            visit(q, row, pattern.columns[q]);
        }
    }
}
