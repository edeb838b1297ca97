//! What the programs do with the bytes of a file of each kind, up to where they would solve or write: for the fuzz
//! targets and for `tests/foreign_bytes.rs`.

use std::path::Path;
use std::sync::OnceLock;

use kanagata::audit::{AuditOptions, CadReference, audit};
use kanagata::cad::{Creases, Model, build, iges, read_raw, step};
use kanagata::contact::ToolSurface;
use kanagata::convert::bezier::{BezierOptions, bezier_from_cad};
use kanagata::convert::own::convert_mesh;
use kanagata::convert::{ConvertOptions, ConvertReport};
use kanagata::mesh::mapped::{MappedOptions, mesh};
use kanagata::mesh::{attach, io};
use kanagata::report::record::{History, RunRecord};
use kanagata::run::progress_line::{json_line, line};
use kanagata::run::{advice, cost};
use kanagata::scene::preview::SheetCounts;
use kanagata::scene::read::parse_card;
use kanagata::scene::types::{Blank, BlankShape, MaterialChoice};
use kanagata::scene::{Plan, PlannedTool, Scene, blank, follow};
use kanagata::solver::Simulation;
use kanagata::solver::material::card;
use kanagata::study::cases::{Roots, cases, ids};
use kanagata::study::read::Description;
use kanagata::tool::ToolModel;
use kanagata::tool::exchange::{to_bezier, to_nagata};

/// Success, or the words of a typed error.
pub type Outcome = Result<(), String>;
/// Reads the bytes of one kind of file.
pub type Reader = fn(&[u8]) -> Outcome;

/// Elements of a scene's blank above which no set-up is made: building meshes is not what is examined.
const ELEMENTS_MAX: usize = 200;
/// Faces of a CAD model above which it is not converted.
const FACES_MAX: usize = 4;
/// Elements of a mesh above which it is not converted.
const MESH_ELEMENTS_MAX: usize = 1_000;
/// Cases of a study above which they are not kept: each has its scene.
const CASES_MAX: usize = 16;
/// Elements of a mesh above which it is not made a tool.
const ATTACHED_MAX: usize = 8;
/// Patches of a tool above which no search structure is built.
const PATCHES_MAX: usize = 16;

fn words(error: impl std::fmt::Display) -> String {
    error.to_string()
}

/// What each ending of a file's name is read by; the longest that fits is meant.
pub const KINDS: [(&str, Reader); 15] = [
    (".convert.igs", convert),
    (".convert.stp", convert),
    (".igs", read_iges),
    (".stp", read_step),
    (".msh", read_msh),
    (".stl", read_stl),
    (".obj", read_obj),
    (".vtu", read_vtu),
    (".inp", read_inp),
    (".tool.json", read_tool),
    (".scene.json", read_scene),
    (".study.json", read_study),
    (".card.json", read_card),
    (".csv", read_history),
    (".run.json", read_history),
];

/// An IGES file: parsed and built.
pub fn read_iges(bytes: &[u8]) -> Outcome {
    let raw = iges::read_bytes(bytes, "fuzz.igs").map_err(words)?;
    drop(build::build_with(raw, "fuzz.igs", Creases::Cut));
    Ok(())
}

/// A STEP file: parsed and built.
pub fn read_step(bytes: &[u8]) -> Outcome {
    let raw = step::read_bytes(bytes, "fuzz.stp").map_err(words)?;
    drop(build::build_with(raw, "fuzz.stp", Creases::Cut));
    Ok(())
}

/// A CAD file of a few faces, meshed with one division of a quarter turn, converted to Nagata and to Bezier patches, both
/// audited.
pub fn convert(bytes: &[u8]) -> Outcome {
    converted(bytes, true)
}

/// As [`convert`], to Bezier patches one time in 32, as they take nine tenths of the time.
#[allow(dead_code, reason = "only the fuzz target uses it; the tests always convert to both")]
pub fn convert_quickly(bytes: &[u8]) -> Outcome {
    converted(bytes, is_one_in_32(bytes))
}

/// True for one input in 32, by the sum of its bytes: for steps that take far longer than all others.
fn is_one_in_32(bytes: &[u8]) -> bool {
    bytes.iter().fold(0, |sum: u8, b| sum.wrapping_add(*b)).is_multiple_of(32)
}

