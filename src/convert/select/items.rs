//! Items of lists: bodies, faces, layers and colours.

use super::error::SelectError;
use super::nearest::nearest;
use super::pattern::fits;
use kanagata_cad::Model;
use kanagata_cad::attributes::{Attributes, BASIC_COLOURS, Body, colour_text};

/// Items of one list, and characters of an item, at most.
pub(super) const ITEMS_MAX: usize = 1_000;
pub(super) const ITEM_LENGTH_MAX: usize = 400;
/// `*` in an item: the time of a comparison grows with their number.
const WILDCARDS_MAX: usize = 8;

/// What the items of a list choose by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Chooser {
    Bodies,
    Faces,
    Layers,
    Colours,
}

impl Chooser {
    fn singular(self) -> &'static str {
        match self {
            Self::Bodies => "body",
            Self::Faces => "face",
            Self::Layers => "layer",
            Self::Colours => "colour",
        }
    }

    pub(super) fn plural(self) -> &'static str {
        match self {
            Self::Bodies => "bodies",
            Self::Faces => "faces",
            Self::Layers => "layers",
            Self::Colours => "colours",
        }
    }
}

/// The faces that a list chooses.
pub(super) fn by_items(
    model: &Model,
    chooser: Chooser,
    items: &[String],
) -> Result<Vec<bool>, SelectError> {
    let too_long = |item: &String| {
        let wildcards = item.chars().filter(|c| *c == '*').count();
        item.chars().count() > ITEM_LENGTH_MAX || wildcards > WILDCARDS_MAX
    };
    if items.len() > ITEMS_MAX || items.iter().any(too_long) {
        let (what, found) = (chooser.plural(), items.len());
        return Err(SelectError::TooLong { what, found, max: ITEMS_MAX, length: ITEM_LENGTH_MAX });
    }
    let excludes = |item: &String| item.starts_with('!');
    let mut chosen = vec![items.iter().all(excludes); model.faces.len()];
    for excluded in [false, true] {
        for item in items.iter().filter(|item| excludes(item) == excluded) {
            let item = item.strip_prefix('!').unwrap_or(item).trim();
            for f in faces_of(model, chooser, item)? {
                chosen[f] = !excluded;
            }
        }
    }
    Ok(chosen)
}

/// The faces that one item chooses, at least one.
fn faces_of(model: &Model, chooser: Chooser, item: &str) -> Result<Vec<usize>, SelectError> {
    let what = chooser.singular();
    if item.is_empty() {
        let allowed = "a name or a number";
        return Err(SelectError::Malformed { what, item: item.into(), allowed });
    }
    let found = match chooser {
        Chooser::Bodies => of_bodies(model, item),
        Chooser::Faces => of_faces(model, item)?,
        Chooser::Layers => {
            let pattern: Vec<char> = item.chars().collect();
            let on = |a: &Attributes| a.layers.iter().any(|l| fits_text(&pattern, l));
            those(model, |_, a| on(a))
        }
        Chooser::Colours => {
            let colour = colour_of(item)?;
            those(model, |_, a| a.colour == colour)
        }
    };
    if found.is_empty() {
        let nearest = nearest_to(model, chooser, item);
        return Err(SelectError::Unknown { what, item: item.into(), nearest });
    }
    Ok(found)
}

fn those(model: &Model, is: impl Fn(usize, &Attributes) -> bool) -> Vec<usize> {
    (0..model.faces.len()).filter(|&f| is(f, &model.faces[f].attributes)).collect()
}

fn fits_text(pattern: &[char], text: &str) -> bool {
    fits(pattern, &text.chars().collect::<Vec<char>>())
}

/// Faces of bodies of this number or name.
fn of_bodies(model: &Model, item: &str) -> Vec<usize> {
    let of = |body: usize| those(model, |_, a| a.body == body);
    let number = item.parse::<usize>().ok().and_then(|n| n.checked_sub(1));
    let by_number = number.map(of).unwrap_or_default();
    if !by_number.is_empty() {
        return by_number;
    }
    let pattern: Vec<char> = item.chars().collect();
    let is = |body: &Body| {
        body.path.iter().any(|name| fits_text(&pattern, name))
            || fits_text(&pattern, &body.path_text())
    };
    let named: Vec<bool> = model.bodies.iter().map(is).collect();
    those(model, |_, a| named.get(a.body).copied().unwrap_or(false))
}

