//! Implausible material data.

use super::finding::Finding;
use kanagata_report::doubt::DoubtCode;
use kanagata_solver::material::card::MaterialCard;
use kanagata_solver::material::hardening::Hardening;

/// Plastic strain at which the flow stress is evaluated.
pub(super) const FLOW_STRESS_STRAIN: f64 = 0.002;
/// Range of the flow stress over Young's modulus. Lead has 4e-4, hard spring steel 0.01.
const FLOW_STRESS_RANGE_REL: [f64; 2] = [5e-5, 0.03];

/// Largest plausible plastic strain of a hardening table. Hydraulic bulge and torsion tests end below 2; a curve in per
/// cent extends to 10 and more.
const TABLE_STRAIN_MAX: f64 = 3.0;

/// Range of Young's moduli [MPa]: a soft polymer has 1000, tungsten 4.1e5.
const YOUNG_RANGE_MPA: [f64; 2] = [500.0, 1e6];

/// A doubt about Young's modulus, about a hardening table in per cent, or about a flow stress that does not fit the
/// modulus.
pub(super) fn finding(card: &MaterialCard) -> Option<Finding> {
    young_modulus(card).or_else(|| table_strain(card)).or_else(|| flow_stress(card))
}

fn doubt(place: &str, what: String, remedy: &str) -> Finding {
    Finding::doubt(DoubtCode::MaterialUnits, place.into(), what, remedy.into())
}

fn young_modulus(card: &MaterialCard) -> Option<Finding> {
    if (YOUNG_RANGE_MPA[0]..=YOUNG_RANGE_MPA[1]).contains(&card.young_mpa) {
        return None;
    }
    let limit = YOUNG_RANGE_MPA[usize::from(card.young_mpa > YOUNG_RANGE_MPA[1])];
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
    let last = strain.last().filter(|last| **last > TABLE_STRAIN_MAX)?;
    let finding = doubt(
        "material.hardening.strain",
        format!(
            "The hardening table of material '{}' goes to a plastic strain of {last}; sheets fracture below {TABLE_STRAIN_MAX}.",
            card.name
        ),
        "Strains are ratios, not per cent: divide them by 100.",
    );
    Some(finding.exceeds([*last, TABLE_STRAIN_MAX]))
}

fn flow_stress(card: &MaterialCard) -> Option<Finding> {
    let (stress, _) = card.tension(FLOW_STRESS_STRAIN)?;
    let ratio = stress / card.young_mpa;
    if (FLOW_STRESS_RANGE_REL[0]..=FLOW_STRESS_RANGE_REL[1]).contains(&ratio) {
        return None;
    }
    let finding = doubt(
        "material.hardening",
        format!(
            "Material '{}' has a flow stress of {stress:.4} MPa at a plastic strain of {FLOW_STRESS_STRAIN}, {ratio:.2e} of its Young's modulus ({:.4} MPa); metals have {:.0e} to {}.",
            card.name, card.young_mpa, FLOW_STRESS_RANGE_REL[0], FLOW_STRESS_RANGE_REL[1]
        ),
        "Check the units: both are in MPa.",
    );
    Some(
        finding
            .exceeds([ratio, FLOW_STRESS_RANGE_REL[usize::from(ratio > FLOW_STRESS_RANGE_REL[1])]]),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use kanagata_solver::material::card;

    #[test]
    fn slips_of_units_are_seen_and_published_sheets_are_not() {
        for card in card::library() {
            assert_eq!(finding(&card), None, "{}", card.name);
        }
        let steel = card::find("mild-steel-neto2012").unwrap();
        for unit in [1e-3, 1e3] {
            let found =
                finding(&MaterialCard { young_mpa: steel.young_mpa * unit, ..steel.clone() });
            assert!(found.unwrap().to_string().contains("Check the unit"));
        }
        let mut pascals = MaterialCard { young_mpa: 2.1e11, ..steel };
        pascals.hardening = Some(Hardening::Swift { k: 5.3e8, eps0: 0.0044, n: 0.27 });
        assert!(finding(&pascals).unwrap().to_string().contains("modulus of 2.1e11 MPa"));
    }
}
