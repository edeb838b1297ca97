//! VTU files and the collection of a run: their arrays are those of `docs/reference/vtu.md`, tools are parts that move, and
//! PyVista, meshio and VTK read them.

mod bend;
mod skipping;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use kanagata::report::record::History;
use kanagata::report::vtu_read::{self, Grid, GridArray};
use serde_json::Value;

/// Runs the changed bend into `out` of a folder; its exit code must be 0 or 1.
fn run(folder: &Path, change: impl FnOnce(&mut Value)) -> PathBuf {
    bend::write_tools(folder);
    let mut scene = bend::scene("");
    scene["stages"][0]["largest_increment"] = 0.2.into();
    change(&mut scene);
    fs::write(folder.join("bend.scene.json"), scene.to_string()).unwrap();
    let mut solve = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"));
    solve.args(["run", "bend.scene.json", "-q", "--report", "failed", "-o", "out"]);
    let done = solve.current_dir(folder).output().unwrap();
    let errors = String::from_utf8_lossy(&done.stderr);
    assert!(matches!(done.status.code(), Some(0 | 1)), "{errors}");
    folder.join("out")
}

fn record(out: &Path) -> Value {
    serde_json::from_slice(&fs::read(out.join("run.json")).unwrap()).unwrap()
}

fn history(out: &Path) -> History {
    History::parse(&fs::read_to_string(out.join("history.csv")).unwrap()).unwrap()
}

/// The value of an attribute of an XML element.
fn attribute<'t>(tag: &'t str, name: &str) -> Option<&'t str> {
    let (_, after) = tag.split_once(&format!(" {name}=\""))?;
    after.split('"').next()
}

/// Place, components and type of every array in a file by its name, except for points and cells.
fn arrays(file: &Path) -> BTreeMap<String, (String, String, String)> {
    let text = fs::read_to_string(file).unwrap();
    let mut found = BTreeMap::new();
    for (section, place) in
        [("FieldData", "file"), ("PointData", "nodes"), ("CellData", "elements")]
    {
        let Some((_, after)) = text.split_once(&format!("<{section}>")) else { continue };
        let body = after.split(&format!("</{section}>")).next().unwrap();
        for tag in body.lines().filter(|line| line.starts_with("<DataArray")) {
            let of = |name: &str| attribute(tag, name).map(str::to_owned);
            let components = of("NumberOfComponents").unwrap_or("1".into());
            found.insert(of("Name").unwrap(), (place.into(), components, of("type").unwrap()));
        }
    }
    found
}

/// The rows of a table of the reference: cells of each by the name of its array.
fn reference(section: &str) -> BTreeMap<String, Vec<String>> {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reference/vtu.md");
    let page = fs::read_to_string(page).unwrap();
    let (_, after) = page.split_once(&format!("## {section}\n")).unwrap();
    let rows = after.split("\n## ").next().unwrap().lines().filter(|l| l.starts_with("| `"));
    rows.map(|row| {
        let cells: Vec<String> =
            row.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect();
        (cells[0].trim_matches('`').to_owned(), cells[1..].to_vec())
    })
    .collect()
}

/// Whether an array that the reference calls so is written for a card, with tools or while they are released.
fn applies(when: &str, limit: bool, released: bool) -> bool {
    match when {
        "" | "plastic" => true,
        "plastic, tools" => !released,
        "released" => released,
        "forming limit" => limit,
        "not converged" => false,
        other => panic!("'{other}' in docs/reference/vtu.md"),
    }
}

/// Place, components and type of the arrays of a run by the reference.
fn expected(
    tools: &[&str],
    limit: bool,
    released: bool,
) -> BTreeMap<String, (String, String, String)> {
    let mut all = BTreeMap::new();
    for (name, cells) in reference("Sheet") {
        let [place, components, kind, _unit, when, meaning] = &cells[..] else {
            panic!("{cells:?}")
        };
        assert!(!meaning.is_empty(), "{name}");
        if !applies(when, limit, released) {
            continue;
        }
        let names: Vec<String> = if name.starts_with("NAME_") {
            tools.iter().map(|tool| name.replace("NAME", tool)).collect()
        } else {
            vec![name]
        };
        for name in names {
            all.insert(name, (place.clone(), components.clone(), kind.clone()));
        }
    }
    all
}

