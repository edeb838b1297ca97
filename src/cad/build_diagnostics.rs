//! Diagnostics of face construction.

use super::creases::Crease;
use super::loops::LoopFault;
use super::offset::Fineness;
use super::raw::RawFace;
use super::{Diagnostic, Severity};

/// Warning `face-skipped`: the face is omitted from the model.
pub(super) fn skipped(face: &RawFace, text: String) -> Diagnostic {
    let place = face.source.clone();
    Diagnostic { severity: Severity::Warning, code: "face-skipped", place, text }
}

/// Note `face-creased` with the crease lines of a split face; `None` without creases.
pub(super) fn creased(raw: &RawFace, found: &[Crease], parts: usize) -> Option<Diagnostic> {
    let line = |c: &Crease| {
        format!("{} = {} ({:.1} degrees)", ["u", "v"][c.axis], c.at, c.angle.to_degrees())
    };
    let lines: Vec<String> = found.iter().map(line).collect();
    let text = format!(
        "its surface has creases along {}; split there into {parts} faces",
        lines.join(", ")
    );
    let place = raw.source.clone();
    let note = Diagnostic { severity: Severity::Note, code: "face-creased", place, text };
    (!found.is_empty()).then_some(note)
}

/// Warning `offset-coarse`: the approximation of the offset surface exceeds `tolerance` [mm].
pub(super) fn coarse(raw: &RawFace, fineness: &Fineness, tolerance: f64) -> Diagnostic {
    let text = format!(
        "its offset surface is too strongly curved (or self-intersects) for an approximation within {tolerance:.1e} mm by \
         the {} patches available for a file of this size",
        fineness.max_patches
    );
    let place = raw.source.clone();
    Diagnostic { severity: Severity::Warning, code: "offset-coarse", place, text }
}

/// Adds a warning for every defect of a face's loops.
pub(super) fn report(raw: &RawFace, faults: &[LoopFault], diagnostics: &mut Vec<Diagnostic>) {
    for fault in faults {
        let (code, text) = match fault {
            LoopFault::Gap(gap) => (
                "loop-open",
                format!(
                    "gap of {gap:.3e} mm between edges of a loop; closed by a straight segment"
                ),
            ),
            LoopFault::Contradiction { off, parameter_kept } => {
                let used = if *parameter_kept {
                    "the parameter curve is used, as preferred by the file (PREF 1)"
                } else {
                    "the space curve is used"
                };
                let text = format!(
                    "the space curve and the parameter curve of an edge differ by {off:.3e} mm; {used}"
                );
                ("curves-contradict", text)
            }
            LoopFault::NoCurve => {
                ("edge-without-curve", "an edge without a curve was omitted".into())
            }
        };
        let place = raw.source.clone();
        diagnostics.push(Diagnostic { severity: Severity::Warning, code, place, text });
    }
}
