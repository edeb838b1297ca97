//! Where a tool file comes from.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::selection::FaceSelection;

/// Where a tool file comes from.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Provenance {
    /// CAD file name.
    pub cad_file: String,
    /// SHA-256 of the CAD file, lower-case hexadecimal.
    pub cad_sha256: String,
    /// Unit of length found in the CAD file.
    pub cad_unit: String,
    /// Mesher and its options.
    pub mesher: String,
    /// Choice of faces of the CAD file from which the tool was made; absent: all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub selection: Option<FaceSelection>,
    /// Distance of the tool's surface from the CAD along its outward normals [mm]; absent: the CAD's own surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset_mm: Option<f64>,
    /// Faces of the CAD file that the tool lacks: entities that could not be read, or not be meshed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faces_lost: Vec<String>,
    /// Program and version that wrote the file.
    pub program: String,
    /// Largest |shape error| found by the audit when it was written [mm].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape_error_mm: Option<f64>,
}

/// Word of [`Provenance::mesher`] before the scene whose sheet can touch the faces of the tool.
const REACH_KEY: &str = " reach=";

impl Provenance {
    /// The words of [`Self::mesher`] for a tool of the faces `kept` of `all`, those that the sheet of `scene` can touch. A
    /// digest tells equally many other faces apart.
    #[must_use]
    pub fn reach(scene: &str, kept: &[usize], all: usize) -> String {
        let numbers: Vec<u8> = kept.iter().flat_map(|&face| (face as u64).to_le_bytes()).collect();
        let digest = &kanagata_files::sha256_hex(&numbers)[..8];
        format!("{REACH_KEY}{scene} faces={}/{all} of {digest}", kept.len())
    }

    /// True for a tool of the faces that the sheet of a scene can touch.
    #[must_use]
    pub fn is_of_reachable_faces(&self) -> bool {
        self.mesher.contains(REACH_KEY)
    }
}
