//! Foot points on the trimmed CAD near known parameters, for the estimates of the tolerance search.

use super::reference::{CadReference, ReferenceFoot, is_regular};
use kanagata_cad::model::Face;
use kanagata_geometry::frame::unit;
use kanagata_geometry::nurbs::NearFoot;
use kanagata_geometry::{Vec2, Vec3};

impl CadReference<'_> {
    /// Foot point of `p` near the parameters `start` of its own face, without a search of the model: on that face, on its
    /// edges or on the adjacent faces. Distances have an error of up to 1e-3. `None` where there is no such point, and at
    /// free borders: another face may continue there.
    pub(super) fn foot_near(
        &self,
        p: &Vec3,
        face: u32,
        start: Vec2,
    ) -> Option<(ReferenceFoot, Vec2)> {
        let own = self.model.faces.get(face as usize)?;
        let near = own.surface.foot_near(p, start, self.accuracy)?;
        let normal = near_normal(own, &near)?;
        let foot = if self.index.region_contains(face as usize, near.uv) {
            ReferenceFoot { point: near.point, normal, own_normal: None, face, on_border: false }
        } else {
            self.foot_beyond(p, face, normal)?
        };
        Some((foot, near.uv))
    }

    /// Foot point of `p`, which lies beyond the border of `face`: on the nearest edge of the face or on the face beyond
    /// it (at a seam the face itself), whichever is closer; in a tie on the face. `normal` is that of `face` there.
    fn foot_beyond(&self, p: &Vec3, face: u32, normal: Vec3) -> Option<ReferenceFoot> {
        let edge = self.index.closest_edge_of_face(face as usize, p)?;
        if self.free[0][edge.edge] {
            return None;
        }
        let on_edge =
            ReferenceFoot { point: edge.point, normal, own_normal: None, face, on_border: false };
        let uses = &self.model.edges[edge.edge].uses;
        let is_seam = uses.iter().filter(|u| u[0] as u32 == face).count() > 1;
        let across = uses.iter().filter(|u| is_seam || u[0] as u32 != face);
        let feet = across.filter_map(|&[f, ring, place]| {
            let other = self.model.faces.get(f)?;
            let side = other.loops.get(ring)?.uses.get(place)?;
            let [a, b] = side.pcurve.domain();
            let fraction = if side.reversed { 1.0 - edge.fraction } else { edge.fraction };
            let start = side.pcurve.point(a + (b - a) * fraction);
            let near = other.surface.foot_near(p, start, self.accuracy)?;
            let inside = self.index.region_contains(f, near.uv);
            let foot = inside.then(|| near_normal(other, &near)).flatten();
            let (face, own_normal) = (f as u32, Some(normal));
            foot.map(|normal| ReferenceFoot {
                point: near.point,
                normal,
                own_normal,
                face,
                on_border: false,
            })
        });
        let distance = |foot: &ReferenceFoot| (foot.point - p).norm();
        let best = feet.min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let limit = distance(&on_edge) + self.tie;
        Some(best.filter(|foot| distance(foot) <= limit).unwrap_or(on_edge))
    }
}

/// Outward normal at a foot point; `None` where the surface is degenerate.
fn near_normal(face: &Face, near: &NearFoot) -> Option<Vec3> {
    let [u, v] = face.surface.domain();
    let reach = [near.su.norm() * (u[1] - u[0]), near.sv.norm() * (v[1] - v[0])];
    let normal = is_regular([near.su, near.sv], reach).then(|| unit(near.su.cross(&near.sv)));
    normal.flatten().map(|n| if face.flipped { -n } else { n })
}
