//! Strains of every element, and its plastic strain and stress for materials with a history.

use super::strains::{ElementStrains, Principal, of_elements};
use kanagata_geometry::Vec3;
use kanagata_report::DataArray;
use kanagata_report::record::{PlasticStrainRecord, StrainRecord};
use kanagata_solver::assembly::Body;
use kanagata_solver::assembly::ElementState;

/// Strains and states of all elements.
#[derive(Debug, Clone, PartialEq)]
pub struct Formed {
    /// Strains at the centre of each element.
    pub strains: Vec<ElementStrains>,
    /// Mean state of the points of each element; `None` for an elastic material.
    pub states: Option<Vec<ElementState>>,
}

/// Strains of a surface of an element.
type Face = fn(&ElementStrains) -> Principal;

impl Formed {
    /// Strains at `displacements` (three per node [mm]), and states of the last commit of the body.
    #[must_use]
    pub fn of(body: &Body, displacements: &[f64]) -> Self {
        let strains = of_elements(body.mesh(), displacements);
        Self { strains, states: body.element_states() }
    }

    /// One number per element, named as in the VTU.
    #[must_use]
    pub fn cell_data(&self) -> Vec<DataArray> {
        let mut arrays = Vec::new();
        if let Some(states) = &self.states {
            let mut push = |name: &str, value: fn(&ElementState) -> f64| {
                arrays.push(DataArray::scalar(name, states.iter().map(value).collect()));
            };
            push("plastic_strain", |state| state.mean.plastic_strain);
            push("plastic_strain_largest", |state| state.largest_plastic_strain);
            push("plastic_strain_lower", |state| state.face_plastic_strain[0]);
            push("plastic_strain_upper", |state| state.face_plastic_strain[1]);
            push("stress_mpa", |state| state.mean.equivalent_stress);
            push("pressure_mpa", |state| state.mean.pressure);
        }
        let mut push = |name: String, value: &dyn Fn(&ElementStrains) -> f64| {
            arrays.push(DataArray::scalar(name, self.strains.iter().map(value).collect()));
        };
        let faces: [(&str, Face); 3] =
            [("", |one| one.middle), ("_lower", |one| one.lower), ("_upper", |one| one.upper)];
        for (suffix, face) in faces {
            push(format!("major_strain{suffix}"), &|one| face(one).major);
            push(format!("minor_strain{suffix}"), &|one| face(one).minor);
        }
        push("thickness_strain".into(), &|one| one.thickness);
        arrays
    }

    /// Largest strains and their positions, for nodes at `positions` [mm]; `None` without elements.
    #[must_use]
    pub fn record(&self, body: &Body, positions: &[Vec3]) -> Option<StrainRecord> {
        let centre = |element: usize| {
            let nodes = body.mesh().elements[element].iter();
            let sum: Vec3 = nodes.map(|&node| positions[node as usize]).sum();
            <[f64; 3]>::from(sum / 8.0)
        };
        let plastic = self.states.as_ref().and_then(|states| {
            let element = largest(states, |state| state.largest_plastic_strain)?;
            let largest = states[element].largest_plastic_strain;
            Some(PlasticStrainRecord { largest, at_mm: centre(element) })
        });
        let element = largest(&self.strains, |one| one.middle.major)?;
        let Principal { major, minor } = self.strains[element].middle;
        Some(StrainRecord { major, minor, at_mm: centre(element), plastic })
    }
}

