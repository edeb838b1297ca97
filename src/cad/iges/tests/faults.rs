//! Tests of defective files: errors and diagnostics with locations, no panic, bounded work.

use super::build::{file, item, moved};
use super::*;
use crate::iges::ownership::{Field, POINTERS};

/// Error or diagnostics for a file of these entities.
fn messages(items: &[super::build::Item]) -> String {
    match read_bytes(&file(items), "bad.igs") {
        Err(error) => error.to_string(),
        Ok(model) => format!("{} faces; {:?}", model.faces.len(), model.diagnostics),
    }
}

#[test]
fn errors_name_line_card_entity_found_and_allowed() {
    let table: [(u32, &str, &str); 12] = [
        (196, "1.5,2.", "parameter 1 (centre or point) is `1.5`; allowed: an integer"),
        (
            196,
            "99,2.",
            "parameter 1 (centre or point) points to D99, which is not an entry; allowed: the sequence number of a directory entry (odd)",
        ),
        (196, ",2.", "parameter 1 (centre or point) is 0; allowed: the sequence number"),
        (196, "3,1E400", "parameter 2 (radius) is `1E400`; allowed: a finite number"),
        (196, "3,NaN", "parameter 2 (radius) is `NaN`; allowed: a finite number"),
        (196, "3,-1.", "radius -1, second 0"),
        (
            114,
            "3,1,2147483647,1",
            "parameter 3 (M) is 2147483647; allowed: 0 to 0, what the record can hold",
        ),
        (128, "2147483647,1,1,1", "parameter 1 (upper index K1) is 2147483647; allowed: 0 to 5"),
        (
            128,
            "1,1,1,1,0,0,1,0,0,0.,0.",
            "knots, weights and points: 24 parameters declared, 2 there",
        ),
        (144, "3,1,2147483647,3", "parameter 3 (N2) is 2147483647"),
        (143, "0,3,-1", "parameter 3 (number of boundaries) is -1"),
        (128, "0,0,0,0,0,0,0,0,0,0.,0.,0.,0.,1.,1.,2.,3.", "degree 0 is outside 1 to 25"),
    ];
    for (kind, text, wanted) in table {
        let got = messages(&[item(kind, 0, text), item(116, 0, "0.,0.,0.")]);
        assert!(got.contains(wanted), "{kind},{text}:\n{got}");
        assert!(got.starts_with("bad.igs, line "), "{got}");
        assert!(got.contains(&format!("(D1, entity {kind})")), "{got}");
    }
}

#[test]
fn text_that_is_no_iges_is_refused() {
    for bytes in [&b""[..], b"\n\n", b"ISO-10303-21;", &[0u8; 1000], &[b' '; 80], &[0xFF; 4000]] {
        assert!(matches!(read_bytes(bytes, "x"), Err(CadError::Invalid { .. })));
    }
    let binary = format!("{:72}C{:7}\n", "", 1);
    let error = read_bytes(binary.as_bytes(), "x").unwrap_err().to_string();
    assert!(error.contains("compressed"), "{error}");
}

#[test]
fn one_bad_face_does_not_cost_the_others() {
    let items = [item(196, 0, "5,2."), item(196, 0, "5,bad"), item(116, 0, "0.,0.,0.")];
    let model = read_bytes(&file(&items), "x").unwrap();
    assert_eq!((model.faces.len(), model.diagnostics.len()), (1, 1));
    assert_eq!(model.diagnostics[0].severity, Severity::Warning);
    assert!(model.diagnostics[0].place.contains("(D3, entity 196)"));
}

