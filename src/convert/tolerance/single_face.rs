//! One face of a model as a model of its own.

use std::collections::BTreeMap;

use kanagata_cad::Model;
use kanagata_cad::model::Edge;

/// One face as a model of its own.
pub(super) struct SingleFace {
    pub model: Model,
    /// Number of each edge in the complete model.
    pub edges: Vec<usize>,
    /// For each edge, true when another face uses it or when it is a free border.
    pub measured_edges: Vec<bool>,
    /// For each edge, true at a free border.
    pub free_edges: Vec<bool>,
}

impl SingleFace {
    /// Extracts face `f` with its edges and vertices; `free` marks the edges of the complete model at free borders.
    pub fn new(whole: &Model, free: &[bool], f: usize) -> Self {
        let mut face = whole.faces[f].clone();
        let (mut edges, mut vertices) = (BTreeMap::new(), BTreeMap::new());
        let mut model = Model {
            name: whole.name.clone(),
            unit: whole.unit.clone(),
            unit_mm: whole.unit_mm,
            join_tolerance: whole.join_tolerance,
            ..Model::default()
        };
        for (l, trim) in face.loops.iter_mut().enumerate() {
            for (k, side) in trim.uses.iter_mut().enumerate() {
                let Some(e) = side.edge else { continue };
                let number = *edges.entry(e).or_insert_with(|| {
                    let old = &whole.edges[e];
                    let ends = old.vertices.map(|v| {
                        *vertices.entry(v).or_insert_with(|| {
                            model.vertices.push(whole.vertices[v]);
                            model.vertices.len() - 1
                        })
                    });
                    let curve = old.curve.clone();
                    model.edges.push(Edge { curve, vertices: ends, uses: Vec::new() });
                    model.edges.len() - 1
                });
                model.edges[number].uses.push([0, l, k]);
                side.edge = Some(number);
            }
        }
        let mut numbers = vec![0; edges.len()];
        edges.iter().for_each(|(&e, &number)| numbers[number] = e);
        let others = |&e: &usize| whole.edges[e].uses.iter().any(|u| u[0] != f);
        let measured_edges = numbers.iter().map(|e| others(e) || free[*e]).collect();
        let free_edges = numbers.iter().map(|&e| free[e]).collect();
        model.faces = vec![face];
        Self { model, edges: numbers, measured_edges, free_edges }
    }
}
