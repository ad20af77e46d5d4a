//! The certified first root of a guard along a Taylor expansion.

use super::changes_sign;
use crate::series::{ORDER, Series, ZERO, at, curvature_bound, derivative, free_time, slope_at, swing_bound};

/// The first of `step`, its half, its quarter … within which a force stays below a limit that falls with the force rate.
///
/// `limit` is asked at the worst force rate ahead, |rate| + curvature τ; no step shorter than `least` is looked for.
pub(crate) fn borne_step(
    mut step: f64,
    least: f64,
    [size, rate, curvature]: [f64; 3],
    limit: impl Fn(f64) -> f64,
) -> f64 {
    let margin = |step: f64| {
        limit(rate.abs() + curvature * step) - size - rate.abs() * step - 0.5 * curvature * step * step
    };
    while step > 0.0 && margin(step) <= 0.0 {
        step *= 0.5;
        if step < least {
            break;
        }
    }
    step
}

/// A guard that starts below zero by so many times its rounding has been passed: something else happened that changed it.
pub(crate) const PASSED_GUARD_FACTOR: f64 = 1e6;

/// A guard that hardly moves, and lies below zero by so many times its rounding, came there unseen. A step leads it on by no
/// more than once its rounding, so that it is seen before it is four times that beyond.
const LEFT_BEHIND_ROUNDINGS: f64 = 2.0;

/// As a part of the reach of a polynomial, how far before and after a root its certificate looks.
pub(crate) const CERTIFIED_BESIDE: f64 = 1e-9;
/// How much of what rounding is to a search it may be to an evaluation of the whole polynomial.
const POLYNOMIAL_ROUNDINGS: f64 = 8.0;

/// The first h in [0, reach] at which a guard is no longer positive.
///
/// A guard that starts within `rounding` of zero and rises is armed: its root at 0 is divided out. `at_reversal` says that its
/// slope is zero by what is known of the mode; then both are. The march advances by the largest step in which a bound of
/// the curvature excludes a root, so none is jumped over; it closes in on the first one from below, quadratically. A touch,
/// where the guard turns back within `rounding` of zero, is no root: it is told to `grazes`.
pub(crate) fn first_root(
    mut guard: Series,
    rounding: f64,
    at_reversal: bool,
    reach: f64,
    grazes: &mut Vec<f64>,
) -> Option<f64> {
    if at_reversal {
        guard[1] = 0.0;
    }
    let root = march(&guard, rounding, at_reversal, reach, grazes);
    // One at the start is where the guard begins, and no search found it.
    debug_assert!(
        root.is_none_or(|h| if h == 0.0 {
            guard[0] <= rounding
        } else {
            changes_sign(h, CERTIFIED_BESIDE * reach, |t| {
                [at(&guard, t), POLYNOMIAL_ROUNDINGS * rounding]
            })
        }),
        "{root:?} is no root of {guard:?} within {reach}"
    );
    root
}

fn march(guard: &Series, rounding: f64, at_reversal: bool, reach: f64, grazes: &mut Vec<f64>) -> Option<f64> {
    let (mut series, mut shifted) = (guard, ZERO);
    if series[0] < -PASSED_GUARD_FACTOR * rounding {
        return Some(0.0);
    }
    let (mut armed, mut left) = (0, false);
    if series[0] <= rounding {
        // A guard that stays within rounding of zero throughout says nothing: two bodies that move on together. One that came
        // below it so slowly that no step showed it has been passed.
        if series[0] >= -LEFT_BEHIND_ROUNDINGS * rounding && swing_bound(series, reach) <= rounding {
            return None;
        }
        // Where it is led by a higher power, as under a force at its crest, that one says where it goes.
        let least = if at_reversal { 2 } else { 1 };
        let order = (least..=ORDER).find(|&k| series[k] != 0.0).unwrap_or(least);
        if series[order] <= 0.0 {
            return Some(0.0);
        }
        armed = order;
        shifted[..=ORDER - order].copy_from_slice(&series[order..]);
        series = &shifted;
    }
    if series[0] > swing_bound(series, reach) {
        return None;
    }
    let curvature = curvature_bound(series, reach);
    if curvature == f64::INFINITY && reach < 1.0 {
        return march_in_own_time(guard, rounding, at_reversal, reach, grazes);
    }
    let tiny = f64::EPSILON * reach;
    let mut t = 0.0;
    // Quadratic convergence needs a few dozen; a guard that touches zero within rounding is given up there.
    for _ in 0..10_000 {
        let (value, slope) = slope_at(series, t);
        // Of the guard itself; one that was armed has to rise before it can touch.
        let rounding = (0..armed).fold(rounding, |rounding, _| rounding / t);
        left |= value > rounding;
        if left
            && value <= rounding
            && let Some(passed) = touch(series, t, (value, slope), rounding)
        {
            grazes.push(t);
            t += passed.max(tiny);
            if t > reach {
                return None;
            }
            continue;
        }
        if value <= 0.0 {
            return Some(t);
        }
        let mut free = free_time(value, slope, curvature);
        if free <= tiny.max(f64::EPSILON * t) {
            return Some((t + free).min(reach));
        }
        if 8.0 * free < reach - t {
            // A tighter bound, over as far as it may be used.
            let near = curvature_bound(series, t + 8.0 * free);
            free = free_time(value, slope, near).min(8.0 * free);
        }
        t += free;
        if t > reach {
            return None;
        }
    }
    debug_assert!(false, "a root not closed in on: {guard:?} within {reach}");
    Some(t)
}

