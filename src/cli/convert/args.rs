//! Arguments of `kanagata convert`.

use std::path::{Path, PathBuf};

use clap::ValueEnum;

use super::offset_args::OffsetArgs;
use crate::cli::exit::{EXIT_HELP, Failure};
use crate::cli::mesh::MesherArgs;
use crate::cli::paths::{input_path, output_path};
use crate::cli::quantity::{angle_deg, length_mm, time_s};
use crate::cli::select::SelectArgs;
use crate::cli::stages::QuietArgs;
use crate::geometry::Vec3;
use crate::reach::Reached;

/// Arguments of `convert`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Examples:\n  kanagata convert die.igs -o die.tool.json --sheet-side +z\n  \
    kanagata convert punch.stp -o punch.tool.json --sheet-side=-z --arc-divisions 6\n  \
    kanagata convert die.igs -o die.tool.json --sheet-side +z --tol 0.01mm --normal-tol 0.5deg\n  \
    kanagata convert die.igs -o die.tool.json --mesh die.msh\n  \
    kanagata convert die.stl -o die.tool.json --sheet-side +z\n  \
    kanagata convert die.stp -o die.tool.json --tol 0.01mm --reach cup.scene.json\n  \
    kanagata convert die.igs -o punch.tool.json --offset 0.8mm --flip --tol 0.01mm\n  \
    kanagata convert die.tool.json -o bezier.tool.json --to bezier\n\n{EXIT_HELP}"))]
pub struct ConvertArgs {
    /// IGES or STEP file, or a mesh without CAD (.msh, .stl, .obj, .vtu, ...) with its own or estimated normals; with
    /// --to a tool file; - for CAD or a tool file from standard input
    #[arg(value_parser = input_path)]
    pub(super) file: PathBuf,
    /// Tool file; - for standard output
    #[arg(short, long, value_name = "FILE", value_parser = output_path)]
    pub(super) output: PathBuf,
    /// Name of the tool; default: from the output file
    #[arg(long)]
    pub(super) name: Option<String>,
    /// Convert a tool file to this kind: Nagata patches and facets to biquadratic Bezier patches (Eq. 15), and back
    #[arg(long, value_enum, value_name = "KIND")]
    pub(super) to: Option<To>,
    /// For a mesh without CAD: elements at a larger angle meet in a crease, where normals are estimated [degrees];
    /// default 40
    #[arg(long, value_name = "DEG", value_parser = angle_deg)]
    pub(super) crease_deg: Option<f64>,
    /// Use this mesh (.msh, .stl, .obj, .vtu; other formats through Python's meshio) instead of making one
    #[arg(long, value_name = "FILE", conflicts_with_all = ["normal_tol", "patches", "reach"])]
    pub(super) mesh: Option<PathBuf>,
    #[command(flatten)]
    pub(super) how: HowArgs,
}

/// How a CAD file becomes a tool model.
#[derive(Debug, Clone, clap::Args)]
pub struct HowArgs {
    /// Kind of the patches
    #[arg(long, value_enum, default_value_t = Kind::Nagata)]
    pub(super) kind: Kind,
    /// Curvature of edges; default `guarded`, with --tol or --patches `cad`
    #[arg(long, value_enum)]
    pub(super) edge: Option<Edge>,
    /// Write a tool file even if patches fold
    #[arg(long)]
    pub(super) allow_folds: bool,
    /// Side of the sheet: the normals are reversed if most faces point away from it
    #[arg(long, value_enum, value_name = "SIDE", allow_hyphen_values = true)]
    pub(super) sheet_side: Option<SheetSide>,
    /// Reverse the normals
    #[arg(long)]
    pub(super) flip: bool,
    /// Normals of neighbouring faces closer than this are merged [degrees]
    #[arg(long, value_name = "DEG", default_value_t = 0.5)]
    pub(super) smooth_deg: f64,
    /// Refine until the largest |shape error| is within this, as `0.01mm` [mm], with the fewest patches
    #[arg(long, value_name = "LENGTH", value_parser = length_mm, conflicts_with = "patches")]
    pub(super) tol: Option<f64>,
    /// Refine until the largest normal error is within this, as `0.5deg` [degrees]; not for --kind bezier
    #[arg(long, value_name = "ANGLE", value_parser = angle_deg, conflicts_with = "patches")]
    pub(super) normal_tol: Option<f64>,
    /// End the search for --tol or --normal-tol in about this time, as `10s` [s], with the best model found. The result
    /// depends on the speed of the machine; not for --kind bezier
    #[arg(long, value_name = "TIME", value_parser = time_s, conflicts_with = "patches")]
    pub(super) time: Option<f64>,
    /// End with exit code 0 although a tolerance is exceeded; doubts are still listed
    #[arg(long)]
    pub(super) accept_doubts: bool,
    /// Smallest error for this number of patches; not for --kind bezier
    #[arg(long, value_name = "N")]
    pub(super) patches: Option<usize>,
    /// With --tol, --normal-tol or --patches, not for --kind bezier: keep all vertices on the CAD surface instead of
    /// balancing the error on both sides
    #[arg(long)]
    pub(super) on_cad: bool,
    /// With --tol or --patches: how patches of neighbouring faces meet
    #[arg(long, value_enum, default_value_t = Borders::Conforming)]
    pub(super) borders: Borders,
    /// Exclude faces that the sheet of this scene cannot touch; the tool is the one of this name or output file in the
    /// scene
    #[arg(long, value_name = "SCENE")]
    pub(super) reach: Option<PathBuf>,
    #[command(flatten)]
    pub(super) offset: OffsetArgs,
    #[command(flatten)]
    pub(super) select: SelectArgs,
    #[command(flatten)]
    pub(super) mesher: MesherArgs,
    #[command(flatten)]
    pub(super) quiet: QuietArgs,
}

