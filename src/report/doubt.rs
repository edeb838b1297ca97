//! Doubts: reasons why a result must not be trusted as it is, each with a stable code.
//!
//! A doubt about a run appears in `run.json`, at the end of the terminal output and at the head of the report, and sets
//! exit code 1. `docs/reference/doubts.md` is the table of all codes, generated from [`DoubtCode::ALL`].

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A position as messages print it [mm].
#[must_use]
pub fn place_mm(at: &[f64; 3]) -> String {
    format!("({:.1}, {:.1}, {:.1}) mm", at[0], at[1], at[2])
}

macro_rules! codes {
    ($($(#[$doc:meta])* $name:ident $code:literal $found:literal $limit:literal $meaning:literal;)*) => {
        /// Stable code of a doubt.
        #[derive(
            Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
        )]
        pub enum DoubtCode {
            $($(#[$doc])* #[serde(rename = $code)] $name,)*
        }

        impl DoubtCode {
            /// All codes, in the order of the reference.
            pub const ALL: &[Self] = &[$(Self::$name),*];

            /// The code as printed in files and on terminals.
            #[must_use]
            pub const fn as_str(self) -> &'static str {
                match self { $(Self::$name => $code,)* }
            }

            /// What raises it: `scene` (`check`, and mostly also `run`), `result` (`run`), `audit` or `convert`.
            #[must_use]
            pub const fn found_by(self) -> &'static str {
                match self { $(Self::$name => $found,)* }
            }

            /// The limit above which it is raised.
            #[must_use]
            pub const fn limit(self) -> &'static str {
                match self { $(Self::$name => $limit,)* }
            }

            /// Its meaning: the first sentence of its entry in the reference.
            #[must_use]
            pub const fn meaning(self) -> &'static str {
                match self { $(Self::$name => $meaning,)* }
            }
        }
    };
}