/// Index of the largest value, the first of equal ones.
fn largest<T>(all: &[T], value: impl Fn(&T) -> f64) -> Option<usize> {
    let larger = |a: usize, b: usize| if value(&all[b]) > value(&all[a]) { b } else { a };
    (0..all.len()).reduce(larger)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::fields;
    use kanagata_geometry::Vec2;
    use kanagata_report::{Vtu, vtu_read};
    use kanagata_solver::assembly::Evaluation;
    use kanagata_solver::element::{ElementKind, Want};
    use kanagata_solver::material::Material;
    use kanagata_solver::material::card;
    use kanagata_solver::material::elastic::Elastic;
    use kanagata_solver::sheet::hex_mesh::rectangle;

    const SHELL: ElementKind = ElementKind::SolidShell { points: 5, membrane: true };

    /// A strip of 4 x 1 elements of 1 mm with nodes moved to `to`, in ten steps.
    fn strip(material: Arc<dyn Material>, to: impl Fn(f64, &Vec3) -> Vec3) -> (Body, Vec<f64>) {
        let mut body = Body::new(rectangle(4.0, 1.0, 0.8, 4, 1, 1), SHELL, material).unwrap();
        let (mut u, mut out) = (Vec::new(), Evaluation::default());
        for step in 1..=10 {
            let moved = |x: &Vec3| <[f64; 3]>::from(to(0.1 * f64::from(step), x) - x);
            u = body.mesh().nodes.iter().flat_map(moved).collect();
            body.evaluate(&u, Want::Residual, &mut out).unwrap();
            body.commit();
        }
        (body, u)
    }

    /// A field of the sheet's VTU, written and read back.
    fn read_back(body: &Body, u: &[f64], name: &str) -> Option<Vec<f64>> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sheet.vtu");
        let state = fields::SheetState {
            body,
            displacements: u,
            contact_forces: &[],
            contacts: None,
            face_depths: &[],
        };
        let grid: Vtu = fields::sheet(&state, &Formed::of(body, u));
        grid.write(&path).unwrap();
        let cells = vtu_read::read(&path).unwrap().cell_data;
        cells.into_iter().find(|array| array.name == name).map(|array| array.values)
    }

    fn steel(angle: f64) -> Arc<dyn Material> {
        card::find("mild-steel-neto2012").unwrap().build(angle).unwrap()
    }

    /// Uniaxial tension of 20 % along and across the rolling direction: r = H/G and H/F, constant volume. Plastic strain
    /// follows from the work at yield stresses in the ratio of Hill's criterion; the remaining elastic strains are 2e-3.
    #[test]
    fn a_strip_in_tension_has_the_strains_of_its_r_value() {
        let (f, g, h) = (0.251, 0.297, 0.703);
        let long = 1.2_f64.ln();
        for (angle, r, ratio) in
            [(0.0, h / g, 1.0), (std::f64::consts::FRAC_PI_2, h / f, f64::sqrt((g + h) / (f + h)))]
        {
            let wide = -long * r / (1.0 + r);
            let thin = -long / (1.0 + r);
            let stretch = Vec3::new(long, wide, thin);
            let to = |share: f64, x: &Vec3| (share * stretch).map(f64::exp).component_mul(x);
            let (body, u) = strip(steel(angle), to);
            let value = |name: &str| read_back(&body, &u, name).unwrap();
            for (name, expected, within) in [
                ("major_strain", long, 1e-14),
                ("minor_strain", wide, 1e-14),
                ("minor_strain_upper", wide, 1e-14),
                ("thickness_strain", thin, 1e-14),
                ("plastic_strain", long * ratio, 2e-3),
                ("plastic_strain_largest", long * ratio, 2e-3),
            ] {
                for found in value(name) {
                    assert!((found - expected).abs() < within, "{name}: {found} {expected}");
                }
            }
            let flow = |p: f64| 529.5 * (0.00439_f64 + p).powf(0.268);
            for (p, stress) in value("plastic_strain").into_iter().zip(value("stress_mpa")) {
                assert!((stress - flow(p)).abs() < 1e-9 * stress, "{stress} {}", flow(p));
            }
        }
    }

    #[test]
    fn a_bent_strip_is_stretched_on_one_face_and_its_largest_strains_are_recorded() {
        // Bent about y to a radius of 4 mm, and its end pulled out.
        let to = |share: f64, x: &Vec3| {
            let radius = 4.0 / share;
            let (s, c) = (x.x / radius).sin_cos();
            let off = radius - (x.z - 0.4);
            let end = if x.x > 3.5 { 0.2 * share } else { 0.0 };
            let tangent = Vec2::new(c, s) * end;
            Vec3::new(off * s + tangent.x, x.y, 0.4 + radius - off * c + tangent.y)
        };
        let (body, u) = strip(steel(0.0), to);
        let value = |name: &str| read_back(&body, &u, name).unwrap();
        let (low, high) = (value("major_strain_lower"), value("minor_strain_upper"));
        for element in 0..3 {
            // Chords of an eighth of a radian to each side.
            let chord = 8.0 * 0.125_f64.sin();
            for (found, radius) in [(low[element], 4.4), (high[element], 3.6)] {
                let expected = f64::ln(chord * radius / 4.0);
                assert!((found - expected).abs() < 1e-13, "{found} {expected}");
            }
            assert!(
                value("plastic_strain_largest")[element] > 1.5 * value("plastic_strain")[element]
            );
        }
        let positions = fields::positions(body.mesh(), &u);
        let record = Formed::of(&body, &u).record(&body, &positions).unwrap();
        assert_eq!(record.major, value("major_strain")[3]);
        assert_eq!(record.minor, value("minor_strain")[3]);
        let plastic = record.plastic.unwrap();
        assert_eq!(plastic.largest, value("plastic_strain_largest")[3]);
        let nodes = body.mesh().elements[3].map(|node| positions[node as usize]);
        let centre = nodes.iter().sum::<Vec3>() / 8.0;
        assert_eq!((record.at_mm, plastic.at_mm), (centre.into(), centre.into()));
    }

    #[test]
    fn an_elastic_sheet_has_strains_and_no_others() {
        let elastic = Arc::new(Elastic { young: 7e4, poisson: 0.3 });
        let (body, u) = strip(elastic, |share, x| Vec3::new(x.x * (1.0 + 1e-3 * share), x.y, x.z));
        let major = read_back(&body, &u, "major_strain").unwrap();
        assert!((major[0] - 1e-3_f64.ln_1p()).abs() < 1e-15, "{major:?}");
        assert_eq!(read_back(&body, &u, "plastic_strain"), None);
        let positions = fields::positions(body.mesh(), &u);
        let record = Formed::of(&body, &u).record(&body, &positions).unwrap();
        assert_eq!(record.plastic, None);
        assert!(record.to_string().starts_with("major 0.0010 with minor 0.0000 at ("), "{record}");
    }
}
