//! The accuracy of Nagata patches on exact shapes, against tables computed independently.

mod order;
mod saddle;
mod shapes;
mod slivers;
mod traps;

use std::f64::consts::FRAC_PI_2;

use kanagata::audit::{AuditOptions, AuditReport, ReferenceSurface, audit};
use kanagata::geometry::Vec3;
use kanagata::tool::{ToolKind, ToolModel};
use shapes::{Cells, Cylinder, Sphere, Torus, grid, octant, rectangle};

fn report(tool: &ToolModel, reference: &impl ReferenceSurface) -> AuditReport {
    let options = AuditOptions { samples: 16, ..AuditOptions::default() };
    audit(tool, reference, &options).unwrap().report
}

const FILLET: Torus = Torus { line: 17.0, tube: 7.0 };

/// A quarter of the fillet a quarter of the way round: from its top to where it is nearest to the axis
/// (hyperbolic) or farthest from it (elliptic).
fn fillet(n: u32, cells: Cells, hyperbolic: bool) -> ToolModel {
    let start = if hyperbolic { FRAC_PI_2 } else { 0.0 };
    grid(n, cells, |s, t| {
        let (theta, phi) = (FRAC_PI_2 * s, start + FRAC_PI_2 * t);
        (FILLET.point(theta, phi), Torus::normal(theta, phi))
    })
}

