//! Options that choose faces of a CAD file, shared by `inspect`, `mesh`, `convert` and `split`.

use std::path::{Path, PathBuf};

use super::exit::Failure;
use crate::cad::Model;
use crate::cad::region::PlanCurve;
use crate::convert::select::{Chosen, choose, plan_pieces};
use crate::geometry::Aabb;
use crate::tool::selection::{FaceSelection, Facing, PlanPiece, SelectionBox};

/// Largest angle between mean normal and direction where none is given [degrees].
const FACING_DEG: f64 = 89.0;

/// Choice of faces.
#[derive(Debug, Clone, Default, clap::Args)]
#[command(
    next_help_heading = "Choice of faces (an item that begins with ! excludes; all options together apply)"
)]
pub struct SelectArgs {
    /// Bodies: numbers as `inspect --tree` lists them, or names (product, occurrence, body) with * and ?
    #[arg(long, value_name = "NAME|NUMBER", value_delimiter = ',')]
    bodies: Vec<String>,
    /// Faces: numbers and ranges as `inspect --tree` lists them (3-9), entities (#120, D25), or names with * and ?
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    faces: Vec<String>,
    /// Layers and groups: names with * and ?; levels of IGES are their numbers
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    layers: Vec<String>,
    /// Colours: #rrggbb, black, red, green, blue, yellow, magenta, cyan, white, or none
    #[arg(long, value_name = "COLOUR", value_delimiter = ',')]
    colours: Vec<String>,
    /// Faces inside this box as a whole [mm]; may be repeated
    #[arg(long = "box", value_name = "X0,Y0,Z0,X1,Y1,Z1", value_parser = selection_box, allow_hyphen_values = true)]
    boxes: Vec<SelectionBox>,
    /// Faces whose mean normal is within ANGLE [degrees] (default 89) of +x, -x, +y, -y, +z, -z or a vector X,Y,Z
    #[arg(long, value_name = "DIRECTION[,ANGLE]", value_parser = facing, allow_hyphen_values = true)]
    facing: Option<Facing>,
    /// Inside a closed curve in plan; faces that it crosses are split: a table of points x,y, a CAD file with one closed
    /// curve, or points as "0,0 50,0 50,30"
    #[arg(long, value_name = "FILE|POINTS", allow_hyphen_values = true)]
    within: Option<String>,
    /// Outside a closed curve in plan, as --within
    #[arg(long, value_name = "FILE|POINTS", allow_hyphen_values = true)]
    outside: Option<String>,
}

impl SelectArgs {
    /// Whether faces are chosen.
    pub(super) fn is_given(&self) -> bool {
        let lists = [&self.bodies, &self.faces, &self.layers, &self.colours];
        lists.iter().any(|list| !list.is_empty())
            || !self.boxes.is_empty()
            || self.facing.is_some()
            || self.within.is_some()
            || self.outside.is_some()
    }

    /// The choice; `None` for all faces.
    pub(super) fn selection(&self) -> Result<Option<FaceSelection>, Failure> {
        let pieces = |text: &Option<String>| text.as_deref().map_or(Ok(Vec::new()), region);
        let (within, outside) = (pieces(&self.within)?, pieces(&self.outside)?);
        let Self { bodies, faces, layers, colours, boxes, facing, .. } = self.clone();
        let selection =
            FaceSelection { bodies, faces, layers, colours, boxes, facing, within, outside };
        Ok((!selection.is_all()).then_some(selection))
    }

    /// Files of the curves.
    pub(super) fn files(&self) -> impl Iterator<Item = &Path> {
        let texts = [&self.within, &self.outside].into_iter().flatten();
        texts.filter(|text| points_of(text).is_none()).map(Path::new)
    }

    /// The same choice for the body of this number (from 1).
    pub(super) fn of_body(&self, number: usize) -> Self {
        Self { bodies: vec![number.to_string()], ..self.clone() }
    }

    /// The chosen faces of the model of a file; `None` for all.
    pub(super) fn choose(&self, file: &Path, model: &Model) -> Result<Option<Chosen>, Failure> {
        let chosen = self.selection()?.map(|selection| choose(model, &selection)).transpose();
        chosen.map_err(|error| Failure::of_file(file, error))
    }

