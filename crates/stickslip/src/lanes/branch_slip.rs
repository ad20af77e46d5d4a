//! Slip between branches in lanes: when the slip acceleration changes its sign, or the slip speed comes to an end of its piece.
//!
//! Of a piece that a turn of the slip speed ends, the speed only rises or only falls: as long as the enclosure of the slip
//! acceleration says so of a cell, the speed has passed the end ahead if and only if the sample at the end of the cell has. A
//! piece that no turn ends has two ends, and so has a slip that is held: there the quantity between the ends is friction,
//! which moves as a slip without a free part would, by a straight line and the wave of the force. So both go side by side.
//!
//! What differs from `slip.rs` beside this: pieces come one after the other without end, so their numbers are computed here, in
//! the lanes, and not kept.

use stickslip_lanes::{Lane, Mask};

use super::branches::LanePiece;
use super::elementary::{exp, reversed, sin_cos};
use super::eligible::{NEAREST_EXPONENTS, SHORTEST_LINE};
use super::lane_oscillator::{Constants, End, Line, SAMPLE_REACH, STEP_HALVINGS, State, Step, sixth_power};
use super::slip::{
    MOST_CELLS, MOST_EXACT_EVALUATIONS, Sample, Steps, TAYLOR_DEGREE, expanded, integral, is, least,
    root_of_quintic, to_root, wrapped,
};

/// Lines along which an exponent is beyond this many natural ones are left to the engine of single motions.
const STEEPEST_BRANCH: f64 = 1e3;
/// Along a steep line a cell is made twice as long, so often at the most, where the slip acceleration is so much more than what
/// the enclosure of a longer one leaves open.
const MOST_DOUBLINGS: f64 = 5.0;
const CLEAR_BY_FAR: f64 = 0.05;
/// A friction that moves along a straight line is sampled this far beyond its end, as a part of the way.
const BEYOND_STRAIGHT_END: f64 = 1.0 / 64.0;

/// Where slip ends.
pub(super) struct Ending<L: Lane> {
    pub(super) end: End<L>,
    /// The velocity there.
    pub(super) v: L,
    /// 1 where the slip speed rises or nothing turns, −1 where it falls.
    pub(super) heading: L,
    /// Lanes that come to the end ahead, the high one unless the speed falls; the others turn, or come to the low end.
    pub(super) ahead: L::Mask,
    /// Lanes whose slip lasts to the horizon, or for more cells than are gone in lanes.
    pub(super) lasts: L::Mask,
    /// Exact evaluations.
    pub(super) evaluations: u64,
}

/// What moves between the ends: the slip speed above the low end, or friction above the lower branch.
struct Course<L: Lane> {
    /// Friction, not the slip speed.
    held: L::Mask,
    /// A turn ends it.
    turns: L::Mask,
    /// The free part is the sum of two exponentials; else it is known by its value and its rate.
    apart: L::Mask,
    line: Line<L>,
    /// k/m, or nothing for friction.
    natural_squared: L,
    /// What its value and the derivatives are made of the two numbers by which the free part is known; the first two are whole.
    of_one: [L; 4],
    of_two: [L; 4],
    heading: L,
    rest: L,
    reach: L,
}

/// The value of a quantity and its first three derivatives.
type Four<L> = [L; 4];

impl<L: Lane> Course<L> {
    /// From the free part, and the wave and its rate.
    #[inline(always)]
    fn at(&self, c: &Constants<L>, [one, two]: [L; 2], [wave, slope]: [L; 2]) -> Four<L> {
        let mut d = [
            wave,
            slope,
            -(c.frequency_squared * wave),
            -(c.frequency_squared * slope),
        ];
        for (own, (of_one, of_two)) in d.iter_mut().zip(self.of_one.iter().zip(&self.of_two)) {
            *own = (*of_one * one + *of_two * two) + *own;
        }
        d[0] = self.rest + d[0];
        d
    }

