//! When adhesion breaks under harmonic forces and a limit that falls with the force rate, of one mass. Without a force it is
//! `end_of_stick.rs`, of several masses `network/end_of_stick.rs`.
//!
//! The search goes from window to window. One ends where a harmonic of the force rate has its next extremum, or before: the
//! extremes of the force, of its rate and of its curvature within are known in closed form. As the limit grows with the stick
//! time and falls with the force rate, the limit at the start of a window, at the fastest rate within, is the least one there:
//! while the force stays below it, adhesion holds. Where the bounds say that the margin between limit and force falls throughout
//! a window, its sign at the end tells whether the window has a root, and that is the first.

use std::f64::consts::PI;

use super::end_of_stick::{Reaction, Side, relieved};
use super::search::{Motion, Sample};
use crate::elementary::{atan2, hypot};
use crate::flow::enclosure::{bounds, larger};
use crate::flow::exact::Stick;
use crate::law::{Friction, Law, Rest};
use crate::watch::Watched;

/// A step to a root that is so short a part of the bracket at its start is the last one: its error is of more than the second order.
const LAST_STEP: f64 = 1e-6;
/// As a part of its rounding, a margin that no further step would make smaller.
const ZERO_ANYWAY: f64 = 0.125;

/// A search along one phase of adhesion.
pub(super) struct FallingLimit<'a, 'w, const H: usize> {
    reaction: Reaction<'a, H>,
    amplitude: [f64; H],
    law: &'a Law,
    side: Side,
    work: &'a mut Watched<'w>,
}

/// What is known of adhesion from some time on.
enum Verdict {
    /// It holds throughout the window.
    Holds,
    Breaks(f64),
    /// It holds for this long at least.
    Doubtful(f64),
}

/// The margin between limit and force at one time.
#[derive(Clone, Copy)]
struct Margin {
    t: f64,
    value: f64,
    slope: f64,
    rounding: f64,
    /// How fast the limit falls with the force rate.
    softening: f64,
}

impl<'a, 'w, const H: usize> FallingLimit<'a, 'w, H> {
    pub(super) fn new(stick: &'a Stick<H>, law: &'a Law, side: Side, work: &'a mut Watched<'w>) -> Self {
        let bound = bounds(&stick.p, &stick.q, &stick.frequency);
        Self {
            reaction: Reaction { stick, bound },
            amplitude: std::array::from_fn(|j| hypot(stick.p[j], stick.q[j])),
            law,
            side,
            work,
        }
    }

    fn limit(&self, t: f64, rate: f64) -> f64 {
        self.law.static_limit(Rest::new(t, rate.abs()))
    }

    /// The first break-away within `horizon`.
    pub(super) fn first(&mut self, horizon: f64) -> Option<f64> {
        let reach = 1.0 / self.reaction.fastest();
        let clear = self.clear_until(horizon, reach);
        if clear >= horizon {
            return None;
        }
        let mut left = self.reaction.at(clear);
        let (mut holds, mut span) = (clear > 0.0, f64::INFINITY);
        while left.t < horizon {
            if self.work.ends(left.t) {
                return None;
            }
            self.work.evaluations += 1;
            if !holds {
                match self.start(&left) {
                    Verdict::Holds => {}
                    Verdict::Breaks(t) => return Some(t),
                    Verdict::Doubtful(touch) => {
                        left = self.reaction.at(left.t + touch);
                        continue;
                    }
                }
            }
            // However short the window that the bounds allow, only the margin itself says whether adhesion breaks.
            let least = f64::EPSILON * reach.max(2.0 * left.t);
            let right = self.end_of_window(&left, span, least);
            match self.verdict(&left, &right) {
                Verdict::Holds => (left, holds, span) = (right, true, f64::INFINITY),
                Verdict::Breaks(t) => return (t < horizon).then_some(t),
                Verdict::Doubtful(free) if free > least => {
                    left = self.reaction.at(left.t + free);
                    (holds, span) = (true, 2.0 * free);
                }
                Verdict::Doubtful(_) => {
                    span = 0.5 * (right.t - left.t);
                    if span < least {
                        left = self.reaction.at(left.t + least);
                        (holds, span) = (false, 8.0 * least);
                    }
                }
            }
        }
        None
    }

    /// Until when the force, with all its harmonics at their extremes, surely stays below the limit with the force rate at its.
    fn clear_until(&mut self, horizon: f64, reach: f64) -> f64 {
        let stick = self.reaction.stick;
        let swing: f64 = self.amplitude.iter().sum();
        let swing_of_rate: f64 = (0..H).map(|j| stick.frequency[j] * self.amplitude[j]).sum();
        let mut clear = 0.0;
        loop {
            let least = self.limit(clear, stick.rate.abs() + swing_of_rate);
            let until = self.side.least(|sign| {
                let (room, rise) = (least - swing - sign * stick.start, sign * stick.rate);
                if room > 0.0 && rise > 0.0 {
                    room / rise
                } else if room > 0.0 {
                    f64::INFINITY
                } else {
                    0.0
                }
            });
            // The limit has grown until then: again, if that is more than a window brings.
            let more = until > clear + reach;
            clear = until.max(clear);
            if !more || clear >= horizon || self.work.ends(clear) {
                return clear;
            }
        }
    }

