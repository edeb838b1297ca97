//! State shared by the entity readers: table, work budget, units, placements.

use std::cell::{Cell, OnceCell, RefCell};
use std::rc::Rc;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::entity::{Attributes, Entity, Fault, Outcome};
use super::styles::Styles;
use super::table::Table;
use crate::attributes::{self, Style, name};
use crate::{Diagnostic, Severity};
use kanagata_geometry::frame::unit;
use kanagata_geometry::nurbs::Curve3;
use kanagata_geometry::{Affine, Frame, Mat3, Vec3};

/// Maximum nesting depth of references. Doubled: no valid file is affected.
pub const REFERENCE_DEPTH_MAX: usize = 200;

/// Cost of a message about a fault, in steps: some bytes of memory per step.
const MESSAGE_COST: u64 = 64;

const MULTIPLIED_TEXT: &str = "self-multiplying references";
const PROPORTION_TEXT: &str = "geometry in proportion to the size of the file";

/// Units of a representation context.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Units {
    /// Millimetres in one unit of length.
    pub length: f64,
    /// Radians in one unit of plane angle.
    pub angle: f64,
}

/// An edge, directed from its first to its second vertex.
#[derive(Debug)]
pub struct EdgeGeometry {
    /// Space curve; `None` for an edge that degenerates to a point.
    pub curve: Option<Curve3>,
    /// Vertices [mm].
    pub ends: [Vec3; 2],
    /// Instance of the curve, which lists the parameter curves.
    pub geometry: u32,
    /// Parameters on the basis curve, in its direction.
    pub range: Option<[f64; 2]>,
    /// The edge has the direction of its curve.
    pub same_sense: bool,
}

/// Shared state of the entity readers.
pub struct Resolver<'t> {
    /// The file.
    pub table: &'t Table<'t>,
    /// Remaining work, in steps; when exhausted the file is rejected as self-multiplying.
    steps_left: Cell<u64>,
    /// Diagnostics of the reader.
    pub diagnostics: RefCell<Vec<Diagnostic>>,
    /// Edges already trimmed, by instance and unit of length.
    pub edges: RefCell<FxHashMap<(u32, u64), Rc<EdgeGeometry>>>,
    /// Edges of poly loops, by the instances of their ends.
    pub poly_edges: RefCell<FxHashMap<[u32; 2], usize>>,
    /// Colours and layers, read on first use.
    styles: OnceCell<Styles>,
}

impl<'t> Resolver<'t> {
    /// A resolver for the file, with work limited in proportion to its size.
    #[must_use]
    pub fn new(table: &'t Table<'t>, bytes: usize) -> Self {
        Self {
            table,
            steps_left: Cell::new(1_000_000 + 40 * bytes as u64),
            diagnostics: RefCell::default(),
            edges: RefCell::default(),
            poly_edges: RefCell::default(),
            styles: OnceCell::new(),
        }
    }

    /// Layers and colour of an item.
    pub(crate) fn style(&self, item: Entity) -> Style {
        self.styles.get_or_init(|| Styles::of(self.entities())).style(item)
    }

    /// Name, layers and colour of a face; its body is not known yet.
    pub fn attributes_of_face(&self, e: Entity<'t>) -> Arc<attributes::Attributes> {
        let Style { layers, colour } = self.style(e);
        Arc::new(attributes::Attributes {
            body: 0,
            name: name(&e.attributes().text(0)),
            layers,
            colour,
        })
    }

