//! Faces of a tool that the sheet of a scene can touch; the others may be left out of its model.
//!
//! What is known before a run is where the sheet begins and how far the tools travel. A face is left out only when
//! one of three things holds over the whole of it:
//!
//! - **beside**: seen along the tool's direction it lies outside the box of the blank, widened by twice the thickness
//!   or a twentieth of the blank's size (whichever is more), and by what tools travel across;
//! - **behind**: it lies farther behind the front of the tool (the foremost point over the blank, which is what
//!   touches the flat sheet first) than all travels together and twice the thickness: no tool carries the sheet there;
//! - **away**: every normal looks away from the sheet by more than 5 degrees: a sheet would have to wrap round the tool.
//!
//! Travels are added up whatever their directions. A tool driven by force is taken to follow the sheet, no farther
//! than the tools driven by travel move it; a scene without a travel, or with loads on the sheet, says nothing about
//! how deep the sheet goes, and no face counts as behind.

use std::collections::BTreeMap;
use std::path::Path;

use crate::cad::Model;
use crate::cad::model::Face;
use crate::geometry::frame::Frame;
use crate::geometry::{Aabb, Vec2, Vec3};
use crate::mesh::mapped::{MappedOptions, mesh};
use crate::mesh::{MeshError, io};
use crate::scene::types::{BlankShape, Drive, Place, Scene, Tool};
use crate::tool::ToolModel;

/// Degrees beyond a right angle from which on a normal looks away.
const AWAY_DEG: f64 = 5.0;
/// Share of the blank's size that it may grow at its rim.
const RIM: f64 = 0.05;

/// Why a face is left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Why {
    /// Beside the sheet.
    Beside,
    /// Farther behind the front than any tool travels.
    Behind,
    /// Looks away from the sheet.
    Away,
}

/// Why there is no zone, or nothing in it.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum ReachError {
    /// No tool of the scene is meant.
    #[error(
        "no tool of the scene has the file '{file}' or the name '{name}'; allowed: {allowed}; name it with --name"
    )]
    NoTool {
        /// Name of the output file.
        file: String,
        /// Name of the tool.
        name: String,
        /// Tools of the scene.
        allowed: String,
    },
    /// Every face is out of reach.
    #[error(
        "the sheet reaches none of the {faces} faces; allowed: at least one; check the tool's direction, its place and the blank in the scene, or leave --reach out"
    )]
    Nothing {
        /// Faces of the model.
        faces: usize,
    },
    /// The blank's mesh file.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// Where the sheet may be during a run, seen from one tool.
#[derive(Debug, Clone, PartialEq)]
pub struct Zone {
    /// Axes across the tool's direction, and along it.
    axes: [Vec3; 3],
    /// Extents of the undeformed blank along the axes, in the tool's frame [mm].
    blank: [[f64; 2]; 3],
    /// How far beside the blank the sheet may be along the first two axes [mm].
    margin: [f64; 2],
    /// How far behind the tool's front the sheet may be [mm].
    depth: f64,
    /// The tool is moved along its direction until it touches.
    touches: bool,
}

impl Zone {
    /// The zone of the tool that a scene calls `name` or whose file there is called `file`; `folder` is what the scene's
    /// paths are relative to.
    ///
    /// # Errors
    /// [`ReachError::NoTool`]; [`ReachError::Mesh`] when the blank's mesh file cannot be read.
    pub fn of_scene(
        scene: &Scene,
        folder: &Path,
        file: &str,
        name: &str,
    ) -> Result<Self, ReachError> {
        let of_file = |t: &&Tool| Path::new(&t.file).file_name().is_some_and(|f| f == file);
        let found = scene.tools.iter().find(|t| t.name == name);
        let found = found.or_else(|| scene.tools.iter().find(of_file));
        let tool = found.ok_or_else(|| ReachError::NoTool {
            file: file.into(),
            name: name.into(),
            allowed: scene.tools.iter().map(|t| t.name.as_str()).collect::<Vec<_>>().join(", "),
        })?;
        let travels = travels(scene);
        let whole: f64 = travels.values().sum();
        let around = blank_box(scene, folder)?;
        let thickness = match scene.blank.thickness_mm {
            given if given > 0.0 => given,
            // Hexahedra of a file: no thicker than their box.
            _ => around.max.z - around.min.z,
        };
        let along = Vec3::from(tool.direction).normalize();
        // The direction was checked with the scene: it has a frame.
        let frame = Frame::from_z_x(Vec3::zeros(), along, Vec3::x()).unwrap_or_else(Frame::world);
        let axes = [frame.x, frame.y, along];
        let (offset, touches) = match tool.place {
            Place::Touch => (Vec3::zeros(), true),
            Place::Shift(by) => (Vec3::from(by), false),
        };
        let corners = around.corners();
        let blank = axes.map(|axis| {
            let at = corners.iter().map(|p| (p - offset).dot(&axis));
            at.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)])
        });
        let size = (blank[0][1] - blank[0][0]).hypot(blank[1][1] - blank[1][0]);
        let across = |axis: &Vec3| -> f64 {
            let of = |t: &Tool| {
                let direction = Vec3::from(t.direction).normalize();
                travels.get(t.name.as_str()).map_or(0.0, |s| s * direction.dot(axis).abs())
            };
            scene.tools.iter().map(of).sum()
        };
        let rim = (RIM * size).max(2.0 * thickness);
        let follows = !travels.contains_key(tool.name.as_str());
        let known = !travels.is_empty() && scene.loads.is_empty();
        let own = if follows { whole } else { 0.0 };
        let depth = if known { whole + own + 2.0 * thickness } else { f64::INFINITY };
        Ok(Self { axes, blank, margin: [0, 1].map(|k| rim + across(&axes[k])), depth, touches })
    }

    /// Unit vector from the tool to the sheet.
    #[must_use]
    pub fn direction(&self) -> Vec3 {
        self.axes[2]
    }
}

