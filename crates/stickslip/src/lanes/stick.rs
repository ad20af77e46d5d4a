//! Adhesion in lanes: when the holding force reaches the static limit.
//!
//! The force k x + k s τ + D s − A cos θ has its extremes at known angles, so it is known in closed form how many periods it
//! stays within its limits and between which extremes it meets one. There it is monotone: the root lies in a bracket, and what
//! the step to it leaves of the margin must be rounding.
//!
//! A limit that grows is not met before that of any earlier time is: from there the limit is raised, until the force rises
//! faster than the limit all the way to where they meet.

use stickslip_lanes::{Lane, Mask};

use super::elementary::{exp, reversed, sin_cos};
use super::lane_oscillator::{Constants, End, State};
use super::slip::wrapped;
use crate::elementary::PI;

/// So many evaluations of the force; then a lane is given to the other search.
const MOST_FORCE_EVALUATIONS: usize = 12;

/// Adhesion for a shorter angle of the force is left to the other search, which knows the stick time to all its digits.
const SHORT_STICK_ANGLE: f64 = 0.01;

/// So often a limit that grows is raised; then a lane is given to the other search.
const MOST_LIMIT_RAISES: usize = 8;
/// So many evaluations where force and limit meet, and how far that may be, as an angle of the force, also before by rounding.
const MEETING_STEPS: usize = 5;
const MEETING_REACH: f64 = 0.1;
const MEETING_ROUNDING: f64 = 1e-12;

/// Where adhesion ends.
pub(super) struct Release<L: Lane> {
    pub(super) end: End<L>,
    pub(super) direction: L,
    /// The static limit there.
    pub(super) limit: L,
    /// Evaluations of the force.
    pub(super) evaluations: u64,
}

impl<L: Lane> Release<L> {
    /// Of no lane yet.
    #[inline(always)]
    pub(super) fn unknown() -> Self {
        Self {
            end: End::unknown(),
            direction: L::splat(1.0),
            limit: L::splat(0.0),
            evaluations: 0,
        }
    }
}

#[inline(always)]
pub(super) fn release<L: Lane>(c: &Constants<L>, state: &State<L>, stuck: L::Mask) -> Release<L> {
    let grows = stuck & L::splat(0.0).below(c.growth);
    let mut release = Release::unknown();
    let (mut limit, mut evaluations) = (c.static_limit, 0);
    for _ in 0..MOST_LIMIT_RAISES {
        release = reaching(c, state, limit, stuck);
        if !grows.any() {
            break;
        }
        evaluations += release.evaluations;
        release.evaluations = evaluations;
        // A lane whose limit is raised no more finds the same each time.
        let reached = release.end.found;
        let [grown, _] = grown(c, release.end.lasted);
        release.end.found = meeting(c, &mut release, reached);
        let open = reached & !release.end.found;
        if !open.any() {
            break;
        }
        limit = L::choose(open, grown, limit);
    }
    release
}

/// The limit after a rest, and its growth.
#[inline(always)]
fn grown<L: Lane>(c: &Constants<L>, rest: L) -> [L; 2] {
    let missing = c.growth * exp(-(c.growth_rate * rest).min(L::splat(700.0)));
    [c.static_limit + (c.growth - missing), c.growth_rate * missing]
}

