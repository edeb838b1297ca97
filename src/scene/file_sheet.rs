//! The sheet of a mesh file.

use std::path::Path;

use super::error::SceneError;
use super::types::{Blank, MeshState};
use kanagata_geometry::Vec3;
use kanagata_mesh::io::{self, SheetElements, SheetMesh};
use kanagata_solver::sheet::columns::{from_hexahedra, oriented};
use kanagata_solver::sheet::hex_mesh::{HexMesh, thickened};

/// Relative tolerance between a thickness in the scene and that of hexahedra.
const THICKNESS_TOLERANCE_REL: f64 = 0.01;

/// The sheet of a mesh file, checked for its blank.
#[derive(Debug, Clone)]
pub enum FileSheet {
    /// Points [mm] and quadrilaterals of one orientation: a sheet without thickness.
    Quads(Vec<Vec3>, Vec<[u32; 4]>),
    /// Hexahedra.
    Solid(HexMesh),
}

impl FileSheet {
    /// The mesh of the blank.
    pub(super) fn mesh(&self, blank: &Blank) -> HexMesh {
        match self {
            Self::Quads(points, quads) => {
                thickened(points, quads, blank.thickness_mm, blank.layers)
            }
            Self::Solid(mesh) => mesh.clone(),
        }
    }
}

pub(super) fn of_file(
    blank: &Blank,
    scene: &Path,
    file: &Path,
    state: Option<MeshState>,
) -> Result<FileSheet, SceneError> {
    let at = |cause: String| SceneError::Blank { path: scene.to_path_buf(), cause };
    let sheet = io::read_sheet(file).map_err(|e| at(e.to_string()))?;
    file_sheet(blank, sheet, state).map_err(|cause| at(format!("{}: {cause}", file.display())))
}

/// The mesh of a blank from the elements of its mesh file.
///
/// # Errors
/// What was found in the file, and what is allowed. Refused are results of a formed sheet, quadrilaterals without
/// thickness, elements that form no sheet, and a thickness or layers that contradict the scene.
pub fn of_sheet(
    blank: &Blank,
    mesh: SheetMesh,
    state: Option<MeshState>,
) -> Result<HexMesh, String> {
    Ok(file_sheet(blank, mesh, state)?.mesh(blank))
}

fn file_sheet(
    blank: &Blank,
    mesh: SheetMesh,
    state: Option<MeshState>,
) -> Result<FileSheet, String> {
    if state.is_none() && !mesh.results.is_empty() {
        return Err(format!(
            "found results of a formed sheet ({}), which a blank does not take over: its stresses, plastic strains and hardening would be lost; allowed: a mesh without them, or `\"state\": \"drop\"` beside `file` for a blank free of stress in this shape",
            listed(&mesh.results)
        ));
    }
    match mesh.elements {
        SheetElements::Quads(quads) => {
            if blank.thickness_mm <= 0.0 {
                let found = "quadrilaterals and no blank.thickness_mm";
                return Err(format!("found {found}; allowed: a thickness above 0"));
            }
            let quads = oriented(&mesh.points, &quads).map_err(|e| e.to_string())?;
            Ok(FileSheet::Quads(mesh.points, quads))
        }
        SheetElements::Hexahedra { elements, stacked } => {
            let thickness = Some(blank.thickness_mm).filter(|given| *given > 0.0);
            let sheet = from_hexahedra(&mesh.points, &elements, stacked, thickness)
                .map_err(|e| e.to_string())?;
            check_solid(blank, &sheet)?;
            Ok(FileSheet::Solid(sheet))
        }
    }
}

/// Compares thickness and layers of hexahedra with those given for the blank.
fn check_solid(blank: &Blank, sheet: &HexMesh) -> Result<(), String> {
    let (given, own) = (blank.thickness_mm, sheet.mean_thickness());
    if given > 0.0 && (given - own).abs() > THICKNESS_TOLERANCE_REL * own {
        return Err(format!(
            "found hexahedra {own} mm thick and blank.thickness_mm {given}; allowed: the same, or none"
        ));
    }
    let layers = sheet.nodes_per_column.saturating_sub(1);
    if blank.layers > 1 && blank.layers != layers {
        return Err(format!(
            "found {layers} layers of hexahedra and blank.layers {}; allowed: the same, or none",
            blank.layers
        ));
    }
    Ok(())
}

/// The first names of a list, and the number of the others.
fn listed(names: &[String]) -> String {
    const NAMES_SHOWN_MAX: usize = 4;
    let shown = names[..names.len().min(NAMES_SHOWN_MAX)].join(", ");
    if names.len() > NAMES_SHOWN_MAX {
        format!("{shown} and {} more", names.len() - NAMES_SHOWN_MAX)
    } else {
        shown
    }
}
