//! Damaged CAD files: each gives a model or a typed error, never a panic, and soon.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};

use kanagata::cad::{build, read_raw};
use kanagata::convert::{ConvertError, ConvertOptions, convert};
use kanagata::mesh::mapped::{MappedOptions, mesh};
use kanagata::mesh::{MeshFeet, SurfaceMesh};
use rayon::prelude::*;

use self::dice::Dice;

#[path = "../fuzz/src/dice.rs"]
mod dice;

/// Mutants in all.
const MUTANTS: u64 = 20_400;
/// No damage may make reading endless: far above what any of these small files needs.
const TOO_LONG: Duration = Duration::from_secs(20);

fn seeds() -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/forming");
    let mut seeds: Vec<(String, Vec<u8>)> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|p| p.extension().is_some_and(|e| e == "igs" || e == "stp"))
        .map(|p| (p.file_name().unwrap().to_string_lossy().into_owned(), std::fs::read(p).unwrap()))
        .filter(|(_, bytes)| bytes.len() < 30_000)
        .collect();
    seeds.sort();
    assert!(seeds.len() >= 6, "{} small files", seeds.len());
    seeds
}

/// Places of runs of digits.
fn numbers(bytes: &[u8]) -> Vec<std::ops::Range<usize>> {
    let mut out = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let end = at + bytes[at..].iter().take_while(|b| b.is_ascii_digit()).count();
        if end > at {
            out.push(at..end);
        }
        at = end + 1;
    }
    out
}

/// One to three damages: bytes, lines, numbers, pointers, the end.
fn mutant(seed: &[u8], numbers: &[std::ops::Range<usize>], dice: &mut Dice) -> Vec<u8> {
    const WORDS: [&[u8]; 10] = [
        b"0",
        b"-1",
        b"1E400",
        b"NaN",
        b"2147483647",
        b"99999999999999999999",
        b"1",
        b"$",
        b"*",
        b"",
    ];
    let mut bytes = seed.to_vec();
    for _ in 0..=dice.below(3) {
        match dice.below(6) {
            0 => {
                let at = dice.below(bytes.len());
                bytes[at] = dice.next() as u8;
            }
            1 => bytes.truncate(dice.below(bytes.len()).max(200)),
            2 | 3 => {
                // A number or pointer becomes another one of the file, in the same columns.
                let (to, from) = (dice.below(numbers.len()), dice.below(numbers.len()));
                let (to, from) = (numbers[to].clone(), numbers[from].clone());
                if to.end <= bytes.len() {
                    let new = &seed[from];
                    let width = to.len();
                    for (k, place) in to.enumerate() {
                        let pad = width.saturating_sub(new.len());
                        bytes[place] = if k < pad { b'0' } else { new[k - pad] };
                    }
                }
            }
            4 => {
                let at = numbers[dice.below(numbers.len())].clone();
                if at.end <= bytes.len() {
                    let word = WORDS[dice.below(WORDS.len())];
                    bytes.splice(at, word.iter().copied());
                }
            }
            _ => {
                let (a, b) = (dice.below(bytes.len()), dice.below(400));
                bytes.drain(a..(a + b).min(bytes.len()));
            }
        }
    }
    bytes
}

/// What is wrong with how some bytes are read; `None` when there is a model or a typed error.
fn fault(name: &str, bytes: &[u8]) -> Option<String> {
    let start = Instant::now();
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        read_raw(bytes, name)
            .map(|raw| build::build_with(raw, name, build::Creases::Cut))
            .map_err(|e| e.to_string())
    }));
    let took = start.elapsed();
    match outcome {
        Err(_) => Some("panic".into()),
        Ok(_) if took > TOO_LONG => Some(format!("{took:?}")),
        Ok(Err(message)) if message.is_empty() => Some("an error without words".into()),
        Ok(_) => None,
    }
}

#[test]
fn twenty_thousand_mutants_give_a_model_or_a_typed_error() {
    let seeds = seeds();
    let places: Vec<_> = seeds.iter().map(|(_, bytes)| numbers(bytes)).collect();
    let faults: Vec<String> = (0..MUTANTS)
        .into_par_iter()
        .filter_map(|k| {
            let mut dice = Dice(k);
            let which = dice.below(seeds.len());
            let bytes = mutant(&seeds[which].1, &places[which], &mut dice);
            fault(&seeds[which].0, &bytes)
                .map(|what| format!("{} mutant {k}: {what}", seeds[which].0))
        })
        .collect();
    assert!(
        faults.is_empty(),
        "{} faults, first:\n{}",
        faults.len(),
        faults[..faults.len().min(20)].join("\n")
    );
}