    /// What the margin itself says at a time before which adhesion held, but for rounding.
    fn start(&self, sample: &Sample<H>) -> Verdict {
        let [force, rate, curvature, _] = sample.d;
        let limit = self.limit(sample.t, rate);
        let sign = self.side.sign(force);
        let (margin, outward) = (limit - sign * force, sign * rate);
        let rounding = self.reaction.stick.rounding(sample.t, limit);
        // The limit can also fall below a force that retreats.
        if margin < -rounding {
            return Verdict::Breaks(sample.t);
        }
        if margin > rounding || outward < 0.0 {
            return Verdict::Holds;
        }
        relieved(outward, -sign * curvature, rounding).map_or(Verdict::Breaks(sample.t), Verdict::Doubtful)
    }

    /// The end of the window that a sample begins, of no more than `span` unless that is less than `least`.
    fn end_of_window(&self, left: &Sample<H>, span: f64, least: f64) -> Sample<H> {
        let (mut step, mut extremal) = (span, None);
        for (j, ([value, rate], frequency)) in
            left.waves.iter().zip(self.reaction.stick.frequency).enumerate()
        {
            // The angle at which |value| cos + sense · rate/Ω sin vanishes: there the rate has its extremum.
            let sense = if *value == 0.0 { *rate } else { *value };
            let angle = atan2(value.abs(), -rate * sense.signum() / frequency);
            let time = if angle > 0.0 { angle } else { PI } / frequency;
            if time < step {
                (step, extremal) = (time, Some(j));
            }
        }
        let mut right = self.reaction.at(left.t + step.max(least));
        if let Some(j) = extremal {
            // Its sign there would be that of rounding.
            right.waves[j][0] = 0.0;
        }
        right
    }

    /// What is known of the window between two samples, if adhesion holds at the first.
    fn verdict(&mut self, left: &Sample<H>, right: &Sample<H>) -> Verdict {
        let stick = self.reaction.stick;
        let sign = self.side.sign(left.d[0]);
        let line = [left.free[0], right.free[0]];
        let [mut low, mut high] = [line[0].min(line[1]), line[0].max(line[1])];
        let [mut slow, mut fast] = [stick.rate; 2];
        let mut relief = 0.0;
        for j in 0..H {
            let (from, to) = (left.waves[j], right.waves[j]);
            let [least, most] = extremes(from, to, self.amplitude[j]);
            let inward = larger(0.0, if sign > 0.0 { most } else { -least });
            (low, high) = (low + least, high + most);
            (slow, fast) = (slow + from[1].min(to[1]), fast + from[1].max(to[1]));
            relief += stick.frequency[j] * stick.frequency[j] * inward;
        }
        if slow >= 0.0 || fast <= 0.0 {
            (low, high) = (left.d[0].min(right.d[0]), left.d[0].max(right.d[0]));
        }
        let fastest = larger(-slow, fast);
        let outward = if sign > 0.0 { slow } else { -fast };
        // A force that goes outward throughout takes the limit down, but for its growth and where the force rate falls.
        let falling = sign * left.d[0] > 0.0 && outward > 0.0;
        let falls = |relief: f64| self.law.growth_bound(left.t) + relief < outward;
        if falling && relief == 0.0 && falls(0.0) {
            return self.falls(left, right);
        }
        let limit = self.limit(left.t, fastest);
        if limit - self.side.most(low, high) > stick.rounding(right.t, limit) {
            return Verdict::Holds;
        }
        if falling && relief > 0.0 && falls(relief * self.law.softening_bound([outward, fastest])) {
            return self.falls(left, right);
        }
        let free = self.side.least(|sign| {
            let rise = larger(0.0, if sign > 0.0 { fast } else { -slow });
            (limit - sign * left.d[0]) / rise
        });
        Verdict::Doubtful(free.min(right.t - left.t))
    }

    fn margin(&self, t: f64, [force, rate, curvature]: [f64; 3]) -> Margin {
        let limit = self.law.adhesion(Rest::new(t, rate.abs()));
        let sign = self.side.sign(force);
        Margin {
            t,
            value: limit.force - sign * force,
            slope: limit.growth - limit.softening * curvature * rate.signum() - sign * rate,
            rounding: self.reaction.stick.rounding(t, limit.force),
            softening: limit.softening,
        }
    }

    /// A window throughout which the margin falls.
    fn falls(&mut self, left: &Sample<H>, right: &Sample<H>) -> Verdict {
        let [force, rate, curvature, jerk] = right.d;
        let end = self.margin(right.t, [force, rate, curvature]);
        if end.value > 0.0 {
            return Verdict::Holds;
        }
        // Where the force rate has an extremum, that is what turns the margin.
        let turn = -end.softening * jerk * rate.signum() - self.side.sign(force) * curvature;
        let root = (end.slope * end.slope - 2.0 * end.value * turn).max(0.0).sqrt();
        self.close(left.t, end, end.t - 2.0 * end.value / (end.slope - root))
    }

