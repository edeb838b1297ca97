//! How gmsh is run.

use std::path::PathBuf;

use crate::mesh::MeshError;
use crate::mesh::mapped::MeshStyle;

/// gmsh's algorithms for surfaces, with its own numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GmshAlgorithm {
    /// MeshAdapt.
    MeshAdapt = 1,
    /// Automatic.
    Automatic = 2,
    /// The triangulation of the divided edges, without points inside.
    InitialOnly = 3,
    /// Delaunay.
    Delaunay = 5,
    /// Frontal-Delaunay (gmsh's default).
    FrontalDelaunay = 6,
    /// BAMG.
    Bamg = 7,
    /// Frontal-Delaunay for quads.
    FrontalQuads = 8,
    /// Packing of parallelograms.
    Parallelograms = 9,
    /// Quasi-structured quads.
    QuasiStructured = 11,
}

/// How gmsh is run.
#[derive(Debug, Clone, PartialEq)]
pub struct GmshOptions {
    /// The program; `None`: environment variable KANAGATA_GMSH, then PATH.
    pub program: Option<PathBuf>,
    /// Structured: grids of quads where the CAD allows, triangles joined to quads elsewhere; mixed: triangles
    /// elsewhere; quads: triangles joined to quads everywhere; triangles.
    pub style: MeshStyle,
    /// No grids, whatever the style.
    pub unstructured: bool,
    /// Algorithm for surfaces.
    pub algorithm: GmshAlgorithm,
    /// Elements for 360 degrees of turn: of curves around grids, elsewhere `Mesh.MeshSizeFromCurvature`; 0 = off.
    pub per_turn: usize,
    /// Smallest and largest element size (mm); `None` = gmsh's own.
    pub size: [Option<f64>; 2],
    /// Time limit (s) for all runs on a part; gmsh is killed when it takes longer.
    pub limit_s: f64,
    /// Allowed difference of area from the model's, relative; of the whole and of each face.
    pub area_tolerance: f64,
}

impl Default for GmshOptions {
    fn default() -> Self {
        Self {
            program: None,
            style: MeshStyle::Structured,
            unstructured: false,
            algorithm: GmshAlgorithm::FrontalDelaunay,
            per_turn: 16,
            size: [None, None],
            limit_s: 300.0,
            area_tolerance: 0.05,
        }
    }
}

impl GmshOptions {
    /// Surfaces with three or four sides become grids; quasi-structured meshes are made without them in any case.
    pub(super) fn has_grids(&self) -> bool {
        !self.unstructured
            && self.algorithm != GmshAlgorithm::QuasiStructured
            && matches!(self.style, MeshStyle::Structured | MeshStyle::Mixed)
    }

    /// Allowed difference of area of one face, relative: squared half angle of an element, which flat elements
    /// in two curved directions keep, and so much as chords of circles take off flat rings.
    pub(super) fn face_tolerance(&self) -> f64 {
        match self.per_turn {
            0 => self.area_tolerance,
            n => (std::f64::consts::PI / n as f64).powi(2).clamp(0.05, 0.7),
        }
    }

    /// Curves are divided by their turn, not by gmsh: BAMG does not end with sizes from curvature.
    pub(super) fn divides_bends(&self) -> bool {
        self.algorithm == GmshAlgorithm::Bamg
    }

    pub(super) fn check(&self) -> Result<(), MeshError> {
        if self.limit_s.is_finite() && self.limit_s > 0.0 {
            return Ok(());
        }
        let found = self.limit_s.to_string();
        Err(MeshError::Option { option: "limit_s", found, allowed: "seconds above zero" })
    }
}
