//! What the page of a run shows, apart from where it comes from.

use std::borrow::Cow;

use super::steps::{self, Step};
use super::tools::ToolView;
use crate::fields;
use crate::folder::RunFolder;
use crate::strains::{ElementStrains, Principal, of_elements};
use kanagata_geometry::Vec3;
use kanagata_report::record::{History, RunRecord};
use kanagata_scene::Plan;
use kanagata_scene::types::BlankShape;
use kanagata_solver::Simulation;
use kanagata_solver::assembly::ElementState;
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// Everything that the page of a run shows.
pub(super) struct Contents<'a> {
    /// Content of `run.json`.
    pub(super) record: &'a RunRecord,
    /// Content of `history.csv`.
    pub(super) history: &'a History,
    /// The scene with what it names; `None` if it cannot be used.
    pub(super) plan: Option<&'a Plan>,
    /// The sheet at the end; `None` if its state is unknown.
    pub(super) sheet: Option<SheetView<'a>>,
    /// Earlier states of sheet and tools, in time.
    pub(super) steps: Vec<Step>,
    /// Symmetry planes of the model: axis and coordinate [mm].
    pub(super) symmetry: Vec<(usize, f64)>,
    /// The tools.
    pub(super) tools: Vec<ToolView>,
    /// Parts that the page lacks, each with the reason.
    pub(super) missing: Vec<String>,
}

/// The sheet at the end of a run.
pub(super) struct SheetView<'a> {
    /// Shape of the blank in the scene; `None` if unknown.
    pub(super) shape: Option<&'a BlankShape>,
    /// The undeformed mesh.
    pub(super) mesh: Cow<'a, HexMesh>,
    /// Positions of the nodes [mm].
    pub(super) positions: Vec<Vec3>,
    /// Positions of the nodes in the last equilibrium with tools [mm]; `None` if unknown.
    pub(super) held: Option<Vec<Vec3>>,
    /// Strains of the mid-surface of every element in the last equilibrium with tools; `None` if unknown.
    pub(super) strains: Option<Vec<Principal>>,
    /// Mean equivalent plastic strain of every element; `None` for an elastic material.
    pub(super) plastic_strain: Option<Vec<f64>>,
    /// Displacement of every node along the normal since the last equilibrium with tools [mm]; `None` with tools.
    pub(super) springback: Option<Vec<f64>>,
    /// Offset of waves at every node [mm], NaN where it is not evaluated; `None` if unknown.
    pub(super) waves: Option<Vec<f64>>,
}

impl SheetView<'_> {
    /// Thickness of every column [mm].
    pub(super) fn thickness(&self) -> Vec<f64> {
        fields::column_thickness(&self.mesh, &self.positions)
    }
}

impl<'a> Contents<'a> {
    /// The contents at the end of a run.
    pub(super) fn of_simulation(
        folder: &'a RunFolder,
        plan: &'a Plan,
        simulation: &'a Simulation,
    ) -> Self {
        let (body, now) = (simulation.body(), simulation.displacements());
        let mesh = body.mesh();
        let released = folder.record.springback.is_some();
        let held = if released { folder.springback.held() } else { now };
        let states = body.element_states();
        let plastic =
            |states: Vec<ElementState>| states.iter().map(|s| s.mean.plastic_strain).collect();
        let sheet = SheetView {
            shape: Some(&plan.scene.blank.shape),
            mesh: Cow::Borrowed(mesh),
            positions: fields::positions(mesh, now),
            held: Some(fields::positions(mesh, held)),
            strains: Some(middle(&of_elements(mesh, held))),
            plastic_strain: states.map(plastic),
            springback: released
                .then(|| folder.springback.along_normal(mesh, now))
                .filter(|map| !map.is_empty()),
            waves: folder.wave_offsets(),
        };
        Self {
            record: &folder.record,
            history: &folder.history,
            plan: Some(plan),
            sheet: Some(sheet),
            steps: steps::read(&folder.path, &folder.history, mesh),
            symmetry: symmetry(plan),
            tools: ToolView::of_plan(plan, &simulation.tool_shifts()),
            missing: Vec::new(),
        }
    }
}

/// Symmetry planes of a scene: axis and coordinate [mm].
pub(super) fn symmetry(plan: &Plan) -> Vec<(usize, f64)> {
    plan.scene.symmetry.iter().map(|plane| (plane.normal.index(), plane.at_mm)).collect()
}

/// Strains of the mid-surfaces.
pub(super) fn middle(strains: &[ElementStrains]) -> Vec<Principal> {
    strains.iter().map(|one| one.middle).collect()
}
