//! The motion of one mass in closed form, segment by segment.

use super::crossings::between;
use super::{Engine, Reached};
use crate::clock::Clock;
use crate::error::Error;
use crate::flow::exact::{Frame, Response, Slip};
use crate::hybrid_state::{HybridState, Restart};
use crate::lanes::LaneMotion;
use crate::observer::{Course, Observer};
use crate::orbit::{Event, Orbit, Record, Segment};
use crate::oscillator::{Oscillator, with_harmonics};
use crate::simulate::{Run, Stop, observe_forced, resume_forced};
use crate::surface::{Cut, Point};
use crate::watch::Watched;

/// One mass on a constant drive, under a law of linear pieces.
#[derive(Clone, Debug)]
pub struct Closed<'a> {
    oscillator: &'a Oscillator,
    run: Run,
    hybrid: Option<HybridState>,
    events: u64,
    /// Events that count for the next call.
    ahead: u64,
    /// Modes that were passed and their events, for the next call to show.
    passed: Vec<(Segment, Event)>,
    end: Reached,
}

impl<'a> Closed<'a> {
    /// From the start of `run`, or from a hybrid state with its x and v; the time of `run` does not count.
    #[must_use]
    pub fn new(oscillator: &'a Oscillator, run: Run, hybrid: Option<HybridState>) -> Self {
        Self {
            oscillator,
            run,
            hybrid,
            events: 0,
            ahead: 0,
            passed: Vec::new(),
            end: Reached::default(),
        }
    }

    pub(crate) fn oscillator(&self) -> &'a Oscillator {
        self.oscillator
    }

    /// The motion as one that may go in a lane, to its last mode before `t_end`.
    pub(crate) fn lane_motion(&self, t_end: f64) -> LaneMotion<'a> {
        let max_events = self.run.max_events - self.ahead;
        let run = Run {
            t_end,
            max_events,
            ..self.run
        };
        LaneMotion::new(self.oscillator, run, self.hybrid)
    }

    /// Take over from where it went there; the next call shows what `passed` and goes on from there.
    pub(crate) fn take(&mut self, motion: &LaneMotion, passed: Vec<(Segment, Event)>) {
        self.passed = passed;
        if motion.events > 0 {
            (self.run.x0, self.run.v0, self.hybrid) = (motion.x, Some(motion.v), Some(motion.hybrid));
            self.events += motion.events;
            self.ahead += motion.events;
        }
    }

    /// From where another motion ended, after so many events at the most.
    #[must_use]
    pub fn restart(oscillator: &'a Oscillator, restart: Restart, max_events: u64) -> Self {
        let (x0, v0, hybrid) = restart.hybrid(oscillator.drive_velocity, Clock::default());
        let run = Run {
            x0,
            v0: Some(v0),
            t_end: f64::INFINITY,
            max_events,
        };
        Self::new(oscillator, run, Some(hybrid))
    }

    fn follow<const H: usize>(
        &mut self,
        t_end: f64,
        after: f64,
        observer: &mut impl Observer,
    ) -> Result<Stop, Error> {
        let mut follower = Follower::<H, _>::new(self.oscillator, after, observer);
        for (segment, event) in std::mem::take(&mut self.passed) {
            follower.segment(segment);
            follower.event(event);
        }
        let run = Run {
            t_end,
            max_events: self.run.max_events - std::mem::take(&mut self.ahead),
            ..self.run
        };
        let (mut stop, work) = match self.hybrid {
            Some(hybrid) => resume_forced::<H>(self.oscillator, run, hybrid, &mut follower)?,
            None => observe_forced::<H>(self.oscillator, run, &mut follower)?,
        };
        self.events += work.events;
        if let Some((reached, start)) = follower.finish(&mut stop, t_end) {
            self.end = reached;
            self.hybrid = follower.hybrid;
            (self.run.x0, self.run.v0) = (start.0, Some(start.1));
        }
        Ok(stop)
    }
}

impl Engine for Closed<'_> {
    fn go(&mut self, t_end: f64, after: f64, observer: &mut impl Observer) -> Result<Stop, Error> {
        with_harmonics!(self.oscillator, H, self.follow::<H>(t_end, after, observer))
    }

    fn events(&self) -> u64 {
        self.events
    }

    fn end(&self) -> &Reached {
        &self.end
    }

    fn must_break(&self, _contact: usize) -> bool {
        self.oscillator.drive_velocity != 0.0
    }
}

