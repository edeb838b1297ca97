//! Thickness along lines of the blank.

use kanagata_geometry::Vec2;
use kanagata_report::page::Page;
use kanagata_report::plot::{Plot, Series};
use kanagata_scene::types::BlankShape;
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// The chart and the position of its lines; a text instead if no row of nodes forms a line. `shape`: that of the scene,
/// if known.
pub(super) fn chart(
    page: &mut Page,
    shape: Option<&BlankShape>,
    mesh: &HexMesh,
    thickness: &[f64],
) {
    let plan = mesh.column_coordinates();
    let low = plan.iter().copied().reduce(|a, b| a.inf(&b)).unwrap_or_default();
    let (series, inside) = series(mesh, thickness);
    if series.is_empty() {
        page.text("No row of nodes lies along x or along the diagonal of the blank's box: see the thickness below, and in steps/*.vtu.");
        return;
    }
    let corner = format!("({:.1}, {:.1}) mm", low.x, low.y);
    page.text(&match (inside, shape) {
        (true, _) => "Through the middle of the blank, from rim to rim: along x (dx) and along the diagonal of its box (dxy).".into(),
        (_, Some(BlankShape::QuarterDisc { .. } | BlankShape::Disc { .. })) => format!(
            "From the middle of the disc at {corner} to its rim: along x (dx) and along the diagonal (dxy)."
        ),
        _ => format!(
            "Along the side of the blank in x (dx) and along the diagonal of its box (dxy), from their corner at {corner}."
        ),
    });
    page.plot(&Plot::lines(series, "distance along the blank [mm]", "thickness [mm]"), 380);
}

/// Thickness along the side of smallest y (dx) and along the diagonal of the blank's bounding box (dxy), if there are
/// nodes.
///
/// For a blank without nodes along that side (a whole disc), dx passes through the middle of the box and the flag is
/// true. The abscissa is the arc length along the blank: in plan, and along the slope where the blank is inclined (a
/// tube).
fn series(mesh: &HexMesh, thickness: &[f64]) -> (Vec<Series>, bool) {
    let plan = mesh.column_coordinates();
    let low = plan.iter().copied().reduce(|a, b| a.inf(&b)).unwrap_or_default();
    let high = plan.iter().copied().reduce(|a, b| a.sup(&b)).unwrap_or_default();
    let middle = 0.5 * (low + high);
    let of = |from, name, direction| along(mesh, thickness, name, (from, direction));
    let side = of(low, "dx", Vec2::x());
    let inside = side.x.len() < 3;
    let first = if inside { of(middle, "dx", Vec2::x()) } else { side };
    let all = [first, of(low, "dxy", high - low)];
    (all.into_iter().filter(|s| s.x.len() > 2).collect(), inside)
}

/// Thickness of the columns on a line in plan, given by a point and a direction, starting from the first column.
fn along(mesh: &HexMesh, thickness: &[f64], name: &str, (from, direction): (Vec2, Vec2)) -> Series {
    let plan = mesh.column_coordinates();
    let height: Vec<f64> = mesh.bottom_nodes().iter().map(|&n| mesh.nodes[n as usize].z).collect();
    let low = plan.iter().copied().reduce(|a, b| a.inf(&b)).unwrap_or_default();
    let high = plan.iter().copied().reduce(|a, b| a.sup(&b)).unwrap_or_default();
    let near = 1e-6 * (high - low).norm();
    let line = direction.normalize();
    let on = |&k: &usize| line.perp(&(plan[k] - from)).abs() <= near;
    let place = |k: usize| Vec2::new(line.dot(&(plan[k] - from)), height[k]);
    // Columns above each other are sorted by height.
    let rounded = |k: usize| Vec2::new((place(k).x / near).round(), height[k]);
    let mut columns: Vec<usize> = (0..plan.len()).filter(on).collect();
    columns.sort_by(|&a, &b| {
        let [a, b] = [a, b].map(rounded);
        a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y))
    });
    let mut last = columns.first().map_or(Vec2::zeros(), |&k| place(k));
    let mut arc_length = 0.0;
    let mut x = Vec::with_capacity(columns.len());
    for &k in &columns {
        arc_length += (place(k) - last).norm();
        last = place(k);
        x.push(arc_length);
    }
    let y = columns.iter().map(|&k| thickness[k]).collect();
    Series { name: name.to_owned(), x, y }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_solver::sheet::hex_mesh::{disc, rectangle, thickened};

    #[test]
    fn thickness_is_drawn_over_the_way_along_the_blank() {
        let mut mesh = rectangle(6.0, 2.0, 1.0, 3, 2, 1);
        mesh.nodes.iter_mut().for_each(|x| x.x += 5.0);
        let thickness: Vec<f64> = (0..mesh.column_count()).map(|k| k as f64).collect();
        let ways = |mesh: &HexMesh| series(mesh, &thickness).0[0].x.clone();
        // From the corner of the blank's bounding box, at 5.
        assert_eq!(ways(&mesh), [0.0, 2.0, 4.0, 6.0]);
        // A slope of 3 in 4, then a wall.
        mesh.nodes.iter_mut().for_each(|x| x.z += 0.75 * (x.x - 5.0));
        for (a, b) in ways(&mesh).iter().zip([0.0, 2.5, 5.0, 7.5]) {
            assert!((a - b).abs() < 1e-12, "{a}");
        }
        mesh.nodes.iter_mut().for_each(|x| x.x = if x.y > 0.5 { 9.0 } else { 5.0 });
        for (a, b) in ways(&mesh).iter().zip([0.0, 1.5, 3.0, 4.5]) {
            assert!((a - b).abs() < 1e-12, "{a}");
        }
    }

    #[test]
    fn the_lines_of_a_whole_disc_go_through_its_middle() {
        let (points, quads) = disc(30.0, 4, 3);
        let mesh = thickened(&points, &quads, 1.0, 1);
        let thickness = vec![1.0; mesh.column_count()];
        let (series, inside) = series(&mesh, &thickness);
        assert!(inside);
        for one in &series {
            let last = one.x.last().unwrap();
            assert!(one.x[0] == 0.0 && (last - 60.0).abs() < 1e-9, "{}: {last}", one.name);
        }
        let shape = BlankShape::Disc { radius_mm: 30.0, core: 4, rings: 3 };
        let mut page = Page::new("disc");
        chart(&mut page, Some(&shape), &mesh, &thickness);
        let html = page.html();
        assert!(html.contains("Through the middle") && !html.contains("their corner"));
    }
}
