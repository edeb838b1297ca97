//! State shared by the entity readers: file, placements, caches.

use std::cell::{OnceCell, RefCell};
use std::rc::Rc;

use rustc_hash::FxHashMap;

use super::file::{Fault, File};
use super::marks::Marks;
use kanagata_geometry::{Affine, Mat3, Vec3};

/// Maximum pointer depth of one kind. Doubled: no valid file is affected.
pub(super) const POINTER_DEPTH_MAX: usize = 24;

/// One edge of an edge list (504).
#[derive(Debug, Clone, Copy)]
pub(super) struct ListedEdge {
    /// Curve entity.
    pub curve: usize,
    /// Vertex list and number (from 1) of start and end.
    pub ends: [(usize, usize); 2],
}

/// Reads entities on demand.
pub(super) struct Reader<'f, 'a> {
    /// The file.
    pub file: &'f File<'a>,
    /// Matrices by entity.
    placements: RefCell<FxHashMap<u32, Affine>>,
    /// Vertex lists (502) by entity.
    pub vertices: RefCell<FxHashMap<usize, Rc<[Vec3]>>>,
    /// Edge lists (504) by entity.
    pub edges: RefCell<FxHashMap<usize, Rc<[ListedEdge]>>>,
    /// Names, levels and groups, read on first use.
    pub marks: OnceCell<Marks>,
}

impl<'f, 'a> Reader<'f, 'a> {
    /// A reader of `file`.
    pub fn new(file: &'f File<'a>) -> Self {
        Self {
            file,
            placements: RefCell::default(),
            vertices: RefCell::default(),
            edges: RefCell::default(),
            marks: OnceCell::new(),
        }
    }

    /// Placement of an entity in file units: the matrix of field 7, composed with the matrices it refers to.
    pub fn placement(&self, entity: usize) -> Result<Affine, Fault> {
        self.placement_by(entity, self.file.entry(entity).transform)
    }

    /// `map` composed with the entity's own placement.
    pub fn placed(&self, entity: usize, map: &Affine) -> Result<Affine, Fault> {
        if self.file.entry(entity).transform == 0 {
            return Ok(*map);
        }
        Ok(map.after(&self.placement(entity)?))
    }

    fn placement_by(&self, entity: usize, pointer: u32) -> Result<Affine, Fault> {
        if pointer == 0 {
            return Ok(Affine::identity());
        }
        if let Some(known) = self.placements.borrow().get(&pointer) {
            return Ok(*known);
        }
        let mut total = Affine::identity();
        let mut next = pointer;
        for _ in 0..POINTER_DEPTH_MAX {
            if next == 0 {
                self.placements.borrow_mut().insert(pointer, total);
                return Ok(total);
            }
            let matrix = self.matrix_entity(entity, next)?;
            total = self.matrix(matrix)?.after(&total);
            next = self.file.entry(matrix).transform;
        }
        Err(self.file.fault(
            entity,
            "matrix-chain",
            format!("the matrices from D{pointer} on are cyclic"),
            format!("a chain of at most {POINTER_DEPTH_MAX} matrices (124) that ends"),
        ))
    }

    fn matrix_entity(&self, entity: usize, pointer: u32) -> Result<usize, Fault> {
        self.file
            .directory
            .find(i64::from(pointer))
            .filter(|m| self.file.entry(*m).kind == 124)
            .ok_or_else(|| {
                self.file.fault(
                    entity,
                    "matrix-missing",
                    format!("directory field 7 points to D{pointer}, which is not a matrix"),
                    "0 or a transformation matrix (124)",
                )
            })
    }

    /// Matrix of a transformation (124): R11 R12 R13 T1, R21 ..., R31 ...
    pub fn matrix(&self, entity: usize) -> Result<Affine, Fault> {
        let mut p = self.file.params(entity)?;
        let mut row = || -> Result<[f64; 4], Fault> {
            Ok([p.real("matrix")?, p.real("matrix")?, p.real("matrix")?, p.real("matrix")?])
        };
        let rows = [row()?, row()?, row()?];
        let linear = Mat3::from_fn(|i, j| rows[i][j]);
        let shift = Vec3::new(rows[0][3], rows[1][3], rows[2][3]);
        let (size, volume) = (linear.norm(), linear.determinant().abs());
        let regular =
            volume >= 1e-9 * size.powi(3) && volume.is_finite() && shift.norm().is_finite();
        if !regular {
            return Err(self.file.fault(
                entity,
                "matrix-singular",
                "the matrix is singular",
                "a rotation (form 0) or reflection (form 1)",
            ));
        }
        Ok(Affine { linear, shift })
    }

    /// Coordinates of a point entity (116).
    pub fn point(&self, entity: usize, map: &Affine) -> Result<Vec3, Fault> {
        self.expect_kind(entity, &[116], "a point (116)")?;
        let mut p = self.file.params(entity)?;
        let point = p.vec3("coordinate")?;
        Ok(self.placed(entity, map)?.point(&point))
    }

    /// Components of a direction entity (123), non-zero.
    pub fn direction(&self, entity: usize, map: &Affine) -> Result<Vec3, Fault> {
        self.expect_kind(entity, &[123], "a direction (123)")?;
        let mut p = self.file.params(entity)?;
        let vector = p.vec3("component")?;
        if vector.norm() == 0.0 {
            return Err(p.fault("direction 0, 0, 0", "a vector that is not zero"));
        }
        Ok(self.placed(entity, map)?.vector(&vector))
    }

    /// Fails unless the entity has one of these types.
    pub fn expect_kind(&self, entity: usize, kinds: &[u32], allowed: &str) -> Result<(), Fault> {
        let kind = self.file.entry(entity).kind;
        if kinds.contains(&kind) {
            return Ok(());
        }
        Err(self.file.fault(entity, "wrong-entity", format!("entity {kind}"), allowed))
    }
}

/// Scale of a similarity (rotation, reflection, uniform scale); `None` for any other map.
pub(super) fn similarity(map: &Affine) -> Option<f64> {
    let gram = map.linear.transpose() * map.linear;
    let square = gram.trace() / 3.0;
    let off = (gram - Mat3::identity() * square).norm();
    (square > 0.0 && off <= 1e-6 * square).then(|| square.sqrt())
}

/// True for an orientation-reversing map.
pub(super) fn mirrors(map: &Affine) -> bool {
    map.linear.determinant() < 0.0
}
