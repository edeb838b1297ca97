//! The line in which a plane cuts the undeformed middle surface of a sheet.

use std::collections::BTreeMap;

use kanagata_geometry::Vec3;
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// Distance from the plane over the size of the sheet within which a node lies on it.
const ON_PLANE_REL: f64 = 1e-6;

/// A point between two columns of nodes: the columns, and the weight of the second one.
#[derive(Debug, Clone, Copy, PartialEq)]
struct LinePoint {
    columns: [usize; 2],
    weight: f64,
}

/// A section line.
#[derive(Debug, Clone, PartialEq)]
pub struct SectionLine {
    points: Vec<LinePoint>,
    /// Length along the line in the undeformed sheet [mm].
    pub arc: Vec<f64>,
}

impl SectionLine {
    /// The points of the line on the middle surface, for nodes at `positions` [mm].
    #[must_use]
    pub fn points(&self, mesh: &HexMesh, positions: &[Vec3]) -> Vec<Vec3> {
        let middle = middle_surface(mesh, positions);
        self.points.iter().map(|p| p.at(&middle)).collect()
    }
}

impl LinePoint {
    fn at(&self, middle: &[Vec3]) -> Vec3 {
        let [a, b] = self.columns.map(|c| middle[c]);
        a + (b - a) * self.weight
    }
}

/// Middle of the lowest and highest node of each column.
fn middle_surface(mesh: &HexMesh, positions: &[Vec3]) -> Vec<Vec3> {
    let ends = mesh.bottom_nodes().into_iter().zip(mesh.top_nodes());
    ends.map(|(a, b)| 0.5 * (positions[a as usize] + positions[b as usize])).collect()
}

/// The longest line in which the plane across axis `normal` at the coordinate `at` [mm] cuts the undeformed sheet; `None` if
/// it does not. It begins at the end with the smaller coordinate along the other axis.
#[must_use]
pub fn cut(mesh: &HexMesh, normal: usize, at: f64) -> Option<SectionLine> {
    let middle = middle_surface(mesh, &mesh.nodes);
    let size = kanagata_geometry::Aabb::of_points(&middle).diagonal();
    let distance: Vec<f64> = middle
        .iter()
        .map(|p| p[normal] - at)
        .map(|d| if d.abs() <= ON_PLANE_REL * size { 0.0 } else { d })
        .collect();
    let mut ends: BTreeMap<[usize; 2], Vec<[usize; 2]>> = BTreeMap::new();
    let mut segments = std::collections::BTreeSet::new();
    for polygon in mesh.upper_polygons() {
        if let Some([a, b]) = segment(&polygon, &distance)
            && segments.insert([a.min(b), a.max(b)])
        {
            ends.entry(a).or_default().push(b);
            ends.entry(b).or_default().push(a);
        }
    }
    let lines = chains(&ends);
    let measured = lines.into_iter().map(|keys| measured(&keys, &distance, &middle));
    let longest = measured.reduce(|a, b| if length(&b) > length(&a) { b } else { a })?;
    Some(turned(longest, &middle, 1 - normal))
}

fn length(line: &SectionLine) -> f64 {
    line.arc.last().copied().unwrap_or(0.0)
}

/// Where the plane crosses a face: two points, each on a column (twice the same) or between two.
fn segment(polygon: &[usize], distance: &[f64]) -> Option<[[usize; 2]; 2]> {
    let mut found: Vec<[usize; 2]> = Vec::new();
    for k in 0..polygon.len() {
        let (a, b) = (polygon[k], polygon[(k + 1) % polygon.len()]);
        if a != b && distance[a] == 0.0 {
            found.push([a, a]);
        }
        if distance[a] * distance[b] < 0.0 {
            found.push([a.min(b), a.max(b)]);
        }
    }
    found.dedup();
    match found[..] {
        [a, b] if a != b => Some([a, b]),
        _ => None,
    }
}

/// Lines through linked points, in the order of their first points.
fn chains(links: &BTreeMap<[usize; 2], Vec<[usize; 2]>>) -> Vec<Vec<[usize; 2]>> {
    let mut seen = std::collections::BTreeSet::new();
    let open = links.iter().filter(|(_, others)| others.len() == 1).map(|(key, _)| *key);
    let mut out = Vec::new();
    for start in open.chain(links.keys().copied()) {
        let mut chain = Vec::new();
        let mut next = Some(start);
        while let Some(key) = next.filter(|key| seen.insert(*key)) {
            chain.push(key);
            next = links[&key].iter().find(|other| !seen.contains(*other)).copied();
        }
        if chain.len() > 1 {
            out.push(chain);
        }
    }
    out
}

