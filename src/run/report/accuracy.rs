//! Estimated errors in `report.html`, and the runs that they come from.

use kanagata_report::page::Page;
use kanagata_report::plot::{Axis, Plot, Series};
use kanagata_report::record::{AccuracyRecord, QuantityRecord, SequenceRunRecord};

/// Writes the estimated errors of a run that ends a sequence.
pub(super) fn errors(page: &mut Page, record: &AccuracyRecord) {
    page.heading("Estimated errors");
    page.text(&format!(
        "Errors from {} runs: {}. Parts: mesh by extrapolation with the observed order of convergence; points and layers by \
         refining each on a coarse mesh; increments by the estimate of the last run; together as the root of the sum of the squares. The runs took {:.1} s of processor time, {:.2} times the last of them.",
        record.runs.len(),
        record.end.in_words().0,
        record.cpu_s,
        record.cpu_s / record.last_cpu_s.max(f64::MIN_POSITIVE)
    ));
    let head = [
        "quantity",
        "value",
        "estimated error",
        "allowed",
        "mesh",
        "increments",
        "points",
        "layers",
        "order",
    ];
    let rows: Vec<Vec<String>> = record.quantities.iter().map(quantity).collect();
    page.table(&head, &rows);
    for name in &record.unmeasured {
        page.text(&format!(
            "The error of {name} is not known: the run with finer {name} did not converge, or would have exceeded time or memory."
        ));
    }
    convergence(page, record);
    let quantities: Vec<&str> = record.quantities.iter().map(|q| q.name.as_str()).collect();
    let mut head = vec!["run", "purpose", "model", "unknowns", "processor time [s]"];
    head.extend(&quantities);
    let rows: Vec<Vec<String>> =
        record.runs.iter().enumerate().map(|(k, run)| row(k, run, &quantities)).collect();
    page.table(&head, &rows);
}

fn quantity(q: &QuantityRecord) -> Vec<String> {
    let number = |x: f64| format!("{x:.4} {}", q.unit);
    let part = |name: &str| q.parts.get(name).map_or_else(|| "-".into(), |x| number(*x));
    vec![
        q.name.clone(),
        number(q.value),
        q.error.map_or_else(|| "not known".into(), number),
        q.allowed.map_or_else(|| "-".into(), number),
        part("mesh"),
        part("increments"),
        part("points"),
        part("layers"),
        q.order.map_or_else(|| "-".into(), |order| format!("{order:.2}")),
    ]
}

fn row(k: usize, run: &SequenceRunRecord, quantities: &[&str]) -> Vec<String> {
    let mut cells = vec![
        (k + 1).to_string(),
        run.purpose.clone(),
        run.model.clone(),
        run.unknowns.to_string(),
        format!("{:.2}", run.cpu_s),
    ];
    let value =
        |name: &&str| run.values.get(*name).map_or_else(|| "-".into(), |x| format!("{x:.4}"));
    cells.extend(quantities.iter().map(value));
    cells
}

/// Change of every quantity from mesh to mesh, over the unknowns of the finer one.
fn convergence(page: &mut Page, record: &AccuracyRecord) {
    let meshes: Vec<&SequenceRunRecord> =
        record.runs.iter().filter(|run| run.purpose == "mesh" && !run.changes.is_empty()).collect();
    let curve = |q: &QuantityRecord| {
        let scale = 100.0 / q.value.abs().max(f64::MIN_POSITIVE);
        let points = meshes
            .iter()
            .filter_map(|run| Some((run.unknowns as f64, scale * run.changes.get(&q.name)?)));
        let (x, y) = points.unzip();
        Series { name: q.name.clone(), x, y }
    };
    let mut plot = Plot::lines(record.quantities.iter().map(curve).collect(), "", "");
    plot.x = Axis { title: "unknowns of the finer mesh".into(), log: true };
    plot.y = Axis { title: "change from the coarser mesh [% of the value]".into(), log: true };
    if meshes.len() > 1 {
        page.plot(&plot, 360);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn errors_and_runs_are_tabulated() {
        let quantity = QuantityRecord {
            name: "thickness".into(),
            unit: "mm".into(),
            value: 0.75,
            error: Some(0.0123),
            allowed: Some(0.01),
            parts: BTreeMap::from([("mesh".into(), 0.0111), ("layers".into(), 0.0012)]),
            order: Some(1.5),
        };
        let run = |unknowns, change| SequenceRunRecord {
            purpose: "mesh".into(),
            model: "8 x 8 elements".into(),
            unknowns,
            values: BTreeMap::from([("thickness".into(), 0.74)]),
            changes: BTreeMap::from([("thickness".into(), change)]),
            ..SequenceRunRecord::default()
        };
        let record = AccuracyRecord {
            quantities: vec![quantity],
            runs: vec![run(1000, 0.05), run(4000, 0.02)],
            unmeasured: vec!["layers".into()],
            ..AccuracyRecord::default()
        };
        let mut page = Page::new("a");
        errors(&mut page, &record);
        let text = page.html();
        for expected in
            ["0.0123 mm", "0.0111 mm", "1.50", "8 x 8 elements", "did not converge", "<svg"]
        {
            assert!(text.contains(expected), "{expected}");
        }
    }
}
