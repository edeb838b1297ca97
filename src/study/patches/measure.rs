//! One model of a method: conversion, audit, and timing of closest-point queries.

use std::fmt;
use std::time::Instant;

use super::{Edges, Method, PatchStudy, Queries};
use kanagata_audit::{AuditOptions, CadReference, audit};
use kanagata_cad::Model;
use kanagata_contact::ToolSurface;
use kanagata_convert::bezier::{BezierOptions, FINEST, within_tolerance};
use kanagata_convert::tolerance::{Borders, Goal, to_tolerance};
use kanagata_convert::{ConvertOptions, convert};
use kanagata_geometry::Vec3;
use kanagata_mesh::mapped::{self, MappedOptions};
use kanagata_mesh::{MeshError, SurfaceMesh};
use kanagata_progress::Progress;
use kanagata_tool::edge::EdgeRule;
use kanagata_tool::{ToolKind, ToolModel};

/// Requested fineness of a model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Size {
    /// Divisions of 90 degrees.
    Divisions(usize),
    /// Largest |shape error| [mm].
    Tolerance(f64),
}

/// Result of one size of a method.
#[derive(Debug, Clone)]
pub(super) struct Row<'a> {
    pub method: &'a Method,
    pub size: Size,
    /// `None` if there is no model.
    pub figures: Option<Figures>,
    /// Why there is no model or the model is unusable; empty otherwise.
    pub reason: String,
}

/// Measured figures of a model. Times are processor seconds of one thread of this machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Figures {
    pub patches: usize,
    /// Largest |shape error| (Eq. 24) [mm].
    pub error_mm: f64,
    /// RMS of the shape error over the area [mm].
    pub rms_mm: f64,
    /// Largest normal error [degrees].
    pub normal_deg: f64,
    /// Conversion time from the CAD model in memory [s].
    pub convert_s: f64,
    /// Time to build the search tree [s].
    pub index_s: f64,
    /// Time of a closest-point query without a starting guess [us].
    pub query_us: f64,
}

impl Row<'_> {
    /// The figures of a usable model.
    pub fn sound(&self) -> Option<&Figures> {
        self.figures.as_ref().filter(|_| self.reason.is_empty())
    }
}

impl fmt::Display for Row<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.size {
            Size::Divisions(n) => write!(f, "{}, {n} divisions:", self.method.name)?,
            Size::Tolerance(t) => write!(f, "{}, {t} mm:", self.method.name)?,
        }
        if let Some(Figures { patches, error_mm, normal_deg, .. }) = self.figures {
            write!(f, " {patches} patches, {error_mm:.2e} mm, {normal_deg:.3} degrees")?;
        }
        if !self.reason.is_empty() {
            write!(f, " {}", self.reason)?;
        }
        Ok(())
    }
}

/// Data common to all models.
pub(super) struct Bench<'a> {
    model: &'a Model,
    reference: CadReference<'a>,
    points: Vec<Vec3>,
    sheet_side: Option<Vec3>,
    /// A pool of one thread for timed work; `None` if it cannot be created: the caller's thread is used.
    single_thread: Option<rayon::ThreadPool>,
}

impl<'a> Bench<'a> {
    /// # Errors
    /// [`MeshError`] when the CAD cannot be meshed; the query points are sampled on its elements.
    pub fn new(study: &PatchStudy, model: &'a Model) -> Result<Self, MeshError> {
        const DIVISIONS: usize = 8;
        let options = MappedOptions { arc_divisions: DIVISIONS, ..MappedOptions::default() };
        Ok(Self {
            model,
            reference: CadReference::new(model),
            points: points_near(&mapped::mesh(model, &options)?, &study.queries),
            sheet_side: study.sheet_side.map(Vec3::from),
            single_thread: rayon::ThreadPoolBuilder::new().num_threads(1).build().ok(),
        })
    }

