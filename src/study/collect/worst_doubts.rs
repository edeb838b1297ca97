//! Doubts about all cases of a study: one of each code.

use std::cmp::Ordering;

use super::row::Row;
use crate::LISTED_MAX;
use kanagata_report::doubt::Doubt;

/// The worst doubt of a code with its case, and all cases that have one.
struct Worst<'a> {
    doubt: &'a Doubt,
    case: &'a str,
    cases: Vec<&'a str>,
}

/// Doubts about all completed cases: of each code that which is farthest beyond its limit (the first of equal ones), with
/// the names of the other cases.
pub(super) fn worst_doubts(rows: &[Row<'_>]) -> Vec<Doubt> {
    let mut found: Vec<Worst<'_>> = Vec::new();
    for row in rows.iter().filter(|row| row.done()) {
        let case = row.case.id.as_str();
        for doubt in row.record.iter().flat_map(|record| &record.doubts) {
            match found.iter_mut().find(|worst| worst.doubt.code == doubt.code) {
                None => found.push(Worst { doubt, case, cases: vec![case] }),
                Some(worst) => {
                    if Excess::of(doubt).compare(&Excess::of(worst.doubt)).is_gt() {
                        (worst.doubt, worst.case) = (doubt, case);
                    }
                    if !worst.cases.contains(&case) {
                        worst.cases.push(case);
                    }
                }
            }
        }
    }
    found.into_iter().map(Worst::with_others).collect()
}

/// How far a value is beyond its limit, on either side.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Excess {
    /// The larger of value and limit over the smaller one; infinite if one of them is 0 or they differ in sign.
    factor: f64,
    /// |value - limit|, for equal factors.
    difference: f64,
}

impl Excess {
    /// The excess of a doubt. One without a limit has no number and is the least; one with a limit and no value has an
    /// infinite value.
    fn of(doubt: &Doubt) -> Self {
        match (doubt.value, doubt.limit) {
            (_, None) => Self { factor: 0.0, difference: 0.0 },
            (None, Some(_)) => Self { factor: f64::INFINITY, difference: f64::INFINITY },
            (Some(value), Some(limit)) => {
                let ratio = value / limit;
                let factor = if ratio > 0.0 { ratio.max(ratio.recip()) } else { f64::INFINITY };
                Self { factor, difference: (value - limit).abs() }
            }
        }
    }

    fn compare(&self, other: &Self) -> Ordering {
        let by_factor = self.factor.total_cmp(&other.factor);
        by_factor.then(self.difference.total_cmp(&other.difference))
    }
}

impl Worst<'_> {
    /// The doubt, whose place and text begin with its case, and the other cases in a sentence.
    fn with_others(self) -> Doubt {
        let Self { doubt, case, cases } = self;
        let rest: Vec<&str> = cases.into_iter().filter(|other| *other != case).collect();
        Doubt {
            place: format!("{case}: {}", doubt.place),
            text: format!("{case}: {}{}", doubt.text, others(&rest)),
            ..doubt.clone()
        }
    }
}

/// A sentence that names other cases with the same doubt; empty without any.
fn others(cases: &[&str]) -> String {
    let named = cases.iter().take(LISTED_MAX).copied().collect::<Vec<_>>().join(", ");
    match cases.len() {
        0 => String::new(),
        1 => format!(" The same doubt applies to {named}."),
        count if count <= LISTED_MAX => {
            format!(" The same doubt applies to {count} others: {named}.")
        }
        count => {
            let more = count - LISTED_MAX;
            format!(
                " The same doubt applies to {count} others: {named} and {more} more (study.csv)."
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_report::doubt::DoubtCode;

    /// The excess of a value over a limit.
    fn excess(value: f64, limit: f64) -> Excess {
        let code = DoubtCode::ThicknessBelowHalf;
        Excess::of(&Doubt::of(code, String::new(), [value, limit], String::new()))
    }

    #[test]
    fn the_worst_value_is_farthest_beyond_its_limit_on_either_side() {
        let none =
            Excess::of(&Doubt::new(DoubtCode::ThicknessBelowHalf, String::new(), String::new()));
        // From the least to the worst.
        for order in [
            // Above a maximum, and below a minimum.
            vec![none, excess(0.011, 0.01), excess(0.02, 0.01), excess(f64::INFINITY, 0.01)],
            vec![none, excess(0.45, 0.5), excess(0.2, 0.5), excess(0.0, 0.5), excess(-0.1, 0.5)],
            // A limit of zero, from above and from below.
            vec![none, excess(1.0, 0.0), excess(3.0, 0.0), excess(f64::INFINITY, 0.0)],
            vec![none, excess(-1.0, 0.0), excess(-3.0, 0.0)],
            // Both ends of a range: by the factor, not by the difference.
            vec![excess(2e6, 1e6), excess(50.0, 500.0), excess(2e7, 1e6), excess(5e-3, 500.0)],
            // Limits of several sizes.
            vec![excess(1.1, 1.0), excess(0.03, 0.02), excess(4.0, 2.0), excess(-1.0, -3.0)],
        ] {
            for pair in order.windows(2) {
                assert_eq!(pair[0].compare(&pair[1]), Ordering::Less, "{pair:?}");
                assert_eq!(pair[1].compare(&pair[0]), Ordering::Greater, "{pair:?}");
            }
        }
        assert_eq!(excess(1.0, 0.5).compare(&excess(1.0, 0.5)), Ordering::Equal);
    }

    #[test]
    fn other_cases_are_named_up_to_a_number() {
        let names = ["a", "b", "c", "d", "e", "f"];
        assert_eq!(others(&names[..2]), " The same doubt applies to 2 others: a, b.");
        assert!(others(&names).ends_with("6 others: a, b, c, d, e and 1 more (study.csv)."));
    }
}
