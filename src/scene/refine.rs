//! Local refinement of the blank in plan: which elements of its base mesh are split, and how often.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::Fault;
use kanagata_geometry::Vec2;
use kanagata_solver::sheet::hex_mesh::HexMesh;
use kanagata_solver::sheet::refine::{LEVEL_MAX, Refinement, plan_elements};

/// Largest number of entries of `blank.refine`, and of points of a polygon. With twice as many, a scene at the limit takes
/// four times as long to read.
const ENTRIES_MAX: usize = 100;
const POLYGON_POINTS_MAX: usize = 1000;

/// Ratio by which an element is shrunk about its centre before it is compared with a region, so that one that only
/// borders on the region is not in it.
const SHRINK_REL: f64 = 1e-6;

/// Elements of the blank that are split in plan: those of a region, or a level for each. An element of level `n` is split
/// into `4^n` columns of elements through all layers. The largest level of all entries holds; it is raised where the levels
/// of two elements with a common side would differ by more than 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Refine {
    /// Level of the elements in the region: 1 to 4. Required with `where`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub level: Option<u8>,
    /// Region in plan.
    #[serde(rename = "where", default, skip_serializing_if = "Option::is_none")]
    pub region: Option<PlanRegion>,
    /// In place of `level` and `where`: one digit from 0 to 4 for each element of the base mesh in plan, in its order.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub levels: Option<String>,
}

/// Elements of the undeformed blank in plan, seen along z: those that overlap the region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum PlanRegion {
    /// All elements (`true`).
    All(bool),
    /// A box along x and y [mm].
    Box {
        /// Smallest x and y.
        min_mm: [f64; 2],
        /// Largest x and y.
        max_mm: [f64; 2],
    },
    /// Further than this from the z axis [mm].
    BeyondRadiusMm(f64),
    /// A ring or a disc.
    Ring {
        /// Its centre [mm].
        #[serde(default)]
        centre_mm: [f64; 2],
        /// Inner and outer radius [mm]; an inner radius of 0 is a disc.
        radii_mm: [f64; 2],
    },
    /// A polygon by its corners [mm], 3 to 1000.
    PolygonMm(Vec<[f64; 2]>),
}

/// Checks the entries of `blank.refine`.
pub(super) fn check(entries: &[Refine]) -> Result<(), Fault> {
    let count = entries.len();
    if count > ENTRIES_MAX {
        let allowed = format!("at most {ENTRIES_MAX} entries");
        return Err(("blank.refine".into(), format!("{count} entries"), allowed));
    }
    entries.iter().enumerate().try_for_each(|(k, entry)| entry.check(k))
}

impl Refine {
    fn check(&self, k: usize) -> Result<(), Fault> {
        let fault = |key: &str, found: String, allowed: &str| {
            Err((format!("blank.refine[{k}]{key}"), found, allowed.to_owned()))
        };
        match (self.level, &self.region, &self.levels) {
            (Some(level), Some(region), None) => {
                if !(1..=LEVEL_MAX).contains(&level) {
                    return fault(".level", level.to_string(), "1 to 4");
                }
                match region.fault() {
                    Some((found, allowed)) => fault(".where", found, allowed),
                    None => Ok(()),
                }
            }
            (None, None, Some(levels)) => match levels.chars().find(|c| !('0'..='4').contains(c)) {
                Some(c) => fault(".levels", format!("'{}'", c.escape_default()), "digits 0 to 4"),
                None => Ok(()),
            },
            _ => fault("", "other keys".into(), "`level` and `where`, or `levels` alone"),
        }
    }
}

impl PlanRegion {
    /// What is wrong with the region, and what is allowed.
    fn fault(&self) -> Option<(String, &'static str)> {
        match self {
            Self::All(_) => None,
            Self::Box { min_mm, max_mm } => (0..2).any(|k| min_mm[k] > max_mm[k]).then(|| {
                (format!("min_mm {min_mm:?} and max_mm {max_mm:?}"), "min_mm up to max_mm")
            }),
            Self::BeyondRadiusMm(radius) => {
                (*radius < 0.0).then(|| (radius.to_string(), "a radius of 0 or more"))
            }
            Self::Ring { radii_mm: [inner, outer], .. } => (*inner < 0.0 || inner >= outer)
                .then(|| (format!("radii [{inner}, {outer}]"), "0 <= inner < outer radius")),
            Self::PolygonMm(points) => (!(3..=POLYGON_POINTS_MAX).contains(&points.len()))
                .then(|| (format!("{} points", points.len()), "3 to 1000 points")),
        }
    }

