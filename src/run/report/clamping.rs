//! Blank holders in `report.html`: contact pressure over the process, and waves of the sheet between tools.

use kanagata_report::doubt::place_mm;
use kanagata_report::page::Page;
use kanagata_report::plot::{Plot, Series};
use kanagata_report::record::{History, HolderPressureRecord, RunRecord, WavesRecord};

/// Offset over the thickness below which the sheet counts as flat: elements that pass a radius stand off by as much.
const FLAT_REL: f64 = 0.02;

/// Writes the pressure under each blank holder over the travel of the moving tool; nothing without holders.
pub(super) fn pressures(
    page: &mut Page,
    record: &RunRecord,
    history: &History,
    (travelled, title): (&[f64], &str),
) {
    let holders = &record.holder_pressure;
    if holders.is_empty() || !history.has_pressures() {
        return;
    }
    page.heading("Pressure under the blank holder");
    page.text(
        "Mean: sum of the normal contact forces over the area of the nodes in contact. Largest: at one node, over the \
         area that belongs to it; it depends on the mesh where the contact is a line.",
    );
    let series = holders.iter().flat_map(|holder| curves(holder, history, travelled)).collect();
    page.plot(&Plot::lines(series, title, "contact pressure [MPa]"), 320);
    let rows: Vec<Vec<String>> = holders.iter().map(row).collect();
    let head = [
        "holder",
        "last increment pressed",
        "mean [MPa]",
        "largest [MPa]",
        "there",
        "largest of all increments [MPa]",
        "there",
        "increment",
    ];
    page.table(&head, &rows);
}

/// Mean and largest pressure of a holder.
fn curves(holder: &HolderPressureRecord, history: &History, travelled: &[f64]) -> Vec<Series> {
    let Some(tool) = history.tools.iter().position(|name| *name == holder.tool) else {
        return Vec::new();
    };
    let curve = |(k, what): (usize, &str)| Series {
        name: format!("{}, {what}", holder.tool),
        x: travelled.to_vec(),
        y: history.rows.iter().map(|row| row.pressure_mpa[tool][k]).collect(),
    };
    [(0, "mean"), (1, "largest")].map(curve).into()
}

fn row(holder: &HolderPressureRecord) -> Vec<String> {
    // Places do not break.
    let cell = |at: &[f64; 3]| place_mm(at).replace(' ', "\u{a0}");
    vec![
        holder.tool.clone(),
        holder.increment.to_string(),
        format!("{:.3}", holder.mean_mpa),
        format!("{:.3}", holder.max_mpa),
        cell(&holder.max_at_mm),
        format!("{:.3}", holder.peak.max_mpa),
        cell(&holder.peak.at_mm),
        holder.peak.increment.to_string(),
    ]
}

/// Waves between tools in a sentence.
pub(super) fn waves(found: &WavesRecord) -> String {
    let WavesRecord { largest, last } = found;
    if largest.offset_rel < FLAT_REL {
        return format!(
            "none: sheet under compression between two tools lies on one of them to {:.1} % of the thickness",
            100.0 * largest.offset_rel
        );
    }
    let later = if last.increment == largest.increment {
        String::new()
    } else {
        format!("; {:.3} mm in increment {}", last.offset_mm, last.increment)
    };
    format!("{largest}{later}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_report::record::{HistoryRow, PressurePeakRecord, WaveRecord};

    #[test]
    fn each_holder_has_two_curves_and_a_row() {
        let row = |increment: usize, mean: f64| HistoryRow {
            increment,
            stage: "draw".into(),
            time: 1.0,
            travel_mm: vec![0.0, 1.0],
            force_n: vec![0.0; 2],
            pressure_mpa: vec![[0.0; 2], [mean, 3.0 * mean]],
            iterations: 1,
            contacts: [0; 2],
            energy: Default::default(),
        };
        let tools = ["die", "ring"].map(str::to_owned).to_vec();
        let history = History { tools, rows: vec![row(1, 2.0), row(2, 2.5)] };
        let peak = PressurePeakRecord { increment: 1, max_mpa: 9.0, at_mm: [1.0, 0.0, 0.0] };
        let holder = HolderPressureRecord {
            tool: "ring".into(),
            increment: 2,
            mean_mpa: 2.5,
            area_mm2: 100.0,
            max_mpa: 7.5,
            max_at_mm: [4.0, 5.0, 6.0],
            peak,
        };
        let curves = curves(&holder, &history, &[0.5, 1.0]);
        assert_eq!(curves[0].y, [2.0, 2.5]);
        assert_eq!((curves[1].name.as_str(), &curves[1].y[..]), ("ring, largest", &[6.0, 7.5][..]));
        let record = RunRecord { holder_pressure: vec![holder], ..RunRecord::default() };
        let mut page = Page::new("a");
        pressures(&mut page, &record, &history, (&[0.5, 1.0], "travel of punch [mm]"));
        let html = page.html();
        assert!(
            html.contains("<td>(4.0,\u{a0}5.0,\u{a0}6.0)\u{a0}mm</td>")
                && html.contains(">9.000</td>")
        );
        let mut none = Page::new("a");
        pressures(&mut none, &RunRecord::default(), &history, (&[], ""));
        assert!(!none.html().contains("holder"));
    }

    #[test]
    fn waves_are_stated_with_their_place_and_tools_or_as_none() {
        let wave = |increment, offset_mm: f64| WaveRecord {
            increment,
            offset_mm,
            offset_rel: offset_mm / 0.8,
            at_mm: [1.0, 2.0, 3.0],
            tools: ["die", "ring"].map(str::to_owned),
        };
        let text = waves(&WavesRecord { largest: wave(4, 0.2), last: wave(9, 0.05) });
        assert_eq!(
            text,
            "0.200 mm off the nearer tool (25.0 % of the thickness) at (1.0, 2.0, 3.0) mm, between die and ring, increment 4; 0.050 mm in increment 9"
        );
        let text = waves(&WavesRecord { largest: wave(4, 0.01), last: wave(4, 0.01) });
        assert!(text.starts_with("none"), "{text}");
    }
}
