//! Closest points of a tool: `cargo run --release --example closest_points PUNCH.tool.json < POINTS`, three coordinates a line.

use std::io::BufRead as _;

use kanagata::prelude::{Error, Tool};

fn main() -> Result<(), Error> {
    let Some(file) = std::env::args().nth(1) else {
        eprintln!("closest_points PUNCH.tool.json < POINTS");
        return Ok(());
    };
    let tool = Tool::read(file)?;
    let lines = std::io::stdin().lock().lines().map_while(Result::ok);
    let points: Vec<[f64; 3]> = lines.filter_map(|line| point(&line)).collect();
    for foot in tool.closest(&points) {
        let (p, n) = (foot.point, foot.normal);
        println!(
            "{} {} {}  gap {}  normal {} {} {}  patch {}",
            p.x, p.y, p.z, foot.gap, n.x, n.y, n.z, foot.patch
        );
    }
    Ok(())
}

/// The three numbers of a line.
fn point(line: &str) -> Option<[f64; 3]> {
    let numbers: Vec<f64> =
        line.split_whitespace().map(str::parse).collect::<Result<_, _>>().ok()?;
    numbers.try_into().ok()
}

#[test]
fn lines_of_three_numbers_are_points() {
    assert_eq!(point(" 1 2.5 -3e1 "), Some([1.0, 2.5, -30.0]));
    assert_eq!((point("1 2"), point("x y z")), (None, None));
}