/// From where the force reaches a limit of earlier to where it meets that of its time, in the lanes of the answer.
#[inline(always)]
fn meeting<L: Lane>(c: &Constants<L>, release: &mut Release<L>, open: L::Mask) -> L::Mask {
    let n = L::splat;
    let (sense, level, rest) = (release.direction, release.limit, release.end.lasted);
    let (cos, sin) = (release.end.cos, release.end.sin);
    let change = c.force * c.frequency;
    let [first, slope] = grown(c, rest);
    let faster = sense * (c.rise + change * sin) - slope;
    let mut by = (first - level) / faster;
    let (mut wave, mut limit, mut left) = ((cos, sin), first, n(0.0));
    for step in 0..MEETING_STEPS {
        wave = reversed((cos, sin), c.frequency * by);
        let [now, slope] = grown(c, rest + by);
        limit = now;
        left = (level - limit) + sense * (c.rise * by + c.force * (cos - wave.0));
        if step + 1 < MEETING_STEPS {
            by = by - left / (sense * (c.rise + change * wave.1) - slope);
        }
    }
    // The rate of the force falls by no more than this on the way, the growth of the limit does not rise.
    let falls = change * c.frequency * by;
    let met = open
        & n(-MEETING_ROUNDING).at_most(c.frequency * by)
        & (c.frequency * by).below(n(MEETING_REACH))
        & falls.below(faster)
        & left.abs().at_most(c.faint);
    release.evaluations += MEETING_STEPS as u64;
    release.limit = limit;
    release.end.lasted = rest + by;
    let (more, t) = wrapped(c, release.end.t, by);
    release.end.periods = release.end.periods + more;
    release.end.t = t;
    (release.end.cos, release.end.sin) = wave;
    release.end.x = position(c, sense * limit, wave.0);
    met
}

/// Where adhesion needs a force, by the cosine of the forcing.
#[inline(always)]
fn position<L: Lane>(c: &Constants<L>, holding: L, cos: L) -> L {
    (holding - c.damper * c.drive + c.force * cos) * c.per_stiffness
}

