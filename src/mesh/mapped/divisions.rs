//! Consistent integer divisions of the edges of a model. Opposite sides of a four-sided face have equal counts, so that
//! counts propagate along chains of opposite edges.

use std::collections::BTreeSet;

use kanagata_geometry::sets::DisjointSets;

/// A constraint of a face on the counts of its edges.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Rule {
    /// The counts of both groups of edges have the same sum.
    Equal(Vec<usize>, Vec<usize>),
    /// The counts have an even sum.
    Even(Vec<usize>),
}

/// Counts, and the constraints they satisfy.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assignment {
    /// Divisions of each edge, at least its minimum.
    pub counts: Vec<usize>,
    /// For each rule, true when satisfied. A rule without solution (or only beyond the limit) is dropped.
    pub kept: Vec<bool>,
}

/// Largest growth of a side relative to the largest minimum before its rule is dropped.
const GROWTH_MAX: usize = 8;

/// Finds small counts: `minima[e] >= 1` is the minimum of edge e. `lengths[e]` [mm] decides which edge of a side gets
/// another division (the one with the longest segments).
///
/// Rules between single edges are satisfied exactly (chains). Sums are met by raising counts one at a time from their
/// minima.
#[must_use]
pub fn assign(minima: &[usize], lengths: &[f64], rules: &[Rule]) -> Assignment {
    PreparedRules::new(lengths, rules).assign(minima)
}

/// Rules of a model, prepared for many assignments.
#[derive(Debug, Clone)]
pub struct PreparedRules {
    /// For each edge the first edge of those with equal counts: its class.
    class: Vec<usize>,
    /// Largest length of each class [mm].
    length: Vec<f64>,
    sums: Vec<Balance>,
    /// Rules that contain each class.
    rules_of: Vec<Vec<usize>>,
}

impl PreparedRules {
    /// Prepares `rules` between edges of these lengths [mm].
    #[must_use]
    pub fn new(lengths: &[f64], rules: &[Rule]) -> Self {
        let mut classes = DisjointSets::new(lengths.len());
        for rule in rules {
            if let Rule::Equal(a, b) = rule
                && let ([a], [b]) = (&a[..], &b[..])
            {
                classes.join(*a, *b);
            }
        }
        let class: Vec<usize> = (0..lengths.len()).map(|e| classes.representative(e)).collect();
        let mut length = vec![0.0f64; lengths.len()];
        for (&c, &own) in class.iter().zip(lengths) {
            length[c] = length[c].max(own);
        }
        let sums: Vec<Balance> = rules.iter().map(|rule| balance(rule, &class)).collect();
        let mut rules_of = vec![Vec::new(); lengths.len()];
        for (r, sum) in sums.iter().enumerate() {
            sum.terms.iter().for_each(|&(k, _)| rules_of[k].push(r));
        }
        Self { class, length, sums, rules_of }
    }

    /// Small counts that satisfy the rules; see [`assign`].
    #[must_use]
    pub fn assign(&self, minima: &[usize]) -> Assignment {
        let mut count = vec![1; minima.len()];
        for (&c, &least) in self.class.iter().zip(minima) {
            count[c] = count[c].max(least);
        }
        let limit = GROWTH_MAX * count.iter().copied().max().unwrap_or(1).max(4);
        let mut kept: Vec<bool> = self.sums.iter().map(can_hold).collect();
        let is_broken = |r: usize, count: &[usize]| residual(&self.sums[r], count) != 0;
        let mut broken: BTreeSet<usize> =
            (0..kept.len()).filter(|&r| kept[r] && is_broken(r, &count)).collect();
        while let Some(&r) = broken.first() {
            let Some(raise) = choose(&self.sums[r], &count, &self.length, limit) else {
                kept[r] = false;
                broken.remove(&r);
                continue;
            };
            count[raise] += 1;
            for &other in self.rules_of[raise].iter().filter(|&&other| kept[other]) {
                if is_broken(other, &count) {
                    broken.insert(other);
                } else {
                    broken.remove(&other);
                }
            }
        }
        Assignment { counts: self.class.iter().map(|&c| count[c]).collect(), kept }
    }
}

