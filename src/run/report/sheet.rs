//! The sheet in `report.html`: strains as in a forming limit diagram, and 3-D views.

use super::contents::{Contents, SheetView};
use super::steps::{self, Step};
use crate::strains::Principal;
use kanagata_geometry::Vec3;
use kanagata_report::page::Page;
use kanagata_report::plot::{Plot, Series};
use kanagata_report::record::RunRecord;
use kanagata_report::viewer::{Field, Frame, Location, Surface, View, Visibility, fans};
use kanagata_solver::material::forming_limit::LimitCurve;
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// Plots major over minor strain of every element in the forming limit diagram, with the limit curve if the card has one;
/// nothing without strains.
pub(super) fn strains(page: &mut Page, sheet: &SheetView<'_>, record: &RunRecord) {
    let Some(strains) = &sheet.strains else { return };
    let released = record.springback.is_some();
    let when = if released { "in the last equilibrium with tools" } else { "at the end" };
    let limit = limit_curve(record);
    page.heading("Forming limit diagram");
    let curve = if limit.is_empty() {
        "The material card has no forming limit, so that no curve is drawn."
    } else {
        "Line: forming limit curve of the card."
    };
    page.text(&format!(
        "Logarithmic strains of the mid-surface of every element, {when}; hover to see the element number. {curve} Dotted: \
         uniaxial tension (isotropic), plane strain, and equal biaxial stretching."
    ));
    let elements = strain_series(strains);
    let paths = strain_paths(&elements.y);
    let curve = drawn_curve(limit, &elements.x);
    let mut plot = Plot::scatter(elements, paths, "minor strain", "major strain");
    if let Some(curve) = curve {
        plot.line(curve);
    }
    page.plot(&plot, 480);
}

/// Points of the forming limit curve.
fn limit_curve(record: &RunRecord) -> &[[f64; 2]] {
    record.formability.as_ref().map_or(&[], |formed| &formed.limit_curve)
}

