//! Constraints on the divisions of edges for mapped faces.

use super::Mesher;
use crate::mapped::divisions::{Assignment, Rule};
use crate::mapped::sides::Shape;

impl Mesher<'_> {
    /// Rules of the faces to be mapped, and the face of each.
    pub(in crate::mapped) fn rules(&self) -> (Vec<Rule>, Vec<usize>) {
        let (mut rules, mut owners) = (Vec::new(), Vec::new());
        if self.options.unstructured {
            return (rules, owners);
        }
        for f in 0..self.model.faces.len() {
            if self.is_even_flat(f) && self.free_edges(f).is_empty() {
                rules.push(Rule::Even(self.edges_of(f)));
                owners.push(f);
            }
            let own = self.rules_of_shape(f);
            owners.extend(std::iter::repeat_n(f, own.len()));
            rules.extend(own);
        }
        (rules, owners)
    }

    /// Rules that permit mapping face `f` between its four or three sides.
    fn rules_of_shape(&self, f: usize) -> Vec<Rule> {
        let edges = |side: &[usize]| -> Option<Vec<usize>> {
            side.iter().map(|&u| self.model.faces[f].loops[0].uses[u].edge).collect()
        };
        let equal = |a: &[usize], b: &[usize]| Some(Rule::Equal(edges(a)?, edges(b)?));
        match &self.shapes[f] {
            // A flat face needs no mapping: it has no rules unless its sides are single edges.
            Shape::Four(sides) if self.flats[f] && sides.iter().any(|s| s.len() > 1) => Vec::new(),
            Shape::Three(_) if self.flats[f] => Vec::new(),
            Shape::Four([a, b, c, d]) => [equal(a, c), equal(b, d)].into_iter().flatten().collect(),
            Shape::Three([a, b, c]) => {
                let even = self.three_blocks().then(|| edges(a).map(Rule::Even)).flatten();
                [equal(a, b), equal(b, c), even].into_iter().flatten().collect()
            }
            _ => Vec::new(),
        }
    }

    /// Faces that can be mapped with the assigned divisions.
    pub(super) fn mapped_faces(&self, agreed: &Assignment, owners: &[usize]) -> Vec<bool> {
        let may = |s: &Shape| *s != Shape::Other && !self.options.unstructured;
        let mut mapped: Vec<bool> = self.shapes.iter().map(may).collect();
        for (&f, &kept) in owners.iter().zip(&agreed.kept) {
            mapped[f] &= kept;
        }
        mapped
    }
}
