//! The loop: from event to event until the end, a limit or an accumulation.

use crate::clock::Clock;
use crate::error::{Error, finite, positive, wrong};
use crate::event::{Arrival, Start, Work, end_of_hold, end_of_slip, end_of_stick};
use crate::flow::exact::{Frame, Response, Slip, Stick};
use crate::hybrid_state::{HybridState, Restart};
use crate::lanes::Alone;
use crate::law::{End, Friction, Hold, Law, Memory, Piece};
use crate::mode::{self, Kind, Mode};
use crate::network;
use crate::orbit::{Event, Orbit, Record, Segment, While};
use crate::oscillator::{Oscillator, with_harmonics};
use crate::watch::Watched;

/// Why a run ended. Ending is a value, not an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Stop {
    /// The asked time was reached.
    End,
    /// As many events as allowed occurred.
    MaxEvents,
    /// Events followed each other with hardly any time passing.
    Accumulation,
    /// The motion grew beyond all numbers.
    Diverged,
    /// The motion is too stiff for the steps that are possible.
    Stiff,
    /// Whoever watches the run said that its time is up.
    MaxSeconds,
    /// The motion is no number any more.
    NotANumber,
    /// What is kept of the run fills the memory that it may take.
    Memory,
}

impl Stop {
    /// Every reason, by its number.
    pub const ALL: [Self; 8] = [
        Self::End,
        Self::MaxEvents,
        Self::Accumulation,
        Self::Diverged,
        Self::Stiff,
        Self::MaxSeconds,
        Self::NotANumber,
        Self::Memory,
    ];

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::End => "t_end",
            Self::MaxEvents => "max_events",
            Self::Accumulation => "accumulation",
            Self::Diverged => "diverged",
            Self::Stiff => "stiff",
            Self::MaxSeconds => "max_seconds",
            Self::NotANumber => "not_a_number",
            Self::Memory => "memory",
        }
    }

    /// What it means and what to do about it.
    #[must_use]
    pub fn sentence(self) -> &'static str {
        match self {
            Self::End => "the run reached t_end",
            Self::MaxEvents => "the run stopped at max_events: raise max_events to go on",
            Self::MaxSeconds => "the run stopped after max_seconds: raise max_seconds to go on",
            Self::NotANumber => {
                "the run stopped where its numbers leave the range of double precision: scale masses, stiffnesses and laws to units in which they are moderate"
            }
            Self::Memory => {
                "the run stopped as its orbit takes 1 GiB of memory: run shorter, or keep less by simulate_many or section"
            }
            Self::Accumulation => {
                "the run stopped where events accumulate with hardly any time passing: look at the last rows of the table of events"
            }
            Self::Diverged => {
                "the run stopped where the motion grew beyond all numbers: look for friction that falls without end"
            }
            Self::Stiff => {
                "the run stopped where friction changes so steeply, or damping is so large, that it takes 100,000 steps a natural time: look for a law that is stiff at the slip speeds of this motion, or take a mass with so large a damping out"
            }
        }
    }
}

/// Where and how long to run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run {
    /// Position at t = 0.
    pub x0: f64,
    /// Velocity at t = 0; none: that of the drive.
    pub v0: Option<f64>,
    /// Time to run.
    pub t_end: f64,
    /// Most events.
    pub max_events: u64,
}

impl Run {
    /// From x = 0 at the velocity of the drive, for `t_end`.
    #[must_use]
    pub fn stuck(t_end: f64) -> Self {
        Self {
            x0: 0.0,
            v0: None,
            t_end,
            max_events: 10_000_000,
        }
    }

    /// From a position and a velocity, for `t_end`.
    #[must_use]
    pub fn starting(x0: f64, v0: f64, t_end: f64) -> Self {
        Self {
            x0,
            v0: Some(v0),
            ..Self::stuck(t_end)
        }
    }

    /// Of one mass, from a run of masses.
    #[must_use]
    pub fn of_one(run: &network::Run) -> Self {
        let first = |values: &Option<Vec<f64>>| values.as_ref().and_then(|values| values.first().copied());
        Self {
            x0: first(&run.x0).unwrap_or(0.0),
            v0: first(&run.v0),
            t_end: run.t_end,
            max_events: run.max_events,
        }
    }

