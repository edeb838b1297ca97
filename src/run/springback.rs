//! Springback after the tools are released.

use serde::{Deserialize, Serialize};

use super::{contact_fields, fields};
use kanagata_report::record::{NormalDisplacementRecord, SpringbackRecord};
use kanagata_solver::IncrementReport;
use kanagata_solver::sheet::hex_mesh::HexMesh;

/// Array of the displacement in springback along the normal [mm].
pub const SPRINGBACK_NORMAL: &str = "springback_normal_mm";

/// The sheet in the last equilibrium with tools.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Springback {
    /// Displacements, three per node [mm].
    held: Vec<f64>,
    /// Sum of the magnitudes of all tool forces, of the whole process [N].
    force_n: f64,
    /// Elastic energy, of the whole process [N mm].
    elastic_nmm: f64,
    /// Its increment; `None` in checkpoints of older programs.
    #[serde(default)]
    increment: Option<usize>,
}

impl Springback {
    /// Displacements in the last equilibrium with tools, three per node [mm]; empty if there was none.
    #[must_use]
    pub fn held(&self) -> &[f64] {
        &self.held
    }

    /// Displacement of every node since the last equilibrium with tools along the normal of the mid-surface there [mm],
    /// positive towards the upper face. Empty if there was none.
    ///
    /// `d = (u - u_held) . n_held`: to first order the distance of the sheet from its shape in the tools. Where it slides
    /// along that shape, the distance differs in the second order of the displacement.
    #[must_use]
    pub fn along_normal(&self, mesh: &HexMesh, displacements: &[f64]) -> Vec<f64> {
        let is_of_mesh = |u: &[f64]| u.len() == 3 * mesh.nodes.len();
        if !is_of_mesh(&self.held) || !is_of_mesh(displacements) {
            return Vec::new();
        }
        let normals = contact_fields::normals(mesh, &fields::positions(mesh, &self.held));
        let levels = mesh.nodes_per_column.max(1);
        let moved = displacements.chunks_exact(3).zip(self.held.chunks_exact(3)).enumerate();
        let along = |(node, (u, held)): (usize, (&[f64], &[f64]))| {
            let normal = normals[node / levels];
            (0..3).map(|k| (u[k] - held[k]) * normal[k]).sum()
        };
        moved.map(along).collect()
    }

    /// Nodes with the largest and the smallest displacement along the normal.
    fn peaks(
        &self,
        mesh: &HexMesh,
        displacements: &[f64],
    ) -> Option<[NormalDisplacementRecord; 2]> {
        let along = self.along_normal(mesh, displacements);
        let order = |a: &usize, b: &usize| along[*a].total_cmp(&along[*b]);
        let (largest, smallest) =
            (0..along.len()).max_by(order).zip((0..along.len()).min_by(order))?;
        let at = |node: usize| NormalDisplacementRecord {
            displacement_mm: along[node],
            node,
            at_mm: std::array::from_fn(|k| mesh.nodes[node][k] + displacements[3 * node + k]),
        };
        Some([at(largest), at(smallest)])
    }

