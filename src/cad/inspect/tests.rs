//! Tests of summaries.

use std::collections::BTreeMap;

use super::text::entity_lines;

#[test]
fn every_entity_is_listed_in_lines_that_a_terminal_holds() {
    let entities: BTreeMap<String, usize> =
        (1..60).map(|k| (format!("ENTITY_NUMBER_{k:02}"), k)).collect();
    let lines = entity_lines(&entities);
    assert!(lines.len() > 10 && lines.iter().all(|l| l.len() <= 101), "{lines:?}");
    let all = lines.join(", ");
    assert_eq!(all.split(", ").count(), 59);
    assert!(all.contains("7 x ENTITY_NUMBER_07") && entity_lines(&BTreeMap::new()) == [""]);
}