/// The limit curve over the minor strains that occur: to the left of its first point with slope -1, to the right of its
/// last one horizontal.
fn drawn_curve(points: &[[f64; 2]], minor: &[f64]) -> Option<Series> {
    let (first, last) = (points.first()?, points.last()?);
    let low = minor.iter().copied().fold(first[0], f64::min);
    let high = minor.iter().copied().fold(last[0], f64::max);
    let mut all = points.to_vec();
    if low < first[0] {
        all.insert(0, [low, first[1] + first[0] - low]);
    }
    if high > last[0] {
        all.push([high, last[1]]);
    }
    let (x, y) = all.into_iter().map(|[x, y]| (x, y)).unzip();
    Some(Series { name: "forming limit".into(), x, y })
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

/// The upper face in 3-D with its fields (thickness: one value per column [mm]), at every step, and the tools.
pub(super) fn formed(
    page: &mut Page,
    contents: &Contents<'_>,
    sheet: &SheetView<'_>,
    thickness: Vec<f64>,
) {
    page.heading("The formed sheet");
    let steps = &contents.steps;
    let margin = margins(sheet, limit_curve(contents.record));
    let mut surfaces = vec![surface(sheet, (thickness, margin), steps)];
    surfaces.extend(contents.tools.iter().enumerate().map(|(k, tool)| Surface {
        visibility: Visibility::Hidden,
        fields: Vec::new(),
        frames: tool.frames(k, contents.history, steps),
        ..tool.surface.clone()
    }));
    let mut names: Vec<String> = steps.iter().map(|step| step.name.clone()).collect();
    if !names.is_empty() {
        names.push(steps::name(contents.history, contents.history.rows.last()));
    }
    let symmetry = contents.symmetry.clone();
    page.view(&View { title: "The formed sheet".into(), surfaces, steps: names, symmetry });
}

/// Margin of every element to the limit curve with these points; `None` without strains or points.
fn margins(sheet: &SheetView<'_>, points: &[[f64; 2]]) -> Option<Vec<f64>> {
    let strains = sheet.strains.as_ref().filter(|_| !points.is_empty())?;
    let curve = LimitCurve::new(points.to_vec());
    let margin = |s: &Principal| 1.0 - curve.failure_ratio(s.minor, s.major);
    Some(strains.iter().map(margin).collect())
}

/// The upper face with its fields, at the end and at every step.
fn surface(
    sheet: &SheetView<'_>,
    (thickness, margin): (Vec<f64>, Option<Vec<f64>>),
    steps: &[Step],
) -> Surface {
    let mesh = &*sheet.mesh;
    let initial = crate::fields::column_thickness(mesh, &mesh.nodes);
    let thinning = |now: &[f64]| -> Vec<f64> {
        now.iter().zip(&initial).map(|(now, before)| 100.0 * (1.0 - now / before)).collect()
    };
    let field =
        |name: &str, location, values| Field { name: name.into(), location, values, signed: false };
    let mut fields = vec![
        field("thickness [mm]", Location::Points, thickness.clone()),
        field("thinning [%]", Location::Points, thinning(&thickness)),
    ];
    let more = at_nodes(sheet, steps);
    fields.extend(more.iter().map(|(name, signed, values, _)| Field {
        signed: *signed,
        ..field(name, Location::Points, upper_values(mesh, values))
    }));
    if let Some(plastic) = &sheet.plastic_strain {
        fields.push(field("equivalent plastic strain", Location::Cells, plastic.clone()));
    }
    let (has_plastic, has_margin) = (sheet.plastic_strain.is_some(), margin.is_some());
    if let Some(margin) = margin {
        fields.push(field("margin to the forming limit", Location::Cells, margin));
    }
    let frame = |step: &Step| {
        let thickness = step.thickness(mesh);
        let thinning = thinning(&thickness);
        let mut values = vec![thickness, thinning];
        values.extend(more.iter().map(|(.., of_step)| upper_values(mesh, of_step(step))));
        values.extend(has_plastic.then(|| step.plastic_strain.clone()));
        values.extend(has_margin.then(|| step.margin.clone()));
        Frame { points: upper_points(mesh, &step.positions), values, ..Frame::default() }
    };
    let frames = steps.iter().map(frame).collect();
    Surface { name: "sheet".into(), fields, frames, ..upper_face(mesh, &sheet.positions) }
}

/// Elements of the top layer with the columns of their upper corners.
fn on_top(mesh: &HexMesh) -> impl Iterator<Item = (usize, [u32; 4])> {
    let levels = mesh.nodes_per_column.max(1) as u32;
    let upper = mesh.elements.iter().enumerate().map(|(k, e)| (k, [e[4], e[5], e[6], e[7]]));
    upper
        .filter(move |(_, nodes)| nodes.iter().all(|&n| n % levels == levels - 1))
        .map(move |(k, nodes)| (k, nodes.map(|n| n / levels)))
}

/// A field with values at the nodes of the sheet: name, whether it is signed, values at the end, and those of a step.
type AtNodes<'a> = (&'static str, bool, &'a [f64], fn(&Step) -> &[f64]);

/// Springback and waves, if there are any at the end or at a step.
fn at_nodes<'a>(sheet: &'a SheetView<'_>, steps: &[Step]) -> Vec<AtNodes<'a>> {
    let springback = sheet.springback.as_deref();
    let waves = sheet.waves.as_deref();
    let has_waves = waves.is_some() || steps.iter().any(|step| !step.waves.is_empty());
    let mut found: Vec<AtNodes<'_>> = Vec::new();
    found.extend(springback.map(|map| (SPRINGBACK, true, map, of_springback as _)));
    if has_waves {
        found.push(("offset of waves [mm]", false, waves.unwrap_or_default(), of_waves));
    }
    found
}

fn of_springback(step: &Step) -> &[f64] {
    &step.springback
}

fn of_waves(step: &Step) -> &[f64] {
    &step.waves
}

/// Name of the springback in the view.
pub(super) const SPRINGBACK: &str = "springback along the normal [mm]";

/// Values at the points of the upper face; missing ones are NaN.
fn upper_values(mesh: &HexMesh, values: &[f64]) -> Vec<f64> {
    let value = |&n: &u32| values.get(n as usize).copied().unwrap_or(f64::NAN);
    mesh.top_nodes().iter().map(value).collect()
}

/// Points of the upper face.
fn upper_points(mesh: &HexMesh, positions: &[Vec3]) -> Vec<Vec3> {
    mesh.top_nodes().iter().map(|&n| positions[n as usize]).collect()
}

/// The upper face of the sheet, without values. Its cells and points have the numbers of the VTU files.
fn upper_face(mesh: &HexMesh, positions: &[Vec3]) -> Surface {
    let (elements, quads): (Vec<usize>, Vec<[u32; 4]>) = on_top(mesh).unzip();
    let (triangles, owners) = fans(quads.iter().map(|quad| &quad[..]));
    let levels = mesh.nodes_per_column.max(1) as u32;
    Surface {
        points: upper_points(mesh, positions),
        triangles,
        cells: owners.iter().map(|&quad| elements[quad as usize] as u32).collect(),
        cell_name: "element",
        numbering: [levels - 1, levels],
        ..Surface::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::contents::middle;
    use crate::strains::of_elements;
    use kanagata_solver::sheet::hex_mesh::rectangle;

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
    fn the_limit_curve_is_drawn_over_all_strains_and_gives_margins() {
        let points = [[-0.1, 0.4], [0.0, 0.3], [0.2, 0.4]];
        let curve = drawn_curve(&points, &[-0.3, 0.5]).unwrap();
        assert_eq!(curve.x, [-0.3, -0.1, 0.0, 0.2, 0.5]);
        assert!((curve.y[0] - 0.6).abs() < 1e-15 && curve.y[4] == 0.4, "{:?}", curve.y);
        assert_eq!(drawn_curve(&points, &[0.1]).unwrap().x.len(), 3);
        assert!(drawn_curve(&[], &[0.1]).is_none());
        let mesh = rectangle(2.0, 1.0, 1.0, 2, 1, 1);
        let sheet = SheetView {
            shape: None,
            mesh: std::borrow::Cow::Borrowed(&mesh),
            positions: mesh.nodes.clone(),
            held: None,
            strains: Some(vec![
                Principal { major: 0.15, minor: 0.0 },
                Principal { major: 0.6, minor: 0.0 },
            ]),
            plastic_strain: None,
            springback: None,
            waves: None,
        };
        let found = margins(&sheet, &points).unwrap();
        assert!((found[0] - 0.5).abs() < 1e-15 && (found[1] + 1.0).abs() < 1e-15, "{found:?}");
        assert!(margins(&sheet, &[]).is_none());
    }

    #[test]
    fn the_upper_face_has_the_numbers_of_the_grid() {
        let mesh = rectangle(2.0, 1.0, 1.0, 2, 1, 2);
        let face = upper_face(&mesh, &mesh.nodes);
        // The elements of the upper layer.
        assert_eq!((face.triangles.len(), &face.cells[..]), (4, &[1, 1, 3, 3][..]));
        let [first, stride] = face.numbering.map(|n| n as usize);
        for (k, point) in face.points.iter().enumerate() {
            assert_eq!(*point, mesh.nodes[first + stride * k]);
        }
    }

    #[test]
    fn thinning_is_relative_to_the_initial_thickness() {
        let mesh = rectangle(1.0, 1.0, 0.8, 1, 1, 1);
        let positions: Vec<Vec3> =
            mesh.nodes.iter().map(|x| Vec3::new(x.x, x.y, 0.9 * x.z)).collect();
        let step = Step {
            name: "start".into(),
            positions: mesh.nodes.clone(),
            plastic_strain: vec![0.0],
            margin: Vec::new(),
            springback: Vec::new(),
            waves: Vec::new(),
            travel_mm: Vec::new(),
        };
        let sheet = SheetView {
            shape: None,
            mesh: std::borrow::Cow::Borrowed(&mesh),
            positions,
            held: None,
            strains: None,
            plastic_strain: None,
            springback: None,
            waves: None,
        };
        let face = surface(&sheet, (sheet.thickness(), None), &[step]);
        assert_eq!(face.fields.len(), 2);
        assert!(face.fields[1].values.iter().all(|v| (v - 10.0).abs() < 1e-12));
        let frame = &face.frames[0].values;
        assert!(frame.len() == 2 && frame[1].iter().all(|v| v.abs() < 1e-12));
    }
}