    fn validate(&self) -> Result<(), Error> {
        finite("x0", self.x0)?;
        if let Some(v0) = self.v0 {
            finite("v0", v0)?;
        }
        positive("t_end", self.t_end).map(drop)
    }
}

/// Simulate and keep the whole orbit.
///
/// # Errors
/// The first value of the oscillator or the run that makes no sense.
pub fn simulate(oscillator: &Oscillator, run: Run) -> Result<Orbit, Error> {
    simulate_while(oscillator, run, || true)
}

/// The same, as long as `go_on` says so.
///
/// # Errors
/// The first value of the oscillator or the run that makes no sense.
pub fn simulate_while(
    oscillator: &Oscillator,
    run: Run,
    go_on: impl FnMut() -> bool,
) -> Result<Orbit, Error> {
    let mut orbit = Orbit::new(oscillator.clone(), run);
    let record = &mut orbit;
    let (stop, work) = observe(oscillator, run, &mut While { record, go_on })?;
    orbit.stop = stop;
    orbit.work = work;
    Ok(orbit)
}

/// The same from where another motion ended, if any, and how this one goes on, if it reached its end.
///
/// # Errors
/// The first value of the oscillator or the run that makes no sense.
pub fn simulate_from(
    oscillator: &Oscillator,
    run: Run,
    from: Option<Restart>,
    go_on: impl FnMut() -> bool,
) -> Result<(Orbit, Option<Restart>), Error> {
    let hybrid = from.map(|from| from.hybrid(oscillator.drive_velocity, Clock::default()));
    let run = hybrid.map_or(run, |(x0, v0, _)| Run {
        x0,
        v0: Some(v0),
        ..run
    });
    let mut kept = Kept {
        orbit: Orbit::new(oscillator.clone(), run),
        hybrid: None,
    };
    let record = &mut While {
        record: &mut kept,
        go_on,
    };
    let (stop, work) = match hybrid {
        Some((_, _, hybrid)) => {
            oscillator.validate()?;
            run.validate()?;
            resume(oscillator, run, hybrid, record)?
        }
        None => observe(oscillator, run, record)?,
    };
    let Kept { mut orbit, hybrid } = kept;
    (orbit.stop, orbit.work) = (stop, work);
    let restart = hybrid.filter(|_| stop == Stop::End).and_then(|hybrid| {
        let (last, segment) = (*orbit.states(&[run.t_end]).first()?, orbit.segments.last()?);
        Some(Restart {
            x: last.x,
            w: if last.stuck {
                0.0
            } else {
                oscillator.drive_velocity - last.v
            },
            stuck_for: if last.stuck {
                segment.clock.until(run.t_end)
            } else {
                0.0
            },
            hybrid,
        })
    });
    Ok((orbit, restart))
}

/// An orbit, and where it arrived.
struct Kept {
    orbit: Orbit,
    hybrid: Option<HybridState>,
}

impl Record for Kept {
    fn segment(&mut self, segment: Segment) {
        self.orbit.segment(segment);
    }

    fn event(&mut self, event: Event) {
        self.orbit.event(event);
    }

    fn full(&self) -> bool {
        self.orbit.full()
    }

    fn arrived(&mut self, hybrid: HybridState) {
        self.hybrid = Some(hybrid);
    }
}

/// Simulate and tell `record` of every segment and event.
///
/// # Errors
/// The first value of the oscillator or the run that makes no sense.
pub fn observe(oscillator: &Oscillator, run: Run, record: &mut impl Record) -> Result<(Stop, Work), Error> {
    with_harmonics!(oscillator, H, observe_forced::<H>(oscillator, run, record))
}

