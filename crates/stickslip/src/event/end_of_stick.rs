//! When adhesion breaks, and when friction leaves the branches between which it holds a slip speed.

use super::falling_limit::FallingLimit;
use super::search::{Ends, Motion, SEARCH_DEGREE, Sample, first_exit};
use super::slip::{add_waves, waves};
use super::{ANEW_ROUNDINGS, BESIDE_ROOT, Start, changes_sign};
use crate::flow::enclosure::bounds;
use crate::flow::exact::Stick;
use crate::law::{End, Friction, Law, Rest};
use crate::series::free_time;
use crate::watch::Watched;

/// The friction force that holds a speed.
pub(super) struct Reaction<'a, const H: usize> {
    pub(super) stick: &'a Stick<H>,
    pub(super) bound: [f64; 3],
}

impl<const H: usize> Motion<H> for Reaction<'_, H> {
    #[inline]
    fn at(&self, t: f64) -> Sample<H> {
        let stick = self.stick;
        let (cos, sin) = stick.waves(t);
        let free = [stick.start + stick.rate * t, stick.rate];
        let mut d = [free[0], free[1], 0.0, 0.0];
        let waves = waves(
            std::array::from_fn(|j| stick.p[j] * cos[j] + stick.q[j] * sin[j]),
            std::array::from_fn(|j| stick.frequency[j] * (stick.q[j] * cos[j] - stick.p[j] * sin[j])),
            &stick.frequency,
            &mut d,
        );
        Sample {
            t,
            d,
            free,
            waves,
            bound: self.bound,
        }
    }

    fn fastest(&self) -> f64 {
        self.stick.frequency.iter().copied().fold(0.0, f64::max)
    }

    fn derivatives(&self, sample: &Sample<H>) -> [f64; SEARCH_DEGREE + 1] {
        let mut derivatives = [0.0; SEARCH_DEGREE + 1];
        derivatives[1] = sample.free[1];
        add_waves(&sample.waves, &self.stick.frequency, &mut derivatives);
        derivatives[0] = sample.d[0];
        derivatives
    }
}

/// When the friction that holds a slip in `direction` leaves [low, high] within `horizon`, and over which end.
///
/// With f₋ while the slip speed falls and f₊ > f₋ while it rises, neither branch is consistent with a balance of forces
/// between them: the slip speed stays, as adhesion holds it at zero, and friction is the reaction that keeps it. `stick` gives
/// that reaction; `start` says on which end it starts, there it moves inward: the end is then where the reaction is, from which
/// a branch that is steep at the slip speed held may be off by more than rounding of forces.
pub fn end_of_hold<const H: usize>(
    stick: &Stick<H>,
    direction: f64,
    [mut low, mut high]: [f64; 2],
    start: Start,
    horizon: f64,
    work: &mut Watched,
) -> Option<(f64, End)> {
    let reaction = Reaction {
        stick: &Stick {
            frequency: stick.frequency,
            start: direction * stick.start,
            rate: direction * stick.rate,
            p: stick.p.map(|p| direction * p),
            q: stick.q.map(|q| direction * q),
        },
        bound: bounds(&stick.p, &stick.q, &stick.frequency),
    };
    match start {
        Start::Low => low = reaction.at(0.0).d[0],
        Start::High => high = reaction.at(0.0).d[0],
        _ => {}
    }
    // A reaction that stays within rounding of what it is, be it on an end, never leaves.
    let rounding = stick.rounding(0.0, low.abs().max(high.abs()));
    let inside = reaction.stick.start >= low - rounding && reaction.stick.start <= high + rounding;
    if stick.rate == 0.0 && inside && reaction.bound[0] <= rounding {
        return None;
    }
    let ends = Ends {
        low,
        high,
        reverses: false,
    };
    first_exit(&reaction, ends, start, horizon, work).map(|exit| (exit.t, exit.end))
}

/// Adhesion with a limit that stays.
fn constant_limit<const H: usize>(
    stick: &Stick<H>,
    [backward, forward]: [f64; 2],
    horizon: f64,
    work: &mut Watched,
) -> Option<f64> {
    if H == 0 {
        if stick.rate == 0.0 {
            return None;
        }
        let limit = if stick.rate < 0.0 { -backward } else { forward };
        let t = ((limit - stick.start) / stick.rate).max(0.0);
        return (t < horizon).then_some(t);
    }
    end_of_hold(stick, 1.0, [-backward, forward], Start::Inside, horizon, work).map(|(t, _)| t)
}

