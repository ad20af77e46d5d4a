//! One mode in some lanes, adhesion or slip: the state at its end, and in which lanes that was found.

use stickslip_lanes::{Lane, Mask};

use super::curve::{CurveNumbers, Form};
use super::curve_slip::OnLaneStep;
use super::lane_oscillator::{Constants, LaneOscillator, Line, STEP_HALVINGS, State, Step};
use super::slip::Arrival;
use super::{curve_slip, slip, stick};
use crate::clock::Clock;
use crate::hybrid_state::HybridState;
use crate::law::Law;
use crate::orbit::{Event, Segment};

/// What the lanes slip along, and what follows where a mode ends.
pub(super) trait SlipPath<L: Lane>: Sized {
    /// That of a line of an oscillator, in every lane.
    fn splat(oscillator: &LaneOscillator, line: f64) -> Self;

    /// Write lane `i`.
    fn put(&mut self, i: usize, oscillator: &LaneOscillator, line: f64);

    /// Lanes whose states are on other lines.
    #[inline(always)]
    fn left_by(&self, _state: &State<L>) -> L::Mask {
        L::Mask::none()
    }

    /// A motion comes into lane `i` at this mode, with this memory; needed where the state does not say them.
    #[inline(always)]
    fn enter(&mut self, _i: usize, _hybrid: &HybridState) {}

    /// The mode in lane `i` is about to be handed over: whether its motion should leave the lanes instead.
    #[inline(always)]
    fn leaves(&mut self, _i: usize) -> bool {
        false
    }

    /// The position, velocity and hybrid state of lane `i`.
    #[inline(always)]
    fn hybrid(&self, _i: usize, oscillator: &LaneOscillator, state: &State<f64>) -> (f64, f64, HybridState) {
        oscillator.hybrid(state)
    }

    /// The event after which lane `i` is, and the mode that follows.
    #[inline(always)]
    fn event_row(
        &self,
        _i: usize,
        oscillator: &LaneOscillator,
        (clock, state): (Clock, &State<f64>),
        event: [f64; 3],
    ) -> (Event, Segment) {
        let event = oscillator.event(clock, state, event);
        (event, oscillator.segment(clock, state))
    }

    /// Adhesion in some lanes, until it breaks or to a horizon.
    #[inline(always)]
    fn break_away(
        &mut self,
        c: &Constants<L>,
        state: &mut State<L>,
        (horizon, stuck): (L, L::Mask),
        _occupants: &[Option<Occupant>],
    ) -> Outcome<L> {
        break_away(c, state, horizon, stuck)
    }

    /// Slip in some lanes, until it ends or to a horizon.
    fn arrive(
        &mut self,
        c: &Constants<L>,
        state: &mut State<L>,
        slips: (L, L::Mask),
        occupants: &[Option<Occupant>],
        on_step: Option<OnLaneStep>,
    ) -> Outcome<L>;
}

/// A path on which every slip ends at one of its speeds.
pub(super) trait Along<L: Lane> {
    /// When slip ends, in some lanes.
    fn arrival(
        &self,
        c: &Constants<L>,
        state: &mut State<L>,
        horizon: L,
        slips: L::Mask,
        on_step: Option<OnLaneStep>,
    ) -> Arrival<L>;

    /// Friction at the slip speed at which it ended.
    fn force(&self, c: &Constants<L>, speed: L) -> L;
}

/// What is in a lane: the number of the motion, its oscillator and its law.
#[derive(Clone)]
pub(super) struct Occupant<'a> {
    pub(super) index: usize,
    pub(super) oscillator: LaneOscillator,
    pub(super) law: &'a Law,
}

/// Lines, curves or branches, whatever the width.
pub(super) trait Kind {
    /// What lanes of some width slip along.
    type Of<L: Lane>: SlipPath<L>;
}

/// Lines of friction.
pub(super) struct Lines;

impl Kind for Lines {
    type Of<L: Lane> = CurrentLine<L>;
}

/// Smooth curves, of the same form in all lanes.
pub(super) struct Curves;

impl Kind for Curves {
    type Of<L: Lane> = CurrentCurve<L>;
}

/// The line of friction that each lane is on, and the steps along it.
pub(super) struct CurrentLine<L> {
    pub(super) line: Line<L>,
    pub(super) steps: [Step<L>; STEP_HALVINGS + 1],
}

