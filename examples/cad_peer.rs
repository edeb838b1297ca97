//! One side of `tools/peers cad`: reads a CAD file on one thread, samples points near its faces, finds the closest
//! points of the model. Prints one JSON object: `cargo run --release --example cad_peer FILE [POINTS]`.

use std::path::Path;
use std::time::Instant;

use kanagata::cad::closest::ClosestPoint;
use kanagata::cad::model::{Face, Model};
use kanagata::cad::read;
use kanagata::cad::trim_region::TrimRegion;
use kanagata::geometry::{Vec2, Vec3};

/// Farthest sample from the faces, as a share of the model's diagonal.
const REACH: f64 = 0.01;

struct Dice(u64);

impl Dice {
    fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A point of the face and the normal there.
fn on_face(face: &Face, region: &TrimRegion, dice: &mut Dice) -> Option<(Vec3, Vec3)> {
    (0..200).find_map(|_| {
        let share = Vec2::new(dice.next(), dice.next());
        let uv = region.low + (region.high - region.low).component_mul(&share);
        let inside = region.contains(uv);
        let normal = if inside { face.normal(uv) } else { None };
        normal.map(|n| (face.surface.point(uv), n))
    })
}

fn points(model: &Model, count: usize, diagonal: f64) -> Vec<Vec3> {
    let regions: Vec<TrimRegion> = model.faces.iter().map(TrimRegion::new).collect();
    let areas: Vec<f64> = model.faces.iter().map(|f| f.area(1e-4)).collect();
    let total: f64 = areas.iter().sum();
    let mut dice = Dice(7);
    let mut out = Vec::new();
    for _ in 0..4 * count {
        let mut left = dice.next() * total;
        let face = areas.iter().position(|a| {
            left -= a;
            left <= 0.0
        });
        let Some(f) = face.filter(|_| out.len() < count) else { continue };
        if let Some((p, n)) = on_face(&model.faces[f], &regions[f], &mut dice) {
            out.push(p + n * (REACH * diagonal * (2.0 * dice.next() - 1.0)));
        }
    }
    out
}

/// Median of the seconds that three calls take.
fn median_of_three(mut call: impl FnMut()) -> f64 {
    let mut all = [0.0; 3].map(|_: f64| {
        let start = Instant::now();
        call();
        start.elapsed().as_secs_f64()
    });
    all.sort_by(f64::total_cmp);
    all[1]
}

/// Most memory this process has held so far [MB], where the system tells.
fn peak_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kb: f64 = line.trim().trim_end_matches("kB").trim().parse().ok()?;
    Some(kb / 1024.0)
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [file, rest @ ..] = &words[..] else {
        eprintln!("cad_peer FILE [POINTS]");
        std::process::exit(2);
    };
    let count = rest.first().and_then(|n| n.parse().ok()).unwrap_or(1000);
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("the first pool");
    let path = Path::new(file);
    let model = match read(path) {
        Ok((model, _)) => model,
        Err(error) => {
            eprintln!("{error}");
            std::process::exit(2);
        }
    };
    let peak_mb = peak_mb();
    let read_s = median_of_three(|| drop(std::hint::black_box(read(path))));
    let diagonal = model.bbox().diagonal();
    let points = if model.faces.is_empty() { vec![] } else { points(&model, count, diagonal) };
    let start = Instant::now();
    let index = ClosestPoint::new(&model);
    let index_s = start.elapsed().as_secs_f64();
    let mut distances = Vec::new();
    let search_s = median_of_three(|| {
        let found = points.iter().map(|p| index.closest(p).map_or(f64::NAN, |f| f.distance));
        distances = found.collect();
    });
    let found = serde_json::json!({
        "faces": model.faces.len(),
        "diagonal_mm": diagonal,
        "read_s": read_s,
        "peak_mb": peak_mb,
        "index_s": index_s,
        "search_s": search_s,
        "points": points.iter().map(|p| [p.x, p.y, p.z]).collect::<Vec<_>>(),
        "distances_mm": distances,
    });
    println!("{found}");
}
