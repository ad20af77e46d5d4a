//! Exponential, sine, cosine and sums in lanes: those of [`crate::elementary`], operation for operation.

use stickslip_lanes::Lane;

use crate::elementary::{ARCTANGENT, CIRCLE, LN_2, LOG, PI, POWERS, ROUND, TABLE_STEPS};

const fn circle(second: bool) -> [f64; 2 * TABLE_STEPS] {
    let mut table = [0.0; 2 * TABLE_STEPS];
    let mut j = 0;
    while j < 2 * TABLE_STEPS {
        table[j] = if second { CIRCLE[j].1 } else { CIRCLE[j].0 };
        j += 1;
    }
    table
}

static SINES: [f64; 2 * TABLE_STEPS] = circle(false);
static COSINES: [f64; 2 * TABLE_STEPS] = circle(true);
static POWERS_OF_TWO: [f64; TABLE_STEPS] = POWERS;

/// x as steps and a rest; the lowest bits of the first are those of their number.
#[inline(always)]
fn reduce<L: Lane>(x: L, per_unit: f64, step: &[f64; 3]) -> (L, L) {
    let shifted = x * L::splat(per_unit) + L::splat(ROUND);
    let k = shifted - L::splat(ROUND);
    let rest = ((x - k * L::splat(step[0])) - k * L::splat(step[1])) - k * L::splat(step[2]);
    (shifted, rest)
}

/// eˣ for |x| < 700.
#[inline(always)]
pub(super) fn exp<L: Lane>(x: L) -> L {
    let c = L::splat;
    let (k, r) = reduce(x, TABLE_STEPS as f64 / LN_2.0, &LOG);
    let scale = k.pick(&POWERS_OF_TWO).stretch::<{ TABLE_STEPS.ilog2() }>(k);
    let square = r * r;
    let tail = (c(0.5) + r * c(1.0 / 6.0)) + square * (c(1.0 / 24.0) + r * c(1.0 / 120.0));
    scale + scale * (r + square * tail)
}

/// sin x and cos x for |x| < 40,000.
#[inline(always)]
pub(super) fn sin_cos<L: Lane>(x: L) -> (L, L) {
    let n = L::splat;
    let (k, r) = reduce(x, TABLE_STEPS as f64 / PI.0, &ARCTANGENT);
    let (sine, cosine) = (k.pick(&SINES), k.pick(&COSINES));
    let square = r * r;
    let s = r + r * square * (n(-1.0 / 6.0) + square * (n(1.0 / 120.0) - square * n(1.0 / 5040.0)));
    let c = square * (n(-0.5) + square * (n(1.0 / 24.0) - square * n(1.0 / 720.0)));
    (sine + (sine * c + cosine * s), cosine + (cosine * c - sine * s))
}

/// a + b without error.
#[inline(always)]
fn sum<L: Lane>(a: L, b: L) -> (L, L) {
    let high = a + b;
    let shift = high - a;
    (high, (a - (high - shift)) + (b - shift))
}

/// The sum of two unevaluated sums, rounded in its low part alone.
#[inline(always)]
pub(super) fn add<L: Lane>(a: (L, L), b: (L, L)) -> (L, L) {
    let (high, low) = sum(a.0, b.0);
    sum(high, low + (a.1 + b.1))
}

/// cos and sin of an angle with a small one added.
#[inline(always)]
pub(super) fn reversed<L: Lane>((cos, sin): (L, L), by: L) -> (L, L) {
    let n = L::splat;
    let q = by * by;
    let c = q * (n(-0.5) + q * (n(1.0 / 24.0) + q * (n(-1.0 / 720.0) + q * n(1.0 / 40_320.0))));
    let s = by
        + by * q * (n(-1.0 / 6.0) + q * (n(1.0 / 120.0) + q * (n(-1.0 / 5040.0) + q * n(1.0 / 362_880.0))));
    (cos + (cos * c - sin * s), sin + (sin * c + cos * s))
}
