//! Part of the sheet that lies between a blank holder and the tools opposite.

use kanagata_contact::ToolSurface;
use kanagata_geometry::Vec3;
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// Smallest cosine between a tool's direction and the normal of a clamping face.
const CLAMP_COS_MIN: f64 = 0.9;
/// Largest lateral distance of a foot point from the line along the tool's direction, over the thickness, beside that of
/// an inclined face.
const FOOT_OFFSET_MAX_REL: f64 = 0.1;
/// Gap over the thickness up to which the foot point on an inclined face is beside: the far face of the sheet, and some play.
const INCLINED_GAP_MAX_REL: f64 = 2.0;

/// A tool at its place.
#[derive(Clone, Copy)]
pub struct Placed<'a> {
    /// Surface in the frame of the tool file.
    pub surface: &'a ToolSurface,
    /// Shift of this frame in the world [mm].
    pub shift: Vec3,
}

/// Centre and area projected along the unit vector `direction` [mm, mm²] of the lower face of every column of elements,
/// with the nodes at `positions`.
#[must_use]
pub fn lower_faces(mesh: &HexMesh, positions: &[Vec3], direction: &Vec3) -> Vec<(Vec3, f64)> {
    let faces =
        mesh.elements.iter().filter(|e| (e[0] as usize).is_multiple_of(mesh.nodes_per_column));
    let face = |element: &[u32; 8]| {
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| positions[element[k] as usize]);
        (0.25 * (a + b + c + d), 0.5 * (c - a).cross(&(d - b)).dot(direction).abs())
    };
    faces.map(face).collect()
}

/// Area of `faces` between the front of a holder and a face of `dies` [mm²]. `direction` is that of the holder, towards
/// the sheet.
#[must_use]
pub fn area_between(
    faces: &[(Vec3, f64)],
    direction: &Vec3,
    thickness: f64,
    (holder, dies): (&Placed<'_>, &[Placed<'_>]),
) -> f64 {
    let near = FOOT_OFFSET_MAX_REL * thickness;
    let covers = |tool: &Placed<'_>, sign: f64| -> Vec<bool> {
        let points: Vec<Vec3> = faces.iter().map(|(x, _)| x - tool.shift).collect();
        let feet = tool.surface.closest_of_all(&points, &[]);
        let covered = points.iter().zip(&feet).map(|(x, foot)| {
            let away = x - foot.point;
            let beside = (away - direction * away.dot(direction)).norm();
            let cosine = sign * foot.normal.dot(direction);
            let slope = (1.0 - cosine * cosine).max(0.0).sqrt();
            let gap = away.norm().min(INCLINED_GAP_MAX_REL * thickness);
            beside < near + gap * slope && cosine > CLAMP_COS_MIN
        });
        covered.collect()
    };
    let front = covers(holder, 1.0);
    let backs: Vec<Vec<bool>> = dies.iter().map(|die| covers(die, -1.0)).collect();
    let is_between = |k: &usize| front[*k] && backs.iter().any(|back| back[*k]);
    (0..faces.len()).filter(is_between).fold(0.0, |sum, k| sum + faces[k].1)
}
