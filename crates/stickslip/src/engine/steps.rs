//! The motion of any number of masses by Taylor steps.

use super::{Engine, Reached};
use crate::clock::Clock;
use crate::error::Error;
use crate::flow::taylor::{Coefficients, ForceLine, Frame, Motion};
use crate::lanes::{ALL_GO, LaneMotion};
use crate::network::orbit::ExpandedSteps;
use crate::network::{Loop, Orbit, Run, SPEED_ROUNDING};
use crate::observer::{Course, Observer};
use crate::orbit::Event;
use crate::oscillator::Oscillator;
use crate::series::{ORDER, Series, ZERO, at, curvature_bound, derivative, free_time, slope_at};
use crate::simulate::{self, Stop};
use crate::surface::{Cut, Guard, Point};
use crate::system::{Contact, System};
use crate::watch::Watched;

/// Any number of masses, drives that vary, smooth laws.
pub struct Steps<'a> {
    system: &'a System,
    state: Loop<'a>,
    run: Run,
    /// Events that count for the next call.
    ahead: u64,
    /// Steps that were gone in lanes, for the next call to show.
    passed: Vec<PassedStep>,
    end: Reached,
}

impl<'a> Steps<'a> {
    /// From the start of `run`; its time does not count.
    ///
    /// # Errors
    /// The first value of the system or the run that makes no sense.
    pub fn new(system: &'a System, run: Run) -> Result<Self, Error> {
        Ok(Self {
            state: Loop::started(system, &run)?,
            system,
            run,
            ahead: 0,
            passed: Vec::new(),
            end: Reached::default(),
        })
    }

    /// Its one mass as an oscillator, if it is one.
    pub(crate) fn one_mass(&self) -> Option<Oscillator> {
        self.system.one_mass()
    }

    /// The motion as one that may go in a lane.
    pub(crate) fn lane_motion<'b>(&mut self, oscillator: &'b Oscillator, t_end: f64) -> LaneMotion<'b> {
        let (at, hybrid) = self.state.at();
        let run = simulate::Run {
            x0: at.0,
            v0: Some(at.1),
            t_end,
            max_events: self.run.max_events - self.ahead,
        };
        LaneMotion {
            began: self.state.began(),
            ..LaneMotion::new(oscillator, run, Some(hybrid))
        }
    }

    /// Take over from where it went there, if it went at all: the start is known better here.
    pub(crate) fn take(&mut self, motion: &LaneMotion, passed: Vec<PassedStep>) {
        if motion.hybrid.clock == self.state.step().clock {
            return;
        }
        let (events, began) = (self.events() + motion.events, self.state.began());
        self.state = Loop::resumed(self.system, (motion.x, motion.v), &motion.hybrid);
        self.state.work.events = events;
        self.state.began = Some(began);
        self.ahead += motion.events;
        self.passed = passed;
    }
}

impl Engine for Steps<'_> {
    fn go(&mut self, t_end: f64, after: f64, observer: &mut impl Observer) -> Result<Stop, Error> {
        let run = Run {
            t_end,
            max_events: (self.events() - std::mem::take(&mut self.ahead)).saturating_add(self.run.max_events),
            ..self.run.clone()
        };
        if ALL_GO {
            for step in std::mem::take(&mut self.passed) {
                step.show(after, observer);
            }
        }
        let stop = self.state.follow(&run, false, after, observer);
        let step = self.state.step();
        let until = step.clock.until(t_end);
        self.end = step.reached(if stop == Stop::End { until } else { 0.0 });
        Ok(stop)
    }

    fn events(&self) -> u64 {
        self.state.work.events
    }

    fn end(&self) -> &Reached {
        &self.end
    }

    fn must_break(&self, contact: usize) -> bool {
        let Contact {
            other,
            drive_velocity,
            ..
        } = &self.system.contacts[contact];
        let mut rows = self.system.stiffness.iter();
        other.is_none()
            && drive_velocity.velocity != 0.0
            && drive_velocity.nodes.is_empty()
            && rows.any(|row| row.iter().sum::<f64>() > 0.0)
    }
}

/// The polynomials of a contact and its mass along one step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Track {
    pub(crate) x: Series,
    pub(crate) v: Series,
    /// The slip speed along `direction`.
    pub(crate) u: Series,
    /// The sign of the slip velocity, 0 while stuck.
    pub(crate) direction: f64,
    /// Speeds below this are zero within rounding.
    pub(crate) rounding: f64,
    /// The fastest rate of the motion.
    pub(crate) rate: f64,
}

