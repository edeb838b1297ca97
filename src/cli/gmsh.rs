//! Options of gmsh shared by `mesh` and `convert`.

use std::path::PathBuf;

use clap::ValueEnum;

use super::exit::Failure;
use crate::mesh::gmsh::{GmshAlgorithm, GmshOptions};

/// How gmsh is run.
#[derive(Debug, Clone, clap::Args)]
pub struct GmshArgs {
    /// Path of gmsh, if it is neither on PATH nor in KANAGATA_GMSH; relative to the current folder
    #[arg(long, value_name = "PROGRAM")]
    gmsh: Option<PathBuf>,
    /// gmsh's algorithm for faces without transfinite grid (--mesher gmsh); default frontal-delaunay
    #[arg(long, value_enum, value_name = "NAME")]
    gmsh_algorithm: Option<Algorithm>,
    /// Time limit of gmsh [s] (--mesher gmsh); default 300
    #[arg(long, value_name = "SECONDS")]
    gmsh_limit: Option<f64>,
}

/// gmsh's two-dimensional algorithms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Algorithm {
    /// Triangles changed locally until they have the requested size
    MeshAdapt,
    /// Delaunay on planes, MeshAdapt elsewhere
    Automatic,
    /// Divided edges joined to triangles, no interior points: for --style structured, whose grids are unchanged. Without
    /// grids it cuts through walls and fillets, which is refused if too much area is lost
    InitialOnly,
    /// Delaunay
    Delaunay,
    /// Delaunay with points placed from the borders inwards
    FrontalDelaunay,
    /// BAMG; edges are divided by their angle, the interior has no curvature-based sizes (it would not end)
    Bamg,
    /// Frontal-Delaunay for right-angled triangles that recombine well; on walls and fillets only with grids (--style
    /// structured), otherwise they may lack interior points
    FrontalQuads,
    /// Packing of parallelograms
    Parallelograms,
    /// Quasi-structured quads on all faces for any style; many and small ones
    QuasiStructured,
}

impl From<Algorithm> for GmshAlgorithm {
    fn from(algorithm: Algorithm) -> Self {
        match algorithm {
            Algorithm::MeshAdapt => Self::MeshAdapt,
            Algorithm::Automatic => Self::Automatic,
            Algorithm::InitialOnly => Self::InitialOnly,
            Algorithm::Delaunay => Self::Delaunay,
            Algorithm::FrontalDelaunay => Self::FrontalDelaunay,
            Algorithm::Bamg => Self::Bamg,
            Algorithm::FrontalQuads => Self::FrontalQuads,
            Algorithm::Parallelograms => Self::Parallelograms,
            Algorithm::QuasiStructured => Self::QuasiStructured,
        }
    }
}

impl GmshArgs {
    /// Program, algorithm and time limit; the rest are the defaults of this program.
    pub(super) fn options(&self) -> GmshOptions {
        let default = GmshOptions::default();
        GmshOptions {
            program: self.gmsh.clone(),
            algorithm: self.gmsh_algorithm.map_or(default.algorithm, Into::into),
            limit_s: self.gmsh_limit.unwrap_or(default.limit_s),
            ..default
        }
    }

    /// The algorithm, for the provenance.
    pub(super) fn describe(&self) -> String {
        let algorithm = self.gmsh_algorithm.unwrap_or(Algorithm::FrontalDelaunay);
        format!("algorithm={}", name(algorithm))
    }

    /// Refuses options that the built-in mesher would ignore.
    pub(super) fn refuse(&self) -> Result<(), Failure> {
        let found = match (self.gmsh_algorithm, self.gmsh_limit) {
            (Some(algorithm), _) => format!("--gmsh-algorithm {}", name(algorithm)),
            (None, Some(limit)) => format!("--gmsh-limit {limit}"),
            (None, None) => return Ok(()),
        };
        Err(Failure::input(format!(
            "{found} with the built-in mesher; allowed: with --mesher gmsh; add that, or leave the option out"
        )))
    }
}

fn name(algorithm: Algorithm) -> String {
    let value = algorithm.to_possible_value();
    value.map_or_else(String::new, |v| v.get_name().to_owned())
}
