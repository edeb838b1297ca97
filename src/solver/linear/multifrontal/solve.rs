//! Forward and backward substitution.

use super::numeric::Factors;
use super::symbolic::Symbolic;

impl Symbolic {
    /// Solves in place for one right-hand side in the pattern's numbering.
    pub fn solve(&self, factors: &Factors, rhs: &mut [f64]) {
        let mut y: Vec<f64> = self.old_of_new.iter().map(|&old| rhs[old as usize]).collect();
        let widest = self.fronts.iter().map(|f| f.pivots + f.below).max().unwrap_or(0);
        let mut work = vec![0.0; widest];
        self.forward(factors, &mut y, &mut work);
        self.backward(factors, &mut y, &mut work);
        for (&old, value) in self.old_of_new.iter().zip(&y) {
            rhs[old as usize] = *value;
        }
    }

    fn forward(&self, factors: &Factors, y: &mut [f64], work: &mut [f64]) {
        for front in &self.fronts {
            let (np, height) = (front.pivots, front.pivots + front.below);
            let own = front.first..front.first + np;
            let panel = &factors.storage()[front.storage..front.storage + front.panel_len()];
            let w = &mut work[..height];
            for (t, &p) in w.iter_mut().zip(&factors.pivot[own.clone()]) {
                *t = y[front.first + p as usize];
            }
            w[np..].fill(0.0);
            for (j, column) in panel.chunks_exact(height).enumerate() {
                let (head, tail) = w.split_at_mut(j + 1);
                subtract(tail, &column[j + 1..], head[j]);
            }
            y[own].copy_from_slice(&w[..np]);
            for (&row, value) in front.rows.iter().zip(&w[np..]) {
                y[row as usize] += value;
            }
        }
    }

    fn backward(&self, factors: &Factors, y: &mut [f64], work: &mut [f64]) {
        for front in self.fronts.iter().rev() {
            let (np, height) = (front.pivots, front.pivots + front.below);
            let own = front.first..front.first + np;
            let storage = &factors.storage()[front.storage..front.storage + front.storage_len()];
            let (panel, u12) = storage.split_at(front.panel_len());
            let w = &mut work[..np];
            w.copy_from_slice(&y[own.clone()]);
            for (&row, column) in front.rows.iter().zip(u12.chunks_exact(np)) {
                subtract(w, column, y[row as usize]);
            }
            for j in (0..np).rev() {
                let column = &panel[j * height..j * height + j + 1];
                let (head, tail) = w.split_at_mut(j);
                tail[0] /= column[j];
                subtract(head, &column[..j], tail[0]);
            }
            y[own].copy_from_slice(w);
        }
    }
}

#[inline]
fn subtract(to: &mut [f64], column: &[f64], by: f64) {
    for (t, c) in to.iter_mut().zip(column) {
        *t -= by * c;
    }
}
