//! Sections of the sheet: material lines in which planes cut the undeformed middle surface, with the angles and the curl of
//! their walls. [`line`] finds the lines, [`shape`] measures them.

pub mod line;
pub mod shape;

use kanagata_geometry::{Vec2, Vec3};
use kanagata_report::record::SectionRecord;
use kanagata_scene::types::Section;
use kanagata_solver::sheet::hex_mesh::HexMesh;

use line::{SectionLine, cut};
use shape::walls;

/// The sections of a sheet whose nodes were at `held` [mm] in the last equilibrium with tools, and are at `released` after
/// that; `None` if it was not released. Planes that do not cut the sheet have no section.
#[must_use]
pub fn sections(
    mesh: &HexMesh,
    planes: &[Section],
    held: &[Vec3],
    released: Option<&[Vec3]>,
) -> Vec<SectionRecord> {
    let of = |plane: &Section| {
        let normal = plane.normal.index();
        let line = cut(mesh, normal, plane.at_mm)?;
        let held = line.points(mesh, held);
        let released = released.map(|now| line.points(mesh, now));
        Some(record(normal, plane.at_mm, &line, &held, released.as_deref()))
    };
    planes.iter().filter_map(of).collect()
}

fn record(
    normal: usize,
    at_mm: f64,
    line: &SectionLine,
    held: &[Vec3],
    released: Option<&[Vec3]>,
) -> SectionRecord {
    let flat = |points: &[Vec3]| -> Vec<Vec2> {
        points.iter().map(|p| Vec2::new(p[1 - normal], p.z)).collect()
    };
    let plain = |points: &[Vec3]| points.iter().map(|p| [p.x, p.y, p.z]).collect();
    SectionRecord {
        normal,
        at_mm,
        arc_mm: line.arc.clone(),
        walls: walls(&line.arc, &flat(held), released.map(flat).as_deref()),
        held_mm: plain(held),
        released_mm: released.map_or_else(Vec::new, plain),
    }
}