/// Records with sufficient pointers to be read, all to D1 and D3.
const RECORDS: [(u32, i32, &str); 26] = [
    (102, 0, "2,1,3"),
    (108, 1, "0.,0.,1.,0.,1"),
    (118, 1, "1,3,0,0"),
    (120, 0, "1,3,0.,1."),
    (122, 0, "1,1.,2.,3."),
    (130, 0, "1,1,0,0,0,1.,0.,0.,0.,0.,0.,1."),
    (130, 0, "3,1,0,0,0,1.,0.,0.,0.,0.,0.,1."),
    (140, 0, "0.,0.,1.,1.,1"),
    (140, 0, "0.,0.,1.,1.,3"),
    (141, 0, "1,3,1,1,1,1,1,1"),
    (142, 0, "0,1,3,1,3"),
    (143, 0, "0,1,1,3"),
    (144, 0, "1,1,1,3,1"),
    (186, 0, "1,1,1,3,1"),
    (190, 1, "1,3,1"),
    (192, 1, "1,3,1.,1"),
    (194, 1, "1,3,1.,30.,1"),
    (196, 1, "1,1.,3,1"),
    (198, 1, "1,3,2.,1.,1"),
    (308, 0, "0,1Hx,2,1,3"),
    (402, 7, "2,1,3"),
    (408, 0, "3,0.,0.,0.,1."),
    (504, 1, "1,1,1,1,3,1"),
    (508, 1, "1,0,3,1,1,1,0,1"),
    (510, 1, "1,1,1,3"),
    (514, 1, "2,1,1,3,1"),
];

#[test]
fn self_and_mutual_references_end() {
    for (a, form_a, text_a) in RECORDS {
        for (b, form_b, text_b) in RECORDS {
            for matrix in [0, 1, 3, 5] {
                let items = [
                    moved(a, form_a, matrix, text_a),
                    moved(b, form_b, matrix, text_b),
                    moved(124, 0, 5, "1.,0.,0.,0.,0.,1.,0.,0.,0.,0.,1.,0."),
                ];
                let _ = messages(&items);
            }
        }
    }
}

/// A record of this pattern with one element per repetition: pointer `slot` is `here`, the others are `there`, skipped
/// fields are `skipped`. Returns the text and the number of pointers.
fn record(pattern: &[Field], slot: usize, pointers: [u32; 2], skipped: &str) -> (String, usize) {
    fn write(fields: &[Field], put: &mut dyn FnMut(&Field)) {
        for field in fields {
            put(field);
            if let Field::Each(inner) | Field::Inner(inner) = field {
                write(inner, put);
            }
        }
    }
    let (mut values, mut count) = (Vec::new(), 0);
    write(pattern, &mut |field| match field {
        Field::Skip => values.push(skipped.to_owned()),
        Field::Count | Field::Inner(_) => values.push("1".into()),
        Field::Each(_) => {}
        Field::Pointer => {
            values.push(pointers[usize::from(count != slot)].to_string());
            count += 1;
        }
    });
    // Values after the last pointer that some types need.
    values.extend(std::iter::repeat_n(skipped.to_owned(), 12));
    (values.join(","), count)
}

#[test]
fn every_pointer_of_every_entity_may_lead_back() {
    let (mut files, mut slots) = (0, 0);
    for (kind, pattern) in &POINTERS {
        let count = record(pattern, 0, [1, 1], "1").1;
        assert!(count > 0, "entity {kind} has pointers");
        slots += count;
        for slot in 0..count {
            for (other, back) in &POINTERS {
                // All pointers of D1 refer to D1 or D3, those of D3 to D1 or D3.
                for (here, there, skipped) in [(1, 3, "1"), (3, 1, "1"), (3, 3, "0"), (1, 1, "0")] {
                    let first = record(pattern, slot, [here, there], skipped).0;
                    let second = record(back, usize::MAX, [1, 4 - here], skipped).0;
                    for form in [0, 1] {
                        let _ = messages(&[item(*kind, form, &first), item(*other, form, &second)]);
                        files += 1;
                    }
                }
            }
        }
    }
    assert!(slots > 40 && files > 8000, "{slots} pointers in {files} files");
}

