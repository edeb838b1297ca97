//! Closest points on the trimmed cross die: 1000 points within 5 mm of it, on one thread.

use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use kanagata::cad::closest::ClosestPoint;
use kanagata::geometry::Vec3;

fn closest_point(c: &mut Criterion) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/cross/die.igs");
    let (model, _) = kanagata::cad::read(&path).expect("the fixture is sound");
    let index = ClosestPoint::new(&model);
    let (low, high) = (Vec3::new(0.0, 0.0, -65.0), Vec3::new(125.0, 125.0, 5.0));
    let mut seed = 1u64;
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    };
    let near = |p: &Vec3| index.closest(p).is_some_and(|foot| (foot.point - p).norm() < 5.0);
    let points: Vec<Vec3> = std::iter::repeat_with(|| {
        low + (high - low).component_mul(&Vec3::new(random(), random(), random()))
    })
    .filter(near)
    .take(1000)
    .collect();
    let mut group = c.benchmark_group("closest point on CAD");
    group.sample_size(20).throughput(Throughput::Elements(points.len() as u64));
    group.bench_function("cross die", |b| {
        b.iter(|| points.iter().filter_map(|p| index.closest(p)).count());
    });
    group.finish();
}

criterion_group!(benches, closest_point);
criterion_main!(benches);
