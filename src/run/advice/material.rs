//! Materials that no sheet is made of.

use super::finding::Finding;
use crate::report::doubt::DoubtCode;
use crate::solver::material::card::MaterialCard;
use crate::solver::material::hardening::Hardening;

/// Plastic strain at which the flow stress is taken.
pub(super) const EARLY: f64 = 0.002;
/// Flow stress there over Young's modulus of what sheets are made of: lead has 4e-4, hard spring steel 0.01.
const ELASTIC: [f64; 2] = [5e-5, 0.03];

/// Largest plastic strain of a hardening table: hydraulic bulge and torsion tests end below 2; a curve in per cent goes to 10 and
/// more.
const LARGEST_STRAIN: f64 = 3.0;

/// Young's moduli [MPa] of what is formed: a soft polymer has 1000, tungsten 4.1e5.
const YOUNG: [f64; 2] = [500.0, 1e6];

/// A remark on a Young's modulus that no sheet has, on a hardening table in per cent, or on a flow stress that does not go with
/// the modulus.
pub(super) fn remark(card: &MaterialCard) -> Option<Finding> {
    young_modulus(card).or_else(|| table_strain(card)).or_else(|| flow_stress(card))
}

fn doubt(place: &str, what: String, remedy: &str) -> Finding {
    Finding::doubt(DoubtCode::MaterialUnits, place.into(), what, remedy.into())
}

fn young_modulus(card: &MaterialCard) -> Option<Finding> {
    if (YOUNG[0]..=YOUNG[1]).contains(&card.young_mpa) {
        return None;
    }
    let limit = YOUNG[usize::from(card.young_mpa > YOUNG[1])];
    let finding = doubt(
        "material.young_mpa",
        format!(
            "Material '{}' has a Young's modulus of {:e} MPa; sheet metals have 4e4 to 4e5.",
            card.name, card.young_mpa
        ),
        "Check the unit: stresses are in MPa (steel 2.1e5, aluminium 7e4).",
    );
    Some(finding.exceeds([card.young_mpa, limit]))
}

fn table_strain(card: &MaterialCard) -> Option<Finding> {
    let Some(Hardening::Table { strain, .. }) = &card.hardening else { return None };
    let last = strain.last().filter(|last| **last > LARGEST_STRAIN)?;
    let finding = doubt(
        "material.hardening.strain",
        format!(
            "The hardening table of material '{}' goes to a plastic strain of {last}; sheets fracture below {LARGEST_STRAIN}.",
            card.name
        ),
        "Strains are ratios, not per cent: divide them by 100.",
    );
    Some(finding.exceeds([*last, LARGEST_STRAIN]))
}

fn flow_stress(card: &MaterialCard) -> Option<Finding> {
    let (stress, _) = card.tension(EARLY)?;
    let ratio = stress / card.young_mpa;
    if (ELASTIC[0]..=ELASTIC[1]).contains(&ratio) {
        return None;
    }
    let finding = doubt(
        "material.hardening",
        format!(
            "Material '{}' has a flow stress of {stress:.4} MPa at a plastic strain of {EARLY}, {ratio:.2e} of its Young's modulus ({:.4} MPa); metals have {:.0e} to {}.",
            card.name, card.young_mpa, ELASTIC[0], ELASTIC[1]
        ),
        "Check the units: both are in MPa.",
    );
    Some(finding.exceeds([ratio, ELASTIC[usize::from(ratio > ELASTIC[1])]]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::material::card;

    #[test]
    fn slips_of_units_are_seen_and_published_sheets_are_not() {
        for card in card::library() {
            assert_eq!(remark(&card), None, "{}", card.name);
        }
        let steel = card::find("mild-steel-neto2012").unwrap();
        for unit in [1e-3, 1e3] {
            let found =
                remark(&MaterialCard { young_mpa: steel.young_mpa * unit, ..steel.clone() });
            assert!(found.unwrap().to_string().contains("Check the unit"));
        }
        let mut pascals = MaterialCard { young_mpa: 2.1e11, ..steel };
        pascals.hardening = Some(Hardening::Swift { k: 5.3e8, eps0: 0.0044, n: 0.27 });
        assert!(remark(&pascals).unwrap().to_string().contains("modulus of 2.1e11 MPa"));
    }
}