#[test]
fn references_that_double_forty_times_are_refused() {
    let pointer = |i: usize| 2 * i + 1;
    let ladder = |kind: u32, text: &dyn Fn(usize) -> String| -> Vec<super::build::Item> {
        (0..40).map(|i| item(kind, 0, text(pointer(i + 1)))).collect()
    };
    let mut composites = ladder(102, &|next| format!("2,{next},{next}"));
    composites.push(item(110, 0, "0.,0.,0.,1.,0.,0."));
    composites.push(item(122, 0, "1,1.,2.,3."));
    let mut figures = ladder(308, &|next| format!("0,1Hx,2,{next},{next}"));
    figures.push(item(196, 0, "83,1."));
    figures.push(item(116, 0, "0.,0.,0."));
    let mut instances = Vec::new();
    for i in 0..20 {
        instances.push(item(308, 0, format!("0,1Hx,2,{0},{0}", pointer(2 * i + 1))));
        instances.push(item(408, 0, format!("{},1.,0.,0.,1.", pointer(2 * i + 2))));
    }
    instances.push(item(308, 0, "0,1Hx,1,83"));
    instances.push(item(196, 0, "85,1."));
    instances.push(item(116, 0, "0.,0.,0."));
    instances.push(item(408, 0, "1,0.,0.,0.,1."));
    for items in [composites, figures, instances] {
        let got = messages(&items);
        assert!(got.contains("repeatedly") || got.contains("too deeply nested"), "{got}");
    }
}

#[test]
fn faces_multiply_no_further_than_the_file_is_long() {
    let doubled = |levels: usize| {
        let mut items: Vec<_> =
            (1..=levels).map(|i| item(308, 0, format!("0,1Hx,2,{0},{0}", 2 * i + 1))).collect();
        items.push(item(196, 0, format!("{},1.", 2 * levels + 3)));
        items.push(item(116, 0, "0.,0.,0."));
        read_bytes(&file(&items), "doubled").map(|model| model.faces.len())
    };
    assert_eq!(doubled(12).unwrap(), 4096);
    let error = doubled(14).unwrap_err().to_string();
    assert!(error.contains("repeatedly") && error.contains("sides"), "{error}");
}

#[test]
fn long_chains_end() {
    let n = 20_000;
    let chain = |kind: u32, form: i32, text: &dyn Fn(usize) -> String| -> Vec<super::build::Item> {
        (0..n).map(|i| item(kind, form, text(2 * i + 3))).collect()
    };
    for items in [
        chain(102, 0, &|next| format!("1,{next}")),
        chain(308, 0, &|next| format!("0,1Hx,1,{next}")),
        chain(402, 7, &|next| format!("1,{next}")),
        chain(140, 0, &|next| format!("0.,0.,1.,1.,{next}")),
        chain(130, 0, &|next| format!("{next},1,0,0,0,1.,0.,0.,0.,0.,0.,1.")),
        chain(144, 0, &|next| format!("{next},1,0,{next}")),
    ] {
        let _ = messages(&items);
    }
    let matrices: Vec<_> = (0..n)
        .map(|i| {
            moved(124, 0, u32::try_from(2 * i + 3).unwrap(), "1.,0.,0.,0.,0.,1.,0.,0.,0.,0.,1.,0.")
        })
        .chain([moved(110, 0, 1, "0.,0.,0.,1.,0.,0.")])
        .collect();
    let _ = messages(&matrices);
}

/// Pseudo-random numbers (SplitMix64), so that every run makes the same mutations.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, sides: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        usize::try_from((z ^ (z >> 31)) % sides.max(1) as u64).unwrap()
    }
}

/// Byte sequences likely to break a parser.
const SPLINTERS: [&[u8]; 16] = [
    b"2147483647",
    b"-1",
    b"1E400",
    b"NaN",
    b",",
    b";",
    b"99999H",
    b"0",
    b"1.D308",
    b"-1.D308",
    b"1",
    b"3",
    b"",
    b"\n",
    b"1E-320",
    b"144",
];

