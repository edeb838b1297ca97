//! `kanagata convert` from end to end: Bezier patches refined until they keep a tolerance, faces out of a sheet's reach,
//! meshes in formats that only meshio reads.

mod skipping;

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use kanagata::audit::{AuditOptions, AuditReport, CadReference, audit};
use kanagata::cad;
use kanagata::tool::file::read;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name)
}

/// Exit code, output and error text.
fn kanagata(arguments: &[&str], python: Option<&Path>) -> (i32, String, String) {
    let mut command = Command::cargo_bin("kanagata").unwrap();
    command.args(arguments);
    if let Some(python) = python {
        command.env("KANAGATA_PYTHON", python);
    }
    let done = command.output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (done.status.code().unwrap_or(-1), text(&done.stdout), text(&done.stderr))
}

fn converted(cad_file: &Path, out: &Path, options: &[&str]) -> (String, AuditReport) {
    let mut arguments = vec!["convert", cad_file.to_str().unwrap(), "-o", out.to_str().unwrap()];
    arguments.extend(options);
    let (code, text, errors) = kanagata(&arguments, None);
    assert_eq!(code, 0, "{errors}");
    let (model, tool) = (cad::read(cad_file).unwrap().0, read(out).unwrap().model);
    let found = audit(&tool, &CadReference::new(&model), &AuditOptions::default()).unwrap();
    (text, found.report)
}

/// Triangles of the die fold at one division of a quarter turn: the faces they are on are divided more finely, and listed;
/// asked for as they are they stay.
#[test]
fn faces_whose_patches_fold_are_divided_more_finely() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("die.tool.json");
    let coarse = ["--style", "triangles", "--arc-divisions", "1"];
    let (text, found) = converted(&fixture("cross/die.igs"), &out, &coarse);
    assert!(text.contains("3 faces divided more finely than asked"), "{text}");
    assert!(found.folded.is_empty() && found.jumps.open_sides == 0);
    let asked: Vec<&str> = coarse.into_iter().chain(["--allow-folds"]).collect();
    let (text, folded) = converted(&fixture("cross/die.igs"), &out, &asked);
    assert!(!text.contains("more finely") && !folded.folded.is_empty(), "{text}");
    assert!(folded.patches < found.patches);
}

/// The punch folds at one division of a quarter turn: it is divided until it does not. A tighter tolerance takes more
/// patches or higher degrees; the audit agrees with what is said.
#[test]
fn bezier_patches_are_refined_until_they_keep_the_tolerance() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("punch.tool.json");
    let mut points = 0;
    for tolerance in ["0.01mm", "1e-7mm"] {
        let options = ["--kind", "bezier", "--tol", tolerance, "--sheet-side=-z"];
        let (text, found) = converted(&fixture("cross/punch.igs"), &out, &options);
        let loaded = read(&out).unwrap();
        let allowed: f64 = tolerance.trim_end_matches("mm").parse().unwrap();
        println!(
            "{tolerance}: {text} audit {:.2e} mm, {}",
            found.worst_mm(),
            loaded.provenance.mesher
        );
        assert!(loaded.provenance.shape_error_mm.unwrap() <= allowed);
        // The audit looks at more points than the conversion does, and at the trimmed face.
        assert!(found.worst_mm() <= 2.0 * allowed + 1e-9, "{}", found.worst_mm());
        assert!(found.folded.is_empty() && found.jumps.open_sides == 0);
        assert!(!loaded.provenance.mesher.contains("arc-divisions=1 "), "one division folds");
        let count = std::fs::read_to_string(&out).unwrap().len();
        assert!(count > points, "a tighter tolerance takes more control points");
        points = count;
    }
}

#[test]
fn a_bezier_tolerance_beyond_degree_six_is_refused_with_the_error_reached() {
    let folder = tempfile::tempdir().unwrap();
    let (cad_file, out) = (fixture("cross/die.igs"), folder.path().join("die.tool.json"));
    let arguments =
        ["convert", cad_file.to_str().unwrap(), "-o", out.to_str().unwrap(), "--kind", "bezier"];
    let mesh = folder.path().join("die.msh");
    let meshed = ["mesh", arguments[1], "-o", mesh.to_str().unwrap(), "--arc-divisions", "1"];
    assert_eq!(kanagata(&meshed, None).0, 0);
    let given = [&arguments[..], &["--tol", "1e-12mm", "--mesh", mesh.to_str().unwrap()]].concat();
    let (code, _, errors) = kanagata(&given, None);
    assert_eq!(code, 2);
    assert!(
        errors.contains("degree 6") && errors.contains("allowed: 0.000000000001 mm"),
        "{errors}"
    );
    assert!(!out.exists());
}

