//! Region that the sheet of a scene can occupy, relative to one tool.

use std::collections::BTreeMap;
use std::path::Path;

use crate::ReachError;
use kanagata_geometry::frame::Frame;
use kanagata_geometry::{Aabb, Vec3};
use kanagata_mesh::io;
use kanagata_scene::types::{BlankShape, Drive, Place, Scene, Tool};

/// Allowance for the growth of the blank at its rim, over the diagonal of its projection.
const RIM_GROWTH_RATIO: f64 = 0.05;

/// Region that the sheet can occupy during a run, relative to one tool.
#[derive(Debug, Clone, PartialEq)]
pub struct Zone {
    /// Unit vectors: two across the tool direction, the third along it.
    pub(super) axes: [Vec3; 3],
    /// Minimum and maximum of the undeformed blank along the axes, in the tool frame [mm].
    pub(super) blank: [[f64; 2]; 3],
    /// Maximum distance of the sheet beside the blank along the first two axes [mm].
    pub(super) margin: [f64; 2],
    /// Maximum distance of the sheet behind the tool front [mm]; infinite when unknown.
    pub(super) depth: f64,
    /// True when the tool is placed by moving it along its direction until it touches the blank.
    pub(super) touches: bool,
    /// True when a tool or a load acts across the tool direction. It may press the sheet against faces that point away.
    pub(super) pressed_across: bool,
}

impl Zone {
    /// Zone of the tool with the name `name` in the scene, or else with the file name `file`. Paths in the scene are
    /// relative to `folder`.
    ///
    /// # Errors
    /// [`ReachError::NoTool`]; [`ReachError::Mesh`] when the mesh file of the blank cannot be read.
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
        let around = blank_box(scene, folder)?;
        let thickness = match scene.blank.thickness_mm {
            given if given > 0.0 => given,
            // Hexahedra from a file: the height of their box is an upper bound.
            _ => around.max.z - around.min.z,
        };
        Ok(Self::of_tool(scene, tool, &around, thickness))
    }

    /// Zone of `tool` for a blank within the box `around`.
    fn of_tool(scene: &Scene, tool: &Tool, around: &Aabb, thickness: f64) -> Self {
        let along = Vec3::from(tool.direction).normalize();
        // The direction is not zero (checked with the scene), so that a frame exists.
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
        let travels = travels(scene);
        let across = |axis: &Vec3| -> f64 {
            let of = |t: &Tool| {
                let direction = Vec3::from(t.direction).normalize();
                travels.get(t.name.as_str()).map_or(0.0, |s| s * direction.dot(axis).abs())
            };
            scene.tools.iter().map(of).sum()
        };
        let rim = (RIM_GROWTH_RATIO * size).max(2.0 * thickness);
        let whole: f64 = travels.values().sum();
        let follows = !travels.contains_key(tool.name.as_str());
        let known = !travels.is_empty() && scene.loads.is_empty();
        let own = if follows { whole } else { 0.0 };
        let depth = if known { whole + own + 2.0 * thickness } else { f64::INFINITY };
        let margin = [0, 1].map(|k| rim + across(&axes[k]));
        let pressed_across = pressed_across(scene, &along);
        Self { axes, blank, margin, depth, touches, pressed_across }
    }

    /// Unit vector from the tool to the sheet.
    #[must_use]
    pub fn direction(&self) -> Vec3 {
        self.axes[2]
    }
}

/// True when a driven tool or a load of the scene acts at an angle to `direction`.
fn pressed_across(scene: &Scene, direction: &Vec3) -> bool {
    /// Sine of the angle up to which a motion or load counts as parallel.
    const PARALLEL_SINE_MAX: f64 = 0.01;
    let moves = |t: &&Tool| {
        let drives = scene.stages.iter().filter_map(|stage| stage.drive.get(&t.name));
        drives.into_iter().any(|d| !matches!(d, Drive::Release(_) | Drive::Absent(_)))
    };
    let tools = scene.tools.iter().filter(moves).map(|t| Vec3::from(t.direction));
    let loads = scene.loads.iter().map(|load| Vec3::from(load.force_n));
    tools.chain(loads).any(|v| v.cross(direction).norm() > PARALLEL_SINE_MAX * v.norm())
}

/// Range of the travel of each travel-driven tool over all stages, maximum minus minimum [mm].
fn travels(scene: &Scene) -> BTreeMap<&str, f64> {
    let mut range: BTreeMap<&str, [f64; 3]> = BTreeMap::new();
    for stage in &scene.stages {
        for (name, drive) in &stage.drive {
            let [now, low, high] = range.get(name.as_str()).copied().unwrap_or_default();
            let (course, from) = match drive {
                Drive::TravelMm(to) => (to, 0.0),
                Drive::AdvanceMm(by) => (by, now),
                _ => continue,
            };
            let values = || course.pairs().into_iter().map(move |[_, value]| from + value);
            let [low, high] = [values().fold(low, f64::min), values().fold(high, f64::max)];
            range.insert(name, [from + course.end(), low, high]);
        }
    }
    range.into_iter().map(|(name, [_, low, high])| (name, high - low)).collect()
}

/// Bounding box of the undeformed blank, over its thickness [mm].
///
/// # Errors
/// [`ReachError::Mesh`] when its mesh file cannot be read.
fn blank_box(scene: &Scene, folder: &Path) -> Result<Aabb, ReachError> {
    let blank = &scene.blank;
    let flat = match &blank.shape {
        BlankShape::Rectangle { corner_mm: [x, y], size_mm: [w, h], .. } => {
            Aabb { min: Vec3::new(*x, *y, 0.0), max: Vec3::new(x + w, y + h, 0.0) }
        }
        BlankShape::QuarterDisc { radius_mm: r, .. } => {
            Aabb { min: Vec3::zeros(), max: Vec3::new(*r, *r, 0.0) }
        }
        BlankShape::Disc { radius_mm: r, .. } => {
            Aabb { min: Vec3::new(-r, -r, 0.0), max: Vec3::new(*r, *r, 0.0) }
        }
        BlankShape::Mesh { file, .. } => io::read_sheet(&folder.join(file))?.bbox(),
    };
    let low = Vec3::z() * blank.z_mm;
    let high = Vec3::z() * (blank.z_mm + blank.thickness_mm);
    Ok(Aabb { min: flat.min + low, max: flat.max + high })
}