/// The same by who knows the number of harmonics, so that a record that depends on it is not compiled for every other one too.
pub(crate) fn observe_forced<const H: usize>(
    oscillator: &Oscillator,
    run: Run,
    record: &mut impl Record,
) -> Result<(Stop, Work), Error> {
    oscillator.validate()?;
    run.validate()?;
    if oscillator.law.smooth() {
        // No closed form: the caller turns the oscillator into a system of one mass.
        return wrong("a smooth law has no closed form: simulate it as a system of one mass".into());
    }
    Loop::<H>::new(oscillator, run, Clock::default())
        .in_a_lane(oscillator)
        .go(run, record)
}

/// Go on from a hybrid state, with x and v of the run, until `run.t_end`, a time on the clock of the hybrid, and tell `record`.
///
/// # Errors
/// A harmonic that meets an undamped resonance.
pub fn resume(
    oscillator: &Oscillator,
    run: Run,
    hybrid: HybridState,
    record: &mut impl Record,
) -> Result<(Stop, Work), Error> {
    with_harmonics!(oscillator, H, resume_forced::<H>(oscillator, run, hybrid, record))
}

/// The same by who knows the number of harmonics.
pub(crate) fn resume_forced<const H: usize>(
    oscillator: &Oscillator,
    run: Run,
    hybrid: HybridState,
    record: &mut impl Record,
) -> Result<(Stop, Work), Error> {
    let mut state = Loop::<H>::new(oscillator, run, hybrid.clock).in_a_lane(oscillator);
    state.memory = hybrid.memory;
    state.go_from(hybrid.mode, run, record)
}

/// The hybrid state where a run starts.
pub(crate) fn first_hybrid_state(oscillator: &Oscillator, run: Run) -> HybridState {
    fn hybrid<const H: usize>(oscillator: &Oscillator, run: Run) -> HybridState {
        let mut state = Loop::<H>::new(oscillator, run, Clock::default());
        let mode = state.first();
        state.hybrid(mode)
    }
    with_harmonics!(oscillator, H, hybrid::<H>(oscillator, run))
}

/// Position, velocity and hybrid state after the next event of a motion from a hybrid, if it occurs before `t_end` and `record` goes
/// on until then.
pub(crate) fn next_event(
    oscillator: &Oscillator,
    (x, v): (f64, f64),
    hybrid: HybridState,
    t_end: f64,
    record: &mut impl Record,
) -> Option<(f64, f64, HybridState)> {
    fn next<const H: usize>(
        oscillator: &Oscillator,
        run: Run,
        hybrid: HybridState,
        record: &mut impl Record,
    ) -> Option<(f64, f64, HybridState)> {
        let mut state = Loop::<H>::new(oscillator, run, hybrid.clock);
        state.memory = hybrid.memory;
        let horizon = state.clock.until(run.t_end);
        let mut mode = hybrid.mode;
        match state.end_of(&mut mode, horizon, record) {
            Ok(Passed::Event) => Some((state.x, state.v, state.hybrid(mode))),
            _ => None,
        }
    }
    let run = Run {
        x0: x,
        v0: Some(v),
        t_end,
        max_events: 1,
    };
    with_harmonics!(oscillator, H, next::<H>(oscillator, run, hybrid, record))
}

/// So many events pass between two questions whether to go on; in less than a millionth of the natural time √(m/k) they are an
/// accumulation.
const ASKED: u64 = 1000;
/// A state beyond this has left the numbers: its square would overflow.
const HUGE: f64 = 1e150;
/// The most bytes that an orbit may take.
pub(crate) const MOST_BYTES: usize = 1 << 30;

/// Why a motion cannot go on from a state, if it cannot.
pub(crate) fn lost(state: &[f64]) -> Option<Stop> {
    if state.iter().any(|number| number.is_nan()) {
        Some(Stop::NotANumber)
    } else {
        let far = state.iter().any(|number| number.abs() >= HUGE);
        far.then_some(Stop::Diverged)
    }
}

/// How far a run came in one mode.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Passed {
    /// To its end: an event.
    Event,
    /// To where it was to go, or where it was stopped.
    Horizon,
    /// It cannot go on.
    Stop(Stop),
}

/// So many pieces, between which a motion goes to and fro, are not worked out anew.
const KEPT: usize = 4;

