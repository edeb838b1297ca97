//! Updates of `run.json` and `iterations.csv` after a converged increment.

use super::RunFolder;
use crate::advice::holder::Holder;
use crate::contact_pressure::{ToolPressure, of_tools};
use crate::holding::{Placed, area_between, lower_faces};
use crate::resources::{Clock, peak_megabytes};
use kanagata_geometry::Vec3;
use kanagata_report::record::{
    HolderLiftRecord, HolderLostRecord, HolderPressureRecord, IterationRow, PressurePeakRecord,
    UnaccountedEnergyRecord,
};
use kanagata_solver::{IncrementReport, IterationRecord, convergence_order};

impl RunFolder {
    /// Records the lift of blank holders: travel back from the farthest position under force control.
    pub(super) fn record_holder_lift(&mut self, report: &IncrementReport<'_>) {
        for holder in &self.holders {
            let Some(farthest) = self.farthest.get_mut(holder.tool) else { continue };
            if !holder.is_forced(report.stage) {
                *farthest = None;
                continue;
            }
            let (name, travel) =
                (&report.tools[holder.tool].name, report.tools[holder.tool].travel);
            let position = farthest.map_or(travel, |position: f64| position.max(travel));
            *farthest = Some(position);
            let lift_mm = position - travel;
            if lift_mm > self.record.holder_lift.as_ref().map_or(0.0, |known| known.lift_mm) {
                let (tool, increment) = (name.clone(), report.increment);
                self.record.holder_lift = Some(HolderLiftRecord { tool, increment, lift_mm });
            }
        }
    }

    /// Records the first increment after which the sheet, with its nodes at `positions` [mm], is no longer between a
    /// holder under force and the tools opposite.
    pub(super) fn record_holder_lost(&mut self, report: &IncrementReport<'_>, positions: &[Vec3]) {
        let watched = |holder: &&Holder| {
            let presses = report.tools[holder.tool].force > 0.0;
            presses && holder.is_forced(report.stage) && !holder.has_stop && holder.is_on_blank()
        };
        if self.record.holder_lost.is_some() || report.increment == 0 {
            return;
        }
        let placed = |tool: usize| Placed {
            surface: &self.surfaces[tool],
            shift: report.tools[tool].shift.into(),
        };
        let mesh = report.body.mesh();
        self.record.holder_lost = self.holders.iter().filter(watched).find_map(|holder| {
            let faces = lower_faces(mesh, positions, &holder.direction);
            let dies: Vec<Placed<'_>> = holder.dies.iter().map(|&die| placed(die)).collect();
            let pair = (&placed(holder.tool), &dies[..]);
            let area_mm2 = area_between(&faces, &holder.direction, mesh.mean_thickness(), pair);
            (area_mm2 < HolderLostRecord::AREA_MIN_REL * holder.blank).then(|| HolderLostRecord {
                tool: report.tools[holder.tool].name.clone(),
                increment: report.increment,
                area_mm2,
                area_rel: area_mm2 / holder.blank,
            })
        });
    }

    /// Records the contact pressure of blank holders that a force drives, with the nodes at `positions` [mm].
    pub(super) fn record_pressures(&mut self, report: &IncrementReport<'_>, positions: &[Vec3]) {
        let pressed = |holder: &&Holder| holder.is_forced(report.stage);
        if !self.holders.iter().any(|holder| pressed(&holder)) {
            return;
        }
        let mesh = report.body.mesh();
        let found = of_tools(mesh, positions, report.node_contacts, report.tools.len());
        for Holder { tool, .. } in self.holders.iter().filter(pressed) {
            let Some(pressure) = found.get(*tool).copied().flatten() else { continue };
            let name = &report.tools[*tool].name;
            let at = positions[pressure.node].into();
            let all = &mut self.record.holder_pressure;
            let known = all.iter().position(|known| known.tool == *name);
            let before = known.map(|k| all.swap_remove(k).peak);
            let now = PressurePeakRecord {
                increment: report.increment,
                max_mpa: pressure.max_mpa,
                at_mm: at,
            };
            let peak = before.filter(|peak| peak.max_mpa >= now.max_mpa).unwrap_or(now);
            let ToolPressure { mean_mpa, max_mpa, area_mm2, .. } = pressure;
            let (tool, increment) = (name.clone(), report.increment);
            all.push(HolderPressureRecord {
                tool,
                increment,
                mean_mpa,
                area_mm2,
                max_mpa,
                max_at_mm: at,
                peak,
            });
            all.sort_by(|a, b| a.tool.cmp(&b.tool));
        }
    }

    pub(super) fn record_iterations(&mut self, increment: usize, history: &[IterationRecord]) {
        self.iterations.extend(history.iter().enumerate().map(|(iteration, r)| IterationRow {
            increment,
            iteration,
            residual: r.residual,
            gap_mm: r.gap,
            correction_mm: r.correction,
            contacts: [r.contacts, r.slipping, r.changes],
        }));
    }

