//! Many oscillators in SIMD lanes: one motion in each lane of the registers of a processor, from mode to mode.
//!
//! A motion goes in a lane where adhesion has a constant limit, friction in slip is one line, at most one harmonic acts, the
//! drive moves forward, and slip oscillates without growing ([`fits`]). Everything else, and every mode whose end the lanes
//! cannot certify, is gone by the engine of single motions; both stand at the begin of a mode, so one goes on from where the
//! other is. A lane asks nothing of its neighbours, and has the same bits in every [`Width`].

mod column;
mod elementary;
mod slip;
mod stick;

pub use stickslip_lanes::Width;
use stickslip_lanes::{Lane, Mask, Single, Task, run};

use crate::mode::Kind;
use crate::model::Running;
use crate::orbit::{Event, Record, Segment};
use crate::oscillator::Oscillator;
use crate::restart::HybridState;
use crate::simulate::{Run, first_hybrid_state, next_event};
use column::{Column, Constants, HALVINGS, State, Step};

/// A motion at the begin of a mode, and how far it goes.
#[derive(Clone, Debug)]
pub struct Runner<'a> {
    /// Its oscillator.
    pub oscillator: &'a Oscillator,
    /// Position.
    pub x: f64,
    /// Velocity.
    pub v: f64,
    /// Time and mode.
    pub hybrid: HybridState,
    /// The motion stops at the last begin of a mode before this time.
    pub t_end: f64,
    /// Or after so many events.
    pub max_events: u64,
    /// Events so far.
    pub events: u64,
}

impl<'a> Runner<'a> {
    /// From the start of a run, or from a hybrid state with the x and v of the run, to its end.
    #[must_use]
    pub fn new(oscillator: &'a Oscillator, run: Run, hybrid: Option<HybridState>) -> Self {
        Self {
            oscillator,
            x: run.x0,
            v: run.v0.unwrap_or(oscillator.drive_velocity),
            hybrid: hybrid.unwrap_or_else(|| first_hybrid_state(oscillator, run)),
            t_end: run.t_end,
            max_events: run.max_events,
            events: 0,
        }
    }
}

/// What motions in lanes have cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Motions that went in lanes.
    pub lanes: u64,
    /// Motions that did not fit.
    pub others: u64,
    /// Events of those that did.
    pub events: u64,
    /// Events whose modes were gone by the engine of single motions.
    pub handed: u64,
}

/// Whether motions of an oscillator go in lanes.
#[must_use]
pub fn fits(oscillator: &Oscillator) -> bool {
    Constants::of(oscillator).is_some()
}

/// Where in a cell of width `d` the quintic through the values, slopes and curvatures at its ends is zero, as a share of it:
/// positive at its left end, negative at its right.
#[inline]
pub(crate) fn root_of_quintic(left: [f64; 3], right: [f64; 3], d: f64) -> f64 {
    slip::root_of_quintic(
        left.map(Single::splat),
        right.map(Single::splat),
        Single::splat(d),
    )
    .get(0)
}

/// Whoever is told of the events, each with the number of its motion.
pub type OnEvent<'a> = &'a mut dyn FnMut(usize, &Event);

/// Bring every motion that fits to the last begin of a mode before its end, as long as `go_on` says so; the others stay.
pub fn forward(
    runners: &mut [Runner],
    width: Width,
    go_on: &mut dyn FnMut() -> bool,
    on_event: Option<OnEvent>,
) -> Tally {
    let going = Going {
        runners,
        go_on,
        on_event,
        next: 0,
        tally: Tally::default(),
    };
    run(going, width)
}

/// Bring many runs of models to the time that each has, in the width that suits their number.
pub(crate) fn forward_all(
    runs: &mut [(Running, f64)],
    go_on: &mut dyn FnMut() -> bool,
    on_event: Option<OnEvent>,
) -> Tally {
    let mut runners: Vec<Runner> = Vec::with_capacity(runs.len());
    let mut indices = Vec::with_capacity(runs.len());
    for (index, (run, t_end)) in runs.iter().enumerate() {
        if let Running::Closed(engine) = run
            && fits(engine.oscillator())
        {
            runners.push(engine.runner(*t_end));
            indices.push(index);
        }
    }
    let width = Width::for_lanes(runners.len());
    let mut tally = match on_event {
        Some(on_event) => {
            let on_event: OnEvent = &mut |index, event| on_event(indices[index], event);
            forward(&mut runners, width, go_on, Some(on_event))
        }
        None => forward(&mut runners, width, go_on, None),
    };
    tally.others += (runs.len() - indices.len()) as u64;
    for (runner, index) in runners.iter().zip(indices) {
        if let Running::Closed(engine) = &mut runs[index].0 {
            engine.take(runner);
        }
    }
    tally
}

