//! `kanagata mesh FILE -o MESH`, and the mesher options shared with `convert`.

use std::path::{Path, PathBuf};

use clap::ValueEnum;

use super::exit::{EXIT_HELP, Exit, Failure};
use super::gmsh::GmshArgs;
use super::output_clash::refuse_clashes;
use super::paths::{input_path, named_path};
use super::read::{LostFaces, read_model};
use super::select::SelectArgs;
use super::skip::skipping;
use super::stages::{QuietArgs, progress, show};
use super::terminal::{err, out};
use crate::cad::Model;
use crate::mesh::mapped::{self, MappedOptions, MeshStyle};
use crate::mesh::{MeshError, MeshReport, SurfaceMesh, gmsh, io};

/// Arguments of `mesh`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Examples:\n  kanagata mesh die.igs -o die.msh --arc-divisions 4\n  \
    kanagata mesh die.igs -o die.vtu --mesher gmsh --style triangles --gmsh-algorithm delaunay\n\n{EXIT_HELP}"))]
pub struct MeshArgs {
    /// IGES or STEP file; - for standard input
    #[arg(value_parser = input_path)]
    file: PathBuf,
    /// Mesh file: .msh (MSH 4.1) or .vtu
    #[arg(short, long, value_name = "FILE", value_parser = named_path)]
    output: PathBuf,
    #[command(flatten)]
    select: SelectArgs,
    #[command(flatten)]
    mesher: MesherArgs,
    #[command(flatten)]
    quiet: QuietArgs,
}

/// Mesher and element sizes.
#[derive(Debug, Clone, clap::Args)]
pub struct MesherArgs {
    /// Mesher: built in, or the program gmsh
    #[arg(long, value_enum, default_value_t = Mesher::Mapped)]
    mesher: Mesher,
    /// Elements per 90 degrees of a fillet
    #[arg(long, value_name = "N", default_value_t = 4)]
    arc_divisions: usize,
    /// Longest element side [mm] (gmsh: approximately; with --tol or --patches before vertices are balanced)
    #[arg(long, value_name = "MM")]
    max_size_mm: Option<f64>,
    /// Largest distance of flat elements from the surface [mm] (built-in mesher)
    #[arg(long, value_name = "MM")]
    chord_mm: Option<f64>,
    /// Kinds of element
    #[arg(long, value_enum, default_value_t = Style::Structured)]
    style: Style,
    /// No mapped faces (gmsh: no transfinite grids): elements of similar size everywhere
    #[arg(long)]
    unstructured: bool,
    /// Continue without faces of the CAD file that cannot be read or meshed; they are listed
    #[arg(long)]
    skip_bad_faces: bool,
    #[command(flatten)]
    gmsh: GmshArgs,
}

/// Meshers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Mesher {
    /// Built in: quads mapped on four-sided faces
    Mapped,
    /// The program gmsh
    Gmsh,
}

/// Kinds of element.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Style {
    /// Quads on three- and four-sided faces, few triangles elsewhere. gmsh: transfinite grids on such faces (with
    /// triangles along a border of three-sided ones), recombined triangles elsewhere
    Structured,
    /// Triangles on three-sided faces; gmsh: quads on four-sided faces only
    Mixed,
    /// Triangles only
    Triangles,
    /// Quads only; gmsh: recombined triangles everywhere, of which a few may remain
    Quads,
}

impl From<MeshError> for Failure {
    fn from(error: MeshError) -> Self {
        let io = matches!(error, MeshError::Read { .. } | MeshError::Write(_));
        Self::new(if io { Exit::Io } else { Exit::Input }, error)
    }
}

impl MesherArgs {
    /// Meshes the model and checks the area of the mesh.
    pub(super) fn mesh(&self, file: &Path, model: &Model) -> Result<SurfaceMesh, MeshError> {
        match self.mesher {
            Mesher::Mapped => mapped::mesh_watched(model, &self.mapped_options(), &progress()),
            Mesher::Gmsh => {
                let made = gmsh::mesh(file, model, &self.gmsh_options())?;
                made.notes.iter().for_each(|note| err!("note: {note}"));
                Ok(made.mesh)
            }
        }
    }

    /// Whether faces that cannot be meshed are skipped.
    pub(super) fn skips_faces(&self) -> bool {
        self.skip_bad_faces
    }

    /// Treatment of faces that cannot be read.
    pub(super) fn lost_faces(&self) -> LostFaces {
        if self.skip_bad_faces { LostFaces::Skip } else { LostFaces::Refuse }
    }

    /// Refuses options of gmsh for another mesher.
    pub(super) fn check(&self) -> Result<(), Failure> {
        if self.is_built_in() { self.gmsh.refuse() } else { Ok(()) }
    }

    /// Whether the mesher is the built-in one.
    pub(super) fn is_built_in(&self) -> bool {
        self.mesher == Mesher::Mapped
    }

    /// Options of the built-in mesher, if it is used.
    pub(super) fn built_in(&self) -> Option<MappedOptions> {
        self.is_built_in().then(|| self.mapped_options())
    }

    /// The same mesher with other divisions per 90 degrees.
    pub(super) fn with_divisions(&self, arc_divisions: usize) -> Self {
        Self { arc_divisions, ..self.clone() }
    }

    /// The built-in mesher with style `mixed` in place of `structured`.
    pub(super) fn mixed(&self) -> Option<Self> {
        let is_structured = self.is_built_in() && self.style == Style::Structured;
        is_structured.then(|| Self { style: Style::Mixed, ..self.clone() })
    }

