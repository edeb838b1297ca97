//! Claims of the STEP reader.

use std::path::{Path, PathBuf};

use super::read_bytes;
use crate::cad::raw::RawModel;

fn read(path: &Path) -> RawModel {
    let bytes = std::fs::read(path).unwrap();
    read_bytes(&bytes, &path.file_name().unwrap().to_string_lossy()).unwrap()
}

fn forming() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/forming")
}

fn step_files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|e| e.unwrap().path()).collect();
    paths.retain(|p| p.extension().is_some_and(|e| e == "stp"));
    paths.sort();
    paths
}

#[test]
fn forming_tools_have_all_their_faces_in_mm() {
    let truth = std::fs::read(forming().join("truth.json")).unwrap();
    let truth: serde_json::Value = serde_json::from_slice(&truth).unwrap();
    let files = step_files(&forming());
    assert!(files.len() >= 12);
    for path in files {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let model = read(&path);
        assert_eq!(model.faces.len() as u64, truth[&name]["faces"].as_u64().unwrap(), "{name}");
        assert_eq!(model.unit_mm, 1.0, "{name}");
        assert!(model.diagnostics.is_empty(), "{name}: {:?}", model.diagnostics);
        edges_join_end_to_end(&model, &name);
    }
}

/// Every edge begins where the one before it ends, in space and at its vertices.
fn edges_join_end_to_end(model: &RawModel, name: &str) {
    for face in &model.faces {
        for boundary in &face.loops {
            let ends: Vec<_> = boundary
                .edges
                .iter()
                .filter_map(|e| e.curve.as_ref())
                .map(|c| [c.point(c.domain()[0]), c.point(c.domain()[1])])
                .collect();
            for k in 0..ends.len() {
                let gap = (ends[k][1] - ends[(k + 1) % ends.len()][0]).norm();
                assert!(gap < 1e-2 * model.unit_mm.max(1.0), "{name} {}: gap {gap}", face.source);
            }
        }
    }
}

#[test]
fn corpus_has_as_many_faces_as_the_kernel_says() {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/cad");
    let folder = std::env::var_os("KANAGATA_CORPUS").map_or(beside, PathBuf::from);
    let Ok(truth) = std::fs::read(folder.join("truth.json")) else {
        println!("skipped: no corpus at {}", folder.display());
        return;
    };
    let truth: serde_json::Value = serde_json::from_slice(&truth).unwrap();
    let mut wrong = vec![];
    for path in step_files(&folder) {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let start = std::time::Instant::now();
        let model = read(&path);
        println!(
            "{name}: {} faces, {:.1} ms, {} diagnostics",
            model.faces.len(),
            start.elapsed().as_secs_f64() * 1e3,
            model.diagnostics.len()
        );
        for d in model.diagnostics.iter().take(3) {
            println!("    {} {} {}", d.code, d.place, d.text);
        }
        let faces = truth[&name]["truth"]["faces"].as_u64().unwrap();
        if model.faces.len() as u64 != faces {
            wrong.push(format!("{name}: {} for {faces}", model.faces.len()));
        }
        edges_join_end_to_end(&model, &name);
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// A file with these instances, in mm.
fn file(data: &str) -> Vec<u8> {
    format!(
        "ISO-10303-21;HEADER;FILE_NAME('','',(''),(''),'p','s','');ENDSEC;DATA;
#901=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
#900=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#901))REPRESENTATION_CONTEXT('',''));
{data}
ENDSEC;END-ISO-10303-21;"
    )
    .into_bytes()
}

#[test]
fn mutated_files_never_panic() {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = |n: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state % n as u64) as usize
    };
    let names = ["cone_AP214.stp", "sphere_AP214.stp", "torus_AP214.stp", "hemi_punch_AP214.stp"];
    let seeds: Vec<Vec<u8>> =
        names.iter().map(|n| std::fs::read(forming().join(n)).unwrap()).collect();
    let spare = b"()#,;'*$.=0123456789EFT-";
    let mut refused = 0;
    for round in 0..5000 {
        let mut bytes = seeds[round % seeds.len()].clone();
        for _ in 0..=random(3) {
            let at = random(bytes.len());
            match random(4) {
                0 => bytes[at] = spare[random(spare.len())],
                1 => {
                    bytes.remove(at);
                }
                2 => bytes.insert(at, spare[random(spare.len())]),
                _ if random(20) == 0 => bytes.truncate(at),
                _ => {
                    // Another digit in place of a digit: pointers and numbers stay well formed.
                    if let Some(d) = bytes[at..].iter().position(u8::is_ascii_digit) {
                        bytes[at + d] = b'0' + random(10) as u8;
                    }
                }
            }
        }
        refused += usize::from(read_bytes(&bytes, "mutated").is_err());
    }
    assert!((100..4900).contains(&refused), "{refused}");
}

#[test]
fn every_pointer_to_itself_or_its_neighbour_is_survived() {
    let text = std::fs::read_to_string(forming().join("hemi_punch_AP214.stp")).unwrap();
    let data = text.find("DATA;").unwrap();
    let hashes: Vec<usize> =
        text.match_indices('#').map(|(k, _)| k).filter(|k| *k > data).collect();
    let mut owner = String::new();
    for &at in &hashes {
        let id: String = text[at + 1..].chars().take_while(char::is_ascii_digit).collect();
        if text[at + 1 + id.len()..].starts_with(" =") {
            owner = id;
            continue;
        }
        let next = (owner.parse::<u64>().unwrap() + 1).to_string();
        for other in [&owner, &next] {
            let changed = format!("{}#{other}{}", &text[..at], &text[at + 1 + id.len()..]);
            let _ = read_bytes(changed.as_bytes(), "circle");
        }
    }
    assert!(hashes.len() > 200);
}

#[test]
fn a_million_brackets_are_refused() {
    let error = read_bytes(&file(&format!("#1=X{};", "(".repeat(1_000_000))), "deep").unwrap_err();
    assert!(error.to_string().contains("nested deeper"), "{error}");
}

#[test]
fn numbers_that_are_not_finite_are_refused() {
    for number in ["1E400", "NaN", "1.#INF", "-1.E999"] {
        let text = file(&format!("#1=CARTESIAN_POINT('',({number},0.,0.));"));
        assert!(read_bytes(&text, "n").is_err(), "{number}");
    }
}

#[test]
fn doubling_mapped_items_are_refused_and_few_are_placed() {
    let doubled = |levels: usize| {
        let mut data = String::from(
            "#1=CARTESIAN_POINT('',(0.,0.,0.));#2=AXIS2_PLACEMENT_3D('',#1,$,$);#3=SPHERICAL_SURFACE('',#2,1.);\n\
             #4=ADVANCED_FACE('',(),#3,.T.);#5=CLOSED_SHELL('',(#4));#6=MANIFOLD_SOLID_BREP('',#5);\n\
             #10=SHAPE_REPRESENTATION('',(#6),#900);\n",
        );
        for k in 1..=levels {
            let (r, below) = (10 * (k + 1), 10 * k);
            data += &format!(
                "#{a}=REPRESENTATION_MAP(#2,#{below});#{b}=MAPPED_ITEM('',#{a},#2);#{c}=MAPPED_ITEM('',#{a},#2);\n\
                 #{r}=SHAPE_REPRESENTATION('',(#{b},#{c}),#900);\n",
                a = r + 1,
                b = r + 2,
                c = r + 3
            );
        }
        read_bytes(&file(&data), "doubling")
    };
    assert_eq!(doubled(3).unwrap().faces.len(), 8);
    let error = doubled(40).unwrap_err().to_string();
    assert!(error.contains("placed faces"), "{error}");
}
