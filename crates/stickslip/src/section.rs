//! Sections: the states in which a motion meets a surface, found while it runs; no segment is kept.
//!
//! Along a closed-form segment n·(x, ẋ, ẍ) − c is a short sum of damped sines. Its curvature is bounded, so the march to
//! its next root jumps over none.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use serde::Deserialize;

use crate::drive::Clock;
use crate::elementary::hypot;
use crate::error::{Error, finite, positive};
use crate::event::Work;
use crate::flow::exact::{Frame, Signal, Slip};
use crate::law::Piece;
use crate::mode::Kind;
use crate::orbit::{Event, Record, Segment};
use crate::place::Place;
use crate::series::free_time;
use crate::simulate::{MOST_BYTES, Run, Stop, observe, resume};
use crate::structure::Oscillator;
use crate::watch::Watched;

/// What makes a section.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Surface {
    /// The times start + n · period.
    Strobe {
        /// Time between two points.
        period: f64,
        /// The time of point 0.
        start: f64,
    },
    /// Events of one kind.
    Event(Kind),
    /// normal · (x, ẋ, ẍ) = level.
    Plane {
        /// Coefficients of position, velocity and acceleration.
        normal: [f64; 3],
        /// The value on the surface.
        level: f64,
        /// Which crossings count: 1 where the left side rises, −1 where it falls, 0 both.
        direction: i8,
    },
}

impl Surface {
    /// The stroboscopic section of a forced oscillator, the maxima of x of another.
    #[must_use]
    pub fn usual(oscillator: &Oscillator) -> Self {
        match oscillator.forcing.first() {
            Some(harmonic) => Self::Strobe {
                period: TAU / harmonic.frequency,
                start: 0.0,
            },
            None => Self::Plane {
                normal: [0.0, 1.0, 0.0],
                level: 0.0,
                direction: -1,
            },
        }
    }

    /// Check every value.
    ///
    /// # Errors
    /// The first value that makes no sense.
    pub fn validate(&self) -> Result<(), Error> {
        match *self {
            Self::Strobe { period, start } => {
                positive("section period", period)?;
                finite("section start", start).map(drop)
            }
            Self::Event(_) => Ok(()),
            Self::Plane { normal, level, .. } => {
                finite("section level", level)?;
                for coefficient in normal {
                    finite("section normal", coefficient)?;
                }
                if normal == [0.0; 3] {
                    return Err(Error::Document {
                        reason: "the normal of a section must not be zero".into(),
                    });
                }
                Ok(())
            }
        }
    }
}

/// A state in a section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Time.
    pub t: f64,
    /// Position.
    pub x: f64,
    /// Velocity.
    pub v: f64,
}

/// What the mass does during one segment.
pub(crate) struct Course<const H: usize> {
    clock: Clock,
    /// The sign of the slip velocity, 0 while stuck.
    pub(crate) direction: f64,
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

impl<const H: usize> Course<H> {
    fn new(frame: &Frame<H>, segment: &Segment) -> Self {
        let motion = if segment.direction == 0.0 || segment.slope.is_infinite() {
            Motion::Steady {
                x: segment.x,
                v: segment.v,
            }
        } else {
            let piece = Piece {
                offset: segment.offset,
                slope: segment.slope,
                low: 0.0,
                high: f64::INFINITY,
                branch: segment.branch,
                turns: false,
            };
            Motion::Slip(frame.closed(segment.clock, segment.x, segment.v, segment.direction, &piece))
        };
        Self {
            clock: segment.clock,
            direction: segment.direction,
            motion,
        }
    }

