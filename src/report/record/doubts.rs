//! Doubts about a run: about its scene, and about its result.

use super::sheet::THICKNESS_MIN_REL;
use super::{
    FacePenetrationRecord, HolderLostRecord, IncrementErrorRecord, NeckingKind, RunRecord, Verdict,
};
use crate::doubt::{Doubt, DoubtCode, place_mm};

/// Penetration of a node over the maximum thickness, above which a doubt is raised.
const NODE_PENETRATION_MAX_REL: f64 = 0.05;
/// Unaccounted energy over the work, above which a doubt is raised.
const UNACCOUNTED_ENERGY_MAX_REL: f64 = 0.01;
/// Unaccounted energy of one increment over the work of the whole run, below which it is ignored.
const UNACCOUNTED_ENERGY_IGNORED_REL: f64 = 1e-3;
/// Work of the remaining forces of released tools over all work, above which a doubt is raised.
const RELEASED_FORCE_WORK_MAX_REL: f64 = 0.02;
/// Artificial (hourglass) energy over the work, above which a doubt is raised.
const ARTIFICIAL_ENERGY_MAX_REL: f64 = 0.02;
/// Lift of a blank holder over the initial thickness, above which a doubt is raised. A flange thickens by less than half
/// its thickness, so that a larger lift means wrinkles or folds.
const HOLDER_LIFT_MAX_REL: f64 = 1.0;

impl RunRecord {
    /// All doubts of the run so far: first `scene`, the doubts about the set-up, then the doubts about the result.
    #[must_use]
    pub fn all_doubts(&self, scene: &[Doubt]) -> Vec<Doubt> {
        let found = [
            self.penetration_at_nodes(),
            self.penetration_on_faces(),
            self.inside_tool(),
            self.never_touched(),
            self.unstable_equilibrium(),
            self.hourglass_modes(),
            self.artificial_energy(),
            self.shear_at_friction_limit(),
            self.self_penetration(),
            self.overhang(),
            self.released_force_work(),
            self.energy_not_accounted_for(),
            self.increments_too_long(),
            self.localised_thinning(),
            self.thickness_below_half(),
            self.holder_lifted(),
            self.holder_lost(),
        ];
        let found = found.into_iter().flatten().chain(self.quality_doubts());
        scene.iter().cloned().chain(found).collect()
    }

    /// The verdict of a run with all stages done: `completed` without doubts, `doubtful` with any.
    #[must_use]
    pub fn completed_verdict(&self) -> Verdict {
        if self.doubts.is_empty() { Verdict::Completed } else { Verdict::Doubtful }
    }

    fn penetration_at_nodes(&self) -> Option<Doubt> {
        let limit = NODE_PENETRATION_MAX_REL * self.thickness.as_ref()?.maximum_mm;
        (self.penetration_mm > limit).then(|| {
            Doubt::of(
                DoubtCode::PenetrationAtNodes,
                String::new(),
                [self.penetration_mm, limit],
                format!(
                    "Nodes are up to {:.3} mm inside a tool ({:.0} % of the thickness allowed). Contact keeps a node out of one tool at a time: join tools that meet at a corner into one file, keep the edge of a tool away from the gap between two others, or raise `solver.contact.stiffness`.",
                    self.penetration_mm,
                    100.0 * NODE_PENETRATION_MAX_REL
                ),
            )
        })
    }

    fn penetration_on_faces(&self) -> Option<Doubt> {
        let allowed = FacePenetrationRecord::ALLOWED_REL;
        let found = self.face_penetration.as_ref().filter(|found| found.depth_rel > allowed)?;
        let FacePenetrationRecord { tool, increment, depth_mm, depth_rel, at_mm, .. } = found;
        let first = found.first_increment.unwrap_or(*increment);
        // The sag of an element face is proportional to the square of its length.
        let shorter = (allowed / depth_rel).sqrt();
        Some(Doubt::of(
            DoubtCode::PenetrationOnFaces,
            format!("{tool}, increment {increment}, {}", place_mm(at_mm)),
            [*depth_rel, allowed],
            format!(
                "{tool} penetrates element faces between nodes by up to {depth_mm:.3} mm, {:.0} % of the thickness ({:.0} % allowed), at {} in increment {increment}; above the limit from increment {first} on. Contact conditions are at nodes: forces and thinning there depend on the mesh. Use elements of {shorter:.2} times the length there, or a larger tool radius.",
                100.0 * depth_rel,
                100.0 * allowed,
                place_mm(at_mm)
            ),
        ))
    }