#[test]
fn the_reference_lists_the_arrays_of_a_run() {
    let card = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("src/solver/material/cards/mild-steel-neto2012.json");
    let mut unlimited: Value = serde_json::from_slice(&fs::read(card).unwrap()).unwrap();
    unlimited.as_object_mut().unwrap().remove("forming_limit").unwrap();
    for (element, shell) in [("solid-shell", true), ("hex8", false)] {
        let folder = tempfile::tempdir().unwrap();
        let out = run(folder.path(), |scene| {
            scene["blank"]["element"] = element.into();
            if !shell {
                scene["material"] = unlimited.clone();
            }
        });
        let expected = |released: bool| expected(&["post", "plane"], shell, released);
        for step in record(&out)["files"]["steps"].as_array().unwrap() {
            let sheet = step["sheet"].as_str().unwrap();
            let released = step["time"].as_f64().unwrap() > 1.0;
            assert_eq!(arrays(&out.join(sheet)), expected(released), "{element}, {sheet}");
        }
        assert_eq!(arrays(&out.join("steps/last.vtu")), expected(true), "{element}, last");
        check_springback(&out);
        let text = fs::read_to_string(out.join("steps/last.vtu")).unwrap();
        let tensor = text.lines().find(|line| line.contains("\"cauchy_stress_mpa\"")).unwrap();
        let labels: Vec<_> =
            (0..6).map(|k| attribute(tensor, &format!("ComponentName{k}")).unwrap()).collect();
        assert_eq!(labels, ["XX", "YY", "ZZ", "XY", "YZ", "XZ"]);
    }
}

/// The extremes in `run.json` are those of the array, which is the displacement since the loaded step along its normals.
fn check_springback(out: &Path) {
    let springback = &record(out)["springback"];
    let read = |name: &str| vtu_read::read(&out.join(format!("steps/{name}.vtu"))).unwrap();
    let held = read(&format!("{:06}", springback["from_increment"].as_u64().unwrap()));
    let last = read("last");
    let map = array(&last.point_data, "springback_normal_mm");
    let normal = array(&held.point_data, "normal");
    for (node, found) in map.iter().enumerate() {
        let moved = last.points[node] - held.points[node];
        let along: f64 = (0..3).map(|k| moved[k] * normal[3 * node + k]).sum();
        assert!((along - found).abs() < 1e-6 * moved.norm() + 1e-12, "{node}: {along} {found}");
    }
    for (key, worse) in [("normal_max", f64::max as fn(f64, f64) -> f64), ("normal_min", f64::min)]
    {
        let extreme = map.iter().copied().reduce(worse).unwrap();
        assert_eq!(springback[key]["displacement_mm"].as_f64().unwrap(), extreme);
        assert_eq!(map[springback[key]["node"].as_u64().unwrap() as usize], extreme);
    }
    assert!(map.iter().any(|d| d.abs() > 0.1 * springback["largest_mm"].as_f64().unwrap()));
}

#[test]
fn the_reference_lists_the_arrays_of_an_audit() {
    let folder = tempfile::tempdir().unwrap();
    let cad = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/forming/hemi_punch_144.igs");
    let kanagata = |arguments: &[&str]| {
        let mut program = Command::new(env!("CARGO_BIN_EXE_kanagata"));
        let done = program.args(arguments).arg(&cad).current_dir(folder.path()).output().unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    };
    kanagata(&["convert", "-o", "punch.tool.json", "--sheet-side=-z"]);
    kanagata(&["audit", "punch.tool.json", "--vtu", "audit.vtu", "--cad"]);
    let file = folder.path().join("audit.vtu");
    let listed = reference("Audited tools").into_iter();
    let expected: BTreeMap<_, _> =
        listed.map(|(name, c)| (name, (c[0].clone(), c[1].clone(), c[2].clone()))).collect();
    assert_eq!(arrays(&file), expected);
    let grid = vtu_read::read(&file).unwrap();
    let largest =
        array(&grid.point_data, "shape_error_mm").iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    assert!(largest > 1e-6 && largest < 1.0, "{largest}");
}