/// A row of the table: cells along a side, largest and smallest error [mm], largest normal error and largest
/// normal jump across a shared edge [degrees], each as printed.
type Row = (u32, [&'static str; 4]);

/// Within 2 %, or within the rounding of a printed figure (half a unit of its last digit).
fn agrees(found: f64, printed: &str) -> bool {
    let Ok(expected) = printed.parse::<f64>() else { return printed.is_empty() };
    let digits = printed.split_once('.').map_or(0, |(_, d)| d.len() as i32);
    let allowed = (0.02 * expected.abs()).max(0.501 * 10f64.powi(-digits));
    (found - expected).abs() <= allowed
}

fn check(what: &str, r: &AuditReport, printed: [&str; 4]) {
    let found = [r.max_mm, r.min_mm, r.normal_max_deg, r.jumps.normal_deg];
    println!("{what}: {found:.4?} against {printed:?}");
    for (f, p) in found.into_iter().zip(printed) {
        assert!(agrees(f, p), "{what}: {f} against {p}");
    }
}

fn table(hyperbolic: bool, cells: Cells, rows: [Row; 3]) {
    for (n, printed) in rows {
        let r = report(&fillet(n, cells, hyperbolic), &FILLET);
        check(&format!("{n} x {n} {cells:?}, hyperbolic {hyperbolic}"), &r, printed);
        assert!(r.jumps.position_mm < 1e-13, "neighbours share their edges");
    }
}

#[test]
fn torus_fillet_in_quads() {
    table(
        true,
        Cells::Quads,
        [
            (2, ["+0.2007", "-0.031", "4.9", "7.3"]),
            (4, ["+0.0145", "-0.002", "0.67", "1.2"]),
            (8, ["+0.0009", "", "0.09", "0.17"]),
        ],
    );
    table(
        false,
        Cells::Quads,
        [
            (2, ["+0.119", "-0.192", "10.4", "10.3"]),
            (4, ["+0.011", "-0.014", "1.6", "2.7"]),
            (8, ["+0.0008", "", "0.21", "0.40"]),
        ],
    );
}

#[test]
fn torus_fillet_in_triangles() {
    for cells in [Cells::Triangles, Cells::TrianglesAcross] {
        table(
            true,
            cells,
            [
                (2, ["+0.185", "-0.074", "23", "19"]),
                (4, ["+0.0208", "-0.015", "4.0", "2.0"]),
                (8, ["+0.0025", "-0.002", "0.85", "0.24"]),
            ],
        );
        table(
            false,
            cells,
            [
                (2, ["+0.119", "-0.134", "13", "11"]),
                (4, ["+0.018", "-0.018", "3.6", "1.8"]),
                (8, ["+0.0024", "", "0.83", "0.24"]),
            ],
        );
    }
}

#[test]
fn sphere_octant_in_triangles() {
    for (n, position, normal) in
        [(1, "6.07", "19.5"), (2, "1.04", "5.05"), (4, "0.095", "0.84"), (8, "0.0066", "0.115")]
    {
        let r = report(&octant(n), &Sphere(1.0));
        println!("{} triangles: {} % {} deg", r.patches, 100.0 * r.max_mm, r.normal_max_deg);
        assert_eq!(r.patches as u32, n * n);
        assert!(agrees(100.0 * r.max_mm, position) && agrees(r.normal_max_deg, normal));
    }
}

/// The largest error of an arc of half angle h is `R (1 - cos h)^2 / (2 cos h)`, outward.
#[test]
fn arcs_have_the_closed_form() {
    let radius: f64 = 7.0;
    for h in [FRAC_PI_2 / 2.0, 0.4, 0.2, 0.1, 0.02, 1e-3] {
        let tool = grid(1, Cells::Quads, |s, t| {
            let a = h * (2.0 * s - 1.0);
            let n = Vec3::new(a.sin(), 0.0, a.cos());
            (n * radius + Vec3::y() * t, n)
        });
        let r = report(&tool, &Cylinder(radius));
        let exact = radius * (1.0 - h.cos()).powi(2) / (2.0 * h.cos());
        assert!((r.max_mm - exact).abs() < 1e-9 * radius, "h {h}: {} {exact}", r.max_mm);
        assert!(r.min_mm > -1e-14);
    }
}

/// Half a unit of the last digit printed.
fn rounds_to(found: f64, printed: &str) -> bool {
    let digits = printed.split_once('.').map_or(0, |(_, d)| d.len() as i32);
    (found - printed.parse::<f64>().unwrap()).abs() <= 0.5 * 10f64.powi(-digits) + 1e-9
}

/// One patch over an arc: position error [% of R] and normal error [degrees], Nagata and flat facet, as printed.
#[test]
fn arcs_and_their_facets_have_the_errors_of_the_table() {
    for (degrees, nagata, facet) in [
        (90.0, ["6.06602", "6.63"], ["29.29", "45"]),
        (45.0, ["0.31359", "0.703"], ["7.61", "22.5"]),
        (30.0, ["0.06010", "0.202"], ["3.41", "15"]),
        (22.5, ["0.01882", "0.085"], ["1.92", "11.25"]),
        (15.0, ["0.00369", "0.025"], ["0.856", "7.5"]),
    ] {
        for (kind, side, printed) in
            [(ToolKind::Nagata, 1.0, nagata), (ToolKind::Facets, -1.0, facet)]
        {
            let tool = rectangle([1, 1], Cells::Quads, kind, |s, t| {
                let a = f64::to_radians(degrees * (s - 0.5));
                let n = Vec3::new(a.sin(), 0.0, a.cos());
                (n * 7.0 + Vec3::y() * t, n)
            });
            let r = report(&tool, &Cylinder(7.0));
            let found = [100.0 * r.worst_mm() / 7.0, r.normal_max_deg];
            println!("{degrees} {kind:?}: {found:.6?} against {printed:?}");
            for (f, p) in found.into_iter().zip(printed) {
                assert!(rounds_to(f, p), "{degrees} {kind:?}: {f} against {p}");
            }
            let other = if side > 0.0 { r.min_mm } else { r.max_mm };
            assert!(other.abs() < 1e-13, "all of it outward, or inward: {other}");
        }
    }
}

/// The hyperbolic corner of a 7 mm fillet whose centre line has a radius of 27 mm: fewest patches in a grid.
#[test]
fn a_torus_corner_takes_sixteen_times_the_facets() {
    const CORNER: Torus = Torus { line: 27.0, tube: 7.0 };
    let worst = |kind: ToolKind, cells: [u32; 2]| {
        let tool = rectangle(cells, Cells::Quads, kind, |s, t| {
            let (theta, phi) = (FRAC_PI_2 * s, FRAC_PI_2 * (1.0 + t));
            (CORNER.point(theta, phi), Torus::normal(theta, phi))
        });
        let options = AuditOptions { samples: 4, ..AuditOptions::default() };
        audit(&tool, &CORNER, &options).unwrap().report.worst_mm()
    };
    // Error falls with each direction's divisions: for every n the first m that keeps the tolerance.
    let fewest = |kind: ToolKind, tol: f64, most: u32| {
        let first =
            |n: u32| (1..=most / n).find(|&m| worst(kind, [n, m]) <= tol).map(|m| (n * m, [n, m]));
        (1..=most).filter_map(first).min().unwrap()
    };
    for (tol, nagata, facets) in [(0.01, [6, 4], 375), (0.03, [5, 3], 135), (0.1, [4, 2], 40)] {
        let smooth = fewest(ToolKind::Nagata, tol, 40);
        let flat = fewest(ToolKind::Facets, tol, facets + 20);
        println!("{tol} mm: {smooth:?} Nagata quads, {flat:?} bilinear facets");
        assert_eq!(smooth, (nagata[0] * nagata[1], nagata), "{tol} mm");
        assert_eq!(flat.0, facets, "{tol} mm");
    }
}
