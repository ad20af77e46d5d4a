//! Slip in lanes: when the slip speed leaves the line of friction, at its low end, which may be zero, or at its high one.
//!
//! Samples lie at a constant distance, so the free part advances by one matrix and the harmonic by one rotation, without
//! exponentials or sines on the way. The enclosure of [`crate::flow::enclosure`] says of every cell between two samples that
//! it is clear; doubt halves the distance. Where a sample is beyond zero, the root of the quintic through the last two is where
//! the motion is evaluated exactly; from there the root follows from the Taylor polynomial, what that leaves of the speed must
//! be rounding, and the enclosure up to it says that it is the first.

use stickslip_lanes::{Lane, Mask};

use super::elementary::{exp, reversed, sin_cos};
use super::lane_oscillator::{Constants, End, Line, STEP_HALVINGS, State, Step};

/// So many cells; a slip that lasts longer, by the longest of them, is likely to last for ever. Rounding grows with every cell.
pub(super) const MOST_CELLS: u32 = 256;
/// So many exact evaluations.
pub(super) const MOST_EXACT_EVALUATIONS: usize = 8;
/// Degree of the Taylor polynomial.
pub(super) const TAYLOR_DEGREE: usize = 7;

/// Where slip ends.
pub(super) struct Arrival<L: Lane> {
    pub(super) end: End<L>,
    /// Lanes that would come to the high end, the others to the low one; and the slip speed there.
    pub(super) high: L::Mask,
    pub(super) speed: L,
    /// Lanes whose slip lasts to the horizon, or for more cells than are gone in lanes.
    pub(super) lasts: L::Mask,
    /// Exact evaluations.
    pub(super) evaluations: u64,
}

/// A time within a period and a step from there: the periods that pass, and the time in the last.
#[inline(always)]
pub(super) fn wrapped<L: Lane>(c: &Constants<L>, t: L, step: L) -> (L, L) {
    let n = L::splat;
    let mut periods = ((t + step) * (c.frequency * n(0.5 / crate::elementary::PI.0))).floor();
    let below = rest(c, t, step, periods).below(n(0.0));
    periods = L::choose(below, periods - n(1.0), periods);
    let beyond = (c.period + c.period_low).at_most(rest(c, t, step, periods));
    periods = L::choose(beyond, periods + n(1.0), periods);
    (periods, rest(c, t, step, periods))
}

#[inline(always)]
fn rest<L: Lane>(c: &Constants<L>, t: L, step: L, periods: L) -> L {
    ((t - periods * c.period) + step) - periods * c.period_low
}

/// The curvature of the slip speed from its free part, the rate of that, and the wave.
#[inline(always)]
fn curvature_of<L: Lane>(c: &Constants<L>, line: &Line<L>, value: L, rate: L, wave: L) -> L {
    -(line.twice_gamma * rate) - c.natural_squared * value - c.frequency_squared * wave
}

/// Whether two numbers are the same.
#[inline(always)]
pub(super) fn is<L: Lane>(one: L, other: L) -> L::Mask {
    one.at_most(other) & other.at_most(one)
}

/// How far the slip speed is above the low end of its line, its rate and its curvature.
#[derive(Clone, Copy)]
pub(super) struct Sample<L>(pub(super) [L; 3]);

impl<L: Lane> Sample<L> {
    /// How far it is below the high end.
    #[inline(always)]
    fn below(self, reach: L) -> Self {
        let [value, rate, curvature] = self.0;
        Self([reach - value, -rate, -curvature])
    }

    /// Become another one where the mask says so.
    #[inline(always)]
    pub(super) fn become_where(&mut self, mask: L::Mask, other: Self) {
        for (own, other) in self.0.iter_mut().zip(other.0) {
            *own = L::choose(mask, other, *own);
        }
    }
}