impl<L: Lane> SlipPath<L> for CurrentLine<L> {
    #[inline(always)]
    fn splat(oscillator: &LaneOscillator, line: f64) -> Self {
        let track = oscillator.track(line);
        Self {
            line: Line::splat(&track.line),
            steps: track.steps.each_ref().map(Step::splat),
        }
    }

    #[inline(always)]
    fn put(&mut self, i: usize, oscillator: &LaneOscillator, line: f64) {
        let track = oscillator.track(line);
        self.line.put(i, &track.line);
        for (step, one) in self.steps.iter_mut().zip(&track.steps) {
            step.put(i, one);
        }
    }

    #[inline(always)]
    fn left_by(&self, state: &State<L>) -> L::Mask {
        state.line.below(self.line.index) | self.line.index.below(state.line)
    }

    #[inline(always)]
    fn arrive(
        &mut self,
        c: &Constants<L>,
        state: &mut State<L>,
        (horizon, slips): (L, L::Mask),
        _occupants: &[Option<Occupant>],
        on_step: Option<OnLaneStep>,
    ) -> Outcome<L> {
        arrive(c, self, state, horizon, slips, on_step)
    }
}

impl<L: Lane> Along<L> for CurrentLine<L> {
    #[inline(always)]
    fn arrival(
        &self,
        c: &Constants<L>,
        state: &mut State<L>,
        horizon: L,
        slips: L::Mask,
        _on_step: Option<OnLaneStep>,
    ) -> Arrival<L> {
        slip::arrival(c, &self.line, &self.steps, state, horizon, slips)
    }

    #[inline(always)]
    fn force(&self, _c: &Constants<L>, speed: L) -> L {
        self.line.offset + self.line.slope * speed
    }
}

/// The curve of friction of each lane, which has one line for its beginning.
pub(super) struct CurrentCurve<L> {
    form: Form,
    numbers: CurveNumbers<L>,
}

impl<L: Lane> SlipPath<L> for CurrentCurve<L> {
    #[inline(always)]
    fn splat(oscillator: &LaneOscillator, _line: f64) -> Self {
        let (form, numbers) = oscillator.curve.as_ref().expect("an oscillator with a curve");
        Self {
            form: *form,
            numbers: CurveNumbers::splat(numbers),
        }
    }

    #[inline(always)]
    fn put(&mut self, i: usize, oscillator: &LaneOscillator, _line: f64) {
        if let Some((_, numbers)) = &oscillator.curve {
            self.numbers.put(i, numbers);
        }
    }

    #[inline(always)]
    fn arrive(
        &mut self,
        c: &Constants<L>,
        state: &mut State<L>,
        (horizon, slips): (L, L::Mask),
        _occupants: &[Option<Occupant>],
        on_step: Option<OnLaneStep>,
    ) -> Outcome<L> {
        arrive(c, self, state, horizon, slips, on_step)
    }
}

impl<L: Lane> Along<L> for CurrentCurve<L> {
    #[inline(always)]
    fn arrival(
        &self,
        c: &Constants<L>,
        state: &mut State<L>,
        horizon: L,
        slips: L::Mask,
        on_step: Option<OnLaneStep>,
    ) -> Arrival<L> {
        curve_slip::arrival(c, self.form, &self.numbers, state, horizon, slips, on_step)
    }

    #[inline(always)]
    fn force(&self, c: &Constants<L>, _speed: L) -> L {
        c.offset
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
    current: &impl Along<L>,
    state: &mut State<L>,
    horizon: L,
    slips: L::Mask,
    on_step: Option<OnLaneStep>,
) -> Outcome<L> {
    let (zero, one, none) = (L::splat(0.0), L::splat(1.0), L::splat(f64::NAN));
    let arrival = current.arrival(c, state, horizon, slips, on_step);
    let up = slips & (arrival.lasts | (arrival.end.found & horizon.at_most(arrival.end.lasted)));
    let go = arrival.end.found & !up;
    let node = go & zero.below(arrival.speed);
    let holding = c.stiffness * arrival.end.x + c.damper * c.drive - c.force * arrival.end.cos;
    let pull = (state.direction * holding).min(c.offset);
    let sticks = pull.abs().at_most(c.static_limit);
    state.go_to(go, &arrival.end, c.drive - state.direction * arrival.speed);
    let force = state.direction * current.force(c, arrival.speed);
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
