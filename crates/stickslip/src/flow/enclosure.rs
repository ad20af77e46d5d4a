//! A smooth function enclosed between two samples of its value, slope and curvature.
//!
//! The quintic that meets both samples is off by f⁽⁶⁾(ξ)/720 · h³(d − h)³ (Hermite's remainder). In the Bernstein basis of
//! degree six that cubic product is d⁶/20 times the middle polynomial, and a combination of Bernstein polynomials lies within
//! the range of its coefficients. So seven numbers bound the function, and one that is known to start or to end on a bound
//! is seen to leave it.

/// Distance between samples, in units of the time in which the motion changes.
const ENCLOSURE_REACH: f64 = 2.2;

/// How far the next sample may be from one of a function of this size and with this bound of its sixth derivative. The sixth
/// root need not be exact.
#[inline]
pub(crate) fn reach(size: f64, sixth: f64) -> f64 {
    const SIXTH_OF_ONE: u64 = 1.0f64.to_bits() / 6 * 5;
    if sixth > 0.0 {
        ENCLOSURE_REACH * f64::from_bits((size / sixth).to_bits() / 6 + SIXTH_OF_ONE)
    } else {
        f64::INFINITY
    }
}

/// The larger of two numbers, or that which is one. [`f64::max`] says the same, but is a call in WebAssembly.
#[inline]
pub(crate) fn larger(one: f64, other: f64) -> f64 {
    if one > other || other.is_nan() { one } else { other }
}

/// Sixth and seventh power of |x|.
pub(crate) fn sixth_and_seventh(x: f64) -> [f64; 2] {
    let third = x.abs() * (x * x);
    [third * third, third * third * x.abs()]
}

/// Bounds of Σ (p cos Ωτ + q sin Ωτ), its sixth and its seventh derivative.
pub(crate) fn bounds<const H: usize>(p: &[f64; H], q: &[f64; H], frequency: &[f64; H]) -> [f64; 3] {
    let mut bound = [0.0; 3];
    for j in 0..H {
        let size = p[j].abs() + q[j].abs();
        let [sixth, seventh] = sixth_and_seventh(frequency[j]);
        bound[0] += size;
        bound[1] += size * sixth;
        bound[2] += size * seventh;
    }
    bound
}

/// The time between two samples and the powers of it that the coefficients need.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    d: f64,
    square: f64,
    slack: f64,
}

impl Span {
    #[inline]
    pub(crate) fn new(d: f64) -> Self {
        let square = d * d;
        Self {
            d,
            square,
            slack: square * square * square * (1.0 / 14_400.0),
        }
    }

    /// The least coefficient of a function with value, slope and curvature `left` and, at the end of the span, `right`, and
    /// |f⁽⁶⁾| ≤ `sixth` between. The function lies above it, but for ends that lie on it.
    #[inline]
    pub(crate) fn least(&self, left: [f64; 3], right: [f64; 3], sixth: f64) -> f64 {
        let least = |a: f64, b: f64| if a < b { a } else { b };
        let (rise, fall) = (self.d * (1.0 / 6.0) * left[1], self.d * (1.0 / 6.0) * right[1]);
        let (curvature, curl) = (self.square * left[2], self.square * right[2]);
        let second = left[0] + 2.0 * rise + curvature * (1.0 / 30.0);
        let fourth = right[0] - 2.0 * fall + curl * (1.0 / 30.0);
        let middle = 0.5 * (left[0] + right[0]) + 1.2 * (rise - fall) + 0.025 * (curvature + curl);
        least(
            least(least(left[0], left[0] + rise), least(right[0], right[0] - fall)),
            least(least(second, fourth), middle - self.slack * sixth),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::Span;

    /// sin over a window and its least value there by dense sampling: enclosed, and not by much.
    #[test]
    fn encloses_a_sine_closely() {
        for i in 0..700 {
            let (from, d) = (0.01 * f64::from(i), 0.1 + 0.003 * f64::from(i));
            let at = |t: f64| [t.sin(), t.cos(), -t.sin()];
            let low = Span::new(d).least(at(from), at(from + d), 1.0);
            let least = (0..=200)
                .map(|j| (from + d * f64::from(j) / 200.0).sin())
                .fold(f64::MAX, f64::min);
            assert!(low <= least + 1e-15 && least - low < 0.06 * d * d, "{from} {d}");
        }
    }

    /// 1 − cos leaves zero with no slope: from there on it is seen to be positive.
    #[test]
    fn a_start_on_the_bound_is_left() {
        let right = [1.0 - 2f64.cos(), 2f64.sin(), 2f64.cos()];
        assert_eq!(Span::new(2.0).least([0.0, 0.0, 1.0], right, 1.0), 0.0);
    }
}