fn mutate(bytes: &[u8], dice: &mut Dice) -> Vec<u8> {
    let mut out = bytes.to_vec();
    for _ in 0..=dice.roll(6) {
        let at = dice.roll(out.len());
        let end = out.len().min(at + dice.roll(12));
        match dice.roll(8) {
            0 => out[at] = b" 0123456789,;.-+EDHPG\n\xFF"[dice.roll(23)],
            1 => drop(out.splice(at..end, SPLINTERS[dice.roll(16)].iter().copied())),
            2 => {
                let put = SPLINTERS[dice.roll(16)];
                let end = out.len().min(at + put.len());
                out[at..end].copy_from_slice(&put[..end - at]);
            }
            3 => out.truncate(at),
            4 => {
                let from = dice.roll(out.len());
                let chunk = out[from..out.len().min(from + 81)].to_vec();
                drop(out.splice(at..at, chunk));
            }
            5 => drop(out.drain(at..out.len().min(at + 81))),
            _ => {
                // Replace one digit
                let digits = (at..out.len()).find(|i| out[*i].is_ascii_digit()).unwrap_or(at);
                out[digits] = b"0123456789"[dice.roll(10)];
            }
        }
        if out.is_empty() {
            break;
        }
    }
    out
}

#[test]
fn mutated_files_never_panic() {
    let mut seeds: Vec<Vec<u8>> =
        ["cone_144", "torus_186", "sphere_186", "hemi_punch_nurbs144", "cross_holder_144"]
            .iter()
            .map(|n| std::fs::read(forming().join(format!("{n}.igs"))).unwrap())
            .collect();
    seeds.push(file(&[
        item(408, 0, "3,1.,0.,0.,2."),
        item(308, 0, "0,3Hone,4,5,7,9,11"),
        item(122, 0, "13,1.,0.,5."),
        item(118, 1, "13,15,0,0"),
        item(140, 0, "0.,0.,1.,3.,7"),
        item(108, 1, "0.,0.,1.,0.,17,0.,0.,0.,1."),
        item(100, 0, "0.,0.,0.,1.,0.,0.,1."),
        item(112, 0, "3,1,3,1,2.,4.,1.,2.,3.,4.,0.,0.,0.,0.,7.,0.,0.,0."),
        item(106, 63, "1,3,0.,0.,0.,1.,0.,1.,2."),
        item(120, 0, "21,13,0.,1.5"),
        item(110, 0, "0.,0.,0.,0.,0.,1."),
        item(104, 1, "0.25,0.,1.,0.,0.,-1.,3.,2.,0.,0.,1."),
        item(130, 0, "23,1,0,0,0,-2.,0.,0.,0.,0.,0.,1.,0.,1.57"),
        item(122, 0, "25,1.,0.,5."),
        item(430, 0, "31"),
        item(184, 0, "1,1,0"),
    ]));
    let mut dice = Dice(1);
    for round in 0..6000 {
        let seed = &seeds[round % seeds.len()];
        let bytes = mutate(seed, &mut dice);
        if let Err(error) = std::panic::catch_unwind(|| read_bytes(&bytes, "mutant").is_ok()) {
            let path = std::env::temp_dir().join("kanagata-mutant.igs");
            std::fs::write(&path, &bytes).unwrap();
            std::panic::resume_unwind(error);
        }
    }
}

#[test]
fn a_file_cut_off_before_its_parameters_is_refused_though_curves_are_left() {
    let items = [item(144, 0, "3,0,0,0"), item(196, 0, "5,2."), item(110, 0, "0.,0.,0.,1.,0.,0.")];
    let whole = super::build::cards(&items);
    let cut = |section: &[char]| {
        let kept = whole.iter().filter(|card| !card[72..].starts_with(section));
        let text: String = kept.map(|card| format!("{card}\n")).collect();
        read_bytes(text.as_bytes(), "cut.igs")
            .map(|model| model.faces.len())
            .unwrap_err()
            .to_string()
    };
    let said = cut(&['P', 'T']);
    let words = "ends in its directory section (D)";
    assert!(said.starts_with("cut.igs, line ") && said.contains(words), "{said}");
    assert!(said.contains("no parameter section (P) and no terminate section (T)"), "{said}");
    assert!(cut(&['P']).contains("no parameter card starts with"));
}