/// An orbit that is there already, shown again; it is gone along once.
#[derive(Clone, Debug)]
pub struct Replay<'a> {
    orbit: &'a Orbit,
    end: Reached,
}

impl<'a> Replay<'a> {
    /// Of the whole orbit.
    #[must_use]
    pub fn new(orbit: &'a Orbit) -> Self {
        Self {
            orbit,
            end: Reached::default(),
        }
    }

    fn follow<const H: usize>(&mut self, t_end: f64, after: f64, observer: &mut impl Observer) -> Stop {
        let mut follower = Follower::<H, _>::new(&self.orbit.oscillator, after, observer);
        let mut events = self.orbit.events.iter();
        for (index, segment) in self.orbit.segments.iter().enumerate() {
            if segment.clock.high > t_end {
                break;
            }
            if index > 0 {
                events.next().into_iter().for_each(|event| follower.event(*event));
            }
            follower.segment(*segment);
        }
        let mut stop = Stop::End;
        self.end = follower
            .finish(&mut stop, t_end)
            .map_or_else(Reached::default, |(reached, _)| reached);
        stop
    }
}

impl Engine for Replay<'_> {
    fn go(&mut self, t_end: f64, after: f64, observer: &mut impl Observer) -> Result<Stop, Error> {
        Ok(with_harmonics!(
            self.orbit.oscillator,
            H,
            self.follow::<H>(t_end, after, observer)
        ))
    }

    fn events(&self) -> u64 {
        self.orbit.work.events
    }

    fn end(&self) -> &Reached {
        &self.end
    }
}

/// Makes courses of segments.
struct Follower<'a, const H: usize, O> {
    frame: Frame<H>,
    after: f64,
    open: Option<Segment>,
    kept: Option<Response<H>>,
    hybrid: Option<HybridState>,
    observer: &'a mut O,
}

impl<'a, const H: usize, O: Observer> Follower<'a, H, O> {
    fn new(oscillator: &Oscillator, after: f64, observer: &'a mut O) -> Self {
        Self {
            frame: Frame::of(oscillator),
            after,
            open: None,
            kept: None,
            hybrid: None,
            observer,
        }
    }

    /// The state that was reached, and that from which a motion that reached its end goes on.
    fn finish(&mut self, stop: &mut Stop, t_end: f64) -> Option<(Reached, (f64, f64))> {
        let segment = self.open.take()?;
        let ended = *stop == Stop::End;
        let until = if ended { segment.clock.until(t_end) } else { 0.0 };
        let state = segment.state(&self.frame, until);
        let w = if state.stuck {
            0.0
        } else {
            self.frame.drive_velocity - state.v
        };
        let hybrid = self.hybrid.filter(|_| ended);
        let restart = hybrid.map(|hybrid| Restart {
            x: state.x,
            w,
            stuck_for: if state.stuck { until } else { 0.0 },
            hybrid,
        });
        if ended {
            self.close(&segment, until, true);
            if !self.observer.go_on() {
                // What the last segment has may not be all there.
                *stop = Stop::MaxSeconds;
            } else if self.observer.full() {
                *stop = Stop::Memory;
            }
        }
        let reached = Reached {
            x: vec![state.x],
            v: vec![state.v],
            rides: vec![state.stuck],
            w: vec![w],
            restart,
        };
        // A stick is gone on with from where it began.
        let start = if state.stuck {
            (segment.x, segment.v)
        } else {
            (state.x, state.v)
        };
        Some((reached, start))
    }

    fn close(&mut self, segment: &Segment, until: f64, last: bool) {
        let from = segment.clock.until(self.after).max(0.0);
        if O::PASSES && (from < until || last) {
            let phase = ClosedPhase::new(&self.frame, segment, &mut self.kept);
            self.observer.pass(&phase, (from, until), last);
        }
    }
}

