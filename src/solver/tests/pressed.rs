//! Sheets pressed flat between plates: no hourglass mode under pressure, for any element width.

use super::claims::square;
use super::{setup, stage, tool};
use crate::assembly::Body;
use crate::element::ElementKind;
use crate::material::card::MaterialCard;
use crate::report::Energies;
use crate::sheet::hex_mesh::rectangle;
use crate::{Constraints, Control, Curve, IncrementReport, Motion, SheetSide, Simulation};
use kanagata_geometry::Vec3;

const THICKNESS: f64 = 0.8;
const SHELL: ElementKind = ElementKind::SolidShell { points: 5, membrane: true };

/// A sheet of equal length and width, from two symmetry planes on, pressed between plates.
struct Pressed {
    size: [f64; 2],
    /// Elements along x, y and through the thickness.
    elements: [usize; 3],
    kind: ElementKind,
    friction: f64,
    /// Travel of the upper plate over the thickness.
    by: f64,
    /// Plane strain: no extension along y.
    plane_strain: bool,
    largest_step: f64,
}

impl Pressed {
    /// Final force [N], work, and inclination of the columns after the plates are removed [rad].
    fn press(&self) -> (f64, Energies, f64) {
        let Self { size: [a, b], elements: [nx, ny, layers], .. } = *self;
        let mesh = rectangle(a, b, THICKNESS, nx, ny, layers);
        let mut constraints = Constraints::none(mesh.nodes.len());
        for (node, x) in mesh.nodes.iter().enumerate() {
            if x.x < 1e-9 {
                constraints.hold(node, 0);
            }
            if x.y < 1e-9 || self.plane_strain {
                constraints.hold(node, 1);
            }
        }
        let card: MaterialCard = serde_json::from_str(
            r#"{"name": "steel", "young_mpa": 210000.0, "poisson": 0.3, "yield": {"criterion": "von-mises"},
                "hardening": {"law": "swift", "k": 529.5, "eps0": 0.00439, "n": 0.268}}"#,
        )
        .unwrap();
        let body = Body::new(mesh, self.kind, card.build(0.0).unwrap()).unwrap();
        let tools = vec![
            tool("low", square("low", 0.0, true), Vec3::z(), SheetSide::Bottom, self.friction),
            tool("up", square("up", THICKNESS, false), -Vec3::z(), SheetSide::Top, self.friction),
        ];
        let down = Curve::ramp(0.0, self.by * THICKNESS);
        let mut press = stage("press", vec![Motion::Hold, Motion::Travel(down)], 0.01);
        press.largest_step = self.largest_step;
        let release = stage("release", vec![Motion::Release, Motion::Release], 0.25);
        let setup = setup(body, constraints, tools, vec![press, release]);
        let mut sim = Simulation::new(setup).unwrap();
        let (mut force, mut energies) = (0.0_f64, Energies::default());
        sim.run(&mut |r: &IncrementReport<'_>| {
            force = force.max(r.tools[1].force.abs());
            energies = r.energies;
            Control::Continue
        })
        .unwrap();
        (force, energies, leaning(&sim))
    }
}

/// Largest inclination of a column [rad].
fn leaning(sim: &Simulation) -> f64 {
    let levels = sim.body().mesh().nodes_per_column;
    let lean = |column: usize| {
        let [foot, head] = [column * levels, column * levels + 1].map(|n| sim.sys.position(n));
        (head - foot).normalize().xy().norm()
    };
    (0..sim.body().mesh().column_count()).map(lean).fold(0.0, f64::max)
}

#[test]
fn wide_elements_pressed_flat_carry_what_the_material_does() {
    let kinds = [(SHELL, 1), (SHELL, 2), (ElementKind::Hex8Enhanced, 2), (ElementKind::Hex8, 1)];
    for (kind, layers) in kinds {
        for largest_step in [0.05, 0.2] {
            let (size, elements) = ([20.0, 5.0], [10, 1, layers]);
            let sheet = Pressed {
                size,
                elements,
                kind,
                friction: 0.0,
                by: 0.1,
                plane_strain: true,
                largest_step,
            };
            let (force, energies, lean) = sheet.press();
            // Rigid-plastic, isochoric.
            let strain = 2.0 / 3.0_f64.sqrt() * (1.0 / 0.9_f64).ln();
            let stress = 2.0 / 3.0_f64.sqrt() * 529.5 * (0.00439 + strain).powf(0.268);
            let expected = stress * 20.0 * 5.0 / 0.9;
            assert!((force / expected - 1.0).abs() < 6e-3, "{kind:?} {layers}: {force} {expected}");
            assert!(lean < 1e-9, "{kind:?} {layers}: {lean}");
            let artificial = energies.artificial.abs() / energies.external;
            assert!(artificial < 1e-12, "{kind:?} {layers}: {artificial}");
            assert!(energies.imbalance().abs() < 1e-6 * energies.largest_work, "{energies:?}");
        }
    }
}

#[test]
fn fibres_tilted_by_friction_do_not_tilt_further() {
    let press = |kind, layers| {
        let (size, elements) = ([8.0, 8.0], [6, 6, layers]);
        let sheet = Pressed {
            size,
            elements,
            kind,
            friction: 0.05,
            by: 0.2,
            plane_strain: false,
            largest_step: 0.05,
        };
        sheet.press()
    };
    let (expected, ..) = press(ElementKind::Hex8, 2);
    for (kind, layers) in [(SHELL, 1), (SHELL, 2), (ElementKind::Hex8Enhanced, 2)] {
        let (force, energies, _) = press(kind, layers);
        assert!((force / expected - 1.0).abs() < 4e-3, "{kind:?} {layers}: {force} {expected}");
        let artificial = energies.artificial / energies.external;
        assert!(artificial < 1e-3, "{kind:?} {layers}: {artificial}");
        assert!(energies.imbalance().abs() < 1e-3 * energies.largest_work, "{energies:?}");
    }
}
