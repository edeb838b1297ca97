//! Hanging nodes of a mesh: their masters, and the effective nodes of elements.

use rustc_hash::FxHashMap;

use super::hanging::{Hanging, HangingColumn};
use super::hex_mesh::HexMesh;

/// Hanging corners of an element in plan: the corner (0..4), and the corner of the element that is one of its masters.
/// The other master is the effective node in the place of the hanging corner.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct HangingCorners([Option<[u8; 2]>; 2]);

impl HangingCorners {
    /// Pairs of hanging corner and master corner, of the lower face; those of the upper face are 4 higher.
    pub fn pairs(&self) -> impl Iterator<Item = [usize; 2]> {
        self.0.into_iter().flatten().map(|pair| pair.map(usize::from))
    }
}

impl HexMesh {
    /// Masters of a node, if it hangs.
    #[must_use]
    pub fn masters(&self, node: usize) -> Option<[usize; 2]> {
        if self.hanging.is_empty() {
            return None;
        }
        let levels = self.nodes_per_column.max(1);
        let masters = self.hanging.masters((node / levels) as u32)?;
        Some(masters.map(|column| column as usize * levels + node % levels))
    }

    /// Hanging nodes with their masters.
    pub fn hanging_nodes(&self) -> impl Iterator<Item = (usize, [usize; 2])> {
        let levels = self.nodes_per_column.max(1);
        let nodes = move |&HangingColumn { column, masters }: &HangingColumn| {
            let node = move |column: u32, level: usize| column as usize * levels + level;
            (0..levels).map(move |k| (node(column, k), masters.map(|m| node(m, k))))
        };
        self.hanging.columns().iter().flat_map(nodes)
    }

    /// Number of nodes that do not hang.
    #[must_use]
    pub fn free_node_count(&self) -> usize {
        self.nodes.len() - self.hanging.columns().len() * self.nodes_per_column.max(1)
    }

    /// Sets the values of every hanging node (three for each node) to the means of those of its masters.
    pub fn set_means(&self, values: &mut [f64]) {
        for (node, [a, b]) in self.hanging_nodes() {
            for k in 0..3 {
                values[3 * node + k] = 0.5 * (values[3 * a + k] + values[3 * b + k]);
            }
        }
    }

    /// Moves the forces on hanging nodes (three for each node) to their masters, half to each.
    pub fn move_to_masters(&self, forces: &mut [f64]) {
        for (node, masters) in self.hanging_nodes() {
            for k in 0..3 {
                let half = 0.5 * std::mem::take(&mut forces[3 * node + k]);
                masters.iter().for_each(|master| forces[3 * master + k] += half);
            }
        }
    }

    /// Moves a quantity that hanging nodes carry (one value for each node) to their masters, half to each.
    pub fn share_with_masters(&self, values: &mut [f64]) {
        for (node, masters) in self.hanging_nodes() {
            let half = 0.5 * std::mem::take(&mut values[node]);
            masters.iter().for_each(|&master| values[master] += half);
        }
    }

    /// Hanging corners of an element; `None` if it has none.
    #[must_use]
    pub fn hanging_corners(&self, element: usize) -> Option<HangingCorners> {
        let nodes = &self.elements[element];
        let mut found = [None; 2];
        let mut rest = found.iter_mut();
        for corner in 0..4 {
            let Some(masters) = self.masters(nodes[corner] as usize) else { continue };
            let own = (0..4).find(|&k| masters.contains(&(nodes[k] as usize)));
            *rest.next()? = own.map(|own| [corner as u8, own as u8]);
        }
        found[0].is_some().then_some(HangingCorners(found))
    }

    /// Effective nodes of an element: each hanging corner is replaced by the master that is not a corner of the element.
    #[must_use]
    pub fn effective_nodes(&self, element: usize) -> [u32; 8] {
        let nodes = self.elements[element];
        if self.hanging.is_empty() {
            return nodes;
        }
        nodes.map(|node| self.effective_node(element, node))
    }

    /// The effective node in the place of a node of an element.
    #[must_use]
    pub fn effective_node(&self, element: usize, node: u32) -> u32 {
        let Some(masters) = self.masters(node as usize) else { return node };
        let [a, b] = masters.map(|master| master as u32);
        if self.elements[element].contains(&a) { b } else { a }
    }

    /// Upper faces of the sheet as polygons of columns, counter-clockwise seen from the top. Hanging columns on the sides
    /// of a coarser face are corners of its polygon too, so that every side inside the sheet occurs twice.
    #[must_use]
    pub fn upper_polygons(&self) -> Vec<Vec<usize>> {
        let levels = self.nodes_per_column.max(1) as u32;
        let between: FxHashMap<[u32; 2], u32> = self.hanging.between();
        let upper = self.elements.iter().map(|e| [e[4], e[5], e[6], e[7]]);
        let upper = upper.filter(|quad| quad.iter().all(|n| n % levels == levels - 1));
        let polygon = |quad: [u32; 4]| {
            let mut out = Vec::with_capacity(4);
            for k in 0..4 {
                let [a, b] = [quad[k], quad[(k + 1) % 4]].map(|n| n / levels);
                out.push(a as usize);
                out.extend(between.get(&[a.min(b), a.max(b)]).map(|&h| h as usize));
            }
            out
        };
        upper.map(polygon).collect()
    }

    /// The hanging columns of a mesh without a list of them: a column in the middle of two others (within `near` [mm]),
    /// where the three sides between them belong to one element each.
    #[must_use]
    pub fn hanging_found(&self, near: f64) -> Hanging {
        let mesh = self;
        let levels = mesh.nodes_per_column.max(1) as u32;
        let mut uses: FxHashMap<[u32; 2], u32> = FxHashMap::default();
        for e in mesh.elements.iter().filter(|e| e[..4].iter().all(|n| n % levels == 0)) {
            for k in 0..4 {
                let [a, b] = [e[k], e[(k + 1) % 4]].map(|n| n / levels);
                *uses.entry([a.min(b), a.max(b)]).or_default() += 1;
            }
        }
        let mut beside: FxHashMap<u32, Vec<u32>> = FxHashMap::default();
        for [a, b] in uses.iter().filter(|(_, uses)| **uses == 1).map(|(side, _)| *side) {
            beside.entry(a).or_default().push(b);
            beside.entry(b).or_default().push(a);
        }
        let at = |column: u32| mesh.nodes[(column * levels) as usize];
        let between = |(&column, others): (&u32, &Vec<u32>)| {
            let &[a, b] = &others[..] else { return None };
            let coarse = uses.get(&[a.min(b), a.max(b)]) == Some(&1);
            let middle = coarse && (0.5 * (at(a) + at(b)) - at(column)).norm() <= near;
            middle.then_some(HangingColumn { column, masters: [a, b] })
        };
        let found = beside.iter().filter_map(between).collect();
        Hanging::new(found)
    }
}