/// Motions that wait for a lane.
struct Going<'a, 'b, 'c> {
    runners: &'a mut [Runner<'b>],
    go_on: &'a mut dyn FnMut() -> bool,
    on_event: Option<OnEvent<'c>>,
    next: usize,
    tally: Tally,
}

/// Passes the events of one motion on.
struct Heard<'a, 'b> {
    index: usize,
    go_on: &'a mut dyn FnMut() -> bool,
    on_event: Option<&'a mut OnEvent<'b>>,
}

impl Record for Heard<'_, '_> {
    fn segment(&mut self, _: Segment) {}

    fn event(&mut self, event: Event) {
        if let Some(on_event) = &mut self.on_event {
            on_event(self.index, &event);
        }
    }

    fn go_on(&mut self) -> bool {
        (self.go_on)()
    }
}

impl Going<'_, '_, '_> {
    /// The next motion that fits.
    fn enter(&mut self) -> Option<(usize, Constants, State<f64>)> {
        while let Some(runner) = self.runners.get(self.next) {
            self.next += 1;
            if let Some(constants) = Constants::of(runner.oscillator)
                && runner.x.is_finite()
                && runner.v.is_finite()
            {
                self.tally.lanes += 1;
                let state = constants.state(
                    (runner.x, runner.v),
                    &runner.hybrid,
                    runner.t_end,
                    runner.max_events,
                );
                return Some((self.next - 1, constants, state));
            }
            self.tally.others += 1;
        }
        None
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a count of events, far below 2^53"
    )]
    fn leave(&mut self, index: usize, constants: &Constants, state: &State<f64>) {
        let runner = &mut self.runners[index];
        if state.events > 0.0 {
            (runner.x, runner.v, runner.hybrid) = constants.hybrid(state);
            runner.events += state.events as u64;
            self.tally.events += state.events as u64;
        }
    }

    /// The state after the mode that begins at this one, as the engine of single motions finds it.
    #[cold]
    #[inline(never)]
    fn other(&mut self, index: usize, constants: &Constants, state: &State<f64>) -> Option<State<f64>> {
        let runner = &self.runners[index];
        let (x, v, hybrid) = constants.hybrid(state);
        let record = &mut Heard {
            index,
            go_on: self.go_on,
            on_event: self.on_event.as_mut(),
        };
        let (x, v, hybrid) = next_event(runner.oscillator, (x, v), hybrid, runner.t_end, record)?;
        self.tally.handed += 1;
        let after = constants.state((x, v), &hybrid, runner.t_end, runner.max_events);
        Some(State {
            events: state.events + 1.0,
            ..after
        })
    }
}

/// What is in a lane: the number of the motion, and its constants.
type Rider = Option<(usize, Constants)>;