    fn localised_thinning(&self) -> Option<Doubt> {
        let found = self.necking.as_ref()?;
        let (code, what) = match found.kind {
            NeckingKind::Band => (
                DoubtCode::LocalisedNecking,
                "past the maximum force a band of the sheet thins while the rest unloads. Its width and strains are those of the mesh. The sheet fails there: reduce the depth, the friction or the holder force, or compare the strains with the forming limit",
            ),
            NeckingKind::Dip => (
                DoubtCode::LocalisedThinning,
                "a row of nodes thins far more than its neighbours, within less than the sheet's thickness: a kink of the elements. Use two layers or more, or elements of half the thickness or longer",
            ),
            NeckingKind::Torn => return None,
        };
        let (place, left) = (place_mm(&found.at_mm), 100.0 * found.thickness_rel);
        let force = found.maximum_force.as_ref().map_or_else(String::new, |force| {
            format!(
                ", after the maximum force of {} ({:.0} N) in increment {}",
                force.tool, force.force_n, force.increment
            )
        });
        Some(Doubt {
            value: Some(found.thickness_rel),
            ..Doubt::new(
                code,
                format!("increment {}, {place}", found.first_increment),
                format!(
                    "Localised thinning to {left:.1} % of the initial thickness at {place}, from increment {} on{force}: {what}.",
                    found.first_increment
                ),
            )
        })
    }

    fn inside_tool(&self) -> Option<Doubt> {
        let found = self.inside_tool.as_ref()?;
        Some(Doubt {
            value: Some(found.depth_mm),
            ..Doubt::new(
                DoubtCode::InsideTool,
                format!("{}, stage {}", found.tool, found.stage),
                format!(
                    "At the end of stage `{}` {} nodes are inside {}, by up to {:.3} mm at {}. Contact of a tool includes the nodes of one face of the sheet: set its `direction` or `side` (\"both\" if it meets both faces), or start it clear of the sheet.",
                    found.stage,
                    found.nodes,
                    found.tool,
                    found.depth_mm,
                    place_mm(&found.at_mm)
                ),
            )
        })
    }

    fn never_touched(&self) -> Option<Doubt> {
        let tools = self.tools_never_touched.join(", ");
        (!tools.is_empty()).then(|| {
            Doubt::new(
                DoubtCode::ToolNeverTouched,
                tools.clone(),
                format!(
                    "{tools} travelled and never touched the sheet. Check its place, direction and travel, and the unit of its file (mm)."
                ),
            )
        })
    }

    fn unstable_equilibrium(&self) -> Option<Doubt> {
        let first = self.first_unstable?;
        Some(Doubt::of(
            DoubtCode::UnstableEquilibrium,
            format!("increment {first}"),
            [self.unstable_increments as f64, 0.0],
            format!(
                "{} of {} increments, first {first}, ended in an unstable equilibrium: the sheet buckles or wrinkles there, and neither step cuts nor a push along the softest motion led to another equilibrium. Try another `largest_increment`, a finer mesh, or a higher holder force.",
                self.unstable_increments, self.increments
            ),
        ))
    }

    fn hourglass_modes(&self) -> Option<Doubt> {
        let found = self.hourglass.as_ref()?;
        Some(Doubt {
            value: Some(found.fraction),
            ..Doubt::new(
                DoubtCode::HourglassModes,
                format!("increment {}, {}", found.first_increment, place_mm(&found.at_mm)),
                format!(
                    "From increment {} on up to {:.0} % of the thickness fibres of the mesh tilt in alternate directions, first at {}: an hourglass mode of wide elements under pressure through the thickness. Forces are far too low. Use `element` \"hex8\" in four layers or more where the sheet is pressed.",
                    found.first_increment,
                    100.0 * found.fraction,
                    place_mm(&found.at_mm)
                ),
            )
        })
    }