    pub(super) fn record_convergence(&mut self, report: &IncrementReport<'_>) {
        if let Some(order) = convergence_order(report.history) {
            let at = self.orders.partition_point(|&o| o < order);
            self.orders.insert(at, order);
            self.record.convergence_order = Some(self.orders[self.orders.len() / 2]);
        }
    }

    pub(super) fn update_record(&mut self, report: &IncrementReport<'_>, clock: &Clock) {
        let record = &mut self.record;
        record.increments = report.increment;
        record.iterations = report.iterations_total;
        record.step_cuts = report.cuts;
        record.snap_throughs = report.snap_throughs;
        record.stabilised_increments = report.stabilised;
        if report.unstable > record.unstable_increments {
            record.first_unstable.get_or_insert(report.increment);
        }
        record.unstable_increments = report.unstable;
        if report.buckles > record.buckles {
            record.first_buckle.get_or_insert(report.increment);
        }
        record.buckles = report.buckles;
        record.released_elastic_nmm = report.energies.released_elastic;
        record.wall_s = self.spent_s[0] + clock.wall_s();
        record.cpu_s = self.spent_s[1] + clock.cpu_s();
        record.peak_mb = record.peak_mb.max(peak_megabytes());
        let t = &report.timings;
        record.factorisations = t.factorisations;
        record.updates = t.updates;
        record.active_set_cycling = t.cycling;
        record.timings_s = [
            ("search", t.search),
            ("elements", t.elements),
            ("contact", t.contact),
            ("factor", t.factor),
            ("update", t.update),
            ("solve", t.solve),
            ("stability", t.stability),
            ("penetration", t.penetration),
        ]
        .map(|(name, seconds)| (name.to_owned(), seconds))
        .into();
        self.update_errors(report);
        self.record.springback = self.springback.update(report);
    }

    /// Records the errors of equilibrium, energy and volume.
    fn update_errors(&mut self, report: &IncrementReport<'_>) {
        let record = &mut self.record;
        let largest =
            report.tools.iter().flat_map(|t| t.force_vector).fold(0.0, |m: f64, f| m.max(f.abs()));
        self.force_scale = self.force_scale.max(largest);
        if self.force_scale > 0.0 {
            let off = force_imbalance(report);
            record.force_error = record.force_error.max(off / self.force_scale);
        }
        let e = &report.energies;
        let open = e.imbalance().abs();
        let opened = (e.imbalance() - record.unaccounted_nmm).abs();
        let work = record.work_nmm.max(e.external.abs()).max(e.internal.abs());
        let reference_work = work.max(report.rounding_work);
        record.energy_error = if reference_work > 0.0 { open / reference_work } else { 0.0 };
        record.unaccounted_nmm = e.imbalance();
        if opened > record.largest_unaccounted.map_or(0.0, |before| before.energy_nmm) {
            let increment = report.increment;
            record.largest_unaccounted = Some(UnaccountedEnergyRecord {
                increment,
                energy_nmm: opened,
                work_nmm: reference_work,
            });
        }
        let unstored = (e.internal - e.stored()).abs();
        record.stored_energy_error =
            if reference_work > 0.0 { unstored / reference_work } else { 0.0 };
        let sums = [e.increment_errors.lacking, e.increment_errors.work];
        let increment_error = record.increment_error.get_or_insert_default();
        let rounding = report.rounding_work.max(f64::MIN_POSITIVE);
        increment_error.update(report.increment, sums, !report.free, rounding);
        record.work_nmm = work;
        record.released_force_work_nmm = e.released_forces;
        record.artificial_energy_nmm = e.artificial;
        let deepest = report.history.last().map_or(0.0, |last| last.penetration);
        record.penetration_mm = record.penetration_mm.max(deepest);
        let volume = report.volume_balance.map(|off| off.max(record.volume_error.unwrap_or(0.0)));
        record.volume_error = volume.or(record.volume_error);
    }
}

/// Largest component of the difference between the sum of nodal contact forces of the modelled part and the sum of tool
/// force vectors [N]: zero in equilibrium, in which forces of all tools and constrained planes cancel.
fn force_imbalance(report: &IncrementReport<'_>) -> f64 {
    let nodal = report.contact_forces.chunks_exact(3).fold([0.0; 3], |mut sum, f| {
        (0..3).for_each(|k| sum[k] += f[k]);
        sum
    });
    let tools = report.tools.iter().fold([0.0; 3], |mut sum, t| {
        (0..3).for_each(|k| sum[k] += t.force_vector[k]);
        sum
    });
    (0..3).map(|k| (nodal[k] - tools[k]).abs()).fold(0.0, f64::max)
}