/// Small files whose cost grew with the square of what they say, or beyond: each is told so and stays small.
#[test]
fn what_multiplies_itself_is_bounded_and_told() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/fuzz");
    let read = |name: &str| {
        let bytes = std::fs::read(folder.join(name)).unwrap();
        read_raw(&bytes, name)
            .map(|raw| build::build_with(raw, name, build::Creases::Cut))
            .map_err(|e| e.to_string())
    };
    // 131072 placed faces of a file of 5 kB.
    let refused = read("assembly-that-doubles.stp").unwrap_err();
    assert!(refused.contains("placed faces have 524288 sides"), "{refused}");
    let told = |name: &str, code: &str| {
        let (model, said) = read(name).unwrap();
        assert!(said.iter().any(|d| d.code == code), "{name}: {said:?}");
        model
    };
    // 13315 pieces that do not follow an offset surface that folds: the face is lost.
    let folding = told("offset-that-folds.igs", "offset-coarse");
    assert!(folding.faces.is_empty(), "{} faces", folding.faces.len());
    assert!(folding.lost[0].reason.contains("self-intersects"), "{:?}", folding.lost);
    // 256 squares in a row, each over nearly all the others: some 130000 places where a corner lies on a side.
    let overlapping = told("faces-on-each-other.stp", "faces-overlap");
    assert_eq!(overlapping.faces.len(), 256);
    assert!(overlapping.edges.len() < 40_000, "{} edges", overlapping.edges.len());
    // 1024 half discs about one axis.
    assert_eq!(told("arcs-with-the-same-ends.stp", "faces-overlap").faces.len(), 1024);
}

/// Vertices of these splines of noise lie off their surfaces. The mesher here knows their parameters; to a mesh from a file
/// each search looks at all of a surface, and the face is refused by name, on one thread and on several.
#[test]
fn a_face_whose_closest_points_cost_too_much_is_refused_by_name() {
    let name = "splines-of-noise-3.convert.stp";
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/fuzz").join(name);
    let raw = read_raw(&std::fs::read(path).unwrap(), name).unwrap();
    let (model, _) = build::build_with(raw, name, build::Creases::Cut);
    let options = MappedOptions { arc_divisions: 1, ..MappedOptions::default() };
    let mesh = mesh(&model, &options).unwrap();
    convert(&model, &mesh, &ConvertOptions::default()).unwrap();
    let foreign = SurfaceMesh { feet: MeshFeet::default(), ..mesh };
    let found = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| convert(&model, &foreign, &ConvertOptions::default()).unwrap_err())
    });
    assert!(matches!(found[0], ConvertError::Searches { .. }), "{}", found[0]);
    assert_eq!(found[0], found[1]);
}

fn step(data: &str) -> Vec<u8> {
    format!(
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n\
         FILE_SCHEMA(('CONFIG_CONTROL_DESIGN'));\nENDSEC;\nDATA;\n{data}\nENDSEC;\nEND-ISO-10303-21;\n"
    )
    .into_bytes()
}

/// Neither a panic nor a face.
fn gives_no_face(name: &str, bytes: &[u8]) {
    assert_eq!(fault(name, bytes), None, "{name}");
    if let Ok(raw) = read_raw(bytes, name) {
        assert!(raw.faces.is_empty(), "{name}: {} faces", raw.faces.len());
    }
}

#[test]
fn a_million_brackets_are_refused() {
    for (open, close) in [("(", ")"), ("X(", ")"), ("(", "")] {
        let data = format!("#1=A({}{});", open.repeat(1_000_000), close.repeat(1_000_000));
        gives_no_face("brackets.stp", &step(&data));
    }
}

#[test]
fn forty_levels_of_doubling_end() {
    let mut data =
        String::from("#1=CARTESIAN_POINT('',(0.,0.,0.));\n#2=DIRECTION('',(1.,0.,0.));\n");
    data += "#3=VECTOR('',#2,1.);\n#10=LINE('',#1,#3);\n";
    for k in 11..51 {
        let below = k - 1;
        data += &format!(
            "#{k}=COMPOSITE_CURVE('',(#{a},#{b}),.F.);\n#{a}=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#{below});\n\
             #{b}=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#{below});\n",
            a = 1000 + 2 * k,
            b = 1001 + 2 * k
        );
    }
    data += "#60=SURFACE_OF_LINEAR_EXTRUSION('',#50,#3);\n#61=GEOMETRIC_SET('',(#60));\n\
             #62=ADVANCED_FACE('',(),#60,.T.);\n#63=OPEN_SHELL('',(#62));\n#64=SHELL_BASED_SURFACE_MODEL('',(#63));";
    gives_no_face("doubling.stp", &step(&data));
}

