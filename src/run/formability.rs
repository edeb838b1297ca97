//! Formability of the sheet: thinning, margin to the forming limit and zone of every element; what `run.json` states of
//! them.

use super::strain_path::{StrainPaths, TURNED_ANGLE_DEG};
use super::strains::SheetStrain;
use kanagata_geometry::Vec3;
use kanagata_report::DataArray;
use kanagata_report::record::{
    FormabilityRecord, LimitMarginRecord, ThinningRecord, TurnedPathsRecord, ZoneShares,
};
use kanagata_solver::material::forming_limit::{Diagram, Zone};
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// Strains of all elements, judged in a forming limit diagram.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged<'a> {
    diagram: &'a Diagram,
    strains: Vec<SheetStrain>,
}

impl<'a> Judged<'a> {
    /// Judges the strains of the sheet, one per element.
    #[must_use]
    pub fn new(diagram: &'a Diagram, strains: Vec<SheetStrain>) -> Self {
        Self { diagram, strains }
    }

    /// Thinning of an element [%]: decrease of its thickness over the initial thickness.
    fn thinning_percent(strain: &SheetStrain) -> f64 {
        // Not -100 (exp - 1), which is -0 for no strain.
        100.0 - 100.0 * strain.thickness.exp()
    }

    fn zone(&self, strain: &SheetStrain) -> Zone {
        self.diagram.zone(strain.principal.minor, strain.principal.major)
    }

    fn margin(&self, strain: &SheetStrain) -> Option<f64> {
        self.diagram.margin(strain.principal.minor, strain.principal.major)
    }

    /// One number per element, named as in the VTU: thinning, margin (if there is a limit) and number of the zone.
    #[must_use]
    pub fn cell_data(&self) -> Vec<DataArray> {
        let thinning = self.strains.iter().map(Self::thinning_percent).collect();
        let mut arrays = vec![DataArray::scalar("thinning_percent", thinning)];
        let margins: Option<Vec<f64>> =
            self.strains.iter().map(|strain| self.margin(strain)).collect();
        if self.diagram.curve.is_some() {
            let margins = margins.unwrap_or_default();
            arrays.push(DataArray::scalar("forming_limit_margin", margins));
        }
        let zones = self.strains.iter().map(|strain| self.zone(strain) as i32).collect();
        arrays.push(DataArray::integer("forming_zone", zones));
        arrays
    }

    /// The record of the sheet in an increment, with nodes at `positions` [mm]; `None` without elements.
    #[must_use]
    pub fn record(
        &self,
        increment: usize,
        mesh: &HexMesh,
        positions: &[Vec3],
        paths: &StrainPaths,
    ) -> Option<FormabilityRecord> {
        let centre = |element: usize| -> [f64; 3] {
            let nodes = mesh.elements[element].iter();
            (nodes.map(|&node| positions[node as usize]).sum::<Vec3>() / 8.0).into()
        };
        let thinning = |element: usize| ThinningRecord {
            percent: Self::thinning_percent(&self.strains[element]),
            element,
            at_mm: centre(element),
        };
        let (area, shares) = self.shares();
        let curve = self.diagram.curve.as_ref();
        Some(FormabilityRecord {
            increment,
            // A stack of elements counts once.
            area_mm2: area / mesh.nodes_per_column.saturating_sub(1).max(1) as f64,
            thinning: thinning(first_largest(&self.strains, |s| -s.thickness)?),
            thickening: thinning(first_largest(&self.strains, |s| s.thickness)?),
            margin: self.limit_margin(centre, paths),
            zones: zone_shares(&shares, curve.is_some()),
            turned_paths: self.turned(paths, area),
            limit_curve: curve.map_or_else(Vec::new, |curve| curve.points().to_vec()),
        })
    }

    /// The element nearest to the limit curve; `None` without one.
    fn limit_margin(
        &self,
        centre: impl Fn(usize) -> [f64; 3],
        paths: &StrainPaths,
    ) -> Option<LimitMarginRecord> {
        let curve = self.diagram.curve.as_ref()?;
        let ratio = |s: &SheetStrain| curve.failure_ratio(s.principal.minor, s.principal.major);
        let element = first_largest(&self.strains, ratio)?;
        let strain = &self.strains[element];
        Some(LimitMarginRecord {
            margin: 1.0 - ratio(strain),
            major: strain.principal.major,
            minor: strain.principal.minor,
            limit_major: curve.major_at(strain.principal.minor),
            element,
            at_mm: centre(element),
            turned: paths.has_turned(element),
        })
    }

