//! Faces divided independently: fewer patches, borders that meet to within the tolerance, and a search that knows them
//! for joints inside the tool.

use std::collections::BTreeMap;
use std::path::Path;

use kanagata::audit::{AuditOptions, CadReference, ReferenceSurface, audit, open_sides};
use kanagata::cad::{self, Model};
use kanagata::contact::ToolSurface;
use kanagata::convert::ConvertOptions;
use kanagata::convert::tolerance::{Borders, Goal, Refined, to_patches, to_tolerance};
use kanagata::geometry::Vec3;
use kanagata::mesh::mapped::MappedOptions;
use kanagata::tool::exchange::to_bezier;
use kanagata::tool::side::SideCurve;
use kanagata::tool::{ToolKind, ToolModel};

fn read(file: &str) -> Model {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(file);
    cad::read(&path).unwrap().0
}

/// Facets with their vertices on the CAD: balanced ones need no more where borders are shared.
fn refined(model: &Model, kind: ToolKind, tol_mm: f64, borders: Borders) -> Refined {
    let two_sided = kind == ToolKind::Nagata;
    let goal = Goal { tol_mm, normal_deg: f64::INFINITY, two_sided, borders };
    let options =
        ConvertOptions { kind, through_cad: kind == ToolKind::Nagata, ..ConvertOptions::default() };
    to_tolerance(model, &MappedOptions::default(), &options, &goal).unwrap()
}

/// Divided independently, audited anew; the gap is within the tolerance and the model says so.
fn apart(model: &Model, kind: ToolKind, tol_mm: f64) -> Refined {
    let found = refined(model, kind, tol_mm, Borders::Independent);
    assert_eq!(found.borders, Borders::Independent);
    let asked = AuditOptions { tolerance_mm: Some(tol_mm), ..AuditOptions::default() };
    let again = audit(&found.tool, &CadReference::new(model), &asked).unwrap().report;
    assert!(again.worst_mm() <= tol_mm && again.folded.is_empty());
    assert_eq!(again.within_tolerance, Some(true));
    assert!(again.jumps.border_gap_mm <= tol_mm && again.jumps.open_sides > 0);
    assert!(found.tool.border_gap_mm >= again.jumps.border_gap_mm);
    found
}

#[test]
fn the_cross_die_takes_fewer_patches_and_its_gaps_are_within_the_tolerance() {
    let model = read("cross/die.igs");
    for tol_mm in [0.1, 0.03] {
        let one = apart(&model, ToolKind::Nagata, tol_mm);
        let all = refined(&model, ToolKind::Nagata, tol_mm, Borders::Conforming);
        let [few, many] = [&one, &all].map(|r| r.tool.patches.len());
        println!("{tol_mm} mm: {few} independent, {many} conforming, {:?}", one.audit.jumps);
        assert!(few < many);
    }
}

/// Fillets of several radii, a spherical corner, a torus between flats; facets too.
#[test]
fn other_models_and_kinds_are_as_tight() {
    let square = read("forming/square_punch_144.igs");
    apart(&square, ToolKind::Nagata, 0.05);
    let die = read("cross/die.igs");
    let facets = apart(&die, ToolKind::Facets, 0.3);
    let together = refined(&die, ToolKind::Facets, 0.3, Borders::Conforming);
    println!("facets: {} and {}", facets.tool.patches.len(), together.tool.patches.len());
    assert!(facets.tool.patches.len() < together.tool.patches.len());
}

/// A face that meets itself only is one piece: its seam is shared, and nothing is gained.
#[test]
fn a_single_face_has_no_borders_and_stays_conforming() {
    let model = read("forming/sphere_144.igs");
    let found = refined(&model, ToolKind::Nagata, 1.0, Borders::Independent);
    assert_eq!((found.borders, found.tool.border_gap_mm), (Borders::Conforming, 0.0));
    assert_eq!(found.audit.jumps.open_sides, 0);
}

#[test]
fn as_many_patches_as_asked_have_no_larger_an_error() {
    let model = read("cross/punch.igs");
    let made = |borders| {
        let options = ConvertOptions { through_cad: true, ..ConvertOptions::default() };
        to_patches(&model, &MappedOptions::default(), &options, 55, true, borders).unwrap()
    };
    let (one, all) = (made(Borders::Independent), made(Borders::Conforming));
    println!("{:.2e} mm and {:.2e} mm", one.audit.worst_mm(), all.audit.worst_mm());
    assert!(one.tool.patches.len() <= 55 && all.tool.patches.len() <= 55);
    assert!(one.audit.worst_mm() < all.audit.worst_mm());
    assert!(one.audit.jumps.border_gap_mm <= one.audit.worst_mm().max(one.tool.border_gap_mm));
}

#[test]
fn one_thread_and_two_give_the_same_model() {
    let model = read("cross/punch.igs");
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| refined(&model, ToolKind::Nagata, 0.05, Borders::Independent))
    };
    assert_eq!(on(1).tool, on(2).tool);
}