/// The whole die against a quarter of a sheet: face numbers stay those of the CAD, and the audit agrees.
#[test]
fn faces_that_a_sheet_cannot_touch_are_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let cad_file = fixture("forming/cross_die_full_144.igs");
    let out = folder.path().join("die.tool.json");
    let scene = fixture("cross/cross.scene.json");
    let reach = ["--reach", scene.to_str().unwrap()];
    let (text, part) = converted(&cad_file, &out, &reach);
    let loaded = read(&out).unwrap();
    println!("{text}{}", loaded.provenance.mesher);
    assert!(loaded.provenance.mesher.contains("reach=cross.scene.json faces="));
    let (_, whole) = converted(&cad_file, &out, &["--sheet-side=+z"]);
    assert!(2 * part.patches < whole.patches, "{} of {}", part.patches, whole.patches);
    assert!(part.worst_mm() <= whole.worst_mm() + 1e-9 && part.folded.is_empty());
    assert!(part.faces.iter().all(|f| whole.faces.iter().any(|w| w.face == f.face)));
    assert!(part.turned == whole.turned && text.contains("left out:"));
    let (_, refined) = converted(&cad_file, &out, &[&reach[..], &["--tol", "0.1mm"]].concat());
    assert_eq!(refined.faces.len(), part.faces.len());
    let (code, _, errors) = kanagata(
        &[
            "convert",
            cad_file.to_str().unwrap(),
            "-o",
            folder.path().join("dye.tool.json").to_str().unwrap(),
            "--reach",
            scene.to_str().unwrap(),
        ],
        None,
    );
    assert_eq!(code, 2);
    assert!(errors.contains("'dye'") && errors.contains("die, holder, punch"), "{errors}");
}

/// A Python that has meshio, if there is one.
fn python_with_meshio() -> Option<PathBuf> {
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join(".local/venv/bin/python");
    let named = std::env::var_os("KANAGATA_PYTHON").map(PathBuf::from);
    [named, Some(own), Some("python3".into())].into_iter().flatten().find(|p| {
        let asked = std::process::Command::new(p).args(["-c", "import meshio"]).output();
        asked.is_ok_and(|o| o.status.success())
    })
}

/// The die meshed here, written as an Abaqus deck by meshio, read back and put on the CAD again.
#[test]
fn an_abaqus_deck_becomes_a_tool() {
    let Some(python) = python_with_meshio() else {
        skipping::skip(skipping::MESHIO);
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let die = fixture("cross/die.igs").to_str().unwrap().to_owned();
    let (msh, deck, out) = (at("die.msh"), at("die.inp"), at("die.tool.json"));
    assert_eq!(kanagata(&["mesh", &die, "-o", &msh], None).0, 0);
    let script = "import sys, meshio\nm = meshio.read(sys.argv[1])\n\
                  meshio.Mesh(m.points, [c for c in m.cells if c.type in ('quad', 'triangle')]).write(sys.argv[2])";
    let written =
        std::process::Command::new(&python).args(["-c", script, &msh, &deck]).output().unwrap();
    assert!(written.status.success(), "{}", String::from_utf8_lossy(&written.stderr));
    let (code, text, errors) =
        kanagata(&["convert", &die, "-o", &out, "--mesh", &deck, "--sheet-side=+z"], Some(&python));
    assert_eq!(code, 0, "{errors}");
    let (code, direct, _) =
        kanagata(&["convert", &die, "-o", &at("direct.tool.json"), "--sheet-side=+z"], None);
    assert_eq!(code, 0);
    let patches = |text: &str| text.split(' ').next().unwrap().to_owned();
    assert_eq!(patches(&text), patches(&direct));
    let model = cad::read(Path::new(&die)).unwrap().0;
    let tool = read(Path::new(&out)).unwrap().model;
    let found = audit(&tool, &CadReference::new(&model), &AuditOptions::default()).unwrap().report;
    println!("{:?} {}", found.jumps, found.worst_mm());
    assert!(found.worst_mm() < 0.05 && found.folded.is_empty());
}

/// Said on the terminal, in the tool file and in the audit; refused where nothing is divided.
#[test]
fn faces_divided_independently_say_their_gap() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("die.tool.json");
    let cad_file = fixture("cross/die.igs");
    let options = ["--tol", "0.03mm", "--sheet-side", "+z", "--borders", "independent"];
    let (text, found) = converted(&cad_file, &out, &options);
    let loaded = read(&out).unwrap();
    println!("{text} {:?}", found.jumps);
    assert!(text.contains("faces divided independently: ") && text.contains("gap up to "));
    assert!(loaded.provenance.mesher.ends_with("borders=independent"));
    let gap = found.jumps.border_gap_mm;
    assert!(gap > 0.0 && gap <= 0.03 && found.jumps.border_gap_at.is_some());
    assert!(loaded.model.border_gap_mm >= gap && loaded.model.border_gap_mm <= 0.0306);
    let said = ["audit", out.to_str().unwrap(), "--cad", cad_file.to_str().unwrap(), "--tol"];
    let audited = |tol: &str| kanagata(&[&said[..], &[tol]].concat(), None);
    let (code, text, _) = audited("0.03mm");
    assert_eq!(code, 0, "{text}");
    assert!(
        text.contains("sides do not meet their neighbours'") && text.contains("that gap is at")
    );
    assert!(loaded.model.patches.len() < 49, "{}", loaded.model.patches.len());

    for (options, reason) in [
        (&["--kind", "bezier", "--tol", "0.01mm"][..], "share their control points"),
        (&["--arc-divisions", "4"][..], "nothing is refined"),
        (&["--to", "bezier"][..], "keeps the borders it has"),
    ] {
        let asked = ["convert", cad_file.to_str().unwrap(), "-o", out.to_str().unwrap()];
        let asked = [&asked[..], &["--borders", "independent"], options].concat();
        let (code, _, errors) = kanagata(&asked, None);
        assert!(code == 2 && errors.contains(reason), "{code} {errors}");
    }
}

