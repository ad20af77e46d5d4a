//! What a run returns: segments that are exact at any time, and the table of events.

use crate::clock::Clock;
use crate::event::Work;
use crate::flow::exact::{Frame, Slip};
use crate::hybrid_state::{HybridState, Restart};
use crate::law::Piece;
use crate::mode::{Kind, Mode};
use crate::oscillator::{Oscillator, with_harmonics};
use crate::simulate::{MOST_BYTES, Run, Stop};
use crate::surface::Point;

/// One event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// Time.
    pub t: f64,
    /// What happened.
    pub kind: Kind,
    /// At which contact.
    pub contact: u32,
    /// Position of its mass.
    pub x: f64,
    /// Velocity of its mass.
    pub v: f64,
    /// Friction force on its mass just before the event.
    pub force: f64,
    /// Time of adhesion before a release; not a number elsewhere.
    pub stick_time: f64,
    /// d|F|/dt at a release; not a number elsewhere.
    pub force_rate: f64,
}

impl Event {
    /// As numbers, in the order of the fields.
    #[must_use]
    pub fn row(&self) -> [f64; 8] {
        let (kind, contact) = (f64::from(self.kind as u8), f64::from(self.contact));
        let Self {
            t,
            x,
            v,
            force,
            stick_time,
            force_rate,
            ..
        } = *self;
        [t, kind, contact, x, v, force, stick_time, force_rate]
    }

    /// The state there. The slip velocity is known where it is zero.
    pub fn point(&self) -> Point {
        let zero = matches!(self.kind, Kind::Release | Kind::Capture | Kind::Crossing);
        Point {
            t: self.t,
            x: self.x,
            v: self.v,
            w: if zero { 0.0 } else { f64::NAN },
        }
    }
}

/// The state at the start of a mode and the line of friction in it: enough to evaluate the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// When the mode starts.
    pub clock: Clock,
    /// Position there.
    pub x: f64,
    /// Velocity there.
    pub v: f64,
    /// Sign of the slip velocity, 0 while stuck.
    pub direction: f64,
    /// Friction opposing slip is offset + slope · u.
    pub offset: f64,
    /// The slope of that line; infinite where the slip speed is held between two branches.
    pub slope: f64,
    /// Branch of the law, for pictures.
    pub branch: u32,
}

impl Segment {
    pub(crate) fn new(clock: Clock, x: f64, v: f64, mode: &Mode) -> Self {
        let (direction, offset, slope, branch) = match *mode {
            Mode::Stick => (0.0, 0.0, 0.0, 0),
            Mode::Slip { direction, piece, .. } => (direction, piece.offset, piece.slope, piece.branch),
            Mode::Hold { direction, .. } => (direction, 0.0, f64::INFINITY, 0),
        };
        Self {
            clock,
            x,
            v,
            direction,
            offset,
            slope,
            branch,
        }
    }

    /// The state `tau` after its start.
    pub(crate) fn state<const H: usize>(&self, frame: &Frame<H>, tau: f64) -> State {
        self.state_on(self.slip(frame).as_ref(), frame, tau)
    }

    /// The friction along a slip.
    pub(crate) fn piece(&self) -> Piece {
        Piece {
            offset: self.offset,
            slope: self.slope,
            low: 0.0,
            high: f64::INFINITY,
            branch: self.branch,
            reverses: false,
        }
    }

    /// The motion along a slip, none where the slip speed is held.
    fn slip<const H: usize>(&self, frame: &Frame<H>) -> Option<Slip<H>> {
        let slips = self.direction != 0.0 && !self.slope.is_infinite();
        slips.then(|| frame.closed(self.clock, self.x, self.v, self.direction, &self.piece()))
    }

    /// The state on that motion.
    fn state_on<const H: usize>(&self, slip: Option<&Slip<H>>, frame: &Frame<H>, tau: f64) -> State {
        let Some(slip) = slip else {
            let x = self.x + self.v * tau;
            let force = frame.held(self.clock, self.x, self.v).at(tau).0;
            return State {
                x,
                v: self.v,
                a: 0.0,
                force,
                stuck: self.direction == 0.0,
            };
        };
        let basis = slip.basis(tau);
        // The state at its start is known and need not be added up again.
        let (x, v) = if tau == 0.0 {
            (self.x, self.v)
        } else {
            (slip.position(tau, &basis), slip.v.at(&basis))
        };
        let force = self.direction * self.piece().force(self.direction * (frame.drive_velocity - v));
        let a = slip.v.derivative(&slip.decay, &slip.frequency).at(&basis);
        State {
            x,
            v,
            a,
            force,
            stuck: false,
        }
    }
}

/// Whoever is told of a run.
pub trait Record {
    /// A mode starts.
    fn segment(&mut self, segment: Segment);
    /// An event occurred.
    fn event(&mut self, event: Event);
    /// Whether to go on; asked every thousand events, and within a long search. The core holds no clock: a limit of time is
    /// kept by whoever has one.
    fn go_on(&mut self) -> bool {
        true
    }
    /// Whether what is kept may not grow any more; asked every thousand events.
    fn full(&self) -> bool {
        false
    }
    /// The end of the run was reached here.
    fn arrived(&mut self, _hybrid: HybridState) {}
}

