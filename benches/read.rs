//! Reading and building a trimmed model, by format: the same cross die as IGES and STEP.

use std::path::Path;

use criterion::{Criterion, criterion_group, criterion_main};

fn read(c: &mut Criterion) {
    let forming = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/forming");
    let mut group = c.benchmark_group("read");
    group.sample_size(20);
    for file in
        ["cross_die_144.igs", "cross_die_186.igs", "cross_die_nurbs144.igs", "cross_die_AP214.stp"]
    {
        let path = forming.join(file);
        group.bench_function(file, |b| {
            b.iter(|| kanagata::cad::read(&path).map(|(model, _)| model.faces.len()).expect(file));
        });
    }
    group.finish();
}

criterion_group!(benches, read);
criterion_main!(benches);
