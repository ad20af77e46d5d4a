//! Slip along a smooth curve of friction in lanes: when the slip speed comes back to zero.
//!
//! Taylor steps, as those of one mass in [`crate::network`]: a step ends where its last terms are no longer below rounding, or
//! where the curve and its series no longer agree. Along a step no root is passed over, as a bound of the curvature says how far
//! the slip speed stays above zero. What is not clear within rounding is left to the engine of single motions.

use stickslip_lanes::{Lane, Mask};

use super::curve::{CURVE_ORDER, CurveNumbers, Expansion, Form, LaneSeries, StepStart, in_fours};
use super::elementary::sin_cos;
use super::lane_oscillator::{Constants, End, State};
use super::slip::{Arrival, wrapped};
use crate::engine::steps::Track;
use crate::series::{CURVATURES, POWERS, ZERO};

/// The last terms of a step may be this large compared with the motion.
const NEGLIGIBLE_TERM: f64 = 5e-17;
/// The longest step, in units of the time in which the motion changes.
const LONGEST_STEP: f64 = 4.0;
/// A shorter one is left to the engine of single motions.
const SHORTEST_STEP: f64 = 1e-6;
/// So many steps; a slip that lasts longer is left where it is.
const MOST_STEPS: usize = 4096;
/// So many where they are shown, as each that is kept takes much room.
const MOST_SHOWN_STEPS: usize = 128;
/// Within a step a curve and its series may differ by as much as changes the speed by this share.
const SERIES_AGREES: f64 = 1e-14;
/// They are compared at so many slip speeds at the most.
const MOST_COMPARISONS: usize = 64;
/// Slip speeds below this share of the largest speed of the motion are zero within rounding.
const SPEED_ROUNDING: f64 = 16.0 * f64::EPSILON;
/// So many approaches to a root.
const MOST_APPROACHES: usize = 48;
/// The root is refined by Newton's method from where the slip speed is this share of its size.
const NEAR: f64 = 1e-8;
/// A motion this much faster than at its start may run away, which the engine of single motions tells.
pub(super) const RUNAWAY_RATIO: f64 = 1e6;

/// r^(1/27) from square roots, from below for r < 1: all that is asked of it is the length of a step.
#[inline(always)]
fn last_root<L: Lane>(r: L) -> L {
    const { assert!(CURVE_ORDER == 28) };
    // 1/27 is a little less than 2⁻⁵ + 2⁻⁸ + 2⁻⁹.
    let coarse = r.sqrt().sqrt().sqrt().sqrt().sqrt();
    let fine = coarse.sqrt().sqrt().sqrt();
    coarse * fine * fine.sqrt()
}

/// The size of the coefficients `k`, as a velocity.
#[inline(always)]
fn size<L: Lane>(series: &Expansion<L>, k: usize, rate: L) -> L {
    (series.x[k].abs() * rate).max(series.u[k].abs())
}

/// A polynomial and its slope.
#[inline(always)]
fn slope_at<L: Lane>(series: &LaneSeries<L>, h: L) -> [L; 2] {
    let slope = in_fours!(h, i => series[i + 1] * L::splat(POWERS[i + 1]));
    [series[0] + gain(series, h), slope]
}

/// By how much a polynomial is more than at its start.
#[inline(always)]
fn gain<L: Lane>(series: &LaneSeries<L>, h: L) -> L {
    h * in_fours!(h, i => series[i + 1])
}

/// Bounds, up to `h`, of how far a polynomial goes from its start, and of its curvature.
#[inline(always)]
fn bounds<L: Lane>(series: &LaneSeries<L>, h: L) -> [L; 2] {
    let swing = h * in_fours!(h, i => series[i + 1].abs());
    let curvature = in_fours!(h, i => series[(i + 2).min(CURVE_ORDER)].abs() * L::splat(CURVATURES[i]));
    [swing, curvature]
}

