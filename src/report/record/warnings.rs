//! What of a run is not as it should be, in words.

use super::{FacePenetrationRecord, NeckingKind, RunRecord};

/// Share of the thickness that a node may lie in a tool, and of the work that energy may lack.
const DEEP: f64 = 0.05;
const OPEN: f64 = 0.01;
/// Energy left open in one increment, as a share of all work, below which it is of no note.
const OF_ALL: f64 = 1e-3;

/// Share of the work that forces left behind may do on the sheet.
const RUNS: f64 = 0.02;

/// Share of the work that may be done against what steadies the fibres.
const ARTIFICIAL: f64 = 0.02;

impl RunRecord {
    /// What makes the results doubtful as far as the run has come: of the scene, and of what became of the sheet.
    #[must_use]
    pub fn doubtful(&self) -> Vec<String> {
        let seen = [
            self.penetration(),
            self.penetration_on_faces(),
            self.localised_thinning(),
            self.in_tool(),
            self.untouched(),
            self.instability(),
            self.fold_of_mesh(),
            self.steadied(),
            self.sheared_faces(),
            self.fold(),
            self.border(),
            self.runaway(),
            self.open_energy(),
        ];
        self.doubts.iter().cloned().chain(seen.into_iter().flatten()).collect()
    }

    fn penetration(&self) -> Option<String> {
        let thickness = self.thickness.as_ref().map_or(f64::INFINITY, |t| t.most_mm);
        (self.penetration_mm > DEEP * thickness).then(|| {
            format!(
                "nodes lie up to {:.3} mm in a tool, as another tool holds them, of two tools at one node only one is seen (a corner made of two files, a tool that pushes on an edge between two others), or as the springs of `solver.contact` are soft",
                self.penetration_mm
            )
        })
    }

    fn penetration_on_faces(&self) -> Option<String> {
        let allowed = FacePenetrationRecord::ALLOWED_REL;
        let found = self.face_penetration.as_ref().filter(|found| found.depth_rel > allowed)?;
        let FacePenetrationRecord { tool, increment, depth_mm, depth_rel, .. } = found;
        let ([x, y, z], first) = (found.at_mm, found.first_increment.unwrap_or(*increment));
        // The sag of a face goes with the square of its length.
        let shorter = (allowed / depth_rel).sqrt();
        Some(format!(
            "{tool} penetrates faces of elements between their nodes by up to {depth_mm:.3} mm, {:.0} % of the thickness ({:.0} % allowed), in increment {increment} at ({x:.1}, {y:.1}, {z:.1}) mm; above the limit from increment {first} on. Contact conditions hold nodes only: forces and thinning there depend on the mesh. Make elements there {shorter:.2} times as long, or give the tool a larger radius",
            100.0 * depth_rel,
            100.0 * allowed
        ))
    }

    fn localised_thinning(&self) -> Option<String> {
        let found = self.necking.as_ref()?;
        let ([x, y, z], first) = (found.at_mm, found.first_increment);
        let what = match found.kind {
            NeckingKind::Band => {
                "past the maximum force a band of the sheet thins while the rest unloads: a localised neck, as wide as the elements make it. Results from there on are of the mesh; the sheet fails there, or compare strains with its forming limit"
            }
            NeckingKind::Dip => {
                "columns of nodes are thinner than those beside them over less than the sheet's thickness, as no sheet can be: a kink of the elements. Use two layers or more, or elements of half the thickness or longer"
            }
            NeckingKind::Torn => "a sheet tears before it has lost half of its thickness",
        };
        Some(format!(
            "localised thinning to {:.1} % of the initial thickness at ({x:.1}, {y:.1}, {z:.1}) mm, from increment {first} on: {what}",
            100.0 * found.thickness_rel
        ))
    }

    fn in_tool(&self) -> Option<String> {
        let found = self.in_tool.as_ref()?;
        let [x, y, z] = found.at_mm;
        Some(format!(
            "at the end of stage `{}` {} nodes of the sheet are inside {}, the deepest by {:.3} mm at ({x:.1}, {y:.1}, {z:.1}) mm: a tool sees nodes of one face of the sheet (its `direction` or `side`), which is the wrong one or not the only one that it meets (\"both\"), or it came in where the sheet was",
            found.stage, found.nodes, found.tool, found.depth_mm
        ))
    }

    fn untouched(&self) -> Option<String> {
        let tools = self.untouched.join(", ");
        (!tools.is_empty()).then(|| {
            format!("{tools} travelled and never touched the sheet: check place, direction, travel and the unit of its file (mm)")
        })
    }