/// Attributes of the data sets of a collection.
fn data_sets(out: &Path) -> Vec<[String; 4]> {
    let text = fs::read_to_string(out.join("run.pvd")).unwrap();
    let tags = text.lines().filter(|line| line.starts_with("<DataSet"));
    tags.map(|tag| ["timestep", "part", "name", "file"].map(|n| attribute(tag, n).unwrap().into()))
        .collect()
}

fn array<'g>(all: &'g [GridArray], name: &str) -> &'g [f64] {
    &all.iter().find(|array| array.name == name).unwrap_or_else(|| panic!("no {name}")).values
}

/// The number of an array of field data, which is in plain base64.
fn field(file: &Path, name: &str) -> f64 {
    use base64::Engine as _;
    let text = fs::read_to_string(file).unwrap();
    let (_, after) = text.split_once(&format!("Name=\"{name}\"")).unwrap();
    let body = after.split_once(">\n").unwrap().1.lines().next().unwrap();
    let bytes = base64::engine::general_purpose::STANDARD.decode(body).unwrap();
    f64::from_le_bytes(bytes[8..16].try_into().unwrap())
}

#[test]
fn sheet_and_tools_are_the_parts_of_every_step() {
    let folder = tempfile::tempdir().unwrap();
    let out = run(folder.path(), |_| ());
    let (record, history) = (record(&out), history(&out));
    let files = &record["files"];
    let steps = files["steps"].as_array().unwrap();
    let names = ["sheet", "post", "plane"];
    // The collection is what run.json lists.
    let sets = data_sets(&out);
    assert_eq!(sets.len(), 3 * steps.len());
    for (step, sets) in steps.iter().zip(sets.chunks(3)) {
        let listed = [&step["sheet"], &step["tools"][0], &step["tools"][1]];
        for (k, [time, part, name, file]) in sets.iter().enumerate() {
            assert_eq!(time.parse::<f64>().unwrap(), step["time"].as_f64().unwrap());
            let expected = (k.to_string(), names[k], listed[k].as_str().unwrap());
            assert_eq!((part.clone(), name.as_str(), file.as_str()), expected);
        }
    }
    // Every VTU file is listed.
    let mut listed: Vec<String> = sets.iter().map(|set| set[3].clone()).collect();
    listed.push(files["last"].as_str().unwrap().into());
    listed.extend(files["tools"].as_array().unwrap().iter().map(|t| t.as_str().unwrap().into()));
    for inner in ["steps", "tools"] {
        for entry in fs::read_dir(out.join(inner)).unwrap() {
            let name = format!("{inner}/{}", entry.unwrap().file_name().to_string_lossy());
            assert!(listed.contains(&name), "{name}");
        }
    }
    let tables = ["collection", "history", "iterations"].map(|key| files[key].as_str().unwrap());
    for file in listed.iter().map(String::as_str).chain(tables) {
        assert!(out.join(file).is_file(), "{file}");
    }
    // Tools move by their travel; a tool at rest keeps its file.
    let read = |file: &Value| vtu_read::read(&out.join(file.as_str().unwrap())).unwrap();
    let first: Vec<Grid> = (0..2).map(|tool| read(&files["tools"][tool])).collect();
    for step in &steps[1..] {
        let increment = step["increment"].as_u64().unwrap() as usize;
        let row = history.rows.iter().find(|row| row.increment == increment).unwrap();
        assert_eq!(step["time"], row.time);
        let sheet = out.join(step["sheet"].as_str().unwrap());
        assert_eq!(field(&sheet, "TimeValue"), row.time);
        for (k, name) in ["post", "plane"].into_iter().enumerate() {
            assert_eq!(field(&sheet, &format!("{name}_travel_mm")), row.travel_mm[k]);
            assert_eq!(field(&sheet, &format!("{name}_force_n")), row.force_n[k]);
            let grid = read(&step["tools"][k]);
            let along = if k == 0 { 1.0 } else { -1.0 };
            assert_eq!(grid.cells, first[k].cells);
            for (now, before) in grid.points.iter().zip(&first[k].points) {
                let off = (now - before).z - along * row.travel_mm[k];
                assert!(off.abs() < 1e-5, "{name}, increment {increment}: {off}");
            }
        }
        check_contact(&vtu_read::read(&sheet).unwrap(), row.contacts);
    }
    let row =
        |step: &Value| history.rows.iter().find(|r| r.increment == step["increment"]).unwrap();
    let of = |step| [row(step).travel_mm[0], row(step).travel_mm[1]];
    let travels: Vec<_> = std::iter::once([0.0; 2]).chain(steps[1..].iter().map(of)).collect();
    for (k, (step, travel)) in steps.iter().zip(&travels).enumerate().skip(1) {
        for tool in 0..2 {
            let same = step["tools"][tool] == steps[k - 1]["tools"][tool];
            assert_eq!(same, travel[tool] == travels[k - 1][tool], "{step}");
        }
    }
    let names = |tool: usize| steps[1]["tools"][tool].as_str().unwrap();
    assert_eq!([names(0), names(1)], ["tools/post.vtu", "tools/plane.000002.vtu"]);
}

