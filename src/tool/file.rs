//! The tool file `*.tool.json`, version 1: contents, reading, validation and writing.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::build::{EdgeChoice, StraightEdge, ToolError, build};
use super::edge::EdgeRule;
use super::model::{GivenCurve, PatchCorners, ToolKind, ToolModel};
use super::patch::{MAX_DEGREE, Patch};
pub use super::provenance::Provenance;
use super::side::corners;
use kanagata_files::{FileKind, WriteError, WrongKind, write_atomic};
use kanagata_geometry::numbers::first_fault;
use kanagata_geometry::{Aabb, Vec3};

/// Largest gap between borders of faces of one surface, relative to the size of the model.
pub const BORDER_GAP_MAX_REL: f64 = 0.01;

/// File version that is written and read.
pub const VERSION: u32 = 1;

/// A tool file as text has it. Lengths in mm; normals are unit vectors out of the tool, to the sheet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ToolFile {
    /// `kanagata-tool`.
    pub format: FormatTag,
    /// 1.
    pub version: u32,
    /// Name of the tool.
    pub name: String,
    /// What its patches are.
    pub kind: ToolKind,
    /// How edges are curved (Nagata).
    #[serde(default)]
    pub edges: EdgeRule,
    /// Where it comes from.
    #[serde(default)]
    pub provenance: Provenance,
    /// Vertex positions [mm] (Nagata, facets).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub vertices: Vec<[f64; 3]>,
    /// Unit normals; one vertex may own several (Nagata, facets).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub normals: Vec<[f64; 3]>,
    /// Patches by corner ids (Nagata, facets).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub patches: Vec<PatchCorners>,
    /// Edges whose coefficient is given instead of derived (Nagata).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub curves: Vec<GivenCurve>,
    /// Patches by control points (Bezier).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bezier_patches: Vec<BezierNet>,
    /// Largest distance of the borders of faces that were divided independently, so that their patches do not share
    /// vertices across the edge of the CAD between them [mm]; 0: all share them.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub border_gap_mm: f64,
}

fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

/// The constant that marks a tool file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum FormatTag {
    /// `kanagata-tool`
    #[serde(rename = "kanagata-tool")]
    Tool,
}

/// A Bezier patch: degrees 1 to 6 each way, control point (i, j) at `i * (degrees[1] + 1) + j` (Eq. 1).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BezierNet {
    /// Degrees along eta and zeta.
    pub degrees: [usize; 2],
    /// Control points [mm].
    pub points: Vec<[f64; 3]>,
    /// CAD face id.
    pub face: u32,
}

/// The reason why a tool file yields no tool model.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum ToolFileError {
    /// The file cannot be opened or read.
    #[error("cannot read tool file {}: {source}; convert the CAD of the tool to make it", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        #[source]
        source: std::io::Error,
    },
    /// The text is not a tool file.
    #[error("{}, line {line}, column {column}: {found}; allowed: the keys and values of schemas/tool.schema.json; convert the CAD again", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// Message of the parser.
        found: String,
    },
    /// The file is of another kind.
    #[error(transparent)]
    Kind(#[from] WrongKind),
    /// An unsupported version.
    #[error("{}: tool file version {found}; allowed: {VERSION}; convert the CAD again", path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// Version found.
        found: u32,
    },
    /// Data that do not define a tool.
    #[error("{}: {cause}; convert the CAD again", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// Cause.
        cause: ToolError,
    },
    /// No patches.
    #[error("{}: no patches of kind {kind}; allowed: at least one", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
        /// Kind declared in the file.
        kind: String,
    },
}

/// A tool file after reading and construction.
#[derive(Debug, Clone)]
pub struct LoadedTool {
    /// The model.
    pub model: ToolModel,
    /// Edges replaced by their chords.
    pub straight_edges: Vec<StraightEdge>,
    /// Origin of the file.
    pub provenance: Provenance,
    /// Rule of its edges.
    pub edges: EdgeRule,
    /// SHA-256 of the tool file itself.
    pub sha256: String,
}

/// Reads and builds a tool file.
///
/// # Errors
/// [`ToolFileError`] with file, location, finding and admissible values.
pub fn read(path: &Path) -> Result<LoadedTool, ToolFileError> {
    let bytes = kanagata_files::read(path, kanagata_files::Input::Tool)
        .map_err(|source| ToolFileError::Io { path: path.to_path_buf(), source })?;
    parse(&bytes, path)
}