/// The least coefficient of the enclosure of a cell of width `d`, see [`crate::flow::enclosure`]; `slack` is d⁶/14,400 times
/// the bound of the sixth derivative.
#[inline(always)]
pub(super) fn least<L: Lane>(Sample(left): Sample<L>, Sample(right): Sample<L>, d: L, slack: L) -> L {
    let n = L::splat;
    let (sixth, square) = (d * n(1.0 / 6.0), d * d);
    let (up, fall) = (sixth * left[1], sixth * right[1]);
    let (curvature, curl) = (square * left[2], square * right[2]);
    let second = left[0] + (up + up) + curvature * n(1.0 / 30.0);
    let fourth = right[0] - (fall + fall) + curl * n(1.0 / 30.0);
    let middle = n(0.5) * (left[0] + right[0]) + n(1.2) * (up - fall) + n(0.025) * (curvature + curl);
    let (start, end) = (left[0].min(left[0] + up), right[0].min(right[0] - fall));
    start.min(end).min(second.min(fourth).min(middle - slack))
}

/// e^{−γτ} cos ωτ and e^{−γτ} sin ωτ / ω, hyperbolic where slip does not oscillate.
#[inline(always)]
pub(super) fn basis<L: Lane>(line: &Line<L>, at: L) -> (L, L) {
    let (n, zero) = (L::splat, L::splat(0.0));
    let slow = exp(-(line.slow * at));
    let (sin, cos) = sin_cos(line.omega * at);
    let (cos, sin) = (slow * cos, slow * sin * line.per_omega);
    let apart = zero.below(line.fast.abs());
    if !apart.any() {
        return (cos, sin);
    }
    let fast = exp(-(line.fast * at));
    (
        L::choose(apart, n(0.5) * (slow + fast), cos),
        L::choose(apart, n(0.5) * (slow - fast) * line.per_omega, sin),
    )
}

/// Σ d_k τᵏ/k!, its slope and its curvature.
#[inline(always)]
pub(super) fn expanded<L: Lane>(d: &[L; TAYLOR_DEGREE + 1], tau: L) -> [L; 3] {
    let mut sums = [d[TAYLOR_DEGREE]; 3];
    for k in (1..=TAYLOR_DEGREE).rev() {
        for (order, sum) in sums.iter_mut().enumerate() {
            if k > order {
                *sum = d[k - 1] + *sum * (tau * L::splat(1.0 / (k - order) as f64));
            }
        }
    }
    sums
}

/// The way to a root of Σ d_k τᵏ/k! that is near.
pub(super) struct Steps<L> {
    /// Householder's step of the third order, then Halley's on the polynomial.
    pub(super) first: L,
    pub(super) second: L,
    /// What is left after both, and slope and curvature there.
    pub(super) remains: L,
    pub(super) slope: L,
    pub(super) curvature: L,
}

#[inline(always)]
pub(super) fn to_root<L: Lane>(d: &[L; TAYLOR_DEGREE + 1]) -> Steps<L> {
    let n = L::splat;
    let newton = -(d[0] / d[1]);
    let (curvature, third) = (newton * d[2], newton * newton * d[3]);
    let first = newton * (d[1] + n(0.5) * curvature) / (d[1] + curvature + third * n(1.0 / 6.0));
    let [value1, slope1, bend1] = expanded(d, first);
    let second = -(value1 * slope1) / (slope1 * slope1 - n(0.5) * value1 * bend1);
    Steps {
        first,
        second,
        remains: value1 + second * (slope1 + n(0.5) * second * bend1),
        slope: slope1 + second * bend1,
        curvature: bend1 + second * d[3],
    }
}

/// ∫ Σ d_k τᵏ/k! from 0 to `by`.
#[inline(always)]
pub(super) fn integral<L: Lane>(d: &[L; TAYLOR_DEGREE + 1], by: L) -> L {
    let n = L::splat;
    let mut sum = d[TAYLOR_DEGREE] * n(1.0 / (TAYLOR_DEGREE + 1) as f64);
    for k in (0..TAYLOR_DEGREE).rev() {
        sum = (d[k] + by * sum) * n(1.0 / (k + 1) as f64);
    }
    by * sum
}