    /// Updates with an increment. Without tools: the springback since the last equilibrium with tools.
    pub fn update(&mut self, report: &IncrementReport<'_>) -> Option<SpringbackRecord> {
        if !report.free {
            self.held = report.displacements.to_vec();
            self.force_n = report.tools.iter().map(|t| t.force.abs()).sum();
            self.elastic_nmm = report.energies.elastic;
            self.increment = Some(report.increment);
            return None;
        }
        let moved = report.displacements.chunks_exact(3).zip(self.held.chunks_exact(3));
        let squares = moved
            .map(|(u, held)| u.iter().zip(held).map(|(a, b)| (a - b).powi(2)).sum::<f64>())
            .zip(report.body.mesh().node_volumes());
        let (largest, sum, volume) =
            squares.fold((0.0_f64, 0.0, 0.0), |(largest, sum, volume), (square, of_node)| {
                (largest.max(square), sum + square * of_node, volume + of_node)
            });
        let peaks = self.peaks(report.body.mesh(), report.displacements);
        (volume > 0.0).then(|| SpringbackRecord {
            largest_mm: largest.sqrt(),
            rms_mm: (sum / volume).sqrt(),
            force_n: self.force_n,
            energy_nmm: self.elastic_nmm - report.energies.elastic,
            from_increment: self.increment,
            normal_max: peaks.map(|[largest, _]| largest),
            normal_min: peaks.map(|[_, smallest]| smallest),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    use kanagata_geometry::Vec3;
    use kanagata_solver::Timings;
    use kanagata_solver::assembly::Body;
    use kanagata_solver::element::ElementKind;
    use kanagata_solver::material::elastic::Elastic;
    use kanagata_solver::report::{Energies, ToolReport};
    use kanagata_solver::sheet::hex_mesh::rectangle;

    fn body() -> Body {
        let elastic = Arc::new(Elastic { young: 7e4, poisson: 0.3 });
        Body::new(rectangle(1.0, 1.0, 1.0, 1, 1, 1), ElementKind::Hex8, elastic).unwrap()
    }

    fn report<'a>(body: &'a Body, free: bool, u: &'a [f64], elastic: f64) -> IncrementReport<'a> {
        let tool = |force: f64| ToolReport {
            name: String::new(),
            travel: 0.0,
            force,
            force_vector: [0.0; 3],
            shift: [0.0; 3],
            contacts: 0,
        };
        IncrementReport {
            increment: 1,
            stage: 0,
            stage_name: "",
            time: 0.0,
            share: 1.0,
            free,
            tools: vec![tool(30.0), tool(-10.0)],
            iterations: 0,
            iterations_total: 0,
            cuts: 0,
            snap_throughs: 0,
            stabilised: 0,
            unstable: 0,
            buckles: 0,
            history: &[],
            energies: Energies { elastic, ..Energies::default() },
            rounding_work: 0.0,
            volume_balance: None,
            over_edge: None,
            face_penetration: None,
            face_depths: &[],
            contacts: 0,
            slipping: 0,
            timings: Timings::default(),
            body,
            displacements: u,
            contact_forces: &[],
            node_contacts: &[],
        }
    }

    /// Of a strip of 1 and 3 mm long elements the longer one has three quarters.
    #[test]
    fn the_root_mean_square_is_over_the_volume() {
        let mut mesh = rectangle(2.0, 1.0, 1.0, 2, 1, 1);
        mesh.nodes.iter_mut().filter(|x| x.x > 1.5).for_each(|x| x.x = 4.0);
        let moved: Vec<f64> =
            mesh.nodes.iter().flat_map(|x| [0.0, 0.0, if x.x > 0.5 { 2.0 } else { 0.0 }]).collect();
        let elastic = Arc::new(Elastic { young: 7e4, poisson: 0.3 });
        let body = Body::new(mesh, ElementKind::Hex8, elastic).unwrap();
        let mut springback = Springback::default();
        springback.update(&report(&body, false, &[0.0; 36], 1.0));
        let found = springback.update(&report(&body, true, &moved, 1.0)).unwrap();
        assert!((found.rms_mm - 2.0 * 0.875_f64.sqrt()).abs() < 1e-14, "{}", found.rms_mm);
    }

    /// A quarter cylinder of 20 mm radius that opens to 21 mm: 1 mm along the normal at every node, outwards, which is
    /// towards the lower face. A rigid shift of 0.5 mm along x has the component of the normal.
    #[test]
    fn the_map_is_the_distance_along_the_normal_of_the_loaded_sheet() {
        let mesh = rectangle(1.0, 1.0, 0.8, 60, 1, 2);
        let on = |x: &Vec3, radius: f64| {
            let angle = (x.x - 0.5) * std::f64::consts::FRAC_PI_2;
            let from_axis = radius - (x.z - 0.4);
            Vec3::new(from_axis * angle.sin(), x.y, -from_axis * angle.cos())
        };
        let displacements = |to: &dyn Fn(&Vec3) -> Vec3| -> Vec<f64> {
            mesh.nodes.iter().flat_map(|x| <[f64; 3]>::from(to(x) - x)).collect()
        };
        let held = displacements(&|x| on(x, 20.0));
        let springback = Springback { held, ..Springback::default() };
        let open = displacements(&|x| on(x, 21.0));
        let map = springback.along_normal(&mesh, &open);
        assert_eq!(map.len(), mesh.nodes.len());
        // Normals of the mesh are those of chords of 1.5 degrees.
        assert!(map.iter().all(|d| (d + 1.0).abs() < 2e-4), "{map:?}");
        let shifted = displacements(&|x| on(x, 20.0) + Vec3::x() * 0.5);
        for (x, d) in mesh.nodes.iter().zip(springback.along_normal(&mesh, &shifted)) {
            let expected = -0.5 * ((x.x - 0.5) * std::f64::consts::FRAC_PI_2).sin();
            assert!((d - expected).abs() < 7e-3, "{d} {expected}");
        }
        let [largest, smallest] = springback.peaks(&mesh, &shifted).unwrap();
        assert!(largest.at_mm[0] < -13.0 && smallest.at_mm[0] > 13.0);
        assert!((largest.displacement_mm - 0.3535).abs() < 7e-3);
        assert!(Springback::default().along_normal(&mesh, &open).is_empty());
    }

    #[test]
    fn what_moves_back_is_measured_from_where_the_tools_held_the_sheet() {
        let body = body();
        let report = |free, u, elastic| report(&body, free, u, elastic);
        let mut springback = Springback::default();
        assert_eq!(springback.update(&report(false, &[9.0; 6], 9.0)), None);
        assert_eq!(springback.update(&report(false, &[1.0; 6], 5.0)), None);
        let there = [1.0, 4.0, 5.0, 1.0, 1.0, 1.0];
        let found = springback.update(&report(true, &there, 2.0)).unwrap();
        assert_eq!([found.largest_mm, found.force_n, found.energy_nmm], [5.0, 40.0, 3.0]);
        assert_eq!(found.from_increment, Some(1));
        assert!((found.rms_mm - 12.5_f64.sqrt()).abs() < 1e-15);
        // Moved further while free: measured from the same state. Formed and released again: measured from the last
        // equilibrium with tools.
        let found = springback.update(&report(true, &[4.0; 6], 1.0)).unwrap();
        assert_eq!(found.largest_mm, 27.0_f64.sqrt());
        assert_eq!(springback.update(&report(false, &[7.0; 6], 1.0)), None);
        let next = [9.0, 7.0, 7.0, 7.0, 7.0, 7.0];
        assert_eq!(springback.update(&report(true, &next, 1.0)).unwrap().largest_mm, 2.0);
        // No equilibrium with tools before.
        assert_eq!(Springback::default().update(&report(true, &[1.0; 6], 0.0)), None);
    }
}
