//! Table of foreign CAD files against an independent kernel: `cargo run --release --example cad_report [WORD] [-v]`.

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
    println!(
        "| file | faces | kernel's | unmatched | area off | allowed | box off | free edges [mm] | kernel's [mm] | read [s] | |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    let (mut exact, mut checked) = (0, 0);
    for (name, truth) in check::truths(&folder) {
        if word.is_some_and(|w| !name.contains(w.as_str())) {
            continue;
        }
        let (sender, receiver) = std::sync::mpsc::channel();
        let (place, own) = (folder.clone(), name.clone());
        std::thread::spawn(move || drop(sender.send(check::check(&place, &own, &truth, true))));
        let Ok(row) = receiver.recv_timeout(std::time::Duration::from_secs(60)) else {
            println!("| {name} | no answer (panic or 60 s) |");
            continue;
        };
        print_row(&row);
        if row.checked {
            checked += 1;
            exact += usize::from(row.holds());
        }
        if verbose {
            row.diagnostics.iter().for_each(|d| println!("    {d}"));
        }
    }
    println!("\n{exact} of {checked} checked files agree");
}

fn print_row(row: &check::Row) {
    let number = |x: Option<f64>| x.map_or("-".into(), |x| format!("{x:.2e}"));
    let mark = |holds: bool| if holds { "" } else { "**" };
    let (a, b, f) = (mark(row.area_holds()), mark(row.bbox_holds()), mark(row.free_holds()));
    println!(
        "| {} | {} | {} | {} + {} | {a}{}{a} | {} | {b}{}{b} | {f}{}{f} | {} | {:.3} | {} |",
        row.name,
        row.faces[0],
        row.faces[1],
        row.unmatched[0],
        row.unmatched[1],
        number(row.area.map(|x| x[0])),
        number(row.area.map(|x| x[1])),
        number(row.bbox),
        row.free.map_or("-".into(), |x| format!("{:.6}", x[0])),
        row.free.map_or("-".into(), |x| format!("{:.6}", x[1])),
        row.seconds,
        match (&row.refused, row.checked) {
            (Some(why), _) => why.as_str(),
            (None, true) => "",
            (None, false) => "not checked",
        },
    );
    std::io::stdout().flush().ok();
}
