//! Closest points on a tool model: the cross die, on one thread, cold and from the last patch.

use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use kanagata::contact::ToolSurface;
use kanagata::convert::{ConvertOptions, convert};
use kanagata::geometry::Vec3;
use kanagata::mesh::mapped::{MappedOptions, mesh};

fn projection(c: &mut Criterion) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/cross/die.igs");
    let (model, _) = kanagata::cad::read(&path).expect("the fixture is sound");
    let options = MappedOptions { arc_divisions: 14, ..MappedOptions::default() };
    let mesh = mesh(&model, &options).expect("the die is meshed");
    let (tool, _) = convert(&model, &mesh, &ConvertOptions::default()).expect("the mesh is sound");
    let patches = tool.patches.len();
    let surface = ToolSurface::new(tool);
    // Nodes of a sheet: a millimetre and less from the tool, a step of sliding apart.
    let mut seed = 1u64;
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    };
    let bounds = surface.bounds();
    let pairs: Vec<(Vec3, Vec3, u32)> = std::iter::repeat_with(|| {
        let share = Vec3::new(random(), random(), random());
        let foot =
            surface.closest(&(bounds.min + (bounds.max - bounds.min).component_mul(&share)), None);
        let near = foot.point + foot.normal * (2.0 * random() - 1.0);
        let step = Vec3::new(random(), random(), random()).map(|x| 0.4 * x - 0.2);
        (near, near + step, surface.closest(&near, None).patch)
    })
    .take(1000)
    .collect();
    let mut group = c.benchmark_group(format!("contact on {patches} patches"));
    group.sample_size(20).throughput(Throughput::Elements(pairs.len() as u64));
    group.bench_function("cold", |b| {
        b.iter(|| pairs.iter().map(|p| surface.closest(&p.1, None).gap).sum::<f64>());
    });
    group.bench_function("warm", |b| {
        b.iter(|| pairs.iter().map(|p| surface.closest(&p.1, Some(p.2)).gap).sum::<f64>());
    });
    group.finish();
}

criterion_group!(benches, projection);
criterion_main!(benches);