struct Loop<'a, const H: usize> {
    law: &'a Law,
    /// The motion in a lane, where that is faster.
    alone: Option<Box<Alone>>,
    /// The static limit backward and forward, if that never changes.
    static_limit: Option<[f64; 2]>,
    frame: Frame<H>,
    responses: [Response<H>; KEPT],
    clock: Clock,
    /// The harmonic forces counted from the clock.
    forces: [[f64; 2]; H],
    x: f64,
    v: f64,
    memory: Memory,
    work: Work,
    /// How far a search had come that was ended before it was done.
    stopped: Option<f64>,
}

impl<'a, const H: usize> Loop<'a, H> {
    fn new(oscillator: &'a Oscillator, run: Run, clock: Clock) -> Self {
        let (law, frame) = (&oscillator.law, Frame::of(oscillator));
        let steady = law.growth_bound(0.0) == 0.0 && (H == 0 || !law.feels_force_rate());
        let hold = Hold::new(0.0, (frame.stiffness * frame.drive_velocity).abs());
        Self {
            law,
            alone: None,
            static_limit: steady.then(|| [-1.0, 1.0].map(|direction| law.toward(direction).break_away(hold))),
            responses: [frame.response(f64::NAN); KEPT],
            clock,
            forces: frame.forces(clock),
            frame,
            x: run.x0,
            v: run.v0.unwrap_or(oscillator.drive_velocity),
            memory: Memory::default(),
            work: Work::default(),
            stopped: None,
        }
    }

    /// The same in a lane, as far as it goes in one.
    fn in_a_lane(mut self, oscillator: &Oscillator) -> Self {
        if H == 1 {
            self.alone = Alone::of(oscillator);
        }
        self
    }

    /// Go to the end of the mode in a lane, if it goes in one.
    #[inline]
    fn alone(&mut self, mode: &mut Mode, horizon: f64, record: &mut impl Record) -> bool {
        // Before the mode is copied, which is large.
        if H != 1 || self.alone.is_none() {
            return false;
        }
        let mut at = (self.x, self.v, self.hybrid(*mode));
        let Some(alone) = &mut self.alone else {
            return false;
        };
        let event = alone.event(&mut at, horizon, &mut self.work.evaluations);
        (self.x, self.v, self.clock, *mode) = (at.0, at.1, at.2.clock, at.2.mode);
        match event {
            Some(event) => record.event(event),
            None => self.forces = self.frame.forces(self.clock),
        }
        event.is_some()
    }

    fn go(mut self, run: Run, record: &mut impl Record) -> Result<(Stop, Work), Error> {
        let mode = self.first();
        self.go_from(mode, run, record)
    }

    /// The mode in which it starts.
    fn first(&mut self) -> Mode {
        let (holding, rate, _) = self.at_rest().at(0.0);
        mode::first(&self.frame, self.law, (self.v, holding, rate), &mut self.memory)
    }

    /// Where a mode begins.
    fn hybrid(&self, mode: Mode) -> HybridState {
        HybridState {
            clock: self.clock,
            mode,
            memory: self.memory,
        }
    }