codes! {
    /// Stress or Young's modulus implausible for a sheet metal in MPa.
    MaterialUnits "material-units" "scene"
        "Young's modulus outside 500 to 10^6 MPa; flow stress at 0.2 % outside 5*10^-5 to 0.03 of it; strains of a hardening table above 3"
        "Stresses or strains of the material are not those of a sheet metal: its card is probably in other units than MPa.";
    /// Estimated errors above those that were asked for.
    AccuracyNotReached "accuracy-not-reached" "result"
        "the errors that `accuracy` allows"
        "The sequence of runs ended before the estimated errors were as small as asked.";
    /// Lengths or forces implausible for a forming process in mm and N.
    SceneUnits "scene-units" "scene"
        "thickness outside 0.01 to 50 mm; blank outside 1 to 20 000 mm; tool over 200 times larger or smaller than the blank; friction above 1; force above the flow stress times the blank's area"
        "Lengths, forces or friction are not those of a forming process: the scene is probably in other units than mm and N.";
    /// Blank-holder pressure outside the range of presses.
    HolderPressure "holder-pressure" "scene"
        "mean pressure on the clamped area below 0.05 MPa"
        "The blank holder presses far less or far more than presses do: its force is probably in kN, or of a part of the process only.";
    /// A tool whose friction coefficient the scene does not give.
    FrictionNotGiven "friction-not-given" "scene"
        "a tool without `friction`"
        "The scene does not give a tool's friction coefficient; 0 is used, and forces and strains depend on it strongly.";
    /// A cut side of the blank without symmetry plane, or tools that end there.
    SymmetryMissing "symmetry-missing" "scene"
        "a straight free side of the blank at which all tools end, or about which they are symmetric"
        "The blank and the tools are cut along a line where no symmetry plane is declared: the cut side is free and moves.";
    /// A symmetry plane about which tools, material or mesh are not symmetric.
    SymmetryWrong "symmetry-wrong" "scene"
        "image of the tool more than 10^-3 of the blank's size away; rolling direction oblique"
        "A declared symmetry plane mirrors something that is not symmetric: results are those of another process.";
    /// The blank does not cover the opening of the die.
    BlankTooSmall "blank-too-small" "scene"
        "less than 1 % of the blank between the holder and the die"
        "The blank lies within the opening of the tools that must hold it, and is pushed through.";
    /// Constrained nodes in the path of a tool.
    ConstrainedNodeDriven "constrained-node-driven" "scene"
        "a tool travels more than 5 % of the thickness into nodes that are constrained along its travel"
        "A tool is driven through nodes that cannot move: contact there has no solution, and the tool passes through the sheet.";
    /// Elements too long for a radius that the sheet is drawn over.
    ElementsTooLong "elements-too-long" "scene"
        "fewer than 2 elements over 90 degrees of the radius"
        "Elements are too long for a radius that the sheet is drawn over: they cut the corner, and forces and thinning are wrong.";
    /// One layer of hexahedra with two points through the thickness.
    TooFewPoints "too-few-points" "scene"
        "two points through the thickness"
        "Hexahedra with two points through the thickness: bending moments are wrong by a third, springback by a fifth.";
    /// Coincident nodes that are not joined.
    UnjoinedNodes "unjoined-nodes" "scene"
        "distance below 10^-3 of a layer's thickness"
        "Nodes of the blank coincide and are not joined: the sheet is slit there.";
    /// A mesh file that a check does not read.
    SheetNotExamined "sheet-not-examined" "scene"
        "mesh file above 16 MB of a blank in one layer, less with more layers"
        "The mesh file of the blank is too large for a quick check: nothing was compared with the sheet. It is examined on request.";
    /// A force-driven tool with no tool or support on the opposite side.
    ToolUnopposed "tool-unopposed" "scene"
        "a tool that pushes the sheet with no tool and no support on the other side"
        "A tool pushes a sheet that nothing supports on the other side: there is no equilibrium, or the sheet moves as a rigid body.";
    /// Loads on an unconstrained sheet.
    SheetUnconstrained "sheet-unconstrained" "scene"
        "net load above 10^-6 of all loads along an axis without support"
        "Loads push a sheet that nothing constrains: there is no equilibrium.";
    /// Tool patches without area.
    PatchesWithoutArea "patches-without-area" "scene"
        "area zero within rounding"
        "Patches of a tool have no area and so no normal.";
    /// No tool moves and no load acts on the sheet.
    NothingMoves "nothing-moves" "scene"
        "no driven tool and no load in any stage"
        "No stage moves a tool and no load acts: the sheet stays as it is.";
    /// A blank read from a result file, without its strains and stresses.
    StateDropped "state-dropped" "scene"
        "a result file used as an undeformed blank"
        "The blank is a deformed sheet from a result file, and its strains and stresses are not taken over.";
    /// Nodes inside a tool.
    PenetrationAtNodes "penetration-at-nodes" "result"
        "5 % of the thickness"
        "Nodes are inside a tool: two tools at one node, or springs of `solver.contact` that are too soft.";
    /// Penetration of a tool into element faces, between nodes.
    PenetrationOnFaces "penetration-on-faces" "result"
        "5 % of the thickness"
        "A tool stands inside the sheet between its nodes: contact conditions are at nodes only, and elements are too long for the tool.";
    /// Nodes inside a tool at the end of a stage that are not part of its contact.
    InsideTool "inside-tool" "scene, result"
        "10 % of the thickness before the first stage or at the end of a stage"
        "The undeformed sheet is inside a tool, or at the end of a stage it is inside one whose contact does not include these nodes.";
    /// A tool that travels and never touches the sheet.
    ToolNeverTouched "tool-never-touched" "result"
        "no contact force in any increment of a tool that travels"
        "A tool travels and never touches the sheet: its place, direction, travel or unit is probably wrong.";
    /// An increment that ended in an unstable equilibrium.
    UnstableEquilibrium "unstable-equilibrium" "result"
        "a negative eigenvalue of the tangent in an accepted increment"
        "The equilibrium found is unstable: the real sheet buckles or wrinkles there.";
    /// Hourglass modes of the mesh.
    HourglassModes "hourglass-modes" "result"
        "20 % of the thickness fibres tilt by more than 0.15 in alternate directions"
        "Elements deform in an hourglass mode under pressure through the thickness: forces are far too low.";
    /// Artificial (hourglass) energy.
    ArtificialEnergy "artificial-energy" "result"
        "2 % of the work"
        "The stabilisation of hourglass modes does work that the sheet does not do.";
    /// Through-thickness shear at the friction limit.
    ShearAtFrictionLimit "shear-at-friction-limit" "result"
        "30 % of the nodes pressed beyond the shear limit, in fewer than 4 layers or other elements than hex8"
        "Friction shears the faces of a pressed sheet at their limit, which one layer of elements cannot resolve: forces are wrong by factors.";
    /// Self-penetration of the sheet.
    SelfPenetration "self-penetration" "result"
        "any node inside another part of the sheet"
        "The sheet penetrates itself: self-contact is not modelled, and forces are too low from there on.";
    /// The sheet overhangs an edge of a tool.
    OverhangAtEdge "overhang-at-edge" "result"
        "10 % of the thickness below the edge between nodes"
        "The sheet overhangs an edge of a tool between nodes: forces there depend on the mesh.";
    /// Work of the remaining contact forces of released tools.
    ReleasedForceWork "released-force-work" "result"
        "2 % of the work"
        "Forces that released tools left behind moved the sheet: it was not held by any tool.";
    /// Energy balance error.
    EnergyBalance "energy-balance" "result"
        "1 % of the work"
        "Work done and energy found do not agree: increments are too long.";
    /// Increments in which the plastic flow or the friction turns too far.
    IncrementsTooLong "increments-too-long" "result"
        "forces lack 5 % of the work, or what `solver.increment_error` allows"
        "Plastic flow or friction turns too far within increments: forces are too low.";
    /// Localised necking.
    LocalisedNecking "localised-necking" "result"
        "process force past its maximum while a band thins and its neighbours unload"
        "The sheet necks: deformation localises in a band, and its width and strains are those of the mesh.";
    /// Thinning of one row of nodes, caused by the mesh.
    LocalisedThinning "localised-thinning" "result"
        "thickness of one row of nodes 5 % below both of its neighbours"
        "One row of nodes thins while its neighbours do not: the elements cause it, not the process.";
    /// Thickness below half of the initial thickness.
    ThicknessBelowHalf "thickness-below-half" "result"
        "50 % of the initial thickness"
        "The sheet has less than half its thickness somewhere: sheet metals fracture before.";
    /// A force-driven holder pushed back by the sheet.
    HolderLifted "holder-lifted" "result"
        "travel against its direction above one thickness"
        "The sheet pushes a force-driven holder back: its force does not hold the sheet down.";
    /// The sheet has left a force-driven holder.
    HolderLost "holder-lost" "result"
        "less than 1 % of the blank between a holder without `stop_mm` and the tool opposite, after 1 % or more at the start"
        "The blank is drawn out from under a force-driven holder, whose whole force then acts on the rim alone.";
    /// Strains beyond the forming limit curve.
    FormingLimitExceeded "forming-limit-exceeded" "result"
        "a failure ratio above 1 in the last equilibrium with tools"
        "The sheet cracks: strains are beyond the forming limit of the material card.";
    /// Margin to the forming limit below the limit of quality.
    FormingLimitMargin "forming-limit-margin" "result"
        "`quality.flc_margin` of the scene"
        "The margin to the forming limit is smaller than asked.";
    /// Thinning above the limit of quality.
    ThinningExceeded "thinning-exceeded" "result"
        "`quality.max_thinning` of the scene"
        "The sheet thins more than allowed.";
    /// Thickening above the limit of quality.
    ThickeningExceeded "thickening-exceeded" "result"
        "`quality.max_thickening` of the scene"
        "The sheet thickens more than allowed.";
    /// Thickness below the limit of quality.
    ThicknessTooSmall "thickness-too-small" "result"
        "`quality.min_thickness_mm` of the scene"
        "The sheet is thinner than asked.";
    /// Springback above the limit of quality.
    SpringbackExceeded "springback-exceeded" "result"
        "`quality.max_springback_mm` of the scene"
        "Springback displaces the sheet more than allowed.";
    /// Faces of the CAD file missing from the tool.
    FacesLost "faces-lost" "audit"
        "any face of the file that could not be read or was skipped"
        "Faces of the CAD file are missing from the model, and nothing was compared there.";
    /// Patches with reversed normals.
    FoldedPatches "folded-patches" "audit"
        "a normal more than 90 degrees off the CAD's"
        "Patches fold: contact on them finds no normal that can be relied on.";
    /// Points of patches without a closest point on the CAD.
    PointsLost "points-lost" "audit"
        "any point of a patch that is not finite or has no closest point"
        "Points of the tool could not be compared with the CAD.";
    /// Self-intersections of an offset were not searched for everywhere.
    OffsetUnchecked "offset-unchecked" "convert"
        "1 000 000 searches for closest points, and 10 000 for each face"
        "The search for self-intersections of an offset ended at its work limit: the tool may pass through itself.";
    /// An offset is not at its distance from the CAD.
    OffsetInexact "offset-inexact" "convert"
        "twice the accuracy of fitted faces, the gap at edges or the joining tolerance, whichever is largest"
        "Points of an offset are not at its distance from the CAD: the offset intersects itself, or a face of it is wrong.";
    /// Shape error above the tolerance.
    ToleranceExceeded "tolerance-exceeded" "audit, convert"
        "`tolerance_mm` of the audit"
        "The tool is farther from its CAD than asked.";
    /// Distance between free borders of tool and CAD above the tolerance.
    BordersExceeded "borders-exceeded" "audit, convert"
        "`tolerance_mm` of the audit"
        "The tool does not end where the CAD ends: it is cut short, goes beyond a trimmed border, or closes an opening.";
    /// Gaps above the tolerance between faces that were divided independently.
    GapsExceeded "gaps-exceeded" "audit"
        "`tolerance_mm` of the audit"
        "Patches of neighbouring faces are farther apart than asked.";
    /// Faces of the CAD that end beside each other without being joined.
    OpenJoints "open-joints" "audit, convert"
        "the tolerance of the audit or the conversion; in an audit without one, the shape error of the tool"
        "Faces of the CAD end beside each other and are not joined: the tool has a gap there, which its shape error does not show.";
    /// Normal error above its tolerance.
    NormalsExceeded "normals-exceeded" "audit"
        "`normal_tolerance_deg` of the audit"
        "The normals of the tool are farther off those of its CAD than asked.";
}