/// Builds the tool in the bytes of a file; `path` is used in messages.
///
/// # Errors
/// As [`read`], except for [`ToolFileError::Io`].
pub fn parse(bytes: &[u8], path: &Path) -> Result<LoadedTool, ToolFileError> {
    let file: ToolFile = serde_json::from_slice(bytes).map_err(|e| {
        let path = path.to_path_buf();
        FileKind::other_than(FileKind::Tool, bytes, path.clone()).map_or_else(
            || ToolFileError::Syntax {
                path,
                line: e.line(),
                column: e.column(),
                found: e.to_string(),
            },
            ToolFileError::Kind,
        )
    })?;
    if file.version != VERSION {
        return Err(ToolFileError::Version { path: path.to_path_buf(), found: file.version });
    }
    if file.patches.len() + file.bezier_patches.len() == 0 {
        let kind = format!("{:?}", file.kind).to_lowercase();
        return Err(ToolFileError::Empty { path: path.to_path_buf(), kind });
    }
    let (provenance, edges) = (file.provenance.clone(), file.edges);
    let (model, straight_edges) = file
        .into_model()
        .map_err(|cause| ToolFileError::Content { path: path.to_path_buf(), cause })?;
    let sha256 = kanagata_files::sha256_hex(bytes);
    Ok(LoadedTool { model, straight_edges, provenance, edges, sha256 })
}

impl ToolFile {
    /// The file of a model.
    #[must_use]
    pub fn of_model(model: &ToolModel, edges: EdgeRule, provenance: Provenance) -> Self {
        let plain = |list: &[Vec3]| list.iter().map(|v| [v.x, v.y, v.z]).collect::<Vec<_>>();
        let net = |(patch, &face): (&Patch, &u32)| match patch {
            Patch::Bezier { degrees, points } => {
                Some(BezierNet { degrees: *degrees, points: plain(points), face })
            }
            _ => None,
        };
        Self {
            format: FormatTag::Tool,
            version: VERSION,
            name: model.name.clone(),
            kind: model.kind,
            edges,
            provenance,
            vertices: plain(&model.vertices),
            normals: plain(&model.normals),
            patches: model.corners.clone(),
            curves: model.curves.clone(),
            bezier_patches: model.patches.iter().zip(&model.faces).filter_map(net).collect(),
            border_gap_mm: model.border_gap_mm,
        }
    }

    /// The model of the file, with the edges replaced by their chords.
    ///
    /// # Errors
    /// [`ToolError`] names the patch, vertex or normal.
    pub fn into_model(self) -> Result<(ToolModel, Vec<StraightEdge>), ToolError> {
        let points = |list: Vec<[f64; 3]>| list.into_iter().map(Vec3::from).collect();
        let (mut model, straight) = match self.kind {
            ToolKind::Bezier => (bezier_model(self.name, &self.bezier_patches)?, Vec::new()),
            _ => build(
                self.name,
                self.kind,
                points(self.vertices),
                points(self.normals),
                self.patches,
                EdgeChoice { rule: self.edges, given: self.curves },
            )?,
        };
        model.border_gap_mm = allowed_gap(self.border_gap_mm, &model)?;
        Ok((model, straight))
    }

    /// Writes the file atomically.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full.
    pub fn write(&self, path: &Path) -> Result<(), WriteError> {
        write_atomic(path, |w| {
            serde_json::to_writer(&mut *w, self)?;
            writeln!(w)
        })
    }
}

/// Border gap declared in a file [mm], if admissible.
fn allowed_gap(found: f64, model: &ToolModel) -> Result<f64, ToolError> {
    let corners = |p: &Patch| -> Vec<Vec3> {
        corners(p.sides()).iter().map(|&(eta, zeta)| p.derivs(eta, zeta).s).collect()
    };
    if found == 0.0 {
        return Ok(found);
    }
    let points: Vec<Vec3> = model.patches.iter().flat_map(corners).collect();
    let limit = BORDER_GAP_MAX_REL * Aabb::of_points(&points).diagonal();
    if (0.0..=limit).contains(&found) { Ok(found) } else { Err(ToolError::Gap { found, limit }) }
}

