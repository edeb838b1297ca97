//! Contents of the page from the files of a run.

use std::borrow::Cow;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::contents::{Contents, SheetView, symmetry};
use super::error::ReportError;
use super::grid;
use super::steps;
use super::tools::ToolView;
use crate::inputs::inputs;
use crate::lock;
use crate::springback::SPRINGBACK_NORMAL;
use crate::waves::WAVE_OFFSET;
use kanagata_files::{Input, read as read_file, read_text};
use kanagata_geometry::Vec3;
use kanagata_report::record::{History, RunRecord};
use kanagata_report::vtu_read::{self, Grid};
use kanagata_scene::Plan;
use kanagata_scene::read::read_with;
use kanagata_scene::set_value::SetValue;
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// The files of a run.
pub(super) struct RunFiles {
    /// The run folder.
    pub(super) folder: PathBuf,
    record: RunRecord,
    history: History,
    /// The scene; the error: why it cannot be used.
    scene: Result<PlacedScene, String>,
}

/// The scene of a run with its undeformed sheet and the tools at their initial positions.
struct PlacedScene {
    plan: Plan,
    mesh: HexMesh,
    /// Shift of each tool from the frame of its file [mm], and its unit direction of travel.
    tools: Vec<(Vec3, Vec3)>,
}

/// The run folder of `folder`: its folder `run` if only that contains a run, or the folder itself.
pub(super) fn run_folder(folder: &Path) -> PathBuf {
    let of_case = folder.join("run");
    let is_run = |folder: &Path| folder.join("run.json").is_file();
    if !is_run(folder) && is_run(&of_case) { of_case } else { folder.to_path_buf() }
}

/// Reads the files of the run in `folder`, except for its grids.
///
/// # Errors
/// [`ReportError`] except for `Write`.
pub(super) fn read(folder: &Path) -> Result<RunFiles, ReportError> {
    let path = folder.join("run.json");
    let bytes = read_file(&path, Input::Description).map_err(|source| match source.kind() {
        ErrorKind::NotFound | ErrorKind::NotADirectory => {
            ReportError::NoRun { folder: folder.to_path_buf() }
        }
        _ => ReportError::Io { path: path.clone(), source },
    })?;
    let record = RunRecord::parse(&bytes).map_err(|found| ReportError::Invalid { path, found })?;
    let lock_file = lock::file_in(folder);
    let holder =
        lock::holder(&lock_file).map_err(|source| ReportError::Io { path: lock_file, source })?;
    if let Some(holder) = holder {
        let who = holder.to_string();
        return Err(ReportError::Running { folder: folder.to_path_buf(), who });
    }
    let history = read_history(folder, record.increments)?;
    let scene = placed_scene(folder, &record);
    Ok(RunFiles { folder: folder.to_path_buf(), record, history, scene })
}

/// The history up to the last increment of `run.json`, which is written after it; empty without a file.
fn read_history(folder: &Path, increments: usize) -> Result<History, ReportError> {
    let path = folder.join("history.csv");
    let text = match read_text(&path, Input::Table) {
        Ok(text) => text,
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(History::default()),
        Err(source) => return Err(ReportError::Io { path, source }),
    };
    let mut history =
        History::parse(&text).map_err(|found| ReportError::Invalid { path, found })?;
    history.rows.retain(|row| row.increment <= increments);
    Ok(history)
}

/// The scene of a run, if it and all files it names are unchanged. The scene of a case is also found beside the run
/// folder, where the study has been moved.
fn placed_scene(folder: &Path, record: &RunRecord) -> Result<PlacedScene, String> {
    let named = record.scene.as_ref().map(PathBuf::from);
    let of_case = folder.join("../case.scene.json");
    let path = named.filter(|path| path.exists() || !of_case.exists()).unwrap_or(of_case);
    let set = record.set.iter().map(|one| one.parse::<SetValue>());
    let set: Vec<SetValue> = set.collect::<Result<_, _>>()?;
    let plan = read_with(&path, &set).map_err(|e| e.to_string())?;
    let now = inputs(&plan);
    let changed = record.inputs.iter().find(|(name, sha256)| now.get(*name) != Some(*sha256));
    if let Some((name, _)) = changed {
        return Err(format!("{name} has changed since the run"));
    }
    let mut setup = plan.simulation_setup(&path).map_err(|e| e.to_string())?;
    setup.place().map_err(|e| e.to_string())?;
    let tools = setup.tools.iter().map(|tool| (tool.offset, tool.direction)).collect();
    let mesh = setup.body.mesh().clone();
    Ok(PlacedScene { plan, mesh, tools })
}

