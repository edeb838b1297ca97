//! Springback in `report.html`: how far the sheet moves when the tools are released, and where.

use super::sheet::SPRINGBACK;
use kanagata_report::page::Page;
use kanagata_report::record::{NormalDisplacementRecord, RunRecord};

/// Writes the springback of a run that ends without tools.
pub(super) fn table(page: &mut Page, record: &RunRecord) {
    let Some(found) = &record.springback else { return };
    page.heading("Springback");
    let from = found.from_increment.map_or_else(String::new, |at| format!(" (increment {at})"));
    page.text(&format!(
        "The sheet at the end against its shape in the last equilibrium with tools{from}. It is moved rigidly, as far as \
         its constraints and symmetry planes permit, to the best fit with that shape. The field \u{201c}{SPRINGBACK}\u{201d} of the view \
         above is the displacement of each node along the normal of the loaded sheet, positive towards the upper face."
    ));
    let place = |peak: &NormalDisplacementRecord| format!("{peak}, node {}", peak.node);
    let mut rows = vec![("largest displacement", format!("{:.3} mm", found.largest_mm))];
    rows.push(("RMS of the displacement", format!("{:.3} mm", found.rms_mm)));
    rows.extend(found.normal_max.as_ref().map(|p| ("largest along the normal", place(p))));
    rows.extend(found.normal_min.as_ref().map(|p| ("smallest along the normal", place(p))));
    rows.push(("released force, all tools", format!("{:.1} N", found.force_n)));
    rows.push(("released elastic energy", format!("{:.0} N mm", found.energy_nmm)));
    let limit = record.quality.and_then(|quality| quality.max_springback_mm);
    rows.extend(limit.map(|limit| {
        let kept = if found.largest_mm > limit { "exceeded" } else { "kept" };
        ("limit of the largest displacement", format!("{limit} mm, {kept}"))
    }));
    let rows: Vec<Vec<String>> =
        rows.into_iter().map(|(name, value)| vec![name.to_owned(), value]).collect();
    page.table(&["", ""], &rows);
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_report::record::{Quality, SpringbackRecord};

    #[test]
    fn the_extremes_have_their_sign_node_and_place_and_the_limit_its_verdict() {
        let peak = |displacement_mm, node| NormalDisplacementRecord {
            displacement_mm,
            node,
            at_mm: [1.0, 2.0, 3.0],
        };
        let springback = SpringbackRecord {
            largest_mm: 1.5,
            rms_mm: 0.5,
            force_n: 10.0,
            energy_nmm: 20.0,
            from_increment: Some(7),
            normal_max: Some(peak(1.25, 12)),
            normal_min: Some(peak(-0.5, 3)),
        };
        let quality = Quality { max_springback_mm: Some(1.0), ..Quality::default() };
        let record = RunRecord {
            springback: Some(springback),
            quality: Some(quality),
            ..RunRecord::default()
        };
        let mut page = Page::new("a");
        table(&mut page, &record);
        let html = page.html();
        for text in [
            "+1.250 mm at (1.0, 2.0, 3.0) mm, node 12",
            "-0.500</span> mm at (1.0, 2.0, 3.0) mm, node 3",
            "1 mm, exceeded",
            "(increment 7)",
        ] {
            assert!(html.contains(text), "{text}");
        }
        let mut page = Page::new("a");
        table(&mut page, &RunRecord::default());
        assert!(!page.html().contains("Springback"));
    }
}