    /// Refuses a choice with another option that works on the whole file.
    pub(super) fn refuse_with(&self, option: Option<&str>) -> Result<(), Failure> {
        match option {
            Some(option) if self.is_given() => Err(Failure::input(format!(
                "{option} with a choice of faces; allowed: the built-in mesher, which takes faces one by one; leave {option} or \
                 the choice out"
            ))),
            _ => Ok(()),
        }
    }
}

/// The pieces of a closed curve in plan: from points, a table of points, or a CAD file.
fn region(text: &str) -> Result<Vec<PlanPiece>, Failure> {
    const ENDS_MEET_REL: f64 = 1e-4;
    let path = PathBuf::from(text);
    let of_file = |error| Failure::of_file(&path, error);
    if let Some(points) = points_of(text) {
        return PlanCurve::polygon(&points).map(|c| plan_pieces(&c)).map_err(Failure::input);
    }
    let is_no_point = |word: &&str| points_of(word).is_none();
    if text.contains(',')
        && !path.exists()
        && let Some(word) = text.split_whitespace().find(is_no_point)
        && text.split_whitespace().nth(1).is_some()
    {
        return Err(Failure::input(format!(
            "{word} in a region; allowed: points x,y in mm with blanks between, or the name of a file"
        )));
    }
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    if matches!(ending.as_deref(), Some("csv" | "txt" | "dat" | "xy")) {
        let table = crate::files::read_text(&path, crate::files::Input::Table)
            .map_err(|e| Failure::new(super::exit::Exit::Io, format!("cannot read {text}: {e}")))?;
        let points = table_of(&table).map_err(|e| Failure::of_file(&path, e))?;
        return PlanCurve::polygon(&points).map(|c| plan_pieces(&c)).map_err(of_file);
    }
    let curves = crate::cad::read_curves(&path)?;
    let boxes = curves.iter().map(|c| Aabb::of_points(c.points()));
    let size = boxes.fold(Aabb::EMPTY, |sum, b| sum.union(&b)).diagonal();
    PlanCurve::of_curves(&curves, ENDS_MEET_REL * size).map(|c| plan_pieces(&c)).map_err(of_file)
}

/// Points as `0,0 50,0 50,30`; `None` for other texts.
fn points_of(text: &str) -> Option<Vec<[f64; 2]>> {
    let point = |word: &str| <[f64; 2]>::try_from(numbers(word)?).ok();
    text.split_whitespace().map(point).collect::<Option<Vec<_>>>().filter(|all| !all.is_empty())
}

/// Points of a table, a line each; a first line of words and lines that begin with `#` are passed over. Lines have two
/// numbers, or three throughout.
fn table_of(text: &str) -> Result<Vec<[f64; 2]>, String> {
    let (mut points, mut columns, mut first) = (Vec::new(), None, true);
    for (k, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let line = line.trim();
        let words: Vec<&str> =
            line.split([',', ';', ' ', '\t']).filter(|w| !w.is_empty()).collect();
        let found: Vec<f64> = words.iter().filter_map(|w| w.parse().ok()).collect();
        let mixed = line.contains(',') && line.contains(';');
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let is_heading = std::mem::take(&mut first) && found.is_empty();
        match found[..] {
            _ if is_heading => {}
            [x, y, ..]
                if !mixed
                    && found.len() == words.len()
                    && found.len() <= 3
                    && *columns.get_or_insert(found.len()) == found.len() =>
            {
                points.push([x, y]);
            }
            _ => {
                let shown: String = line.chars().take(40).collect();
                return Err(format!(
                    "line {}: `{shown}`; allowed: x and y in mm, with one separator and a decimal point, as in all lines",
                    k + 1
                ));
            }
        }
    }
    Ok(points)
}

/// Numbers with commas between them.
fn numbers(text: &str) -> Option<Vec<f64>> {
    let all: Option<Vec<f64>> = text.split(',').map(|t| t.trim().parse().ok()).collect();
    all.filter(|all| all.iter().all(|x| x.is_finite()))
}

