//! Arrays of numbers inside a page, as the script of the page reads them.
//!
//! Integers are stored as differences to the number before. All numbers are stored as planes: first the lowest byte of
//! each, then the second, and so on. Planes are compressed by zlib and written in base64. Equal arrays of a page are
//! stored once.

use std::collections::HashMap;
use std::io::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use serde_json::{Value, json};

/// Largest code of a quantised number; the code above it stands for a missing value.
const CODE_MAX: f64 = 65534.0;
/// Code of a missing value.
const MISSING: u16 = u16::MAX;

/// The arrays of a page.
#[derive(Debug, Clone, Default)]
pub(crate) struct Arrays {
    texts: Vec<String>,
    known: HashMap<Vec<u8>, usize>,
}

impl Arrays {
    /// The arrays in base64.
    pub(crate) fn texts(&self) -> &[String] {
        &self.texts
    }

    fn add(&mut self, planes: Vec<u8>) -> usize {
        if let Some(&known) = self.known.get(&planes) {
            return known;
        }
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
        // Writing to memory does not fail.
        let _ = encoder.write_all(&planes);
        self.texts.push(STANDARD.encode(encoder.finish().unwrap_or_default()));
        self.known.insert(planes, self.texts.len() - 1);
        self.texts.len() - 1
    }

    /// Adds whole numbers: its description for the script.
    pub(super) fn integers(&mut self, values: &[u32]) -> Value {
        let mut last = 0;
        let differences = values.iter().map(|&v| v.wrapping_sub(std::mem::replace(&mut last, v)));
        let at = self.add(planes(&differences.map(u32::to_le_bytes).collect::<Vec<_>>()));
        json!({"kind": "u32", "array": at, "count": values.len()})
    }

    /// Adds numbers in single precision; those that are not finite are missing.
    pub(super) fn floats(&mut self, values: &[f64]) -> Value {
        let single = |&v: &f64| if v.is_finite() { v as f32 } else { f32::NAN };
        let bytes: Vec<[u8; 4]> = values.iter().map(|v| single(v).to_le_bytes()).collect();
        let at = self.add(planes(&bytes));
        json!({"kind": "f32", "array": at, "count": values.len()})
    }

    /// Adds numbers in 65535 even steps over `range`, which contains them: the description and the largest error.
    pub(super) fn quantised(&mut self, values: &[f64], [low, high]: [f64; 2]) -> (Value, f64) {
        let step = if high > low { (high - low) / CODE_MAX } else { 0.0 };
        let code = |v: f64| match step {
            _ if !v.is_finite() => MISSING,
            0.0 => 0,
            step => ((v - low) / step).round().clamp(0.0, CODE_MAX) as u16,
        };
        let mut last = 0;
        let codes = values.iter().map(|&v| code(v));
        let differences = codes.map(|v| v.wrapping_sub(std::mem::replace(&mut last, v)));
        let at = self.add(planes(&differences.map(u16::to_le_bytes).collect::<Vec<_>>()));
        let text =
            json!({"kind": "u16", "array": at, "count": values.len(), "low": low, "step": step});
        (text, 0.5 * step)
    }
}

/// The lowest bytes of all numbers, then the second, and so on.
fn planes<const N: usize>(numbers: &[[u8; N]]) -> Vec<u8> {
    (0..N).flat_map(|k| numbers.iter().map(move |bytes| bytes[k])).collect()
}

#[cfg(test)]
pub(super) mod tests {
    use std::io::Read as _;

    use super::*;

    /// The numbers of an array, read as the script does.
    pub(in crate::viewer) fn decoded(arrays: &Arrays, what: &Value) -> Vec<f64> {
        let text = &arrays.texts[what["array"].as_u64().unwrap() as usize];
        let packed = STANDARD.decode(text).unwrap();
        let mut planes = Vec::new();
        flate2::read::ZlibDecoder::new(&packed[..]).read_to_end(&mut planes).unwrap();
        let count = what["count"].as_u64().unwrap() as usize;
        let number = |k: usize| {
            (0..planes.len() / count.max(1))
                .map(|p| u32::from(planes[p * count + k]) << (8 * p))
                .sum::<u32>()
        };
        let mut last = 0_u32;
        let numbers = (0..count).map(|k| match what["kind"].as_str().unwrap() {
            "f32" => f64::from(f32::from_bits(number(k))),
            "u32" => {
                last = last.wrapping_add(number(k));
                f64::from(last)
            }
            _ => {
                last = last.wrapping_add(number(k)) & 0xffff;
                let [low, step] = ["low", "step"].map(|key| what[key].as_f64().unwrap());
                if last == 0xffff { f64::NAN } else { low + step * f64::from(last) }
            }
        });
        numbers.collect()
    }

    #[test]
    fn numbers_come_back_within_their_accuracy() {
        let mut arrays = Arrays::default();
        let ids = [7, 0, u32::MAX, 3];
        let integers = arrays.integers(&ids);
        assert_eq!(decoded(&arrays, &integers), ids.map(f64::from));
        let values = [0.1, -3e5, f64::NAN, f64::INFINITY];
        let floats = arrays.floats(&values);
        let back = decoded(&arrays, &floats);
        assert_eq!(back[..2], [f64::from(0.1_f32), -3e5]);
        assert!(back[2].is_nan() && back[3].is_nan());
        let (quantised, error) = arrays.quantised(&[-1.0, 0.123, f64::NAN, 2.0], [-1.0, 2.0]);
        let back = decoded(&arrays, &quantised);
        assert!((error - 1.5 / 65534.0).abs() < 1e-12 && (back[1] - 0.123).abs() <= error);
        assert!(back[0] == -1.0 && back[2].is_nan() && (back[3] - 2.0).abs() < 1e-12);
        let (flat, error) = arrays.quantised(&[5.0, 5.0], [5.0, 5.0]);
        assert_eq!((decoded(&arrays, &flat), error), (vec![5.0, 5.0], 0.0));
    }

    #[test]
    fn equal_arrays_are_stored_once() {
        let mut arrays = Arrays::default();
        let (a, b) = (arrays.floats(&[1.0, 2.0]), arrays.floats(&[1.0, 2.0]));
        assert_eq!((a, arrays.texts().len()), (b, 1));
        arrays.floats(&[]);
        assert_eq!(arrays.texts().len(), 2);
    }
}