fn bezier_model(name: String, nets: &[BezierNet]) -> Result<ToolModel, ToolError> {
    let mut patches = Vec::with_capacity(nets.len());
    for (patch, net) in nets.iter().enumerate() {
        let [n, m] = net.degrees;
        let allowed = 1..=MAX_DEGREE;
        let fits = allowed.contains(&n) && allowed.contains(&m);
        if !fits || net.points.len() != (n + 1) * (m + 1) {
            let points = net.points.len();
            return Err(ToolError::Net { patch, degrees: net.degrees, points });
        }
        let points: Vec<Vec3> = net.points.iter().map(|&p| Vec3::from(p)).collect();
        if let Some((_, found)) = first_fault(&points) {
            let what = "control point of patch";
            return Err(ToolError::Number { what, index: patch, found });
        }
        patches.push(Patch::Bezier { degrees: net.degrees, points });
    }
    let faces = nets.iter().map(|net| net.face).collect();
    Ok(ToolModel::of_patches(&name, ToolKind::Bezier, patches, faces))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quad() -> ToolFile {
        let n = [0.0, 0.0, 1.0];
        ToolFile {
            format: FormatTag::Tool,
            version: VERSION,
            name: "plate".into(),
            kind: ToolKind::Nagata,
            edges: EdgeRule::Guarded,
            provenance: Provenance::default(),
            vertices: vec![
                [0.1, 0.0, 0.0],
                [1.0, 0.0, 0.0],
                [1.0, 1.0 / 3.0, 0.0],
                [0.0, 1.0, 0.0],
            ],
            normals: vec![n],
            patches: vec![PatchCorners {
                vertices: vec![0, 1, 2, 3],
                normals: vec![0; 4],
                face: 5,
            }],
            curves: vec![GivenCurve { vertices: [2, 1], c: [0.0, 0.1 / 3.0, 0.0] }],
            bezier_patches: vec![],
            border_gap_mm: 0.0,
        }
    }

    fn read_text(text: &str) -> Result<LoadedTool, ToolFileError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.tool.json");
        std::fs::write(&path, text).unwrap();
        read(&path)
    }

    #[test]
    fn numbers_come_back_to_the_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.tool.json");
        quad().write(&path).unwrap();
        let loaded = read(&path).unwrap();
        let (model, _) = quad().into_model().unwrap();
        assert_eq!(loaded.model, model);
        let again = ToolFile::of_model(&loaded.model, EdgeRule::Guarded, loaded.provenance);
        assert_eq!(again, quad());
    }

    #[test]
    fn unknown_keys_wrong_versions_and_empty_files_are_named() {
        let text = serde_json::to_string(&quad()).unwrap();
        let unknown = text.replacen("\"name\"", "\"colour\":1,\"name\"", 1);
        let message = read_text(&unknown).unwrap_err().to_string();
        assert!(message.contains("colour") && message.contains("line 1"), "{message}");
        let newer = text.replacen("\"version\":1", "\"version\":2", 1);
        assert!(matches!(read_text(&newer), Err(ToolFileError::Version { found: 2, .. })));
        assert!(matches!(read_text(""), Err(ToolFileError::Kind(_))));
        assert!(matches!(read_text(&text[..text.len() / 2]), Err(ToolFileError::Syntax { .. })));
        let other = text.replacen("\"face\":5}]", "\"face\":5}],\"bezier_patches\":[]", 1);
        assert!(read_text(&other).is_ok());
        let lost = text.replacen("\"vertices\":[2,1]", "\"vertices\":[2,0]", 1);
        assert!(read_text(&lost).unwrap_err().to_string().contains("edge 2-0"));
        let bad = text.replacen("[0,1,2,3]", "[0,1,2,9]", 1);
        assert!(read_text(&bad).unwrap_err().to_string().contains("vertex 9"));
    }

    #[test]
    fn a_net_that_is_not_full_is_refused() {
        let file = ToolFile {
            kind: ToolKind::Bezier,
            vertices: vec![],
            normals: vec![],
            patches: vec![],
            bezier_patches: vec![BezierNet {
                degrees: [2, 7],
                points: vec![[0.0; 3]; 24],
                face: 0,
            }],
            ..quad()
        };
        assert!(matches!(file.into_model(), Err(ToolError::Net { patch: 0, .. })));
    }
}