/// Where the `#` of each reference of an instance stands, behind its own id.
fn references(line: &str) -> Vec<std::ops::Range<usize>> {
    let from = line.find('=').unwrap_or(line.len());
    let starts = line.match_indices('#').map(|m| m.0).filter(|&at| at > from);
    let digits = |at: usize| line[at + 1..].bytes().take_while(u8::is_ascii_digit).count();
    starts.map(|at| at..at + 1 + digits(at)).collect()
}

#[test]
fn every_pointer_of_every_instance_may_lead_back() {
    let seeds = seeds();
    let mut tried = 0;
    for (name, bytes) in seeds.iter().filter(|s| s.0.ends_with("stp")).take(3) {
        let text = String::from_utf8(bytes.clone()).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        let own = |k: usize| lines[k].split_once('=').map_or("", |l| l.0.trim());
        let refers =
            |j: usize, id: &str| references(lines[j]).iter().any(|r| &lines[j][r.clone()] == id);
        let mut changes: Vec<(usize, String)> = Vec::new();
        for k in (0..lines.len()).filter(|&k| own(k).starts_with('#')) {
            // To itself, to what refers to it, and all to itself.
            let above = (0..lines.len()).find(|&j| own(j).starts_with('#') && refers(j, own(k)));
            let targets = [Some(own(k)), above.map(own)];
            let places = references(lines[k]);
            for (place, target) in places.iter().flat_map(|p| targets.map(|t| (p, t))) {
                let Some(target) = target else { continue };
                let mut line = lines[k].to_owned();
                line.replace_range(place.clone(), target);
                changes.push((k, line));
            }
            let mut line = lines[k].to_owned();
            places.iter().rev().for_each(|p| line.replace_range(p.clone(), own(k)));
            changes.push((k, line));
        }
        tried += changes.len();
        let one = |(k, line): &(usize, String)| {
            let mut changed = lines.clone();
            changed[*k] = line;
            fault(name, changed.join("\n").as_bytes()).map(|what| format!("{name} {line}: {what}"))
        };
        let faults: Vec<String> = changes.par_iter().filter_map(one).collect();
        assert!(faults.is_empty(), "{}", faults.join("\n"));
    }
    assert!(tried > 1000, "{tried} pointers");
}

/// Each number or pointer of the P section becomes the given word, one at a time.
fn iges_with_word_everywhere(word: &str) {
    for (name, bytes) in seeds().iter().filter(|s| s.0.ends_with("igs")).take(2) {
        let text = String::from_utf8(bytes.clone()).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        let faults: Vec<String> = (0..lines.len())
            .into_par_iter()
            .flat_map_iter(|k| {
                let card = lines[k];
                let data = if card.as_bytes().get(72) == Some(&b'P') { &card[..64] } else { "" };
                let values: Vec<&str> = data.trim_end().split(',').collect();
                let mut found = Vec::new();
                for i in 0..values.len().min(6) * usize::from(!data.is_empty()) {
                    let mut new = values.clone();
                    new[i] = word;
                    // Longer than the card: the columns behind 64 move, as a careless writer's would.
                    let line = format!("{:<64}{}", new.join(","), &card[64..]);
                    let mut changed = lines.clone();
                    changed[k] = &line;
                    let what = fault(name, changed.join("\n").as_bytes());
                    found.extend(what.map(|what| format!("{name} card {k} value {i}: {what}")));
                }
                found
            })
            .collect();
        assert!(faults.is_empty(), "{word}: {}", faults.join("\n"));
    }
}

#[test]
fn huge_counts_and_no_numbers_anywhere_in_iges_are_survived() {
    for word in ["2147483647", "1E400", "NaN", "-1", "1"] {
        iges_with_word_everywhere(word);
    }
}

#[test]
fn directions_of_no_length_are_survived() {
    for (name, bytes) in seeds().iter().filter(|s| s.0.ends_with("stp")) {
        let text = String::from_utf8(bytes.clone()).unwrap();
        let lines = text.lines().map(|line| match line.find("DIRECTION(") {
            Some(at) => format!("{}DIRECTION('',(0.,0.,0.));", &line[..at]),
            None => line.to_owned(),
        });
        let changed = lines.collect::<Vec<_>>().join("\n");
        assert_ne!(changed, text.trim_end());
        assert_eq!(fault(name, changed.as_bytes()), None, "{name}");
    }
}