/// How far each tool that is driven by travel goes from where it starts, and back [mm].
fn travels(scene: &Scene) -> BTreeMap<&str, f64> {
    let mut range: BTreeMap<&str, [f64; 3]> = BTreeMap::new();
    for stage in &scene.stages {
        for (name, drive) in &stage.drive {
            let [now, low, high] = range.get(name.as_str()).copied().unwrap_or_default();
            let to = match drive {
                Drive::TravelMm(to) => *to,
                Drive::AdvanceMm(by) => now + by,
                _ => continue,
            };
            range.insert(name, [to, low.min(to), high.max(to)]);
        }
    }
    range.into_iter().map(|(name, [_, low, high])| (name, high - low)).collect()
}

fn blank_box(scene: &Scene, folder: &Path) -> Result<Aabb, ReachError> {
    let blank = &scene.blank;
    let flat = match &blank.shape {
        BlankShape::Rectangle { corner_mm: [x, y], size_mm: [w, h], .. } => {
            Aabb { min: Vec3::new(*x, *y, 0.0), max: Vec3::new(x + w, y + h, 0.0) }
        }
        BlankShape::QuarterDisc { radius_mm: r, .. } => {
            Aabb { min: Vec3::zeros(), max: Vec3::new(*r, *r, 0.0) }
        }
        BlankShape::Mesh { file } => io::read_sheet(&folder.join(file))?.bbox(),
    };
    let low = Vec3::z() * blank.z_mm;
    let high = Vec3::z() * (blank.z_mm + blank.thickness_mm);
    Ok(Aabb { min: flat.min + low, max: flat.max + high })
}

/// A model without the faces that the sheet cannot touch.
#[derive(Debug, Clone)]
pub struct Reached {
    /// The faces within reach, numbered anew.
    pub model: Model,
    /// For each of them its number in the whole model.
    pub kept: Vec<usize>,
    /// Faces left out, and why.
    pub left_out: Vec<(usize, Why)>,
    /// The whole model looks away from the sheet and has to be turned round.
    pub turned: bool,
}

/// Splits `model` into what the sheet can touch and what it cannot. `side`: where the sheet is, if not where the tool
/// goes; `flip`: the model is turned round after that.
///
/// # Errors
/// [`ReachError::Nothing`] when no face is left.
pub fn within_reach(
    model: &Model,
    zone: &Zone,
    side: Option<Vec3>,
    flip: bool,
) -> Result<Reached, ReachError> {
    let coarse = MappedOptions { arc_divisions: 2, ..MappedOptions::default() };
    let mesh = mesh(model, &coarse).ok();
    let away = |m| super::looks_away(m, Some(side.unwrap_or(zone.direction())));
    let turned = mesh.as_ref().is_some_and(away) ^ flip;
    // Vertices lie on the tool: the foremost one over the blank is no farther ahead than the front is.
    let front = if zone.touches {
        let over = |p: &&Vec3| {
            (0..2).all(|k| (zone.blank[k][0]..=zone.blank[k][1]).contains(&p.dot(&zone.axes[k])))
        };
        let on_tool = mesh.iter().flat_map(|m| &m.vertices);
        on_tool.filter(over).map(|p| p.dot(&zone.axes[2])).fold(f64::NEG_INFINITY, f64::max)
    } else {
        zone.blank[2][0]
    };
    let near = 1e-6 * model.bbox().diagonal();
    let mut found = Reached { model: Model::default(), kept: vec![], left_out: vec![], turned };
    for (f, face) in model.faces.iter().enumerate() {
        match why_not(face, zone, front, turned, near) {
            Some(why) => found.left_out.push((f, why)),
            None => found.kept.push(f),
        }
    }
    if found.kept.is_empty() {
        return Err(ReachError::Nothing { faces: model.faces.len() });
    }
    found.model = subset(model, &found.kept);
    Ok(found)
}

