//! The sheet in `report.html`: strains as in a forming limit diagram, and 3-D views.

use super::contents::SheetView;
use crate::geometry::Vec3;
use crate::report::charts::{Series, ValuedSurface, points, surfaces};
use crate::report::page::Page;
use crate::run::strains::Principal;
use crate::solver::sheet::hex_mesh::HexMesh;

/// Plots major over minor strain of every element, as in a forming limit diagram; nothing without strains. `released`:
/// the strains are those before the tools were released.
pub(super) fn strains(page: &mut Page, sheet: &SheetView<'_>, released: bool) {
    let Some(strains) = &sheet.strains else { return };
    let when = if released { "in the last equilibrium with tools" } else { "at the end" };
    page.heading("Major and minor strain");
    page.text(&format!(
        "Logarithmic strains of the mid-surface of every element, {when}; hover to see the element number. Dotted: uniaxial \
         tension (isotropic), plane strain, and equal biaxial stretching."
    ));
    let elements = strain_series(strains);
    let (traces, layout) =
        points(&elements, &strain_paths(&elements.y), "minor strain", "major strain");
    page.plot(&traces, &layout, 480);
}

fn strain_series(strains: &[Principal]) -> Series {
    let (x, y) = strains.iter().map(|strain| (strain.minor, strain.major)).unzip();
    Series { name: "elements".into(), x, y }
}

/// Proportional strain paths up to the largest of `major`.
fn strain_paths(major: &[f64]) -> Vec<Series> {
    let top = major.iter().copied().fold(0.0, f64::max);
    let path = |(name, minor): (&str, f64)| Series {
        name: name.into(),
        x: vec![0.0, minor * top],
        y: vec![0.0, top],
    };
    [("tension", -0.5), ("plane strain", 0.0), ("equal biaxial", 1.0)].map(path).into()
}

/// The upper face in 3-D, coloured by thickness (one value per column [mm]) and, if the material has it, by plastic
/// strain.
pub(super) fn formed(page: &mut Page, sheet: &SheetView<'_>, thickness: Vec<f64>) {
    page.heading("The formed sheet");
    let (mesh, positions) = (&*sheet.mesh, sheet.positions.as_slice());
    let mut parts = vec![ValuedSurface {
        name: "thickness".into(),
        values: thickness,
        quantity: "thickness [mm]".into(),
        ..upper_face(mesh, positions)
    }];
    if let Some(plastic) = &sheet.plastic_strain {
        parts.push(ValuedSurface {
            name: "plastic strain".into(),
            values: at_columns(mesh, plastic),
            quantity: "equivalent plastic strain".into(),
            hidden: true,
            ..upper_face(mesh, positions)
        });
        page.text("Names in the legend show and hide: thickness, plastic strain (means of the elements around a node).");
    }
    let (traces, layout) = surfaces(&parts);
    page.plot(&traces, &layout, 620);
}

/// Elements of the top layer with the columns of their upper corners.
fn on_top(mesh: &HexMesh) -> impl Iterator<Item = (usize, [u32; 4])> {
    let levels = mesh.nodes_per_column.max(1) as u32;
    let upper = mesh.elements.iter().enumerate().map(|(k, e)| (k, [e[4], e[5], e[6], e[7]]));
    upper
        .filter(move |(_, nodes)| nodes.iter().all(|&n| n % levels == levels - 1))
        .map(move |(k, nodes)| (k, nodes.map(|n| n / levels)))
}

/// Mean of the top-layer elements around each column.
fn at_columns(mesh: &HexMesh, values: &[f64]) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); mesh.column_count()];
    for (element, columns) in on_top(mesh) {
        for column in columns {
            let (sum, count) = &mut sums[column as usize];
            *sum += values[element];
            *count += 1.0;
        }
    }
    sums.iter().map(|(sum, count)| sum / count).collect()
}

/// The upper face of the sheet, without values.
fn upper_face(mesh: &HexMesh, positions: &[Vec3]) -> ValuedSurface {
    ValuedSurface {
        points: mesh.top_nodes().iter().map(|&n| positions[n as usize]).collect(),
        triangles: on_top(mesh).flat_map(|(_, [a, b, c, d])| [[a, b, c], [a, c, d]]).collect(),
        opacity: 1.0,
        ..ValuedSurface::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::report::contents::middle;
    use crate::run::strains::of_elements;
    use crate::solver::sheet::hex_mesh::rectangle;

    #[test]
    fn strains_are_drawn_over_the_paths_to_the_largest() {
        let mesh = rectangle(2.0, 1.0, 1.0, 2, 1, 1);
        let wide = |x: &Vec3| [0.1 * x.x, if x.x > 1.5 { -0.05 * x.y } else { 0.0 }, 0.0];
        let u: Vec<f64> = mesh.nodes.iter().flat_map(wide).collect();
        let series = strain_series(&middle(&of_elements(&mesh, &u)));
        assert_eq!((series.x.len(), series.y.len()), (2, 2));
        assert!(series.x[0] == 0.0 && series.x[1] < -0.02, "{series:?}");
        assert!((series.y[0] - 1.1_f64.ln()).abs() < 1e-14, "{series:?}");
        let paths = strain_paths(&series.y);
        let top = series.y.iter().copied().fold(0.0, f64::max);
        assert_eq!((paths[0].x[1], paths[2].x[1], paths[1].y[1]), (-0.5 * top, top, top));
    }

    #[test]
    fn values_of_the_top_layer_are_averaged_at_columns() {
        let mesh = rectangle(2.0, 1.0, 1.0, 2, 1, 2);
        // Values of the lower layer are not used.
        let values = at_columns(&mesh, &[9.0, 1.0, 9.0, 3.0]);
        assert_eq!(values, [1.0, 1.0, 2.0, 2.0, 3.0, 3.0]);
        assert_eq!(upper_face(&mesh, &mesh.nodes).triangles.len(), 4);
    }
}
