//! What the scripts of a page read: values of plots, scenes of 3-D views, and the arrays of the page.
#![allow(dead_code, reason = "not every test needs all of it")]

use std::io::Read as _;

use base64::Engine as _;
use serde_json::Value;

/// Contents of the page's script elements with this attribute, in order.
pub fn data(html: &str, attribute: &str) -> Vec<Value> {
    let open = format!("<script type=\"application/json\" {attribute}>");
    let starts = html.match_indices(&open).map(|(at, _)| at + open.len());
    let ends = starts.map(|at| &html[at..at + html[at..].find("</script>").unwrap()]);
    ends.map(|text| serde_json::from_str(text).unwrap()).collect()
}

/// Values of the plots on a page.
pub fn plots(html: &str) -> Vec<Value> {
    data(html, "class=\"values\"")
}

/// 3-D views of a page.
pub fn views(html: &str) -> Vec<Value> {
    data(html, "class=\"scene\"")
}

/// A JSON array of numbers.
pub fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

/// The arrays of a page.
pub struct Arrays(Vec<Value>);

impl Arrays {
    pub fn of(html: &str) -> Self {
        let [all] = &data(html, "id=\"arrays\"")[..] else { panic!("one list of arrays") };
        Self(all.as_array().unwrap().clone())
    }

    /// The numbers of an array, by its description.
    pub fn read(&self, what: &Value) -> Vec<f64> {
        let text = self.0[what["array"].as_u64().unwrap() as usize].as_str().unwrap();
        let packed = base64::engine::general_purpose::STANDARD.decode(text).unwrap();
        let mut planes = Vec::new();
        flate2::read::ZlibDecoder::new(&packed[..]).read_to_end(&mut planes).unwrap();
        let count = what["count"].as_u64().unwrap() as usize;
        let width = planes.len() / count.max(1);
        let whole =
            |k: usize| (0..width).map(|p| u32::from(planes[p * count + k]) << (8 * p)).sum::<u32>();
        let mut last = 0_u32;
        let mut add = |k: usize, mask: u32| {
            last = last.wrapping_add(whole(k)) & mask;
            last
        };
        let number = |key: &str| what[key].as_f64().unwrap();
        let values = (0..count).map(|k| match what["kind"].as_str().unwrap() {
            "f32" => f64::from(f32::from_bits(whole(k))),
            "u32" => f64::from(add(k, u32::MAX)),
            _ => match add(k, 0xffff) {
                0xffff => f64::NAN,
                code => number("low") + number("step") * f64::from(code),
            },
        });
        values.collect()
    }
}
