//! Curves as polylines and the boundary curves of each surface as read by gmsh, from a mesh (MSH 4.1, ASCII) of the
//! curves.

use std::collections::BTreeMap;

use crate::MeshError;
use crate::io::cursor::Cursor;
use kanagata_geometry::Vec3;

/// Curves and surfaces by gmsh tag.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Outline {
    /// Curves.
    pub curves: BTreeMap<i64, Curve>,
    /// Curves of all loops of each surface, without orientation.
    pub surfaces: BTreeMap<i64, Vec<i64>>,
}

/// A curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Point tags at start and end; equal for a closed curve.
    pub ends: [i64; 2],
    /// Equidistant points, including the ends.
    pub line: Vec<Vec3>,
}

impl Curve {
    /// Length [mm].
    #[must_use]
    pub fn length(&self) -> f64 {
        self.line.windows(2).map(|w| (w[1] - w[0]).norm()).sum()
    }

    /// Turning angle of the tangent [rad]: sum of the angles between chords, plus half an angle at each end.
    #[must_use]
    pub fn turn(&self) -> f64 {
        let chords: Vec<Vec3> = self.line.windows(2).map(|w| w[1] - w[0]).collect();
        let angles: Vec<f64> = chords.windows(2).map(|w| w[0].angle(&w[1])).collect();
        let ends = angles.first().zip(angles.last()).map_or(0.0, |(a, b)| 0.5 * (a + b));
        angles.iter().sum::<f64>() + ends
    }
}

/// Parses the sections of entities and nodes.
///
/// # Errors
/// [`MeshError::Invalid`] with the line, the finding and the admissible values.
pub fn parse(bytes: &[u8], file: &str) -> Result<Outline, MeshError> {
    let mut cursor = Cursor::new(bytes, file);
    let mut points = BTreeMap::new();
    let mut out = Outline::default();
    while let Some(line) = cursor.line() {
        match line {
            "$Entities" => {
                entities(&mut cursor, &mut points, &mut out)?;
                cursor.skip_past(b"$EndEntities");
            }
            "$Nodes" => {
                nodes(&mut cursor, &points, &mut out)?;
                cursor.skip_past(b"$EndNodes");
            }
            _ => {}
        }
    }
    if out.surfaces.is_empty() {
        return Err(cursor.error("no surfaces in $Entities", "a mesh (MSH 4.1) of a CAD file"));
    }
    Ok(out)
}

fn entities(
    cursor: &mut Cursor<'_>,
    points: &mut BTreeMap<i64, Vec3>,
    out: &mut Outline,
) -> Result<(), MeshError> {
    let [of_points, of_curves, of_surfaces] = [cursor.size()?, cursor.size()?, cursor.size()?];
    cursor.size()?;
    for _ in 0..of_points {
        let tag = cursor.int()?;
        points.insert(tag, Vec3::new(cursor.float()?, cursor.float()?, cursor.float()?));
        list(cursor)?;
    }
    for (dimension, count) in [(1, of_curves), (2, of_surfaces)] {
        for _ in 0..count {
            let tag = cursor.int()?;
            (0..6).try_for_each(|_| cursor.float().map(|_| ()))?;
            list(cursor)?;
            let around = list(cursor)?;
            if dimension == 2 {
                out.surfaces.insert(tag, around);
            } else if let [a, b] = around[..] {
                out.curves.insert(tag, Curve { ends: [a, b], line: Vec::new() });
            } else if let [a] = around[..] {
                out.curves.insert(tag, Curve { ends: [a, a], line: Vec::new() });
            }
        }
    }
    Ok(())
}

/// A counted list of numbers, without signs.
fn list(cursor: &mut Cursor<'_>) -> Result<Vec<i64>, MeshError> {
    let mut out = Vec::new();
    for _ in 0..cursor.size()? {
        out.push(cursor.int()?.saturating_abs());
    }
    Ok(out)
}

fn nodes(
    cursor: &mut Cursor<'_>,
    points: &BTreeMap<i64, Vec3>,
    out: &mut Outline,
) -> Result<(), MeshError> {
    let blocks = cursor.size()?;
    (0..3).try_for_each(|_| cursor.size().map(|_| ()))?;
    for _ in 0..blocks {
        let (dimension, tag, parametric) = (cursor.int()?, cursor.int()?, cursor.int()?);
        let count = cursor.size()?;
        (0..count).try_for_each(|_| cursor.size().map(|_| ()))?;
        let mut line = Vec::new();
        for _ in 0..count {
            line.push(Vec3::new(cursor.float()?, cursor.float()?, cursor.float()?));
            if parametric != 0 {
                (0..dimension.clamp(0, 3)).try_for_each(|_| cursor.float().map(|_| ()))?;
            }
        }
        if let Some(curve) = out.curves.get_mut(&tag).filter(|_| dimension == 1) {
            let end = |k: usize| points.get(&curve.ends[k]).copied();
            curve.line = end(0).into_iter().chain(line).chain(end(1)).collect();
        }
    }
    for curve in out.curves.values_mut().filter(|c| c.line.is_empty()) {
        curve.line = curve.ends.iter().filter_map(|p| points.get(p).copied()).collect();
    }
    Ok(())
}