/// The positive root of margin + rate τ − curvature τ²/2 ([`crate::series::free_time`]).
#[inline(always)]
fn free_time<L: Lane>(margin: L, rate: L, curvature: L) -> L {
    let (n, zero) = (L::splat, L::splat(0.0));
    let root = (rate * rate + n(2.0) * curvature * margin).sqrt();
    let down = n(2.0) * margin / (root - rate);
    let up = L::choose(zero.below(curvature), (root + rate) / curvature, n(f64::INFINITY));
    L::choose(rate.below(zero), down, L::choose(zero.below(rate), up, down))
}

/// How far a curve and its series agree along a step of length `h`; nothing where they do not.
#[inline(always)]
fn agreed<L: Lane>(
    form: Form,
    numbers: &CurveNumbers<L>,
    (u, force): (&LaneSeries<L>, &LaneSeries<L>),
    (mut h, curvature, bound): (L, L, L),
    slips: L::Mask,
) -> L {
    let (n, zero) = (L::splat, L::splat(0.0));
    let (mut t, mut speed, mut slope) = (zero, u[0], u[1]);
    // Slip that begins may do so below zero, by rounding.
    let mut begun = zero.below(speed);
    let mut open = slips & t.below(h);
    for _ in 0..MOST_COMPARISONS {
        if !open.any() {
            return h;
        }
        let free = free_time(form.resolution(numbers, speed), -slope.abs(), curvature);
        // Where there is no limit to it, it is not a number.
        let next = (t + free).min(h);
        let next = L::choose(next.at_most(h), next, h);
        let [at, rate] = slope_at(u, next);
        let along = force[0] + gain(force, next);
        let off = next * numbers.per_mass * (along - form.force(numbers, at)).abs();
        let agrees = off.at_most(bound);
        h = L::choose(open & !agrees, t + n(0.5) * (next - t), h);
        let on = open & agrees;
        t = L::choose(on, next, t);
        speed = L::choose(on, at, speed);
        slope = L::choose(on, rate, slope);
        begun = begun | (on & zero.below(speed));
        open = open & t.below(h) & (zero.at_most(speed) | !begun);
    }
    // So far they agree.
    L::choose(open, t, h)
}

/// The first zero of the slip speed within a step.
struct Zero<L: Lane> {
    found: L::Mask,
    /// Lanes in which it may be anywhere.
    unclear: L::Mask,
    at: L,
}

/// Where the slip speed is zero for the first time within `h`, but for the `order` zeros at its start.
#[inline(always)]
fn first_zero<L: Lane>(
    u: &LaneSeries<L>,
    mut within: [L; 2],
    order: L,
    (h, rounding): (L, L),
    slips: L::Mask,
) -> Zero<L> {
    let (n, zero) = (L::splat, L::splat(0.0));
    // Without the zeros at its start.
    let (once, twice) = (zero.below(order), n(1.0).below(order));
    let mut g = *u;
    if once.any() {
        for k in 0..=CURVE_ORDER {
            let one = if k < CURVE_ORDER { u[k + 1] } else { zero };
            let two = if k + 1 < CURVE_ORDER { u[k + 2] } else { zero };
            g[k] = L::choose(twice, two, L::choose(once, one, u[k]));
        }
        within = bounds(&g, h);
    }
    let [swing, curvature] = within;
    // What it would be of the slip speed at the end of the step.
    let whole = L::choose(twice, h * h, L::choose(once, h, n(1.0)));
    let bounded = curvature.below(n(f64::INFINITY));
    let unclear = slips & !((n(4.0) * rounding).below(g[0] * whole) & bounded);
    let mut open = slips & !unclear & !swing.below(n(0.999) * g[0]);
    let near_size = n(NEAR) * (g[0] + swing);
    let (mut t, mut near) = (zero, L::Mask::none());
    let (mut value, mut slope) = (g[0], g[1]);
    for _ in 0..MOST_APPROACHES {
        if !open.any() {
            break;
        }
        t = L::choose(open, t + free_time(value, slope, curvature), t);
        let [at, rate] = slope_at(&g, t);
        value = L::choose(open, at, value);
        slope = L::choose(open, rate, slope);
        open = open & t.below(h);
        let here = open & value.at_most(near_size);
        near = near | here;
        open = open & !here;
    }
    let mut zero_at = Zero {
        found: near,
        unclear: unclear | open,
        at: t,
    };
    if !near.any() {
        return zero_at;
    }
    // No slope, no root: whether it touches zero or crosses it is not for lanes to say.
    let steep = slope.below(zero) & (n(8.0) * curvature * (value + near_size)).below(slope * slope);
    for _ in 0..3 {
        zero_at.at = L::choose(near, zero_at.at - value / slope, zero_at.at);
        let [at, rate] = slope_at(&g, zero_at.at);
        (value, slope) = (at, rate);
    }
    let left = value
        * L::choose(
            twice,
            zero_at.at * zero_at.at,
            L::choose(once, zero_at.at, n(1.0)),
        );
    let sure = steep & left.abs().at_most(rounding) & zero.below(zero_at.at);
    zero_at.unclear = zero_at.unclear | (near & !(sure & zero_at.at.below(h)));
    zero_at.found = near & sure & zero_at.at.below(h);
    zero_at
}

