//! Diagnostics of building faces.

use super::creases::Crease;
use super::loops::LoopFault;
use super::offset::Fineness;
use super::raw::RawFace;
use super::{Diagnostic, Severity};

/// Warning `face-skipped`: the face is left out of the model.
pub(super) fn skipped(face: &RawFace, text: String) -> Diagnostic {
    let place = face.source.clone();
    Diagnostic { severity: Severity::Warning, code: "face-skipped", place, text }
}

/// Note `face-creased`: the lines at which the face is cut; `None` where there are none.
pub(super) fn creased(raw: &RawFace, found: &[Crease], parts: usize) -> Option<Diagnostic> {
    let line = |c: &Crease| {
        format!("{} = {} ({:.1} degrees)", ["u", "v"][c.axis], c.at, c.angle.to_degrees())
    };
    let lines: Vec<String> = found.iter().map(line).collect();
    let text =
        format!("its surface has creases along {}; cut there into {parts} faces", lines.join(", "));
    let place = raw.source.clone();
    let note = Diagnostic { severity: Severity::Note, code: "face-creased", place, text };
    (!found.is_empty()).then_some(note)
}

/// Warning `offset-coarse`: the offset surface is followed less closely than `tolerance` [mm].
pub(super) fn coarse(raw: &RawFace, fineness: &Fineness, tolerance: f64) -> Diagnostic {
    let text = format!(
        "its offset surface bends too much (or folds) to be followed within {tolerance:.1e} mm by the {} pieces that \
         a file of this size may take",
        fineness.most
    );
    let place = raw.source.clone();
    Diagnostic { severity: Severity::Warning, code: "offset-coarse", place, text }
}

/// Adds warnings of the faults of a face's loops.
pub(super) fn report(raw: &RawFace, faults: &[LoopFault], diagnostics: &mut Vec<Diagnostic>) {
    for fault in faults {
        let (code, text) = match fault {
            LoopFault::Gap(gap) => (
                "loop-open",
                format!("edges of a loop do not meet by {gap:.3e} mm; bridged straight"),
            ),
            LoopFault::Contradiction { off, parameter_kept } => {
                let used = if *parameter_kept {
                    "the parameter curve is used, which the file prefers (PREF 1)"
                } else {
                    "the curve in space is used"
                };
                let text = format!(
                    "the curve in space and the parameter curve of an edge are {off:.3e} mm apart; {used}"
                );
                ("curves-contradict", text)
            }
            LoopFault::NoCurve => {
                ("edge-without-curve", "an edge without a curve was left out".into())
            }
        };
        let place = raw.source.clone();
        diagnostics.push(Diagnostic { severity: Severity::Warning, code, place, text });
    }
}
