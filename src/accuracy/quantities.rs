//! What is compared between runs: forces, thickness, border and springback, from the files of a run.

use std::path::Path;

use super::error::AccuracyError;
use super::field::Field;
use kanagata_files::{Input, read_text};
use kanagata_geometry::Vec2;
use kanagata_report::record::{History, RunRecord};
use kanagata_report::vtu_read;
use kanagata_run::draw_in::{Border, borders};
use kanagata_scene::Plan;
use kanagata_scene::types::Drive;
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// A tool with its force over process time, in the stages that prescribe its travel.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct ForceCurve {
    pub(super) tool: String,
    /// First and last process time of each of these stages.
    pub(super) stages: Vec<[f64; 2]>,
    /// Process time and force [N], beginning with zero.
    pub(super) points: Vec<[f64; 2]>,
}

/// The border of the blank: share of its length, displacement in plan [mm].
pub(super) type BorderCurve = Vec<(f64, Vec2)>;

/// The results of a run that are compared.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Results {
    pub(super) forces: Vec<ForceCurve>,
    /// Thickness at the end [mm].
    pub(super) thickness: Field,
    /// Initial thickness [mm].
    pub(super) initial_mm: f64,
    /// The longest border; empty if the blank is not flat.
    pub(super) border: BorderCurve,
    /// Largest and root mean square of the displacements in springback [mm].
    pub(super) springback: Option<[f64; 2]>,
}

impl Results {
    /// Reads the results of a run that is done.
    ///
    /// # Errors
    /// [`AccuracyError::Results`] for a file that is missing or not of this run.
    pub(super) fn read(
        folder: &Path,
        plan: &Plan,
        record: &RunRecord,
        scene: &Path,
    ) -> Result<Self, AccuracyError> {
        let fault =
            |name: &str, found: String| AccuracyError::Results { path: folder.join(name), found };
        let text = read_text(&folder.join("history.csv"), Input::Table)
            .map_err(|e| fault("history.csv", e.to_string()))?;
        let history = History::parse(&text).map_err(|found| fault("history.csv", found))?;
        let last = "steps/last.vtu";
        let grid = vtu_read::read(&folder.join(last)).map_err(|e| fault(last, e.to_string()))?;
        let setup = plan.simulation_setup(scene).map_err(kanagata_run::RunError::from)?;
        let mesh = setup.body.mesh();
        let thickness = grid.point_data.iter().find(|a| a.name == "thickness_mm");
        let thickness = thickness.filter(|a| a.values.len() == mesh.nodes.len());
        let thickness = thickness
            .ok_or_else(|| fault(last, "no thickness at the nodes of the scene's sheet".into()))?;
        let planes: Vec<(usize, f64)> =
            plan.scene.symmetry.iter().map(|s| (s.normal.index(), s.at_mm)).collect();
        Ok(Self {
            forces: forces(plan, &history),
            thickness: Field::new(mesh, &thickness.values),
            initial_mm: mesh.mean_thickness(),
            border: border(mesh, &grid.points, &planes),
            springback: record.springback.as_ref().map(|s| [s.largest_mm, s.rms_mm]),
        })
    }
}

/// The force curves of all tools whose travel is prescribed in some stage.
fn forces(plan: &Plan, history: &History) -> Vec<ForceCurve> {
    let curve = |(k, name): (usize, &String)| {
        let driven = |drive: &Drive| matches!(drive, Drive::TravelMm(_) | Drive::AdvanceMm(_));
        let stages = plan.scene.stages.iter().enumerate();
        let stages = stages.filter(|(_, stage)| stage.drive.get(name).is_some_and(driven));
        let stages: Vec<[f64; 2]> = stages.map(|(k, _)| [k as f64, k as f64 + 1.0]).collect();
        let rows = history.rows.iter().map(|row| [row.time, row.force_n[k]]);
        let points = std::iter::once([0.0; 2]).chain(rows).collect();
        (!stages.is_empty()).then(|| ForceCurve { tool: name.clone(), stages, points })
    };
    history.tools.iter().enumerate().filter_map(curve).collect()
}

/// The longest border of a flat blank.
fn border(
    mesh: &HexMesh,
    positions: &[kanagata_geometry::Vec3],
    planes: &[(usize, f64)],
) -> BorderCurve {
    let longest: Border = borders(mesh, positions, planes).into_iter().next().unwrap_or_default();
    let length = longest.length_mm();
    if length <= 0.0 {
        return Vec::new();
    }
    longest.points.iter().map(|p| (p.arc_mm / length, p.now - p.initial)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_geometry::Vec3;
    use kanagata_solver::sheet::hex_mesh::rectangle;

    /// The value of the quantity is the farthest displacement of the border, and the draw-in where a side moves straight
    /// inwards: a strip of one element whose end moves by 9.15 mm.
    #[test]
    fn the_border_moves_as_its_draw_in_says() {
        let mesh = rectangle(60.0, 2.0, 1.0, 1, 1, 1);
        let end = |x: &Vec3| if x.x > 1.0 { x - Vec3::x() * 9.15 } else { *x };
        let moved: Vec<Vec3> = mesh.nodes.iter().map(end).collect();
        let planes = [(0, 0.0), (1, 0.0)];
        let value = border(&mesh, &moved, &planes).iter().map(|p| p.1.norm()).fold(0.0, f64::max);
        let of_run = borders(&mesh, &moved, &planes);
        let far = of_run[0].farthest_moved().unwrap();
        assert_eq!(value, (far.now - far.initial).norm());
        let [_, (_, most)] = of_run[0].extremes().unwrap();
        assert!((value - most.draw_in).abs() < 1e-12 && (value - 9.15).abs() < 1e-12);
    }
}