    fn artificial_energy(&self) -> Option<Doubt> {
        let ratio = self.artificial_energy_nmm.abs() / self.work_nmm;
        (ratio > ARTIFICIAL_ENERGY_MAX_REL).then(|| {
            Doubt::of(
                DoubtCode::ArtificialEnergy,
                String::new(),
                [ratio, ARTIFICIAL_ENERGY_MAX_REL],
                format!(
                    "Artificial (hourglass) energy is {:.1} % of the work ({:.0} % allowed): forces are wrong by at least as much. Use `element` \"hex8\" in four layers or more where the sheet is pressed through its thickness.",
                    100.0 * ratio,
                    100.0 * ARTIFICIAL_ENERGY_MAX_REL
                ),
            )
        })
    }

    fn shear_at_friction_limit(&self) -> Option<Doubt> {
        let found = self.through_thickness_shear.as_ref()?;
        Some(Doubt {
            value: Some(found.fraction),
            ..Doubt::new(
                DoubtCode::ShearAtFrictionLimit,
                format!("increment {}, {}", found.first_increment, place_mm(&found.at_mm)),
                format!(
                    "From increment {} on friction shears the faces of the pressed sheet at its shear flow stress, at up to {:.0} % of the pressed nodes, first at {}. The sheet flows out between its faces, which few elements through the thickness cannot follow: forces are wrong by factors. Use `element` \"hex8\" in four layers or more.",
                    found.first_increment,
                    100.0 * found.fraction,
                    place_mm(&found.at_mm)
                ),
            )
        })
    }

    fn self_penetration(&self) -> Option<Doubt> {
        let found = self.self_penetration.as_ref()?;
        Some(Doubt::of(
            DoubtCode::SelfPenetration,
            format!("increment {}, {}", found.first_increment, place_mm(&found.at_mm)),
            [found.nodes as f64, 0.0],
            format!(
                "The sheet penetrates itself from increment {} on (up to {} nodes), first at {}. Self-contact is not modelled; forces are too low from there on.",
                found.first_increment,
                found.nodes,
                place_mm(&found.at_mm)
            ),
        ))
    }

    fn overhang(&self) -> Option<Doubt> {
        let edge = self.overhang.as_ref()?;
        Some(Doubt {
            value: Some(edge.depth_mm),
            ..Doubt::new(
                DoubtCode::OverhangAtEdge,
                format!("{}, {}", edge.tool, place_mm(&edge.at_mm)),
                format!(
                    "The sheet overhangs an edge of {} from increment {} on (up to {} nodes), first at {}; the edge is up to {:.2} mm inside the sheet between nodes. Forces there depend on the mesh, and a node drawn back over the edge may catch. Model the edge radius of the tool, or extend the tool beyond the sheet.",
                    edge.tool,
                    edge.first_increment,
                    edge.nodes,
                    place_mm(&edge.at_mm),
                    edge.depth_mm
                ),
            )
        })
    }

    fn released_force_work(&self) -> Option<Doubt> {
        let ratio = self.released_force_work_nmm / self.work_nmm;
        (ratio > RELEASED_FORCE_WORK_MAX_REL).then(|| {
            Doubt::of(
                DoubtCode::ReleasedForceWork,
                String::new(),
                [ratio, RELEASED_FORCE_WORK_MAX_REL],
                format!(
                    "Contact forces of released tools did {:.0} N mm of work on the sheet while they were reduced to zero, {:.0} % of all work ({:.0} % allowed): the sheet moved with them because no tool guided it. Move these tools back by `travel_mm` first.",
                    self.released_force_work_nmm,
                    100.0 * ratio,
                    100.0 * RELEASED_FORCE_WORK_MAX_REL
                ),
            )
        })
    }

