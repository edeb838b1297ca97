//! Compared quantities of the runs of a study: thickness along two lines, draw-in, and patches of the tools.

use std::path::Path;

use serde_json::Value;

use kanagata_files::sha256_hex;
use kanagata_geometry::{Vec2, Vec3};
use kanagata_report::vtu_read;

/// Thickness along a line: distance in the flat blank [mm] and thickness [mm].
pub type Profile = Vec<(f64, f64)>;

/// The formed sheet.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sheet {
    /// Along the side of smallest y.
    pub dx: Profile,
    /// Along the diagonal of the blank's bounding box.
    pub dxy: Profile,
    /// Draw-in: inward displacement of the ends of the two lines [mm].
    pub draw_in: [f64; 2],
    /// Minimum thickness [mm].
    pub thinnest: f64,
}

/// Reads `steps/last.vtu` of a run; `None` if it is missing or unusable.
#[must_use]
pub fn sheet(run: &Path) -> Option<Sheet> {
    let grid = vtu_read::read(&run.join("steps/last.vtu")).ok()?;
    let array = |name: &str| grid.point_data.iter().find(|a| a.name == name);
    let (moved, thickness) = (array("displacement_mm")?, array("thickness_mm")?);
    let flat: Vec<Vec2> = grid
        .points
        .iter()
        .zip(moved.values.chunks_exact(3))
        .map(|(x, u)| Vec2::new(x.x - u[0], x.y - u[1]))
        .collect();
    let nodes = Nodes { flat, now: &grid.points, thickness: &thickness.values };
    (nodes.flat.len() == thickness.values.len()).then(|| nodes.sheet()).flatten()
}

struct Nodes<'a> {
    /// Positions in the flat blank.
    flat: Vec<Vec2>,
    now: &'a [Vec3],
    thickness: &'a [f64],
}

impl Nodes<'_> {
    fn sheet(&self) -> Option<Sheet> {
        let low = self.flat.iter().copied().reduce(|a, b| a.inf(&b))?;
        let high = self.flat.iter().copied().reduce(|a, b| a.sup(&b))?;
        let (dx, in_x) = self.along(low, Vec2::x(), (high - low).norm())?;
        let (dxy, in_xy) = self.along(low, high - low, (high - low).norm())?;
        let thinnest = self.thickness.iter().copied().fold(f64::INFINITY, f64::min);
        Some(Sheet { dx, dxy, draw_in: [in_x, in_xy], thinnest })
    }

    /// Thickness along a line from `low`, and the draw-in of its far end.
    fn along(&self, low: Vec2, direction: Vec2, size: f64) -> Option<(Profile, f64)> {
        let line = direction.try_normalize(0.0)?;
        let near = 1e-6 * size;
        let mut on: Vec<(f64, usize)> = (0..self.flat.len())
            .filter(|&k| line.perp(&(self.flat[k] - low)).abs() <= near)
            .map(|k| (line.dot(&(self.flat[k] - low)), k))
            .collect();
        on.sort_by(|a, b| a.0.total_cmp(&b.0));
        on.dedup_by(|b, a| b.0 - a.0 <= near);
        let &(end, last) = on.last()?;
        let now = line.dot(&(Vec2::new(self.now[last].x, self.now[last].y) - low));
        Some((on.iter().map(|&(s, k)| (s, self.thickness[k])).collect(), end - now))
    }
}

/// Largest difference between two profiles [mm], at the points of the coarser one: between them it is only interpolated.
#[must_use]
pub fn largest_difference(one: &[(f64, f64)], other: &[(f64, f64)]) -> Option<f64> {
    let (coarse, fine) = if one.len() <= other.len() { (one, other) } else { (other, one) };
    if fine.len() < 2 {
        return None;
    }
    let difference = coarse.iter().map(|&(s, t)| (t - at(fine, s)).abs());
    difference.reduce(f64::max)
}

/// Linear interpolation, constant beyond the ends; zero for an empty curve.
#[must_use]
pub fn at(curve: &[(f64, f64)], x: f64) -> f64 {
    let after = curve.partition_point(|p| p.0 < x).clamp(1, curve.len().max(2) - 1);
    let (Some(&(x0, y0)), Some(&(x1, y1))) = (curve.get(after - 1), curve.get(after)) else {
        return curve.first().map_or(0.0, |p| p.1);
    };
    y0 + (y1 - y0) * ((x - x0) / (x1 - x0)).clamp(0.0, 1.0)
}

/// Number of patches of all tools of a scene, and the largest of their shape errors [mm] if all are known. Files are
/// relative to `folder`.
#[must_use]
pub fn tools(scene: &Value, folder: &Path) -> (usize, Option<f64>) {
    let files = scene.get("tools").and_then(Value::as_array).into_iter().flatten();
    let files = files.filter_map(|t| t.get("file").and_then(Value::as_str));
    let (mut patches, mut errors) = (0, Vec::new());
    for file in files {
        let file = super::inputs::joined(folder, Path::new(file));
        let bytes = kanagata_files::read(&file, kanagata_files::Input::Tool).unwrap_or_default();
        let tool: Value = serde_json::from_slice(&bytes).unwrap_or_default();
        let count = |key: &str| tool.get(key).and_then(Value::as_array).map_or(0, Vec::len);
        patches += count("patches") + count("bezier_patches");
        let named = tool.pointer("/provenance/shape_error_mm").and_then(Value::as_f64);
        errors.push(audited(&file, &bytes).or(named).map(f64::abs));
    }
    let known: Option<Vec<f64>> = errors.into_iter().collect();
    (patches, known.and_then(|errors| errors.into_iter().reduce(f64::max)))
}

