//! Offsets of single surfaces.

use super::budget::{Fineness, PATCHES_BASE, shares};
use super::fit::offset_spline;
use super::restrict::restricted;
use super::surface::offset;
use crate::build::build;
use crate::loops::Side;
use crate::raw::{RawEdge, RawFace, RawLoop, RawModel, RawSurface};
use kanagata_geometry::nurbs::{Curve2, Curve3, Surface};
use kanagata_geometry::{Frame, Vec2, Vec3};

const FREE: Fineness = Fineness { max_patches: 10_000, coarse: false };

#[test]
fn a_spline_offset_stays_at_its_distance() {
    let (f, r) = (Frame::world(), 10.0);
    let meridian = Frame { y: f.z, z: -f.y, ..f };
    let arc = Curve3::ellipse_arc(&meridian, r, r, -1.0, 1.2);
    let sphere = Surface::revolution(&arc, Vec3::zeros(), Vec3::z(), [0.2, 3.0]);
    let out = offset_spline(&sphere, 1.5, 1e-9, &mut FREE.clone()).unwrap();
    for k in 0..400 {
        let t = |m: f64| (f64::from(k) * m).fract();
        let [u, v] = sphere.domain();
        let uv = Vec2::new(u[0] + (u[1] - u[0]) * t(0.618), v[0] + (v[1] - v[0]) * t(0.414));
        assert!((out.point(uv).norm() - 11.5).abs() < 3e-9);
        assert!((out.point(uv) - sphere.point(uv) * 1.15).norm() < 3e-9);
    }
}

/// Waves of height 4 on a grid of `n` x `n` spans, on which an offset by 1.5 self-intersects.
fn waves(n: usize) -> Surface {
    let at = |i: usize, j: usize| Vec3::new(i as f64, j as f64, ((7 * i + 3 * j) % 5) as f64);
    let points = (0..n + 3).flat_map(|i| (0..n + 3).map(move |j| at(i, j))).collect();
    let inner = (0..=n).map(|k| k as f64);
    let knots: Vec<f64> = [vec![0.0; 3], inner.collect(), vec![n as f64; 3]].concat();
    Surface::try_new([3, 3], [knots.clone(), knots], points, None).unwrap()
}

#[test]
fn an_offset_that_folds_is_followed_as_finely_as_the_file_is_large() {
    let base = RawSurface::Nurbs(waves(10));
    let over =
        |base: &RawSurface| RawSurface::Offset { base: Box::new(base.clone()), distance: 1.5 };
    let surfaces = [base.clone(), over(&base), over(&over(&base))];
    let shares = shares(surfaces.iter(), 4_000);
    // 100 spans at one level and, for the other two faces, at two levels, of 9192 patches.
    assert_eq!([0, 1, 2].map(|k| shares[k].max_patches), [0, 3064, 3064]);
    let mut own = shares[1];
    let Ok(RawSurface::Nurbs(found)) = offset(&base, 1.5, 1e-9, &mut own) else {
        panic!("a spline's offset is a spline");
    };
    assert!(own.coarse);
    let pieces = found.points().len() / 25;
    assert!((100..=3300).contains(&pieces), "{pieces}");
    assert!(offset(&base, 1.5, 1e-9, &mut Fineness { max_patches: 99, coarse: false }).is_err());
}

#[test]
fn a_base_that_many_faces_share_is_offset_only_so_often() {
    let surface =
        RawSurface::Offset { base: Box::new(RawSurface::Nurbs(waves(40))), distance: 0.1 };
    let shares = shares(std::iter::repeat_n(&surface, 20), 0);
    let given: usize = shares.iter().map(|s| s.max_patches).sum();
    assert_eq!(shares.iter().filter(|s| s.max_patches >= 1600).count(), 5);
    assert!(given <= PATCHES_BASE, "{given}");
}

#[test]
fn a_cone_offset_keeps_its_parameters() {
    let cone = RawSurface::Cone { frame: Frame::world(), radius: 5.0, semi_angle: 0.4 };
    let Ok(RawSurface::Cone { frame, radius, .. }) = offset(&cone, 2.0, 1e-9, &mut FREE.clone())
    else {
        panic!("a cone's offset is a cone");
    };
    let v = 3.0;
    let base = Vec3::new(5.0 + v * 0.4f64.tan(), 0.0, v);
    let normal = Vec3::new(0.4f64.cos(), 0.0, -0.4f64.sin());
    let found = frame.point(&Vec3::new(radius + v * 0.4f64.tan(), 0.0, v));
    assert!((found - (base + normal * 2.0)).norm() < 1e-12);
    let ball = RawSurface::Sphere { frame: Frame::world(), radius: 1.0 };
    assert!(offset(&ball, -1.0, 1e-9, &mut FREE.clone()).is_err());
}