impl RunFiles {
    /// The contents of the page.
    pub(super) fn contents(&self) -> Contents<'_> {
        let mut missing = Vec::new();
        let sheet = self.sheet(&mut missing);
        let tools = self.tools(&mut missing);
        let plan = self.scene.as_ref().ok().map(|scene| &scene.plan);
        let steps =
            sheet.as_ref().map(|sheet| steps::read(&self.folder, &self.history, &sheet.mesh));
        Contents {
            record: &self.record,
            history: &self.history,
            plan,
            sheet,
            steps: steps.unwrap_or_default(),
            symmetry: plan.map(symmetry).unwrap_or_default(),
            tools,
            missing,
        }
    }

    /// The sheet at the end, from `steps/last.vtu`.
    fn sheet(&self, missing: &mut Vec<String>) -> Option<SheetView<'_>> {
        let read = self.grid("last").and_then(|grid| Ok((self.mesh(&grid)?, grid)));
        let (mesh, grid) = match read {
            Ok(read) => read,
            Err(why) => {
                missing.push(format!("thickness, strains and formed sheet ({why})"));
                return None;
            }
        };
        let held = self.held(&grid);
        let strains = held.as_ref().map_err(Clone::clone).and_then(|held| {
            grid::strains(held).ok_or("arrays major_strain and minor_strain are missing".into())
        });
        if let Err(why) = &strains {
            missing.push(format!("strains in the last equilibrium with tools ({why})"));
        }
        if let Err(why) = &held {
            missing.push(format!("draw-in with tools ({why})"));
        }
        let held = held.ok().map(|held| held.points.clone());
        let shape = self.scene.as_ref().ok().map(|scene| &scene.plan.scene.blank.shape);
        let plastic_strain = grid::cell_values(&grid, "plastic_strain").map(<[f64]>::to_vec);
        let strains = strains.ok();
        let at_nodes = |name: &str| grid::point_values(&grid, name).map(<[f64]>::to_vec);
        let (springback, waves) = (at_nodes(SPRINGBACK_NORMAL), at_nodes(WAVE_OFFSET));
        let positions = grid.points;
        Some(SheetView { shape, mesh, positions, held, strains, plastic_strain, springback, waves })
    }

    /// A grid of the sheet.
    ///
    /// # Errors
    /// Why it cannot be used.
    fn grid(&self, name: &str) -> Result<Grid, String> {
        let file = format!("steps/{name}.vtu");
        let path = self.folder.join(&file);
        if path.exists() {
            vtu_read::read(&path).map_err(|e| e.to_string())
        } else {
            Err(format!("{file} is missing"))
        }
    }

    /// The undeformed mesh: that of the scene, or from the displacements.
    ///
    /// # Errors
    /// Why the grid is not that of the run.
    fn mesh(&self, grid: &Grid) -> Result<Cow<'_, HexMesh>, String> {
        let invalid = |found: String| format!("steps/last.vtu: found {found}");
        let Ok(scene) = &self.scene else {
            return grid::undeformed(grid).map(Cow::Owned).map_err(invalid);
        };
        let same_nodes = grid.points.len() == scene.mesh.nodes.len();
        if same_nodes && grid::elements(grid).map_err(invalid)? == scene.mesh.elements {
            return Ok(Cow::Borrowed(&scene.mesh));
        }
        Err(invalid("a mesh that is not that of the scene".into()))
    }

    /// The grid of the last equilibrium with tools: `last`, or one before the tools were released.
    ///
    /// # Errors
    /// Why it is unknown.
    fn held<'g>(&self, last: &'g Grid) -> Result<Cow<'g, Grid>, String> {
        let Some(springback) = &self.record.springback else { return Ok(Cow::Borrowed(last)) };
        let increment = springback
            .from_increment
            .ok_or("run.json lacks the increment before the tools were released")?;
        let held = self.grid(&format!("{increment:06}"))?;
        if held.cells.len() != last.cells.len() || held.points.len() != last.points.len() {
            return Err(format!("steps/{increment:06}.vtu: found another mesh"));
        }
        Ok(Cow::Owned(held))
    }

    /// The tools at their positions at the end; without the scene, at their initial positions.
    fn tools(&self, missing: &mut Vec<String>) -> Vec<ToolView> {
        let why = match &self.scene {
            Ok(scene) => {
                let last = self.history.rows.last();
                let travel = |k: usize| last.and_then(|row| row.travel_mm.get(k).copied());
                let shifts = scene.tools.iter().enumerate();
                let shift = |(k, (offset, direction)): (usize, &(Vec3, Vec3))| {
                    offset + direction * travel(k).unwrap_or(0.0)
                };
                let shifts: Vec<Vec3> = shifts.map(shift).collect();
                return ToolView::of_plan(&scene.plan, &shifts);
            }
            Err(why) => why,
        };
        missing.push(format!(
            "material, audits and final positions of the tools, which are drawn at their initial positions; the scene of \
             the run cannot be used ({why})"
        ));
        self.history.tools.iter().filter_map(|name| self.tool_of_file(name)).collect()
    }

    /// A tool at its initial position, from `tools/NAME.vtu`.
    fn tool_of_file(&self, name: &str) -> Option<ToolView> {
        // A history from elsewhere must not lead out of the folder.
        let file = format!("{name}.vtu");
        let is_name = Path::new(&file).file_name() == Some(file.as_ref());
        is_name.then(|| ToolView::of_file(name, &self.folder.join("tools").join(&file))).flatten()
    }
}
