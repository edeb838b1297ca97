//! Provenance of a tool file.

use std::path::Path;

use super::args::{Borders, ConvertArgs};
use crate::cad::Model;
use crate::cad::raw::LostFace;
use crate::cli::exit::{Exit, Failure};
use crate::files::sha256_hex;
use crate::reach::Reached;
use crate::tool::file::Provenance;

/// The provenance of a tool made from `model`, which lacks the faces `lost` and is the CAD or its offset by `offset_mm`.
pub(super) fn provenance(
    args: &ConvertArgs,
    (model, lost): (&Model, &[LostFace]),
    shape_error_mm: Option<f64>,
    reached: Option<&Reached>,
    offset_mm: Option<f64>,
) -> Result<Provenance, Failure> {
    let bytes = crate::files::read(&args.file, crate::files::Input::Cad)
        .map_err(|e| Failure::new(Exit::Io, format!("cannot read {}: {e}", args.file.display())))?;
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let within = reached.zip(args.how.reach.as_deref()).map_or_else(String::new, |(r, scene)| {
        let all = r.kept.len() + r.left_out.len();
        Provenance::reach(&name(scene), &r.kept, all)
    });
    Ok(Provenance {
        cad_file: name(&args.file),
        cad_sha256: sha256_hex(&bytes),
        cad_unit: model.unit.clone(),
        mesher: match &args.mesh {
            Some(path) => format!("mesh file {}", name(path)),
            None if args.is_refined() => {
                format!("{}{}", args.how.mesher.describe_refinement(), goal(args))
            }
            None => args.how.mesher.describe(),
        } + &within,
        selection: args.how.select.selection()?,
        offset_mm,
        faces_lost: lost.iter().map(|f| f.source.clone()).collect(),
        program: concat!("kanagata ", env!("CARGO_PKG_VERSION")).into(),
        shape_error_mm,
    })
}

/// The goal of a refinement, for the provenance.
fn goal(args: &ConvertArgs) -> String {
    let tol = args.how.tol.map_or_else(String::new, |t| format!(" tol-mm={t}"));
    let normal = args.how.normal_tol.map_or_else(String::new, |t| format!(" normal-tol-deg={t}"));
    let time = args.how.time.map_or_else(String::new, |s| format!(" time-s={s}"));
    let patches = args.how.patches.map_or_else(String::new, |n| format!(" patches={n}"));
    let vertices = if args.how.on_cad { " vertices=on-cad" } else { " vertices=balanced" };
    let edges = format!(" edges={}", format!("{:?}", args.edge()).to_lowercase());
    let borders = match args.how.borders {
        Borders::Conforming => "",
        Borders::Independent => " borders=independent",
    };
    format!("{tol}{normal}{time}{patches}{vertices}{edges}{borders}")
}
