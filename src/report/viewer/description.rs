//! A view as JSON for the script of the page; its numbers are arrays of the page.

use std::collections::BTreeSet;

use serde_json::{Value, json};

use super::arrays::Arrays;
use super::colors;
use super::surface::{Field, Location, Surface, Visibility};
use super::view::View;
use crate::foreign::visible_text;
use kanagata_geometry::Vec3;

/// The view for the script: parts, fields, steps, symmetry, and the largest error of the places [mm].
pub(super) fn description(view: &View, arrays: &mut Arrays) -> Value {
    let mut accuracy: f64 = 0.0;
    let parts: Vec<Value> = view
        .surfaces
        .iter()
        .map(|surface| {
            let (mut part, error) = part(surface, arrays);
            part["mirrors"] = json!(view.mirrors(surface));
            accuracy = accuracy.max(error);
            part
        })
        .collect();
    let fields = view.fields().into_iter().map(|(name, signed)| {
        json!({"name": visible_text(name), "limits": view.limits(name, signed), "colors": colors::table(signed)})
    });
    json!({
        "title": visible_text(&view.title),
        "parts": parts,
        "fields": fields.collect::<Vec<_>>(),
        "steps": view.steps.iter().map(|name| visible_text(name)).collect::<Vec<_>>(),
        "accuracy": accuracy,
    })
}

/// The word of the script.
fn word_of(visibility: Visibility) -> &'static str {
    match visibility {
        Visibility::Shown => "shown",
        Visibility::Transparent => "transparent",
        Visibility::Hidden => "hidden",
    }
}

/// A surface, and the largest error of its places [mm].
fn part(surface: &Surface, arrays: &mut Arrays) -> (Value, f64) {
    let bounds = surface.bounds().unwrap_or_default();
    let (points, accuracy) = places(&surface.points, &bounds, arrays);
    let owners = surface.owners();
    let numbers: Vec<u32> = BTreeSet::from_iter(owners.iter().copied()).into_iter().collect();
    // Every owner is in the list.
    let index = |owner: &u32| numbers.binary_search(owner).unwrap_or_default() as u32;
    let cells: Vec<u32> = owners.iter().map(index).collect();
    let fields: Vec<Value> =
        surface.fields.iter().map(|one| field(one, &numbers, arrays)).collect();
    let frames: Vec<Value> = surface
        .frames
        .iter()
        .map(|frame| {
            let mut out = json!({"shift": [frame.shift.x, frame.shift.y, frame.shift.z]});
            if !frame.points.is_empty() {
                out["points"] = places(&frame.points, &bounds, arrays).0;
            }
            let earlier = surface.fields.iter().zip(&frame.values);
            let values = earlier.map(|(field, own)| frame_values(field, own, &numbers, arrays));
            out["values"] = values.collect();
            out
        })
        .collect();
    let part = json!({
        "name": visible_text(&surface.name),
        "visibility": word_of(surface.visibility),
        "points": points,
        "triangles": arrays.integers(surface.triangles.as_flattened()),
        "cells": arrays.integers(&cells),
        "numbers": arrays.integers(&numbers),
        "edges": arrays.integers(surface.cell_edges().as_flattened()),
        "cellName": if surface.cell_name.is_empty() { "cell" } else { surface.cell_name },
        "numbering": if surface.numbering[1] == 0 { [0, 1] } else { surface.numbering },
        "fields": fields,
        "frames": frames,
    });
    (part, accuracy)
}

/// Places, axis by axis, in steps of the box around the surface at all times; and their largest error [mm].
fn places(points: &[Vec3], [low, high]: &[Vec3; 2], arrays: &mut Arrays) -> (Value, f64) {
    let mut error: f64 = 0.0;
    let axes = [0, 1, 2].map(|k| {
        let values: Vec<f64> = points.iter().map(|p| p[k]).collect();
        let (axis, off) = arrays.quantised(&values, [low[k], high[k]]);
        error = error.max(off);
        axis
    });
    (json!(axes), error)
}

/// Values in the order of points or of listed cells.
fn in_order(field: &Field, values: &[f64], numbers: &[u32]) -> Vec<f64> {
    match field.location {
        Location::Points => values.to_vec(),
        Location::Cells => {
            let value = |&number: &u32| values.get(number as usize).copied().unwrap_or(f64::NAN);
            numbers.iter().map(value).collect()
        }
    }
}

fn field(field: &Field, numbers: &[u32], arrays: &mut Arrays) -> Value {
    json!({
        "name": visible_text(&field.name),
        "cells": field.location == Location::Cells,
        "values": arrays.floats(&in_order(field, &field.values, numbers)),
    })
}

/// Values at an earlier step: in steps of their range.
fn frame_values(field: &Field, values: &[f64], numbers: &[u32], arrays: &mut Arrays) -> Value {
    let values = in_order(field, values, numbers);
    let limits = colors::limits(values.iter().copied(), false).unwrap_or_default();
    arrays.quantised(&values, limits).0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::viewer::arrays::tests::decoded;
    use crate::viewer::surface::Frame;

    /// A square of two triangles, which is raised by 1 in its second step.
    fn square() -> View {
        let points = [[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [2.0, 1.0, 1.0], [0.0, 1.0, 1.0]];
        let points: Vec<Vec3> = points.map(Vec3::from).into();
        let field = |name: &str, location, values: &[f64]| Field {
            name: name.into(),
            location,
            values: values.to_vec(),
            signed: false,
        };
        let surface = Surface {
            name: "sheet".into(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            // The second layer of two: cell 1.
            cells: vec![1, 1],
            cell_name: "element",
            numbering: [1, 2],
            fields: vec![
                field("t", Location::Points, &[1.0, 0.9, 0.8, 0.7]),
                field("p", Location::Cells, &[9.0, 0.25]),
            ],
            frames: vec![Frame {
                shift: Vec3::zeros(),
                points: points.iter().map(|p| p - Vec3::z()).collect(),
                values: vec![vec![1.0; 4], vec![9.0, 0.125]],
            }],
            points,
            ..Surface::default()
        };
        View {
            surfaces: vec![surface],
            steps: vec!["start".into(), "end".into()],
            symmetry: vec![(0, 0.0)],
            ..View::default()
        }
    }

    #[test]
    fn the_script_gets_what_the_view_has() {
        let mut arrays = Arrays::default();
        let text = description(&square(), &mut arrays);
        let part = &text["parts"][0];
        let read = |what: &Value| decoded(&arrays, what);
        let near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-12;
        assert!(read(&part["points"][0]).iter().zip(&[0.0, 2.0, 2.0, 0.0]).all(near));
        assert_eq!(read(&part["frames"][0]["points"][2]), [0.0; 4]);
        assert_eq!(read(&part["triangles"]), [0.0, 1.0, 2.0, 0.0, 2.0, 3.0]);
        assert_eq!((read(&part["cells"]), read(&part["numbers"])), (vec![0.0; 2], vec![1.0]));
        assert_eq!(read(&part["fields"][0]["values"])[1], f64::from(0.9_f32));
        assert_eq!(read(&part["fields"][1]["values"]), [0.25]);
        assert_eq!(read(&part["frames"][0]["values"][1]), [0.125]);
        assert_eq!(read(&part["edges"]).len(), 8);
        assert_eq!(
            (&part["mirrors"], &text["fields"][1]["limits"]),
            (&json!([[0, 0.0]]), &json!([0.125, 9.0]))
        );
        let accuracy = text["accuracy"].as_f64().unwrap();
        assert!((accuracy - 1.0 / 65534.0).abs() < 1e-12, "{accuracy}");
    }
}
