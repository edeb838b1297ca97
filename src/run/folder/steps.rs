//! VTU files of a run: sheet and tools after an increment, and their collection.

use std::sync::Arc;

use super::files::{COLLECTION, LAST, LastReport, ToolFile};
use super::{RunFolder, row};
use crate::fields::{self, SheetState};
use crate::formability::Judged;
use crate::formed::Formed;
use crate::springback::SPRINGBACK_NORMAL;
use crate::strains::of_sheet;
use crate::waves::{WAVE_OFFSET, Waves};
use kanagata_files::WriteError;
use kanagata_geometry::Vec3;
use kanagata_report::record::{HistoryRow, StepFilesRecord, WavesRecord};
use kanagata_report::{DataArray, Part, Vtu, write_pvd};
use kanagata_scene::Plan;
use kanagata_solver::sheet::hex_mesh::HexMesh;
use kanagata_solver::{IncrementReport, Simulation};

/// Most divisions of a patch in the VTU of its tool.
const TOOL_DIVISIONS_MAX: usize = 6;
/// Triangles of a tool, reached by fewer divisions where it has many patches: a file of 0.8 MB. Doubled, the files of tools
/// with more than 550 patches are twice as large.
const TOOL_TRIANGLES_MAX: usize = 40_000;

/// Divisions of each patch of a tool with so many patches.
fn divisions(patches: usize) -> usize {
    let of_one = TOOL_TRIANGLES_MAX / (2 * patches.max(1));
    of_one.isqrt().clamp(1, TOOL_DIVISIONS_MAX)
}

impl RunFolder {
    /// Sets the surfaces of the tools.
    pub fn set_tools(&mut self, plan: &Plan) {
        self.surfaces = plan.tools.iter().map(|tool| Arc::clone(&tool.surface)).collect();
    }

    /// Writes each tool at its initial position as `tools/NAME.vtu`.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full.
    pub fn write_tools(&mut self, simulation: &Simulation) -> Result<(), WriteError> {
        self.tool_files.clear();
        for (k, shift) in simulation.tool_shifts().into_iter().enumerate() {
            let file = format!("tools/{}.vtu", self.history.tools[k]);
            self.write_tool(k, &file, &shift)?;
            let shift = shift.into();
            self.tool_files.push(ToolFile { file: file.clone(), shift, first: (file, shift) });
        }
        self.record.files.tools = self.tool_files.iter().map(|tool| tool.file.clone()).collect();
        Ok(())
    }

    fn write_tool(&self, tool: usize, file: &str, shift: &Vec3) -> Result<(), WriteError> {
        let Some(surface) = self.surfaces.get(tool) else { return Ok(()) };
        let model = surface.model();
        fields::tool(model, divisions(model.patches.len()), shift).write(&self.path.join(file))
    }

    /// Writes the tools that have moved since their last file. Returns the file of each tool.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full.
    fn write_moved_tools(
        &mut self,
        report: &IncrementReport<'_>,
    ) -> Result<Vec<String>, WriteError> {
        self.tool_files.resize_with(report.tools.len(), ToolFile::default);
        for (k, tool) in report.tools.iter().enumerate() {
            let known = &self.tool_files[k];
            let same = |shift: &[f64; 3]| shift.map(f64::to_bits) == tool.shift.map(f64::to_bits);
            // A file may have been removed since a restart.
            if same(&known.shift) && self.path.join(&known.file).is_file() {
                continue;
            }
            let back = same(&known.first.1) && self.path.join(&known.first.0).is_file();
            let file = if back {
                known.first.0.clone()
            } else {
                let file = format!("tools/{}.{:06}.vtu", tool.name, report.increment);
                self.write_tool(k, &file, &tool.shift.into())?;
                file
            };
            let known = &mut self.tool_files[k];
            (known.file, known.shift) = (file, tool.shift);
        }
        Ok(self.tool_files.iter().map(|tool| tool.file.clone()).collect())
    }

    /// Writes sheet and tools after an increment, and the collection; `limits` are the arrays of the forming limit diagram.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full.
    pub(super) fn write_step(
        &mut self,
        report: &IncrementReport<'_>,
        formed: &Formed,
        limits: Vec<DataArray>,
    ) -> Result<(), WriteError> {
        let state = SheetState {
            body: report.body,
            displacements: report.displacements,
            contact_forces: report.contact_forces,
            contacts: Some(report.node_contacts),
            face_depths: report.face_depths,
        };
        let sheet = format!("steps/{:06}.vtu", report.increment);
        let mut grid = fields::sheet(&state, formed);
        grid.cell_data.extend(limits);
        grid.point_data.extend(self.springback_map(report.body.mesh(), report.displacements));
        self.update_waves(report);
        grid.point_data.extend(self.wave_array());
        grid.field_data = self.field_data(&row(report));
        grid.write(&self.path.join(&sheet))?;
        let tools = self.write_moved_tools(report)?;
        let steps = &mut self.record.files.steps;
        if steps.last().is_none_or(|last| last.sheet != sheet) {
            let (increment, time) = (report.increment, report.time);
            steps.push(StepFilesRecord { increment, time, sheet, tools });
        }
        self.write_collection()
    }

