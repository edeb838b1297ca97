//! The contact search measured: misses against an oracle, time, growth, threads, the paper's searches, facets.
//! The last line is JSON. `KANAGATA_POINTS` (default 20000) points of each kind are judged on the first model, a
//! tenth of that on the others. With `KANAGATA_MODELS`, a folder of tool models (`tools/models FOLDER`), only the tree is
//! judged, on so many points of each kind on every one of them.

#[path = "contact_cases/mod.rs"]
mod cases;
#[path = "contact_cases/models.rs"]
mod models;
#[path = "contact_cases/path.rs"]
mod path;

use std::hint::black_box;
use std::time::Instant;

use cases::{KINDS, Random, point};
use kanagata::contact::oracle::Oracle;
use kanagata::contact::paper::PaperSearch;
use kanagata::contact::{ContactSearch, Outcome, Projection, ToolSurface};
use kanagata::geometry::Vec3;
use kanagata::report::drawing::{Chart, Line, write_chart};
use kanagata::tool::ToolModel;
use parry3d_f64::query::PointQuery;
use rayon::prelude::*;

fn main() {
    let models = models::cross();
    // `cargo test` runs benches too, without this argument: then only see that all of it works.
    if !std::env::args().any(|a| a == "--bench") {
        let [misses, _] = exactness(&models[1..2], 20);
        assert_eq!(misses, 0);
        return;
    }
    let points = std::env::var("KANAGATA_POINTS").ok().and_then(|n| n.parse().ok());
    let points: usize = points.unwrap_or(20_000);
    if let Some(folder) = std::env::var_os("KANAGATA_MODELS") {
        return only_tree(&models::of_folder(folder.as_ref()), points);
    }
    let [misses, uncertified] = exactness(&models, points);
    smoothness(&models);
    miss_rates(&models[0].1);
    let die = ToolSurface::new(models[0].1.clone());
    let [cold, warm] = speed(&die);
    let growth = growth();
    let threads = threads(&die);
    let paper = against_paper(&models[0].1, cold);
    let parry = against_parry(&models[0].1, &die);
    println!(
        "{}",
        serde_json::json!({
            "misses": misses, "uncertified": uncertified, "warm_us": warm, "cold_us": cold, "growth_1e2_1e6": growth,
            "threads_2": threads, "vs_paper": paper, "vs_parry": parry,
        })
    );
}

/// Counts of one search on one kind of point.
#[derive(Default, Clone, Copy)]
struct Tally {
    points: usize,
    /// More than 1e-9 mm farther than the oracle's.
    missed: usize,
    /// More than 1e-3 mm farther.
    badly: usize,
    failed: usize,
    worst: f64,
}

impl Tally {
    /// An answer that is not certified counts as failed and is judged all the same; a failed search has none.
    fn add(mut self, excess: f64, outcome: Outcome) -> Self {
        self.points += 1;
        self.failed += usize::from(matches!(outcome, Outcome::Failed | Outcome::WorkSpent));
        if outcome != Outcome::Failed {
            self.missed += usize::from(excess > 1e-9);
            self.badly += usize::from(excess > 1e-3);
            self.worst = self.worst.max(excess);
        }
        self
    }

    fn and(self, o: Self) -> Self {
        Self {
            points: self.points + o.points,
            missed: self.missed + o.missed,
            badly: self.badly + o.badly,
            failed: self.failed + o.failed,
            worst: self.worst.max(o.worst),
        }
    }
}

/// Misses of the tree on all models, and answers it could not certify (right or not); the paper's searches beside it.
fn exactness(models: &[(String, ToolModel)], points: usize) -> [usize; 2] {
    let closed: Vec<_> = (0..20).map(|k| (format!("closed {k}"), cases::closed(k))).collect();
    let all = models.iter().chain(&closed);
    let (mut misses, mut uncertified) = (0, 0);
    for (index, (name, model)) in all.enumerate() {
        let count = if index == 0 { points } else { points / 10 };
        let tree = ToolSurface::new(model.clone());
        let grid = PaperSearch::bezier_grid(model.clone());
        let nodes = PaperSearch::nagata_nodes(model.clone());
        let searches: [(&str, &dyn ContactSearch); 3] =
            [("tree", &tree), ("bezier-grid", &grid), ("nagata-nodes", &nodes)];
        let oracle = Oracle::new(model);
        for (k, kind) in KINDS.iter().enumerate() {
            let tallies = judge(model, &oracle, &searches, k, count);
            misses += tallies[0].missed;
            uncertified += tallies[0].failed;
            if index < models.len() {
                for (t, (search, _)) in tallies.iter().zip(&searches) {
                    println!(
                        "{name:16} {:6} patches {kind:28} {search:12} {:8} points missed {:8} (> 1e-3 mm: {:8}) \
                         failed {:8} worst {:.1e} mm",
                        model.patches.len(),
                        t.points,
                        t.missed,
                        t.badly,
                        t.failed,
                        t.worst
                    );
                }
            } else if tallies[0].missed + tallies[0].failed > 0 {
                let Tally { missed, failed, .. } = tallies[0];
                println!("{name}: {kind}: {missed} misses of the tree, {failed} not certified");
            }
        }
    }
    [misses, uncertified]
}

