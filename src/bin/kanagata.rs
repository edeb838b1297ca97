//! CAD to tool models, audits, reports.
fn main() {}