/// A record that is told on as long as `go_on` says so.
#[derive(Debug)]
pub struct While<R, F> {
    /// Who is told.
    pub record: R,
    /// Who decides.
    pub go_on: F,
}

impl<R: Record, F: FnMut() -> bool> Record for While<&mut R, F> {
    fn segment(&mut self, segment: Segment) {
        self.record.segment(segment);
    }

    fn event(&mut self, event: Event) {
        self.record.event(event);
    }

    fn go_on(&mut self) -> bool {
        (self.go_on)()
    }

    fn full(&self) -> bool {
        self.record.full()
    }

    fn arrived(&mut self, hybrid: HybridState) {
        self.record.arrived(hybrid);
    }
}

/// The state of the motion at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Position.
    pub x: f64,
    /// Velocity.
    pub v: f64,
    /// Acceleration ẍ.
    pub a: f64,
    /// Friction force on the mass.
    pub force: f64,
    /// Whether the mass sticks.
    pub stuck: bool,
}

/// A whole run.
#[derive(Clone, Debug)]
pub struct Orbit {
    /// What moved.
    pub oscillator: Oscillator,
    /// From where and how long.
    pub run: Run,
    /// The modes, in time.
    pub segments: Vec<Segment>,
    /// The events, in time.
    pub events: Vec<Event>,
    /// Why it ended.
    pub stop: Stop,
    /// What it cost.
    pub work: Work,
    /// What the contact does and remembers where the run reached its end.
    pub end: Option<Box<HybridState>>,
}

/// Rows up to which room is made for four times as many: to double it each time copies every row once more.
const FEW_ROWS: usize = 1024;

#[inline]
fn push<T>(rows: &mut Vec<T>, row: T) {
    if rows.len() == rows.capacity() {
        rows.reserve(3 * rows.len().clamp(1, FEW_ROWS));
    }
    rows.push(row);
}

impl Record for Orbit {
    fn segment(&mut self, segment: Segment) {
        push(&mut self.segments, segment);
    }

    fn event(&mut self, event: Event) {
        push(&mut self.events, event);
    }

    fn full(&self) -> bool {
        size_of_val(&*self.segments) + size_of_val(&*self.events) > MOST_BYTES
    }

    fn arrived(&mut self, hybrid: HybridState) {
        self.end = Some(Box::new(hybrid));
    }
}

impl Orbit {
    pub(crate) fn new(oscillator: Oscillator, run: Run) -> Self {
        Self {
            oscillator,
            run,
            segments: Vec::new(),
            events: Vec::new(),
            stop: Stop::End,
            work: Work::default(),
            end: None,
        }
    }

    /// How the motion goes on, if it reached its end.
    pub fn restart(&self) -> Option<Restart> {
        let hybrid = **self.end.as_ref().filter(|_| self.stop == Stop::End)?;
        let (last, segment) = (*self.states(&[self.run.t_end]).first()?, self.segments.last()?);
        let (w, stuck_for) = if last.stuck {
            (0.0, segment.clock.until(self.run.t_end))
        } else {
            (self.oscillator.drive_velocity - last.v, 0.0)
        };
        Some(Restart {
            x: last.x,
            w,
            stuck_for,
            hybrid,
        })
    }

    /// The time up to which the orbit is known: t_end, or where the run stopped before.
    pub fn t_last(&self) -> f64 {
        if self.stop == Stop::End {
            return self.run.t_end;
        }
        // A search that was stopped leaves a segment that begins where it had come to.
        let begun = self.segments.last().map_or(0.0, |segment| segment.clock.high);
        self.events.last().map_or(begun, |event| event.t.max(begun))
    }

    /// The states at `times`, in any order.
    pub fn states(&self, times: &[f64]) -> Vec<State> {
        let mut states = Vec::with_capacity(times.len());
        self.each_state(times, |state| states.push(state));
        states
    }

    /// Show the states at `times`, one after the other.
    pub(crate) fn each_state(&self, times: &[f64], see: impl FnMut(State)) {
        with_harmonics!(self.oscillator, H, self.evaluate::<H>(times, see));
    }

    fn evaluate<const H: usize>(&self, times: &[f64], mut see: impl FnMut(State)) {
        let frame = Frame::<H>::of(&self.oscillator);
        let begun = |index: usize, t: f64| self.segments[index].clock.until(t) >= 0.0;
        let mut known = None;
        for &t in times {
            // Times come in order as a rule: in the segment of the time before.
            let (index, slip) = match known.take() {
                Some((index, slip))
                    if begun(index, t) && (index + 1 == self.segments.len() || !begun(index + 1, t)) =>
                {
                    (index, slip)
                }
                _ => {
                    let after = self
                        .segments
                        .partition_point(|segment| segment.clock.until(t) >= 0.0);
                    let index = after.max(1) - 1;
                    (index, self.segments[index].slip(&frame))
                }
            };
            let segment = &self.segments[index];
            see(segment.state_on(slip.as_ref(), &frame, segment.clock.until(t)));
            known = Some((index, slip));
        }
    }
}