    /// Makes and measures a model.
    pub fn row<'m>(&self, method: &'m Method, size: Size) -> Row<'m> {
        let (built, convert_s) = self.timed(|| self.build_model(method, size));
        let (figures, reason) = match built {
            Err(reason) => (None, reason),
            Ok((tool, folded)) => match self.figures(&tool, convert_s) {
                Ok(figures) if folded == 0 => (Some(figures), String::new()),
                Ok(figures) => (Some(figures), format!("{folded} patches fold")),
                Err(reason) => (None, reason),
            },
        };
        Row { method, size, figures, reason }
    }

    /// A model and the number of its folded patches.
    fn build_model(&self, method: &Method, size: Size) -> Result<(ToolModel, usize), String> {
        let mesh = MappedOptions {
            style: method.style,
            through_cad: method.edges() == Edges::Cad,
            ..MappedOptions::default()
        };
        let options = ConvertOptions {
            name: method.name.clone(),
            kind: method.kind,
            edges: match method.edges() {
                Edges::Plain => EdgeRule::Plain,
                Edges::Guarded | Edges::Cad => EdgeRule::Guarded,
            },
            through_cad: method.edges() == Edges::Cad,
            sheet_side: self.sheet_side,
            ..ConvertOptions::default()
        };
        match size {
            Size::Tolerance(tol_mm) if method.kind == ToolKind::Bezier => {
                self.bezier(&mesh, &options, tol_mm)
            }
            Size::Tolerance(tol_mm) => {
                let two_sided = !method.on_cad;
                let borders =
                    if method.independent { Borders::Independent } else { Borders::Conforming };
                let goal = Goal { tol_mm, normal_deg: f64::INFINITY, two_sided, borders };
                let found = to_tolerance(self.model, &mesh, &options, &goal);
                found.map(|r| (r.tool, r.report.folded.len())).map_err(|e| e.to_string())
            }
            Size::Divisions(arc_divisions) => {
                let options_here = MappedOptions { arc_divisions, ..mesh };
                let mesh = mapped::mesh(self.model, &options_here).map_err(|e| e.to_string())?;
                let found = convert(self.model, &mesh, &options);
                found.map(|(tool, r)| (tool, r.folded.len())).map_err(|e| e.to_string())
            }
        }
    }

    fn bezier(
        &self,
        mesh: &MappedOptions,
        options: &ConvertOptions,
        tolerance_mm: f64,
    ) -> Result<(ToolModel, usize), String> {
        let options = BezierOptions {
            name: options.name.clone(),
            tolerance_mm,
            sheet_side: options.sheet_side,
            flip: options.flip,
            progress: Progress::default(),
        };
        let mesh_of = |n| mapped::mesh(self.model, &MappedOptions { arc_divisions: n, ..*mesh });
        let found = within_tolerance(self.model, &options, false, FINEST, mesh_of);
        found.map(|w| (w.tool, w.report.folded.len())).map_err(|e| e.to_string())
    }

    fn figures(&self, tool: &ToolModel, convert_s: f64) -> Result<Figures, String> {
        let found = audit(tool, &self.reference, &AuditOptions::default());
        let report = found.map_err(|e| e.to_string())?.report;
        let (surface, index_s) = self.timed(|| ToolSurface::new(tool.clone()));
        let gaps = || self.points.iter().map(|p| surface.closest(p, None).gap).sum::<f64>();
        let (_, queries_s) = self.timed(gaps);
        Ok(Figures {
            patches: tool.patches.len(),
            error_mm: report.worst_mm(),
            rms_mm: report.rms_mm,
            normal_deg: report.normal_max_deg,
            convert_s,
            index_s,
            query_us: 1e6 * queries_s / self.points.len() as f64,
        })
    }

    /// Result of `work`, and its processor time on one thread [s]. Short work is repeated and averaged.
    fn timed<T: Send>(&self, work: impl Fn() -> T + Sync) -> (T, f64) {
        const TIMED_S_MIN: f64 = 0.1;
        const REPEATS_MAX: u32 = 1000;
        let repeats = || {
            let (begin, mut repeats) = (ThreadTime::now(), 0);
            loop {
                let out = work();
                repeats += 1;
                let spent = begin.spent_s();
                if spent >= TIMED_S_MIN || repeats == REPEATS_MAX {
                    return (out, spent / f64::from(repeats));
                }
            }
        };
        match &self.single_thread {
            Some(pool) => pool.install(repeats),
            None => repeats(),
        }
    }
}

/// A point in time on the clock of this thread.
struct ThreadTime {
    wall: Instant,
    processor_ns: Option<u64>,
}

impl ThreadTime {
    fn now() -> Self {
        Self { wall: Instant::now(), processor_ns: processor_ns() }
    }

    /// Processor time of this thread since then [s]; wall time if the system does not report it.
    fn spent_s(&self) -> f64 {
        match (self.processor_ns, processor_ns()) {
            (Some(from), Some(to)) => to.saturating_sub(from) as f64 * 1e-9,
            _ => self.wall.elapsed().as_secs_f64(),
        }
    }
}

/// Processor time of this thread [ns].
fn processor_ns() -> Option<u64> {
    let text = kanagata_files::read_system("/proc/thread-self/schedstat").ok()?;
    text.split_ascii_whitespace().next()?.parse().ok()
}

/// Random points, uniform over the area of a mesh and offset along its normals.
pub(super) fn points_near(mesh: &SurfaceMesh, queries: &Queries) -> Vec<Vec3> {
    let mut state = queries.seed;
    let mut random = move || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut triangles: Vec<[Vec3; 3]> = Vec::new();
    for element in &mesh.elements {
        let x = |k: usize| mesh.vertices[element.nodes()[k] as usize];
        triangles.extend((1..element.nodes().len() - 1).map(|k| [x(0), x(k), x(k + 1)]));
    }
    let mut sums = Vec::with_capacity(triangles.len());
    let mut area = 0.0;
    for [a, b, c] in &triangles {
        area += (b - a).cross(&(c - a)).norm();
        sums.push(area);
    }
    let point = |_| {
        let share = random() * area;
        let [a, b, c] = triangles[sums.partition_point(|s| *s <= share).min(sums.len() - 1)];
        let (mut u, mut v) = (random(), random());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
        a + (b - a) * u + (c - a) * v + normal * ((2.0 * random() - 1.0) * queries.distance_mm)
    };
    (0..queries.points).map(point).collect()
}