/// Largest shape error in the audit beside a tool file (`NAME.audit.json`), if the audit is of the same file [mm].
fn audited(file: &Path, bytes: &[u8]) -> Option<f64> {
    let name = file.file_name()?.to_str()?.strip_suffix(".tool.json")?;
    let beside = kanagata_files::read(
        &file.with_file_name(format!("{name}.audit.json")),
        kanagata_files::Input::Description,
    )
    .ok()?;
    let audit: Value = serde_json::from_slice(&beside).ok()?;
    if audit.get("tool_sha256")?.as_str()? != sha256_hex(bytes) {
        return None;
    }
    let number = |key: &str| audit.get(key).and_then(Value::as_f64);
    Some(number("max_mm")?.abs().max(number("min_mm")?.abs()))
}

/// Whether each point (cost, error) is Pareto-optimal: no other point is as good in both and better in one.
#[must_use]
pub fn pareto_front(points: &[(f64, f64)]) -> Vec<bool> {
    let beats =
        |a: &(f64, f64), b: &(f64, f64)| a.0 <= b.0 && a.1 <= b.1 && (a.0 < b.0 || a.1 < b.1);
    points.iter().map(|p| !points.iter().any(|q| beats(q, p))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_report::{DataArray, Vtu};

    #[test]
    fn lines_of_a_formed_sheet_are_found_in_the_flat_blank() {
        // A 2 x 2 grid of columns of two nodes on a box of 10 mm; the far corner is drawn in by (1, 1).
        let mut points = Vec::new();
        let mut moved = Vec::new();
        let mut thickness = Vec::new();
        for (i, j) in [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1), (0, 2), (1, 2), (2, 2)] {
            for z in [0.0, 1.0] {
                let x = Vec3::new(5.0 * f64::from(i), 5.0 * f64::from(j), z);
                let u =
                    if i == 2 { Vec3::new(-1.0, -f64::from(j) / 2.0, -3.0) } else { Vec3::zeros() };
                points.push(x + u);
                moved.push(u);
                thickness.push(1.0 - 0.1 * f64::from(i * j));
            }
        }
        let mut grid = Vtu::new(points);
        grid.point_data.push(DataArray::vector("displacement_mm", &moved));
        grid.point_data.push(DataArray::scalar("thickness_mm", thickness));
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("steps")).unwrap();
        grid.write(&folder.path().join("steps/last.vtu")).unwrap();
        let sheet = sheet(folder.path()).unwrap();
        assert_eq!(sheet.dx, [(0.0, 1.0), (5.0, 1.0), (10.0, 1.0)]);
        let far = 200.0_f64.sqrt();
        assert!((sheet.dxy[1].0 - far / 2.0).abs() < 1e-12 && (sheet.dxy[2].1 - 0.6).abs() < 1e-12);
        assert!((sheet.draw_in[0] - 1.0).abs() < 1e-12);
        assert!((sheet.draw_in[1] - 2.0_f64.sqrt()).abs() < 1e-12);
        assert!((sheet.thinnest - 0.6).abs() < 1e-12);
        assert!(super::sheet(&folder.path().join("nothing")).is_none());
    }

    #[test]
    fn profiles_are_compared_where_the_coarser_has_points() {
        let coarse = [(0.0, 1.0), (10.0, 2.0)];
        assert_eq!(largest_difference(&[(5.0, 1.5), (7.5, 1.5)], &coarse), Some(0.25));
        let fine = [(0.0, 1.0), (5.0, 0.0), (10.0, 1.9)];
        for difference in [largest_difference(&fine, &coarse), largest_difference(&coarse, &fine)] {
            assert!((difference.unwrap() - 0.1).abs() < 1e-12, "{difference:?}");
        }
        assert_eq!(largest_difference(&[(5.0, 1.5)], &[]), None);
    }

    #[test]
    fn shape_errors_are_those_of_every_tool_or_none() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let put = |name: &str, value: Value| std::fs::write(path(name), value.to_string()).unwrap();
        put(
            "die.tool.json",
            serde_json::json!({"patches": [1, 2], "provenance": {"shape_error_mm": -0.3}}),
        );
        put("punch.tool.json", serde_json::json!({"bezier_patches": [1], "provenance": {}}));
        let file = |name: &str| serde_json::json!({"file": path(name)});
        let scene = serde_json::json!({"tools": [file("die.tool.json"), file("punch.tool.json")]});
        assert_eq!(tools(&scene, Path::new("/")), (3, None));
        let mut audit = serde_json::json!({"tool_sha256": "other", "max_mm": 0.1, "min_mm": -0.4});
        put("punch.audit.json", audit.clone());
        assert_eq!(tools(&scene, Path::new("/")), (3, None));
        audit["tool_sha256"] = sha256_hex(&std::fs::read(path("punch.tool.json")).unwrap()).into();
        put("punch.audit.json", audit);
        assert_eq!(tools(&scene, Path::new("/")), (3, Some(0.4)));
    }

    #[test]
    fn the_pareto_front_holds_undominated_points() {
        let points = [(1.0, 5.0), (2.0, 3.0), (3.0, 3.0), (4.0, 1.0), (4.0, 6.0)];
        assert_eq!(pareto_front(&points), [true, true, false, true, false]);
    }
}
