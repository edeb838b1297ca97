//! Closest points on the die of the cross tool, on one thread: cold and warm, points up to 20 mm away.

#[path = "contact_cases/mod.rs"]
#[allow(dead_code)]
mod cases;
#[path = "contact_cases/models.rs"]
#[allow(dead_code)]
mod models;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use kanagata::contact::{Projection, ToolSurface};
use kanagata::geometry::Vec3;

fn contact(c: &mut Criterion) {
    let surface = ToolSurface::new(models::cross().swap_remove(0).1);
    let mut random = cases::Random(7);
    let points: Vec<Vec3> = (0..2000)
        .map(|_| {
            let on = cases::point(surface.model(), 0, &mut random);
            on + random.direction() * (20.0 * random.share())
        })
        .collect();
    let last: Vec<Projection> =
        points.iter().map(|p| surface.closest(&(p + random.direction() * 0.05), None)).collect();
    let mut group = c.benchmark_group("closest point on the die");
    group.sample_size(20).throughput(Throughput::Elements(points.len() as u64));
    group.bench_function("cold", |b| {
        b.iter(|| points.iter().map(|p| surface.closest(p, None).gap).sum::<f64>());
    });
    group.bench_function("warm", |b| {
        let pairs = || points.iter().zip(&last);
        b.iter(|| pairs().map(|(p, l)| surface.from_last(p, l, f64::INFINITY).gap).sum::<f64>());
    });
    group.finish();
}

criterion_group!(benches, contact);
criterion_main!(benches);
