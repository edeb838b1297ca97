//! SIMD operations of the search on four numbers or eight boxes, with AVX2 where available, otherwise scalar: the same
//! operations in the same order, so that both give identical bits.

use super::node::{Node, WIDE};

/// Operations on four doubles or eight boxes.
pub(super) trait Wide: Copy {
    /// Four doubles.
    type Four: Copy;
    /// Eight singles.
    type Eight: Copy;

    fn four(self, x: [f64; 4]) -> Self::Four;
    fn add(self, a: Self::Four, b: Self::Four) -> Self::Four;
    fn sub(self, a: Self::Four, b: Self::Four) -> Self::Four;
    fn mul(self, a: Self::Four, b: Self::Four) -> Self::Four;
    /// Sums of the elements of each row: `(0 + 1) + (2 + 3)`.
    fn sums(self, rows: [Self::Four; 4]) -> [f64; 4];
    /// The same for two rows.
    fn two_sums(self, a: Self::Four, b: Self::Four) -> [f64; 2];

    /// Squared distances from `p` to the children of a node; infinite for missing ones.
    fn distances(self, node: &Node, p: [f32; 3]) -> Self::Eight;
    /// One bit for each element not above the limit.
    fn not_above(self, x: Self::Eight, limit: f32) -> u32;
    /// Lane of the minimum, ignoring the last three bits of the mantissa.
    fn min_lane(self, x: Self::Eight) -> usize;
    fn eight(self, x: Self::Eight) -> [f32; WIDE];

    #[inline(always)]
    fn splat(self, x: f64) -> Self::Four {
        self.four([x; 4])
    }
}

/// Scalar implementation.
#[derive(Clone, Copy)]
pub(super) struct Plain;

/// Applies `f` to each pair.
#[inline(always)]
fn each<const N: usize, T: Copy>(a: [T; N], b: [T; N], f: impl Fn(T, T) -> T) -> [T; N] {
    std::array::from_fn(|k| f(a[k], b[k]))
}

#[inline(always)]
fn sum(x: [f64; 4]) -> f64 {
    (x[0] + x[1]) + (x[2] + x[3])
}

impl Wide for Plain {
    type Four = [f64; 4];
    type Eight = [f32; WIDE];

    #[inline(always)]
    fn four(self, x: [f64; 4]) -> [f64; 4] {
        x
    }

    #[inline(always)]
    fn add(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        each(a, b, |a, b| a + b)
    }

    #[inline(always)]
    fn sub(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        each(a, b, |a, b| a - b)
    }

    #[inline(always)]
    fn mul(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        each(a, b, |a, b| a * b)
    }

    #[inline(always)]
    fn sums(self, rows: [[f64; 4]; 4]) -> [f64; 4] {
        rows.map(sum)
    }

    #[inline(always)]
    fn two_sums(self, a: [f64; 4], b: [f64; 4]) -> [f64; 2] {
        [sum(a), sum(b)]
    }

    #[inline(always)]
    fn distances(self, node: &Node, p: [f32; 3]) -> [f32; WIDE] {
        let larger = |a: f32, b: f32| if a > b { a } else { b };
        let mut sum = [0.0; WIDE];
        for ((low, high), p) in node.low.iter().zip(&node.high).zip(p) {
            for ((low, high), sum) in low.iter().zip(high).zip(&mut sum) {
                let d = larger(larger(low - p, p - high), 0.0);
                *sum += d * d;
            }
        }
        sum
    }

    #[inline(always)]
    fn not_above(self, x: [f32; WIDE], limit: f32) -> u32 {
        x.iter().enumerate().map(|(lane, x)| u32::from(*x <= limit) << lane).sum()
    }

    #[inline(always)]
    fn min_lane(self, x: [f32; WIDE]) -> usize {
        let key = |lane: usize| x[lane].to_bits() & !7 | lane as u32;
        (0..WIDE).map(key).fold(u32::MAX, u32::min) as usize & 7
    }

