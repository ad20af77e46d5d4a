//! One mode in some lanes, adhesion or slip: the state at its end, and in which lanes that was found.

use stickslip_lanes::{Lane, Mask};

use super::lane_oscillator::{Constants, Line, STEP_HALVINGS, State, Step, Track};
use super::{slip, stick};

/// The line of friction that each lane is on, and the steps along it.
pub(super) struct CurrentLine<L> {
    pub(super) line: Line<L>,
    pub(super) steps: [Step<L>; STEP_HALVINGS + 1],
}

impl<L: Lane> CurrentLine<L> {
    pub(super) fn splat(track: &Track) -> Self {
        Self {
            line: Line::splat(&track.line),
            steps: track.steps.each_ref().map(Step::splat),
        }
    }

    /// Write lane `i`.
    pub(super) fn put(&mut self, i: usize, track: &Track) {
        self.line.put(i, &track.line);
        for (step, one) in self.steps.iter_mut().zip(&track.steps) {
            step.put(i, one);
        }
    }
}

/// What became of the modes of some lanes.
pub(super) struct Outcome<L: Lane> {
    /// Lanes whose mode ended: they are at the next one.
    pub(super) at_event: L::Mask,
    /// Lanes whose mode lasts to the horizon.
    pub(super) at_horizon: L::Mask,
    /// Lanes whose mode ends as the engine of single motions will find.
    pub(super) unsettled: L::Mask,
    /// Friction at the event, the stick time and the force rate, of which there are some at a release only.
    pub(super) event: [L; 3],
    /// Exact evaluations.
    pub(super) evaluations: u64,
}

/// Adhesion in some lanes, until it breaks or to a horizon.
#[inline(always)]
pub(super) fn break_away<L: Lane>(
    c: &Constants<L>,
    state: &mut State<L>,
    horizon: L,
    stuck: L::Mask,
) -> Outcome<L> {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let known = stuck & c.growth.below(L::splat(f64::INFINITY));
    let release = if known.any() {
        stick::release(c, state, known)
    } else {
        stick::Release::unknown()
    };
    let up = stuck & release.end.found & horizon.at_most(release.end.lasted);
    let go = release.end.found & !up;
    state.go_to(go, &release.end, c.drive);
    state.direction = L::choose(go, release.direction, state.direction);
    let at_reversal = L::choose(release.limit.at_most(c.offset), one, zero);
    state.at_reversal = L::choose(go, at_reversal, state.at_reversal);
    state.line = L::choose(go, zero, state.line);
    state.stuck = L::choose(go, zero, state.stuck);
    state.events = L::choose(go, state.events + one, state.events);
    let rate = release.direction * (c.rise + c.force * c.frequency * state.sin);
    Outcome {
        at_event: go,
        at_horizon: up,
        unsettled: stuck & !release.end.found,
        event: [release.direction * release.limit, release.end.lasted, rate],
        evaluations: release.evaluations,
    }
}

/// Slip in some lanes, until it ends or to a horizon.
#[inline(always)]
pub(super) fn arrive<L: Lane>(
    c: &Constants<L>,
    current: &CurrentLine<L>,
    state: &mut State<L>,
    horizon: L,
    slips: L::Mask,
) -> Outcome<L> {
    let (zero, one, none) = (L::splat(0.0), L::splat(1.0), L::splat(f64::NAN));
    let arrival = slip::arrival(c, &current.line, &current.steps, state, horizon, slips);
    let up = slips & (arrival.lasts | (arrival.end.found & horizon.at_most(arrival.end.lasted)));
    let go = arrival.end.found & !up;
    let node = go & zero.below(arrival.speed);
    let holding = c.stiffness * arrival.end.x + c.damper * c.drive - c.force * arrival.end.cos;
    let pull = (state.direction * holding).min(c.offset);
    let sticks = pull.abs().at_most(c.static_limit);
    state.go_to(go, &arrival.end, c.drive - state.direction * arrival.speed);
    let force = state.direction * (current.line.offset + current.line.slope * arrival.speed);
    let backwards = L::choose(pull.below(zero), -state.direction, state.direction);
    state.direction = L::choose(go & !sticks & !node, backwards, state.direction);
    let at_reversal = L::choose(pull.abs().at_most(c.offset) & !node, one, zero);
    state.at_reversal = L::choose(go, at_reversal, state.at_reversal);
    let next = L::choose(arrival.high, state.line + one, state.line - one);
    state.line = L::choose(node, next, state.line);
    state.stuck = L::choose(go & sticks & !node, one, state.stuck);
    state.events = L::choose(go, state.events + one, state.events);
    Outcome {
        at_event: go,
        at_horizon: up,
        unsettled: slips & !arrival.end.found & !up,
        event: [force, none, none],
        evaluations: arrival.evaluations,
    }
}
