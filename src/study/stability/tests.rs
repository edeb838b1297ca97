use super::evaluation::{at_corner, at_middle, exact};
use super::*;
use kanagata_solver::ContactMethod;

fn small() -> StabilityStudy {
    StabilityStudy {
        format: FormatTag::Stability,
        version: 1,
        name: "small".into(),
        newton: NewtonMap { angles_deg: vec![60.0], starts: 3, columns: 8, rows: 20 },
        evaluation: EvaluationMap { highest_degree: 12, polynomials: 20 },
        edges: EdgeMap { cells: 24 },
        forming: FormingMap {
            depth_mm: 1.0,
            methods: vec![ContactMethod::Exact, ContactMethod::Penalty { stiffness: 1.0 }],
            increments: vec![1, 40],
            patches: 4,
            divisions: vec![4],
        },
    }
}

#[test]
fn the_paper_s_newton_finds_feet_near_the_patch_and_none_beyond_the_axis() {
    let panel = &newton::maps(&small().newton)[0];
    let row = |j: usize| &panel.map.values[8 * j..8 * j + 8];
    let at = |k: usize| middle(&panel.map, k).1;
    let near: Vec<usize> = (0..20).filter(|j| at(8 * j).abs() < 0.3).collect();
    assert!(near.len() >= 3);
    for j in near {
        assert!(row(j).iter().all(|v| *v == 1.0), "{} {:?}", at(8 * j), row(j));
    }
    // Beyond the axis the closest points are on the far sides, where Eq. 19 has no solution.
    let far: Vec<usize> = (0..20).filter(|j| at(8 * j) > 1.05).collect();
    assert!(far.iter().all(|&j| row(j).iter().all(|v| v.is_nan() || *v < 0.5)));
}

#[test]
fn exact_values_are_those_of_the_formula() {
    // 1 t^2 has the Bernstein coefficients 0, 0, 1.
    let one = 1 << 48;
    assert_eq!(exact(&[0, 0, one], 32), 1 << 118);
    assert_eq!(exact(&[one; 13], 17), 1 << 120);
}

#[test]
fn monomial_coefficients_of_a_known_polynomial() {
    assert_eq!(at_corner(&[0.0, 0.0, 1.0]), [0.0, 0.0, 1.0]);
    assert_eq!(at_middle(&[0.0, 0.0, 1.0]), [0.25, 0.5, 0.25]);
    assert_eq!(at_middle(&[-1.0, -0.5, 0.0, 0.5, 1.0]), [0.0, 1.0, 0.0, 0.0, 0.0]);
}

#[test]
fn monomials_about_a_corner_lose_digits_with_the_degree_and_bernstein_keeps_them() {
    let chart = evaluation::chart(&small().evaluation);
    let last = |k: usize| chart.lines[k].points.last().unwrap().1;
    let first = |k: usize| chart.lines[k].points[0].1;
    assert!(last(0) > 1e3 * first(0), "{} {}", last(0), first(0));
    assert!(last(2) < 12.0 && last(1) < last(0), "{} {} {}", last(0), last(1), last(2));
}

#[test]
fn the_guard_leaves_no_wild_edge_and_touches_no_arc() {
    let panels = edges::maps(&small().edges);
    let wild = |p: &Panel| p.map.values.iter().filter(|v| **v > 2.0_f64.log10()).count();
    assert!(wild(&panels[0]) > 0 && wild(&panels[1]) == 0);
    // Arcs have no tilt.
    let map = &panels[1].map;
    for k in (0..map.values.len()).filter(|&k| middle(map, k).0.abs() < 2.0) {
        let angle = middle(map, k).1.to_radians();
        if angle.abs() < 100.0_f64.to_radians() && angle.abs() > 0.2 {
            assert!(map.values[k].is_finite(), "{angle}");
        }
    }
}

#[test]
fn a_study_writes_its_drawings_and_refuses_nonsense() {
    let folder = tempfile::tempdir().unwrap();
    let report = run(&small(), Path::new("study.json"), folder.path()).unwrap();
    assert_eq!(report.len(), 1 + 2 + 3 + 4 + 2);
    for name in DRAWINGS {
        assert!(folder.path().join(format!("{name}.svg")).exists());
        assert!(folder.path().join(format!("{name}.csv")).exists());
    }
    let table = std::fs::read_to_string(folder.path().join("increments.csv")).unwrap();
    let depth = |line: &str| -> f64 {
        let row = table.lines().find(|l| l.starts_with(line)).unwrap();
        row.split(',').nth(3).unwrap().parse().unwrap()
    };
    // In equal increments of 0.025 mm exact contact and a spring reach the end, in one of 1 mm neither.
    assert!(depth("exact,40,") > 0.999 && depth("penalty; 1,40,") > 0.999, "{table}");
    assert!(depth("exact,1,") == 0.0, "{table}");
    let mut wrong = small();
    wrong.forming.divisions = vec![0];
    let error = run(&wrong, Path::new("study.json"), folder.path()).unwrap_err().to_string();
    assert!(error.contains("forming.divisions") && error.contains("1 to 1000"), "{error}");
    let mut wrong = small();
    wrong.newton.angles_deg = vec![200.0];
    let error = run(&wrong, Path::new("study.json"), folder.path()).unwrap_err().to_string();
    assert!(error.contains("study.json") && error.contains("200"), "{error}");
}

#[test]
fn roughness_is_what_a_line_leaves() {
    let curve = |force: &dyn Fn(f64) -> f64| {
        (0..=100).map(|k| f64::from(k) * 0.1).map(|x| [x, force(x)]).collect::<Vec<_>>()
    };
    let drawn =
        |curve| Draw { line: String::new(), x: 1, depth: 10.0, iterations: 1, force: 1.0, curve };
    let straight = drawn(curve(&|x| 30.0 + 2.0 * x)).roughness().unwrap();
    assert!(straight < 1e-13, "{straight}");
    // Waves shorter than the fit: their RMS over the mean.
    let wavy = drawn(curve(&|x| 30.0 + 3.0 * (20.0 * x).sin())).roughness().unwrap();
    assert!((wavy - 0.1 / 2.0_f64.sqrt()).abs() < 0.01, "{wavy}");
    assert!(drawn(vec![[0.0, 0.0], [1.0, 5.0]]).roughness().is_none());
}