/// Every open side with its points, 2 000 steps each, by face and edge of the CAD.
fn dense_gap(tool: &ToolModel, reference: &CadReference<'_>) -> f64 {
    const N: usize = 2000;
    let mut lines: BTreeMap<usize, Vec<(u32, Vec<Vec3>)>> = BTreeMap::new();
    for open in open_sides(tool, reference, 16) {
        let curve = SideCurve::new(&tool.patches[open.patch], open.side);
        let points = (0..=N).map(|k| curve.point(k as f64 / N as f64)).collect();
        lines.entry(open.edge).or_default().push((tool.faces[open.patch], points));
    }
    let mut worst = 0.0f64;
    for sides in lines.values() {
        for (face, points) in sides {
            for p in points.iter().step_by(10) {
                let others = sides.iter().filter(|s| s.0 != *face).flat_map(|s| &s.1);
                let near = others.map(|q| (q - p).norm_squared()).fold(f64::INFINITY, f64::min);
                worst = worst.max(near.sqrt());
            }
        }
    }
    worst
}

#[test]
fn the_largest_gap_is_that_of_dense_sampling() {
    let model = read("cross/die.igs");
    let reference = CadReference::new(&model);
    for (kind, tol_mm) in [(ToolKind::Nagata, 0.1), (ToolKind::Nagata, 0.03)] {
        let found = apart(&model, kind, tol_mm);
        let jumps = found.audit.jumps;
        let dense = dense_gap(&found.tool, &reference);
        println!("{} mm, dense {dense} mm", jumps.border_gap_mm);
        assert!((jumps.border_gap_mm / dense - 1.0).abs() < 0.01, "{jumps:?} {dense}");
        // Where it is said to be it is.
        let patch = &found.tool.patches[jumps.border_gap_patch.unwrap() as usize];
        let at = Vec3::from(jumps.border_gap_at.unwrap());
        let on = (0..patch.sides()).map(|k| SideCurve::new(patch, k).distance(&at));
        assert!(on.fold(f64::INFINITY, f64::min) < 1e-6);
    }
}

fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    ((*seed >> 33) as f64) / (1u64 << 31) as f64
}

/// Points up to 0.5 mm over and under the joints of fillets, corners and flats: as far from the tool as from the CAD,
/// within what the patches and their borders are off; over the tool all of them.
#[test]
fn points_over_joints_are_as_far_away_as_from_the_cad_and_have_not_left_the_tool() {
    for (file, tol_mm) in [("cross/die.igs", 0.03), ("forming/square_punch_144.igs", 0.1)] {
        let model = read(file);
        let reference = CadReference::new(&model);
        let found = apart(&model, ToolKind::Nagata, tol_mm);
        let open = open_sides(&found.tool, &reference, 16);
        let outer = |p: &Vec3| {
            let free = model.edges.iter().filter(|e| e.uses.len() == 1);
            let off = free.map(|e| (e.curve.point(e.curve.closest(p).0) - p).norm());
            off.fold(f64::INFINITY, f64::min)
        };
        let nagata = ToolSurface::new(found.tool.clone());
        let bezier = ToolSurface::new(to_bezier(&found.tool));
        let blind = ToolSurface::new(ToolModel { border_gap_mm: 0.0, ..found.tool.clone() });
        let (mut seed, mut asked, mut lost) = (1, 0, 0);
        while asked < 5000 {
            let side = &open[(random(&mut seed) * open.len() as f64) as usize];
            let patch = &found.tool.patches[side.patch];
            let curve = SideCurve::new(patch, side.side);
            let t = random(&mut seed);
            let (eta, zeta) = curve.parameters(t);
            let Some(normal) = patch.normal(eta, zeta) else { continue };
            let h = random(&mut seed) - 0.5;
            let beside = Vec3::new(random(&mut seed), random(&mut seed), random(&mut seed))
                .add_scalar(-0.5)
                * 0.2;
            let p = curve.point(t) + normal * h + beside;
            if outer(&p) < 1.0 {
                continue;
            }
            asked += 1;
            let cad = reference.closest(&p, u32::MAX).unwrap();
            let (far, gap) = ((p - cad.point).norm(), (p - cad.point).dot(&cad.normal));
            let allowed = tol_mm + found.tool.border_gap_mm;
            for surface in [&nagata, &bezier] {
                let seen = surface.closest(&p, None);
                let off = (p - seen.point).norm() - far;
                assert!(!seen.past_border, "{file} {p:?}: {seen:?}");
                assert!(off.abs() <= allowed, "{file} {p:?}: {off} mm, {seen:?}");
                assert!((seen.gap - gap).abs() <= allowed, "{file} {p:?} {cad:?} {seen:?}");
            }
            lost += usize::from(blind.closest(&p, None).past_border);
        }
        println!("{file}: of {asked} points {lost} would have left a tool without joints");
        assert!(lost > 0);
    }
}
