//! Many oscillators in SIMD lanes: one motion in each lane of the registers of a processor, from mode to mode.
//!
//! A motion goes in a lane where adhesion begins with the same limit each time, friction in slip is of lines that follow each
//! other, at most one harmonic acts, and the drive moves forward ([`fits`]). Everything else, adhesion whose limit grows other than
//! exponentially, slip along lines that are very steep, and every mode whose end the lanes cannot certify, is gone by the engine of single motions;
//! both stand at the begin of a mode, so one goes on from where the other is. A lane asks nothing of its neighbours, and has the
//! same bits in every [`Width`].

mod column;
mod elementary;
mod slip;
mod stick;

pub use stickslip_lanes::Width;
use stickslip_lanes::{Lane, Mask, Single, Task, run};

use crate::clock::Clock;
use crate::hybrid_state::HybridState;
use crate::law::Memory;
use crate::mode::Mode;
use crate::model::Running;
use crate::orbit::{Event, Record, Segment};
use crate::oscillator::Oscillator;
use crate::simulate::{Run, first_hybrid_state, next_event};
use column::{Column, Constants, HALVINGS, Line, State, Step, Track};

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

/// Whoever is told of the events, each with the number of its motion and the mode that follows.
pub type OnEvent<'a> = &'a mut dyn FnMut(usize, &Event, &Segment);

/// So many events of a run are kept until it is looked at.
const KEPT: u64 = 1024;

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
    let (mut runners, indices) = runners_of(runs, fits);
    let width = Width::for_lanes(runners.len());
    let mut tally = match on_event {
        Some(on_event) => {
            let on_event: OnEvent = &mut |index, event, segment| on_event(indices[index], event, segment);
            forward(&mut runners, width, go_on, Some(on_event))
        }
        None => forward(&mut runners, width, go_on, None),
    };
    tally.others += (runs.len() - indices.len()) as u64;
    for (runner, index) in runners.iter().zip(indices) {
        if let Running::Closed(engine) = &mut runs[index].0 {
            engine.take(runner, Vec::new());
        }
    }
    tally
}

/// The same where they will be looked at: each shows what it passed, or the first of it, when it goes on. Those stay that do
/// not have these bits when they go alone.
pub(crate) fn forward_seen(runs: &mut [(Running, f64)], go_on: &mut dyn FnMut() -> bool) {
    let (mut runners, indices) = runners_of(runs, Alone::takes);
    let mut open: Vec<Segment> = Vec::with_capacity(runners.len());
    for runner in &mut runners {
        runner.max_events = runner.max_events.min(KEPT);
        let HybridState { clock, mode, .. } = &runner.hybrid;
        open.push(Segment::new(*clock, runner.x, runner.v, mode));
    }
    let mut passed = vec![Vec::new(); runners.len()];
    let on_event: OnEvent = &mut |index, event, segment| {
        let before = std::mem::replace(&mut open[index], *segment);
        passed[index].push((before, *event));
    };
    let width = Width::for_lanes(runners.len());
    forward(&mut runners, width, go_on, Some(on_event));
    for ((runner, passed), index) in runners.iter().zip(passed).zip(indices) {
        if let Running::Closed(engine) = &mut runs[index].0 {
            engine.take(runner, passed);
        }
    }
}

/// The runs of the oscillators that a rule takes, and their numbers.
fn runners_of<'a>(
    runs: &[(Running<'a>, f64)],
    takes: fn(&Oscillator) -> bool,
) -> (Vec<Runner<'a>>, Vec<usize>) {
    let runners = runs
        .iter()
        .enumerate()
        .filter_map(|(index, (run, t_end))| match run {
            Running::Closed(engine) if takes(engine.oscillator()) => Some((engine.runner(*t_end), index)),
            _ => None,
        });
    runners.unzip()
}

/// Motions that wait for a lane.
struct Going<'a, 'b, 'c> {
    runners: &'a mut [Runner<'b>],
    go_on: &'a mut dyn FnMut() -> bool,
    on_event: Option<OnEvent<'c>>,
    next: usize,
    tally: Tally,
}

/// Keeps the event that one motion comes to.
struct Heard<'a> {
    event: Option<Event>,
    go_on: &'a mut dyn FnMut() -> bool,
}