impl<const H: usize, O: Observer> Record for Follower<'_, H, O> {
    fn segment(&mut self, segment: Segment) {
        if let Some(before) = self.open.replace(segment) {
            let until = before.clock.until(segment.clock.high) + segment.clock.low;
            self.close(&before, until, false);
        }
    }

    fn event(&mut self, event: Event) {
        if event.t >= self.after {
            self.observer.event(&event);
        }
    }

    fn go_on(&mut self) -> bool {
        self.observer.go_on()
    }

    fn full(&self) -> bool {
        self.observer.full()
    }

    fn arrived(&mut self, hybrid: HybridState) {
        self.hybrid = Some(hybrid);
    }
}

/// What the mass does during one segment.
struct ClosedPhase<const H: usize> {
    clock: Clock,
    drive_velocity: f64,
    sticks: bool,
    motion: Motion<H>,
}

enum Motion<const H: usize> {
    /// At constant velocity: stuck, or held between two branches of friction.
    Steady {
        x: f64,
        v: f64,
    },
    Slip(Slip<H>),
}

impl<const H: usize> ClosedPhase<H> {
    /// What a segment is; `kept` has what depends on the slope of friction alone, from one to the next.
    fn new(frame: &Frame<H>, segment: &Segment, kept: &mut Option<Response<H>>) -> Self {
        let motion = if segment.direction == 0.0 || segment.slope.is_infinite() {
            Motion::Steady {
                x: segment.x,
                v: segment.v,
            }
        } else {
            let piece = segment.piece();
            kept.take_if(|response| response.slope != segment.slope);
            let response = kept.get_or_insert_with(|| frame.response(segment.slope));
            let forces = frame.forces(segment.clock);
            Motion::Slip(response.from(frame, &forces, (segment.x, segment.v), segment.direction, &piece))
        };
        Self {
            clock: segment.clock,
            drive_velocity: frame.drive_velocity,
            sticks: segment.direction == 0.0,
            motion,
        }
    }

    /// Where it is after a time, at a position and a velocity.
    fn at(&self, tau: f64, [x, v]: [f64; 2]) -> Point {
        Point {
            t: self.clock.after(tau).high,
            x,
            v,
            w: if self.sticks { 0.0 } else { self.drive_velocity - v },
        }
    }

    /// A line of the phase plane at constant velocity.
    fn cross_steady(
        &self,
        cut: &mut Cut,
        (x, v): (f64, f64),
        (from, to): (f64, f64),
        found: &mut impl FnMut(Point),
    ) {
        let [along_x, along_v, ..] = cut.normal;
        let noise = 4.0 * f64::EPSILON * ((along_x * x).abs() + (along_v * v).abs() + cut.level.abs());
        let slope = along_x * v;
        let value = |tau: f64| along_x * x + along_v * v - cut.level + slope * tau;
        let (first, last) = (value(from), value(to));
        if first.abs() > noise {
            cut.see(first.signum(), || self.point(0, from), found);
        } else if slope == 0.0 {
            cut.stay(|| self.point(0, from));
        }
        if last.abs() > noise && last.signum() != cut.side() {
            let root = (from - first / slope).max(from).min(to);
            cut.see(last.signum(), || self.point(0, root), found);
        }
    }
}

impl<const H: usize> Course for ClosedPhase<H> {
    fn clock(&self) -> Clock {
        self.clock
    }

    fn point(&self, _contact: usize, tau: f64) -> Point {
        let state = match &self.motion {
            Motion::Steady { x, v } => [x + v * tau, *v],
            Motion::Slip(slip) => {
                let basis = slip.basis(tau);
                [slip.position(tau, &basis), slip.v.at(&basis)]
            }
        };
        self.at(tau, state)
    }

    fn sticks(&self, _contact: usize) -> bool {
        self.sticks
    }

    fn cross(
        &self,
        _contact: usize,
        cuts: &mut [&mut Cut],
        span: (f64, f64),
        watched: &mut Watched,
        found: &mut dyn FnMut(usize, Point),
    ) {
        match &self.motion {
            Motion::Steady { x, v } => {
                for (which, cut) in cuts.iter_mut().enumerate() {
                    self.cross_steady(cut, (*x, *v), span, &mut |point| found(which, point));
                }
            }
            Motion::Slip(slip) => {
                let point = |tau, state| self.at(tau, state);
                between(slip, cuts, span, watched, &point, found);
            }
        }
    }
}
