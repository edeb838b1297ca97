//! Golden-section search for the minimum of a function of one variable.

/// Golden-section search on `[a, b]` in `steps` reductions of the bracket; returns argument and value of the minimum.
/// Assumes a unimodal `f`. The end points are also evaluated, so that a minimum at an end is exact.
#[must_use]
pub fn minimize(f: impl Fn(f64) -> f64, [mut a, mut b]: [f64; 2], steps: usize) -> (f64, f64) {
    const INVERSE_GOLDEN_RATIO: f64 = 0.618_033_988_749_894_9;
    let (mut c, mut d) = (b - INVERSE_GOLDEN_RATIO * (b - a), a + INVERSE_GOLDEN_RATIO * (b - a));
    let (mut fc, mut fd) = (f(c), f(d));
    let ends = [(a, f(a)), (b, f(b))];
    let mut best = if ends[0].1 <= ends[1].1 { ends[0] } else { ends[1] };
    for _ in 0..steps {
        if fc < fd {
            (b, d, fd) = (d, c, fc);
            c = b - INVERSE_GOLDEN_RATIO * (b - a);
            fc = f(c);
        } else {
            (a, c, fc) = (c, d, fd);
            d = a + INVERSE_GOLDEN_RATIO * (b - a);
            fd = f(d);
        }
        let inner = if fc < fd { (c, fc) } else { (d, fd) };
        if inner.1 < best.1 {
            best = inner;
        }
    }
    best
}
