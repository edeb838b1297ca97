//! Minima of functions of one variable by golden sections.

/// Place and least value of `f` between `a` and `b` by golden sections, of a function with one minimum there.
#[must_use]
pub fn least(f: impl Fn(f64) -> f64, [mut a, mut b]: [f64; 2], steps: usize) -> (f64, f64) {
    const SHARE: f64 = 0.618_033_988_749_894_9;
    let (mut c, mut d) = (b - SHARE * (b - a), a + SHARE * (b - a));
    let (mut fc, mut fd) = (f(c), f(d));
    let ends = [(a, f(a)), (b, f(b))];
    let mut best = if ends[0].1 <= ends[1].1 { ends[0] } else { ends[1] };
    for _ in 0..steps {
        if fc < fd {
            (b, d, fd) = (d, c, fc);
            c = b - SHARE * (b - a);
            fc = f(c);
        } else {
            (a, c, fc) = (c, d, fd);
            d = a + SHARE * (b - a);
            fd = f(d);
        }
        let inner = if fc < fd { (c, fc) } else { (d, fd) };
        if inner.1 < best.1 {
            best = inner;
        }
    }
    best
}
