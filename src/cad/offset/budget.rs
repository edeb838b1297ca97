//! Limits on the patches of fitted offset surfaces.

use crate::raw::RawSurface;

/// Patches available to all offset surfaces of a file, in addition to one per [`BYTES_PER_PATCH`] bytes of the file.
pub(super) const PATCHES_BASE: usize = 8_192;
/// See [`PATCHES_BASE`]. A bicubic patch takes more than 500 bytes of a file, and thus may yield more than 100 patches.
pub(super) const BYTES_PER_PATCH: usize = 4;

/// Patches of the offset of a face of a model for each span, in addition to [`PATCHES_PER_FACE`]. Fillets of 5 mm need 4
/// a span at 1e-6 mm.
const PATCHES_PER_SPAN: usize = 32;
const PATCHES_PER_FACE: usize = 256;

/// Refinement limit of a fitted offset surface.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Fineness {
    /// Maximum number of patches of its spline.
    pub max_patches: usize,
    /// The limit was reached: the approximation exceeds the tolerance.
    pub coarse: bool,
}

/// Patch limits of the surfaces of a file of `bytes` bytes, in proportion to the spans of their bases. Zero once the
/// spans of this and the preceding surfaces exceed the total.
pub(crate) fn shares<'a>(
    surfaces: impl Iterator<Item = &'a RawSurface>,
    bytes: usize,
) -> Vec<Fineness> {
    let total = PATCHES_BASE + bytes / BYTES_PER_PATCH;
    let mut sum = 0;
    let mut needed: Vec<(usize, usize)> = surfaces.map(|s| spans_under(s, 0)).collect();
    for (spans, levels) in &mut needed {
        let all = spans.saturating_mul(*levels);
        *spans = if sum + all <= total { *spans } else { 0 };
        sum += if *spans > 0 { all } else { 0 };
    }
    let fraction = |(spans, _): (usize, usize)| spans * total / sum.max(1);
    needed.into_iter().map(|n| Fineness { max_patches: fraction(n), coarse: false }).collect()
}

/// Patch limits of the faces of a model with these numbers of spans.
pub(super) fn shares_of_spans(spans: impl Iterator<Item = usize>) -> Vec<usize> {
    spans.map(|n| PATCHES_PER_FACE + PATCHES_PER_SPAN * n).collect()
}

/// Spans of the spline below nested offsets, and the nesting depth; zero for other surfaces.
fn spans_under(surface: &RawSurface, levels: usize) -> (usize, usize) {
    match surface {
        RawSurface::Offset { base, .. } => spans_under(base, levels + 1),
        RawSurface::Nurbs(s) if levels > 0 => {
            let domain = s.domain();
            let spans = |k: usize| breaks_of(s.knots()[k], domain[k]).len() - 1;
            (spans(0) * spans(1), levels)
        }
        _ => (0, levels),
    }
}

/// Distinct knots within a domain.
pub(super) fn breaks_of(knots: &[f64], [a, b]: [f64; 2]) -> Vec<f64> {
    let mut out: Vec<f64> = knots.iter().copied().filter(|t| *t >= a && *t <= b).collect();
    out.dedup();
    out
}