/// Where in a cell of width `d` the quintic through both samples is zero, as a share of it: positive at its left end, negative
/// at its right.
#[inline(always)]
pub(super) fn root_of_quintic<L: Lane>(left: [L; 3], right: [L; 3], d: L) -> L {
    let n = L::splat;
    let square = d * d;
    let (p0, p1, p2) = (left[0], d * left[1], n(0.5) * square * left[2]);
    let e0 = right[0] - (p0 + p1 + p2);
    let e1 = d * right[1] - (p1 + (p2 + p2));
    let e2 = square * right[2] - (p2 + p2);
    let p3 = n(10.0) * e0 - n(4.0) * e1 + n(0.5) * e2;
    let p4 = n(7.0) * e1 - n(15.0) * e0 - e2;
    let p5 = n(6.0) * e0 - n(3.0) * e1 + n(0.5) * e2;
    let (mut u, mut low, mut high) = (n(1.0), n(0.0), n(1.0));
    for round in 0..3 {
        let value = p0 + u * (p1 + u * (p2 + u * (p3 + u * (p4 + u * p5))));
        let slope = p1 + u * (p2 + p2 + u * (n(3.0) * p3 + u * (n(4.0) * p4 + u * (n(5.0) * p5))));
        let curvature = p2 + p2 + u * (n(6.0) * p3 + u * (n(12.0) * p4 + u * (n(20.0) * p5)));
        if round > 0 {
            let beyond = value.below(n(0.0));
            high = L::choose(beyond, u, high);
            low = L::choose(beyond, low, u);
        }
        let tried = u - (value * slope) / (slope * slope - n(0.5) * value * curvature);
        let inside = low.below(tried) & tried.below(high) & slope.below(n(0.0));
        u = L::choose(inside, tried, n(0.5) * (low + high));
    }
    u
}