    fn go_from(mut self, mut mode: Mode, run: Run, record: &mut impl Record) -> Result<(Stop, Work), Error> {
        let short = 1e-6 * (self.frame.mass / self.frame.stiffness).sqrt();
        let (mut mark, mut asked) = (self.clock, self.work.events);
        loop {
            record.segment(Segment::new(self.clock, self.x, self.v, &mode));
            if !(self.x.abs() < HUGE && self.v.abs() < HUGE) {
                return Ok((lost(&[self.x, self.v]).unwrap_or(Stop::Diverged), self.work));
            }
            if self.work.events >= asked {
                asked = self.work.events + ASKED;
                if self.work.events > 0 && mark.until(self.clock.high) < short {
                    return Ok((Stop::Accumulation, self.work));
                }
                mark = self.clock;
                if !record.go_on() {
                    return Ok((Stop::MaxSeconds, self.work));
                }
                if record.full() {
                    return Ok((Stop::Memory, self.work));
                }
            }
            let horizon = self.clock.until(run.t_end);
            let passed = if self.alone(&mut mode, horizon, record) {
                Passed::Event
            } else {
                self.end_of(&mut mode, horizon, record)?
            };
            if let Passed::Stop(stop) = passed {
                return Ok((stop, self.work));
            }
            if passed == Passed::Horizon {
                let segment = Segment::new(self.clock, self.x, self.v, &mode);
                let reached = self.stopped.unwrap_or(horizon);
                let state = segment.state(&self.frame, reached);
                if let Some(stop) = lost(&[state.x, state.v]) {
                    return Ok((stop, self.work));
                }
                if self.stopped.is_some() {
                    record.segment(Segment {
                        clock: self.clock.after(reached),
                        x: state.x,
                        v: state.v,
                        ..segment
                    });
                    return Ok((Stop::MaxSeconds, self.work));
                }
                record.arrived(HybridState::inside(self.clock, horizon, mode, self.memory));
                return Ok((Stop::End, self.work));
            }
            self.work.events += 1;
            if self.work.events >= run.max_events {
                return Ok((Stop::MaxEvents, self.work));
            }
        }
    }

    /// Go to the end of the mode, if it ends within `horizon`: then it is the next one.
    #[inline]
    fn end_of(&mut self, mode: &mut Mode, horizon: f64, record: &mut impl Record) -> Result<Passed, Error> {
        // Each mode writes the next one where it is kept: it is too large to be handed on.
        match *mode {
            Mode::Stick => match self.stick(horizon, record) {
                Some(next) => *mode = next,
                None => return Ok(Passed::Horizon),
            },
            Mode::Slip {
                direction,
                piece,
                start,
            } => {
                self.respond(&piece)?;
                let slip = self.slip(direction, &piece);
                if !slip.is_finite() {
                    return Ok(Passed::Stop(Stop::NotANumber));
                }
                let drive_velocity = self.frame.drive_velocity;
                let arrival = self.search(record, |work| {
                    end_of_slip(&slip, direction, drive_velocity, &piece, start, horizon, work)
                });
                let Some(Arrival { t, end, x, v }) = arrival else {
                    return Ok(Passed::Horizon);
                };
                if (t + x + v).is_nan() {
                    return Ok(Passed::Stop(Stop::NotANumber));
                }
                (self.x, self.v) = (x, v);
                self.wait(t);
                *mode = self.slipped(direction, &piece, end, record);
            }
            Mode::Hold {
                direction,
                u,
                between,
                start,
            } => match self.hold(direction, u, between, start, horizon, record) {
                Some(next) => *mode = next,
                None => return Ok(Passed::Horizon),
            },
        }
        Ok(Passed::Event)
    }

    /// Adhesion from the present state.
    fn at_rest(&self) -> Stick<H> {
        self.frame
            .held_against(&self.forces, self.x, self.frame.drive_velocity)
    }

    /// Search for the end of a mode, as long as whoever is told goes on.
    fn search<T>(
        &mut self,
        record: &mut impl Record,
        find: impl FnOnce(&mut Watched) -> Option<T>,
    ) -> Option<T> {
        let mut go_on = || record.go_on();
        let mut watched = Watched::new(&mut self.work, &mut go_on);
        let found = find(&mut watched);
        if watched.stopped.is_some() {
            self.stopped = watched.stopped;
        }
        found
    }

    fn wait(&mut self, t: f64) {
        self.clock = self.clock.after(t);
        self.forces = self.frame.forces(self.clock);
    }

    /// Work out how the oscillator answers along a piece of friction, if that is not kept.
    #[inline]
    fn respond(&mut self, piece: &Piece) -> Result<(), Error> {
        let response = &mut self.responses[piece.branch as usize % KEPT];
        if response.slope != piece.slope {
            self.frame.bounded(piece.slope)?;
            *response = self.frame.response(piece.slope);
        }
        Ok(())
    }

