//! When adhesion breaks: the first time its force is more than a limit that grows with rest and falls with the force rate.

use super::SPEED_ROUNDING;
use crate::event::first_root::{CERTIFIED_BESIDE, PASSED_GUARD_FACTOR, borne_step, first_root};
use crate::event::{Side, changes_sign, on_either_side};
use crate::law::{Friction, Law, Rest};
use crate::series::{Series, at, curvature_bound, slope_at, swing_bound};

/// A search of so many rounds gives up where it is: the motion goes on from there.
const MOST_SEARCH_ROUNDS: u32 = 10_000;

/// A contact that sticks along a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct StickPhase<'a> {
    /// The force that it needs to stick.
    pub(super) force: &'a Series,
    /// Its normal force over that of the law, where that varies.
    pub(super) normal: Option<&'a Series>,
    /// For how long it has stuck.
    pub(super) stick_time: f64,
    /// A force that starts beyond the limit by no more than this and is relieved from there does not break it.
    pub(super) zero_rate: f64,
}

/// When adhesion breaks within `reach`. An error is the time up to which it holds, where the search gave up.
pub(super) fn end_of_adhesion(
    law: &Law,
    phase: StickPhase,
    reach: f64,
    grazes: &mut Vec<f64>,
) -> Result<Option<f64>, f64> {
    let found = on_either_side(law, reach, |law, side, until| {
        end_on(law, side, phase, until, grazes)
    });
    debug_assert!(
        !matches!(found, Ok(Some(h)) if !breaks(law, phase, h, reach)),
        "{found:?} is no end of adhesion of {phase:?}, {law:?}"
    );
    found
}

/// The certificate of a break-away, checked in a debug build.
fn breaks(law: &Law, phase: StickPhase, h: f64, reach: f64) -> bool {
    let margin = |t: f64| {
        let (value, rate) = slope_at(phase.force, t);
        let rest = Rest::new(phase.stick_time + t, rate.abs());
        let limit = pressed(phase.normal, t) * law.toward(value.signum()).static_limit(rest);
        [
            limit - value.abs(),
            16.0 * rounding_of(limit + value.abs(), phase.zero_rate),
        ]
    };
    h == 0.0 || changes_sign(h, CERTIFIED_BESIDE * reach, margin)
}

/// The share of the law's force that there is at a time: 1 where the normal force does not vary.
fn pressed(normal: Option<&Series>, t: f64) -> f64 {
    normal.map_or(1.0, |normal| at(normal, t).max(0.0))
}

/// How far from the limit a force may be by rounding and by the error with which an event was found.
fn rounding_of(limit: f64, zero_rate: f64) -> f64 {
    (SPEED_ROUNDING * limit).max(2.0 * zero_rate / PASSED_GUARD_FACTOR)
}

/// When adhesion breaks on a side.
fn end_on(
    law: &Law,
    side: Side,
    phase: StickPhase,
    reach: f64,
    grazes: &mut Vec<f64>,
) -> Result<Option<f64>, f64> {
    let (force, normal, stick_time) = (phase.force, phase.normal, phase.stick_time);
    let of_law = |t: f64, rate: f64| law.static_limit(Rest::new(stick_time + t, rate.abs()));
    let limit = |t: f64, rate: f64| pressed(normal, t) * of_law(t, rate);
    let feels_rate = law.feels_force_rate();
    let static_limit = limit(0.0, force[1]);
    let rounding = rounding_of(static_limit, phase.zero_rate);
    if !feels_rate && law.growth_bound(stick_time) == 0.0 {
        let (mut first, constant) = (None, of_law(0.0, 0.0));
        // Far from the limit on both sides.
        let room = constant - force[0].abs();
        if normal.is_none() && room > rounding && room > swing_bound(force, reach) {
            return Ok(None);
        }
        for sign in [1.0, -1.0].into_iter().filter(|&sign| side.sign(sign) == sign) {
            let mut room = force.map(|term| -sign * term);
            match normal {
                None => room[0] += constant,
                Some(normal) => room
                    .iter_mut()
                    .zip(normal)
                    .for_each(|(room, n)| *room += n * constant),
            }
            first = first_root(room, rounding, false, first.unwrap_or(reach), grazes).or(first);
        }
        return Ok(first);
    }
    let curvature = curvature_bound(force, reach);
    let flat = curvature * reach * reach <= rounding;
    // A force that stays what it is within rounding, below a limit that does not fall, breaks nothing.
    let swing = force[1].abs() * reach + 0.5 * curvature * reach * reach;
    let least = if feels_rate {
        limit(0.0, force[1].abs() + curvature * reach)
    } else {
        static_limit
    };
    let outward_of = |value: f64| side.sign(value) * value;
    let margin = |t: f64| {
        let (value, rate) = slope_at(force, t);
        limit(t, rate) - outward_of(value)
    };
    if normal.is_none() && swing <= rounding && outward_of(force[0]) - least <= rounding {
        return Ok(None);
    }
    let tiny = f64::EPSILON * reach;
    let mut t = 0.0;
    for _ in 0..MOST_SEARCH_ROUNDS {
        let (value, rate) = slope_at(force, t);
        let static_limit = limit(t, rate);
        let size = outward_of(value);
        let outward = rate * side.sign(value);
        if static_limit - size <= rounding {
            if t > 0.0 || outward > 0.0 || static_limit - size < -PASSED_GUARD_FACTOR * rounding {
                return Ok(Some(if t > 0.0 { settle(margin, t, reach) } else { t }));
            }
            // Adhesion that starts at its limit and is relieved from there.
            t += f64::EPSILON.sqrt() * reach;
            continue;
        }
        // A normal force that varies takes the limit along.
        let (rise, bend) = normal.map_or((0.0, 0.0), |normal| {
            let law = of_law(t, rate);
            (law * slope_at(normal, t).1, law * curvature_bound(normal, reach))
        });
        let mut step = side
            .free_time([static_limit, rise], [value, rate, curvature + bend])
            .min(reach - t);
        if feels_rate && !flat {
            // The limit falls with the force rate: at the worst rate ahead it must still bear.
            step = borne_step(step, tiny, [size, rate, curvature], |rate| limit(t, rate));
        }
        if normal.is_none()
            && (!feels_rate || flat)
            && law.growth_bound(stick_time + t) < outward - 2.0 * curvature * step
        {
            // The margin falls from here on: one root, close it.
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

/// The root of a margin just after `low`, where it is no more than rounding; `low` where it does not fall to zero.
fn settle(margin: impl Fn(f64) -> f64, low: f64, reach: f64) -> f64 {
    let mut last = margin(low);
    let mut step = f64::EPSILON * reach;
    while last > 0.0 && low + step < reach {
        let next = margin(low + step);
        if next <= 0.0 {
            return close(margin, low, low + step);
        }
        if next > last {
            break;
        }
        last = next;
        step *= 4.0;
    }
    low
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