    /// The instance at `index`.
    #[must_use]
    pub fn entity(&self, index: u32) -> Entity<'t> {
        Entity { table: self.table, index }
    }

    /// All instances.
    pub fn entities(&self) -> impl Iterator<Item = Entity<'t>> {
        let table = self.table;
        (0..table.len() as u32).map(move |index| Entity { table, index })
    }

    /// Records a diagnostic.
    pub fn note(&self, severity: Severity, code: &'static str, place: String, text: String) {
        self.diagnostics.borrow_mut().push(Diagnostic { severity, code, place, text });
    }

    /// Charges one step for `entity` at `depth`, and `amount` created values.
    ///
    /// # Errors
    /// References nested deeper than [`REFERENCE_DEPTH_MAX`] (a cycle), or the work budget is exhausted.
    pub fn charge(&self, entity: Entity, depth: usize, amount: usize) -> Outcome<()> {
        if depth > REFERENCE_DEPTH_MAX {
            let allowed = format!("at most {REFERENCE_DEPTH_MAX} nested entities, no cycles");
            return Err(entity.fault("cyclic or too deeply nested references", allowed));
        }
        if self.try_charge(1 + amount as u64) {
            return Ok(());
        }
        let mut fault = entity.fault(MULTIPLIED_TEXT, PROPORTION_TEXT);
        fault.fatal = true;
        Err(fault)
    }

    /// The fault, after charging the cost of its message.
    ///
    /// # Errors
    /// The work budget is exhausted: cyclic references on several paths produce too many messages.
    pub fn charged(&self, mut fault: Box<Fault>) -> Outcome<Box<Fault>> {
        if self.try_charge(MESSAGE_COST) {
            return Ok(fault);
        }
        (fault.found, fault.allowed, fault.fatal) =
            (MULTIPLIED_TEXT.into(), PROPORTION_TEXT.into(), true);
        Err(fault)
    }

    fn try_charge(&self, amount: u64) -> bool {
        let left = self.steps_left.get().checked_sub(amount);
        left.inspect(|left| self.steps_left.set(*left)).is_some()
    }

    /// `CARTESIAN_POINT` in mm; a planar point has z = 0.
    pub fn point(&self, e: Entity, units: Units) -> Outcome<Vec3> {
        if e.kind() != "CARTESIAN_POINT" {
            return Err(e.fault(format!("a {} as a point", e.kind()), "CARTESIAN_POINT"));
        }
        let p = coordinates(&e.attributes(), 1)? * units.length;
        if p.norm().is_finite() {
            return Ok(p);
        }
        Err(e.fault("coordinates too large", "numbers below 1e150"))
    }

    /// `DIRECTION` as a unit vector.
    pub fn direction(&self, e: Entity) -> Outcome<Vec3> {
        if e.kind() != "DIRECTION" {
            return Err(e.fault(format!("a {} as a direction", e.kind()), "DIRECTION"));
        }
        let d = coordinates(&e.attributes(), 1)?;
        unit(d).ok_or_else(|| e.fault("direction ratios of length 0", "a vector of some length"))
    }

    /// `VECTOR`: direction times magnitude, in mm.
    pub fn vector(&self, e: Entity, units: Units) -> Outcome<Vec3> {
        if e.kind() == "DIRECTION" {
            return self.direction(e);
        }
        if e.kind() != "VECTOR" {
            return Err(e.fault(format!("a {} as a vector", e.kind()), "VECTOR"));
        }
        let a = e.attributes();
        let v = self.direction(a.entity(1)?)? * (a.real(2)? * units.length);
        if v.norm() > 0.0 && v.norm().is_finite() {
            return Ok(v);
        }
        Err(e.fault(format!("magnitude {}", a.real(2)?), "a magnitude above 0"))
    }

    /// `AXIS2_PLACEMENT_3D` or `_2D`: location, axis z (3D only), direction of x.
    pub fn frame(&self, e: Entity, units: Units) -> Outcome<Frame> {
        let a = e.attributes();
        let (z, x) = match e.kind() {
            "AXIS2_PLACEMENT_3D" => (a.maybe_entity(2)?, a.maybe_entity(3)?),
            "AXIS2_PLACEMENT_2D" => (None, a.maybe_entity(2)?),
            "AXIS1_PLACEMENT" => (a.maybe_entity(2)?, None),
            kind => return Err(e.fault(format!("a {kind} as a placement"), "AXIS2_PLACEMENT_3D")),
        };
        let origin = self.point(a.entity(1)?, units)?;
        let z = z.map_or(Ok(Vec3::z()), |z| self.direction(z))?;
        let x = x.map_or(Ok(Vec3::x()), |x| self.direction(x))?;
        Frame::from_z_x(origin, z, x)
            .ok_or_else(|| e.fault("axes that span no frame", "two independent directions"))
    }

    /// `CARTESIAN_TRANSFORMATION_OPERATOR_3D(names, axis 1, axis 2, local origin, scale, axis 3)`.
    pub fn operator(&self, e: Entity, units: Units) -> Outcome<Affine> {
        let a = e.attributes();
        // The number of inherited names depends on the writer: the last five attributes are axis 1, axis 2, local
        // origin, scale, axis 3.
        let first = a.len().saturating_sub(5);
        let axis = |k: usize| -> Outcome<Option<Vec3>> {
            a.maybe_entity(first + k)?.map(|d| self.direction(d)).transpose()
        };
        let shift = self.point(a.entity(first + 2)?, units)?;
        let scale = match a.get(first + 3) {
            super::table::Value::Missing | super::table::Value::Derived => 1.0,
            _ => a.real(first + 3)?,
        };
        if !(scale.is_finite() && scale > 0.0) {
            return Err(e.fault(format!("scale {scale}"), "a scale above 0"));
        }
        let z = axis(4)?.unwrap_or_else(Vec3::z);
        let frame = Frame::from_z_x(shift, z, axis(0)?.unwrap_or_else(Vec3::x));
        let frame = frame.ok_or_else(|| e.fault("axes that span no frame", "three axes"))?;
        // A second axis opposite to z x x is a reflection.
        let y = match axis(1)? {
            Some(y) if y.dot(&frame.y) < 0.0 => -frame.y,
            _ => frame.y,
        };
        Ok(Affine { linear: Mat3::from_columns(&[frame.x, y, frame.z]) * scale, shift })
    }
}

fn coordinates(a: &Attributes, k: usize) -> Outcome<Vec3> {
    let values = a.reals(k)?;
    let at = |k: usize| values.get(k).copied().unwrap_or(0.0);
    Ok(Vec3::new(at(0), at(1), at(2)))
}