impl Record for Heard<'_> {
    fn segment(&mut self, _: Segment) {}

    fn event(&mut self, event: Event) {
        self.event = Some(event);
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
        let mut heard = Heard {
            event: None,
            go_on: self.go_on,
        };
        let (x, v, hybrid) = next_event(runner.oscillator, (x, v), hybrid, runner.t_end, &mut heard)?;
        self.tally.handed += 1;
        if let (Some(on_event), Some(event)) = (&mut self.on_event, heard.event) {
            on_event(index, &event, &Segment::new(hybrid.clock, x, v, &hybrid.mode));
        }
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
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let Some((index, constants, first)) = self.enter() else {
            return self.tally;
        };
        // Lanes that wait hold something sensible.
        let mut c = Column::<L>::splat(&constants.column);
        let mut on = On::<L>::splat(constants.track(first.line));
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
                        on.put(i, constants.track(first.line));
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
                let passed = break_away(&c, &mut state, left, stuck);
                done = done | passed.up;
                self.settle(&mut state, &mut done, &riders, passed.open);
                self.tell(&riders, &c, &state, &passed);
            }
            // What has just come loose slips on in the same round.
            let left =
                (state.end_periods - state.periods) * (c.period + c.period_low) + (state.end_t - state.t);
            let slips = !zero.below(state.stuck) & alive & !done & (state.events + one).below(state.most);
            if slips.any() {
                let others = slips & (state.line.below(on.line.index) | on.line.index.below(state.line));
                if others.any() {
                    for i in (0..L::WIDTH).filter(|&i| others.at(i)) {
                        if let Some((_, constants)) = &riders[i] {
                            on.put(i, constants.track(state.line.get(i)));
                        }
                    }
                }
                let passed = arrive(&c, &on, &mut state, left, slips);
                done = done | passed.up;
                self.settle(&mut state, &mut done, &riders, passed.open);
                self.tell(&riders, &c, &state, &passed);
            }
        }
    }
}

/// The line of friction that each lane is on, and the steps along it.
struct On<L> {
    line: Line<L>,
    steps: [Step<L>; HALVINGS + 1],
}

impl<L: Lane> On<L> {
    fn splat(track: &Track) -> Self {
        Self {
            line: Line::splat(&track.line),
            steps: track.steps.each_ref().map(Step::splat),
        }
    }

    /// Write lane `i`.
    fn put(&mut self, i: usize, track: &Track) {
        self.line.put(i, &track.line);
        for (step, one) in self.steps.iter_mut().zip(&track.steps) {
            step.put(i, one);
        }
    }
}

/// What became of the modes of some lanes.
struct Passed<L: Lane> {
    /// Lanes that are at the next mode.
    go: L::Mask,
    /// Lanes whose mode lasts to the horizon.
    up: L::Mask,
    /// Lanes whose mode ends as the engine of single motions will find.
    open: L::Mask,
    /// Friction at the event, the stick time and the force rate, of which there are some at a release only.
    event: [L; 3],
    /// Exact evaluations.
    evaluations: u64,
}

/// Adhesion in some lanes, until it breaks or to a horizon.
#[inline(always)]
fn break_away<L: Lane>(c: &Column<L>, state: &mut State<L>, horizon: L, stuck: L::Mask) -> Passed<L> {
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
    Passed {
        go,
        up,
        open: stuck & !release.end.found,
        event: [release.direction * release.limit, release.end.lasted, rate],
        evaluations: release.evaluations,
    }
}

/// Slip in some lanes, until it ends or to a horizon.
#[inline(always)]
fn arrive<L: Lane>(c: &Column<L>, on: &On<L>, state: &mut State<L>, horizon: L, slips: L::Mask) -> Passed<L> {
    let (zero, one, none) = (L::splat(0.0), L::splat(1.0), L::splat(f64::NAN));
    let arrival = slip::arrival(c, &on.line, &on.steps, state, horizon, slips);
    let up = slips & (arrival.lasts | (arrival.end.found & horizon.at_most(arrival.end.lasted)));
    let go = arrival.end.found & !up;
    let node = go & zero.below(arrival.speed);
    let holding = c.stiffness * arrival.end.x + c.damper * c.drive - c.force * arrival.end.cos;
    let pull = (state.direction * holding).min(c.offset);
    let sticks = pull.abs().at_most(c.static_limit);
    state.go_to(go, &arrival.end, c.drive - state.direction * arrival.speed);
    let force = state.direction * (on.line.offset + on.line.slope * arrival.speed);
    let backwards = L::choose(pull.below(zero), -state.direction, state.direction);
    state.direction = L::choose(go & !sticks & !node, backwards, state.direction);
    let at_reversal = L::choose(pull.abs().at_most(c.offset) & !node, one, zero);
    state.at_reversal = L::choose(go, at_reversal, state.at_reversal);
    let next = L::choose(arrival.high, state.line + one, state.line - one);
    state.line = L::choose(node, next, state.line);
    state.stuck = L::choose(go & sticks & !node, one, state.stuck);
    state.events = L::choose(go, state.events + one, state.events);
    Passed {
        go,
        up,
        open: slips & !arrival.end.found & !up,
        event: [force, none, none],
        evaluations: arrival.evaluations,
    }
}

