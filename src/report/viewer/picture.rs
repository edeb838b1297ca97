//! The picture of a view: an orthographic projection with a depth buffer, coloured by the first field.

use super::colors::{color, table};
use super::png;
use super::surface::{Field, Location, Surface, Visibility};
use super::view::View;
use kanagata_geometry::Vec3;

/// Size of the picture [px].
pub(super) const SIZE: [usize; 2] = [960, 560];
/// Direction to the eye; the script starts with the same.
const EYE: [f64; 3] = [1.3, -1.5, 0.9];
/// Space around the surfaces over the size of the picture.
const MARGIN_REL: f64 = 0.04;
/// Colours along the scale, and shades of each: few enough for a palette of 256.
const BANDS: usize = 20;
const SHADES: usize = 11;
/// Direction to the light by right, up and to the eye, as in the script.
const LIGHT: [f64; 3] = [0.2, 0.35, 0.92];
/// Brightness of a face along the light, over that of one that faces it; as in the script.
const DARKEST: f64 = 0.45;
/// Colours of surfaces without values, and of places without a value.
const PLAIN: [f64; 3] = [154.0, 165.0, 177.0];
const MISSING: [f64; 3] = [120.0, 120.0, 120.0];

/// Axes of the picture: right, up, to the eye.
struct Camera {
    axes: [Vec3; 3],
    /// Pixel at the origin, and pixels per mm.
    origin: [f64; 2],
    scale: f64,
}

impl Camera {
    /// The camera that shows all these points.
    fn around(points: impl Iterator<Item = Vec3>) -> Option<Self> {
        let eye = Vec3::from(EYE).normalize();
        let right = Vec3::z().cross(&eye).normalize();
        let axes = [right, eye.cross(&right), eye];
        let (low, high) = points.map(|p| Vec3::new(axes[0].dot(&p), axes[1].dot(&p), 0.0)).fold(
            None,
            |found: Option<(Vec3, Vec3)>, p| {
                Some(found.map_or((p, p), |(low, high)| (low.inf(&p), high.sup(&p))))
            },
        )?;
        let [width, height] = SIZE.map(|n| n as f64 * (1.0 - 2.0 * MARGIN_REL));
        let span = high - low;
        let scale = (width / span.x).min(height / span.y);
        let scale = if scale.is_finite() { scale } else { 1.0 };
        let middle = 0.5 * (low + high);
        let [w, h] = SIZE.map(|n| 0.5 * n as f64);
        Some(Self { axes, origin: [w - scale * middle.x, h + scale * middle.y], scale })
    }

    /// Pixel and depth of a point.
    fn project(&self, p: &Vec3) -> Vec3 {
        let [x, y, z] = [0, 1, 2].map(|k| self.axes[k].dot(p));
        Vec3::new(self.origin[0] + self.scale * x, self.origin[1] - self.scale * y, z)
    }
}

/// Pixels that may be tested for all triangles together: 400 pictures' worth, where a surface needs a few. It bounds the
/// time for a foreign file whose triangles all fill the picture; what is drawn later is left out. Doubled, such a file may
/// take twice as long, about a second.
const TESTS_MAX: usize = 400 * SIZE[0] * SIZE[1];

/// A palette index per pixel, and its depth.
struct Canvas {
    pixels: Vec<u8>,
    depth: Vec<f64>,
    /// Pixels that may still be tested.
    tests_left: usize,
}

/// The picture as a PNG file. `shown`: name, sign and limits of the field in colours.
pub(super) fn picture(view: &View, shown: Option<(&str, bool, [f64; 2])>) -> Vec<u8> {
    let opaque = view.surfaces.iter().any(|s| s.visibility == Visibility::Shown);
    let wanted = if opaque { Visibility::Shown } else { Visibility::Transparent };
    let drawn: Vec<&Surface> = view.surfaces.iter().filter(|s| s.visibility == wanted).collect();
    let places: Vec<Vec<Vec3>> =
        drawn.iter().flat_map(|surface| copies(&surface.points, &view.mirrors(surface))).collect();
    let mut canvas = Canvas::new();
    if let Some(camera) = Camera::around(places.iter().flatten().copied()) {
        let owners = drawn.iter().flat_map(|surface| {
            let count = 1 << view.mirrors(surface).len();
            std::iter::repeat_n(*surface, count)
        });
        for (surface, points) in owners.zip(&places) {
            let field = shown.and_then(|(name, _, limits)| {
                Some((surface.fields.iter().find(|f| f.name == name)?, limits))
            });
            canvas.draw(&camera, surface, points, field);
        }
    }
    png::png(SIZE, &canvas.pixels, &palette(shown.is_some_and(|(_, signed, _)| signed)))
}

