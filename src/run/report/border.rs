//! The border of the blank in `report.html`: before and after, and draw-in by side.

use super::contents::SheetView;
use crate::draw_in::{Border, CORNER_MIN_DEG, Side, SidePoint, borders};
use kanagata_geometry::{Vec2, Vec3};
use kanagata_report::page::Page;
use kanagata_report::plot::{Plot, Series};
use kanagata_report::record::RunRecord;

/// Rows of the table of a side.
const ROWS: usize = 12;
/// Sides whose draw-in is plotted, the longest first. More have no colours of their own.
const PLOTTED_MAX: usize = 8;

/// Name of a side of a border, numbered from 1; border 0 is the outer one.
pub(super) fn side_name(border: usize, side: usize) -> String {
    let number = side + 1;
    if border == 0 { format!("side {number}") } else { format!("hole {border}, side {number}") }
}

/// The borders of the sheet.
#[derive(Debug, Clone, Default)]
pub(super) struct Drawn {
    /// In the last equilibrium with tools; at the end where that is not known.
    pub(super) borders: Vec<Border>,
    /// At the end, if all tools have been released since.
    pub(super) released: Option<Vec<Border>>,
}

impl Drawn {
    /// Of a sheet with these symmetry planes.
    pub(super) fn new(record: &RunRecord, sheet: &SheetView<'_>, planes: &[(usize, f64)]) -> Self {
        let of = |positions: &[Vec3]| borders(&sheet.mesh, positions, planes);
        match &sheet.held {
            Some(held) if record.springback.is_some() => {
                Self { borders: of(held), released: Some(of(&sheet.positions)) }
            }
            _ => Self { borders: of(&sheet.positions), released: None },
        }
    }
}

/// Plots the borders before and after and the draw-in along each side, and writes them as numbers; nothing for a blank
/// without a border in plan.
pub(super) fn draw_in(page: &mut Page, drawn: &Drawn) {
    let borders = &drawn.borders;
    let Some(outer) = borders.first() else { return };
    page.heading("Draw-in");
    let when = match drawn.released {
        Some(_) => "in the last equilibrium with tools",
        None => "at the end of the run",
    };
    page.text(&format!(
        "Border of the blank (dotted) and of the sheet {when}, in plan. The draw-in of a side is the displacement \
         along the inward normal of that side of the blank. Sides end at corners, where the border turns by more than \
         {CORNER_MIN_DEG:.0} degrees; a corner belongs to both sides."
    ));
    page.plot(&in_plan(borders), 480);
    extremes(page, borders);
    if let Some(far) = outer.farthest_moved() {
        page.text(&format!(
            "Largest displacement of the outer border in plan, in any direction: {:.3} mm at {} of the blank.",
            (far.now - far.initial).norm(),
            place(far.initial)
        ));
    }
    let along = along_sides(&outer.sides);
    page.plot(&Plot::lines(along, "along the outer border of the blank [mm]", "draw-in [mm]"), 300);
    page.folded("Draw-in along the sides as numbers", |page| numbers(page, borders));
}

/// The borders before and after.
fn in_plan(borders: &[Border]) -> Plot {
    let of = |name: &str, border: &Border, initial: bool| {
        let at = border.points.iter().map(|p| if initial { p.initial } else { p.now });
        let (x, y) = at.map(|p| (p.x, p.y)).unzip();
        Series { name: name.into(), x, y }
    };
    let mut plot = Plot::lines(Vec::new(), "x [mm]", "y [mm]");
    plot.equal = true;
    for (k, border) in borders.iter().enumerate() {
        let name = |what: &str| {
            if k == 0 { what.to_owned() } else { format!("{what}, hole {k}") }
        };
        plot.guide(of(&name("blank"), border, true));
        plot.line(of(&name("sheet"), border, false));
    }
    plot
}

/// Draw-in of the longest sides over the length along the border, in their order.
fn along_sides(sides: &[Side]) -> Vec<Series> {
    let mut longest: Vec<usize> = (0..sides.len()).collect();
    longest.sort_by(|&a, &b| sides[b].length_mm().total_cmp(&sides[a].length_mm()));
    longest.truncate(PLOTTED_MAX);
    longest.sort_unstable();
    let series = |k: usize| {
        let points = sides[k].points.iter().map(|p| (p.point.arc_mm, p.draw_in));
        let (x, y) = points.unzip();
        Series { name: side_name(0, k), x, y }
    };
    longest.into_iter().map(series).collect()
}

fn place(at: Vec2) -> String {
    format!("({:.1}, {:.1}) mm", at.x, at.y)
}

/// A place in a cell of a table, which does not break.
fn cell(at: Vec2) -> String {
    format!("({:.1},\u{a0}{:.1})", at.x, at.y)
}

/// A table with the smallest and largest draw-in of each side.
fn extremes(page: &mut Page, borders: &[Border]) {
    let of = |p: SidePoint| [format!("{:.3}", p.draw_in), cell(p.point.initial)];
    let row = |name: String, side: &Side| {
        let [least, most] = side.extremes()?;
        let (first, last) = (side.points.first()?, side.points.last()?);
        let from = [cell(first.point.initial), cell(last.point.initial)];
        let ends = [name].into_iter().chain(from).chain([format!("{:.1}", side.length_mm())]);
        Some(ends.chain(of(most)).chain(of(least)).collect::<Vec<String>>())
    };
    let rows: Vec<Vec<String>> =
        all_sides(borders).filter_map(|(name, side)| row(name, side)).collect();
    let head = [
        "side",
        "from [mm]",
        "to [mm]",
        "length [mm]",
        "largest draw-in [mm]",
        "at [mm]",
        "smallest draw-in [mm]",
        "at [mm]",
    ];
    page.table(&head, &rows);
}

