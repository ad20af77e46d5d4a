//! When adhesion breaks: the first time its force is more than a limit that grows with rest and falls with the force rate.

use crate::law::{Friction, Hold, Law};
use crate::series::{PASSED, Series, curvature, first_root, free_time, slope_at};

/// A search of so many rounds gives up where it is: the motion goes on from there.
const ROUNDS: u32 = 10_000;

/// When adhesion under `force` breaks within `reach`, for a contact that has rested for `rested`; a force that starts beyond
/// the limit by no more than `still` and is relieved from there does not break it. An error is the time up to which it holds,
/// where the search gave up.
pub(super) fn end_of_adhesion(
    law: &Law,
    force: &Series,
    rested: f64,
    still: f64,
    reach: f64,
    grazes: &mut Vec<f64>,
) -> Result<Option<f64>, f64> {
    let limit = |t: f64, rate: f64| {
        law.break_away(Hold {
            stick_time: rested + t,
            force_rate: rate.abs(),
        })
    };
    let feels_rate = law.feels_force_rate();
    let bears = limit(0.0, force[1]);
    let rounding = (4.0 * f64::EPSILON * bears).max(2.0 * still / PASSED);
    if !feels_rate && law.growth_bound(rested) == 0.0 {
        let mut upper = force.map(|term| -term);
        let mut lower = *force;
        upper[0] += bears;
        lower[0] += bears;
        let first = first_root(&upper, rounding, false, reach, grazes);
        let second = first_root(&lower, rounding, false, first.unwrap_or(reach), grazes);
        return Ok(second.or(first));
    }
    let bend = curvature(force, reach);
    let flat = bend * reach * reach <= rounding;
    // A force that stays what it is within rounding, below a limit that does not fall, breaks nothing.
    let swing = force[1].abs() * reach + 0.5 * bend * reach * reach;
    let least = if feels_rate { limit(0.0, force[1].abs() + bend * reach) } else { bears };
    if swing <= rounding && force[0].abs() - least <= rounding {
        return Ok(None);
    }
    let tiny = f64::EPSILON * reach;
    let mut t = 0.0;
    for _ in 0..ROUNDS {
        let (value, rate) = slope_at(force, t);
        let bears = limit(t, rate);
        let outward = rate * value.signum();
        if bears - value.abs() <= rounding {
            if t > 0.0 || outward > 0.0 || bears - value.abs() < -PASSED * rounding {
                return Ok(Some(t));
            }
            // Adhesion that starts at its limit and is relieved from there.
            t += f64::EPSILON.sqrt() * reach;
            continue;
        }
        let mut step = free_time(bears - value, -rate, bend)
            .min(free_time(bears + value, rate, bend))
            .min(reach - t);
        if feels_rate && !flat {
            // The limit falls with the force rate: at the worst rate ahead it must still bear.
            while step > 0.0
                && limit(t, rate.abs() + bend * step)
                    - value.abs()
                    - rate.abs() * step
                    - 0.5 * bend * step * step
                    <= 0.0
            {
                step *= 0.5;
                if step < tiny {
                    break;
                }
            }
        }
        if (!feels_rate || flat) && law.growth_bound(rested + t) < outward - 2.0 * bend * step {
            // The margin falls from here on: one root, close it.
            let margin = |t: f64| {
                let (value, rate) = slope_at(force, t);
                limit(t, rate) - value.abs()
            };
            let until = (t + 2.0 * step).min(reach);
            if margin(until) <= 0.0 {
                return Ok(Some(close(margin, t, until)));
            }
            step = until - t;
        }
        // However small the step that the bounds allow, only the margin itself says whether adhesion breaks.
        t += step.max(tiny);
        if t >= reach {
            return Ok(None);
        }
    }
    Err(t)
}

/// The root of a falling margin, positive at `low` and not at `high`: secant steps inside a bracket (Illinois), halved where
/// they are slow, until its ends are neighbours.
fn close(margin: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let (mut above, mut below) = (margin(low), margin(high));
    let mut moved = 0;
    for tried in 0..200 {
        if below == 0.0 || high - low <= 2.0 * f64::EPSILON * high {
            break;
        }
        let mut t = high - below * (high - low) / (below - above);
        if tried >= 20 || !(t > low && t < high) {
            t = 0.5 * (low + high);
            if t <= low || t >= high {
                break;
            }
        }
        let value = margin(t);
        if value > 0.0 {
            (low, above) = (t, value);
            below *= if moved == 1 { 0.5 } else { 1.0 };
            moved = 1;
        } else {
            (high, below) = (t, value);
            above *= if moved == 2 { 0.5 } else { 1.0 };
            moved = 2;
        }
    }
    high
}
