//! Union-find over consecutive integers.

/// A partition of `0..count` into disjoint sets.
#[derive(Debug, Clone)]
pub struct DisjointSets {
    parent: Vec<usize>,
}

impl DisjointSets {
    /// The partition into `count` singletons.
    #[must_use]
    pub fn new(count: usize) -> Self {
        Self { parent: (0..count).collect() }
    }

    /// The representative of the set of `k`: its smallest member.
    pub fn representative(&mut self, mut k: usize) -> usize {
        while self.parent[k] != k {
            self.parent[k] = self.parent[self.parent[k]];
            k = self.parent[k];
        }
        k
    }

    /// Merges the sets of `a` and `b`.
    pub fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.representative(a), self.representative(b));
        self.parent[a.max(b)] = a.min(b);
    }

    /// Set number of every member and the number of sets. Sets are numbered in the order of their smallest members.
    #[must_use]
    pub fn numbered(mut self) -> (Vec<usize>, usize) {
        let mut count = 0;
        let mut numbers = vec![0; self.parent.len()];
        for k in 0..numbers.len() {
            let root = self.representative(k);
            if root == k {
                numbers[k] = count;
                count += 1;
            } else {
                numbers[k] = numbers[root];
            }
        }
        (numbers, count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_are_numbered_by_their_least_members_whatever_the_order_of_joins() {
        let joined = |pairs: &[[usize; 2]]| {
            let mut sets = DisjointSets::new(7);
            pairs.iter().for_each(|&[a, b]| sets.join(a, b));
            sets.numbered()
        };
        let expected = (vec![0, 1, 0, 2, 1, 0, 3], 4);
        assert_eq!(joined(&[[5, 2], [2, 0], [4, 1]]), expected);
        assert_eq!(joined(&[[1, 4], [0, 5], [5, 2], [2, 5]]), expected);
    }
}