/// The sides of all borders with their names.
fn all_sides(borders: &[Border]) -> impl Iterator<Item = (String, &Side)> {
    let of = |(b, border): (usize, &'_ Border)| (b, border.sides.len());
    let counts: Vec<(usize, usize)> = borders.iter().enumerate().map(of).collect();
    let places = counts.into_iter().flat_map(|(b, sides)| (0..sides).map(move |k| (b, k)));
    places.map(|(b, k)| (side_name(b, k), &borders[b].sides[k]))
}

/// A table of points along each side.
fn numbers(page: &mut Page, borders: &[Border]) {
    let row = |name: &str, p: &SidePoint| {
        let at = p.point;
        let values = [at.arc_mm, at.initial.x, at.initial.y, at.now.x, at.now.y, p.draw_in];
        let values = values.iter().map(|v| format!("{v:.3}"));
        [name.to_owned()].into_iter().chain(values).collect::<Vec<String>>()
    };
    let mut rows: Vec<Vec<String>> = Vec::new();
    for (name, side) in all_sides(borders) {
        let last = side.points.len().saturating_sub(1);
        let every = side.points.len().div_ceil(ROWS).max(1);
        let chosen = (0..=last).filter(|k| k % every == 0 || *k == last);
        rows.extend(chosen.filter_map(|k| side.points.get(k)).map(|p| row(&name, p)));
    }
    let head = [
        "side",
        "along the border [mm]",
        "x of the blank",
        "y",
        "x at the end",
        "y",
        "draw-in [mm]",
    ];
    page.table(&head, &rows);
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_report::record::SpringbackRecord;
    use kanagata_solver::sheet::hex_mesh::rectangle;

    /// The corner of two sides that move by 0.5 and 0.1 mm is in the rows of both, with the draw-in of each.
    #[test]
    fn a_corner_has_a_row_for_each_of_its_sides() {
        let mesh = rectangle(10.0, 4.0, 1.0, 5, 2, 1);
        let moved: Vec<_> = mesh
            .nodes
            .iter()
            .map(|x| x - kanagata_geometry::Vec3::new(0.05 * x.x, 0.025 * x.y, 0.0))
            .collect();
        let mut page = Page::new("a");
        let drawn = Drawn { borders: borders(&mesh, &moved, &[]), released: None };
        draw_in(&mut page, &drawn);
        let html = page.html();
        for (side, value) in [(2, "0.500"), (3, "0.100")] {
            let row = format!("<td>side {side}</td>");
            let rows: Vec<&str> =
                html.split("<tr>").filter(|text| text.starts_with(&row)).collect();
            let at_corner = rows
                .iter()
                .filter(|text| text.contains(">10.000</td>") && text.contains(">4.000</td>"));
            for text in at_corner.clone() {
                assert!(text.contains(&format!(">{value}</td>")), "{text}");
            }
            assert_eq!(at_corner.count(), 1);
        }
        assert!(html.contains("in any direction: 0.510 mm at (10.0, 4.0) mm"));
        assert_eq!(along_sides(&drawn.borders[0].sides).len(), 4);
    }

    /// An end that is drawn in by 0.5 mm and springs back by 0.2 mm.
    #[test]
    fn draw_in_is_that_with_tools_where_they_are_released() {
        let mesh = rectangle(10.0, 4.0, 1.0, 5, 2, 1);
        let drawn_by = |by: f64| -> Vec<Vec3> {
            mesh.nodes.iter().map(|x| x - Vec3::new(by * x.x / 10.0, 0.0, 0.0)).collect()
        };
        let sheet = |held: Option<Vec<Vec3>>| SheetView {
            shape: None,
            mesh: std::borrow::Cow::Borrowed(&mesh),
            positions: drawn_by(0.3),
            held,
            strains: None,
            plastic_strain: None,
            springback: None,
            waves: None,
        };
        let largest = |borders: &[Border]| borders[0].extremes().unwrap()[1].1.draw_in;
        let mut record = RunRecord::default();
        let kept = Drawn::new(&record, &sheet(Some(drawn_by(0.5))), &[]);
        assert!(kept.released.is_none() && (largest(&kept.borders) - 0.3).abs() < 1e-12);
        record.springback = Some(SpringbackRecord {
            largest_mm: 0.2,
            rms_mm: 0.1,
            force_n: 0.0,
            energy_nmm: 0.0,
            from_increment: Some(1),
            normal_max: None,
            normal_min: None,
        });
        let released = Drawn::new(&record, &sheet(Some(drawn_by(0.5))), &[]);
        assert!((largest(&released.borders) - 0.5).abs() < 1e-12);
        assert!((largest(released.released.as_deref().unwrap()) - 0.3).abs() < 1e-12);
        assert!(Drawn::new(&record, &sheet(None), &[]).released.is_none());
    }
}