    fn instability(&self) -> Option<String> {
        let first = self.first_unstable?;
        Some(format!(
            "{} increments, the first of them {first}, ended in a balance that does not last: the sheet buckles or wrinkles there, and neither shorter steps nor a push along the motion in which it gives way led to another balance. To follow it, try another largest_increment, a finer mesh or a larger load across",
            self.unstable
        ))
    }

    fn fold_of_mesh(&self) -> Option<String> {
        let zigzag = self.zigzag.as_ref()?;
        let [x, y, z] = zigzag.at_mm;
        Some(format!(
            "from increment {} on up to {:.0} % of the mesh's columns lean to opposite sides by turns, first at ({x:.1}, {y:.1}, {z:.1}) mm: under pressure through the thickness elements that are wide for their layer fold so, and forces are far too low. Press it with `element` `hex8` in four layers or more",
            zigzag.first_increment,
            100.0 * zigzag.share
        ))
    }

    fn steadied(&self) -> Option<String> {
        (self.artificial_nmm.abs() > ARTIFICIAL * self.work_nmm).then(|| {
            format!(
                "{:.1} % of the work was done against what keeps fibres of wide elements from tilting by turns under pressure through the thickness: forces are off by that much or far more. Press it with `element` `hex8` in four layers or more",
                100.0 * self.artificial_nmm / self.work_nmm
            )
        })
    }

    fn sheared_faces(&self) -> Option<String> {
        let sheared = self.sheared.as_ref()?;
        let [x, y, z] = sheared.at_mm;
        Some(format!(
            "from increment {} on friction shears the faces of the pressed sheet as far as it bears, at up to {:.0} % of the nodes that are pressed so, first at ({x:.1}, {y:.1}, {z:.1}) mm: its middle moves out against them, which takes `element` `hex8` in four layers or more; forces of others are wrong by factors there",
            sheared.first_increment,
            100.0 * sheared.share
        ))
    }

    fn fold(&self) -> Option<String> {
        let through = self.through_itself.as_ref()?;
        let [x, y, z] = through.at_mm;
        Some(format!(
            "the sheet passes through itself from increment {} on, up to {} nodes, first at ({x:.1}, {y:.1}, {z:.1}) mm: nothing keeps it from that, and forces are too low from there on",
            through.first_increment, through.nodes
        ))
    }

    fn border(&self) -> Option<String> {
        let edge = self.over_edge.as_ref()?;
        let [x, y, z] = edge.at_mm;
        Some(format!(
            "the sheet bends over the border of {} from increment {} on, up to {} nodes, first at ({x:.1}, {y:.1}, {z:.1}) mm, {:.2} mm deep: tools hold nodes and see nothing between them, so that forces there go by the mesh, and a node drawn back over the border may lock the sheet. Give the tool its edge radius, or let it end beyond the sheet",
            edge.tool, edge.first_increment, edge.nodes, edge.depth_mm
        ))
    }

    fn runaway(&self) -> Option<String> {
        (self.left_behind_nmm > RUNS * self.work_nmm).then(|| {
            format!(
                "forces that tools left behind as they were let go have done {:.0} N mm of work on the sheet, {:.0} % of all: it ran along with them, as no tool guides them and it was held by friction alone. Let these tools go back by travel first",
                self.left_behind_nmm,
                100.0 * self.left_behind_nmm / self.work_nmm
            )
        })
    }

    /// Later work, and energy that opens the other way, do not make good what an increment left open.
    fn open_energy(&self) -> Option<String> {
        let most = self.opened.filter(|most| {
            most.energy_nmm > OPEN * most.work_nmm && most.energy_nmm > OF_ALL * self.work_nmm
        });
        let in_one = most.map(|most| {
            let share = 100.0 * most.energy_nmm / most.work_nmm;
            format!(
                "{share:.1} % of the work done by then opened in increment {} alone",
                most.increment
            )
        });
        let in_all = (self.energy_balance > OPEN).then(|| {
            format!("{:.1} % of the work is not accounted for", 100.0 * self.energy_balance)
        });
        let found: Vec<String> = in_all.into_iter().chain(in_one).collect();
        (!found.is_empty()).then(|| {
            format!(
                "energy does not close, {}: increments are too long for what happens in them (contact that closes in one step, a sheet that jumps); a smaller largest_increment sees more",
                found.join(", ")
            )
        })
    }
}