fn why_not(face: &Face, zone: &Zone, front: f64, turned: bool, near: f64) -> Option<Why> {
    let corners = face.bbox().widened(near).corners();
    let extent = |k: usize| {
        let at = corners.iter().map(|p| p.dot(&zone.axes[k]));
        at.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)])
    };
    let beside = |k: usize| {
        let ([low, high], [a, b]) = (extent(k), zone.blank[k]);
        high < a - zone.margin[k] || low > b + zone.margin[k]
    };
    if beside(0) || beside(1) {
        Some(Why::Beside)
    } else if extent(2)[1] < front - zone.depth {
        Some(Why::Behind)
    } else if looks_away(face, &(zone.axes[2] * if turned { -1.0 } else { 1.0 })) {
        Some(Why::Away)
    } else {
        None
    }
}

/// True when every normal of the face's surface, over the box of its loops, looks away from `side`, by the angle
/// between neighbouring samples more than is asked.
fn looks_away(face: &Face, side: &Vec3) -> bool {
    const N: usize = 12;
    let [[u0, u1], [v0, v1]] = face.surface.domain();
    let at = |k: usize| {
        let (i, j) = ((k / (N + 1)) as f64 / N as f64, (k % (N + 1)) as f64 / N as f64);
        face.normal(Vec2::new(u0 + (u1 - u0) * i, v0 + (v1 - v0) * j))
    };
    let normals: Option<Vec<Vec3>> = (0..(N + 1) * (N + 1)).map(at).collect();
    // A surface without a normal somewhere (a pole) is kept.
    let Some(normals) = normals else { return false };
    let angle = |a: &Vec3, b: &Vec3| a.cross(b).norm().atan2(a.dot(b));
    let mut between: f64 = 0.0;
    for k in 0..normals.len() {
        for next in [k + 1, k + N + 1] {
            if next < normals.len() && (next != k + 1 || next % (N + 1) != 0) {
                between = between.max(angle(&normals[k], &normals[next]));
            }
        }
    }
    let limit = std::f64::consts::FRAC_PI_2 + AWAY_DEG.to_radians() + between;
    normals.iter().all(|n| angle(n, side) > limit)
}

/// The model of some faces; edges keep their numbers.
fn subset(model: &Model, kept: &[usize]) -> Model {
    let number: BTreeMap<usize, usize> = kept.iter().enumerate().map(|(k, &f)| (f, k)).collect();
    let mut out = model.clone();
    out.faces = kept.iter().map(|&f| model.faces[f].clone()).collect();
    for edge in &mut out.edges {
        let uses = edge.uses.iter();
        edge.uses = uses.filter_map(|u| Some([*number.get(&u[0])?, u[1], u[2]])).collect();
    }
    out
}

