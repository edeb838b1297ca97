use super::*;

#[test]
fn every_embedded_card_is_read_names_its_source_and_builds() {
    let cards = library();
    assert_eq!(cards.len(), LIBRARY.len());
    for card in cards {
        assert!(!card.source.is_empty(), "{}", card.name);
        card.build(0.3).unwrap();
    }
}

#[test]
fn isotropy_follows_from_the_criterion() {
    let isotropic = |name: &str| find(name).unwrap().is_isotropic().unwrap();
    assert!(isotropic("sheet-ssnv501") && isotropic("structural-steel-hartloper-uvc"));
    assert!(!isotropic("mild-steel-neto2012") && !isotropic("aa2090-t3-barlat2005"));
    let steel = find("mild-steel-neto2012").unwrap();
    let with = |criterion| {
        let card = MaterialCard { criterion: Some(criterion), ..steel.clone() };
        card.is_isotropic().unwrap()
    };
    assert!(with(YieldCriterion::Hosford { exponent: 8.0 }));
    let mut first = [1.1; 9];
    assert!(with(YieldCriterion::Yld2004 { exponent: 6.0, first, second: [0.9; 9] }));
    first[8] = 1.101;
    assert!(!with(YieldCriterion::Yld2004 { exponent: 6.0, first, second: [0.9; 9] }));
    let elastic = MaterialCard { criterion: None, hardening: None, ..steel };
    assert!(elastic.is_isotropic().unwrap());
}

#[test]
fn cards_that_cannot_be_used_say_why() {
    let steel = find("mild-steel-neto2012").unwrap();
    assert!(find("unobtainium").unwrap_err().to_string().contains("mild-steel-neto2012"));
    let half = MaterialCard { hardening: None, ..steel.clone() };
    assert!(matches!(half.build(0.0), Err(CardError::Half { missing: "hardening", .. })));
    let soft = MaterialCard { poisson: 0.6, ..steel.clone() };
    let elastic = |card| MaterialCard { criterion: None, hardening: None, ..card };
    for card in [soft.clone(), elastic(soft)] {
        assert!(card.build(0.0).unwrap_err().to_string().contains("poisson: found 0.6"));
    }
    let backstresses = vec![BackstressCard { c_mpa: 1000.0, gamma: 10.0 }];
    let kinematic = MaterialCard { backstresses, ..elastic(steel) };
    assert!(matches!(kinematic.build(0.0), Err(CardError::Half { missing: "yield", .. })));
    assert!(serde_json::from_str::<MaterialCard>(r#"{"name":"x","young":1}"#).is_err());
}
/// The message about the card of the mild steel with other keys; empty for a card that is allowed.
fn said(change: &str) -> String {
    let mut card = serde_json::to_value(find("mild-steel-neto2012").unwrap()).unwrap();
    let change: serde_json::Value = serde_json::from_str(change).unwrap();
    for (key, value) in change.as_object().unwrap() {
        card[key] = value.clone();
    }
    let card: MaterialCard = serde_json::from_value(card).unwrap();
    card.build(0.0).err().map_or(String::new(), |e| e.to_string())
}

/// Compares messages with what they say after the name of the card.
fn are_named<const N: usize>(messages: [(String, &str); N]) {
    for (message, expected) in messages {
        assert_eq!(message, format!("material 'mild-steel-neto2012', {expected}"));
    }
}

#[test]
fn numbers_of_yield_criteria_out_of_range_are_named_by_their_keys() {
    let r = |r0: f64, r45: f64, r90: f64| {
        said(&format!(
            r#"{{"yield": {{"criterion": "hill48-r", "r0": {r0}, "r45": {r45}, "r90": {r90}}}}}"#
        ))
    };
    assert_eq!(r(0.7, 0.0, 0.7), "");
    are_named([
        (r(0.0, 1.0, 1.0), "yield.r0: found 0; allowed: above 0 and below 1e6"),
        (r(1.0, 1.0, -0.2), "yield.r90: found -0.2; allowed: above 0 and below 1e6"),
        (r(1.0, -0.1, 1.0), "yield.r45: found -0.1; allowed: 0 or above and below 1e6"),
        (
            said(
                r#"{"yield": {"criterion": "hill48", "f": 0.5, "g": 0.5, "h": -0.5, "l": 1.5, "m": 1.5, "n": 1.5}}"#,
            ),
            "yield.g + yield.h: found 0; allowed: above zero, for a convex yield surface",
        ),
        (
            said(r#"{"yield": {"criterion": "hosford", "exponent": 1}}"#),
            "yield.exponent: found 1; allowed: in [2, 60]",
        ),
        (
            said(
                r#"{"yield": {"criterion": "yld2004-18p", "exponent": 8, "first": [1,1,1,1,1,1,1,1,1],
                "second": [1,1,1,2000,1,1,1,1,1]}}"#,
            ),
            "yield.second[3] (c23): found 2000; allowed: in (-1000, 1000)",
        ),
    ]);
}

#[test]
fn numbers_of_hardening_and_elasticity_out_of_range_are_named_by_their_keys() {
    are_named([
        (
            said(r#"{"hardening": {"law": "swift", "k": 500, "eps0": 0.01, "n": 2}}"#),
            "hardening.n: found 2; allowed: in [0, 1]",
        ),
        (
            said(
                r#"{"hardening": {"law": "table", "strain": [0, 0.1, 0.05], "stress": [1, 2, 3]}}"#,
            ),
            "hardening.strain[2]: found 0.05; allowed: above the one before",
        ),
        (
            said(r#"{"backstresses": [{"c_mpa": 100, "gamma": 1}, {"c_mpa": 100, "gamma": -1}]}"#),
            "backstresses[1].gamma: found -1; allowed: zero or above",
        ),
        (said(r#"{"young_mpa": -1}"#), "young_mpa: found -1; allowed: above zero"),
    ]);
}
