//! Taylor coefficients of a motion and of friction along it.
//!
//! A product, a reciprocal or an exponential of series has a recursion for its k-th coefficient from the lower ones
//! (automatic differentiation: Moore, Interval Analysis, 1966; Jorba & Zou, Experimental Mathematics 14 (2005) 99).

use crate::scalar::Scalar;

/// The highest power of a step that is kept, which smooth laws want: with more of them steps grow no longer by what they cost.
pub const ORDER: usize = 28;

/// The highest power where friction is linear: there events end most steps.
pub(crate) const LINEAR_ORDER: usize = 22;

/// The coefficients of 1, h, h², …
pub type Series<N = f64> = [N; ORDER + 1];

/// 1/k
pub(crate) const INVERSE: Series = {
    let mut table = [0.0; ORDER + 1];
    let mut k = 1;
    while k <= ORDER {
        table[k] = 1.0 / k as f64;
        k += 1;
    }
    table
};

/// k
pub(crate) const POWERS: Series = {
    let mut table = [0.0; ORDER + 1];
    let mut k = 0;
    while k <= ORDER {
        table[k] = k as f64;
        k += 1;
    }
    table
};

/// (k + 1) (k + 2), as long as there is such a power.
pub(crate) const CURVATURES: Series = {
    let mut table = [0.0; ORDER + 1];
    let mut k = 0;
    while k + 2 <= ORDER {
        table[k] = POWERS[k + 1] * POWERS[k + 2];
        k += 1;
    }
    table
};

/// Nothing.
pub const ZERO: Series = [0.0; ORDER + 1];

/// The same of any number type.
pub fn nothing<N: Scalar>() -> Series<N> {
    [N::default(); ORDER + 1]
}

/// What a smooth law carries from one coefficient to the next.
#[derive(Clone, Debug)]
pub struct Grown<N = f64> {
    /// A first function of the slip speed.
    pub first: Series<N>,
    /// A second one.
    pub second: Series<N>,
    /// A third one.
    pub third: Series<N>,
    /// The stages of a composition.
    pub inner: Vec<Series<N>>,
}

impl<N: Scalar> Default for Grown<N> {
    fn default() -> Self {
        Self {
            first: nothing(),
            second: nothing(),
            third: nothing(),
            inner: Vec::new(),
        }
    }
}

/// Σ a_j b_{k−j} for j from `from` to k − 1.
#[expect(
    clippy::inline_always,
    reason = "as a call it takes a tenth of a smooth motion, measured"
)]
#[inline(always)]
fn convolve_known<N: Scalar>(a: &Series<N>, b: &Series<N>, from: usize, k: usize) -> N {
    if from == k {
        return N::default();
    }
    // The first, of which one factor has just become known, comes last: the rest need not wait for it. It has four sums, so
    // that one addition need not wait for the other. The order is fixed, so are the bits.
    let mut sums = [N::default(); 4];
    let mut forward = a[from + 1..k].chunks_exact(4);
    let mut backward = b[1..k - from].rchunks_exact(4);
    for (a, b) in forward.by_ref().zip(backward.by_ref()) {
        sums[0] += a[0] * b[3];
        sums[1] += a[1] * b[2];
        sums[2] += a[2] * b[1];
        sums[3] += a[3] * b[0];
    }
    // Three branches cost less than a loop of three rounds.
    match (forward.remainder(), backward.remainder()) {
        (&[a0, a1, a2], &[b2, b1, b0]) => {
            sums[0] += a0 * b0;
            sums[1] += a1 * b1;
            sums[2] += a2 * b2;
        }
        (&[a0, a1], &[b1, b0]) => {
            sums[0] += a0 * b0;
            sums[1] += a1 * b1;
        }
        (&[a0], &[b0]) => sums[0] += a0 * b0,
        _ => {}
    }
    ((sums[0] + sums[1]) + (sums[2] + sums[3])) + a[from] * b[k - from]
}

/// The same to k.
#[inline]
fn convolve<N: Scalar>(a: &Series<N>, b: &Series<N>, from: usize, k: usize) -> N {
    convolve_known(a, b, from, k) + a[k] * b[0]
}

/// Coefficient k of a · b.
#[inline]
pub fn product<N: Scalar>(a: &Series<N>, b: &Series<N>, k: usize) -> N {
    convolve(a, b, 0, k)
}

/// Coefficient k of r = 1/(1 + rate · u), from u up to k and r below k.
#[inline]
pub fn reciprocal<N: Scalar>(rate: N, u: &Series<N>, r: &Series<N>, k: usize) -> N {
    if k == 0 {
        return (rate * u[0] + 1.0).inverse();
    }
    // What is done with u_k, which all waits for, is one product and one sum.
    let lead = -rate * r[0];
    lead * convolve_known(u, r, 1, k) + lead * r[0] * u[k]
}