    /// The margin to a turn or the low end, and that to the end ahead.
    #[inline(always)]
    fn margins(&self, d: &Four<L>) -> [Sample<L>; 2] {
        let up = L::splat(0.0).below(self.heading);
        let below = [self.reach - d[0], -d[1], -d[2]];
        let (mut turn, mut ahead) = ([d[0], d[1], d[2]], below);
        // No function of a function, which a compiler might leave out of the code for the width.
        for k in 0..3 {
            turn[k] = L::choose(self.turns, self.heading * d[k + 1], d[k]);
            ahead[k] = L::choose(up, below[k], d[k]);
        }
        [Sample(turn), Sample(ahead)]
    }

    /// The two functions that the free part is made of, after a time.
    #[inline(always)]
    fn basis(&self, at: L) -> (L, L) {
        let slow = exp(-(self.line.slow * at));
        let (sin, cos) = sin_cos(self.line.omega * at);
        let (one, two) = (slow * cos, slow * sin * self.line.per_omega);
        if !self.apart.any() {
            return (one, L::choose(self.held, at, two));
        }
        let fast = exp(-(self.line.fast * at));
        (one, L::choose(self.held, at, L::choose(self.apart, fast, two)))
    }

    #[inline(always)]
    fn step(&self, c: &Constants<L>, h: L) -> Step<L> {
        let (one, two) = self.basis(h);
        let step = Step::over(c, &self.line, self.natural_squared, (one, two), h);
        let zero = L::splat(0.0);
        Step {
            f11: L::choose(self.apart, one, step.f11),
            f12: L::choose(self.apart, zero, step.f12),
            f21: L::choose(self.apart, zero, step.f21),
            f22: L::choose(self.apart, two, step.f22),
            ..step
        }
    }
}

impl<L: Lane> Step<L> {
    /// Twice as long.
    #[inline(always)]
    fn twice(&self) -> Self {
        let n = L::splat;
        let cross = self.f12 * self.f21;
        let trace = self.f11 + self.f22;
        let sines = self.sin_over * self.sin_times;
        Self {
            f11: self.f11 * self.f11 + cross,
            f12: self.f12 * trace,
            f21: self.f21 * trace,
            f22: self.f22 * self.f22 + cross,
            cos: self.cos * self.cos - sines,
            sin_over: n(2.0) * self.cos * self.sin_over,
            sin_times: n(2.0) * self.cos * self.sin_times,
            h: n(2.0) * self.h,
            slack: n(64.0) * self.growth * self.slack,
            growth: self.growth * self.growth,
        }
    }
}

/// −1 below zero, else 1.
#[inline(always)]
fn sign_of<L: Lane>(x: L) -> L {
    L::choose(x.below(L::splat(0.0)), L::splat(-1.0), L::splat(1.0))
}