impl fmt::Display for DoubtCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// A reason why a result must not be trusted as it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Doubt {
    /// Stable code: `docs/reference/doubts.md` lists them with their limits.
    pub code: DoubtCode,
    /// Where: tool, stage, increment or position [mm], as far as they apply.
    #[serde(rename = "where")]
    pub place: String,
    /// The value of the quantity, in the unit named in `text`; none for a doubt without a number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// The limit that `value` exceeds, in the same unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit: Option<f64>,
    /// What happened, where, how bad, and what to change.
    pub text: String,
}

impl Doubt {
    /// A doubt without a number.
    #[must_use]
    pub fn new(code: DoubtCode, place: String, text: String) -> Self {
        Self { code, place, value: None, limit: None, text }
    }

    /// A doubt about `value`, which exceeds `limit`. Infinite numbers are omitted.
    #[must_use]
    pub fn of(code: DoubtCode, place: String, [value, limit]: [f64; 2], text: String) -> Self {
        // JSON has no infinite numbers.
        let finite = |x: f64| x.is_finite().then_some(x);
        Self { code, place, value: finite(value), limit: finite(limit), text }
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.code, self.text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_has_a_name_of_its_own_a_limit_and_a_meaning() {
        for (k, code) in DoubtCode::ALL.iter().enumerate() {
            let text = serde_json::to_string(code).unwrap();
            assert_eq!(text, format!("\"{code}\""));
            assert!(DoubtCode::ALL[..k].iter().all(|other| other.as_str() != code.as_str()));
            assert!(!code.limit().is_empty() && code.meaning().ends_with('.'), "{code}");
        }
    }

    #[test]
    fn a_doubt_without_a_finite_number_is_valid_json() {
        let doubt =
            Doubt::of(DoubtCode::EnergyBalance, String::new(), [f64::INFINITY, 0.01], "x".into());
        let text = serde_json::to_string(&doubt).unwrap();
        assert_eq!(serde_json::from_str::<Doubt>(&text).unwrap(), doubt);
        assert!(!text.contains("value") && text.contains("\"where\":\"\""), "{text}");
    }
}
