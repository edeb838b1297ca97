//! Options of the gmsh program that `mesh` and `convert` share.

use std::path::PathBuf;

use clap::ValueEnum;

use super::exit::Failure;
use crate::mesh::gmsh::{GmshAlgorithm, GmshOptions};

/// How gmsh is run.
#[derive(Debug, Clone, clap::Args)]
pub struct GmshArgs {
    /// The gmsh program, if not on PATH nor named by KANAGATA_GMSH; a relative path begins in the current folder
    #[arg(long, value_name = "PROGRAM")]
    gmsh: Option<PathBuf>,
    /// gmsh's algorithm for faces that are no transfinite grids (--mesher gmsh); frontal-delaunay when not given
    #[arg(long, value_enum, value_name = "NAME")]
    gmsh_algorithm: Option<Algorithm>,
    /// Time after which gmsh is stopped [s] (--mesher gmsh); 300 when not given
    #[arg(long, value_name = "SECONDS")]
    gmsh_limit: Option<f64>,
}

/// gmsh's two-dimensional algorithms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Algorithm {
    /// Triangles changed locally until they have the size asked
    MeshAdapt,
    /// Delaunay on planes, MeshAdapt elsewhere
    Automatic,
    /// Divided edges joined to triangles, no points inside: for --style structured, whose grids it leaves alone;
    /// alone it cuts through walls and fillets, which is refused where it takes too much area
    InitialOnly,
    /// Delaunay
    Delaunay,
    /// Delaunay with points placed from the borders inwards
    FrontalDelaunay,
    /// BAMG; edges are divided by their turn, inside gmsh has no sizes from curvature (it would not end)
    Bamg,
    /// Frontal-Delaunay for right-angled triangles that recombine well; on walls and fillets only with grids
    /// (--style structured), alone it may leave them without points inside
    FrontalQuads,
    /// Packing of parallelograms
    Parallelograms,
    /// Quasi-structured quads on all faces, whatever the style; many and small ones
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
    /// Program, algorithm and time limit; all else as gmsh's default here.
    pub(super) fn options(&self) -> GmshOptions {
        let default = GmshOptions::default();
        GmshOptions {
            program: self.gmsh.clone(),
            algorithm: self.gmsh_algorithm.map_or(default.algorithm, Into::into),
            limit_s: self.gmsh_limit.unwrap_or(default.limit_s),
            ..default
        }
    }

    /// For the provenance.
    pub(super) fn describe(&self) -> String {
        let algorithm = self.gmsh_algorithm.unwrap_or(Algorithm::FrontalDelaunay);
        format!("algorithm={}", name(algorithm))
    }

    /// Refuses options that the built-in mesher would pass over.
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