/// Points and their images in symmetry planes.
fn copies(points: &[Vec3], planes: &[(usize, f64)]) -> Vec<Vec<Vec3>> {
    let mut out = vec![points.to_vec()];
    for &(axis, at) in planes {
        let mut images = out.clone();
        images.iter_mut().flatten().for_each(|p| p[axis] = 2.0 * at - p[axis]);
        out.append(&mut images);
    }
    out
}

/// Colours: transparent, then shades of each band of the scale, of plain surfaces and of missing values.
fn palette(signed: bool) -> Vec<[u8; 3]> {
    let mut out = vec![[255; 3]];
    let bands = (0..BANDS).map(|k| color(table(signed), k as f64 / (BANDS - 1) as f64));
    for base in bands.chain([PLAIN, MISSING]) {
        for shade in 0..SHADES {
            let light = DARKEST + (1.0 - DARKEST) * shade as f64 / (SHADES - 1) as f64;
            out.push(base.map(|c| (c * light).round() as u8));
        }
    }
    out
}

impl Canvas {
    fn new() -> Self {
        let count = SIZE[0] * SIZE[1];
        Self {
            pixels: vec![0; count],
            depth: vec![f64::NEG_INFINITY; count],
            tests_left: TESTS_MAX,
        }
    }

    fn draw(
        &mut self,
        camera: &Camera,
        surface: &Surface,
        points: &[Vec3],
        field: Option<(&Field, [f64; 2])>,
    ) {
        let seen: Vec<Vec3> = points.iter().map(|p| camera.project(p)).collect();
        let light = Vec3::from(LIGHT).normalize();
        let light: Vec3 = (0..3).map(|k| camera.axes[k] * light[k]).sum();
        for (triangle, owner) in surface.triangles.iter().zip(surface.owners()) {
            let Some([a, b, c]) = corners(points, triangle) else { continue };
            let normal = (b - a).cross(&(c - a));
            let facing = (normal.dot(&light) / normal.norm()).abs();
            let shade =
                (facing * (SHADES - 1) as f64).round().clamp(0.0, (SHADES - 1) as f64) as usize;
            let values =
                field.map(|(field, limits)| (corner_values(field, triangle, owner), limits));
            let index = |weights: [f64; 3]| {
                let band = values.map_or(BANDS, |(values, limits)| {
                    band((0..3).map(|k| weights[k] * values[k]).sum(), limits)
                });
                (1 + band * SHADES + shade) as u8
            };
            if let Some(seen) = corners(&seen, triangle) {
                self.fill(&seen, index);
            }
        }
    }

    /// Fills the pixels of a triangle that are nearest to the eye; `index`: palette index at barycentric coordinates.
    fn fill(&mut self, [a, b, c]: &[Vec3; 3], index: impl Fn([f64; 3]) -> u8) {
        let area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
        if area == 0.0 || !area.is_finite() {
            return;
        }
        let range = |of: fn(&Vec3) -> f64, size: usize| {
            let (low, high) = (of(a).min(of(b)).min(of(c)), of(a).max(of(b)).max(of(c)));
            low.floor().max(0.0) as usize..(high.ceil().max(0.0) as usize + 1).min(size)
        };
        let (rows, columns) = (range(|p| p.y, SIZE[1]), range(|p| p.x, SIZE[0]));
        let Some(left) = self.tests_left.checked_sub(rows.len() * columns.len()) else { return };
        self.tests_left = left;
        for y in rows {
            for x in columns.clone() {
                let (px, py) = (x as f64 + 0.5, y as f64 + 0.5);
                let v = ((px - a.x) * (c.y - a.y) - (c.x - a.x) * (py - a.y)) / area;
                let w = ((b.x - a.x) * (py - a.y) - (px - a.x) * (b.y - a.y)) / area;
                let u = 1.0 - v - w;
                if u < 0.0 || v < 0.0 || w < 0.0 {
                    continue;
                }
                let depth = u * a.z + v * b.z + w * c.z;
                let at = y * SIZE[0] + x;
                if depth > self.depth[at] {
                    self.depth[at] = depth;
                    self.pixels[at] = index([u, v, w]);
                }
            }
        }
    }
}

