use super::*;
use crate::shapes::holed_square;
use kanagata_audit::{AuditOptions, audit};

#[test]
fn free_borders_are_within_the_tolerance() {
    let model = holed_square(20.0);
    for (tol_mm, through_cad) in [(0.5, false), (0.5, true), (0.05, false)] {
        let goal = Goal {
            tol_mm,
            normal_deg: f64::INFINITY,
            two_sided: true,
            borders: Borders::Conforming,
        };
        let options = ConvertOptions { through_cad, straighten: true, ..ConvertOptions::default() };
        let found = to_tolerance(&model, &MappedOptions::default(), &options, &goal).unwrap();
        let asked =
            AuditOptions { samples: 32, tolerance_mm: Some(tol_mm), ..AuditOptions::default() };
        let report = audit(&found.tool, &CadReference::new(&model), &asked).unwrap().report;
        assert_eq!(report.borders.cad_edges, 5);
        assert!(report.borders.deviation_mm() <= 1.02 * tol_mm, "{:?}", report.borders);
        assert!(report.borders.deviation_mm() > 1e-9 * tol_mm);
        assert_eq!(found.audit.within_tolerance, Some(true));
    }
}

#[test]
fn free_borders_of_facets_and_bezier_patches_are_within_the_tolerance() {
    use crate::bezier::{BezierOptions, within_tolerance};
    use kanagata_tool::ToolKind;
    let model = holed_square(20.0);
    let goal = Goal {
        tol_mm: 0.5,
        normal_deg: f64::INFINITY,
        two_sided: true,
        borders: Borders::Conforming,
    };
    let options = ConvertOptions { kind: ToolKind::Facets, ..ConvertOptions::default() };
    let facets = to_tolerance(&model, &MappedOptions::default(), &options, &goal).unwrap();
    let options = BezierOptions {
        name: "plate".into(),
        tolerance_mm: 0.5,
        sheet_side: None,
        flip: false,
        progress: Default::default(),
    };
    let mesh = |arc_divisions| {
        kanagata_mesh::mapped::mesh(
            &model,
            &MappedOptions { arc_divisions, ..MappedOptions::default() },
        )
    };
    let bezier = within_tolerance(&model, &options, false, 64, mesh).unwrap();
    for tool in [&facets.tool, &bezier.tool] {
        let found =
            audit(tool, &CadReference::new(&model), &AuditOptions::default()).unwrap().report;
        assert!(found.borders.cad_edges == 5 && found.borders.deviation_mm() <= 0.51, "{found:?}");
    }
}

#[test]
fn a_search_ends_at_its_work_limit_with_the_remaining_error() {
    let model = holed_square(20.0);
    let reference = CadReference::new(&model);
    let options = ConvertOptions::default();
    let goal = Goal {
        tol_mm: 1e-6,
        normal_deg: f64::INFINITY,
        two_sided: true,
        borders: Borders::Conforming,
    };
    let mut scope =
        Scope::new(&model, &reference, &MappedOptions::default(), &options, None, false).unwrap();
    scope.budget = std::sync::Arc::new(budget::Budget::new(160));
    let evaluator = FaceEvaluator::new(&scope, &scope.free_edges, false);
    let error = scope.refine(&evaluator, &goal).unwrap_err();
    let ToleranceError::NotReached { found, patches, spent, unit, .. } = &error else {
        panic!("{error}")
    };
    assert!(*found > 1e-6 && *unit == "mm of distance from its free border", "{error}");
    // The limit may be exceeded by the last model.
    let spent = spent.unwrap();
    assert!(spent >= 320 && spent <= 320 + 8 * (1 + *patches as u64), "{error}");
    assert!(error.to_string().contains("work limit"), "{error}");
    let default = scope.uniform_model(MappedOptions::default().arc_divisions, &goal).unwrap();
    let Err(ToleranceError::Above { model: closest, .. }) = scope.closest_or(error, &goal) else {
        panic!("a model above the tolerance")
    };
    let ratio = |found: &Refined| closest::goal_ratio(found, &goal);
    assert!(ratio(&closest) > 1.0 && ratio(&closest) <= ratio(&default), "{}", ratio(&closest));
}

#[test]
fn work_limits_depend_on_the_number_of_faces_only() {
    let limit = |faces: usize| budget::Budget::of_faces(faces).remaining();
    assert_eq!(limit(2001) - limit(2000), limit(2) - limit(1));
    let (one, all) = (budget::Budget::of_single_face(1000).remaining(), limit(1000));
    assert!(1000 * one <= 6 * all, "{one} {all}");
}

#[test]
fn the_next_density_is_one_that_changes_the_mesh() {
    let next = |model: &Model, face: usize, fewest: bool| {
        let reference = CadReference::new(model);
        let options = ConvertOptions::default();
        let scope = Scope::new(model, &reference, &MappedOptions::default(), &options, None, false)
            .unwrap();
        let scope = if fewest { scope } else { scope.with_interior_nodes().unwrap() };
        let evaluator = FaceEvaluator::new(&scope, &scope.free_edges, false);
        let divisions = scope.plan.agree(scope.plan.minima());
        let count = |density| scope.plan.face(face, &divisions, density).unwrap().elements.len();
        let found = evaluator.denser(face, &divisions, 1, 2000);
        found.map(|density| (count(density), count(1)))
    };
    // A flat without interior nodes has the same mesh at any density.
    assert_eq!(next(&holed_square(20.0), 0, true), None);
    let path = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
        .join("fixtures/forming");
    let (ball, _) = kanagata_cad::read(&path.join("ball_hole_AP214.stp")).unwrap();
    let trimmed = |f: &usize| {
        ball.faces[*f].loops.len() > 1 || !kanagata_mesh::mapped::is_flat(&ball.faces[*f])
    };
    let curved: Vec<usize> = (0..ball.faces.len()).filter(trimmed).collect();
    let found: Vec<_> = curved.iter().filter_map(|&f| next(&ball, f, false)).collect();
    assert!(!found.is_empty() && found.iter().all(|(after, before)| after != before), "{found:?}");
}