    pub(crate) fn point(&self, tau: f64) -> Point {
        let (x, v) = match &self.motion {
            Motion::Steady { x, v } => (x + v * tau, *v),
            Motion::Slip(slip) => {
                let basis = slip.basis(tau);
                (slip.position(tau, &basis), slip.v.at(&basis))
            }
        };
        Point {
            t: self.clock.after(tau).high,
            x,
            v,
        }
    }
}

/// Whoever looks at the motion between two events.
pub(crate) trait View<const H: usize> {
    /// The mass follows `course` from `span.0` to `span.1` after its start; `last` where the run ends.
    fn pass(&mut self, course: &Course<H>, span: (f64, f64), last: bool);
    /// An event occurred.
    fn event(&mut self, event: Event);
    /// Whether to go on; asked every thousand events, and within a long search.
    fn go_on(&mut self) -> bool;
    /// Whether what is kept may not grow any more.
    fn full(&self) -> bool {
        false
    }
    /// The end of the run was reached here.
    fn arrived(&mut self, _place: Place) {}
}

/// Run, from the start or from a place, and show what happens from the time `after` on. Returns why the run ended and how
/// many events it had.
pub(crate) fn follow<const H: usize>(
    oscillator: &Oscillator,
    run: Run,
    from: Option<Place>,
    after: f64,
    view: &mut impl View<H>,
) -> Result<(Stop, u64), Error> {
    let mut follower = Follower {
        frame: Frame::of(oscillator),
        after,
        open: None,
        view,
    };
    let (mut stop, work) = match from {
        Some(place) => resume(oscillator, run, place, &mut follower)?,
        None => observe(oscillator, run, &mut follower)?,
    };
    if stop == Stop::End
        && let Some(segment) = follower.open.take()
    {
        follower.close(&segment, segment.clock.until(run.t_end), true);
        if !follower.view.go_on() {
            // What the last segment has may not be all there.
            stop = Stop::MaxSeconds;
        } else if follower.view.full() {
            stop = Stop::Memory;
        }
    }
    Ok((stop, work.events))
}

struct Follower<'a, const H: usize, V> {
    frame: Frame<H>,
    after: f64,
    open: Option<Segment>,
    view: &'a mut V,
}

impl<const H: usize, V: View<H>> Follower<'_, H, V> {
    fn close(&mut self, segment: &Segment, until: f64, last: bool) {
        let from = segment.clock.until(self.after).max(0.0);
        if from < until || last {
            self.view
                .pass(&Course::new(&self.frame, segment), (from, until), last);
        }
    }
}

impl<const H: usize, V: View<H>> Record for Follower<'_, H, V> {
    fn segment(&mut self, segment: Segment) {
        if let Some(before) = self.open.replace(segment) {
            let until = before.clock.until(segment.clock.high) + segment.clock.low;
            self.close(&before, until, false);
        }
    }

    fn event(&mut self, event: Event) {
        if event.t >= self.after {
            self.view.event(event);
        }
    }

    fn go_on(&mut self) -> bool {
        self.view.go_on()
    }

    fn full(&self) -> bool {
        self.view.full()
    }

    fn arrived(&mut self, place: Place) {
        self.view.arrived(place);
    }
}

/// Points at regular times.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Strobe {
    period: f64,
    start: f64,
}

impl Strobe {
    fn pass<const H: usize>(
        &self,
        course: &Course<H>,
        (from, to): (f64, f64),
        last: bool,
        watched: &mut Watched,
        found: &mut impl FnMut(Point),
    ) {
        // The ends of a run are whole periods as a rule: rounding must not take or double a point there.
        let slack = 1e-9 * self.period;
        let (from, to) = (from - slack, if last { to + slack } else { to - slack });
        let since = |tau: f64| course.clock.high - self.start + course.clock.low + tau;
        let mut n = (since(from) / self.period).ceil();
        loop {
            let tau = course.clock.until(self.start + n * self.period);
            if tau >= to || watched.ends(tau) {
                return;
            }
            found(course.point(tau.max(0.0)));
            n += 1.0;
        }
    }
}

/// Motion smaller than this, in whatever units, has come to rest.
const DIED_OUT: f64 = 1e-150;

/// Crossings of normal · (x, ẋ, ẍ) = level.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cut {
    normal: [f64; 3],
    level: f64,
    direction: f64,
    /// The side the motion was last seen on.
    side: f64,
    /// Where it came to rest on the surface, if it does.
    rest: Option<Point>,
}

impl Cut {
    pub(crate) fn new(normal: [f64; 3], level: f64, direction: i8) -> Self {
        Self {
            normal,
            level,
            direction: f64::from(direction),
            side: 0.0,
            rest: None,
        }
    }

    pub(crate) fn pass<const H: usize>(
        &mut self,
        course: &Course<H>,
        span: (f64, f64),
        watched: &mut Watched,
        found: &mut impl FnMut(Point),
    ) {
        match &course.motion {
            Motion::Steady { x, v } => self.pass_steady(course, *x, *v, span, found),
            Motion::Slip(slip) => self.pass_slip(course, slip, span, watched, found),
        }
    }