impl Task for Going<'_, '_, '_> {
    type Output = Tally;

    #[inline(always)]
    fn run<L: Lane>(mut self) -> Tally {
        let n = L::splat;
        let (zero, one) = (n(0.0), n(1.0));
        let Some((index, constants, first)) = self.enter() else {
            return self.tally;
        };
        // Lanes that wait hold something sensible.
        let mut c = Column::<L>::splat(&constants.column);
        let mut steps: [Step<L>; HALVINGS + 1] = constants.steps.each_ref().map(Step::splat);
        let mut state = State::<L>::splat(&first);
        let mut riders: Vec<Rider> = vec![None; L::WIDTH];
        riders[0] = Some((index, constants));
        let mut alive = L::Mask::none();
        alive.put(0, true);
        let mut done = !alive;
        let mut rounds = 0_u32;
        loop {
            rounds += 1;
            if rounds.is_multiple_of(256) && !(self.go_on)() {
                done = alive;
                self.next = self.runners.len();
            }
            let left =
                (state.end_periods - state.periods) * (c.period + c.period_low) + (state.end_t - state.t);
            done = done | (alive & (left.at_most(zero) | state.most.at_most(state.events + one)));
            if done.any() {
                for i in (0..L::WIDTH).filter(|&i| done.at(i)) {
                    if let Some((index, constants)) = riders[i].take() {
                        self.leave(index, &constants, &state.take(i));
                    }
                    let next = self.enter();
                    alive.put(i, next.is_some());
                    if let Some((index, constants, first)) = next {
                        c.put(i, &constants.column);
                        for (step, one) in steps.iter_mut().zip(&constants.steps) {
                            step.put(i, one);
                        }
                        state.put(i, &first);
                        riders[i] = Some((index, constants));
                    }
                }
                done = L::Mask::none();
                if !alive.any() {
                    return self.tally;
                }
                continue;
            }
            let stuck = zero.below(state.stuck) & alive;
            if stuck.any() {
                let release = stick::release(&c, &state, stuck);
                let up = stuck & release.end.found & left.at_most(release.end.lasted);
                let go = release.end.found & !up;
                done = done | up;
                self.settle(&mut state, &mut done, &riders, stuck & !release.end.found);
                state.go_to(go, &release.end, c.drive);
                state.direction = L::choose(go, release.direction, state.direction);
                let at_reversal = L::choose(c.static_limit.at_most(c.offset), one, zero);
                state.at_reversal = L::choose(go, at_reversal, state.at_reversal);
                state.stuck = L::choose(go, zero, state.stuck);
                state.events = L::choose(go, state.events + one, state.events);
                if self.on_event.is_some() {
                    let rate = release.direction * (c.rise + c.force * c.frequency * state.sin);
                    let force = release.direction * c.static_limit;
                    self.tell(&riders, &state, go, force, (release.end.lasted, rate));
                }
            }
            // What has just come loose slips on in the same round.
            let left =
                (state.end_periods - state.periods) * (c.period + c.period_low) + (state.end_t - state.t);
            let slips = !zero.below(state.stuck) & alive & !done & (state.events + one).below(state.most);
            if slips.any() {
                let arrival = slip::arrival(&c, &steps, &state, left, slips);
                let up = slips & (arrival.lasts | (arrival.end.found & left.at_most(arrival.end.lasted)));
                let go = arrival.end.found & !up;
                done = done | up;
                self.settle(&mut state, &mut done, &riders, slips & !arrival.end.found & !up);
                let holding = c.stiffness * arrival.end.x + c.damper * c.drive - c.force * arrival.end.cos;
                let pull = (state.direction * holding).min(c.offset);
                let sticks = pull.abs().at_most(c.static_limit);
                state.go_to(go, &arrival.end, c.drive);
                let force = state.direction * c.offset;
                let backwards = L::choose(pull.below(zero), -state.direction, state.direction);
                state.direction = L::choose(go & !sticks, backwards, state.direction);
                let at_reversal = L::choose(pull.abs().at_most(c.offset), one, zero);
                state.at_reversal = L::choose(go, at_reversal, state.at_reversal);
                state.stuck = L::choose(go & sticks, one, state.stuck);
                state.events = L::choose(go, state.events + one, state.events);
                if self.on_event.is_some() {
                    self.tell(&riders, &state, go, force, (n(f64::NAN), n(f64::NAN)));
                }
            }
        }
    }
}

impl Going<'_, '_, '_> {
    /// Give the lanes of `open` to the engine of single motions for one mode; those whose mode lasts to the end are done.
    #[inline(always)]
    fn settle<L: Lane>(&mut self, state: &mut State<L>, done: &mut L::Mask, riders: &[Rider], open: L::Mask) {
        if !open.any() {
            return;
        }
        for i in (0..L::WIDTH).filter(|&i| open.at(i)) {
            let Some((index, constants)) = &riders[i] else {
                continue;
            };
            match self.other(*index, constants, &state.take(i)) {
                Some(after) => state.put(i, &after),
                None => done.put(i, true),
            }
        }
    }
    /// Tell of the events of lanes, at the states after them; only a release has a stick time.
    #[inline(always)]
    fn tell<L: Lane>(
        &mut self,
        riders: &[Rider],
        state: &State<L>,
        lanes: L::Mask,
        force: L,
        (stick_time, force_rate): (L, L),
    ) {
        let Some(on_event) = &mut self.on_event else {
            return;
        };
        for i in (0..L::WIDTH).filter(|&i| lanes.at(i)) {
            let Some((index, constants)) = &riders[i] else {
                continue;
            };
            let stick_time = stick_time.get(i);
            let kind = if !stick_time.is_nan() {
                Kind::Release
            } else if state.stuck.get(i) == 1.0 {
                Kind::Capture
            } else {
                Kind::Crossing
            };
            let event = Event {
                t: constants.clock(state.periods.get(i), state.t.get(i)).high,
                kind,
                contact: 0,
                x: state.x.get(i),
                v: constants.column.drive,
                force: force.get(i),
                stick_time,
                force_rate: force_rate.get(i),
            };
            on_event(*index, &event);
        }
    }
}
