//! One face judged alone: its patches for given divisions of its edges, audited. Answers are kept.

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use rustc_hash::FxHashMap;

use crate::audit::{AuditOptions, CadReference, audit};
use crate::convert::{ConvertOptions, convert};
use crate::geometry::Vec3;
use crate::mesh::SurfaceMesh;
use crate::mesh::mapped::plan::{Divisions, Plan};

/// What the audit of a face's patches says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Figures {
    /// Patches.
    pub patches: usize,
    /// Largest |shape error| [mm]; infinite when the face cannot be meshed so.
    pub error_mm: f64,
    /// Largest normal error [degrees]; infinite when the face cannot be meshed so.
    pub normal_deg: f64,
    /// Where the error is largest, if there are patches.
    pub worst: Option<Vec3>,
}

const NONE: Figures =
    Figures { patches: 0, error_mm: f64::INFINITY, normal_deg: f64::INFINITY, worst: None };

/// Divisions of the face's edges in loop order, density, mapped.
type Key = (usize, Vec<usize>, usize, bool);

/// Judges faces.
pub(super) struct Judge<'a> {
    plan: &'a Plan<'a>,
    reference: &'a CadReference<'a>,
    options: ConvertOptions,
    known: Mutex<FxHashMap<Key, Figures>>,
    /// Patches made so far: work done, the same for any number of threads.
    spent: AtomicU64,
}

impl<'a> Judge<'a> {
    pub fn new(
        plan: &'a Plan<'a>,
        reference: &'a CadReference<'a>,
        options: &ConvertOptions,
    ) -> Self {
        let options = ConvertOptions { sheet_side: None, flip: false, ..options.clone() };
        Self { plan, reference, options, known: Mutex::default(), spent: AtomicU64::new(0) }
    }

    /// Figures of face `f`.
    pub fn of(&self, f: usize, divisions: &Divisions, density: usize) -> Figures {
        let face = &self.plan.model().faces[f];
        let edges = face.loops.iter().flat_map(|l| &l.uses).filter_map(|u| u.edge);
        let key: Key =
            (f, edges.map(|e| divisions.counts[e]).collect(), density, divisions.mapped[f]);
        let known = |k: &Key| self.known.lock().ok()?.get(k).copied();
        if let Some(found) = known(&key) {
            return found;
        }
        let mesh = self.plan.face(f, divisions, density).ok();
        let work = mesh.as_ref().map_or(0, |mesh| mesh.elements.len());
        let found = mesh.and_then(|mesh| self.judge(&mesh)).unwrap_or(NONE);
        if let Ok(mut known) = self.known.lock()
            && known.insert(key, found).is_none()
        {
            self.spent.fetch_add(1 + work as u64, Ordering::Relaxed);
        }
        found
    }

    /// Work done so far, in patches made.
    pub fn spent(&self) -> u64 {
        self.spent.load(Ordering::Relaxed)
    }

    /// Figures of one face's mesh; none when its patches fold or cannot be made.
    fn judge(&self, mesh: &SurfaceMesh) -> Option<Figures> {
        let (tool, made) = convert(self.plan.model(), mesh, &self.options).ok()?;
        if !made.folded.is_empty() {
            return None;
        }
        let options = AuditOptions { samples: 4, refine: 4, ..AuditOptions::default() };
        let report = audit(&tool, self.reference, &options).ok()?.report;
        if !report.folded.is_empty() {
            return None;
        }
        Some(Figures {
            patches: tool.patches.len(),
            error_mm: report.worst_mm(),
            normal_deg: report.normal_max_deg,
            worst: report.worst.first().map(|w| w.point.into()),
        })
    }
}