    /// Initial area of all elements [mm2], and the share of each zone.
    fn shares(&self) -> (f64, [f64; Zone::ALL.len()]) {
        let (mut area, mut shares) = (0.0, [0.0; Zone::ALL.len()]);
        for strain in &self.strains {
            area += strain.area;
            shares[self.zone(strain) as usize] += strain.area;
        }
        (area, shares.map(|part| part / area))
    }

    /// The elements whose path turned, of a sheet of initial `area` [mm2].
    fn turned(&self, paths: &StrainPaths, area: f64) -> TurnedPathsRecord {
        let (mut elements, mut turned, mut largest) = (0, 0.0, 0.0_f64);
        for (element, strain) in self.strains.iter().enumerate() {
            largest = largest.max(paths.angle_deg(element));
            if paths.has_turned(element) {
                elements += 1;
                turned += strain.area;
            }
        }
        TurnedPathsRecord {
            angle_deg: TURNED_ANGLE_DEG,
            elements,
            share: turned / area,
            largest_deg: largest,
        }
    }
}

/// Shares by zone; those that need a limit curve only if there is one.
fn zone_shares(shares: &[f64; Zone::ALL.len()], with_curve: bool) -> ZoneShares {
    let of = |zone: Zone| shares[zone as usize];
    ZoneShares {
        crack: with_curve.then(|| of(Zone::Crack)),
        risk: with_curve.then(|| of(Zone::Risk)),
        safe: with_curve.then(|| of(Zone::Safe)),
        not_judged: (!with_curve).then(|| of(Zone::NotJudged)),
        insufficient_stretch: of(Zone::InsufficientStretch),
        wrinkling_tendency: of(Zone::WrinklingTendency),
        thickening: of(Zone::Thickening),
        strong_wrinkling: of(Zone::StrongWrinkling),
    }
}