/// Inwards by more than the radius at v = 0: the apex moves past v = 0, and the cone beyond it stays the offset.
#[test]
fn a_cone_offset_past_its_reference_circle_is_the_offset_beyond_the_apex() {
    for radius in [0.0, 1.0] {
        let (semi_angle, distance) = (0.4f64, -2.0);
        let cone = RawSurface::Cone { frame: Frame::world(), radius, semi_angle };
        let found = offset(&cone, distance, 1e-9, &mut FREE.clone()).unwrap();
        let native = crate::native::Native::new(&found);
        for (u, v) in [(0.0, 5.0), (1.0, 6.0), (-2.0, 40.0)] {
            let around = Vec3::new(f64::cos(u), f64::sin(u), 0.0);
            let base = around * (radius + v * semi_angle.tan()) + Vec3::z() * v;
            let normal = around * semi_angle.cos() - Vec3::z() * semi_angle.sin();
            let expected = base + normal * distance;
            assert!((native.point(Vec2::new(u, v)) - expected).norm() < 1e-12, "{u} {v}");
            let back = native.inverse(&expected, None);
            assert!((back - Vec2::new(u, v)).norm() < 1e-12, "{back}");
        }
    }
}

/// Nodes and weights of the Gauss-Legendre rule with ten points on `[a, b]`.
fn gauss([a, b]: [f64; 2]) -> impl Iterator<Item = (f64, f64)> {
    const HALF: [(f64, f64); 5] = [
        (0.148_874_338_981_631_2, 0.295_524_224_714_752_9),
        (0.433_395_394_129_247_2, 0.269_266_719_309_996_4),
        (0.679_409_568_299_024_4, 0.219_086_362_515_982),
        (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
        (0.973_906_528_517_171_7, 0.066_671_344_308_688_1),
    ];
    let at = move |x: f64| 0.5 * (a + b) + 0.5 * (b - a) * x;
    HALF.into_iter()
        .flat_map(|(x, w)| [(x, w), (-x, w)])
        .map(move |(x, w)| (at(x), 0.5 * (b - a) * w))
}

/// Area element `|pu x pv|` of the offset `p = s + d n`, from the derivatives of the normal (Weingarten):
/// `nu = (I - n n^T)(suu x sv + su x suv) / |su x sv|`.
fn area_element(s: &Surface, d: f64, uv: Vec2) -> f64 {
    let e = s.derivs(uv);
    let cross = e.su.cross(&e.sv);
    let (size, n) = (cross.norm(), cross.normalize());
    let turn = |c: Vec3| (c - n * n.dot(&c)) / size;
    let pu = e.su + turn(e.suu.cross(&e.sv) + e.su.cross(&e.suv)) * d;
    let pv = e.sv + turn(e.suv.cross(&e.sv) + e.su.cross(&e.svv)) * d;
    pu.cross(&pv).norm()
}

/// Area of the offset over a rectangle, span by span, each in `parts` x `parts` pieces.
pub(super) fn area_by_definition(s: &Surface, d: f64, [u, v]: [[f64; 2]; 2], parts: usize) -> f64 {
    let pieces = |k: usize, [a, b]: [f64; 2]| {
        let mut ends: Vec<f64> =
            s.knots()[k].iter().copied().filter(|t| *t > a && *t < b).collect();
        ends.dedup();
        let ends = [vec![a], ends, vec![b]].concat();
        let part = |w: &[f64], i: usize| {
            [i, i + 1].map(|i| w[0] + (w[1] - w[0]) * i as f64 / parts as f64)
        };
        ends.windows(2).flat_map(|w| (0..parts).map(move |i| part(w, i))).collect::<Vec<_>>()
    };
    let mut sum = 0.0;
    for (a, b) in
        pieces(0, u).into_iter().flat_map(|a| pieces(1, v).into_iter().map(move |b| (a, b)))
    {
        for ((x, wx), (y, wy)) in gauss(a).flat_map(|x| gauss(b).map(move |y| (x, y))) {
            sum += area_element(s, d, Vec2::new(x, y)) * wx * wy;
        }
    }
    sum
}

/// A bicubic spline of `n[0]` x `n[1]` spans of 10 mm with waves of radii down to 14 mm.
pub(super) fn panel(n: [usize; 2]) -> Surface {
    let at = |i: usize, j: usize| {
        let (x, y) = (10.0 * i as f64, 10.0 * j as f64);
        Vec3::new(x, y, 6.0 * (x / 14.0).sin() * (y / 17.0).cos() - x * x / 2000.0)
    };
    let points = (0..n[0] + 3).flat_map(|i| (0..n[1] + 3).map(move |j| at(i, j))).collect();
    let knots = n.map(|n| {
        let inner = (0..=n).map(|k| k as f64);
        [vec![0.0; 3], inner.collect(), vec![n as f64; 3]].concat()
    });
    Surface::try_new([3, 3], knots, points, None).unwrap()
}

/// A face on the offset of `base` over a rectangle of parameters, with space curves or parameter curves.
fn face_over(base: &Surface, distance: f64, [u, v]: [[f64; 2]; 2], in_space: bool) -> RawFace {
    let corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| Vec2::new(u[i], v[j]));
    let at = |uv: Vec2| base.point(uv) + base.normal(uv).unwrap() * distance;
    let edge = |k: usize| {
        let line = Curve2::line(corners[k], corners[(k + 1) % 4]);
        let curve = in_space.then(|| {
            let breaks: Vec<f64> = (0..=40).map(|i| f64::from(i) / 40.0).collect();
            Curve3::fitted(|t| at(line.point(t)), &breaks, 1e-9)
        });
        RawEdge { curve, pcurve: (!in_space).then_some(line), ..RawEdge::default() }
    };
    RawFace {
        surface: RawSurface::Offset { base: Box::new(RawSurface::Nurbs(base.clone())), distance },
        loops: vec![RawLoop { outer: None, edges: (0..4).map(edge).collect(), vertex: None }],
        flipped: false,
        source: "face".into(),
        shell: None,
        attributes: Default::default(),
    }
}