/// Faces of a number, a range, an entity or a name.
fn of_faces(model: &Model, item: &str) -> Result<Vec<usize>, SelectError> {
    let number = |text: &str| text.trim().parse::<usize>().ok();
    let range = match item.split_once('-') {
        Some((from, to)) => number(from).zip(number(to)),
        None => number(item).map(|n| (n, n)),
    };
    if let Some((from, to)) = range {
        if from > to {
            let allowed = "a range from the smaller to the larger number, as 3-9";
            return Err(SelectError::Malformed { what: "face", item: item.into(), allowed });
        }
        return Ok(if to < model.faces.len() { (from..=to).collect() } else { Vec::new() });
    }
    let entity = |f: usize| model.faces[f].source.split(' ').next() == Some(item);
    let by_entity = those(model, |f, _| entity(f));
    if !by_entity.is_empty() {
        return Ok(by_entity);
    }
    let pattern: Vec<char> = item.chars().collect();
    Ok(those(model, |_, a| a.name.as_ref().is_some_and(|name| fits_text(&pattern, name))))
}

/// A colour by `#rrggbb` or name; `None` for `none`.
fn colour_of(item: &str) -> Result<Option<[u8; 3]>, SelectError> {
    if item.eq_ignore_ascii_case("none") {
        return Ok(None);
    }
    if let Some(basic) = BASIC_COLOURS.iter().find(|c| c.0.eq_ignore_ascii_case(item)) {
        return Ok(Some(basic.1));
    }
    let digits = item.strip_prefix('#').unwrap_or(item);
    let is_hex = digits.len() == 6 && digits.chars().all(|c| c.is_ascii_hexdigit());
    let value = is_hex.then(|| u32::from_str_radix(digits, 16).ok()).flatten();
    let Some(value) = value else {
        let allowed = "#rrggbb, black, red, green, blue, yellow, magenta, cyan, white, none";
        return Err(SelectError::Malformed { what: "colour", item: item.into(), allowed });
    };
    let [_, red, green, blue] = value.to_be_bytes();
    Ok(Some([red, green, blue]))
}

/// What comes nearest to an item that chooses nothing.
fn nearest_to(model: &Model, chooser: Chooser, item: &str) -> String {
    let attributes = || model.faces.iter().map(|face| &face.attributes);
    match chooser {
        Chooser::Bodies => {
            let names = model.bodies.iter().flat_map(|b| b.path.iter().map(ToString::to_string));
            format!("{}; numbers: 1 to {}", nearest(item, names), model.bodies.len())
        }
        Chooser::Faces => {
            let last = model.faces.len().saturating_sub(1);
            let is_number = item.chars().all(|c| c.is_ascii_digit() || c == '-');
            let entity = |f: &kanagata_cad::model::Face| {
                f.source.split(' ').next().unwrap_or_default().to_owned()
            };
            let names = attributes().filter_map(|a| a.name.as_ref().map(ToString::to_string));
            let entities = model.faces.iter().map(entity);
            let is_entity = item.starts_with(['#', 'D']) && item.len() > 1;
            match (is_number, is_entity) {
                (true, _) => format!("numbers: 0 to {last}"),
                (_, true) => format!("{}; numbers: 0 to {last}", nearest(item, entities)),
                _ => format!("{}; numbers: 0 to {last}", nearest(item, names)),
            }
        }
        Chooser::Layers => {
            nearest(item, attributes().flat_map(|a| a.layers.iter().map(ToString::to_string)))
        }
        Chooser::Colours => {
            let text = |c: Option<[u8; 3]>| c.map_or_else(|| "none".into(), colour_text);
            nearest(item, attributes().map(|a| text(a.colour)))
        }
    }
}
