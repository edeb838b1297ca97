//! Numbers with units on the command line: `0.01mm`, `0.5deg`.

/// Parses a length [mm]; without unit in mm.
pub(super) fn length_mm(text: &str) -> Result<f64, String> {
    positive(text, &[("mm", 1.0), ("um", 1e-3), ("cm", 10.0), ("in", 25.4), ("m", 1000.0)])
}

/// Parses a length other than zero, which may be negative [mm]; without unit in mm.
pub(super) fn signed_length_mm(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let (sign, size) = match text.strip_prefix('-') {
        Some(size) => (-1.0, size),
        None => (1.0, text.strip_prefix('+').unwrap_or(text)),
    };
    let size = length_mm(size).map_err(|e| e.replace("above zero", "other than zero"))?;
    Ok(sign * size)
}

/// Parses an angle [degrees]; without unit in degrees.
pub(super) fn angle_deg(text: &str) -> Result<f64, String> {
    positive(text, &[("deg", 1.0), ("rad", 180.0 / std::f64::consts::PI)])
}

/// Parses a time [s]; without unit in seconds.
pub(super) fn time_s(text: &str) -> Result<f64, String> {
    positive(text, &[("ms", 1e-3), ("min", 60.0), ("h", 3600.0), ("s", 1.0)])
}

fn positive(text: &str, units: &[(&str, f64)]) -> Result<f64, String> {
    let found = units.iter().find_map(|(name, size)| Some((text.strip_suffix(name)?, *size)));
    let (number, size) = found.unwrap_or((text, 1.0));
    let names: Vec<&str> = units.iter().map(|u| u.0).collect();
    match number.trim().parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value * size),
        _ => Err(format!(
            "allowed: a number above zero, with or without a unit ({})",
            names.join(", ")
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_take_their_units() {
        assert_eq!(length_mm("0.01"), Ok(0.01));
        assert_eq!(length_mm("0.01mm"), Ok(0.01));
        assert_eq!(length_mm("2 in"), Ok(50.8));
        assert_eq!(length_mm("1.5m"), Ok(1500.0));
        assert_eq!(angle_deg("0.5deg"), Ok(0.5));
        assert_eq!((time_s("2"), time_s("10 s"), time_s("1.5min")), (Ok(2.0), Ok(10.0), Ok(90.0)));
        assert_eq!(signed_length_mm("-0.8mm"), Ok(-0.8));
        assert_eq!(signed_length_mm("+0.1in"), Ok(2.54));
        for bad in ["", "-", "0", "-0mm", "--1", "-nan"] {
            assert!(signed_length_mm(bad).unwrap_err().contains("other than zero"), "{bad}");
        }
        for bad in ["", "mm", "0", "-1mm", "1ft", "nan", "inf"] {
            assert!(length_mm(bad).unwrap_err().contains("above zero"), "{bad}");
        }
    }
}