/// One motion by the arithmetic of the lanes: it has the same bits as in a sweep.
pub(crate) struct Alone {
    constants: Constants,
    column: Column<Single>,
    on: On<Single>,
    state: State<Single>,
    /// Whether the state is where the motion is.
    there: bool,
}

impl Alone {
    /// The constants of a forced oscillator that goes in lanes; without a force the engine of single motions is faster.
    fn constants(oscillator: &Oscillator) -> Option<Constants> {
        Constants::of(oscillator).filter(|constants| constants.column.force > 0.0)
    }

    fn takes(oscillator: &Oscillator) -> bool {
        Self::constants(oscillator).is_some()
    }

    /// Of an oscillator that it takes.
    pub(crate) fn of(oscillator: &Oscillator) -> Option<Box<Self>> {
        let constants = Self::constants(oscillator)?;
        let start = HybridState {
            clock: Clock::default(),
            mode: Mode::Stick,
            memory: Memory::default(),
        };
        Some(Box::new(Self {
            column: Column::splat(&constants.column),
            on: On::splat(constants.track(0.0)),
            state: State::splat(&constants.state((0.0, 0.0), &start, 0.0, 0)),
            there: false,
            constants,
        }))
    }

    /// The event that ends the mode that begins at a position, velocity and hybrid state, which are those after it then. None
    /// where the mode lasts to the horizon or its end is not certified; they stay, but for rounding of the time.
    pub(crate) fn event(
        &mut self,
        at: &mut (f64, f64, HybridState),
        horizon: f64,
        evaluations: &mut u64,
    ) -> Option<Event> {
        if !self.there {
            let state = self.constants.state((at.0, at.1), &at.2, 0.0, 0);
            self.state = State::splat(&state);
        }
        let (state, horizon) = (&mut self.state, Single::splat(horizon));
        let (mut all, zero) = (<Single as Lane>::Mask::none(), Single::splat(0.0));
        all.put(0, true);
        let passed = if zero.below(state.stuck).any() {
            break_away(&self.column, state, horizon, all)
        } else {
            if state.line.get(0) != self.on.line.index.get(0) {
                self.on = On::splat(self.constants.track(state.line.get(0)));
            }
            arrive(&self.column, &self.on, state, horizon, all)
        };
        *evaluations += passed.evaluations;
        self.there = passed.go.any();
        // Also where it stays: its clock is that of the lanes from here on, as in a sweep.
        let state = self.state.take(0);
        *at = self.constants.hybrid(&state);
        self.there.then(|| {
            let event = passed.event.map(|number| number.get(0));
            self.constants.event(at.2.clock, &state, event)
        })
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

    /// Tell of the events of lanes, at the states after them.
    #[inline(always)]
    fn tell<L: Lane>(&mut self, riders: &[Rider], c: &Column<L>, state: &State<L>, passed: &Passed<L>) {
        let Some(on_event) = &mut self.on_event else {
            return;
        };
        // Side by side: one after the other these sums would take a quarter of all the time.
        let (high, low) = state.clock(c);
        for i in (0..L::WIDTH).filter(|&i| passed.go.at(i)) {
            let Some((index, constants)) = &riders[i] else {
                continue;
            };
            let event = passed.event.map(|number| number.get(i));
            let state = state.take(i);
            let clock = Clock {
                high: high.get(i),
                low: low.get(i),
            };
            let event = constants.event(clock, &state, event);
            on_event(*index, &event, &constants.segment(clock, &state));
        }
    }
}
