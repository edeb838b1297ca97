//! Sections of the sheet in `report.html`: before and after springback, with the angles and the curl of their walls.

use kanagata_report::page::Page;
use kanagata_report::plot::{Plot, Series};
use kanagata_report::record::{SectionRecord, WallRecord};

/// Writes the sections of a run, if it has any.
pub(super) fn sections(page: &mut Page, sections: &[SectionRecord]) {
    if sections.is_empty() {
        return;
    }
    page.heading("Sections");
    page.text(
        "Middle surface along material lines: in the last equilibrium with tools (dotted) and at the end. Angles are those in the \
         corners between chords from 20 to 80 % of the lengths of bottom, wall and flange; curl is the radius of the circle through \
         the wall.",
    );
    for section in sections {
        picture(page, section);
    }
    let rows: Vec<Vec<String>> =
        sections.iter().flat_map(|s| s.walls.iter().map(|wall| row(s, wall).into())).collect();
    if !rows.is_empty() {
        let head = [
            "section",
            "wall along the line [mm]",
            "bottom to wall",
            "wall to flange",
            "curl radius [mm]",
        ];
        page.table(&head, &rows);
    }
}

/// Name of a section.
fn name(section: &SectionRecord) -> String {
    format!("{} = {} mm", ["x", "y"][section.normal], section.at_mm)
}

/// Rows of the table of answers: angles and curl of every wall.
pub(super) fn answers(sections: &[SectionRecord]) -> Vec<(String, String)> {
    let answer = |section: &SectionRecord, wall: &WallRecord| {
        let [of, arc, corner, flange, curl] = row(section, wall);
        let curl = match wall.curl_radius_mm {
            Some(_) => format!("curl radius {curl} mm"),
            None => curl,
        };
        let flange = match wall.flange_deg {
            Some(_) => format!("wall to flange {flange}"),
            None => flange,
        };
        let text = format!("bottom to wall {corner}; {flange}; {curl}");
        (format!("wall at {arc} mm of section {of}"), text)
    };
    let walls = sections.iter().flat_map(|s| s.walls.iter().map(move |wall| (s, wall)));
    walls.map(|(section, wall)| answer(section, wall)).collect()
}

fn picture(page: &mut Page, section: &SectionRecord) {
    let of = |name: String, points: &[[f64; 3]]| {
        let (x, y) = points.iter().map(|p| (p[1 - section.normal], p[2])).unzip();
        Series { name, x, y }
    };
    let along = format!("{} [mm], section {}", ["y", "x"][section.normal], name(section));
    let mut plot = Plot::lines(Vec::new(), &along, "z [mm]");
    plot.equal = true;
    if section.released_mm.is_empty() {
        plot.line(of("sheet".into(), &section.held_mm));
    } else {
        plot.guide(of("with tools".into(), &section.held_mm));
        plot.line(of("released".into(), &section.released_mm));
    }
    page.plot(&plot, 420);
}

fn row(section: &SectionRecord, wall: &WallRecord) -> [String; 5] {
    let both = |held: Option<f64>, released: Option<f64>| match (held, released) {
        (Some(a), Some(b)) => format!("{a:.2} to {b:.2} degrees ({:+.2})", b - a),
        (Some(a), None) => format!("{a:.2} degrees"),
        (None, _) => "no flange".into(),
    };
    [
        name(section),
        format!("{:.2} to {:.2}", wall.arc_mm[0], wall.arc_mm[1]),
        both(Some(wall.wall_deg), wall.released_wall_deg),
        both(wall.flange_deg, wall.released_flange_deg),
        wall.curl_radius_mm.map_or_else(|| "straight".into(), |radius| format!("{radius:.1}")),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_is_drawn_with_a_row_for_every_wall() {
        let wall = WallRecord {
            arc_mm: [30.0, 60.0],
            wall_deg: 90.0,
            released_wall_deg: Some(101.5),
            flange_deg: Some(90.0),
            released_flange_deg: Some(95.0),
            curl_radius_mm: Some(150.04),
        };
        let section = SectionRecord {
            normal: 1,
            at_mm: 0.5,
            arc_mm: vec![0.0, 30.0],
            held_mm: vec![[0.0, 0.5, 0.0], [30.0, 0.5, 0.0]],
            released_mm: vec![[0.0, 0.5, 0.0], [29.0, 0.5, 3.0]],
            walls: vec![wall, WallRecord { flange_deg: None, curl_radius_mm: None, ..wall }],
        };
        let mut page = Page::new("a");
        let found = answers(std::slice::from_ref(&section));
        assert_eq!(found[0].0, "wall at 30.00 to 60.00 mm of section y = 0.5 mm");
        assert!(found[0].1.ends_with("90.00 to 95.00 degrees (+5.00); curl radius 150.0 mm"));
        assert!(found[1].1.ends_with("(+11.50); no flange; straight"), "{}", found[1].1);
        sections(&mut page, &[section]);
        let text = page.html();
        for expected in [
            "section y = 0.5 mm",
            "90.00 to 101.50 degrees (+11.50)",
            "150.0",
            "no flange",
            "straight",
        ] {
            assert!(text.contains(expected), "{expected}");
        }
        let mut none = Page::new("a");
        sections(&mut none, &[]);
        assert!(!none.html().contains("Sections"));
    }
}
