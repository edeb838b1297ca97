//! Units of a representation context.

use super::entity::{Attributes, Entity, Outcome};
use super::resolver::{Resolver, Units};
use super::table::Value;
use crate::Severity;

/// Units of a context, and the name of the unit of length.
#[derive(Debug, Clone)]
pub struct Context {
    /// Factors to mm and rad.
    pub units: Units,
    /// Name of the unit of length.
    pub name: String,
    /// Smallest significant distance [mm], if stated.
    pub resolution: f64,
}

impl<'t> Resolver<'t> {
    /// Units and uncertainty of a representation context.
    pub fn context(&self, e: Entity<'t>) -> Outcome<Context> {
        let mut context = Context {
            units: Units { length: 1.0, angle: 1.0 },
            name: String::new(),
            resolution: 0.0,
        };
        if let Some(part) = e.part("GLOBAL_UNIT_ASSIGNED_CONTEXT") {
            for unit in part.entities(part.len().saturating_sub(1))? {
                if unit.has("LENGTH_UNIT") {
                    (context.units.length, context.name) = self.unit(unit, 1000.0, 0)?;
                } else if unit.has("PLANE_ANGLE_UNIT") {
                    context.units.angle = self.unit(unit, 1.0, 0)?.0;
                }
            }
        }
        if context.name.is_empty() {
            context.name = "mm (assumed)".into();
            let text = "no unit of length is given: millimetres are assumed".into();
            self.note(Severity::Warning, "unit-missing", e.place(), text);
        }
        if let Some(part) = e.part("GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT") {
            context.resolution = self.uncertainty(&part).unwrap_or(0.0);
        }
        Ok(context)
    }

    /// `UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(x), unit, name, description)`.
    fn uncertainty(&self, part: &Attributes<'t>) -> Outcome<f64> {
        for measure in part.entities(part.len().saturating_sub(1))? {
            let a = measure.attributes();
            let unit = a.entity(1)?;
            if unit.has("LENGTH_UNIT") {
                return Ok(a.real(0)? * self.unit(unit, 1000.0, 0)?.0);
            }
        }
        Ok(0.0)
    }

    /// Factor of a unit: SI with prefix, or conversion based. `base` is the size of the underlying SI unit.
    fn unit(&self, e: Entity<'t>, base: f64, depth: usize) -> Outcome<(f64, String)> {
        self.charge(e, depth, 0)?;
        if let Some(a) = e.part("SI_UNIT") {
            // In a simple instance (invalid, but in use) the inherited dimensions come first.
            let k = a.len().saturating_sub(2);
            let prefix = a.enumeration(k).unwrap_or("");
            let name = a.enumeration(k + 1).unwrap_or("").to_lowercase();
            let factor = si_prefix(prefix).ok_or_else(|| {
                e.fault(format!("prefix .{prefix}."), "an SI prefix from ATTO to EXA")
            })?;
            return Ok((base * factor, format!("{}{name}", prefix.to_lowercase())));
        }
        let Some(a) = e.part("CONVERSION_BASED_UNIT") else {
            return Err(e.fault("neither SI_UNIT nor CONVERSION_BASED_UNIT", "one of them"));
        };
        let measure = a.entity(a.len().saturating_sub(1))?;
        let name = a.text(a.len().saturating_sub(2));
        let m = measure.attributes();
        let factor = m.real(0)? * self.unit(m.entity(1)?, base, depth + 1)?.0;
        if factor > 0.0 && factor.is_finite() {
            return Ok((factor, name));
        }
        Err(measure.fault(format!("factor {factor}"), "a factor above 0"))
    }
}

fn si_prefix(name: &str) -> Option<f64> {
    Some(match name {
        "" => 1.0,
        "EXA" => 1e18,
        "PETA" => 1e15,
        "TERA" => 1e12,
        "GIGA" => 1e9,
        "MEGA" => 1e6,
        "KILO" => 1e3,
        "HECTO" => 1e2,
        "DECA" => 1e1,
        "DECI" => 1e-1,
        "CENTI" => 1e-2,
        "MILLI" => 1e-3,
        "MICRO" => 1e-6,
        "NANO" => 1e-9,
        "PICO" => 1e-12,
        "FEMTO" => 1e-15,
        "ATTO" => 1e-18,
        _ => return None,
    })
}

/// Text of element `k` of a header part.
#[must_use]
pub fn header_text(values: &[Value], k: usize) -> String {
    match values.get(k) {
        Some(Value::Text(raw)) => super::lexer::decode(raw),
        _ => String::new(),
    }
}
