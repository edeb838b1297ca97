//! Values of several material points, one in each SIMD lane.
//!
//! A quantity at eight points is stored as [`Eight`]; [`Lane`] holds as many of them as fit in a SIMD vector. All
//! lanes execute the same operations in the same order, so the results of a point do not depend on its neighbours.
//!
//! Code on lanes uses plain loops over arrays instead of closures. A closure is compiled for the widest vectors only
//! if it is inlined, and the compiler does not inline long ones.

use std::ops::{Add, Div, Mul, Neg, Sub};

use pulp::Simd;

/// Points processed together.
pub(crate) const POINTS: usize = 8;

/// One value at eight points.
pub(crate) type Eight = [f64; POINTS];

/// One value at as many points as fit in a SIMD vector.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lane<S: Simd> {
    simd: S,
    value: S::f64s,
}

impl<S: Simd> Lane<S> {
    /// First indices of the SIMD groups of all points.
    #[inline(always)]
    pub(crate) fn groups() -> std::iter::StepBy<std::ops::Range<usize>> {
        Self::groups_of(POINTS)
    }

    /// First indices of the SIMD groups of the first `count` points.
    #[inline(always)]
    pub(crate) fn groups_of(count: usize) -> std::iter::StepBy<std::ops::Range<usize>> {
        const { assert!(POINTS.is_multiple_of(S::F64_LANES)) };
        (0..count.min(POINTS)).step_by(S::F64_LANES)
    }

    /// The same value in every lane.
    #[inline(always)]
    pub(crate) fn splat(simd: S, value: f64) -> Self {
        Self { simd, value: simd.splat_f64s(value) }
    }

    /// Loads the points from `first`.
    #[inline(always)]
    pub(crate) fn load(simd: S, from: &[f64], first: usize) -> Self {
        Self { simd, value: S::as_simd_f64s(&from[first..first + S::F64_LANES]).0[0] }
    }

    /// Loads several values at the points from `first`.
    #[inline(always)]
    pub(crate) fn load_all<const N: usize, const L: usize>(
        simd: S,
        from: &[[f64; L]; N],
        first: usize,
    ) -> [Self; N] {
        let mut out = [Self::splat(simd, 0.0); N];
        for (out, from) in out.iter_mut().zip(from) {
            *out = Self::load(simd, from, first);
        }
        out
    }

    #[inline(always)]
    pub(crate) fn store(self, to: &mut [f64], first: usize) {
        S::as_mut_simd_f64s(&mut to[first..first + S::F64_LANES]).0[0] = self.value;
    }

    /// `self * by + plus`.
    #[inline(always)]
    pub(crate) fn mul_add(self, by: Self, plus: Self) -> Self {
        Self { value: self.simd.mul_add_e_f64s(self.value, by.value, plus.value), ..self }
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        Self { value: self.simd.sqrt_f64s(self.value), ..self }
    }

    #[inline(always)]
    pub(crate) fn abs(self) -> Self {
        self.max(-self)
    }

    /// Smaller value in each lane.
    #[inline(always)]
    pub(crate) fn min(self, other: Self) -> Self {
        Self { value: self.simd.min_f64s(self.value, other.value), ..self }
    }

    /// Larger value in each lane.
    #[inline(always)]
    pub(crate) fn max(self, other: Self) -> Self {
        Self { value: self.simd.max_f64s(self.value, other.value), ..self }
    }

    /// In each lane `then` if `self < limit`, else `otherwise`.
    #[inline(always)]
    pub(crate) fn if_less(self, limit: Self, then: Self, otherwise: Self) -> Self {
        let mask = self.simd.less_than_f64s(self.value, limit.value);
        Self { value: self.simd.select_f64s(mask, then.value, otherwise.value), ..self }
    }

    /// Scalar product in each lane.
    #[inline(always)]
    pub(crate) fn dot<const N: usize>(a: &[Self; N], b: &[Self; N]) -> Self {
        const { assert!(N > 0) };
        let mut sum = a[0] * b[0];
        for (a, b) in a[1..].iter().zip(&b[1..]) {
            sum = a.mul_add(*b, sum);
        }
        sum
    }

    /// Multiplies all values by `by`.
    #[inline(always)]
    pub(crate) fn scaled<const N: usize>(mut all: [Self; N], by: Self) -> [Self; N] {
        for one in &mut all {
            *one = *one * by;
        }
        all
    }

    /// Sum over the lanes.
    #[inline(always)]
    pub(crate) fn sum(self) -> f64 {
        self.simd.reduce_sum_f64s(self.value)
    }

    /// Largest lane.
    #[inline(always)]
    pub(crate) fn largest(self) -> f64 {
        self.simd.reduce_max_f64s(self.value)
    }
}

impl<S: Simd> Add for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { value: self.simd.add_f64s(self.value, other.value), ..self }
    }
}

impl<S: Simd> Sub for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { value: self.simd.sub_f64s(self.value, other.value), ..self }
    }
}

impl<S: Simd> Mul for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self { value: self.simd.mul_f64s(self.value, other.value), ..self }
    }
}

impl<S: Simd> Mul<f64> for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, by: f64) -> Self {
        self * Self::splat(self.simd, by)
    }
}

impl<S: Simd> Div for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self { value: self.simd.div_f64s(self.value, other.value), ..self }
    }
}

impl<S: Simd> Neg for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::splat(self.simd, -0.0) - self
    }
}