fn converted(bytes: &[u8], to_bezier: bool) -> Outcome {
    let raw = read_raw(bytes, "fuzz.cad").map_err(words)?;
    let (model, _) = build::build_with(raw, "fuzz.cad", Creases::Cut);
    if model.faces.len() > FACES_MAX {
        return Err(format!("{} faces", model.faces.len()));
    }
    let divided = MappedOptions { arc_divisions: 1, ..MappedOptions::default() };
    let mesh = mesh(&model, &divided).map_err(words)?;
    // Time and memory of finer meshes are those of their patches.
    if mesh.elements.len() > MESH_ELEMENTS_MAX {
        return Err(format!("{} elements", mesh.elements.len()));
    }
    let nagata = kanagata::convert::convert(&model, &mesh, &ConvertOptions::default());
    let nagata = nagata.map_err(words).and_then(|(tool, _)| audited(&model, &tool));
    if !to_bezier {
        return nagata;
    }
    let size = model.faces.iter().map(|f| f.bbox().diagonal()).fold(0.0, f64::max);
    let options = BezierOptions {
        name: String::new(),
        tolerance_mm: 1e-3 * size,
        sheet_side: None,
        flip: false,
        progress: Default::default(),
    };
    let bezier = bezier_from_cad(&model, &mesh, &options);
    let bezier = bezier.map_err(words).and_then(|(tool, _)| audited(&model, &tool));
    nagata.and(bezier)
}

fn audited(model: &Model, tool: &ToolModel) -> Outcome {
    let options = AuditOptions { samples: 2, refine: 1, ..AuditOptions::default() };
    audit(tool, &CadReference::new(model), &options).map(drop).map_err(words)
}

/// A MSH file, as a tool and as a blank.
pub fn read_msh(bytes: &[u8]) -> Outcome {
    either(surface(bytes, "fuzz.msh"), sheet(bytes, "fuzz.msh"))
}

/// An STL file as a tool.
pub fn read_stl(bytes: &[u8]) -> Outcome {
    surface(bytes, "fuzz.stl")
}

/// An OBJ file, as a tool and as a blank.
pub fn read_obj(bytes: &[u8]) -> Outcome {
    either(surface(bytes, "fuzz.obj"), sheet(bytes, "fuzz.obj"))
}

/// A VTU file, as a tool and as a blank.
pub fn read_vtu(bytes: &[u8]) -> Outcome {
    either(surface(bytes, "fuzz.vtu"), sheet(bytes, "fuzz.vtu"))
}

/// An Abaqus deck as a blank.
pub fn read_inp(bytes: &[u8]) -> Outcome {
    sheet(bytes, "fuzz.inp")
}

/// Success of one of two; both are tried.
fn either(one: Outcome, other: Outcome) -> Outcome {
    one.or(other)
}

/// A mesh made a tool without CAD, and put back on a CAD model.
fn surface(bytes: &[u8], name: &str) -> Outcome {
    static SPHERE: OnceLock<Model> = OnceLock::new();
    let sphere = SPHERE.get_or_init(|| {
        let bytes = include_bytes!("../../fixtures/forming/sphere_AP214.stp");
        let raw = read_raw(bytes, "sphere.stp").expect("a sound fixture");
        build::build_with(raw, "sphere.stp", Creases::Cut).0
    });
    let file = io::parse(bytes, name).map_err(words)?;
    if file.mesh.elements.len() > ATTACHED_MAX {
        return Ok(());
    }
    if is_one_in_32(bytes) {
        // Most meshes are of other parts.
        drop(attach(&file.mesh, sphere));
    }
    let made: Result<(ToolModel, ConvertReport, _), _> =
        convert_mesh(&file, &ConvertOptions::default(), 40.0);
    made.map(drop).map_err(words)
}

/// A mesh made a blank of one layer, 1 mm thick where it does not say its thickness.
fn sheet(bytes: &[u8], name: &str) -> Outcome {
    let sheet = io::parse_sheet(bytes, name).map_err(words)?;
    let thin = blank::of_sheet(&blank_of_file(0.0), sheet.clone(), None);
    thin.or_else(|_| blank::of_sheet(&blank_of_file(1.0), sheet, None)).map(drop)
}

fn blank_of_file(thickness_mm: f64) -> Blank {
    let text = format!(
        r#"{{"shape": {{"mesh": {{"file": "x"}}}}, "thickness_mm": {thickness_mm:?}, "layers": 1}}"#
    );
    serde_json::from_str(&text).expect("a sound blank")
}

/// A tool file: built, searched for closest points, exchanged for the other kinds of patches.
pub fn read_tool(bytes: &[u8]) -> Outcome {
    let loaded = kanagata::tool::file::parse(bytes, Path::new("fuzz.tool.json")).map_err(words)?;
    if loaded.model.patches.len() > PATCHES_MAX {
        return Ok(());
    }
    let bezier = to_bezier(&loaded.model);
    let back = to_nagata(&bezier).map(drop).map_err(words);
    let surface = ToolSurface::new(loaded.model);
    let box_ = surface.bounds();
    let [low, high] = [box_.min, box_.max];
    // A patch with a spike takes the work of a query in full, about 0.2 s: two queries.
    let foot = surface.closest(&low, None);
    let _ = surface.from_last(&(0.5 * (low + high)), &foot, f64::INFINITY);
    back
}

