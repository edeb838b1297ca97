//! Tests of writer peculiarities: the same model for any card layout.

use super::build::{cards, cards_in, item};
use super::*;

/// Cards of a real file with arcs, matrices, composites and trimmed surfaces.
fn sample() -> Vec<String> {
    let bytes = std::fs::read(forming().join("round_die_144.igs")).unwrap();
    String::from_utf8(bytes).unwrap().lines().map(str::to_owned).collect()
}

fn reads_alike(bytes: &[u8], what: &str) -> RawModel {
    let plain = read_bytes(sample().join("\n").as_bytes(), "plain").unwrap();
    let model = read_bytes(bytes, what).unwrap_or_else(|e| panic!("{what}: {e}"));
    assert_eq!(format!("{:?}", model.faces), format!("{:?}", plain.faces), "{what}");
    model
}

/// Parameter cards, modified one by one.
fn with_parameters(change: impl Fn(usize, String) -> String) -> String {
    let is_parameter = |l: &String| l.as_bytes().get(72) == Some(&b'P');
    let lines = sample().into_iter().enumerate();
    lines
        .map(|(i, l)| if is_parameter(&l) { change(i, l) } else { l })
        .collect::<Vec<_>>()
        .join("\n")
}

#[test]
fn line_ends_and_widths_do_not_matter() {
    let lines = sample();
    assert!(lines.iter().all(|l| l.len() == 80));
    reads_alike(lines.concat().as_bytes(), "bare records");
    reads_alike(format!("{}\n", lines.concat()).as_bytes(), "bare records with a last line end");
    reads_alike(lines.join("\r\n").as_bytes(), "CR LF");
    reads_alike(lines.join("\r").as_bytes(), "CR");
    reads_alike(
        lines.iter().map(|l| format!("{l} \n")).collect::<String>().as_bytes(),
        "81 columns",
    );
    reads_alike(
        lines.iter().map(|l| format!("{l}\n\n")).collect::<String>().as_bytes(),
        "empty lines",
    );
    reads_alike(format!("\u{feff}{}", lines.join("\n")).as_bytes(), "byte order mark");
    let cut = with_parameters(|i, l| if i % 2 == 0 { l[..64].trim_end().to_owned() } else { l });
    let model = reads_alike(cut.as_bytes(), "64 columns");
    assert!(model.diagnostics.iter().any(|d| d.code == "card-unlettered"));
    let first = lines.iter().position(|l| l.as_bytes()[72] == b'P').unwrap();
    let cut: Vec<_> =
        lines.iter().enumerate().map(|(i, l)| if i > first { &l[..72] } else { l }).collect();
    reads_alike(cut.join("\n").as_bytes(), "72 columns");
}

#[test]
fn pointers_and_numbers_of_cards_may_be_wrong() {
    reads_alike(
        with_parameters(|_, l| format!("{}      0{}", &l[..65], &l[72..])).as_bytes(),
        "no back pointers",
    );
    reads_alike(
        with_parameters(|_, l| format!("{}1234567{}", &l[..65], &l[72..])).as_bytes(),
        "wrong back pointers",
    );
    reads_alike(
        with_parameters(|_, l| format!("{}0000000", &l[..73])).as_bytes(),
        "no sequence numbers",
    );
    reads_alike(
        with_parameters(|_, l| format!("{}{:7}", &l[..73], 4_000_000 - l.len())).as_bytes(),
        "one number",
    );
}

#[test]
fn directory_entries_may_lack_numbers_pointers_and_fields() {
    let swap = |section: u8, change: &dyn Fn(usize, &str) -> String| -> String {
        let lines = sample().into_iter().enumerate();
        lines
            .map(|(i, l)| if l.as_bytes()[72] == section { change(i, &l) } else { l })
            .collect::<Vec<_>>()
            .join("\n")
    };
    reads_alike(
        swap(b'D', &|_, l| format!("{}0000000", &l[..73])).as_bytes(),
        "no directory numbers",
    );
    let model = reads_alike(
        swap(b'D', &|_, l| format!("{}{:>8}{}", &l[..8], 0, &l[16..])).as_bytes(),
        "no parameter pointers",
    );
    assert!(model.diagnostics.iter().any(|d| d.code == "parameters-relocated"));
    reads_alike(
        swap(b'D', &|_, l| l[..72].replace("       0", "        ") + &l[72..]).as_bytes(),
        "blank fields",
    );
    reads_alike(
        swap(b'D', &|_, l| format!("{}01010000{}", &l[..64], &l[72..])).as_bytes(),
        "status 01",
    );
    reads_alike(swap(b'T', &|_, _| String::new()).as_bytes(), "no T section");
}

#[test]
fn records_may_run_on_or_not_end() {
    reads_alike(with_parameters(|_, l| l.replacen(';', " ", 1)).as_bytes(), "no record delimiters");
    let comment = |l: String| {
        let Some(at) = l.find(';') else { return l };
        format!(
            "{:64}{}",
            format!("{}; note, x", &l[..at]).chars().take(64).collect::<String>(),
            &l[64..]
        )
    };
    reads_alike(with_parameters(|_, l| comment(l)).as_bytes(), "comments");
    let spelled = with_parameters(|_, l| format!("{}{}", l[..64].replace("E-", "D-"), &l[64..]));
    reads_alike(spelled.as_bytes(), "D exponents");
    let spelled = with_parameters(|_, l| format!("{}{}", l[..64].replace("E-", "e-"), &l[64..]));
    reads_alike(spelled.as_bytes(), "e exponents");
}

#[test]
fn data_may_run_into_column_65() {
    let text = "0.,0.,0.,1.,0.,1234567890.";
    let long = format!("{:0>38}.,{text}", "");
    let items = [item(110, 0, long)];
    let mut lines = cards(&items);
    let at = lines.iter().position(|l| l.as_bytes()[72] == b'P').unwrap();
    let (one, two) = (lines[at].clone(), lines[at + 1].clone());
    let moved = two.chars().next().unwrap();
    lines[at] = format!("{}{moved}{}", &one[..64], &one[65..]);
    lines[at + 1] = format!("{:64}{}", &two[1..64], &two[64..]);
    let model = read_bytes(lines.join("\n").as_bytes(), "65").unwrap();
    assert_eq!(model.loose_curves, 1);
    assert!(model.diagnostics.is_empty(), "{:?}", model.diagnostics);
}

#[test]
fn lengths_become_millimetres_by_unit_and_scale() {
    let items = [item(196, 0, "3,2."), item(116, 0, "1.,2.,3.,0")];
    for (unit, mm) in
        [("1.,2,2HMM", 1.0), ("1.,1,2HIN", 25.4), ("0.5,6,1HM", 2000.0), ("4.,3,2HFT", 76.2)]
    {
        let model = read_bytes(cards_in(&items, unit).join("\n").as_bytes(), unit).unwrap();
        let crate::raw::RawSurface::Sphere { frame, radius } = &model.faces[0].surface else {
            panic!("{:?}", model.faces)
        };
        assert!(
            (radius - 2.0 * mm).abs() < 1e-9 && (frame.origin.z - 3.0 * mm).abs() < 1e-9,
            "{unit}"
        );
    }
}