/// When adhesion breaks within `horizon`, if it does; `static_limit` is its limit backward and forward, if that stays whatever the hold.
pub fn end_of_stick<const H: usize>(
    stick: &Stick<H>,
    law: &Law,
    static_limit: Option<[f64; 2]>,
    horizon: f64,
    work: &mut Watched,
) -> Option<f64> {
    let end = match static_limit {
        Some(static_limit) => constant_limit(stick, static_limit, horizon, work),
        None => changing_limit(stick, law, horizon, work),
    };
    debug_assert!(
        end.is_none_or(|t| breaks(stick, law, static_limit, t)),
        "{end:?} is no end of {stick:?}, {law:?}"
    );
    end
}

/// The certificate of a break-away.
fn breaks<const H: usize>(stick: &Stick<H>, law: &Law, static_limit: Option<[f64; 2]>, t: f64) -> bool {
    let fastest = stick.frequency.iter().copied().fold(0.0, f64::max);
    changes_sign(t, if H == 0 { 0.0 } else { BESIDE_ROOT / fastest }, |t| {
        let (force, rate, _) = stick.at(t);
        let rest = Rest::new(t, rate.abs());
        let limit = static_limit.map_or_else(
            || law.toward(force.signum()).static_limit(rest),
            |[backward, forward]| if force < 0.0 { backward } else { forward },
        );
        [limit - force.abs(), ANEW_ROUNDINGS * stick.rounding(t, limit)]
    })
}

/// Adhesion with a limit that changes with the hold.
fn changing_limit<const H: usize>(
    stick: &Stick<H>,
    law: &Law,
    horizon: f64,
    work: &mut Watched,
) -> Option<f64> {
    if H == 0 && stick.rate == 0.0 {
        return None;
    }
    let search = |law: &Law, side, until| {
        if H == 1 && cfg!(not(target_family = "wasm")) && law.feels_force_rate() {
            return Ok(FallingLimit::new(stick, law, side, work).first(until));
        }
        if H > 0 && law.feels_force_rate() {
            // One copy of the search for all other numbers of harmonics, with the same bits: a core for a browser is small.
            return Ok(FallingLimit::new(&stick.padded(), law, side, work).first(until));
        }
        Ok(growing_limit(stick, law, side, until, work))
    };
    on_either_side(law, horizon, search).unwrap_or_default()
}

/// The sign of the forces under which a break-away is looked for; none: either.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Side(Option<f64>);

impl Side {
    #[cfg(test)]
    pub(super) const EITHER: Self = Self(None);

    /// The sign by which a force counts.
    #[inline]
    pub(crate) fn sign(self, force: f64) -> f64 {
        self.0.unwrap_or(force.signum())
    }

    /// The least of what there is for the sign of each side.
    pub(super) fn least(self, of: impl Fn(f64) -> f64) -> f64 {
        self.0.map_or_else(|| of(1.0).min(of(-1.0)), &of)
    }

    /// How far outward a force goes that lies between two.
    pub(super) fn most(self, low: f64, high: f64) -> f64 {
        -self.least(|sign| if sign > 0.0 { -high } else { low })
    }

    /// The largest step τ in which force + rate τ + curvature τ²/2 surely stays within limit + rise τ.
    #[inline]
    pub(crate) fn free_time(self, [limit, rise]: [f64; 2], [force, rate, curvature]: [f64; 3]) -> f64 {
        let to = |sign: f64| free_time(limit - sign * force, rise - sign * rate, curvature);
        self.0.map_or_else(|| to(1.0).min(to(-1.0)), to)
    }
}

/// The first break-away within `reach` by a search of one side, or of both where the law is the same on them. An error is
/// the time up to which a search knows that there is none.
pub(crate) fn on_either_side(
    law: &Law,
    reach: f64,
    mut search: impl FnMut(&Law, Side, f64) -> Result<Option<f64>, f64>,
) -> Result<Option<f64>, f64> {
    let [backward, forward] = [-1.0, 1.0].map(|direction| law.toward(direction));
    if std::ptr::eq(backward, forward) {
        return search(law, Side(None), reach);
    }
    let first = search(forward, Side(Some(1.0)), reach);
    let clear = first.map_or_else(|clear| clear, |found| found.unwrap_or(reach));
    match search(backward, Side(Some(-1.0)), clear) {
        Ok(None) => first,
        second => second,
    }
}

