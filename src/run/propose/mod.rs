//! A scene proposed from the tools of a part: directions, symmetry planes, blank, travel and holder force.
//!
//! The tools move along z, and the blank is normal to it. The proposal is where an engineer starts: what the tools do
//! not determine (material, friction, force) has a usual value, and a comment in the scene says so.
//!
//! - `heights`: the surfaces of tools seen along z
//! - `roles`: which tools lie below the blank, and which are die, punch and holder
//! - `travel`: travel of the punch until the tools close on the sheet
//! - `symmetry`: planes about which all tools are symmetric or at which they end, and tools of revolution
//! - `blank`: outline and elements
//! - `layout`: everything together
//! - `text`: the scene with comments

mod blank;
mod heights;
mod layout;
mod roles;
mod symmetry;
mod text;
mod travel;

use std::sync::Arc;

use kanagata_contact::ToolSurface;
use kanagata_scene::types::ToolCad;

pub use layout::{Layout, propose, template};
pub use roles::ProposeError;

/// A tool of the scene to propose.
#[derive(Clone)]
pub struct GivenTool {
    /// Name in the scene.
    pub name: String,
    /// Tool file, relative to the scene.
    pub file: String,
    /// CAD from which the tool file is made.
    pub cad: Option<ToolCad>,
    /// Its surface.
    pub surface: Arc<ToolSurface>,
    /// Whether its normals are known to look at the sheet, as in tool files. Those of CAD may look either way.
    pub has_side: bool,
}

/// Kinds of parts with a scene of their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PartKind {
    /// Drawn from a disc over a punch of revolution.
    Cup,
    /// Drawn from a rectangle with a holder.
    Pan,
    /// A strip drawn over two radii, plane strain.
    UDraw,
    /// A strip bent without a holder, plane strain.
    Bend,
}

/// What is known besides the tools.
#[derive(Debug, Clone)]
pub struct Wishes {
    /// Name of the scene.
    pub name: String,
    /// Thickness of the sheet [mm].
    pub thickness_mm: f64,
    /// Material: a card of the library or a card file.
    pub material: String,
    /// Kind of the part, if it is not to follow from the tools.
    pub kind: Option<PartKind>,
}