/// What would say nothing is refused, not passed over.
#[test]
fn options_of_refinement_are_refused_where_nothing_is_refined() {
    let folder = tempfile::tempdir().unwrap();
    let (cad_file, out) = (fixture("cross/die.igs"), folder.path().join("die.tool.json"));
    for (options, words) in [
        (
            &["--kind", "bezier", "--patches", "50"][..],
            "--patches with --kind bezier; allowed: --tol",
        ),
        (&["--kind", "bezier", "--normal-tol", "5deg"], "--normal-tol with --kind bezier"),
        (&["--kind", "bezier", "--tol", "1mm", "--on-cad"], "--on-cad with --kind bezier"),
        (&["--on-cad"], "--on-cad without --tol, --normal-tol or --patches; allowed"),
    ] {
        let asked = ["convert", cad_file.to_str().unwrap(), "-o", out.to_str().unwrap()];
        let (code, _, errors) = kanagata(&[&asked[..], options].concat(), None);
        assert!(code == 2 && errors.contains(words) && !out.exists(), "{code} {errors}");
    }
}

/// A can of elliptic section, 30 by 12 mm, 25 high, without rounding.
const CAN: &str = "ISO-10303-21;
HEADER;
FILE_DESCRIPTION((''),'2;1');
FILE_NAME('','',(''),(''),'','','');
FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));
ENDSEC;
DATA;
#1=DIRECTION('',(0.,0.,1.));
#2=DIRECTION('',(1.,0.,0.));
#3=CARTESIAN_POINT('',(0.,0.,0.));
#4=CARTESIAN_POINT('',(0.,0.,25.));
#5=AXIS2_PLACEMENT_3D('',#3,#1,#2);
#6=AXIS2_PLACEMENT_3D('',#4,#1,#2);
#7=PLANE('',#5);
#8=PLANE('',#6);
#9=ELLIPSE('',#5,30.,12.);
#10=ELLIPSE('',#6,30.,12.);
#11=CARTESIAN_POINT('',(30.,0.,0.));
#12=CARTESIAN_POINT('',(30.,0.,25.));
#13=VERTEX_POINT('',#11);
#14=VERTEX_POINT('',#12);
#15=EDGE_CURVE('',#13,#13,#9,.T.);
#16=EDGE_CURVE('',#14,#14,#10,.T.);
#17=VECTOR('',#1,25.);
#18=LINE('',#11,#17);
#19=EDGE_CURVE('',#13,#14,#18,.T.);
#20=SURFACE_OF_LINEAR_EXTRUSION('',#9,#17);
#21=ORIENTED_EDGE('',*,*,#15,.T.);
#22=ORIENTED_EDGE('',*,*,#19,.T.);
#23=ORIENTED_EDGE('',*,*,#16,.F.);
#24=ORIENTED_EDGE('',*,*,#19,.F.);
#25=EDGE_LOOP('',(#21,#22,#23,#24));
#26=FACE_OUTER_BOUND('',#25,.T.);
#27=ADVANCED_FACE('',(#26),#20,.T.);
#28=ORIENTED_EDGE('',*,*,#15,.F.);
#29=EDGE_LOOP('',(#28));
#30=FACE_OUTER_BOUND('',#29,.T.);
#31=ADVANCED_FACE('',(#30),#7,.F.);
#32=ORIENTED_EDGE('',*,*,#16,.T.);
#33=EDGE_LOOP('',(#32));
#34=FACE_OUTER_BOUND('',#33,.T.);
#35=ADVANCED_FACE('',(#34),#8,.T.);
#36=CLOSED_SHELL('',(#27,#31,#35));
#37=MANIFOLD_SOLID_BREP('',#36);
#38=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
#39=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));
#40=(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT());
#41=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#38,#39,#40))REPRESENTATION_CONTEXT('',''));
#42=ADVANCED_BREP_SHAPE_REPRESENTATION('',(#37),#41);
ENDSEC;
END-ISO-10303-21;
";

/// Structured meshes of its ends have quadrilaterals with two sides along the ellipse, which fold; mixed ones have
/// triangles there.
#[test]
fn bezier_patches_that_fold_on_quadrilaterals_are_made_on_a_mixed_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let (can, out) = (folder.path().join("can.step"), folder.path().join("can.tool.json"));
    std::fs::write(&can, CAN).unwrap();
    let asked = ["convert", can.to_str().unwrap(), "-o", out.to_str().unwrap(), "--kind", "bezier"];
    let (code, text, errors) = kanagata(&asked, None);
    assert!(code == 0 && errors.contains("meshed with --style mixed"), "{code} {text} {errors}");
    assert!(read(&out).unwrap().provenance.mesher.contains("style=mixed"));
}