    #[inline(always)]
    fn eight(self, x: [f32; WIDE]) -> [f32; WIDE] {
        x
    }
}

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use std::arch::x86_64::{__m256, __m256d, __m256i, _CMP_LE_OQ};

    use pulp::bytemuck::cast;
    use pulp::x86::V3;

    use super::{Node, WIDE, Wide};

    impl Wide for V3 {
        type Four = __m256d;
        type Eight = __m256;

        #[inline(always)]
        fn four(self, x: [f64; 4]) -> __m256d {
            cast(x)
        }

        #[inline(always)]
        fn add(self, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_add_pd(a, b)
        }

        #[inline(always)]
        fn sub(self, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_sub_pd(a, b)
        }

        #[inline(always)]
        fn mul(self, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_mul_pd(a, b)
        }

        #[inline(always)]
        fn sums(self, [a, b, c, d]: [__m256d; 4]) -> [f64; 4] {
            let (ab, cd) = (self.avx._mm256_hadd_pd(a, b), self.avx._mm256_hadd_pd(c, d));
            let low = self.avx._mm256_permute2f128_pd::<0x20>(ab, cd);
            let high = self.avx._mm256_permute2f128_pd::<0x31>(ab, cd);
            cast(self.avx._mm256_add_pd(low, high))
        }

        #[inline(always)]
        fn two_sums(self, a: __m256d, b: __m256d) -> [f64; 2] {
            let [low, high]: [[f64; 2]; 2] = cast(self.avx._mm256_hadd_pd(a, b));
            [low[0] + high[0], low[1] + high[1]]
        }

        #[inline(always)]
        fn distances(self, node: &Node, p: [f32; 3]) -> __m256 {
            let avx = self.avx;
            let zero = avx._mm256_setzero_ps();
            let mut sum = zero;
            for ((low, high), p) in node.low.iter().zip(&node.high).zip(p) {
                let at = avx._mm256_set1_ps(p);
                let below = avx._mm256_sub_ps(cast(*low), at);
                let above = avx._mm256_sub_ps(at, cast(*high));
                let d = avx._mm256_max_ps(avx._mm256_max_ps(below, above), zero);
                sum = avx._mm256_add_ps(sum, avx._mm256_mul_ps(d, d));
            }
            sum
        }

        #[inline(always)]
        fn not_above(self, x: __m256, limit: f32) -> u32 {
            let limit = self.avx._mm256_set1_ps(limit);
            self.avx._mm256_movemask_ps(self.avx._mm256_cmp_ps::<_CMP_LE_OQ>(x, limit)) as u32
        }

        #[inline(always)]
        fn min_lane(self, x: __m256) -> usize {
            const LANES: [u32; WIDE] = [0, 1, 2, 3, 4, 5, 6, 7];
            let avx2 = self.avx2;
            let bits = avx2._mm256_and_si256(cast(x), cast([!7_u32; WIDE]));
            let key = avx2._mm256_or_si256(bits, cast(LANES));
            let key = avx2._mm256_min_epu32(key, avx2._mm256_permute2x128_si256::<1>(key, key));
            let key = avx2._mm256_min_epu32(key, avx2._mm256_shuffle_epi32::<0b0100_1110>(key));
            let key: __m256i =
                avx2._mm256_min_epu32(key, avx2._mm256_shuffle_epi32::<0b1011_0001>(key));
            cast::<__m256i, [u32; WIDE]>(key)[0] as usize & 7
        }

        #[inline(always)]
        fn eight(self, x: __m256) -> [f32; WIDE] {
            cast(x)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn random(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        ((*seed >> 33) as f64) / (1u64 << 31) as f64 - 0.5
    }

    fn node(seed: &mut u64) -> Node {
        let mut node = Node::EMPTY;
        // The last lane remains empty.
        for (low, high) in node.low.iter_mut().zip(&mut node.high) {
            for (low, high) in low.iter_mut().zip(high).take(WIDE - 1) {
                *low = random(seed) as f32;
                *high = *low + (random(seed) as f32).abs();
            }
        }
        node
    }

    /// Results of all operations, as bits.
    fn all(wide: impl Wide, rows: [[f64; 4]; 4], node: &Node, p: [f32; 3]) -> Vec<u64> {
        let four = rows.map(|x| wide.four(x));
        let [a, b, c, d] = four;
        let mixed = wide.sub(wide.mul(a, b), wide.add(c, wide.mul(d, wide.splat(rows[0][0]))));
        let sums = wide.sums([mixed, b, c, d]).into_iter().chain(wide.two_sums(a, mixed));
        let distances = wide.distances(node, p);
        let counts = [wide.not_above(distances, 0.1) as usize, wide.min_lane(distances)];
        let singles = wide.eight(distances).map(|x| u64::from(x.to_bits()));
        sums.map(f64::to_bits).chain(singles).chain(counts.map(|n| n as u64)).collect()
    }

    #[test]
    fn distances_are_those_to_the_boxes_and_bits_do_not_depend_on_the_machine() {
        let mut seed = 9;
        for _ in 0..1000 {
            let node = node(&mut seed);
            let p = [0; 3].map(|_| 2.0 * random(&mut seed) as f32);
            let rows = [[0; 4]; 4].map(|row| row.map(|_| random(&mut seed)));
            let distances = Plain.distances(&node, p);
            for (lane, found) in distances.iter().enumerate().take(WIDE - 1) {
                let off = |k: usize| p[k] - p[k].clamp(node.low[k][lane], node.high[k][lane]);
                let exact = (0..3).map(|k| off(k) * off(k)).sum::<f32>();
                assert!((found - exact).abs() <= 1e-6 * exact, "{found} {exact}");
            }
            assert_eq!(distances[WIDE - 1], f32::INFINITY);
            let minimum = distances.iter().copied().fold(f32::INFINITY, f32::min);
            assert!(distances[Plain.min_lane(distances)] <= minimum * (1.0 + 1e-6));
            let near = (0..WIDE).filter(|&k| distances[k] <= 0.1).count();
            assert_eq!(Plain.not_above(distances, 0.1).count_ones() as usize, near);
            #[cfg(target_arch = "x86_64")]
            if let Some(v3) = pulp::x86::V3::try_new() {
                assert_eq!(all(v3, rows, &node, p), all(Plain, rows, &node, p));
            }
        }
    }
}