/// A scene file: checked, and with tools of another scene set up, judged and made a simulation, if its blank is small.
pub fn read_scene(bytes: &[u8]) -> Outcome {
    let path = Path::new("fuzz.scene.json");
    let scene = kanagata::scene::read::parse(bytes, path).map_err(words)?;
    let is_mesh = matches!(scene.blank.shape, BlankShape::Mesh { .. });
    let counts = SheetCounts::of_blank(&scene.blank);
    let is_small = counts.as_ref().is_some_and(|sheet| sheet.elements <= ELEMENTS_MAX);
    if is_mesh || !is_small {
        return Ok(());
    }
    let plan = plan_of(scene)?;
    let mut setup = plan.simulation_setup(path).map_err(words)?;
    setup.place().map_err(words)?;
    let estimate = cost::estimate(&setup, &SheetCounts::of_mesh(setup.body.mesh()));
    let findings = advice::advice(&plan, &setup, 1.0, &estimate);
    if findings.iter().any(|finding| finding.to_string().is_empty()) {
        return Err("a finding without words".into());
    }
    Simulation::new(setup).map(drop).map_err(words)
}

/// The plan of a scene whose tools are those of the U-draw: die, holder or punch as their files are named, by turns otherwise.
///
/// # Errors
/// What is wrong with the material.
pub fn plan_of(scene: Scene) -> Result<Plan, String> {
    static TOOLS: OnceLock<[PlannedTool; 3]> = OnceLock::new();
    let known = TOOLS.get_or_init(|| {
        [
            include_bytes!("../../fixtures/u-draw/die.tool.json").as_slice(),
            include_bytes!("../../fixtures/u-draw/holder.tool.json"),
            include_bytes!("../../fixtures/u-draw/punch.tool.json"),
        ]
        .map(|bytes| {
            let path = Path::new("fuzz.tool.json");
            let loaded = kanagata::tool::file::parse(bytes, path).expect("a sound fixture");
            PlannedTool {
                path: path.into(),
                sha256: loaded.sha256,
                surface: ToolSurface::new(loaded.model).into(),
                shape_error_mm: None,
                reachable_only: false,
            }
        })
    });
    let card = match &scene.material {
        MaterialChoice::Named(name) => card::find(name).map_err(words)?,
        MaterialChoice::Card(card) => (**card).clone(),
    };
    let material = card.build(scene.blank.rolling_direction_deg.to_radians()).map_err(words)?;
    let names = ["die.tool.json", "holder.tool.json", "punch.tool.json"];
    let named = |file: &str| names.iter().position(|name| *name == file);
    let tools = scene.tools.iter().enumerate();
    let tools = tools.map(|(k, tool)| known[named(&tool.file).unwrap_or(k % 3)].clone()).collect();
    Ok(Plan {
        scene,
        folder: "".into(),
        sha256: String::new(),
        set: Vec::new(),
        tools,
        card,
        material,
        files: Vec::new(),
        followed: None,
    })
}

/// A study: checked, its cases made as they are and with `--quick`.
pub fn read_study(bytes: &[u8]) -> Outcome {
    let described = kanagata::study::read::parse(bytes, Path::new("fuzz.json")).map_err(words)?;
    if let Description::Forming(study) = described
        && ids(&study).len() <= CASES_MAX
    {
        let own = Path::new("own");
        drop(cases(&study, &Roots { tools: Path::new("tools"), own }, false));
    }
    Ok(())
}

/// A material card: its law built, and brought to yield.
pub fn read_card(bytes: &[u8]) -> Outcome {
    let card = parse_card(bytes)?;
    card.build(0.3).map_err(words)?;
    card.yield_function().map(drop).map_err(words)
}

/// A `history.csv`, or a `run.json`: what `status`, a restart and a scene that follows it read there.
pub fn read_history(bytes: &[u8]) -> Outcome {
    if bytes.starts_with(b"{") {
        let record: RunRecord = serde_json::from_slice(bytes).map_err(words)?;
        return serde_json::to_vec(&record).map(drop).map_err(words);
    }
    let history = History::parse(&String::from_utf8_lossy(bytes))?;
    for row in &history.rows {
        drop((line(&history.tools, row), json_line(&history.tools, row)));
    }
    drop(history.untouched());
    let mut stages: Vec<&str> = history.rows.iter().map(|row| row.stage.as_str()).collect();
    stages.dedup();
    follow::ends(&history, &stages).map(drop)
}