    /// Slip from the present state along a piece of which the response is kept.
    #[inline]
    fn slip(&self, direction: f64, piece: &Piece) -> Slip<H> {
        let response = &self.responses[piece.branch as usize % KEPT];
        response.from(&self.frame, &self.forces, (self.x, self.v), direction, piece)
    }

    /// Adhesion until it breaks; the mode after that.
    fn stick(&mut self, horizon: f64, record: &mut impl Record) -> Option<Mode> {
        let (stick, law, static_limit) = (self.at_rest(), self.law, self.static_limit);
        let t = self.search(record, |work| {
            end_of_stick(&stick, law, static_limit, horizon, work)
        })?;
        self.x += self.frame.drive_velocity * t;
        self.v = self.frame.drive_velocity;
        self.wait(t);
        let (holding, rate, _) = self.at_rest().at(0.0);
        let force = match self.static_limit {
            Some([backward, forward]) => {
                if holding < 0.0 {
                    backward
                } else {
                    forward
                }
            }
            None => self.law.toward(holding).break_away(Hold::new(t, rate.abs())),
        };
        let (stick_time, force_rate) = (t, rate * holding.signum());
        record.event(Event {
            stick_time,
            force_rate,
            ..self.event(Kind::Release, holding)
        });
        // Slip begins with the limit itself, of which the holding force differs by rounding.
        Some(mode::slip_from_zero(
            self.law,
            force.copysign(holding),
            force,
            &mut self.memory,
        ))
    }

    /// Slip at constant speed until friction meets one of the branches; the mode after that.
    fn hold(
        &mut self,
        direction: f64,
        u: f64,
        between: [f64; 2],
        start: Start,
        horizon: f64,
        record: &mut impl Record,
    ) -> Option<Mode> {
        let v = self.frame.drive_velocity - direction * u;
        let reaction = self.frame.held_against(&self.forces, self.x, v);
        let (t, end) = self.search(record, |work| {
            end_of_hold(&reaction, direction, between, start, horizon, work)
        })?;
        self.x += v * t;
        self.v = v;
        self.wait(t);
        let force = if end == End::High { between[1] } else { between[0] };
        record.event(self.event(Kind::Reversal, direction * force));
        Some(mode::after_hold(self.law, direction, u, end, &mut self.memory))
    }

    /// What follows where slip along `piece` ended at the present state.
    fn slipped(&mut self, direction: f64, piece: &Piece, end: End, record: &mut impl Record) -> Mode {
        let speed = match end {
            End::Low => piece.low,
            End::High => piece.high,
            End::Reversal { .. } => direction * (self.frame.drive_velocity - self.v),
        };
        let force = direction * piece.force(speed);
        if !matches!(end, End::Reversal { .. }) {
            // The slip velocity is known exactly here.
            self.v = self.frame.drive_velocity - direction * speed;
        }
        if end == (End::Reversal { rising: true }) {
            self.memory.force_rate = self.at_rest().at(0.0).1.abs();
        }
        if speed > 0.0 || end == (End::Reversal { rising: true }) {
            let next = mode::after(self.law, direction, piece, end, speed, &mut self.memory);
            let kind = match (end, &next) {
                (_, Mode::Hold { .. }) => Kind::Hold,
                (End::Reversal { .. }, _) => Kind::Reversal,
                _ => Kind::Node,
            };
            record.event(self.event(kind, force));
            return next;
        }
        let (holding, rate, _) = self.at_rest().at(0.0);
        // Friction stopped this slip: adhesion holds against no more than that, and what is more is rounding.
        let pull = direction * (direction * holding).min(piece.force(0.0));
        let mode = mode::at_zero(self.law, pull, rate, &mut self.memory);
        let kind = if mode == Mode::Stick {
            Kind::Capture
        } else {
            Kind::Crossing
        };
        record.event(self.event(kind, force));
        mode
    }

    fn event(&self, kind: Kind, force: f64) -> Event {
        Event {
            t: self.clock.high,
            kind,
            contact: 0,
            x: self.x,
            v: self.v,
            force,
            stick_time: f64::NAN,
            force_rate: f64::NAN,
        }
    }
}