/// Index of the largest value, the first of equal ones.
fn first_largest<T>(all: &[T], value: impl Fn(&T) -> f64) -> Option<usize> {
    let larger = |a: usize, b: usize| if value(&all[b]) > value(&all[a]) { b } else { a };
    (0..all.len()).reduce(larger)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fields::positions;
    use crate::strains::of_sheet;
    use kanagata_solver::material::card;
    use kanagata_solver::material::forming_limit::{FormingLimit, StrainMeasure};
    use kanagata_solver::sheet::hex_mesh::rectangle;

    /// A diagram of an isotropic sheet with FLD0 = 0.3, or without a limit.
    fn diagram(with_curve: bool) -> Diagram {
        let mut steel = card::find("sheet-ssnv501").unwrap();
        steel.forming_limit = with_curve.then(|| FormingLimit::Points {
            strain: StrainMeasure::Logarithmic,
            points: vec![[-0.3, 0.6], [0.0, 0.3], [0.3, 0.45]],
        });
        steel.diagram(1.0).unwrap()
    }

    /// Widths, major and minor logarithmic strains of strips in every zone, and the zone.
    const STRIPS: [(f64, f64, f64, Zone); 7] = [
        (1.0, 0.32, 0.0, Zone::Crack),
        (2.0, 0.285, 0.0, Zone::Risk),
        (3.0, 0.15, 0.05, Zone::Safe),
        (4.0, 0.01, -0.005, Zone::InsufficientStretch),
        (5.0, 0.2, -0.15, Zone::WrinklingTendency),
        (6.0, 0.15, -0.2, Zone::Thickening),
        (7.0, 0.05, -0.2, Zone::StrongWrinkling),
    ];

    /// Strips side by side, 2 mm long and 1 mm thick, each strained homogeneously along its length and width: the mesh
    /// and its displacements. Strips are apart, so that each keeps its own nodes.
    fn sheet(layers: usize) -> (HexMesh, Vec<f64>) {
        let mut whole: Option<HexMesh> = None;
        let (mut displacements, mut shift) = (Vec::new(), 0.0);
        for (width, major, minor, _) in STRIPS {
            let mut strip = rectangle(2.0, width, 1.0, 2, 3, layers);
            let stretch = Vec3::new(major, minor, -major - minor).map(f64::exp);
            for x in &mut strip.nodes {
                let to = x.component_mul(&stretch);
                displacements.extend(<[f64; 3]>::from(to - *x));
                x.y += shift;
            }
            shift += width + 1.0;
            match &mut whole {
                None => whole = Some(strip),
                Some(whole) => {
                    let first = whole.nodes.len() as u32;
                    whole.nodes.extend(strip.nodes);
                    whole.elements.extend(strip.elements.iter().map(|e| e.map(|n| n + first)));
                }
            }
        }
        (whole.unwrap(), displacements)
    }

    fn near(found: f64, expected: f64) {
        let error = (found - expected).abs() / expected.abs().max(1.0);
        assert!(error < 1e-13, "{found} {expected}");
    }

    #[test]
    fn areas_of_zones_of_a_sheet_with_known_strains_are_the_closed_form() {
        for (layers, with_curve) in [(1, true), (3, true), (2, false)] {
            let (mesh, u) = sheet(layers);
            let diagram = diagram(with_curve);
            let judged = Judged::new(&diagram, of_sheet(&mesh, &u));
            let at = positions(&mesh, &u);
            let record = judged.record(4, &mesh, &at, &StrainPaths::default()).unwrap();
            near(record.area_mm2, 56.0);
            let zones = record.zones;
            near(zones.insufficient_stretch, 4.0 / 28.0);
            near(zones.wrinkling_tendency, 5.0 / 28.0);
            near(zones.thickening, 6.0 / 28.0);
            near(zones.strong_wrinkling, 7.0 / 28.0);
            near(zones.named().iter().map(|zone| zone.1).sum(), 1.0);
            near(record.thinning.percent, 100.0 * (1.0 - f64::exp(-0.32)));
            near(record.thickening.percent, 100.0 * (1.0 - f64::exp(0.15)));
            assert_eq!(record.thinning.element, 0);
            if with_curve {
                near(zones.crack.unwrap(), 1.0 / 28.0);
                near(zones.risk.unwrap(), 2.0 / 28.0);
                near(zones.safe.unwrap(), 3.0 / 28.0);
                assert_eq!(zones.not_judged, None);
                let margin = record.margin.unwrap();
                near(margin.margin, 1.0 - 0.32 / 0.3);
                near(margin.limit_major, 0.3);
                assert_eq!((margin.element, margin.turned), (0, false));
                assert_eq!(record.limit_curve.len(), 3);
            } else {
                near(zones.not_judged.unwrap(), 6.0 / 28.0);
                assert_eq!((zones.crack, zones.risk, zones.safe), (None, None, None));
                assert_eq!((record.margin, record.limit_curve.len()), (None, 0));
            }
        }
    }

    #[test]
    fn fields_have_a_number_for_every_element() {
        let (mesh, u) = sheet(1);
        for with_curve in [true, false] {
            let diagram = diagram(with_curve);
            let mut grid = kanagata_report::Vtu::new(positions(&mesh, &u));
            for element in &mesh.elements {
                grid.push_cell(kanagata_report::CellKind::Hexahedron, element);
            }
            grid.cell_data = Judged::new(&diagram, of_sheet(&mesh, &u)).cell_data();
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("sheet.vtu");
            grid.write(&path).unwrap();
            let read = kanagata_report::vtu_read::read(&path).unwrap().cell_data;
            let values = |name: &str| {
                let found = read.iter().find(|array| array.name == name);
                found.map(|array| array.values.clone())
            };
            let zones = values("forming_zone").unwrap();
            let thinning = values("thinning_percent").unwrap();
            for (k, (_, major, minor, zone)) in STRIPS.into_iter().enumerate() {
                let judged = matches!(zone, Zone::Crack | Zone::Risk | Zone::Safe);
                let zone = if judged && !with_curve { Zone::NotJudged } else { zone };
                for (found, thinning) in zones.iter().zip(&thinning).skip(6 * k).take(6) {
                    assert_eq!(*found, f64::from(zone as i32));
                    near(0.01 * thinning, 1.0 - f64::exp(-major - minor));
                }
            }
            let margins = values("forming_limit_margin");
            assert_eq!(margins.is_some(), with_curve);
            if let Some(margins) = margins {
                near(margins[0], 1.0 - 0.32 / 0.3);
                near(margins[6 * 6], 1.0);
            }
        }
    }

    #[test]
    fn turned_paths_are_counted_by_area() {
        let (mesh, u) = sheet(1);
        let mut paths = StrainPaths::default();
        // The first half of the path is plane strain, for all.
        let mut first = of_sheet(&mesh, &u);
        first.iter_mut().for_each(|strain| strain.tensor = [0.1, 0.1, 0.0]);
        paths.update(&first);
        let strains = of_sheet(&mesh, &u);
        paths.update(&strains);
        let expected: f64 = strains
            .iter()
            .enumerate()
            .filter(|(k, _)| paths.angle_deg(*k) > 30.0)
            .map(|(_, strain)| strain.area)
            .sum();
        let diagram = diagram(true);
        let record =
            Judged::new(&diagram, strains).record(1, &mesh, &positions(&mesh, &u), &paths).unwrap();
        near(record.turned_paths.share, expected / 56.0);
        // Straight: the strips in plane strain beyond 0.2; all others turned.
        assert_eq!(record.turned_paths.elements, 5 * 6);
        assert!(!record.margin.unwrap().turned && record.turned_paths.largest_deg > 90.0);
    }
}
