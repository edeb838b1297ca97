//! What a file says about its faces besides their shape: bodies, names, layers and colours.
//!
//! Readers fill in what stands in the file. A face inherits layers and colour of its shell, solid or occurrence where it
//! has none of its own.

use std::sync::Arc;

/// A name of the file, shared by all that bear it.
pub type Name = Arc<str>;

/// Longest name that is kept [characters]; the rest is cut off.
const NAME_LENGTH_MAX: usize = 120;
/// Largest number of names in the path of a body; the outermost ones are dropped.
const PATH_LENGTH_MAX: usize = 16;

/// The eight basic colours: those with a name in STEP and with a number (from 1) in IGES.
pub const BASIC_COLOURS: [(&str, [u8; 3]); 8] = [
    ("black", [0, 0, 0]),
    ("red", [255, 0, 0]),
    ("green", [0, 255, 0]),
    ("blue", [0, 0, 255]),
    ("yellow", [255, 255, 0]),
    ("magenta", [255, 0, 255]),
    ("cyan", [0, 255, 255]),
    ("white", [255, 255, 255]),
];

/// What a body is in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum BodyKind {
    /// A solid with its outer shell and its voids.
    Solid,
    /// A shell of faces.
    Shell,
    /// Faces of no solid or shell that are connected to each other.
    Faces,
}

/// A solid, a shell or a set of connected faces; one for every occurrence in an assembly.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Body {
    /// Names from the outermost product to the body itself: products, occurrences where their names differ from those
    /// of the products, and the body. Empty where the file names nothing.
    pub path: Arc<[Name]>,
    /// What the body is in the file.
    pub kind: BodyKind,
    /// Entity in the file; empty for faces of no solid or shell.
    pub source: String,
}

impl Body {
    /// The names of the path with `/` between them.
    #[must_use]
    pub fn path_text(&self) -> String {
        self.path.join("/")
    }
}

/// Body, name, layers and colour of a face.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Attributes {
    /// Index of its body in the model.
    pub body: usize,
    /// Its own name.
    pub name: Option<Name>,
    /// Its layers (STEP presentation layers, IGES levels) and groups.
    pub layers: Arc<[Name]>,
    /// Its colour: red, green, blue.
    pub colour: Option<[u8; 3]>,
}

impl Attributes {
    /// Takes over the layers and the colour of an entity that contains the face where the face has none.
    pub(super) fn inherit(&mut self, from: &Style) {
        if self.layers.is_empty() && !from.layers.is_empty() {
            self.layers = Arc::clone(&from.layers);
        }
        self.colour = self.colour.or(from.colour);
    }
}

/// Layers and colour of an entity.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Style {
    /// Layers and groups.
    pub layers: Arc<[Name]>,
    /// Red, green, blue.
    pub colour: Option<[u8; 3]>,
}

/// A name of the file; `None` for texts that name nothing.
pub(super) fn name(text: &str) -> Option<Name> {
    let text = text.trim();
    let says_nothing = text.is_empty() || text.eq_ignore_ascii_case("none") || text == "$";
    (!says_nothing).then(|| text.chars().take(NAME_LENGTH_MAX).collect::<String>().into())
}

/// Path with further names at its end; a name that repeats the one before it is omitted.
pub(super) fn path_below(path: &Arc<[Name]>, names: &[Option<Name>]) -> Arc<[Name]> {
    let mut out: Vec<Name> = path.to_vec();
    for name in names.iter().flatten() {
        if out.last() != Some(name) {
            out.push(Arc::clone(name));
        }
    }
    let dropped = out.len().saturating_sub(PATH_LENGTH_MAX);
    out.drain(..dropped);
    out.into()
}

/// A colour as `#rrggbb`.
#[must_use]
pub fn colour_text([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// A colour from fractions of red, green and blue; `None` unless all are from 0 to 1.
pub(super) fn rgb(parts: [f64; 3]) -> Option<[u8; 3]> {
    let within = parts.iter().all(|x| (-1e-6..=1.0 + 1e-6).contains(x));
    within.then(|| parts.map(|x| (x.clamp(0.0, 1.0) * 255.0).round() as u8))
}
