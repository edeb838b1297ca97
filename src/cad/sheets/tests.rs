use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::*;
use kanagata_geometry::Frame;

/// Circle in the xz plane about `(x, 0, 0)`, starting at an angle from x towards z.
fn circle(x: f64, radius: f64, from: f64) -> Curve3 {
    let frame =
        Frame { y: Vec3::z(), z: -Vec3::y(), origin: Vec3::new(x, 0.0, 0.0), ..Frame::world() };
    Curve3::ellipse_arc(&frame, radius, radius, from, from + TAU)
}

fn hits(profile: &Curve3) -> Vec<f64> {
    on_axis(profile, Vec3::zeros(), Vec3::z())
}

#[test]
fn profiles_are_on_the_axis_where_they_cross_or_touch_it() {
    let near = |found: &[f64], wanted: &[f64]| {
        assert_eq!(found.len(), wanted.len(), "{found:?}");
        found.iter().zip(wanted).for_each(|(a, b)| assert!((a - b).abs() < 1e-7, "{found:?}"));
    };
    near(&hits(&circle(0.0, 25.0, 0.0)), &[FRAC_PI_2, 3.0 * FRAC_PI_2]);
    let from_below = circle(0.0, 25.0, -FRAC_PI_2);
    near(&hits(&from_below), &[-FRAC_PI_2, FRAC_PI_2, 3.0 * FRAC_PI_2]);
    // A circle tangent to the axis, one at a distance from it, a straight line across it.
    near(&hits(&circle(5.0, 5.0, 0.0)), &[PI]);
    near(&hits(&circle(5.0 + 1e-5, 5.0, 0.0)), &[]);
    near(&hits(&Curve3::line(Vec3::new(-1.0, 0.0, 0.0), Vec3::new(3.0, 0.0, 8.0))), &[0.25]);
}

#[test]
fn parts_lie_between_points_on_the_axis() {
    let ranges = |profile: &Curve3| -> Vec<[f64; 2]> {
        parts_of(profile, Vec3::zeros(), Vec3::z()).iter().map(Curve3::domain).collect()
    };
    let profile = circle(0.0, 25.0, 0.0);
    let found = ranges(&profile);
    // The part across the seam extends by one period.
    assert_eq!(found.len(), 2);
    assert!((found[0][0] - 3.0 * FRAC_PI_2).abs() < 1e-12, "{found:?}");
    assert!((found[0][1] - 5.0 * FRAC_PI_2).abs() < 1e-12, "{found:?}");
    let over = &parts_of(&profile, Vec3::zeros(), Vec3::z())[0];
    for k in 0..=8 {
        let t = found[0][0] + PI * f64::from(k) / 8.0;
        let p = over.point(t);
        assert!((p.norm() - 25.0).abs() < 1e-12 && p.x > -1e-12, "{p}");
    }
    assert_eq!(ranges(&circle(0.0, 25.0, -FRAC_PI_2)).len(), 2);
    // No alternatives.
    assert!(ranges(&circle(6.0, 5.0, 0.0)).is_empty());
    assert!(ranges(&profile.trimmed(0.0, FRAC_PI_2).unwrap()).is_empty());
}