    /// The motion is on the side `sign` at `point`; a crossing if it was on the other.
    fn see(&mut self, sign: f64, point: impl FnOnce() -> Point, found: &mut impl FnMut(Point)) {
        let rest = self.rest.take();
        if self.side == -sign && (self.direction == 0.0 || self.direction == sign) {
            found(rest.unwrap_or_else(point));
        }
        self.side = sign;
    }

    fn pass_steady<const H: usize>(
        &mut self,
        course: &Course<H>,
        x: f64,
        v: f64,
        (from, to): (f64, f64),
        found: &mut impl FnMut(Point),
    ) {
        let [along_x, along_v, _] = self.normal;
        let noise = 4.0 * f64::EPSILON * ((along_x * x).abs() + (along_v * v).abs() + self.level.abs());
        let slope = along_x * v;
        let value = |tau: f64| along_x * x + along_v * v - self.level + slope * tau;
        let (first, last) = (value(from), value(to));
        if first.abs() > noise {
            self.see(first.signum(), || course.point(from), found);
        } else if slope == 0.0 {
            self.rest = self.rest.or_else(|| Some(course.point(from)));
        }
        if last.abs() > noise && last.signum() != self.side {
            let root = (from - first / slope).max(from).min(to);
            self.see(last.signum(), || course.point(root), found);
        }
    }

    fn pass_slip<const H: usize>(
        &mut self,
        course: &Course<H>,
        slip: &Slip<H>,
        (from, to): (f64, f64),
        watched: &mut Watched,
        found: &mut impl FnMut(Point),
    ) {
        let a = slip.v.derivative(&slip.decay, &slip.frequency);
        let signals = [&slip.x, &slip.v, &a];
        let sum = |part: fn(&Signal<H>) -> f64| {
            let each = self.normal.iter().zip(signals);
            each.map(|(factor, signal)| factor * part(signal)).sum::<f64>()
        };
        let waves = |part: fn(&Signal<H>) -> &[f64; H]| {
            std::array::from_fn::<f64, H, _>(|j| {
                let each = self.normal.iter().zip(signals);
                each.map(|(factor, signal)| factor * part(signal)[j]).sum()
            })
        };
        let g = Signal {
            constant: sum(|signal| signal.constant) - self.level,
            free: [sum(|signal| signal.free[0]), sum(|signal| signal.free[1])],
            p: waves(|signal| &signal.p),
            q: waves(|signal| &signal.q),
        };
        let dg = g.derivative(&slip.decay, &slip.frequency);
        let (mut swing, mut waves) = (g.constant.abs() + self.level.abs(), 0.0);
        for j in 0..H {
            let amplitude = hypot(g.p[j], g.q[j]);
            swing += amplitude;
            waves += slip.frequency[j] * slip.frequency[j] * amplitude;
        }
        // The bound of the curvature is taken anew after this long: it shrinks as the free motion decays.
        let reach = slip.decay.time();
        let growth = slip.decay.growth(reach);
        let mut t = from;
        while t < to && !watched.ends(t) {
            let basis = slip.basis(t);
            let (value, rate) = (g.at(&basis), dg.at(&basis));
            let amplitudes = slip.decay.amplitudes(g.free(&basis), dg.free(&basis));
            let (mut bend, mut free) = (waves, 0.0);
            for (amplitude, exponent) in amplitudes.into_iter().zip(slip.decay.exponents()) {
                bend += growth * amplitude * exponent * exponent;
                free += amplitude;
            }
            // The squares of what has died out further are no numbers.
            let noise = (4.0 * f64::EPSILON * (swing + free)).max(DIED_OUT);
            if value.abs() > noise {
                self.see(value.signum(), || course.point(t), found);
            } else if rate.abs() * reach <= noise && bend * reach * reach <= noise {
                // On the surface for good, as far as rounding can tell.
                self.rest = self.rest.or_else(|| Some(course.point(t)));
                t += reach;
                continue;
            }
            let tiny = 4.0 * f64::EPSILON * t.max(reach);
            let mut step = free_time((self.side * value).max(0.0), self.side * rate, bend);
            if step <= tiny {
                if self.side * rate < 0.0 {
                    self.see(-self.side, || course.point(t), found);
                    step = free_time(0.0, rate.abs(), bend);
                } else {
                    // It touches: the square root of rounding leads past.
                    step = 1e-8 * reach;
                }
            }
            t += step.max(tiny).min(reach);
        }
    }
}