    /// Whether an element with these corners overlaps the region.
    fn overlaps(&self, quad: &[Vec2; 4]) -> bool {
        let farthest = |c: &Vec2| quad.iter().map(|x| (x - c).norm()).fold(0.0, f64::max);
        match self {
            Self::All(all) => *all,
            Self::Box { min_mm: [a, b], max_mm: [c, d] } => {
                overlap(quad, &[[*a, *b], [*c, *b], [*c, *d], [*a, *d]].map(Vec2::from))
            }
            Self::BeyondRadiusMm(radius) => farthest(&Vec2::zeros()) > *radius,
            Self::Ring { centre_mm, radii_mm: [inner, outer] } => {
                let centre = Vec2::from(*centre_mm);
                farthest(&centre) > *inner && distance(quad, &centre) < *outer
            }
            Self::PolygonMm(points) => {
                let points: Vec<Vec2> = points.iter().copied().map(Vec2::from).collect();
                overlap(quad, &points)
            }
        }
    }
}

fn sides(polygon: &[Vec2]) -> impl Iterator<Item = [Vec2; 2]> {
    (0..polygon.len()).map(|k| [polygon[k], polygon[(k + 1) % polygon.len()]])
}

/// Twice the area of the triangle, positive if counter-clockwise.
fn turn(a: &Vec2, b: &Vec2, c: &Vec2) -> f64 {
    (b - a).perp(&(c - a))
}

/// Whether a point is inside a polygon (even-odd rule).
fn contains(polygon: &[Vec2], x: &Vec2) -> bool {
    let crosses = |[a, b]: &[Vec2; 2]| {
        (a.y > x.y) != (b.y > x.y) && x.x < a.x + (b.x - a.x) * (x.y - a.y) / (b.y - a.y)
    };
    sides(polygon).filter(crosses).count() % 2 == 1
}

/// Whether two polygons overlap: a corner of one in the other, or sides that cross.
fn overlap(a: &[Vec2], b: &[Vec2]) -> bool {
    let range = |polygon: &[Vec2], k: usize| {
        polygon.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
            [low.min(x[k]), high.max(x[k])]
        })
    };
    let apart = |k: usize| {
        let ([a0, a1], [b0, b1]) = (range(a, k), range(b, k));
        a1 < b0 || b1 < a0
    };
    if (0..2).any(apart) {
        return false;
    }
    let cross = |[p, q]: [Vec2; 2]| {
        sides(b).any(|[r, s]| {
            turn(&p, &q, &r) * turn(&p, &q, &s) < 0.0 && turn(&r, &s, &p) * turn(&r, &s, &q) < 0.0
        })
    };
    a.iter().any(|x| contains(b, x)) || b.iter().any(|x| contains(a, x)) || sides(a).any(cross)
}

