//! Foreign CAD files against what an independent kernel says of them, one JSON object a line:
//! `cargo run --release --example cad_report [WORD] [-v]`. `tools/bench cad` makes the table of them.

#[path = "../tests/corpus/check.rs"]
mod check;

use std::io::Write;

fn main() {
    let Some(folder) = check::folder() else {
        eprintln!("no corpus: set KANAGATA_CORPUS to a folder with truth.json");
        return;
    };
    let words: Vec<String> = std::env::args().skip(1).collect();
    let verbose = words.iter().any(|w| w == "-v");
    let word = words.iter().find(|w| *w != "-v");
    for (name, truth) in check::truths(&folder) {
        if word.is_some_and(|w| !name.contains(w.as_str())) {
            continue;
        }
        let (sender, receiver) = std::sync::mpsc::channel();
        let checked = truth["trust"] == "checked";
        let (place, own) = (folder.clone(), name.clone());
        std::thread::spawn(move || drop(sender.send(check::check(&place, &own, &truth, true))));
        let row = receiver.recv_timeout(std::time::Duration::from_secs(60)).unwrap_or(check::Row {
            name,
            checked,
            refused: Some("no answer (panic or 60 s)".into()),
            ..check::Row::default()
        });
        print_row(&row);
        if verbose {
            row.diagnostics.iter().for_each(|d| eprintln!("    {d}"));
        }
    }
}

fn print_row(row: &check::Row) {
    let differs: Vec<&str> = row.differs().collect();
    let found = serde_json::json!({
        "file": row.name,
        "checked": row.checked,
        "faces": row.faces,
        "unmatched": row.unmatched,
        "area_off": row.area.map(|x| x[0]),
        "area_allowed": row.area.map(|x| x[1]),
        "box": row.bounds,
        "box_off": row.bbox,
        "free_edges_mm": row.free,
        "read_s": row.seconds,
        "differs": differs,
        "refused": row.refused,
    });
    println!("{found}");
    std::io::stdout().flush().ok();
}