/// A rule over classes: coefficients, and whether only its parity matters.
#[derive(Debug, Clone)]
struct Balance {
    terms: Vec<(usize, i64)>,
    parity: bool,
}

fn balance(rule: &Rule, class: &[usize]) -> Balance {
    let mut terms = std::collections::BTreeMap::new();
    let (plus, minus, parity) = match rule {
        Rule::Equal(a, b) => (&a[..], &b[..], false),
        Rule::Even(a) => (&a[..], &[][..], true),
    };
    plus.iter().for_each(|&e| *terms.entry(class[e]).or_insert(0) += 1);
    minus.iter().for_each(|&e| *terms.entry(class[e]).or_insert(0) -= 1);
    terms.retain(|_, c| if parity { *c % 2 != 0 } else { *c != 0 });
    Balance { terms: terms.into_iter().collect(), parity }
}

fn can_hold(sum: &Balance) -> bool {
    let sign = |s: i64| sum.terms.iter().any(|&(_, c)| c.signum() == s);
    sum.parity || sign(1) == sign(-1)
}

fn residual(sum: &Balance, count: &[usize]) -> i64 {
    let total: i64 = sum.terms.iter().map(|&(k, c)| c * count[k] as i64).sum();
    if sum.parity { total.rem_euclid(2) } else { total }
}

/// The class to raise: longest segments first, among those that do not overshoot if there are any.
fn choose(sum: &Balance, count: &[usize], length: &[f64], limit: usize) -> Option<usize> {
    let r = residual(sum, count);
    let helps = |c: i64| sum.parity || c.signum() == -r.signum();
    let score = |k: usize| length[k] / count[k] as f64;
    let best = |fits: &dyn Fn(i64) -> bool| {
        let fitting = sum.terms.iter().filter(|&&(k, c)| helps(c) && fits(c) && count[k] < limit);
        fitting.map(|&(k, _)| k).max_by(|&a, &b| score(a).total_cmp(&score(b)).then(b.cmp(&a)))
    };
    best(&|c| c.abs() <= r.abs()).or_else(|| best(&|_| true))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn equal(a: &[usize], b: &[usize]) -> Rule {
        Rule::Equal(a.to_vec(), b.to_vec())
    }

    #[test]
    fn a_chain_takes_its_largest_demand_and_leaves_others_alone() {
        let rules = [equal(&[0], &[1]), equal(&[1], &[2])];
        let got = assign(&[1, 1, 5, 2], &[1.0; 4], &rules);
        assert_eq!(got.counts, [5, 5, 5, 2]);
    }

    #[test]
    fn a_side_of_two_edges_shares_by_length() {
        let got = assign(&[8, 1, 1], &[10.0, 9.0, 3.0], &[equal(&[0], &[1, 2])]);
        assert_eq!(got.counts[1] + got.counts[2], 8);
        assert_eq!(got.counts, [8, 6, 2]);
    }

    #[test]
    fn a_rule_no_count_can_keep_is_given_up_alone() {
        let rules = [equal(&[0], &[0, 1]), equal(&[2], &[3, 4])];
        let got = assign(&[2, 1, 1, 1, 1], &[1.0; 5], &rules);
        assert_eq!(got.kept, [false, true]);
        assert_eq!(got.counts, [2, 1, 2, 1, 1]);
    }

    #[test]
    fn rules_that_chase_each_other_end() {
        // n0 = n1 + n2 and n1 = n0 + n2: solvable only with n2 = 0.
        let rules = [equal(&[0], &[1, 2]), equal(&[1], &[0, 2])];
        let got = assign(&[1, 1, 1], &[1.0; 3], &rules);
        assert!(got.kept.iter().any(|k| !k));
    }

    #[test]
    fn parity_raises_the_edge_with_the_longest_segments() {
        let got = assign(&[3, 2, 2], &[1.0, 8.0, 2.0], &[Rule::Even(vec![0, 1, 2])]);
        assert_eq!(got.counts, [3, 3, 2]);
    }
}