impl Track {
    /// Of a mass that sticks on a drive.
    pub(crate) fn of_stick(x: f64, drive: f64, rate: f64) -> Self {
        let mut track = Self {
            x: ZERO,
            v: ZERO,
            u: ZERO,
            direction: 0.0,
            rounding: SPEED_ROUNDING * drive,
            rate,
        };
        (track.x[0], track.x[1], track.v[0]) = (x, drive, drive);
        track
    }

    pub(crate) fn point(&self, clock: Clock, tau: f64) -> Point {
        Point {
            t: clock.after(tau).high,
            x: at(&self.x, tau),
            v: at(&self.v, tau),
            w: self.direction * at(&self.u, tau),
        }
    }

    /// All surfaces, one after the other.
    fn cross_all(
        &self,
        clock: Clock,
        cuts: &mut [&mut Cut],
        span: (f64, f64),
        watched: &mut Watched,
        found: &mut dyn FnMut(usize, Point),
    ) {
        for (which, cut) in cuts.iter_mut().enumerate() {
            self.cross(clock, cut, span, watched, &mut |point| found(which, point));
        }
    }

    /// n·(x, ẋ, ẍ, ẇ) − c is a polynomial, whose curvature is bounded by its coefficients.
    pub(crate) fn cross(
        &self,
        clock: Clock,
        cut: &mut Cut,
        span: (f64, f64),
        watched: &mut Watched,
        found: &mut impl FnMut(Point),
    ) {
        let [along_x, along_v, along_a, along_slip] = cut.normal;
        let (a, slip) = (derivative(&self.v), derivative(&self.u));
        let mut g = ZERO;
        for k in 0..=ORDER {
            g[k] = along_x * self.x[k]
                + along_v * self.v[k]
                + along_a * a[k]
                + along_slip * self.direction * slip[k];
        }
        g[0] -= cut.level;
        let speed =
            along_x.abs() / self.rate + along_v.abs() + self.rate * (along_a.abs() + along_slip.abs());
        let sizes = (along_x * self.x[0]).abs() + (along_v * self.v[0]).abs() + cut.level.abs();
        let noise = self.rounding * speed + 4.0 * f64::EPSILON * sizes;
        let (_, to) = span;
        let whole = curvature_bound(&g, to);
        let guard = |t: f64| {
            let (value, rate) = slope_at(&g, t);
            let (mut curvature, mut reach) = (whole, to - t);
            // A tighter bound, over as far as it may be used.
            let near = 8.0 * free_time(value.abs(), -rate.abs(), whole);
            if value.abs() > noise && near < reach {
                (curvature, reach) = (curvature_bound(&g, t + near), near);
            }
            Guard {
                value,
                rate,
                curvature,
                noise,
                reach,
            }
        };
        cut.march(span, to, watched, &guard, &|t| self.point(clock, t), found);
    }
}

/// A step of one mass along its track.
#[derive(Clone, Debug)]
pub(crate) struct TrackStep {
    pub(crate) clock: Clock,
    pub(crate) track: Track,
    pub(crate) sticks: bool,
}

impl Course for TrackStep {
    fn clock(&self) -> Clock {
        self.clock
    }

    fn point(&self, _contact: usize, tau: f64) -> Point {
        self.track.point(self.clock, tau)
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
        self.track.cross_all(self.clock, cuts, span, watched, found);
    }
}

/// A step that was gone in lanes, and the event at its end, if there was one.
#[derive(Clone, Debug)]
pub(crate) struct PassedStep {
    pub(crate) step: TrackStep,
    pub(crate) lasts: f64,
    pub(crate) event: Option<Event>,
}

impl PassedStep {
    /// Show it from the time `after` on.
    fn show<O: Observer>(&self, after: f64, observer: &mut O) {
        let from = self.step.clock.until(after).max(0.0);
        if O::PASSES && from < self.lasts {
            observer.pass(&self.step, (from, self.lasts), false);
        }
        if let Some(event) = self.event.filter(|event| event.t >= after) {
            observer.event(&event);
        }
    }
}