#[inline(always)]
pub(super) fn arrival<L: Lane>(
    c: &Constants<L>,
    line: &Line<L>,
    steps: &[Step<L>; STEP_HALVINGS + 1],
    state: &State<L>,
    horizon: L,
    slips: L::Mask,
) -> Arrival<L> {
    let n = L::splat;
    let (zero, one) = (n(0.0), n(1.0));
    let sign = state.direction;
    let wave = line.within * state.cos + line.behind * state.sin;
    let wave_rate = c.frequency * (line.behind * state.cos - line.within * state.sin);
    let centre = line.rest + sign * line.lag;
    let (y, z) = (state.x - centre - wave, state.v - wave_rate);
    let at_reversal = zero.below(state.at_reversal);
    // The slip speed σ (s − ẋ) above the low end: its rest, its free part and the rate of that, its wave and the rate of that.
    let rest = sign * c.drive - line.low;
    let (value0, rate0) = (-(sign * z), sign * (line.twice_gamma * z + c.natural_squared * y));
    let (mut wave_value, mut wave_slope) = (-(sign * wave_rate), sign * c.frequency_squared * wave);
    // What is known to be zero is zero: the rate of the free part makes up for the wave.
    let rate0 = L::choose(at_reversal, -wave_slope, rate0);
    let (mut value, mut rate) = (value0, rate0);
    let height = (rate0 + line.gamma * value0).abs();
    let mut sixth = value0.abs() * line.power + height * line.power_per_omega + line.sixth;
    let size = value0.abs() + height * line.per_omega + line.swing + c.drive + line.low;
    let mut rounding = size * n(8.0 * f64::EPSILON);
    let mut left = Sample([
        L::choose(
            is(state.v, c.drive - sign * line.low),
            zero,
            rest + value + wave_value,
        ),
        L::choose(at_reversal, zero, rate + wave_slope),
        curvature_of(c, line, value, rate, wave_value),
    ]);
    let mut step = steps[0];
    // Only some laws have lines with a high end.
    let bounded = slips & line.reach.below(n(f64::INFINITY));
    let is_bounded = bounded.any();
    if is_bounded {
        left.0[0] = L::choose(
            is(state.v, c.drive - sign * (line.low + line.reach)),
            line.reach,
            left.0[0],
        );
    }
    let is_growing = (slips & one.below(step.growth)).any();
    let mut high = L::Mask::none();
    let mut right = left;
    let mut gone = zero;
    let mut slack = step.slack * sixth;
    let mut level = zero;
    let mut active = slips & !zero.below(line.left);
    let (mut crossed, mut lasts) = (L::Mask::none(), L::Mask::none());
    // A cell that starts on zero may be clear within rounding; what follows must be clear by more than what rounding adds up to.
    let mut least_clear = -rounding;
    let mut drift = rounding;
    for _ in 0..MOST_CELLS {
        let (next_value, next_rate) = (
            step.f11 * value + step.f12 * rate,
            step.f21 * value + step.f22 * rate,
        );
        let next_wave = wave_value * step.cos + wave_slope * step.sin_over;
        let next_slope = wave_slope * step.cos - wave_value * step.sin_times;
        let next = Sample([
            rest + next_value + next_wave,
            next_rate + next_slope,
            curvature_of(c, line, next_value, next_rate, next_wave),
        ]);
        let mut beyond = next.0[0].below(-drift);
        let mut clear = least_clear.at_most(least(left, next, step.h, slack));
        if is_bounded {
            let (one, other) = (left.below(line.reach), next.below(line.reach));
            let above = active & bounded & other.0[0].below(-drift);
            high = high | above;
            beyond = beyond | above;
            clear = clear & (least_clear.at_most(least(one, other, step.h, slack)) | !bounded);
        }
        let clear = clear & !beyond;
        let closer = active & !clear & !beyond & level.below(n(STEP_HALVINGS as f64));
        if closer.any() {
            level = L::choose(closer, level + one, level);
            // By the levels there are: to choose among all steps is to load them all for every slip.
            let mut rest = closer;
            for i in 0..L::WIDTH {
                if rest.at(i) {
                    let own = level.get(i);
                    let here = rest & is(level, n(own));
                    #[expect(
                        clippy::cast_possible_truncation,
                        clippy::cast_sign_loss,
                        reason = "the number of a level is small"
                    )]
                    let shorter = &steps[own as usize];
                    step = step.or(here, shorter);
                    rest = rest & !here;
                }
            }
            slack = step.slack * sixth;
        }
        let ends = active & beyond;
        right.become_where(ends, next);
        crossed = crossed | ends;
        let on = active & clear;
        value = L::choose(on, next_value, value);
        rate = L::choose(on, next_rate, rate);
        wave_value = L::choose(on, next_wave, wave_value);
        wave_slope = L::choose(on, next_slope, wave_slope);
        left.become_where(on, next);
        gone = L::choose(on, gone + step.h, gone);
        if is_growing {
            // Rounding grows with the motion.
            rounding = L::choose(on, rounding * step.growth, rounding);
            sixth = L::choose(on, sixth * step.growth, sixth);
            slack = step.slack * sixth;
            drift = L::choose(on, drift * step.growth, drift);
        }
        drift = L::choose(on, drift + rounding, drift);
        least_clear = L::choose(on, drift, least_clear);
        lasts = lasts | (on & horizon.at_most(gone));
        active = on & gone.below(horizon) | closer;
        if !active.any() {
            break;
        }
    }
    let mut arrival = Arrival {
        end: End::unknown(),
        high,
        speed: L::choose(high, line.low + line.reach, line.low),
        lasts: lasts | (active & level.at_most(zero)),
        evaluations: 0,
    };
    if is_growing {
        rounding = rounding * step.growth;
        sixth = sixth * step.growth;
    }
    let is_high = high.any();
    // From here on the margin to the end that is crossed, and that to the other one beside it.
    let mut other = left;
    if is_bounded {
        other.become_where(!high, left.below(line.reach));
        left.become_where(high, left.below(line.reach));
        right.become_where(high, right.below(line.reach));
    }
    let sense = L::choose(high, -sign, sign);
    let d = step.h;
    let mut at = gone + root_of_quintic(left.0, right.0, d) * d;
    let (mut early, mut late) = (gone, gone + d);
    let mut open = crossed;
    for _ in 0..MOST_EXACT_EVALUATIONS {
        if !open.any() {
            break;
        }
        arrival.evaluations += 1;
        let (cos, sin) = basis(line, at);
        let (periods, t) = wrapped(c, state.t, at);
        let (wave_sin, wave_cos) = sin_cos(c.frequency * t);
        let mut free = [value0 * cos + (rate0 + line.gamma * value0) * sin; TAYLOR_DEGREE + 1];
        free[1] = rate0 * cos - (c.natural_squared * value0 + line.gamma * rate0) * sin;
        let mut wave =
            [-(sign * c.frequency * (line.behind * wave_cos - line.within * wave_sin)); TAYLOR_DEGREE + 1];
        wave[1] = sign * c.frequency_squared * (line.within * wave_cos + line.behind * wave_sin);
        for k in 2..=TAYLOR_DEGREE {
            free[k] = -(line.twice_gamma * free[k - 1]) - c.natural_squared * free[k - 2];
            wave[k] = -(c.frequency_squared * wave[k - 2]);
        }
        let mut g = free;
        for (own, wave) in g.iter_mut().zip(wave) {
            *own = *own + wave;
        }
        g[0] = rest + g[0];
        if is_high {
            for own in &mut g {
                *own = L::choose(high, -*own, *own);
            }
            g[0] = L::choose(high, line.reach + g[0], g[0]);
        }
        let Steps {
            first,
            second,
            remains,
            slope,
            curvature,
        } = to_root(&g);
        let by = first + second;
        let span = (at + by) - gone;
        let near = first.abs().below(n(0.02) * d) & second.abs().below(n(2e-6) * d) & zero.below(span);
        let cube = span * span * span;
        let low_of = least(
            left,
            Sample([zero, slope, curvature]),
            span,
            cube * cube * n(1.0 / 14_400.0) * sixth,
        );
        let mut sure = (-rounding).at_most(low_of)
            & remains.abs().at_most(rounding)
            & slope.below(zero)
            & (n(2.0) * curvature * rounding).below(slope * slope);
        if is_bounded {
            let low_of = least(
                other,
                Sample([line.reach, -slope, -curvature]),
                span,
                cube * cube * n(1.0 / 14_400.0) * sixth,
            );
            sure = sure & ((-rounding).at_most(low_of) | !bounded);
        }
        let take = open & near & sure;
        let travel = integral(&g, by);
        let x =
            y * cos + (z + line.gamma * y) * sin + centre + (line.within * wave_cos + line.behind * wave_sin);
        arrival.end.lasted = L::choose(take, at + by, arrival.end.lasted);
        arrival.end.x = L::choose(
            take,
            x + (c.drive - sign * arrival.speed) * by - sense * travel,
            arrival.end.x,
        );
        let (more, t) = wrapped(c, t, by);
        arrival.end.periods = L::choose(take, periods + more, arrival.end.periods);
        arrival.end.t = L::choose(take, t, arrival.end.t);
        let (wave_cos, wave_sin) = reversed((wave_cos, wave_sin), c.frequency * by);
        arrival.end.cos = L::choose(take, wave_cos, arrival.end.cos);
        arrival.end.sin = L::choose(take, wave_sin, arrival.end.sin);
        arrival.end.found = arrival.end.found | take;
        // What is near and not sure will not be any surer.
        open = open & !near;
        let beyond = g[0].below(zero);
        late = L::choose(beyond, at, late);
        early = L::choose(beyond, early, at);
        let next = at + first;
        let inside = early.below(next) & next.below(late) & g[1].below(zero);
        at = L::choose(inside, next, n(0.5) * (early + late));
    }
    arrival
}