/// Where the force reaches a limit that stays the same.
#[inline(always)]
fn reaching<L: Lane>(c: &Constants<L>, state: &State<L>, limit: L, stuck: L::Mask) -> Release<L> {
    let n = L::splat;
    let (zero, one) = (n(0.0), n(1.0));
    let (half_turn, turn) = (n(PI.0), n(2.0 * PI.0));
    let start = c.frequency * state.t;
    // Without the wave.
    let base = c.stiffness * state.x + c.damper * c.drive;
    let rate = c.rise_a_radian;
    let monotone = zero.below(c.monotone);
    // The next crest and dip, and their heights.
    let (crest_at, dip_at) = (half_turn + c.early, turn - c.early);
    let crest_at = L::choose(start.below(crest_at), crest_at, crest_at + turn);
    let dip_at = L::choose(start.below(dip_at), dip_at, dip_at + turn);
    let top = base + rate * (crest_at - start) + c.crest;
    let bottom = base + rate * (dip_at - start) - c.crest;
    // So many crests stay below the limit: the next one is above it, the last one below, by more than rounding.
    let missing = limit - top;
    let skipped = (-(-missing * (one / c.rise_a_period)).floor()).max(zero);
    let above = skipped * c.rise_a_period - missing;
    let crest_sure = c.faint.below(above) & (skipped.at_most(zero) | c.faint.below(c.rise_a_period - above));
    let dip_first = dip_at.below(crest_at) | zero.below(skipped);
    let below = bottom + limit;
    let dip_sure = !dip_first | c.faint.below(below.abs());
    let down = below.below(zero) & dip_first & !monotone;
    let (level, sense) = (L::choose(down, -limit, limit), L::choose(down, -one, one));
    // The margin, sense · (force − level), is negative and rises from here to its extreme.
    let end = L::choose(down, dip_at, crest_at + skipped * turn);
    let way = L::choose(
        down,
        half_turn - (c.early + c.early),
        half_turn + (c.early + c.early),
    );
    let wave = c.force * state.cos;
    let mut low = L::choose(
        monotone,
        (start + (limit - c.force - base) / rate).max(start),
        (end - way).max(start),
    );
    let mut high = L::choose(monotone, start + (limit + c.force - base) / rate, end);
    let here = low.at_most(start);
    let margin_low = sense
        * (L::choose(
            here,
            base - wave,
            base + rate * (low - start) - L::choose(monotone, c.force, sense * c.crest),
        ) - level);
    // A first guess: a cubic with the slopes at both ends, of which that at an extreme is zero.
    let slope_low = L::choose(here, sense * (rate + c.force * state.sin), zero);
    let margin_high = sense * (base + rate * (high - start) - level) + c.crest;
    let width = high - low;
    let a1 = slope_low * width;
    let rise = margin_high - margin_low;
    let (a2, a3) = (n(3.0) * rise - (a1 + a1), a1 - (rise + rise));
    let mut share = -(margin_low / rise);
    for _ in 0..2 {
        let value = margin_low + share * (a1 + share * (a2 + share * a3));
        let slope = a1 + share * (a2 + a2 + n(3.0) * share * a3);
        let tried = share - value / slope;
        let inside = zero.below(tried) & tried.below(one);
        share = L::choose(inside, tried, share);
    }
    let straight = start + (limit - base + wave) / (rate + c.force * state.sin);
    let mut at = L::choose(monotone, straight.max(low).min(high), low + share * width);
    let mut open = stuck
        & (monotone | (crest_sure & dip_sure))
        & (sense * (base - wave - level)).below(-c.faint)
        & skipped.below(n(1e6))
        & (high - start).below(n(1e7));
    let mut release = Release {
        direction: sense,
        limit,
        ..Release::unknown()
    };
    for _ in 0..MOST_FORCE_EVALUATIONS {
        if !open.any() {
            break;
        }
        release.evaluations += 1;
        let step = (at - start) * c.per_frequency;
        let (periods, t) = wrapped(c, state.t, step);
        let (sin, cos) = sin_cos(c.frequency * t);
        let wave = c.force * cos;
        let margin = sense * (base + c.rise * step - wave - level);
        let slope = sense * (rate + c.force * sin);
        // Householder's step of the third order, then Halley's, by the angle.
        let newton = -(margin / slope);
        let (curvature, third) = (
            newton * (sense * wave),
            newton * newton * -(sense * c.force * sin),
        );
        let first = newton * (slope + n(0.5) * curvature) / (slope + curvature + third * n(1.0 / 6.0));
        let (cos1, sin1) = reversed((cos, sin), first);
        let margin1 = sense * (base + c.rise * (step + first * c.per_frequency) - c.force * cos1 - level);
        let slope1 = sense * (rate + c.force * sin1);
        let bend1 = sense * c.force * cos1;
        let second = -(margin1 * slope1) / (slope1 * slope1 - n(0.5) * margin1 * bend1);
        let by = first + second;
        let (square, to) = (n(0.5) * second * second, at + by);
        let left = margin1 + second * slope1 + square * bend1;
        let near = first.abs().below(n(0.1)) & second.abs().below(n(3e-6));
        let inside = low.below(to + n(1e-9)) & to.at_most(high + n(1e-9)) & zero.below(slope1);
        // The difference of two angles has few digits where it is small.
        let long = n(SHORT_STICK_ANGLE).below(to - start);
        let take = open & near & inside & left.abs().at_most(c.faint) & long;
        release.end.lasted = L::choose(take, step + by * c.per_frequency, release.end.lasted);
        let (more, t) = wrapped(c, t, by * c.per_frequency);
        release.end.periods = L::choose(take, periods + more, release.end.periods);
        release.end.t = L::choose(take, t, release.end.t);
        release.end.cos = L::choose(take, cos1 - (sin1 * second + cos1 * square), release.end.cos);
        release.end.sin = L::choose(take, sin1 + (cos1 * second - sin1 * square), release.end.sin);
        release.end.found = release.end.found | take;
        open = open & !take;
        low = L::choose(margin.at_most(zero), at.max(low), low);
        high = L::choose(margin.at_most(zero), high, at.min(high));
        let next = at + first;
        let inside = low.below(next) & next.below(high);
        at = L::choose(inside, next, n(0.5) * (low + high));
    }
    release.end.x = position(c, level, release.end.cos);
    release
}
