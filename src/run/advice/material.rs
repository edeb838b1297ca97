//! Materials that no sheet is made of.

use super::Remark;
use crate::solver::material::card::MaterialCard;

/// Plastic strain at which the flow stress is taken.
pub(super) const EARLY: f64 = 0.002;
/// Flow stress there over Young's modulus of what sheets are made of: lead has 4e-4, hard spring steel 0.01.
const ELASTIC: [f64; 2] = [5e-5, 0.03];

/// Young's moduli [MPa] of what is formed: a soft polymer has 1000, tungsten 4.1e5.
const YOUNG: [f64; 2] = [500.0, 1e6];

/// A remark on a Young's modulus that no sheet has, or on a flow stress that does not go with it.
pub(super) fn remark(card: &MaterialCard) -> Option<Remark> {
    if !(YOUNG[0]..=YOUNG[1]).contains(&card.young_mpa) {
        return Some(Remark::new(
            format!("material '{}' has a Young's modulus of {:e} MPa", card.name, card.young_mpa),
            "steel has 2.1e5 MPa, aluminium 7e4: check the units, stresses are in MPa".into(),
        ));
    }
    let (stress, _) = card.tension(EARLY)?;
    let ratio = stress / card.young_mpa;
    (!(ELASTIC[0]..=ELASTIC[1]).contains(&ratio)).then(|| {
        Remark::new(
            format!(
                "material '{}' flows at {stress:.4} MPa after a plastic strain of {EARLY}, {ratio:.2e} of its Young's modulus of {:.4} MPa",
                card.name, card.young_mpa
            ),
            format!(
                "metals have {:.0e} to {}: check the units, both are in MPa",
                ELASTIC[0], ELASTIC[1]
            ),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::material::card;
    use crate::solver::material::hardening::Hardening;

    #[test]
    fn slips_of_units_are_seen_and_published_sheets_are_not() {
        for card in card::library() {
            assert_eq!(remark(&card), None, "{}", card.name);
        }
        let steel = card::find("mild-steel-neto2012").unwrap();
        for unit in [1e-3, 1e3] {
            let found =
                remark(&MaterialCard { young_mpa: steel.young_mpa * unit, ..steel.clone() });
            assert!(found.unwrap().to_string().contains("check the units"));
        }
        let mut pascals = MaterialCard { young_mpa: 2.1e11, ..steel };
        pascals.hardening = Some(Hardening::Swift { k: 5.3e8, eps0: 0.0044, n: 0.27 });
        assert!(remark(&pascals).unwrap().to_string().contains("modulus of 2.1e11 MPa"));
    }
}