/// One Taylor step of all masses.
pub(crate) struct Step<'a> {
    pub(crate) clock: Clock,
    pub(crate) frame: &'a Frame,
    pub(crate) motion: &'a Motion,
    pub(crate) force_lines: &'a [ForceLine],
    /// Speeds below this are zero within rounding.
    pub(crate) rounding: f64,
}

impl Step<'_> {
    fn track(&self, contact: usize) -> Track {
        let mass = self.frame.mass_of(contact);
        Track {
            x: self.motion.x.series(mass),
            v: self.motion.v.series(mass),
            u: self.motion.u.series(contact),
            direction: self.force_lines[contact].direction,
            rounding: self.rounding,
            rate: self.frame.rate,
        }
    }

    /// The state `h` after its start.
    pub(crate) fn reached(&self, h: f64) -> Reached {
        // Where a run leaves the numbers only the start of its last step is one.
        let at = |series: &Series, h: f64| if h == 0.0 { series[0] } else { at(series, h) };
        let all = |of: &Coefficients| (0..of.count()).map(|i| at(&of.series(i), h)).collect();
        let (x, v): (Vec<f64>, Vec<f64>) = (all(&self.motion.x), all(&self.motion.v));
        let mut rides = vec![false; x.len()];
        for (contact, force_line) in self.force_lines.iter().enumerate() {
            rides[self.frame.mass_of(contact)] |= force_line.direction == 0.0 && self.frame.driven(contact);
        }
        let slip = self.force_lines.iter().enumerate();
        Reached {
            w: slip
                .map(|(contact, force_line)| force_line.direction * at(&self.motion.u.series(contact), h))
                .collect(),
            x,
            v,
            rides,
            restart: None,
        }
    }
}

impl Course for Step<'_> {
    fn clock(&self) -> Clock {
        self.clock
    }

    fn point(&self, contact: usize, tau: f64) -> Point {
        self.track(contact).point(self.clock, tau)
    }

    fn sticks(&self, contact: usize) -> bool {
        self.force_lines[contact].direction == 0.0
    }

    fn cross(
        &self,
        contact: usize,
        cuts: &mut [&mut Cut],
        span: (f64, f64),
        watched: &mut Watched,
        found: &mut dyn FnMut(usize, Point),
    ) {
        self.track(contact)
            .cross_all(self.clock, cuts, span, watched, found);
    }
}

/// An orbit that is there already, shown again; it is gone along once.
pub struct ReplaySteps<'a> {
    orbit: &'a Orbit,
    end: Reached,
}

impl<'a> ReplaySteps<'a> {
    /// Of the whole orbit.
    #[must_use]
    pub fn new(orbit: &'a Orbit) -> Self {
        Self {
            orbit,
            end: Reached::default(),
        }
    }
}

impl Engine for ReplaySteps<'_> {
    fn go(&mut self, t_end: f64, after: f64, observer: &mut impl Observer) -> Result<Stop, Error> {
        let mut steps = ExpandedSteps::new(self.orbit);
        let mut events = self.orbit.events.iter().peekable();
        let mut scale = f64::MIN_POSITIVE;
        for index in 0..steps.count() {
            let clock = steps.expand(index);
            let next = (index + 1 < steps.count()).then(|| steps.clock(index + 1));
            let next = next.filter(|next| next.until(t_end) > 0.0);
            let until = next.map_or(clock.until(t_end), |next| clock.until(next.high) + next.low);
            let speeds = steps.motion.v.of(0).iter();
            scale = speeds.fold(scale, |most: f64, v| most.max(v.abs()));
            while let Some(event) = events.next_if(|event| event.t <= clock.high) {
                if event.t >= after {
                    observer.event(event);
                }
            }
            let step = Step {
                clock,
                frame: &steps.frame,
                motion: &steps.motion,
                force_lines: &steps.force_lines,
                rounding: SPEED_ROUNDING * scale,
            };
            let from = clock.until(after).max(0.0);
            if from < until || next.is_none() {
                observer.pass(&step, (from, until), next.is_none());
            }
            if next.is_none() {
                self.end = step.reached(until);
                break;
            }
            if index.is_multiple_of(64) && !observer.go_on() {
                return Ok(Stop::MaxSeconds);
            }
        }
        Ok(Stop::End)
    }

    fn events(&self) -> u64 {
        self.orbit.work.events
    }

    fn end(&self) -> &Reached {
        &self.end
    }
}