/// The tree alone against the oracle on given models.
fn only_tree(models: &[(String, ToolModel)], points: usize) {
    let mut all = Tally::default();
    for (name, model) in models {
        let tree = ToolSurface::new(model.clone());
        let oracle = Oracle::new(model);
        let tallies =
            (0..KINDS.len()).map(|k| judge(model, &oracle, &[("tree", &tree)], k, points)[0]);
        let sum = tallies.fold(Tally::default(), Tally::and);
        println!(
            "{name:28} {:6} patches {:8} points missed {:4} not certified {:4} worst {:.1e} mm",
            model.patches.len(),
            sum.points,
            sum.missed,
            sum.failed,
            sum.worst
        );
        all = all.and(sum);
    }
    let Tally { points, missed, failed, worst, .. } = all;
    println!(
        "{}",
        serde_json::json!({"points": points, "misses": missed, "uncertified": failed, "worst_mm": worst})
    );
}

fn judge<const N: usize>(
    model: &ToolModel,
    oracle: &Oracle,
    searches: &[(&str, &dyn ContactSearch); N],
    kind: usize,
    count: usize,
) -> [Tally; N] {
    (0..count)
        .into_par_iter()
        .map(|k| {
            let mut random = Random((kind * 1_000_003 + k) as u64 * 0x9e37_79b9 + 12_345);
            random.share();
            let p = point(model, kind, &mut random);
            let best = oracle.distance(&p);
            searches.map(|(_, search)| {
                let foot = search.find(&p, None);
                Tally::default().add((p - foot.point).norm() - best, foot.outcome)
            })
        })
        .reduce(|| [Tally::default(); N], |a, b| std::array::from_fn(|k| a[k].and(b[k])))
}

/// Jumps over patch borders, model by model.
fn smoothness(models: &[(String, ToolModel)]) {
    for (name, model) in models {
        let j = path::along_paths(model, &ToolSurface::new(model.clone()), 60, 2.0);
        println!(
            "{name:16} {:6} crossings: gap jumps by {:.1e} mm, normal by {:.3} deg at most ({} creases left out)",
            j.crossings, j.gap, j.normal_deg, j.creases
        );
    }
}

/// Share of points that each search misses or fails on, by distance from the die: `contact-misses.svg` in docs/results.
fn miss_rates(model: &ToolModel) {
    const COUNT: usize = 4000;
    let oracle = Oracle::new(model);
    let tree = ToolSurface::new(model.clone());
    let (grid, nodes) =
        (PaperSearch::bezier_grid(model.clone()), PaperSearch::nagata_nodes(model.clone()));
    let searches: [(&str, &dyn ContactSearch); 3] =
        [("tree", &tree), ("bezier-grid", &grid), ("nagata-nodes", &nodes)];
    let mut lines =
        searches.map(|(name, _)| Line { name: name.into(), points: vec![], marks_only: false });
    for distance in [0.01, 0.1, 0.3, 1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0] {
        let tally = |k: usize| {
            let mut random = Random(k as u64 * 0x9e37_79b9 + 99);
            random.share();
            let p = point(model, 0, &mut random) + random.direction() * distance;
            let best = oracle.distance(&p);
            searches.map(|(_, search)| {
                let foot = search.find(&p, None);
                Tally::default().add((p - foot.point).norm() - best, foot.outcome)
            })
        };
        let sum = |a: [Tally; 3], b: [Tally; 3]| [a[0].and(b[0]), a[1].and(b[1]), a[2].and(b[2])];
        let all = (0..COUNT).into_par_iter().map(tally);
        let tallies = all.reduce(|| [Tally::default(); 3], sum);
        for (line, t) in lines.iter_mut().zip(tallies) {
            let share = (t.missed + t.failed) as f64 / t.points as f64;
            line.points.push((distance, 100.0 * share));
            println!("{:12} {distance:6} mm: {:.2} % missed or failed", line.name, 100.0 * share);
        }
    }
    let chart = Chart {
        title: "Closest points missed or not found, die of 1230 Nagata quadrilaterals".into(),
        x: ("distance from the tool [mm]".into(), true),
        y: ("share of points [%]".into(), false),
        lines: lines.into(),
    };
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/results");
    write_chart(&folder.join("contact-misses.svg"), &chart).expect("docs/results can be written");
}

/// Least time of seven passes over the points [us] per point.
fn time(points: usize, mut pass: impl FnMut()) -> f64 {
    let best = (0..7).map(|_| {
        let start = Instant::now();
        pass();
        start.elapsed().as_secs_f64()
    });
    best.fold(f64::INFINITY, f64::min) * 1e6 / points as f64
}