/// Kinds of patch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Kind {
    /// Nagata patches
    Nagata,
    /// Flat triangles and bilinear quadrilaterals
    Facets,
    /// Bezier patches of degree 1 to 6 directly from the CAD faces, within --tol (default 1e-4 mm)
    Bezier,
}

/// How neighbouring faces meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Borders {
    /// Faces share vertices and curves: no gap
    Conforming,
    /// Each face has its own divisions, as few as its error allows: gaps within the tolerance, measured and reported
    Independent,
}

/// Kinds to which a tool file can be converted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum To {
    /// Nagata patches
    Nagata,
    /// Bezier patches
    Bezier,
}

/// Rules for edge curves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Edge {
    /// Eq. 8 where its curve advances monotonically, straight elsewhere
    Guarded,
    /// Eq. 8 everywhere, also where it fails
    Plain,
    /// Eq. 8; where it is undetermined or fails, from the CAD; stored in the tool file
    Cad,
}

/// Directions of the coordinate axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum SheetSide {
    /// Towards +x
    #[value(name = "+x")]
    PlusX,
    /// Towards -x
    #[value(name = "-x")]
    MinusX,
    /// Towards +y
    #[value(name = "+y")]
    PlusY,
    /// Towards -y
    #[value(name = "-y")]
    MinusY,
    /// Towards +z
    #[value(name = "+z")]
    PlusZ,
    /// Towards -z
    #[value(name = "-z")]
    MinusZ,
}

impl SheetSide {
    /// Unit vector in that direction.
    pub(super) fn direction(self) -> Vec3 {
        match self {
            Self::PlusX => Vec3::x(),
            Self::MinusX => -Vec3::x(),
            Self::PlusY => Vec3::y(),
            Self::MinusY => -Vec3::y(),
            Self::PlusZ => Vec3::z(),
            Self::MinusZ => -Vec3::z(),
        }
    }
}

impl ConvertArgs {
    /// Input files.
    pub(super) fn inputs(&self) -> Vec<&Path> {
        let more = [&self.mesh, &self.how.reach].into_iter().flatten().map(PathBuf::as_path);
        std::iter::once(self.file.as_path()).chain(more).chain(self.how.select.files()).collect()
    }

    /// The edge rule, including the default.
    pub(super) fn edge(&self) -> Edge {
        let usual = if self.is_refined() { Edge::Cad } else { Edge::Guarded };
        self.how.edge.unwrap_or(usual)
    }

    /// Whether the mesh is refined to a goal.
    pub(super) fn is_refined(&self) -> bool {
        let asked =
            self.how.tol.is_some() || self.how.normal_tol.is_some() || self.how.patches.is_some();
        asked && self.how.kind != Kind::Bezier
    }

    /// Sheet side and flip; a conversion with --reach has applied them to the whole model.
    pub(super) fn side_and_flip(&self, reached: Option<&Reached>) -> (Option<Vec3>, bool) {
        match reached {
            Some(reached) => (None, reached.turned),
            None => (self.how.sheet_side.map(SheetSide::direction), self.how.flip),
        }
    }

    /// Refuses options for a mesh without CAD, and refinement of a given mesh.
    pub(super) fn check_cad(&self) -> Result<(), Failure> {
        if self.crease_deg.is_some() {
            return Err(Failure::input(
                "--crease-deg with a CAD file; allowed: with a mesh alone; the CAD knows where its creases are (--smooth-deg \
                 says which normals are one), leave it out",
            ));
        }
        if self.mesh.is_some() && self.is_refined() {
            return Err(Failure::input(
                "--tol with --mesh; allowed: with --kind bezier; a given mesh is not refined, leave one of them out",
            ));
        }
        Ok(())
    }

    /// Refuses options of the refinement of Nagata patches or facets if there is none.
    pub(super) fn check_refinement(&self) -> Result<(), Failure> {
        let kind = self.how.kind == Kind::Bezier;
        let refused = [
            ("--patches", self.how.patches.is_some() && kind),
            ("--normal-tol", self.how.normal_tol.is_some() && kind),
            ("--on-cad", self.how.on_cad && kind),
            ("--time", self.how.time.is_some() && kind),
        ];
        if let Some((option, _)) = refused.into_iter().find(|r| r.1) {
            return Err(Failure::input(format!(
                "{option} with --kind bezier; allowed: --tol, and {option} with --kind nagata or facets; patches straight from \
                 the CAD interpolate it and are made finer until they are within --tol; leave {option} out"
            )));
        }
        if self.how.time.is_some() && !self.is_refined() {
            return Err(Failure::input(
                "--time without --tol or --normal-tol; allowed: with one of them; without a tolerance nothing is searched; \
                 leave --time out",
            ));
        }
        if self.how.on_cad && !self.is_refined() {
            return Err(Failure::input(
                "--on-cad without --tol, --normal-tol or --patches; allowed: with one of them; nothing is balanced without, \
                 all vertices are on the CAD anyway; leave --on-cad out",
            ));
        }
        Ok(())
    }

    /// Refuses independent borders if no face is divided.
    pub(super) fn check_borders(&self) -> Result<(), Failure> {
        let reason = match self.how.borders {
            Borders::Conforming => return Ok(()),
            _ if self.to.is_some() => "with --to; a tool file keeps the borders it has",
            _ if self.how.kind == Kind::Bezier => {
                "with --kind bezier; patches straight from the CAD share their control points; convert to --kind nagata and that file with --to bezier"
            }
            _ if !self.is_refined() => {
                "without --tol, --normal-tol or --patches; nothing is refined, and uniform meshes are conforming"
            }
            Borders::Independent => return Ok(()),
        };
        Err(Failure::input(format!("--borders independent {reason}; or leave --borders out")))
    }
}