#[test]
fn faces_on_one_large_offset_have_the_area_of_the_definition_and_few_patches() {
    let base = panel([36, 25]);
    let (nu, nv) = (6, 5);
    for (in_space, distance) in [(false, 0.8), (true, -1.3)] {
        let cell = |k: usize, n: usize, size: usize| {
            [k, k + 1].map(|k| 0.3 + (size as f64 - 0.7) * k as f64 / n as f64)
        };
        let boxes: Vec<[[f64; 2]; 2]> = (0..nu)
            .flat_map(|i| (0..nv).map(move |j| [cell(i, nu, 36), cell(j, nv, 25)]))
            .collect();
        let faces = boxes.iter().map(|b| face_over(&base, distance, *b, in_space)).collect();
        let (model, diagnostics) = build(RawModel { faces, ..RawModel::default() }, "panel");
        assert_eq!((model.faces.len(), diagnostics.len()), (30, 0), "{diagnostics:?}");
        // 30 faces joined along 49 edges, with 22 free ones.
        assert_eq!(model.edges.len(), 71);
        for (face, b) in model.faces.iter().zip(&boxes) {
            let expected = area_by_definition(&base, distance, *b, 1);
            let finer = area_by_definition(&base, distance, *b, 2);
            assert!((expected - finer).abs() < 1e-9 * finer, "the quadrature has converged");
            let off = (face.area(1e-10) - finer).abs() / finer;
            assert!(off < 1e-7, "{off:e}");
        }
        // The base has 900 spans, and a face enters 7 x 6 of them with two more on each side.
        let patches = |f: &crate::model::Face| f.surface.points().len() / 25;
        let all: usize = model.faces.iter().map(patches).sum();
        println!("in space {in_space}: {all} patches");
        assert!(all < 2_500, "{all}");
    }
}

/// A loop outside the spans of its samples: the whole spline is used.
#[test]
fn a_spline_is_restricted_only_where_the_loops_stay_within() {
    let base = panel([20, 20]);
    let b = [[4.2, 6.9], [5.1, 8.8]];
    let part = restricted(&face_over(&base, 0.5, b, true), 1e-6).unwrap();
    let RawSurface::Offset { base: spline, .. } = &part.surface else { panic!("an offset") };
    let RawSurface::Nurbs(spline) = &**spline else { panic!("of a spline") };
    assert_eq!(spline.domain(), [[3.0, 8.0], [4.0, 10.0]]);
    let side = |to: f64| Side::straight(Vec2::new(4.2, 5.1), Vec2::new(to, 8.8));
    assert!(part.holds([side(6.9)].iter()) && !part.holds([side(8.0)].iter()));
    // Points that are not at the distance of the offset, and a face that needs all spans.
    let mut wrong = face_over(&base, 0.5, b, true);
    if let RawSurface::Offset { distance, .. } = &mut wrong.surface {
        *distance = 0.6;
    }
    assert!(restricted(&wrong, 1e-6).is_none());
    assert!(restricted(&face_over(&base, 0.5, [[0.5, 19.5]; 2], true), 1e-6).is_none());
}