    /// The root of a margin that falls from `low` on to `last`, where it is not above zero, with a guess of the root. It is a time
    /// at which the margin was evaluated: it is zero within rounding there, or has changed its sign within that of t.
    fn close(&mut self, mut low: f64, mut last: Margin, mut next: f64) -> Verdict {
        let mut high = last.t;
        let short = LAST_STEP * (high - low);
        let (mut step, mut settled) = (f64::INFINITY, false);
        loop {
            if self.work.ends(low) {
                return Verdict::Doubtful(0.0);
            }
            settled |= (next - last.t).abs() <= f64::EPSILON * last.t;
            if last.value.abs() <= if settled { 1.0 } else { ZERO_ANYWAY } * last.rounding {
                return Verdict::Breaks(last.t);
            }
            self.work.fallbacks += u64::from(settled);
            if last.value > 0.0 {
                low = last.t;
            } else {
                high = last.t;
            }
            // A step that does not halve the one before is not closing in.
            let closes = next > low && next < high && (next - last.t).abs() < 0.5 * step;
            if !closes {
                next = 0.5 * (low + high);
                if next <= low || next >= high {
                    return Verdict::Breaks(high);
                }
            }
            step = (next - last.t).abs();
            settled = closes && step <= short;
            self.work.evaluations += 1;
            let (force, rate, curvature) = self.reaction.stick.at(next);
            let before = last;
            last = self.margin(next, [force, rate, curvature]);
            next = root(&before, &last);
        }
    }
}

/// The least and the largest value of a harmonic of this amplitude between two times, by its value and rate there, of which one
/// at the most has its sign between them.
fn extremes([from, rises]: [f64; 2], [to, falls]: [f64; 2], amplitude: f64) -> [f64; 2] {
    [
        if rises < 0.0 && falls > 0.0 {
            -amplitude
        } else {
            from.min(to)
        },
        if rises > 0.0 && falls < 0.0 {
            amplitude
        } else {
            from.max(to)
        },
    ]
}

/// Where the cubic that gives the time over the margin, through two margins with their slopes, has the margin zero.
fn root(one: &Margin, other: &Margin) -> f64 {
    let change = other.value - one.value;
    let u = -one.value / change;
    let v = 1.0 - u;
    one.t + u * (u * (1.0 + 2.0 * v) * (other.t - one.t) + v * change * (v / one.slope - u / other.slope))
}

#[cfg(test)]
mod tests {
    use super::FallingLimit;
    use crate::event::Work;
    use crate::event::end_of_stick::Side;
    use crate::flow::exact::Stick;
    use crate::law::declaration::Parameters;
    use crate::law::{BogaczRyczek, ForceRate, Friction, Law, Rest};
    use crate::watch::Watched;

    /// Against the margin at many times: it is zero where adhesion breaks, and nowhere less before.
    fn agrees<const H: usize>(stick: &Stick<H>, law: &Law) -> bool {
        let (mut work, mut yes) = (Work::default(), || true);
        let horizon = 20.0;
        let end = FallingLimit::new(stick, law, Side::EITHER, &mut Watched::new(&mut work, &mut yes))
            .first(horizon);
        let margin = |t: f64| {
            let (force, rate, _) = stick.at(t);
            law.static_limit(Rest::new(t, rate.abs())) - force.abs()
        };
        if margin(0.0) <= 0.0 {
            return end == Some(0.0);
        }
        let last = end.unwrap_or(horizon);
        let least = (0..4000)
            .map(|i| margin(last * f64::from(i) / 4000.0))
            .fold(f64::MAX, f64::min);
        assert!(least > -1e-12, "{least} before {end:?} of {stick:?}");
        assert!(
            end.is_none_or(|t| margin(t).abs() < 1e-13),
            "{end:?} of {stick:?}"
        );
        end.is_some()
    }

    #[test]
    fn adhesion_breaks_first_where_the_margin_is_zero() {
        let laws: [Law; 2] = [BogaczRyczek::default().into(), ForceRate::example().into()];
        let mut broken = 0;
        for i in 0..2000_u32 {
            // Numbers that fill a cube evenly.
            let share = |k: u32| (f64::from(i) * f64::from(k).sqrt()).fract();
            let (start, rate) = (0.6 * share(2) - 0.3, 0.6 * share(3) - 0.3);
            let (first, second) = (0.2 + 2.0 * share(5), 0.2 + 5.0 * share(6));
            let [p, q, r, s] = [7, 10, 11, 13].map(|k| 0.3 * share(k) - 0.15);
            let law = &laws[usize::from(i % 2 == 1)];
            broken += u32::from(agrees(
                &Stick {
                    frequency: [first],
                    start,
                    rate,
                    p: [p],
                    q: [q],
                },
                law,
            ));
            let (frequency, p, q) = ([first, second], [p, r], [q, s]);
            broken += u32::from(agrees(
                &Stick {
                    frequency,
                    start,
                    rate,
                    p,
                    q,
                },
                law,
            ));
        }
        assert!(broken > 1000, "{broken}");
    }
}