impl Reached {
    /// Gives a tool made from `model` the face numbers of the whole model.
    pub fn renumber(&self, tool: &mut ToolModel) {
        let whole = |face: &mut u32| *face = self.kept[*face as usize] as u32;
        tool.faces.iter_mut().for_each(whole);
        tool.corners.iter_mut().for_each(|c| whole(&mut c.face));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::types::Scene;

    fn read(file: &str) -> Model {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(file);
        crate::cad::read(&path).unwrap().0
    }

    fn scene(change: impl Fn(&mut serde_json::Value)) -> Scene {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/cross/demo.scene.json");
        let mut value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
        change(&mut value);
        serde_json::from_value(value).unwrap()
    }

    fn zone(scene: &Scene, tool: &str) -> Zone {
        Zone::of_scene(scene, Path::new(""), "", tool).unwrap()
    }

    fn counts(model: &Model, zone: &Zone) -> [usize; 4] {
        let found = within_reach(model, zone, None, false).unwrap();
        let of = |why| found.left_out.iter().filter(|l| l.1 == why).count();
        [found.kept.len(), of(Why::Beside), of(Why::Behind), of(Why::Away)]
    }

    /// The whole die in a scene of one quarter: of the other three quarters only what the rim of the sheet may meet
    /// at the symmetry planes is left.
    #[test]
    fn faces_beside_a_quarter_of_the_sheet_are_left_out() {
        let model = read("forming/cross_die_full_144.igs");
        let found = within_reach(&model, &zone(&scene(|_| {}), "die"), None, false).unwrap();
        println!("{} kept, {:?}", found.kept.len(), found.left_out);
        assert!(found.left_out.iter().any(|l| l.1 == Why::Beside));
        for (f, face) in model.faces.iter().enumerate() {
            let b = face.bbox();
            // Twice the thickness is 1.6 mm, a twentieth of the quarter's diagonal 8.8 mm.
            let meets = b.max.x >= -8.0 && b.max.y >= -8.0;
            let beside = b.max.x < -9.0 || b.max.y < -9.0;
            assert!(!meets || found.kept.contains(&f), "face {f} {b:?}");
            assert!(!beside || found.left_out.contains(&(f, Why::Beside)), "face {f} {b:?}");
        }
        for f in 0..found.model.faces.len() {
            let uses = found.model.edges.iter().flat_map(|e| &e.uses).filter(|u| u[0] == f);
            let own: usize = model.faces[found.kept[f]].loops.iter().map(|l| l.uses.len()).sum();
            assert_eq!(uses.count(), own);
        }
    }

    #[test]
    fn depth_is_what_tools_travel_and_nothing_when_that_is_unknown() {
        let model = read("cross/die.igs");
        let depth = |change: &dyn Fn(&mut serde_json::Value)| zone(&scene(change), "die").depth;
        // 20 mm of the punch; the die stands, and follows as much for all the scene says.
        assert!((depth(&|_| {}) - 41.6).abs() < 1e-12);
        let unknown = |s: &mut serde_json::Value| {
            s["stages"][1]["drive"] = serde_json::json!({"punch": {"force_n": 10.0}});
        };
        assert_eq!(depth(&unknown), f64::INFINITY);
        // Drawn to 1 mm nothing goes down to the bottom edge of the die's wall.
        let shallow = scene(|s| {
            s["stages"][1]["drive"] = serde_json::json!({"punch": {"travel_mm": 1.0}});
        });
        let [kept, _, behind, _] = counts(&model, &zone(&shallow, "die"));
        let front = model.bbox().max.z;
        let low = model.faces.iter().filter(|f| f.bbox().max.z < front - 3.6 - 1e-3).count();
        println!("{kept} kept, {behind} behind, {low} low");
        assert_eq!(behind, low);
        assert_eq!(counts(&model, &zone(&scene(unknown), "die"))[2], 0);
    }

    /// A closed block as a punch: its back and nothing else looks away; sides stay.
    #[test]
    fn the_back_of_a_block_is_left_out() {
        let model = read("forming/cylinder_AP214.stp");
        let b = model.bbox();
        let wide = scene(|s| {
            let size = [b.max.x - b.min.x, b.max.y - b.min.y];
            let corner = [b.min.x, b.min.y];
            s["blank"]["shape"] = serde_json::json!({
                "rectangle": {"corner_mm": corner, "size_mm": size, "elements": [2, 2]}
            });
            s["stages"][1]["drive"] = serde_json::json!({"punch": {"force_n": 10.0}});
        });
        let found = within_reach(&model, &zone(&wide, "punch"), None, false).unwrap();
        println!("{:?} of {}", found.left_out, model.faces.len());
        for (f, why) in &found.left_out {
            let face = model.faces[*f].bbox();
            assert_eq!(*why, Why::Away);
            assert!(face.min.z > b.max.z - 1e-6, "the back of a punch that goes down is its top");
        }
    }

    #[test]
    fn a_tool_the_scene_does_not_have_is_refused() {
        let said = Zone::of_scene(&scene(|_| {}), Path::new(""), "dye.tool.json", "dye");
        let said = said.unwrap_err().to_string();
        assert!(said.contains("'dye.tool.json'") && said.contains("die, holder, punch"), "{said}");
        // By the file's name.
        Zone::of_scene(&scene(|_| {}), Path::new(""), "punch.tool.json", "p").unwrap();
        let far = scene(|s| {
            s["blank"]["shape"]["rectangle"]["corner_mm"] = serde_json::json!([5000.0, 0.0]);
        });
        let nothing = within_reach(&read("cross/die.igs"), &zone(&far, "die"), None, false);
        assert!(matches!(nothing, Err(ReachError::Nothing { faces: 15 })));
    }
}