/// A surface while a motion passes it.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Passing {
    Strobe(Strobe),
    Event(Kind),
    Cut(Cut),
}

impl Passing {
    pub(crate) fn new(surface: &Surface) -> Self {
        match *surface {
            Surface::Strobe { period, start } => Self::Strobe(Strobe { period, start }),
            Surface::Event(kind) => Self::Event(kind),
            Surface::Plane {
                normal,
                level,
                direction,
            } => Self::Cut(Cut::new(normal, level, direction)),
        }
    }

    pub(crate) fn pass<const H: usize>(
        &mut self,
        course: &Course<H>,
        span: (f64, f64),
        last: bool,
        watched: &mut Watched,
        found: &mut impl FnMut(Point),
    ) {
        match self {
            Self::Strobe(strobe) => strobe.pass(course, span, last, watched, found),
            Self::Cut(cut) => cut.pass(course, span, watched, found),
            Self::Event(_) => {}
        }
    }

    pub(crate) fn event(&self, event: &Event) -> Option<Point> {
        let there = matches!(self, Self::Event(kind) if *kind == event.kind);
        there.then_some(Point {
            t: event.t,
            x: event.x,
            v: event.v,
        })
    }
}

/// Keep the last `most` of what comes.
pub(crate) fn keep<T>(ring: &mut VecDeque<T>, most: usize, value: T) {
    if ring.len() == most {
        ring.pop_front();
    }
    if most > 0 {
        ring.push_back(value);
    }
}

/// The last `most` points of a section from the time `after` on, as long as `go_on` says so, and why the run ended.
///
/// # Errors
/// The first value of the oscillator, the run or the surface that makes no sense.
pub fn section(
    oscillator: &Oscillator,
    run: Run,
    surface: &Surface,
    after: f64,
    most: usize,
    go_on: impl FnMut() -> bool,
) -> Result<(Vec<SectionPoint>, Stop), Error> {
    surface.validate()?;
    let mut gather = Gather {
        passing: Passing::new(surface),
        most,
        points: VecDeque::new(),
        go_on,
    };
    let (stop, _) = match oscillator.forcing.len() {
        0 => follow::<0>(oscillator, run, None, after, &mut gather),
        1 => follow::<1>(oscillator, run, None, after, &mut gather),
        2 => follow::<2>(oscillator, run, None, after, &mut gather),
        3 => follow::<3>(oscillator, run, None, after, &mut gather),
        _ => follow::<4>(oscillator, run, None, after, &mut gather),
    }?;
    Ok((gather.points.into(), stop))
}

/// A point of a section, with what its event says where it is one; not a number elsewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionPoint {
    /// The state.
    pub point: Point,
    /// Friction on the mass just before the event.
    pub force: f64,
    /// Time of adhesion before a release.
    pub stick_time: f64,
    /// d|F|/dt at a release.
    pub force_rate: f64,
}

impl From<Point> for SectionPoint {
    fn from(point: Point) -> Self {
        Self {
            point,
            force: f64::NAN,
            stick_time: f64::NAN,
            force_rate: f64::NAN,
        }
    }
}

struct Gather<F> {
    passing: Passing,
    most: usize,
    points: VecDeque<SectionPoint>,
    go_on: F,
}

impl<const H: usize, F: FnMut() -> bool> View<H> for Gather<F> {
    fn pass(&mut self, course: &Course<H>, span: (f64, f64), last: bool) {
        let (points, most) = (&mut self.points, self.most);
        let mut work = Work::default();
        let watched = &mut Watched::new(&mut work, &mut self.go_on);
        self.passing.pass(course, span, last, watched, &mut |point| {
            keep(points, most, point.into());
        });
    }

    fn event(&mut self, event: Event) {
        if let Some(point) = self.passing.event(&event) {
            let point = SectionPoint {
                point,
                force: event.force,
                stick_time: event.stick_time,
                force_rate: event.force_rate,
            };
            keep(&mut self.points, self.most, point);
        }
    }

    fn go_on(&mut self) -> bool {
        (self.go_on)()
    }

    fn full(&self) -> bool {
        self.points.len() * size_of::<SectionPoint>() > MOST_BYTES
    }
}