    /// The error of a single increment counts too: later work or an error of opposite sign can hide it in the total.
    fn energy_not_accounted_for(&self) -> Option<Doubt> {
        let worst = self.largest_unaccounted.filter(|worst| {
            worst.energy_nmm > UNACCOUNTED_ENERGY_MAX_REL * worst.work_nmm
                && worst.energy_nmm > UNACCOUNTED_ENERGY_IGNORED_REL * self.work_nmm
        });
        let of_increment = worst.map_or(0.0, |worst| worst.energy_nmm / worst.work_nmm);
        let in_one = worst.map(|worst| {
            format!(
                "{:.1} % of the work so far in increment {}",
                100.0 * of_increment,
                worst.increment
            )
        });
        let in_all = (self.energy_error > UNACCOUNTED_ENERGY_MAX_REL)
            .then(|| format!("{:.1} % of the work in all", 100.0 * self.energy_error));
        let found: Vec<String> = in_all.into_iter().chain(in_one).collect();
        (!found.is_empty()).then(|| {
            Doubt::of(
                DoubtCode::EnergyBalance,
                worst.map_or_else(String::new, |worst| format!("increment {}", worst.increment)),
                [self.energy_error.max(of_increment), UNACCOUNTED_ENERGY_MAX_REL],
                format!(
                    "Energy is not accounted for: {} ({:.0} % allowed). Increments are too long for what happens in them (contact that closes in one step, snap-through). Reduce `largest_increment`.",
                    found.join(", "),
                    100.0 * UNACCOUNTED_ENERGY_MAX_REL
                ),
            )
        })
    }

    fn increments_too_long(&self) -> Option<Doubt> {
        let error = self.increment_error?;
        let most = IncrementErrorRecord::ALLOWED_REL;
        let limit = error.allowed.map_or(most, |allowed| allowed.min(most));
        if error.of_work <= limit {
            return None;
        }
        Some(Doubt::of(
            DoubtCode::IncrementsTooLong,
            format!("increment {}", error.increment),
            [error.of_work, limit],
            format!(
                "Forces are too low because of the length of the increments: they lack about {:.2} % of the work ({:.2} % allowed), {:.2} % in increment {}. Give `solver.increment_error`, for example 0.01; where it is given, take a shorter `first_increment` of the stage.",
                100.0 * error.of_work,
                100.0 * limit,
                100.0 * error.largest,
                error.increment
            ),
        ))
    }

    fn holder_lifted(&self) -> Option<Doubt> {
        let lift = self.holder_lift.as_ref()?;
        let limit = HOLDER_LIFT_MAX_REL * self.thickness.as_ref()?.initial_mm;
        (lift.lift_mm > limit).then(|| {
            Doubt::of(
                DoubtCode::HolderLifted,
                format!("{}, increment {}", lift.tool, lift.increment),
                [lift.lift_mm, limit],
                format!(
                    "The sheet pushed the blank holder {} back by {:.2} mm (increment {}; {limit:.2} mm allowed, one thickness): its force does not hold the sheet down, and the flange wrinkles or folds. Raise `force_n`, or check its unit (N, of the whole process).",
                    lift.tool, lift.lift_mm, lift.increment
                ),
            )
        })
    }

    fn holder_lost(&self) -> Option<Doubt> {
        let lost = self.holder_lost.as_ref()?;
        Some(Doubt::of(
            DoubtCode::HolderLost,
            format!("{}, increment {}", lost.tool, lost.increment),
            [lost.area_rel, HolderLostRecord::AREA_MIN_REL],
            format!(
                "The blank is drawn out from under {} in increment {}: {:.2} % of it is between the holder and the tool opposite ({:.0} % expected). From there on the whole force acts on the rim alone. Take a larger blank, less travel or more holder force; if the rim is to leave the holder, give the holder `stop_mm`.",
                lost.tool,
                lost.increment,
                100.0 * lost.area_rel,
                100.0 * HolderLostRecord::AREA_MIN_REL
            ),
        ))
    }

    fn thickness_below_half(&self) -> Option<Doubt> {
        let thickness = self.thickness.filter(super::ThicknessRecord::is_below_half)?;
        let left = thickness.minimum_mm / thickness.initial_mm;
        Some(Doubt::of(
            DoubtCode::ThicknessBelowHalf,
            place_mm(&thickness.at_mm),
            [left, THICKNESS_MIN_REL],
            format!(
                "The thickness is {:.0} % of its initial value ({:.4} of {:.4} mm) at {}: sheet metals neck and fracture before {:.0} %. Results after that are not those of a real sheet. Reduce the depth, the friction or the holder force.",
                100.0 * left,
                thickness.minimum_mm,
                thickness.initial_mm,
                place_mm(&thickness.at_mm),
                100.0 * THICKNESS_MIN_REL
            ),
        ))
    }
}