/// Coefficient k of e = exp(rate · u), from e below k and the `weighted` coefficients j · rate · u_j up to k, of which the
/// last is written here.
#[inline]
pub fn exponential<N: Scalar>(
    rate: N,
    u: &Series<N>,
    weighted: &mut Series<N>,
    e: &Series<N>,
    k: usize,
) -> N {
    if k == 0 {
        return (rate * u[0]).exp();
    }
    weighted[k] = rate * k as f64 * u[k];
    convolve_known(weighted, e, 1, k) * INVERSE[k] + rate * e[0] * u[k]
}

/// Coefficient k ≥ 1 of p(u), by the stages of Horner's rule around u_0: stage j is p_j + (u − u_0) · stage j + 1. They begin
/// with the coefficients of p in powers of u − u_0, the last of them is no more than that.
#[inline]
pub fn compose<N: Scalar>(u: &Series<N>, stages: &mut [Series<N>], k: usize) -> N {
    for j in (0..k.min(stages.len() - 1)).rev() {
        stages[j][k - j] = convolve(u, &stages[j + 1], 1, k - j);
    }
    stages[0][k]
}

/// The polynomial at `h`.
#[inline]
pub fn at(series: &Series, h: f64) -> f64 {
    series[0] + gain(series, h)
}

/// By how much the polynomial is more at `h` than at 0.
#[inline]
pub fn gain(series: &Series, h: f64) -> f64 {
    h * in_fours(h, |i| series[i + 1])
}

/// The polynomial and its derivative at `h`.
#[inline]
pub fn slope_at(series: &Series, h: f64) -> (f64, f64) {
    (at(series, h), in_fours(h, |i| POWERS[i + 1] * series[i + 1]))
}

/// The derivative as a series.
pub fn derivative(series: &Series) -> Series {
    let mut result = ZERO;
    for k in 0..ORDER {
        result[k] = POWERS[k + 1] * series[k + 1];
    }
    result
}

/// A bound of the second derivative for 0 ≤ h ≤ `reach`.
pub fn curvature_bound(series: &Series, reach: f64) -> f64 {
    in_fours(reach, |i| CURVATURES[i] * series[(i + 2).min(ORDER)].abs())
}

/// A bound of how far the polynomial goes from its start for 0 ≤ h ≤ `reach`.
#[inline]
pub(crate) fn swing_bound(series: &Series, reach: f64) -> f64 {
    reach * in_fours(reach, |i| series[i + 1].abs())
}

/// Σ `term`(i) hⁱ for i < `ORDER`: four sums side by side, as one by Horner's rule would wait for each of its terms.
#[inline]
fn in_fours(h: f64, term: impl Fn(usize) -> f64) -> f64 {
    const { assert!(ORDER.is_multiple_of(4)) }
    let step = (h * h) * (h * h);
    if !step.is_normal() {
        return (0..ORDER).rev().fold(0.0, |sum, i| sum * h + term(i));
    }
    let mut sums = [0.0; 4];
    for first in (0..ORDER).step_by(4).rev() {
        for (lane, sum) in sums.iter_mut().enumerate() {
            *sum = *sum * step + term(first + lane);
        }
    }
    (sums[0] + h * sums[1]) + (h * h) * (sums[2] + h * sums[3])
}

/// The positive root of margin + rate τ − curvature τ²/2, in the form that does not cancel; none is infinite.
pub fn free_time(margin: f64, rate: f64, curvature: f64) -> f64 {
    let square = rate * rate + 2.0 * curvature * margin;
    // Where the square of a rate is too large for a number the root is one still: at most this, and no less than the rate.
    let root = if rate * rate < f64::INFINITY {
        square.sqrt()
    } else if rate < 0.0 {
        (2.0 * curvature).sqrt() * margin.sqrt() - rate
    } else {
        rate
    };
    if rate < 0.0 {
        2.0 * margin / (root - rate)
    } else if curvature > 0.0 {
        (root + rate) / curvature
    } else {
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::{Grown, ORDER, ZERO, at, exponential, product, reciprocal};

    #[test]
    fn a_rate_whose_square_is_too_large_for_a_number_leaves_time_all_the_same() {
        assert!((super::free_time(0.5, -1e200, 0.0) * 1e200 - 0.5).abs() < 1e-15);
        assert_eq!(super::free_time(0.5, 1e200, 0.0), f64::INFINITY);
        assert!((super::free_time(0.5, 1e200, 1e10) / 1e190 - 2.0).abs() < 1e-15);
    }

    #[test]
    fn recursions_agree_with_the_functions() {
        let mut u = ZERO;
        (u[0], u[1], u[2]) = (0.4, 0.3, -0.2);
        let (mut grown, mut r, mut square) = (Grown::default(), ZERO, ZERO);
        for k in 0..=ORDER {
            grown.first[k] = exponential(-2.0, &u, &mut grown.second, &grown.first, k);
            r[k] = reciprocal(3.0, &u, &r, k);
            square[k] = product(&u, &u, k);
        }
        let h = 0.1;
        let speed = at(&u, h);
        assert!((at(&grown.first, h) - (-2.0 * speed).exp()).abs() < 1e-15);
        assert!((at(&r, h) - 1.0 / (1.0 + 3.0 * speed)).abs() < 1e-15);
        assert!((at(&square, h) - speed * speed).abs() < 1e-15);
    }
}