    /// The map of the springback, if the tools are released.
    fn springback_map(&self, mesh: &HexMesh, displacements: &[f64]) -> Option<DataArray> {
        self.record.springback.as_ref()?;
        let map = self.springback.along_normal(mesh, displacements);
        (!map.is_empty()).then(|| DataArray::scalar(SPRINGBACK_NORMAL, map))
    }

    /// Offsets of waves in the last equilibrium, if they were determined there.
    pub(crate) fn wave_offsets(&self) -> Option<Vec<f64>> {
        self.waves.at_nodes().filter(|_| self.waves.increment == self.record.increments)
    }

    fn wave_array(&self) -> Option<DataArray> {
        Some(DataArray::scalar(WAVE_OFFSET, self.wave_offsets()?))
    }

    /// Determines the offsets of waves after an increment with tools, and records the largest.
    fn update_waves(&mut self, report: &IncrementReport<'_>) {
        self.waves = Waves::of(report, &self.surfaces);
        let Some(found) = self.waves.largest(report) else { return };
        let larger = |known: &WavesRecord| found.offset_mm > known.largest.offset_mm;
        let is_larger = self.record.waves.as_ref().is_none_or(larger);
        let known = self.record.waves.take().map(|known| known.largest);
        let largest =
            if is_larger { found.clone() } else { known.unwrap_or_else(|| found.clone()) };
        self.record.waves = Some(WavesRecord { largest, last: found });
    }

    /// Time, increment, and travel and force of each tool.
    fn field_data(&self, row: &HistoryRow) -> Vec<DataArray> {
        let increment = i32::try_from(row.increment).unwrap_or(i32::MAX);
        let mut data = vec![
            DataArray::scalar("TimeValue", vec![row.time]),
            DataArray::integer("increment", vec![increment]),
        ];
        let values = row.travel_mm.iter().zip(&row.force_n);
        for (name, (travel, force)) in self.history.tools.iter().zip(values) {
            data.push(DataArray::scalar(format!("{name}_travel_mm"), vec![*travel]));
            data.push(DataArray::scalar(format!("{name}_force_n"), vec![*force]));
        }
        data
    }

    /// Writes the collection of all steps: the sheet is part 0, tools follow in the order of the scene.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full.
    pub(super) fn write_collection(&self) -> Result<(), WriteError> {
        let names =
            || std::iter::once("sheet").chain(self.history.tools.iter().map(String::as_str));
        let parts = |step: &StepFilesRecord| -> Vec<(String, String)> {
            names().map(str::to_owned).zip(step.paths().cloned()).collect()
        };
        let steps: Vec<_> =
            self.record.files.steps.iter().map(|step| (step.time, parts(step))).collect();
        let steps: Vec<_> = steps
            .iter()
            .map(|(time, parts)| {
                let parts = parts.iter().map(|(name, file)| Part { name, file }).collect();
                (*time, parts)
            })
            .collect();
        write_pvd(&self.path.join(COLLECTION), &steps)
    }

    /// Keeps what the last state needs from a report.
    pub(super) fn keep_report(&mut self, report: &IncrementReport<'_>) {
        let contacts = report.node_contacts.to_vec();
        let face_depths = report.face_depths.to_vec();
        self.last_report = Some(LastReport { row: row(report), contacts, face_depths });
    }

    /// Writes the state of the simulation as `steps/last.vtu`; a field marks the node with the largest residual, if
    /// given.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full.
    pub fn write_last_state(
        &mut self,
        simulation: &Simulation,
        node: Option<usize>,
    ) -> Result<(), WriteError> {
        let (body, displacements) = (simulation.body(), simulation.displacements());
        let forces = simulation.contact_forces();
        let reported = self.last_report.as_ref();
        let state = SheetState {
            body,
            displacements,
            contact_forces: &forces,
            contacts: reported.map(|last| &last.contacts[..]),
            face_depths: reported.map_or(&[], |last| &last.face_depths[..]),
        };
        let mut grid: Vtu = fields::sheet(&state, &Formed::of(body, displacements));
        let strains = of_sheet(body.mesh(), displacements);
        grid.cell_data.extend(Judged::new(&self.diagram, strains).cell_data());
        grid.point_data.extend(self.springback_map(body.mesh(), displacements));
        grid.point_data.extend(self.wave_array());
        grid.field_data = reported.map_or_else(Vec::new, |last| self.field_data(&last.row));
        if let Some(worst) = node {
            let mark = |node: usize| if node == worst { 1.0 } else { 0.0 };
            let marks = (0..body.mesh().nodes.len()).map(mark).collect();
            grid.point_data.push(DataArray::scalar("not_converged_here", marks));
        }
        grid.write(&self.path.join(LAST))?;
        self.record.files.last = Some(LAST.into());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_tools_have_fewer_divisions() {
        assert_eq!([0, 1, 555].map(divisions), [6; 3]);
        assert_eq!([556, 1250, 5000, 1_000_000].map(divisions), [5, 4, 2, 1]);
    }
}
