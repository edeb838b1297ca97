//! One CAD file against what an independent kernel says of it.

use std::path::{Path, PathBuf};
use std::time::Instant;

use kanagata::cad::{Model, read};
use kanagata::geometry::{Aabb, Vec3};
use serde_json::Value;

/// The folder of foreign CAD files, if there is one.
pub fn folder() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/cad");
    let named = std::env::var_os("KANAGATA_CORPUS").map(PathBuf::from);
    named.or(Some(beside)).filter(|f| f.join("truth.json").is_file())
}

/// Names and truths, in the order of the names.
pub fn truths(folder: &Path) -> Vec<(String, Value)> {
    let text = std::fs::read(folder.join("truth.json")).expect("truth.json can be read");
    let all: serde_json::Map<String, Value> =
        serde_json::from_slice(&text).expect("truth.json is JSON");
    let mut all: Vec<_> = all.into_iter().map(|(k, v)| (k, v["truth"].clone())).collect();
    all.sort_by(|a, b| a.0.cmp(&b.0));
    all
}

/// What was found of one file.
#[derive(Debug, Clone, Default)]
pub struct Row {
    pub name: String,
    /// Seconds to read and build.
    pub seconds: f64,
    pub checked: bool,
    /// Ours, and the kernel's.
    pub faces: [usize; 2],
    /// Faces that the other side has not, by area and centroid: ours, and the kernel's, where they were compared.
    pub unmatched: Option<[usize; 2]>,
    /// Relative difference of the areas, and what is allowed.
    pub area: Option<[f64; 2]>,
    /// Our box: smallest and largest coordinates [mm].
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Largest difference of the boxes as a share of the diagonal.
    pub bbox: Option<f64>,
    /// Length of free edges after joining: ours, and the kernel's [mm].
    pub free: Option<[f64; 2]>,
    /// The reader's refusal.
    pub refused: Option<String>,
    pub diagnostics: Vec<String>,
}

impl Row {
    /// The figures that differ from the kernel's, by name.
    pub fn differs(&self) -> impl Iterator<Item = &'static str> {
        [
            ("area", self.area_holds()),
            ("box", self.bbox_holds()),
            ("free edges", self.free_holds()),
            ("faces", self.faces[0] == self.faces[1] || self.unmatched == Some([0, 0])),
            ("reading", self.refused.is_none()),
        ]
        .into_iter()
        .filter_map(|(what, holds)| (!holds).then_some(what))
    }

    pub fn area_holds(&self) -> bool {
        self.area.is_none_or(|[off, allowed]| off <= allowed)
    }

    pub fn bbox_holds(&self) -> bool {
        self.bbox.is_none_or(|off| off <= 1e-6)
    }

    pub fn free_holds(&self) -> bool {
        self.free.is_none_or(|[own, other]| (own - other).abs() <= 0.01 * other.max(1e-9 * own))
    }
}

/// Reads a file and compares it; faces are matched one by one where `match_faces` says so.
pub fn check(folder: &Path, name: &str, truth: &Value, match_faces: bool) -> Row {
    let mut row = Row { name: name.into(), ..Row::default() };
    row.checked = truth["trust"] == "checked";
    row.faces[1] = truth["faces"].as_u64().unwrap_or(0) as usize;
    let start = Instant::now();
    let (model, diagnostics) = match read(&folder.join(name)) {
        Ok(found) => found,
        Err(error) => {
            row.seconds = start.elapsed().as_secs_f64();
            row.refused = Some(error.to_string());
            return row;
        }
    };
    row.seconds = start.elapsed().as_secs_f64();
    row.diagnostics = diagnostics
        .iter()
        .map(|d| format!("{:?} {} {}: {}", d.severity, d.code, d.place, d.text))
        .collect();
    row.faces[0] = model.faces.len();
    if model.faces.is_empty() {
        return row;
    }
    if let Some(area) = truth["area_truth_mm2"].as_f64().filter(|a| *a > 0.0) {
        let allowed = truth["area_rel_uncertainty"].as_f64().unwrap_or(0.0).max(1e-5);
        row.area = Some([(model.area() / area - 1.0).abs(), allowed]);
    }
    let own = model.bbox();
    row.bounds = Some([own.min.into(), own.max.into()]);
    row.bbox = bbox_off(&own, truth);
    let sewn = &truth["sewn"];
    let (tolerance, free) = match sewn["tol_mm"].as_f64() {
        Some(tolerance) => (Some(tolerance), sewn["free_edge_length"].as_f64()),
        None => (None, truth["free_edge_length"].as_f64()),
    };
    row.free = free.map(|other| {
        let joined = tolerance.map(|t| model.joined_within(t));
        [free_length(joined.as_ref().unwrap_or(&model)), other]
    });
    if match_faces {
        row.unmatched = Some(unmatched(&model, truth));
    }
    row
}

fn bbox_off(own: &Aabb, truth: &Value) -> Option<f64> {
    let other: Vec<f64> = truth["bbox_mm"].as_array()?.iter().filter_map(Value::as_f64).collect();
    let found = [own.min.x, own.min.y, own.min.z, own.max.x, own.max.y, own.max.z];
    let off = found.iter().zip(&other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    Some(off / own.diagonal())
}

/// Length of the edges that one face alone uses [mm]. The kernel joins sides in pairs: where three faces meet in an
/// edge, one of them stays free.
pub fn free_length(model: &Model) -> f64 {
    model
        .edges
        .iter()
        .filter(|e| e.uses.len() % 2 == 1)
        .map(|e| e.curve.length())
        .sum::<f64>()
        .abs()
}

/// Faces without a partner of the same area (1e-3) and centroid (1e-4 of the diagonal), on both sides.
fn unmatched(model: &Model, truth: &Value) -> [usize; 2] {
    let Some(list) = truth["face_list"].as_array() else { return [0, 0] };
    let reach = 1e-4 * model.bbox().diagonal();
    let mut own: Vec<(f64, Vec3)> = model
        .faces
        .iter()
        .map(|face| {
            let one = Model { faces: vec![face.clone()], ..Model::default() };
            (face.area(1e-6), one.area_centroid().unwrap_or_default())
        })
        .collect();
    let mut missing = 0;
    for other in list {
        let area = other["area"].as_f64().unwrap_or(0.0).abs();
        let c: Vec<f64> =
            other["centroid"].as_array().into_iter().flatten().filter_map(Value::as_f64).collect();
        let [x, y, z] = c[..] else { continue };
        let at = Vec3::new(x, y, z);
        let near = |(a, b): &(f64, Vec3)| {
            (a - area).abs() <= 1e-3 * area.max(1e-6 * reach * reach) && (b - at).norm() <= reach
        };
        match own.iter().position(near) {
            Some(k) => {
                own.swap_remove(k);
            }
            None => missing += 1,
        }
    }
    [own.len(), missing]
}