/// The time after which a force that is at its limit is clear of it again, where it has its crest there within rounding and only
/// touches; none where it goes on.
pub(super) fn relieved(outward: f64, inward: f64, rounding: f64) -> Option<f64> {
    let touches = inward > 0.0 && (outward <= 0.0 || outward * outward <= 2.0 * inward * rounding);
    touches.then(|| outward / inward + (16.0 * rounding / inward).sqrt())
}

/// When adhesion breaks under a limit that changes with the stick time alone, on one side or on either.
fn growing_limit<const H: usize>(
    stick: &Stick<H>,
    law: &Law,
    side: Side,
    horizon: f64,
    work: &mut Watched,
) -> Option<f64> {
    let mut t = 0.0;
    let curvature_bound = stick.curvature_bound();
    let reach = if H == 0 {
        f64::INFINITY
    } else {
        1.0 / stick.frequency.iter().copied().fold(0.0, f64::max)
    };
    loop {
        if work.ends(t) {
            return None;
        }
        work.evaluations += 1;
        let (force, rate, curvature) = stick.at(t);
        let static_limit = law.static_limit(Rest::new(t, rate.abs()));
        let sign = side.sign(force);
        let margin = static_limit - sign * force;
        let outward = rate * sign;
        let rounding = stick.rounding(t, static_limit);
        if margin <= rounding && outward >= 0.0 {
            match relieved(outward, -curvature * sign, rounding) {
                Some(touch) => t += touch,
                None => return Some(t),
            }
            continue;
        }
        // As the limit does not fall while the contact rests, its value now is a lower bound.
        let mut step = side
            .free_time([static_limit, 0.0], [force, rate, curvature_bound])
            .min(reach);
        if force != 0.0 && law.growth_bound(t) < outward - curvature_bound * (2.0 * step) {
            // The margin falls from here to twice the step: at most one root, close it.
            match close(stick, law, side, (t, t + 2.0 * step), work) {
                Ok(root) => return (root < horizon).then_some(root),
                Err(free) => step = free - t,
            }
        }
        // However small the step that the bounds allow, only the margin itself says whether adhesion breaks: the force changes
        // by no more than rounding in the least one.
        let least = side
            .free_time([rounding, 0.0], [0.0, rate, curvature_bound])
            .min(f64::EPSILON * reach);
        t += step.max(least).max(2.0 * f64::EPSILON * t);
        if t >= horizon {
            return None;
        }
    }
}

/// The root of the falling margin in (low, high], or `high` where it is still positive there: Halley inside the bracket. A
/// root is a time at which the margin was evaluated: it is zero within rounding there, or has changed its sign within that of t.
fn close<const H: usize>(
    stick: &Stick<H>,
    law: &Law,
    side: Side,
    (mut low, high): (f64, f64),
    work: &mut Watched,
) -> Result<f64, f64> {
    let (mut t, mut above, mut crossed) = (low, high, false);
    let (mut last, mut polished) = (f64::INFINITY, false);
    // From a step this short the next one is below rounding: Halley's error is cubic.
    let settled = 1e-5 * (high - low);
    loop {
        if work.ends(t) {
            return Err(t);
        }
        work.evaluations += 1;
        let (force, rate, curvature) = stick.at(t);
        let limit = law.adhesion(Rest::new(t, rate.abs()));
        let sign = side.sign(force);
        let margin = limit.force - sign * force;
        let rounding = stick.rounding(t, limit.force);
        if margin.abs()
            <= if polished {
                rounding
            } else {
                f64::EPSILON * limit.force
            }
        {
            return Ok(t);
        }
        work.fallbacks += u64::from(polished);
        if margin > 0.0 {
            if t == high {
                return Err(high);
            }
            low = t;
        } else {
            (above, crossed) = (t, true);
        }
        let fall = rate * sign - limit.growth;
        let mut hastens = curvature * sign;
        if limit.curvature.is_finite() {
            hastens -= limit.curvature;
        }
        let newton = margin / fall;
        let step = newton / (1.0 + 0.5 * newton * hastens / fall).max(0.5);
        let mut next = t + step;
        if step.abs() <= f64::EPSILON * t && margin.abs() <= rounding {
            return Ok(t);
        }
        polished = step.abs() <= settled;
        // A step that does not halve the one before is not closing in: the line of a table has a corner ahead.
        if !(next > low && next < above && step.abs() < 0.5 * last) {
            polished = false;
            next = 0.5 * (low + above);
            let ends = next <= low || next >= above;
            if ends && crossed {
                return Ok(above);
            }
            if !crossed && (ends || t + step >= high) {
                next = high;
            }
        }
        last = (next - t).abs();
        t = next;
    }
}
