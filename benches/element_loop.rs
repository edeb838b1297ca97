//! The element loop of the 62 x 62 x 2 sheet: forces and tangent of every element, all points plastic.

use std::sync::Arc;

use criterion::{Criterion, criterion_group, criterion_main};
use kanagata::solver::assembly::Body;
use kanagata::solver::assembly::Evaluation;
use kanagata::solver::element::{ElementKind, Want};
use kanagata::solver::material::elastic::Elastic;
use kanagata::solver::material::hardening::Hardening;
use kanagata::solver::material::hill48::Hill48;
use kanagata::solver::material::plastic::Plastic;
use kanagata::solver::sheet::hex_mesh;

fn element_loop(criterion: &mut Criterion) {
    let hill = Hill48 { f: 0.251, g: 0.297, h: 0.703, l: 1.5, m: 1.5, n: 1.29 };
    let swift = Hardening::Swift { k: 529.5, eps0: 0.00439, n: 0.268 };
    let Ok(material) = Plastic::new(Elastic { young: 210_000.0, poisson: 0.3 }, &hill, swift)
    else {
        return;
    };
    let material = Arc::new(material);
    let kinds = [
        ("hex8", ElementKind::Hex8, 2),
        ("hex8-enhanced", ElementKind::Hex8Enhanced, 2),
        ("solid-shell 5", ElementKind::SolidShell { points: 5, membrane: true }, 1),
        ("solid-shell 5 plain", ElementKind::SolidShell { points: 5, membrane: false }, 1),
    ];
    let mut group = criterion.benchmark_group("element loop 62x62");
    group.sample_size(10);
    for (name, kind, layers) in kinds {
        let mesh = hex_mesh::rectangle(125.0, 125.0, 0.8, 62, 62, layers);
        let u: Vec<f64> = mesh
            .nodes
            .iter()
            .flat_map(|x| {
                [0.05 * x.x + 0.001 * x.x * x.z, -0.02 * x.y, -0.02 * x.z + 1e-4 * x.x * x.y]
            })
            .collect();
        let Ok(mut body) = Body::new(mesh, kind, material.clone()) else { return };
        let mut out = Evaluation::default();
        for want in [Want::ResidualAndTangent, Want::Residual] {
            group.bench_function(format!("{name} {want:?}"), |bench| {
                bench.iter(|| body.evaluate(&u, want, &mut out).is_ok());
            });
        }
    }
    group.finish();
}

criterion_group!(benches, element_loop);
criterion_main!(benches);