/// The line through these points.
fn measured(keys: &[[usize; 2]], distance: &[f64], middle: &[Vec3]) -> SectionLine {
    let point = |&[a, b]: &[usize; 2]| {
        let across = distance[a] - distance[b];
        LinePoint { columns: [a, b], weight: if a == b { 0.0 } else { distance[a] / across } }
    };
    let points: Vec<LinePoint> = keys.iter().map(point).collect();
    let at: Vec<Vec3> = points.iter().map(|p| p.at(middle)).collect();
    let mut arc = vec![0.0];
    for pair in at.windows(2) {
        arc.push(arc[arc.len() - 1] + (pair[1] - pair[0]).norm());
    }
    SectionLine { points, arc }
}

/// The line from its end with the smaller coordinate along `axis`.
fn turned(mut line: SectionLine, middle: &[Vec3], axis: usize) -> SectionLine {
    let along = |p: &LinePoint| p.at(middle)[axis];
    if along(&line.points[line.points.len() - 1]) < along(&line.points[0]) {
        let all = length(&line);
        line.points.reverse();
        line.arc = line.arc.iter().rev().map(|s| all - s).collect();
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_solver::sheet::hex_mesh::rectangle;

    #[test]
    fn a_plane_cuts_a_sheet_along_and_between_its_nodes() {
        let mesh = rectangle(10.0, 4.0, 1.0, 5, 4, 2);
        for (normal, at, count, all) in
            [(1, 0.0, 6, 10.0), (1, 2.0, 6, 10.0), (1, 1.3, 6, 10.0), (0, 10.0, 5, 4.0)]
        {
            let line = cut(&mesh, normal, at).unwrap();
            let points = line.points(&mesh, &mesh.nodes);
            assert_eq!(points.len(), count, "{normal} {at}");
            for (point, s) in points.iter().zip(&line.arc) {
                assert!((point[normal] - at).abs() < 1e-12 && (point.z - 0.5).abs() < 1e-12);
                assert!((point[1 - normal] - s).abs() < 1e-12, "{point} {s}");
            }
            assert!((line.arc[count - 1] - all).abs() < 1e-12);
        }
        assert!(cut(&mesh, 0, 11.0).is_none() && cut(&mesh, 1, -0.1).is_none());
    }

    #[test]
    fn a_line_passes_over_hanging_nodes() {
        use kanagata_solver::sheet::refine::{Refinement, plan_elements};
        let base = rectangle(10.0, 4.0, 1.0, 5, 2, 1);
        let levels = vec![0, 0, 1, 0, 2, 1, 0, 0, 0, 0];
        let mesh = Refinement::balanced(plan_elements(&base), levels).mesh(&base, None);
        // Along sides of coarse and fine elements, and between their nodes.
        for at in [0.0, 0.3, 1.0, 1.5, 2.0, 3.7, 4.0] {
            let line = cut(&mesh, 1, at).unwrap();
            assert!((line.arc.last().unwrap() - 10.0).abs() < 1e-9, "{at}: {:?}", line.arc);
        }
        for at in [3.0, 4.0, 4.2, 6.0] {
            let line = cut(&mesh, 0, at).unwrap();
            assert!((line.arc.last().unwrap() - 4.0).abs() < 1e-9, "{at}: {:?}", line.arc);
        }
    }

    #[test]
    fn a_line_follows_its_material_and_passes_over_triangles_of_a_disc() {
        use kanagata_solver::sheet::hex_mesh::{quarter_disc, thickened};
        let (points, quads) = quarter_disc(20.0, 4, 6);
        let mesh = thickened(&points, &quads, 1.0, 1);
        let line = cut(&mesh, 1, 0.0).unwrap();
        assert!((line.arc[line.arc.len() - 1] - 20.0).abs() < 1e-9);
        let line = cut(&mesh, 1, 7.0).unwrap();
        let chord = (400.0_f64 - 49.0).sqrt();
        assert!((line.arc[line.arc.len() - 1] - chord).abs() < 0.3, "{:?}", line.arc.last());
        let moved: Vec<Vec3> = mesh.nodes.iter().map(|p| p + Vec3::new(0.0, 0.0, p.x)).collect();
        for p in line.points(&mesh, &moved) {
            assert!((p.z - 0.5 - p.x).abs() < 1e-12);
        }
    }
}