    /// Options of the built-in mesher for refinement to a tolerance.
    pub(super) fn mapped_for_refinement(&self) -> Result<MappedOptions, Failure> {
        if self.mesher == Mesher::Gmsh {
            return Err(Failure::input(
                "--mesher gmsh with --tol or --patches; allowed: the built-in mesher, whose divisions can be chosen \
                 edge by edge; leave --mesher out",
            ));
        }
        Ok(self.mapped_options())
    }

    /// Mesher and options of a refinement, for the provenance.
    pub(super) fn describe_refinement(&self) -> String {
        let size = self.max_size_mm.map_or_else(String::new, |s| format!(" max-size-mm={s}"));
        format!("mapped{size} style={}", format!("{:?}", self.style).to_lowercase())
    }

    fn mapped_options(&self) -> MappedOptions {
        MappedOptions {
            arc_divisions: self.arc_divisions,
            max_size: self.max_size_mm,
            chord_error: self.chord_mm,
            through_cad: false,
            by_turn: false,
            fewest: false,
            style: self.mesh_style(),
            unstructured: self.unstructured,
        }
    }

    fn mesh_style(&self) -> MeshStyle {
        match self.style {
            Style::Structured => MeshStyle::Structured,
            Style::Mixed => MeshStyle::Mixed,
            Style::Triangles => MeshStyle::Triangles,
            Style::Quads => MeshStyle::Quads,
        }
    }

    fn gmsh_options(&self) -> gmsh::GmshOptions {
        let default = gmsh::GmshOptions::default();
        gmsh::GmshOptions {
            style: self.mesh_style(),
            unstructured: self.unstructured,
            per_turn: self.arc_divisions.saturating_mul(4),
            size: [None, self.max_size_mm],
            area_tolerance: self.area_tolerance().max(default.area_tolerance),
            ..self.gmsh.options()
        }
    }

    /// Mesher and options, for the provenance.
    pub(super) fn describe(&self) -> String {
        let size = self.max_size_mm.map_or_else(String::new, |s| format!(" max-size-mm={s}"));
        let chord = self.chord_mm.map_or_else(String::new, |c| format!(" chord-mm={c}"));
        let style = format!("{:?}", self.style).to_lowercase();
        let mesher = match self.mesher {
            Mesher::Mapped => "mapped".to_owned(),
            Mesher::Gmsh => format!("gmsh {}", self.gmsh.describe()),
        };
        let free = if self.unstructured { " unstructured" } else { "" };
        format!("{mesher} arc-divisions={}{size}{chord} style={style}{free}", self.arc_divisions)
    }

    /// Allowed relative difference between the area of a mesh of flat elements and that of the model. Chords cut corners
    /// by about 1 - cos h on a fillet of n elements, with h = 45 degrees / n.
    pub(super) fn area_tolerance(&self) -> f64 {
        let h = std::f64::consts::FRAC_PI_4 / self.arc_divisions.max(1) as f64;
        (h * h).clamp(1e-3, 0.3)
    }
}

/// Meshes the file.
///
/// # Errors
/// Exit code 2 for a file that is not CAD or cannot be meshed, 4 when files cannot be read or written.
pub fn run(args: &MeshArgs) -> Result<Exit, Failure> {
    args.mesher.check()?;
    let inputs: Vec<&Path> =
        std::iter::once(args.file.as_path()).chain(args.select.files()).collect();
    refuse_clashes(&inputs, &[("--output", Some(&args.output))])?;
    args.select.refuse_with((!args.mesher.is_built_in()).then_some("--mesher gmsh"))?;
    let shown = show(args.quiet);
    let whole = read_model(&args.file, args.mesher.lost_faces())?;
    let chosen = args.select.choose(&args.file, &whole)?;
    let model = chosen.as_ref().map_or(&whole, |c| &c.model);
    let make = |model: &Model| Ok(args.mesher.mesh(&args.file, model)?);
    let (mut mesh, part) = skipping(args.mesher.skips_faces(), model, make)?;
    let meshed = part.as_ref().map_or(model, |p| &p.model);
    let report = MeshReport::new(&mesh, meshed);
    report.check(meshed, args.mesher.area_tolerance())?;
    let numbers = [part.as_ref().map(|p| &p.kept), chosen.as_ref().map(|c| &c.kept)];
    for numbers in numbers.into_iter().flatten() {
        mesh.elements.iter_mut().for_each(|e| e.face = numbers[e.face as usize] as u32);
    }
    io::write(&mesh, &args.output)?;
    drop(shown);
    print_report(&report);
    out!("  {}", args.output.display());
    Ok(Exit::Done)
}

fn print_report(r: &MeshReport) {
    out!(
        "{} elements ({} quads, {} triangles) on {} faces, {} vertices",
        r.elements,
        r.quads,
        r.triangles,
        r.faces,
        r.vertices
    );
    out!(
        "  area {:.4} mm2, the model's {:.4} ({:+.4} %)",
        r.area_mm2,
        r.model_area_mm2,
        100.0 * r.area_error
    );
    out!(
        "  {} border sides, {} irregular; smallest corner Jacobian {:.3}, {} inverted elements; largest aspect {:.1}",
        r.free_sides,
        r.irregular_sides,
        r.min_corner_jacobian,
        r.inverted,
        r.max_aspect
    );
}