/// The motion in lane `i` along a step, in powers of time.
#[inline(always)]
fn track<L: Lane>(along: &Expansion<L>, i: usize, [rate, rounding, direction, drive]: [f64; 4]) -> Track {
    let mut track = Track {
        x: ZERO,
        v: ZERO,
        u: ZERO,
        direction,
        rounding,
        rate,
    };
    let mut power = 1.0;
    for k in 0..=CURVE_ORDER {
        (track.x[k], track.u[k]) = (along.x[k].get(i) * power, along.u[k].get(i) * power);
        track.v[k] = -direction * track.u[k];
        power *= rate;
    }
    track.v[0] += drive;
    track
}

/// Whoever is shown the steps of slip: the lane, how many periods and how much time there were at the start of one, what the motion
/// is along it, and how long it takes.
pub(super) type OnLaneStep<'a> = &'a mut dyn FnMut(usize, (f64, f64), Track, f64);

/// When slip ends. Where it lasts to the horizon, the state is that at the start of the last step.
#[inline(always)]
pub(super) fn arrival<L: Lane>(
    c: &Constants<L>,
    form: Form,
    numbers: &CurveNumbers<L>,
    state: &mut State<L>,
    horizon: L,
    slips: L::Mask,
    mut on_step: Option<OnLaneStep>,
) -> Arrival<L> {
    let (n, zero, one) = (L::splat, L::splat(0.0), L::splat(1.0));
    let sign = state.direction;
    let mut u = sign * (c.drive - state.v);
    let (mut x, mut gone) = (state.x, zero);
    let (mut periods, mut t, mut cos, mut sin) = (zero, state.t, state.cos, state.sin);
    let flat = zero.below(state.at_reversal);
    u = L::choose(flat, zero, u);
    let at_zero = u.at_most(zero) & zero.at_most(u);
    // How many zeros the slip speed has at its start.
    let mut order = L::choose(flat, n(2.0), L::choose(at_zero, one, zero));
    let natural = c.natural_squared.sqrt();
    let mut speed = c.drive.max(state.v.abs()).max(natural * x.abs());
    let most = n(RUNAWAY_RATIO) * state.began;
    let mut arrival = Arrival {
        end: End::unknown(),
        high: L::Mask::none(),
        speed: zero,
        lasts: L::Mask::none(),
        evaluations: 0,
    };
    let mut active = slips;
    let mut h = one;
    let most_steps = if on_step.is_some() {
        MOST_SHOWN_STEPS
    } else {
        MOST_STEPS
    };
    for count in 0..=most_steps {
        if !active.any() {
            break;
        }
        arrival.evaluations += 1;
        let start = StepStart {
            x,
            u,
            direction: sign,
            cos,
            sin,
            flat: one.below(order),
        };
        let series = form.expand(c, numbers, &start);
        speed = speed.max((c.drive - sign * u).abs());
        let negligible = n(NEGLIGIBLE_TERM) * speed;
        // The last two terms, for a step no shorter than the one before.
        let share = negligible
            / (size(&series, CURVE_ORDER - 1, numbers.rate)
                + size(&series, CURVE_ORDER, numbers.rate) * h.max(one));
        let slope = (series.force[1] / series.u[1]).abs();
        let slope = L::choose(slope.below(n(f64::INFINITY)), slope, zero);
        let longest = last_root(share).min(n(LONGEST_STEP) / (one + slope * numbers.per_mass));
        let within = bounds(&series.u, longest);
        let unlike = n(SERIES_AGREES) * speed;
        h = agreed(
            form,
            numbers,
            (&series.u, &series.force),
            (longest, within[1], unlike),
            active,
        );
        let rounding = n(SPEED_ROUNDING) * speed;
        let zero_at = first_zero(&series.u, within, order, (h, rounding), active);
        let usual = n(SHORTEST_STEP).at_most(h) & speed.below(most) & !zero_at.unclear;
        let ends = active & usual & zero_at.found;
        let step = L::choose(ends, zero_at.at, h);
        let after = gone + step * numbers.unit;
        // The horizon is met on the way, or it is the last step that lanes follow: the state stays at its start.
        let mut at_horizon = active & usual;
        if count < most_steps {
            at_horizon = at_horizon & horizon.at_most(after);
        }
        if at_horizon.any() {
            state.x = L::choose(at_horizon, x, state.x);
            state.v = L::choose(at_horizon, c.drive - sign * u, state.v);
            state.periods = L::choose(at_horizon, state.periods + periods, state.periods);
            state.t = L::choose(at_horizon, t, state.t);
            state.cos = L::choose(at_horizon, cos, state.cos);
            state.sin = L::choose(at_horizon, sin, state.sin);
            state.at_reversal = L::choose(at_horizon & order.below(n(1.5)), zero, state.at_reversal);
            arrival.lasts = arrival.lasts | at_horizon;
        }
        let on = active & usual & !at_horizon;
        if let Some(on_step) = &mut on_step {
            for i in (0..L::WIDTH).filter(|&i| on.at(i)) {
                let begin = (state.periods.get(i) + periods.get(i), t.get(i));
                let track = track(
                    &series,
                    i,
                    [numbers.rate, rounding, sign, c.drive].map(|of| of.get(i)),
                );
                on_step(i, begin, track, (step * numbers.unit).get(i));
            }
        }
        x = L::choose(on, x + gain(&series.x, step), x);
        u = L::choose(on, u + gain(&series.u, step), u);
        gone = L::choose(on, after, gone);
        let (more, next) = wrapped(c, t, step * numbers.unit);
        periods = L::choose(on, periods + more, periods);
        t = L::choose(on, next, t);
        (sin, cos) = sin_cos(c.frequency * t);
        order = L::choose(on, zero, order);
        let ends = ends & on;
        arrival.end.found = arrival.end.found | ends;
        arrival.end.lasted = L::choose(ends, gone, arrival.end.lasted);
        arrival.end.periods = L::choose(ends, periods, arrival.end.periods);
        arrival.end.t = L::choose(ends, t, arrival.end.t);
        arrival.end.cos = L::choose(ends, cos, arrival.end.cos);
        arrival.end.sin = L::choose(ends, sin, arrival.end.sin);
        arrival.end.x = L::choose(ends, x, arrival.end.x);
        active = on & !ends;
    }
    arrival
}
