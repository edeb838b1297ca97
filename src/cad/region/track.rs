//! Sides of faces along the nodes of a curve that was followed: curves in the parameter plane, fitted to the exact one.

use super::trace::{FIT_REL, Node, Tracer};
use crate::loops::Side;
use kanagata_geometry::Vec2;
use kanagata_geometry::nurbs::Curve2;

/// Advance along the plan curve, relative to that along the cut, below which the cut has the length as parameter.
const ADVANCE_MIN_REL: f64 = 0.1;

/// Nodes of one side with increasing parameters.
struct Track {
    nodes: Vec<Node>,
    at: Vec<f64>,
    /// The parameters are those of the plan curve, with its sign of direction.
    by_t: bool,
}

impl Track {
    /// Parameters between which the curve is smooth in its parameter.
    fn breaks(&self) -> Vec<f64> {
        if !self.by_t {
            return self.at.clone();
        }
        let last = self.at.len() - 1;
        let is_break = |k: &usize| *k == 0 || *k == last || self.nodes[*k].kink;
        (0..=last).filter(is_break).map(|k| self.at[k]).collect()
    }
}

impl Tracer<'_> {
    /// Sides along the nodes, one for each piece of the plan curve that they follow.
    pub(super) fn sides(&self, nodes: &[Node]) -> Vec<Side> {
        let mut out = Vec::new();
        let mut from = 0;
        for k in 1..nodes.len() {
            // A node at a corner belongs to the piece that begins there.
            if k + 1 == nodes.len() || nodes[k].piece != nodes[from].piece {
                out.push(self.side(&nodes[from..=k]));
                from = k;
            }
        }
        out
    }

    /// A side along nodes of one piece of the plan curve; the last one may belong to the next piece.
    fn side(&self, nodes: &[Node]) -> Side {
        let (first, last) = (nodes[0].uv, nodes[nodes.len() - 1].uv);
        let track = self.track(nodes);
        let [low, high] = [track.at[0], track.at[track.at.len() - 1]];
        let chord = last - first;
        let is_on_chord = |w: &f64| {
            let uv = self.on_track(&track, low + (high - low) * w);
            let s = chord.dot(&(uv - first)) / chord.norm_squared().max(f64::MIN_POSITIVE);
            self.distance(uv, first + chord * s) <= 1e-3 * FIT_REL * self.tolerance
        };
        if [0.2, 0.4, 0.5, 0.7, 0.9].iter().all(is_on_chord) {
            return Side::straight(first, last);
        }
        let d = self.surface.derivs(nodes[nodes.len() / 2].uv);
        let speed = d.su.norm().max(d.sv.norm()).max(f64::MIN_POSITIVE);
        let breaks = track.breaks();
        let path =
            Curve2::fitted(|s| self.on_track(&track, s), &breaks, FIT_REL * self.tolerance / speed);
        Side { path: path.with_start(first).with_end(last), curve: None, edge_id: None }
    }

    /// Nodes of one piece with an increasing parameter: that of the plan curve where the side runs along it, otherwise
    /// the length.
    fn track(&self, nodes: &[Node]) -> Track {
        let piece = nodes[0].piece;
        let mut nodes = nodes.to_vec();
        if let Some(last) = nodes.last_mut().filter(|last| last.piece != piece) {
            *last = Node { piece, t: self.piece_end(piece, last.piece), ..*last };
        }
        let mut lengths = vec![0.0];
        for w in nodes.windows(2) {
            let length = self.distance(w[0].uv, w[1].uv).max(f64::MIN_POSITIVE);
            lengths.push(lengths[lengths.len() - 1] + length);
        }
        let (count, all) = (nodes.len() - 1, lengths[nodes.len() - 1]);
        let span = nodes[count].t - nodes[0].t;
        let advances = |k: usize| {
            let part = (nodes[k + 1].t - nodes[k].t) / span;
            part > 0.0 && part >= ADVANCE_MIN_REL * (lengths[k + 1] - lengths[k]) / all
        };
        let by_t = span != 0.0 && (0..count).all(advances);
        let at = if by_t { nodes.iter().map(|n| n.t * span.signum()).collect() } else { lengths };
        Track { nodes, at, by_t }
    }

    /// The point of the curve at a parameter of a track.
    fn on_track(&self, track: &Track, s: f64) -> Vec2 {
        let Track { nodes, at, by_t } = track;
        let k = at.partition_point(|a| *a <= s).clamp(1, nodes.len() - 1);
        let w = ((s - at[k - 1]) / (at[k] - at[k - 1])).clamp(0.0, 1.0);
        let (a, b) = (&nodes[k - 1], &nodes[k]);
        let (uv, t) = (a.uv + (b.uv - a.uv) * w, a.t + (b.t - a.t) * w);
        let guess = Node { uv, t, ..*a };
        self.corrected(guess, *by_t).map_or(guess.uv, |node| node.uv)
    }
}
