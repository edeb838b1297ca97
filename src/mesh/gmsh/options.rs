//! Options of the gmsh driver.

use std::path::PathBuf;

use crate::MeshError;
use crate::mapped::MeshStyle;

/// gmsh's algorithms for surfaces, with its own numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GmshAlgorithm {
    /// MeshAdapt.
    MeshAdapt = 1,
    /// Automatic.
    Automatic = 2,
    /// Triangulation of the edge nodes, without interior nodes.
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

/// Options of the gmsh driver.
#[derive(Debug, Clone, PartialEq)]
pub struct GmshOptions {
    /// Path of the program; `None`: environment variable KANAGATA_GMSH, then PATH.
    pub program: Option<PathBuf>,
    /// Structured: quadrilateral grids on suitable faces, triangles recombined to quadrilaterals elsewhere. Mixed:
    /// triangles elsewhere. Quads: triangles recombined everywhere. Triangles: triangles only.
    pub style: MeshStyle,
    /// No transfinite grids, for any style.
    pub unstructured: bool,
    /// Algorithm for surfaces.
    pub algorithm: GmshAlgorithm,
    /// Elements per 360 degrees: on curves around grids, elsewhere as `Mesh.MeshSizeFromCurvature`; 0 = off.
    pub per_turn: usize,
    /// Smallest and largest element size [mm]; `None` = default of gmsh.
    pub size: [Option<f64>; 2],
    /// Time limit [s] for all runs on a part; gmsh is then killed.
    pub limit_s: f64,
    /// Relative area error allowed, of the whole mesh and of each face.
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
    /// True when surfaces with three or four sides become grids; never with quasi-structured meshing.
    pub(super) fn has_grids(&self) -> bool {
        !self.unstructured
            && self.algorithm != GmshAlgorithm::QuasiStructured
            && matches!(self.style, MeshStyle::Structured | MeshStyle::Mixed)
    }

    /// Relative area error allowed for one face: the squared half angle per element. Flat elements on doubly curved
    /// faces, and chords on the circles of flat rings, have such errors.
    pub(super) fn face_tolerance(&self) -> f64 {
        match self.per_turn {
            0 => self.area_tolerance,
            n => (std::f64::consts::PI / n as f64).powi(2).clamp(0.05, 0.7),
        }
    }

    /// Curves are divided by turning angle here: BAMG does not terminate with sizes from curvature.
    pub(super) fn divides_by_turning_angle(&self) -> bool {
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