/// Counts of nodes in contact and of those that slip are those of the history; pressure acts where there is contact.
fn check_contact(grid: &Grid, [touch, slip]: [usize; 2]) {
    let of = |name: &str| array(&grid.point_data, name);
    let (state, tool) = (of("contact_state"), of("contact_tool"));
    let (pressure, normal) = (of("contact_pressure_mpa"), of("normal"));
    assert_eq!(state.iter().filter(|s| **s > 0.0).count(), touch);
    assert_eq!(state.iter().filter(|s| **s == 2.0).count(), slip);
    let force = of("contact_force_n");
    for node in 0..state.len() {
        let free = state[node] == 0.0;
        assert_eq!((tool[node] == 0.0, pressure[node] == 0.0), (free, free), "node {node}");
        // The post pushes the lower face up along the normal, the plane the upper face down.
        let along: f64 = (0..3).map(|k| normal[3 * node + k] * force[3 * node + k]).sum();
        let up = if tool[node] == 1.0 { 1.0 } else { -1.0 };
        assert!(free || (up * along > 0.0 && pressure[node] > 0.0), "node {node}: {along}");
        let length = (0..3).map(|k| normal[3 * node + k].powi(2)).sum::<f64>().sqrt();
        assert!((length - 1.0).abs() < 1e-6);
    }
}

/// A Python that has these modules, if there is one.
fn python_with(modules: &str) -> Option<PathBuf> {
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join(".local/venv/bin/python");
    let named = std::env::var_os("KANAGATA_PYTHON").map(PathBuf::from);
    [named, Some(own), Some("python3".into())].into_iter().flatten().find(|python| {
        let asked = Command::new(python).args(["-c", &format!("import {modules}")]).output();
        asked.is_ok_and(|out| out.status.success())
    })
}

/// Runs a script on a run folder; returns what it prints.
fn script(python: &Path, text: &str, out: &Path) -> String {
    let done = Command::new(python).args(["-c", text]).arg(out).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    String::from_utf8(done.stdout).unwrap()
}