#[inline(always)]
pub(super) fn ending<L: Lane>(
    c: &Constants<L>,
    piece: &LanePiece<L>,
    state: &State<L>,
    horizon: L,
    slips: L::Mask,
) -> Ending<L> {
    let n = L::splat;
    let (zero, one) = (n(0.0), n(1.0));
    let sign = state.direction;
    let (held, turns) = (zero.below(piece.held), zero.below(piece.turns));
    let (starts_low, starts_high) = (zero.below(piece.start), piece.start.below(zero));
    let (mut line, exponent) = Line::of(c, piece.mass, [piece.offset, piece.slope, piece.low, piece.high]);
    let natural = c.natural_squared.sqrt();
    let goes = (n(NEAREST_EXPONENTS) * natural).below(line.omega)
        & exponent.below(n(STEEPEST_BRANCH) * natural)
        & (n(SHORTEST_LINE) * c.drive.max(piece.low)).below(line.reach);
    let mut active = slips & (held | goes);
    // Under heavy damping, or as much of its opposite, the free part is the sum of a slow and a fast exponential: what it would
    // be of its value and rate is a small difference of large numbers.
    let apart = zero.below(line.fast.abs()) & !held;
    let fast = line.gamma + sign_of(line.gamma) * line.omega;
    let slow = c.natural_squared / fast;
    line.slow = L::choose(apart, slow, line.slow);
    line.fast = L::choose(apart, fast, zero);
    line.omega = L::choose(apart, zero, line.omega);
    // Friction that holds a slip has no free part but a straight line; the force itself is its wave.
    let cube = c.frequency_squared * c.frequency_squared * c.frequency_squared;
    for (own, other) in [
        (&mut line.gamma, zero),
        (&mut line.twice_gamma, zero),
        (&mut line.omega, zero),
        (&mut line.per_omega, zero),
        (&mut line.slow, zero),
        (&mut line.power, zero),
        (&mut line.power_per_omega, zero),
        (&mut line.within, zero),
        (&mut line.behind, c.force * c.per_frequency),
        (&mut line.swing, c.force),
        (&mut line.sixth, c.force * cube),
    ] {
        *own = L::choose(held, other, *own);
    }
    let natural_squared = L::choose(held, zero, c.natural_squared);
    // The exponents, where they are apart.
    let (e1, e2) = (-slow, -fast);
    let jerk = line.twice_gamma * line.twice_gamma - natural_squared;
    let of_one = [
        one,
        L::choose(apart, e1, zero),
        L::choose(apart, e1 * e1, -natural_squared),
        L::choose(apart, e1 * e1 * e1, line.twice_gamma * natural_squared),
    ];
    let of_two = [
        L::choose(apart, one, zero),
        L::choose(apart, e2, one),
        L::choose(apart, e2 * e2, -line.twice_gamma),
        L::choose(apart, e2 * e2 * e2, jerk),
    ];
    let wave = line.within * state.cos + line.behind * state.sin;
    let wave_rate = c.frequency * (line.behind * state.cos - line.within * state.sin);
    let centre = line.rest + sign * line.lag;
    let (y, z) = (state.x - centre - wave, state.v - wave_rate);
    let spring = c.stiffness * state.x + c.damper * state.v;
    let mut course = Course {
        held,
        turns,
        apart,
        natural_squared,
        of_one,
        of_two,
        heading: one,
        rest: sign * L::choose(held, spring, c.drive) - piece.low,
        reach: line.reach,
        line,
    };
    let line = &course.line;
    let value0 = L::choose(held, zero, -(sign * z));
    let turned = sign * (line.twice_gamma * z + c.natural_squared * y);
    let mut rate0 = L::choose(held, sign * c.stiffness * state.v, turned);
    let (mut wave_value, mut wave_slope) = (-(sign * wave_rate), sign * c.frequency_squared * wave);
    // Sizes of what is summed up, and what of that may be rounding.
    let ends = piece.low.abs() + L::choose(held, spring.abs() + piece.high.abs(), c.drive);
    let width = e1 - e2;
    let size_of_rate = L::choose(
        held,
        rate0.abs(),
        line.twice_gamma.abs() * (state.v.abs() + line.swing)
            + c.natural_squared * (state.x.abs() + centre.abs() + line.swing * c.per_frequency),
    ) + line.swing * c.frequency;
    let rate_rounding = size_of_rate * n(8.0 * f64::EPSILON);
    // What is known to be zero is zero: the rate of the free part makes up for the wave.
    let rate = rate0 + wave_slope;
    let inward = (starts_low & rate.at_most(zero)) | (starts_high & zero.at_most(rate));
    let flat = zero.below(state.at_reversal) | (turns & inward);
    rate0 = L::choose(flat, -wave_slope, rate0);
    let height = rate0 + line.gamma * value0;
    let first = L::choose(apart, (rate0 - e2 * value0) / width, value0);
    let second = L::choose(apart, (e1 * value0 - rate0) / width, rate0);
    let swing = L::choose(apart, second, height * line.per_omega).abs();
    let mut rounding = (first.abs() + swing + line.swing + ends) * n(8.0 * f64::EPSILON);
    let (mut value, mut rate) = (first, second);
    let mut start = course.at(c, [value, rate], [wave_value, wave_slope]);
    start[1] = L::choose(flat, zero, start[1]);
    let led = L::choose(flat, start[2], start[1]);
    let known = starts_low | starts_high;
    let own = L::choose(starts_low, one, L::choose(starts_high, -one, sign_of(led)));
    course.heading = L::choose(turns, own, one);
    active = active & (!turns | known | L::choose(flat, zero, rate_rounding).below(led.abs()));
    // Where the motion is exactly at an end, and for friction the end is where it is.
    let at_low = L::choose(held, piece.start, zero);
    let (shifts_low, shifts_high) = (zero.below(at_low), at_low.below(zero));
    let off = L::choose(shifts_low, start[0], zero);
    course.rest = course.rest - off;
    course.reach = L::choose(shifts_high, start[0], course.reach - off);
    let is_low = is(state.v, c.drive - sign * piece.low) & !held;
    let is_high = is(state.v, c.drive - sign * piece.high) & !held;
    start[0] = L::choose(shifts_low | is_low, zero, start[0]);
    start[0] = L::choose(is_high, course.reach, start[0]);
    let course = &course;
    let line = &course.line;
    let [mut turn, mut ahead] = course.margins(&start);
    // A motion that is at the end ahead already goes nowhere.
    active = active & (!turns | zero.below(ahead.0[0]));
    let fastest = L::choose(held, c.frequency, exponent.max(c.frequency));
    let mut h = n(SAMPLE_REACH) / fastest;
    // A straight line ends where it can be told.
    let straight = held & !zero.below(c.force);
    if straight.any() {
        let way = L::choose(zero.below(rate0), course.reach - start[0], start[0]);
        let lasts = way / rate0.abs() * n(1.0 + BEYOND_STRAIGHT_END);
        let reasonable = lasts.max(n(1e-3) * h).min(n(1e3) * h);
        h = L::choose(straight & reasonable.at_most(n(1e3) * h), reasonable, h);
    }
    let mut step = course.step(c, h);
    let is_growing = (active & one.below(step.growth)).any();
    let free = L::choose(
        apart,
        first.abs() * sixth_power(e1) + second.abs() * line.power,
        (first.abs() + swing) * line.power,
    );
    let mut sixth = free + line.sixth;
    let fades = apart & zero.below(fast) & turns;
    let can_fade = (active & fades).any();
    let mut seventh = L::choose(turns, exponent * free + c.frequency * line.sixth, sixth);
    let mut gone = zero;
    let mut level = zero;
    let (mut right_turn, mut right_ahead) = (turn, ahead);
    let mut crossed = L::Mask::none();
    let mut is_ahead = L::Mask::none();
    let mut lasts = L::Mask::none();
    // A cell that starts on zero may be clear within rounding; what follows must be clear by more than what rounding adds up to.
    let mut turn_rounding = L::choose(turns, rate_rounding, rounding);
    let (mut least_ahead, mut drift_ahead) = (-rounding, rounding);
    let (mut least_turn, mut drift_turn) = (-turn_rounding, turn_rounding);
    for _ in 0..MOST_CELLS {
        let next_value = step.f11 * value + step.f12 * rate;
        let next_rate = step.f21 * value + step.f22 * rate;
        let next_wave = wave_value * step.cos + wave_slope * step.sin_over;
        let next_slope = wave_slope * step.cos - wave_value * step.sin_times;
        let [next_turn, next_ahead] =
            course.margins(&course.at(c, [next_value, next_rate], [next_wave, next_slope]));
        let beyond_turn = next_turn.0[0].below(-drift_turn);
        let beyond_ahead = next_ahead.0[0].below(L::choose(turns, zero, -drift_ahead));
        let clear_turn = least_turn.at_most(least(turn, next_turn, step.h, step.slack * seventh));
        let clear_ahead = least_ahead.at_most(least(ahead, next_ahead, step.h, step.slack * sixth));
        let to_turn = active & beyond_turn & !beyond_ahead & clear_ahead;
        let to_ahead = active & beyond_ahead & !beyond_turn & clear_turn;
        let on = active & !beyond_turn & !beyond_ahead & clear_turn & (turns | clear_ahead);
        let ends = to_turn | to_ahead;
        let closer = active & !ends & !on & level.below(n(STEP_HALVINGS as f64));
        right_turn.become_where(ends, next_turn);
        right_ahead.become_where(ends, next_ahead);
        is_ahead = is_ahead | to_ahead;
        crossed = crossed | ends;
        value = L::choose(on, next_value, value);
        rate = L::choose(on, next_rate, rate);
        wave_value = L::choose(on, next_wave, wave_value);
        wave_slope = L::choose(on, next_slope, wave_slope);
        turn.become_where(on, next_turn);
        ahead.become_where(on, next_ahead);
        gone = L::choose(on, gone + step.h, gone);
        if is_growing {
            // Rounding grows with the motion.
            for grows in [
                &mut rounding,
                &mut turn_rounding,
                &mut sixth,
                &mut seventh,
                &mut drift_ahead,
                &mut drift_turn,
            ] {
                *grows = L::choose(on, *grows * step.growth, *grows);
            }
        }
        drift_ahead = L::choose(on, drift_ahead + rounding, drift_ahead);
        drift_turn = L::choose(on, drift_turn + turn_rounding, drift_turn);
        least_ahead = L::choose(on, drift_ahead, least_ahead);
        least_turn = L::choose(on, drift_turn, least_turn);
        lasts = lasts | (on & horizon.at_most(gone));
        if can_fade {
            // Cells grow where the fast part of the motion has faded.
            let [slower, faster] = [value.abs() * sixth_power(e1), rate.abs() * line.power];
            let fading = on & fades;
            sixth = L::choose(fading, slower + faster + line.sixth, sixth);
            let next = e1.abs() * slower + exponent * faster + c.frequency * line.sixth;
            seventh = L::choose(fading, next, seventh);
            let clear = (n(64.0) * step.slack * seventh).below(n(CLEAR_BY_FAR) * turn.0[0]);
            let longer = fading & clear & n(-MOST_DOUBLINGS).below(level);
            if longer.any() {
                level = L::choose(longer, level - one, level);
                step = step.or(longer, &step.twice());
            }
        }
        if closer.any() {
            level = L::choose(closer, level + one, level);
            step = step.or(closer, &course.step(c, n(0.5) * step.h));
        }
        active = on & gone.below(horizon) | closer;
        if !active.any() {
            break;
        }
    }
    let mut ending = Ending {
        end: End::unknown(),
        v: state.v,
        heading: course.heading,
        ahead: is_ahead,
        // Along a steep line so many cells are a short time.
        lasts: lasts | (active & level.at_most(zero) & !apart),
        evaluations: 0,
    };
    if is_growing {
        for grows in [&mut rounding, &mut turn_rounding, &mut sixth, &mut seventh] {
            *grows = *grows * step.growth;
        }
    }
    // From here on the margin that ends it.
    turn.become_where(is_ahead, ahead);
    right_turn.become_where(is_ahead, right_ahead);
    let (left, right) = (turn, right_turn);
    let by_turn = turns & !is_ahead;
    let rounding = L::choose(is_ahead, rounding, turn_rounding);
    let sixth = L::choose(is_ahead, sixth, seventh);
    let falls = is_ahead & zero.below(course.heading);
    let d = step.h;
    let mut at = gone + root_of_quintic(left.0, right.0, d) * d;
    let (mut early, mut late) = (gone, gone + d);
    let mut open = crossed;
    // Of the two functions: the value, its rate, and the position.
    let of_value = [first, L::choose(apart, second, height)];
    let of_rate = [
        L::choose(apart, e1 * first, rate0),
        L::choose(
            apart,
            e2 * second,
            -(natural_squared * value0 + line.gamma * rate0),
        ),
    ];
    let of_position = [
        L::choose(apart, -(sign * first / e1), y),
        L::choose(apart, -(sign * second / e2), z + line.gamma * y),
    ];
    for _ in 0..MOST_EXACT_EVALUATIONS {
        if !open.any() {
            break;
        }
        ending.evaluations += 1;
        let (first, second) = course.basis(at);
        let (periods, t) = wrapped(c, state.t, at);
        let (wave_sin, wave_cos) = sin_cos(c.frequency * t);
        // One derivative more than those of the margin.
        let mut g = [of_value[0] * first + of_value[1] * second; TAYLOR_DEGREE + 2];
        g[1] = of_rate[0] * first + of_rate[1] * second;
        let mut wave = g;
        wave[0] = -(sign * c.frequency * (line.behind * wave_cos - line.within * wave_sin));
        wave[1] = sign * c.frequency_squared * (line.within * wave_cos + line.behind * wave_sin);
        for k in 2..TAYLOR_DEGREE + 2 {
            g[k] = -(line.twice_gamma * g[k - 1]) - course.natural_squared * g[k - 2];
            wave[k] = -(c.frequency_squared * wave[k - 2]);
        }
        for (own, wave) in g.iter_mut().zip(wave) {
            *own = *own + wave;
        }
        g[0] = course.rest + g[0];
        let mut margin = [zero; TAYLOR_DEGREE + 1];
        for k in 0..=TAYLOR_DEGREE {
            let along = L::choose(falls, -g[k], g[k]);
            margin[k] = L::choose(by_turn, course.heading * g[k + 1], along);
        }
        margin[0] = L::choose(falls, course.reach + margin[0], margin[0]);
        let Steps {
            first: step,
            second: last,
            remains,
            slope,
            curvature,
        } = to_root(&margin);
        let by = step + last;
        let span = (at + by) - gone;
        let near = step.abs().below(n(0.02) * d) & last.abs().below(n(2e-6) * d) & zero.below(span);
        let cube = span * span * span;
        let lowest = least(
            left,
            Sample([zero, slope, curvature]),
            span,
            cube * cube * n(1.0 / 14_400.0) * sixth,
        );
        let sure = (-rounding).at_most(lowest)
            & remains.abs().at_most(rounding)
            & slope.below(zero)
            & (n(2.0) * curvature * rounding).below(slope * slope);
        let take = open & near & sure;
        let along = g.first_chunk().expect("one derivative more");
        let travel = integral(along, by);
        let x = of_position[0] * first
            + of_position[1] * second
            + centre
            + (line.within * wave_cos + line.behind * wave_sin)
            + (c.drive - sign * piece.low) * by
            - sign * travel;
        let lasted = at + by;
        ending.end.lasted = L::choose(take, lasted, ending.end.lasted);
        ending.end.x = L::choose(take, L::choose(held, state.x + state.v * lasted, x), ending.end.x);
        let speed = L::choose(falls, piece.high, piece.low);
        let speed = L::choose(by_turn, piece.low + expanded(along, by)[0], speed);
        ending.v = L::choose(take & !held, c.drive - sign * speed, ending.v);
        let (more, t) = wrapped(c, t, by);
        ending.end.periods = L::choose(take, periods + more, ending.end.periods);
        ending.end.t = L::choose(take, t, ending.end.t);
        let (wave_cos, wave_sin) = reversed((wave_cos, wave_sin), c.frequency * by);
        ending.end.cos = L::choose(take, wave_cos, ending.end.cos);
        ending.end.sin = L::choose(take, wave_sin, ending.end.sin);
        ending.end.found = ending.end.found | take;
        // What is near and not sure will not be any surer.
        open = open & !near;
        let beyond = margin[0].below(zero);
        late = L::choose(beyond, at, late);
        early = L::choose(beyond, early, at);
        let next = at + step;
        let inside = early.below(next) & next.below(late) & margin[1].below(zero);
        at = L::choose(inside, next, n(0.5) * (early + late));
    }
    ending
}
