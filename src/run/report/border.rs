//! The border of the blank in `report.html`: before and after, and draw-in along it.

use crate::report::page::Page;
use crate::report::plot::{Plot, Series};
use crate::run::draw_in::Border;

/// Rows of the table of a border.
const ROWS: usize = 24;

/// Plots the borders before and after, and writes the draw-in along the outer one as numbers; nothing for a blank
/// without a border in plan.
pub(super) fn draw_in(page: &mut Page, borders: &[Border]) {
    let Some(outer) = borders.first() else { return };
    page.heading("Draw-in");
    page.text(
        "Border of the blank (dotted) and of the sheet at the end, in plan. Draw-in is the displacement along the inward \
         normal of the blank's border.",
    );
    let of = |name: &str, border: &Border, initial: bool| {
        let at = border.iter().map(|p| if initial { p.initial } else { p.now });
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
    page.plot(&plot, 480);
    let every = outer.len().div_ceil(ROWS).max(1);
    let row = |p: &crate::run::draw_in::BorderPoint| {
        [p.arc_mm, p.initial.x, p.initial.y, p.now.x, p.now.y, p.draw_in]
            .map(|v| format!("{v:.3}"))
            .to_vec()
    };
    let rows: Vec<Vec<String>> = outer.iter().step_by(every).map(row).collect();
    page.folded("Draw-in along the outer border as numbers", |page| {
        let head =
            ["along the border [mm]", "x of the blank", "y", "x at the end", "y", "draw-in [mm]"];
        page.table(&head, &rows);
    });
}