fn selection_box(text: &str) -> Result<SelectionBox, String> {
    let (excluded, rest) = text.strip_prefix('!').map_or((false, text), |rest| (true, rest));
    match numbers(rest).as_deref() {
        Some(&[a, b, c, d, e, f]) if a <= d && b <= e && c <= f => {
            Ok(SelectionBox { min: [a, b, c], max: [d, e, f], excluded })
        }
        _ => Err("allowed: six numbers with commas between, the smallest x, y, z first, as 0,0,-5,100,80,20".into()),
    }
}

fn facing(text: &str) -> Result<Facing, String> {
    let allowed =
        "allowed: +x, -x, +y, -y, +z, -z or X,Y,Z, then perhaps an angle from 0 to 180, as +z,60";
    let (first, rest) = text.split_once(',').map_or((text, None), |(a, b)| (a, Some(b)));
    let axis = match first.trim() {
        "+x" | "x" => Some([1.0, 0.0, 0.0]),
        "-x" => Some([-1.0, 0.0, 0.0]),
        "+y" | "y" => Some([0.0, 1.0, 0.0]),
        "-y" => Some([0.0, -1.0, 0.0]),
        "+z" | "z" => Some([0.0, 0.0, 1.0]),
        "-z" => Some([0.0, 0.0, -1.0]),
        _ => None,
    };
    let (direction, angle_deg) = match (axis, rest) {
        (Some(axis), None) => (axis, FACING_DEG),
        (Some(axis), Some(angle)) => match numbers(angle).as_deref() {
            Some(&[angle]) => (axis, angle),
            _ => return Err(allowed.into()),
        },
        (None, _) => match numbers(text).as_deref() {
            Some(&[x, y, z]) => ([x, y, z], FACING_DEG),
            Some(&[x, y, z, angle]) => ([x, y, z], angle),
            _ => return Err(allowed.into()),
        },
    };
    let is_zero = direction.iter().all(|x| *x == 0.0);
    if is_zero || !(0.0..=180.0).contains(&angle_deg) {
        return Err(allowed.into());
    }
    Ok(Facing { direction, angle_deg })
}

#[cfg(test)]
mod tests {
    use super::{facing, points_of, selection_box, table_of};

    #[test]
    fn points_come_from_words_or_tables() {
        assert_eq!(points_of("0,0 5,-1\n2,3"), Some(vec![[0.0, 0.0], [5.0, -1.0], [2.0, 3.0]]));
        assert!(["", "region.csv", "0,0,0 1,1,1", "0,0 x"].iter().all(|t| points_of(t).is_none()));
        let table = "x,y\n# mm\n0,0\n 5 ; 1 \n\n2\t3\n";
        assert_eq!(table_of(table), Ok(vec![[0.0, 0.0], [5.0, 1.0], [2.0, 3.0]]));
        assert!(table_of("0,0\n1,a\n").unwrap_err().contains("line 2: `1,a`"));
        for (bad, line) in
            [("x,y\nO,0\n1,0\n", 2), ("O,0\n1,0\n", 1), ("0;0\n50,5;0\n", 2), ("0,0\n1,2,3\n", 2)]
        {
            assert!(table_of(bad).unwrap_err().contains(&format!("line {line}:")), "{bad}");
        }
        assert_eq!(table_of("\u{feff}0,0\n1,0\n"), Ok(vec![[0.0, 0.0], [1.0, 0.0]]));
    }

    #[test]
    fn directions_and_boxes_are_read_or_refused() {
        let f = facing("-z").unwrap();
        assert_eq!((f.direction, f.angle_deg), ([0.0, 0.0, -1.0], 89.0));
        let f = facing("0,1,1,30").unwrap();
        assert_eq!((f.direction, f.angle_deg), ([0.0, 1.0, 1.0], 30.0));
        for bad in ["", "up", "+z,200", "0,0,0", "+z,", "1,2", "nan,0,1"] {
            assert!(facing(bad).unwrap_err().contains("allowed"), "{bad}");
        }
        let b = selection_box("!-1,-2,-3,1,2,3").unwrap();
        assert!(b.excluded && b.min == [-1.0, -2.0, -3.0] && b.max == [1.0, 2.0, 3.0]);
        for bad in ["", "1,2,3", "1,0,0,0,0,0", "0,0,0,1,1,inf"] {
            assert!(selection_box(bad).unwrap_err().contains("allowed"), "{bad}");
        }
    }
}