fn around(model: &ToolModel, reach: f64, count: usize) -> Vec<Vec3> {
    let mut random = Random(7);
    let mut on = |_| point(model, 0, &mut random);
    let on: Vec<Vec3> = (0..count).map(&mut on).collect();
    let mut random = Random(8);
    on.iter().map(|p| p + random.direction() * (reach * random.share())).collect()
}

/// Cold and warm time [us] on one thread, of points up to 20 mm away; other distances are printed.
fn speed(die: &ToolSurface) -> [f64; 2] {
    let mut headline = [0.0; 2];
    for reach in [1.0, 5.0, 20.0, 100.0] {
        let points = around(die.model(), reach, 20_000);
        let cold = time(points.len(), || {
            points.iter().for_each(|p| {
                black_box(die.closest(p, None));
            });
        });
        let first: Vec<Projection> = points.iter().map(|p| die.closest(p, None)).collect();
        let mut random = Random(9);
        let moved: Vec<Vec3> = points.iter().map(|p| p + random.direction() * 0.05).collect();
        let warm = time(points.len(), || {
            moved.iter().zip(&first).for_each(|(p, last)| {
                black_box(die.from_last(p, last, f64::INFINITY));
            });
        });
        println!("points within {reach:5} mm: cold {cold:.3} us, warm {warm:.3} us a query");
        if reach == 20.0 {
            headline = [cold, warm];
        }
    }
    headline
}

/// Time of a cold query by number of patches, 10^2 to 10^6: last over first.
fn growth() -> f64 {
    let times: Vec<f64> = [10, 32, 100, 316, 1000]
        .into_iter()
        .map(|n| {
            let surface = ToolSurface::new(cases::waves(n));
            let points = around(surface.model(), 5.0, 20_000);
            let us = time(points.len(), || {
                points.iter().for_each(|p| {
                    black_box(surface.closest(p, None));
                });
            });
            println!("waves of {:7} patches: {us:.3} us", n * n);
            us
        })
        .collect();
    times[4] / times[0]
}

/// Speed of two threads over one.
fn threads(die: &ToolSurface) -> f64 {
    let points = around(die.model(), 20.0, 50_000);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            time(points.len(), || {
                black_box(die.closest_of_all(&points, &[]));
            })
        })
    };
    run(1) / run(2)
}

/// Time of the paper's search over the tree's, both from nothing.
fn against_paper(model: &ToolModel, cold: f64) -> f64 {
    let points = around(model, 20.0, 500);
    let mut ratios = Vec::new();
    let searches = [
        ("bezier-grid", PaperSearch::bezier_grid(model.clone())),
        ("nagata-nodes", PaperSearch::nagata_nodes(model.clone())),
    ];
    for (name, search) in searches {
        let candidates: Vec<_> = points.iter().map(|p| search.candidates(p)).collect();
        let global = time(points.len(), || {
            points.iter().for_each(|p| {
                black_box(search.candidates(p));
            });
        });
        let local = time(points.len(), || {
            points.iter().zip(&candidates).for_each(|(p, c)| {
                black_box(search.project(p, c));
            });
        });
        println!("{name}: global search {global:.2} us, ten projections {local:.2} us");
        ratios.push((global + local) / cold);
    }
    println!("paper / tree, cold: bezier-grid {:.1}, nagata-nodes {:.1}", ratios[0], ratios[1]);
    ratios[1]
}

/// Time of parry's closest point on a triangle mesh as near to the CAD, over the tree's.
fn against_parry(model: &ToolModel, die: &ToolSurface) -> f64 {
    let (error, facets) = models::facets_as_good_as(model);
    let to = |v: &Vec3| parry3d_f64::math::Vector::new(v.x, v.y, v.z);
    let vertices: Vec<_> = facets.vertices.iter().map(to).collect();
    let triangles: Vec<[u32; 3]> = facets
        .corners
        .iter()
        .flat_map(|c| {
            (2..c.vertices.len()).map(|k| [c.vertices[0], c.vertices[k - 1], c.vertices[k]])
        })
        .collect();
    let count = triangles.len();
    let mesh = parry3d_f64::shape::TriMesh::new(vertices, triangles).expect("triangles");
    let points = around(model, 20.0, 20_000);
    let queries: Vec<_> = points.iter().map(to).collect();
    let parry = time(points.len(), || {
        queries.iter().for_each(|p| {
            black_box(mesh.project_local_point(*p, false));
        });
    });
    let tree = time(points.len(), || {
        points.iter().for_each(|p| {
            black_box(die.closest(p, None));
        });
    });
    println!(
        "parry: {count} triangles for the error {error:.2e} mm of {} patches: {parry:.3} us, tree {tree:.3} us",
        model.patches.len()
    );
    parry / tree
}