/// Band of a value on the scale; that of missing values if it is none.
fn band(value: f64, [low, high]: [f64; 2]) -> usize {
    if !value.is_finite() {
        return BANDS + 1;
    }
    let fraction = if high > low { (value - low) / (high - low) } else { 0.5 };
    ((fraction * BANDS as f64).max(0.0) as usize).min(BANDS - 1)
}

fn corners(points: &[Vec3], triangle: &[u32; 3]) -> Option<[Vec3; 3]> {
    let [a, b, c] = triangle.map(|k| points.get(k as usize).copied());
    Some([a?, b?, c?])
}

/// Values at the corners of a triangle.
fn corner_values(field: &Field, triangle: &[u32; 3], owner: u32) -> [f64; 3] {
    let value = |k: u32| field.values.get(k as usize).copied().unwrap_or(f64::NAN);
    match field.location {
        Location::Points => triangle.map(value),
        Location::Cells => [value(owner); 3],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearer_face_hides_the_other() {
        let mut canvas = Canvas::new();
        let triangle = |z: f64| [[10.0, 10.0, z], [50.0, 10.0, z], [10.0, 50.0, z]].map(Vec3::from);
        canvas.fill(&triangle(1.0), |_| 7);
        canvas.fill(&triangle(0.0), |_| 9);
        let at = |x: usize, y: usize| canvas.pixels[y * SIZE[0] + x];
        assert_eq!((at(12, 12), at(49, 49), at(9, 12)), (7, 0, 0));
        // Half of 40 by 40 pixels.
        let filled = canvas.pixels.iter().filter(|p| **p == 7).count();
        assert!((780..=820).contains(&filled), "{filled}");
        // What fills the picture too often is left out.
        let whole = [[0.0, -2e3, 5.0], [2e3, 2e3, 5.0], [-2e3, 2e3, 5.0]].map(Vec3::from);
        canvas.tests_left = SIZE[0] * SIZE[1];
        canvas.fill(&whole, |_| 11);
        canvas.fill(&whole.map(|p| p + Vec3::z()), |_| 12);
        assert!(canvas.pixels.iter().all(|p| *p == 0 || *p == 11) && canvas.tests_left == 0);
        // Outside, of no area, not a number.
        canvas.tests_left = TESTS_MAX;
        for odd in [-1e9, 1e9, f64::NAN] {
            canvas
                .fill(&[[odd, 0.0, 0.0], [odd, 1.0, 0.0], [1.0, odd, 0.0]].map(Vec3::from), |_| 3);
        }
    }

    #[test]
    fn values_choose_their_band_and_images_are_mirrored() {
        assert_eq!([0.0, 0.5, 1.0, 2.0].map(|v| band(v, [0.0, 1.0])), [0, 10, 19, 19]);
        assert_eq!((band(f64::NAN, [0.0, 1.0]), band(3.0, [3.0, 3.0])), (BANDS + 1, 10));
        let images = copies(&[Vec3::new(1.0, 2.0, 3.0)], &[(0, 0.0), (1, 1.0)]);
        let places: Vec<[f64; 3]> = images.iter().map(|one| one[0].into()).collect();
        assert_eq!(places, [[1.0, 2.0, 3.0], [-1.0, 2.0, 3.0], [1.0, 0.0, 3.0], [-1.0, 0.0, 3.0]]);
        assert!(palette(true).len() <= 256 && palette(false).len() == 1 + (BANDS + 2) * SHADES);
    }
}
