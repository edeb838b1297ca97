//! Tool models of the cross tool, made from its CAD.

use std::path::Path;

use kanagata::audit::{AuditOptions, audit, reference::CadReference};
use kanagata::cad::Model;
use kanagata::convert::{ConvertOptions, convert};
use kanagata::geometry::Vec3;
use kanagata::mesh::mapped::{MappedOptions, MeshStyle, mesh};
use kanagata::tool::exchange::to_bezier;
use kanagata::tool::{ToolKind, ToolModel};

fn cad(name: &str) -> Model {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/cross").join(name);
    kanagata::cad::read(&path).expect("the fixture is sound").0
}

fn make(model: &Model, kind: ToolKind, side: Vec3, options: &MappedOptions) -> ToolModel {
    let mesh = mesh(model, options).expect("the fixture can be meshed");
    let options = ConvertOptions { kind, sheet_side: Some(side), ..ConvertOptions::default() };
    convert(model, &mesh, &options).expect("the mesh can be converted").0
}

fn sized(arc_divisions: usize, max_size: f64, style: MeshStyle) -> MappedOptions {
    let max_size = Some(max_size);
    MappedOptions { arc_divisions, max_size, style, ..MappedOptions::default() }
}

/// Names and models; the first is the die of about 1241 quadrilaterals.
pub fn cross() -> Vec<(String, ToolModel)> {
    use MeshStyle::{Structured, Triangles};
    let (die, punch, holder) = (cad("die.igs"), cad("punch.igs"), cad("holder.igs"));
    let up = Vec3::z();
    let quads = make(&die, ToolKind::Nagata, up, &sized(8, 5.5, Structured));
    let bezier = to_bezier(&quads);
    let coarse = sized(4, 20.0, Structured);
    vec![
        ("die, quads".into(), quads),
        ("die, few".into(), make(&die, ToolKind::Nagata, up, &coarse)),
        ("die, triangles".into(), make(&die, ToolKind::Nagata, up, &sized(8, 7.0, Triangles))),
        ("die, Bezier".into(), bezier),
        ("die, facets".into(), make(&die, ToolKind::Facets, up, &sized(8, 5.5, Structured))),
        ("punch".into(), make(&punch, ToolKind::Nagata, -up, &sized(8, 5.0, Structured))),
        ("punch, few".into(), make(&punch, ToolKind::Nagata, -up, &coarse)),
        ("holder".into(), make(&holder, ToolKind::Nagata, -up, &coarse)),
    ]
}

/// Largest shape error of a model of the die [mm], and triangles of the die that are as near to it.
pub fn facets_as_good_as(tool: &ToolModel) -> (f64, ToolModel) {
    let die = cad("die.igs");
    let reference = CadReference::new(&die);
    let worst = |tool: &ToolModel| {
        let found = audit(tool, &reference, &AuditOptions::default()).expect("can be audited");
        found.report.worst_mm()
    };
    let error = worst(tool);
    let mut divisions = 8;
    loop {
        // On an arc of radius 20 mm, the largest.
        let step = std::f64::consts::FRAC_PI_2 / divisions as f64;
        let style = MeshStyle::Triangles;
        let options = MappedOptions {
            arc_divisions: divisions,
            max_size: Some(20.0 * step * 2.0),
            style,
            ..MappedOptions::default()
        };
        let facets = make(&die, ToolKind::Facets, Vec3::z(), &options);
        if worst(&facets) <= error || divisions >= 256 {
            return (error, facets);
        }
        divisions = divisions * 5 / 4;
    }
}

/// All tool files one folder down, by name.
pub fn of_folder(folder: &Path) -> Vec<(String, ToolModel)> {
    let inside = |path: &Path| {
        let entries = std::fs::read_dir(path).into_iter().flatten().flatten();
        let mut all: Vec<_> = entries.map(|e| e.path()).collect();
        all.sort();
        all
    };
    let files = inside(folder).into_iter().flat_map(|model| inside(&model));
    let tools = files.filter(|path| path.to_string_lossy().ends_with(".tool.json"));
    let read = |path: std::path::PathBuf| {
        let name = path.strip_prefix(folder).unwrap_or(&path).display().to_string();
        let loaded = kanagata::tool::file::read(&path).expect("the folder holds sound tool files");
        (name.trim_end_matches(".tool.json").to_owned(), loaded.model)
    };
    tools.map(read).collect()
}
