//! One mass in closed form, from mode to mode.

use super::stop::HUGE_STATE;
use super::{EVENTS_BETWEEN_ASKS, Run, Stop, lost};
use crate::clock::Clock;
use crate::error::Error;
use crate::event::{Arrival, SlipPhase, Start, Work, end_of_hold, end_of_slip, end_of_stick};
use crate::flow::exact::{Frame, Response, Slip, Stick};
use crate::hybrid_state::HybridState;
use crate::lanes::SingleLane;
use crate::law::{End, Friction, Law, Memory, Piece, Rest};
use crate::mode::{self, Kind, Mode};
use crate::orbit::{Event, Record, Segment};
use crate::oscillator::Oscillator;
use crate::watch::Watched;

/// How far a run came in one mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Passed {
    /// To its end: an event.
    Event,
    /// To where it was to go, or where it was stopped.
    Horizon,
    /// It cannot go on.
    Stop(Stop),
}

/// So many pieces, between which a motion goes to and fro, are not worked out anew.
const PIECES_KEPT: usize = 4;

pub(super) struct Loop<'a, const H: usize> {
    law: &'a Law,
    /// The motion in a lane, where that is faster.
    single_lane: Option<Box<SingleLane>>,
    /// The static limit backward and forward, if that never changes.
    static_limit: Option<[f64; 2]>,
    frame: Frame<H>,
    responses: [Response<H>; PIECES_KEPT],
    pub(super) clock: Clock,
    /// The harmonic forces counted from the clock.
    forces: [[f64; 2]; H],
    pub(super) x: f64,
    pub(super) v: f64,
    pub(super) memory: Memory,
    work: Work,
    /// How far a search had come that was ended before it was done.
    stopped: Option<f64>,
}

impl<'a, const H: usize> Loop<'a, H> {
    pub(super) fn new(oscillator: &'a Oscillator, run: Run, clock: Clock) -> Self {
        let (law, frame) = (&oscillator.law, Frame::of(oscillator));
        let steady = law.growth_bound(0.0) == 0.0 && (H == 0 || !law.feels_force_rate());
        let rest = Rest::new(0.0, (frame.stiffness * frame.drive_velocity).abs());
        Self {
            law,
            single_lane: None,
            static_limit: steady
                .then(|| [-1.0, 1.0].map(|direction| law.toward(direction).static_limit(rest))),
            responses: [frame.response(f64::NAN); PIECES_KEPT],
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
    pub(super) fn in_a_lane(mut self, oscillator: &Oscillator) -> Self {
        if H == 1 {
            self.single_lane = SingleLane::of(oscillator);
        }
        self
    }

    /// Go to the end of the mode in a lane, if it goes in one.
    #[inline]
    fn single_lane(&mut self, mode: &mut Mode, horizon: f64, record: &mut impl Record) -> bool {
        // Before the mode is copied, which is large.
        if H != 1 || self.single_lane.is_none() {
            return false;
        }
        let mut at = (self.x, self.v, self.hybrid(*mode));
        let Some(lane) = &mut self.single_lane else {
            return false;
        };
        let event = lane.event(&mut at, horizon, &mut self.work.evaluations);
        (self.x, self.v, self.clock, *mode) = (at.0, at.1, at.2.clock, at.2.mode);
        match event {
            Some(event) => record.event(event),
            None => self.forces = self.frame.forces(self.clock),
        }
        event.is_some()
    }

    pub(super) fn go(mut self, run: Run, record: &mut impl Record) -> Result<(Stop, Work), Error> {
        let mode = self.first();
        self.go_from(mode, run, record)
    }

    /// The mode in which it starts.
    pub(super) fn first(&mut self) -> Mode {
        let (holding, rate, _) = self.at_rest().at(0.0);
        mode::first(&self.frame, self.law, (self.v, holding, rate), &mut self.memory)
    }

    /// Where a mode begins.
    pub(super) fn hybrid(&self, mode: Mode) -> HybridState {
        HybridState {
            clock: self.clock,
            mode,
            memory: self.memory,
        }
    }

    pub(super) fn go_from(
        mut self,
        mut mode: Mode,
        run: Run,
        record: &mut impl Record,
    ) -> Result<(Stop, Work), Error> {
        let short = 1e-6 * (self.frame.mass / self.frame.stiffness).sqrt();
        let (mut mark, mut asked) = (self.clock, self.work.events);
        loop {
            record.segment(Segment::new(self.clock, self.x, self.v, &mode));
            if !(self.x.abs() < HUGE_STATE && self.v.abs() < HUGE_STATE) {
                return Ok((lost(&[self.x, self.v]).unwrap_or(Stop::Diverged), self.work));
            }
            if self.work.events >= asked {
                asked = self.work.events + EVENTS_BETWEEN_ASKS;
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
            let mut horizon = self.clock.until(run.t_end);
            let passed = if self.single_lane(&mut mode, horizon, record) {
                Passed::Event
            } else {
                // A lane that handed the mode over may have rounded the clock.
                horizon = self.clock.until(run.t_end);
                self.end_of(&mut mode, horizon, record)?
            };
            if let Passed::Stop(stop) = passed {
                return Ok((stop, self.work));
            }
            if passed == Passed::Horizon {
                let segment = Segment::new(self.clock, self.x, self.v, &mode);
                let reached = self.stopped.unwrap_or(horizon);
                let state = segment.state(&self.frame, reached);
                if lost(&[state.x, state.v]).is_some() {
                    // Where the mode began it was within the numbers.
                    return Ok((Stop::Diverged, self.work));
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
    pub(super) fn end_of(
        &mut self,
        mode: &mut Mode,
        horizon: f64,
        record: &mut impl Record,
    ) -> Result<Passed, Error> {
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
                let drive_velocity = self.frame.drive_velocity;
                // Where a velocity cannot tell the two ends of a piece apart, no event at them can be confirmed.
                let [low, high] = [piece.low, piece.high].map(|u| drive_velocity - direction * u);
                if !slip.is_finite() || (low == high && piece.low < piece.high) {
                    return Ok(Passed::Stop(Stop::NotANumber));
                }
                let phase = SlipPhase {
                    slip: &slip,
                    direction,
                    drive_velocity,
                    piece: &piece,
                    start,
                };
                let arrival = self.search(record, |work| end_of_slip(&phase, horizon, work));
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
        let response = &mut self.responses[piece.branch as usize % PIECES_KEPT];
        if response.slope != piece.slope {
            self.frame.bounded(piece.slope)?;
            *response = self.frame.response(piece.slope);
        }
        Ok(())
    }

    /// Slip from the present state along a piece of which the response is kept.
    #[inline]
    fn slip(&self, direction: f64, piece: &Piece) -> Slip<H> {
        let response = &self.responses[piece.branch as usize % PIECES_KEPT];
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
            None => self.law.toward(holding).static_limit(Rest::new(t, rate.abs())),
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
        let (frame, forces, x) = (&self.frame, &self.forces, self.x);
        let held = || {
            let stick = frame.held_against(forces, x, frame.drive_velocity);
            let (holding, rate, _) = stick.at(0.0);
            [holding, rate]
        };
        let (next, kind) =
            mode::after_slip(self.law, (direction, piece), (end, speed), held, &mut self.memory);
        record.event(self.event(kind, force));
        next
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