/// The same in units of the reach: of motions that are fast in the units of the document the high powers are almost too large
/// for a number, and bounds of them are. Powers of two keep each bit.
#[cold]
fn march_in_own_time(
    guard: &Series,
    rounding: f64,
    at_reversal: bool,
    reach: f64,
    grazes: &mut Vec<f64>,
) -> Option<f64> {
    // The largest power of two that is no more than the reach.
    let unit = reach / significand(reach);
    let mut scaled = *guard;
    for k in 1..=ORDER {
        for term in &mut scaled[k..] {
            *term *= unit;
        }
    }
    let before = grazes.len();
    let root = march(&scaled, rounding, at_reversal, reach / unit, grazes);
    for graze in &mut grazes[before..] {
        *graze *= unit;
    }
    root.map(|h| h * unit)
}

/// In [1, 2).
fn significand(value: f64) -> f64 {
    const FRACTION: u64 = (1 << (f64::MANTISSA_DIGITS - 1)) - 1;
    f64::from_bits(value.to_bits() & FRACTION | 1.0_f64.to_bits())
}

/// The time after which a guard that meets zero at `t` is clear of it again, if it turns back before it is below `rounding`.
fn touch(series: &Series, t: f64, (value, slope): (f64, f64), rounding: f64) -> Option<f64> {
    let curvature = slope_at(&derivative(series), t).1;
    let deepest = value - 0.5 * slope * slope / curvature;
    (curvature > 0.0 && deepest > -rounding)
        .then(|| (2.0 * (2.0 * rounding - deepest) / curvature).sqrt() - slope / curvature)
}

#[cfg(test)]
mod tests {
    use super::first_root;
    use crate::series::{ORDER, Series, ZERO, curvature_bound};

    /// (h − a)(h − b) + gap.
    fn parabola(a: f64, b: f64, gap: f64) -> Series {
        let mut series = ZERO;
        (series[0], series[1], series[2]) = (a * b + gap, -(a + b), 1.0);
        series
    }

    #[test]
    fn two_close_roots_do_not_hide() {
        let grazes = &mut Vec::new();
        let root = first_root(parabola(0.5, 0.5 + 1e-7, 0.0), 0.0, false, 1.0, grazes).unwrap();
        assert!((root - 0.5).abs() < 1e-9, "{root}");
        assert_eq!(
            first_root(parabola(0.5, 0.5, 1e-15), 0.0, false, 1.0, grazes),
            None
        );
        assert!(grazes.is_empty());
    }

    #[test]
    fn a_guard_that_is_fast_in_its_unit_of_time_has_the_same_root() {
        // exp(−h) − 1/2, and with a unit of time in which the last powers times their number are too large.
        let (mut slow, mut term) = (ZERO, 1.0);
        let unit = 2.0_f64.powi(-40);
        for (k, coefficient) in slow.iter_mut().enumerate() {
            *coefficient = term;
            term /= -((k + 1) as f64);
        }
        slow[0] -= 0.5;
        let mut series = slow;
        for k in 1..=ORDER {
            for term in &mut series[k..] {
                *term /= unit;
            }
        }
        assert!(series[ORDER].is_finite() && !curvature_bound(&series, unit).is_finite());
        let known = first_root(slow, 1e-15, false, 1.5, &mut Vec::new()).unwrap();
        let root = first_root(series, 1e-15, false, 1.5 * unit, &mut Vec::new()).unwrap();
        assert!((known - 2.0_f64.ln()).abs() < 1e-14, "{known}");
        assert!((root / unit - known).abs() < 1e-14, "{}", root / unit);
    }

    #[test]
    fn a_touch_within_rounding_is_no_root() {
        for gap in [-1e-15, 0.0, 1e-15] {
            let grazes = &mut Vec::new();
            // (h − 0.5)² (1 − h), but for the gap: what is met after the touch is a root.
            let mut series = parabola(0.5, 0.5, gap);
            for k in (0..3).rev() {
                series[k + 1] -= series[k];
            }
            let root = first_root(series, 1e-14, false, 2.0, grazes).unwrap();
            assert!((root - 1.0).abs() < 1e-12, "{gap}: {root}");
            assert!(grazes.len() == 1 && (grazes[0] - 0.5).abs() < 1e-6, "{grazes:?}");
        }
    }

    #[test]
    fn a_guard_that_starts_at_zero_is_armed_by_its_slope() {
        let mut series = ZERO;
        (series[0], series[1], series[2]) = (1e-17, 1.0, -2.0);
        assert!((first_root(series, 1e-16, false, 1.0, &mut Vec::new()).unwrap() - 0.5).abs() < 1e-15);
        series[1] = -1.0;
        assert_eq!(first_root(series, 1e-16, false, 1.0, &mut Vec::new()), Some(0.0));
        (series[1], series[2], series[3]) = (1e-18, 1.0, -1.0);
        assert!((first_root(series, 1e-16, true, 2.0, &mut Vec::new()).unwrap() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn a_guard_that_starts_at_zero_without_slope_goes_where_its_next_power_leads() {
        let mut series = ZERO;
        (series[0], series[2], series[3]) = (1e-17, 1.0, -1.0);
        assert!((first_root(series, 1e-16, false, 2.0, &mut Vec::new()).unwrap() - 1.0).abs() < 1e-15);
        (series[2], series[3], series[4]) = (0.0, 1.0, -1.0);
        assert!((first_root(series, 1e-16, true, 2.0, &mut Vec::new()).unwrap() - 1.0).abs() < 1e-15);
        series[3] = -1.0;
        assert_eq!(first_root(series, 1e-16, true, 2.0, &mut Vec::new()), Some(0.0));
    }
}