const WITH_PYVISTA: &str = r#"
import sys, numpy, pyvista, vtk
out = sys.argv[1]
reader = pyvista.get_reader(out + "/run.pvd")
assert list(reader.time_values) == sorted(set(reader.time_values)) and reader.time_values[0] == 0.0
for time in reader.time_values:
    reader.set_active_time_value(time)
    parts = [d.part for d in reader.active_datasets]
    assert sorted(parts) == [0, 1, 2], parts
    blocks = reader.read()
    sheet, post, plane = blocks
    assert sheet.field_data["TimeValue"][0] == time
    assert set(sheet.celltypes) == {12} and set(plane.celltypes) == {5}
    for face in ("", "_lower", "_upper"):
        for tensor, principal in (("cauchy_stress_mpa", "principal_stress_mpa"), ("logarithmic_strain", "principal_strain")):
            xx, yy, zz, xy, yz, xz = numpy.array(sheet.cell_data[tensor + face], float).T
            full = numpy.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).transpose(2, 0, 1)
            expected = numpy.linalg.eigvalsh(full)[:, ::-1]
            found = sheet.cell_data[principal + face]
            size = max(abs(expected).max(), 1e-3)
            assert abs(found - expected).max() < 2e-6 * size, (time, tensor + face)
grid = vtk.vtkXMLUnstructuredGridReader()
grid.SetFileName(out + "/steps/last.vtu")
grid.Update()
stress = grid.GetOutput().GetCellData().GetArray("cauchy_stress_mpa_upper")
print([stress.GetComponentName(k) for k in range(stress.GetNumberOfComponents())])
print(grid.GetOutput().GetFieldData().GetArray("plane_travel_mm").GetValue(0))
"#;

/// PyVista steps through the collection, VTK names the components.
#[test]
fn pyvista_and_vtk_read_the_collection() {
    let Some(python) = python_with("pyvista") else {
        skipping::skip(skipping::PYVISTA);
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let out = run(folder.path(), |_| ());
    let text = script(&python, WITH_PYVISTA, &out);
    let travel = history(&out).rows.last().unwrap().travel_mm[1];
    let expected = format!("['XX', 'YY', 'ZZ', 'XY', 'YZ', 'XZ']\n{travel:?}\n");
    assert_eq!(text, expected);
}

const WITH_MESHIO: &str = r#"
import sys, meshio
mesh = meshio.read(sys.argv[1] + "/steps/last.vtu")
tool = meshio.read(sys.argv[1] + "/tools/post.vtu")
print(len(mesh.points), len(mesh.cells_dict["hexahedron"]), tool.cells[0].type)
for name in ("cauchy_stress_mpa", "principal_strain_upper", "forming_zone", "plastic_strain_lower"):
    print(name, list(mesh.cell_data[name][0].shape), mesh.cell_data[name][0].dtype)
print(float(mesh.point_data["contact_pressure_mpa"].sum()), float(abs(mesh.cell_data["cauchy_stress_mpa"][0]).max()))
"#;

#[test]
fn meshio_reads_sheet_and_tools() {
    let Some(python) = python_with("meshio") else {
        skipping::skip(skipping::MESHIO);
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let out = run(folder.path(), |_| ());
    let text = script(&python, WITH_MESHIO, &out);
    let lines: Vec<&str> = text.lines().collect();
    let own = vtu_read::read(&out.join("steps/last.vtu")).unwrap();
    let (nodes, cells) = (own.points.len(), own.cells.len());
    assert_eq!(
        lines[..5],
        [
            &format!("{nodes} {cells} triangle"),
            &format!("cauchy_stress_mpa [{cells}, 6] float32"),
            &format!("principal_strain_upper [{cells}, 3] float32"),
            &format!("forming_zone [{cells}] int32"),
            &format!("plastic_strain_lower [{cells}] float64"),
        ]
    );
    let numbers: Vec<f64> = lines[5].split(' ').map(|word| word.parse().unwrap()).collect();
    let pressure: f64 = array(&own.point_data, "contact_pressure_mpa").iter().sum();
    let stress =
        array(&own.cell_data, "cauchy_stress_mpa").iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    assert!((numbers[0] - pressure).abs() < 1e-3 && (numbers[1] - stress).abs() < 1e-3, "{text}");
    assert!(stress > 1.0);
}