/// Distance of a point from a polygon; 0 inside.
fn distance(polygon: &[Vec2], x: &Vec2) -> f64 {
    if contains(polygon, x) {
        return 0.0;
    }
    let of_side = |[a, b]: [Vec2; 2]| {
        let along = b - a;
        let t = ((x - a).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (x - a - along * t).norm()
    };
    sides(polygon).map(of_side).fold(f64::INFINITY, f64::min)
}

/// Levels of the elements in plan of the base mesh of a blank, balanced. At most `elements_max` elements in all.
pub(super) fn refinement(
    entries: &[Refine],
    base: &HexMesh,
    elements_max: usize,
) -> Result<Refinement, Fault> {
    let quads = plan_elements(base);
    let mut levels = vec![0_u8; quads.len()];
    for (k, entry) in entries.iter().enumerate() {
        let found = match (&entry.levels, &entry.region) {
            (Some(digits), _) => given_levels(digits, quads.len(), k)?,
            (None, Some(region)) => {
                let level = entry.level.unwrap_or(0);
                let of = |quad| if region.overlaps(&shrunk(base, quad)) { level } else { 0 };
                let found: Vec<u8> = quads.iter().map(of).collect();
                if found.iter().all(|level| *level == 0) {
                    let allowed = "a region that overlaps elements of the blank";
                    return Err((
                        format!("blank.refine[{k}].where"),
                        "no element".into(),
                        allowed.into(),
                    ));
                }
                found
            }
            (None, None) => continue,
        };
        levels.iter_mut().zip(found).for_each(|(level, new)| *level = (*level).max(new));
    }
    let refinement = Refinement::balanced(quads, levels);
    let layers = base.nodes_per_column.saturating_sub(1).max(1);
    let count = refinement.element_count().saturating_mul(layers);
    if count > elements_max {
        let allowed = format!("at most {elements_max} in all");
        return Err(("blank.refine".into(), format!("{count} elements"), allowed));
    }
    Ok(refinement)
}

/// Corners of an element in plan [mm], shrunk about its centre by [`SHRINK_REL`].
fn shrunk(base: &HexMesh, quad: &[u32; 4]) -> [Vec2; 4] {
    let at = quad.map(|column| base.nodes[column as usize * base.nodes_per_column].xy());
    let middle = at.iter().sum::<Vec2>() / 4.0;
    at.map(|x| x + (middle - x) * SHRINK_REL)
}

/// The levels of `count` elements from their digits.
fn given_levels(digits: &str, count: usize, k: usize) -> Result<Vec<u8>, Fault> {
    if digits.len() != count {
        let found = format!("{} digits", digits.len());
        let allowed = format!("{count} digits, one for each element of the base mesh in plan");
        return Err((format!("blank.refine[{k}].levels"), found, allowed));
    }
    Ok(digits.bytes().map(|digit| digit.wrapping_sub(b'0').min(LEVEL_MAX)).collect())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::blank::blank_mesh;
    use crate::types::Blank;
    use kanagata_geometry::Vec3;

    fn blank(shape: serde_json::Value, refine: serde_json::Value) -> Blank {
        let blank =
            serde_json::json!({"shape": shape, "thickness_mm": 1.0, "layers": 2, "refine": refine});
        serde_json::from_value(blank).unwrap()
    }

    fn rectangle() -> serde_json::Value {
        serde_json::json!({"rectangle": {"size_mm": [40.0, 30.0], "elements": [4, 3]}})
    }

    fn levels(refine: serde_json::Value) -> Result<Vec<u8>, Fault> {
        let blank = blank(rectangle(), refine);
        check(&blank.refine)?;
        let plain = Blank { refine: Vec::new(), ..blank.clone() };
        let base = blank_mesh(&plain, Path::new("x"), Path::new(""), None).unwrap();
        Ok(refinement(&blank.refine, &base, 1000)?.levels().to_vec())
    }

    #[test]
    fn regions_find_the_elements_that_they_overlap() {
        let of = |region| levels(serde_json::json!([{"level": 1, "where": region}])).unwrap();
        let json = |text: &str| serde_json::from_str::<serde_json::Value>(text).unwrap();
        // Elements are numbered along y first, 10 mm long.
        let box_ = of(json(r#"{"box": {"min_mm": [10, 10], "max_mm": [20, 20]}}"#));
        assert_eq!(box_, [0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]);
        let inside = of(json(r#"{"box": {"min_mm": [12, 12], "max_mm": [13, 21]}}"#));
        assert_eq!(inside, [0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0, 0]);
        let far = of(json(r#"{"beyond_radius_mm": 45.0}"#));
        assert_eq!(far, [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1]);
        // A ring that passes through an element between its corners.
        let ring = of(json(r#"{"ring": {"centre_mm": [15, 15], "radii_mm": [1, 2]}}"#));
        assert_eq!(ring, [0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]);
        let triangle = of(json(r#"{"polygon_mm": [[-5, -5], [9, -5], [-5, 12]]}"#));
        assert_eq!(triangle, [1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(of(json(r#"{"all": true}"#)), [1; 12]);
    }

    #[test]
    fn the_largest_level_holds_and_neighbours_follow() {
        let refine = serde_json::json!([
            {"level": 1, "where": {"box": {"min_mm": [0, 0], "max_mm": [10, 10]}}},
            {"levels": "300000000000"}
        ]);
        assert_eq!(levels(refine), Ok(vec![3, 2, 1, 2, 1, 0, 1, 0, 0, 0, 0, 0]));
    }

    #[test]
    fn wrong_entries_say_where() {
        let place = |refine| levels(refine).unwrap_err().0;
        let json = |text: &str| serde_json::from_str::<serde_json::Value>(text).unwrap();
        for (text, expected) in [
            (r#"[{"level": 5, "where": {"all": true}}]"#, "blank.refine[0].level"),
            (r#"[{"level": 1}]"#, "blank.refine[0]"),
            (r#"[{"level": 1, "where": {"all": true}, "levels": "0"}]"#, "blank.refine[0]"),
            (r#"[{"levels": "01x"}]"#, "blank.refine[0].levels"),
            (r#"[{"levels": "011"}]"#, "blank.refine[0].levels"),
            (r#"[{"level": 1, "where": {"beyond_radius_mm": 90}}]"#, "blank.refine[0].where"),
            (
                r#"[{"level": 1, "where": {"polygon_mm": [[0, 0], [1, 1]]}}]"#,
                "blank.refine[0].where",
            ),
            (r#"[{"level": 1, "where": {"ring": {"radii_mm": [2, 1]}}}]"#, "blank.refine[0].where"),
            (
                r#"[{"level": 1, "where": {"box": {"min_mm": [2, 0], "max_mm": [1, 5]}}}]"#,
                "blank.refine[0].where",
            ),
            (r#"[{"level": 4, "where": {"all": true}}]"#, "blank.refine"),
        ] {
            assert_eq!(place(json(text)), expected, "{text}");
        }
    }

    #[test]
    fn the_rim_of_a_refined_disc_is_its_circle() {
        let shape = serde_json::json!({"disc": {"radius_mm": 30.0, "core": 2, "rings": 2}});
        let refine = serde_json::json!([{"level": 2, "where": {"beyond_radius_mm": 29.0}}]);
        let mesh = blank_mesh(&blank(shape, refine), Path::new("x"), Path::new(""), None).unwrap();
        let far = mesh.nodes.iter().map(|x| x.xy().norm()).filter(|r| *r > 29.9);
        let off: Vec<f64> = far.map(|r| (r - 30.0).abs()).collect();
        // 16 base elements on the rim, 4 parts each, 3 levels.
        assert_eq!(off.len(), 16 * 4 * 3);
        assert!(off.iter().all(|off| *off < 1e-13), "{off:?}");
    }

    /// Hexahedra of a file on their sides and in disorder, with uneven levels: new nodes are means of the corner columns.
    #[test]
    fn hexahedra_of_a_file_are_refined_by_columns() {
        use kanagata_solver::sheet::columns::from_hexahedra;
        use kanagata_solver::sheet::hex_mesh::rectangle;
        let mut whole = rectangle(6.0, 4.0, 1.0, 3, 2, 2);
        whole.nodes.iter_mut().filter(|x| x.z == 0.5).for_each(|x| x.z = 0.3 + 0.05 * x.x);
        let lying = |k: usize| [0, 3, 7, 4, 1, 2, 6, 5].map(|n| whole.elements[5 * k % 12][n]);
        let elements: Vec<[u32; 8]> = (0..12).map(lying).collect();
        let base = from_hexahedra(&whole.nodes, &elements, false, Some(1.0)).unwrap();
        let region = serde_json::json!({"box": {"min_mm": [0, 0], "max_mm": [2, 2]}});
        let entry = serde_json::json!([{"level": 2, "where": region}]);
        let entries: Vec<Refine> = serde_json::from_value(entry).unwrap();
        let mesh = refinement(&entries, &base, 1000).unwrap().mesh(&base, None);
        assert_eq!((mesh.nodes_per_column, mesh.elements.len()), (3, 2 * (16 + 4 + 4 + 3)));
        assert!(!mesh.hanging.is_empty());
        for column in mesh.nodes.chunks(3) {
            let x = column[0];
            assert!((column[1] - Vec3::new(x.x, x.y, 0.3 + 0.05 * x.x)).norm() < 1e-14, "{x}");
            assert!((column[2] - x - Vec3::z()).norm() < 1e-14, "{x}");
        }
    }
}
