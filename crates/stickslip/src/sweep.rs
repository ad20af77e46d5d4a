//! Steady motions over parameters and starts, told apart while they run: memory does not grow with their length.
//!
//! Each run has a transient and then a window that is looked at: its extremes, how it meets a section, and after how many
//! returns to the section it repeats. Rows may stand alone, or follow each other, each starting where the one before ended.

use std::collections::VecDeque;
use std::f64::consts::TAU;
use std::ops::Range;

use serde::Deserialize;

use crate::drive::Clock;
use crate::error::{Error, positive};
use crate::event::Work;
use crate::mode::Kind;
use crate::orbit::Event;
use crate::place::Place;
use crate::regime::Regime;
use crate::rows::Rows;
use crate::section::{Course, Cut, Passing, Point, Surface, View, follow, keep};
use crate::simulate::{Run, Stop};
use crate::structure::Oscillator;
use crate::watch::Watched;
use crate::zero_one;

/// What is looked at in each run. A *period* is that of the first forcing, or the natural one 2π √(m/k).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Look {
    /// Periods that are left out.
    pub transient: f64,
    /// Periods that are looked at after them.
    pub window: f64,
    /// A motion repeats where its states in the section do, to this part of its extent.
    pub tolerance: f64,
    /// The section; none: [`Surface::usual`].
    pub surface: Option<Surface>,
    /// Returns after the window by which a motion that does not repeat is told regular from chaotic; 0: not at all.
    #[serde(default)]
    pub decide: usize,
    /// How many turning points and points of the section are kept.
    pub points: usize,
    /// Most events of each run.
    pub max_events: u64,
}

/// Returns to the section that are compared with each other, at most.
const RETURNS: usize = 256;

/// What is kept of one run.
#[derive(Clone, Debug, PartialEq)]
pub struct Steady {
    /// The kind of motion.
    pub regime: Regime,
    /// Returns to the section after which it repeats; 0 where it does not; 1 for a motion that rests.
    pub period: u32,
    /// The growth rate K of the 0–1 test ([`zero_one::growth`]) where it does not repeat: near 1 for chaos, near 0 for a
    /// motion on a torus. Not a number elsewhere.
    pub chaos: f64,
    /// Maxima of x until it repeats.
    pub loops: u32,
    /// Time until it repeats; not a number where it does not.
    pub period_time: f64,
    /// Least and greatest position.
    pub x: [f64; 2],
    /// Least and greatest slip velocity.
    pub w: [f64; 2],
    /// Mean position and velocity in the section, over one period or, where there is none, over all returns.
    pub mean: (f64, f64),
    /// The share of the time in which the mass sticks.
    pub stuck_share: f64,
    /// Where it ended: position, and velocity unless stuck.
    pub end: (f64, Option<f64>),
    /// How the motion goes on there, if it reached the end.
    pub onward: Option<Onward>,
    /// Events of the whole run.
    pub events: u64,
    /// Why it ended.
    pub stop: Stop,
    /// Positions where ẋ changes its sign, the last of them in time.
    pub turning_x: VecDeque<f64>,
    /// Slip velocities where ẇ changes its sign, 0 while the mass sticks.
    pub turning_w: VecDeque<f64>,
    /// The last returns to the section.
    pub section: VecDeque<Point>,
}

/// How a motion goes on under another drive or forcing: its position and its slip velocity, so that what sticks sticks on,
/// and what the contact does and remembers. Forcing begins anew.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Onward {
    /// Position.
    pub x: f64,
    /// Slip velocity.
    pub w: f64,
    /// How long a stick has lasted; 0 in slip.
    pub stuck_for: f64,
    /// Mode and memory.
    pub place: Place,
}

impl Onward {
    /// How many numbers that is.
    pub const NUMBERS: usize = Place::NUMBERS + 3;

    /// As numbers, to be kept in a table.
    #[must_use]
    pub fn numbers(&self) -> [f64; Self::NUMBERS] {
        let mut numbers = [self.x; Self::NUMBERS];
        numbers[1..3].copy_from_slice(&[self.w, self.stuck_for]);
        numbers[3..].copy_from_slice(&self.place.numbers());
        numbers
    }

    /// What [`Onward::numbers`] gave.
    #[must_use]
    pub fn read(numbers: &[f64]) -> Option<Self> {
        let (&[x, w, stuck_for], place) = numbers.split_first_chunk()?;
        let place = Place::read(place, Clock::default())?;
        Some(Self {
            x,
            w,
            stuck_for,
            place,
        })
    }

    /// The place, at the time `now`, and x and v there: those of the begin of a stick.
    fn place(&self, drive_velocity: f64, now: Clock) -> (f64, f64, Place) {
        let place = Place {
            clock: now.after(-self.stuck_for),
            ..self.place
        };
        (
            self.x - drive_velocity * self.stuck_for,
            drive_velocity - self.w,
            place,
        )
    }
}

/// Where a run begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Begin {
    /// At a position, with a velocity or with that of the drive; what a law remembers begins anew.
    State(f64, Option<f64>),
    /// Where another motion ended.
    Onward(Onward),
}

/// Many runs of one oscillator.
#[derive(Clone, Debug)]
pub struct Sweep {
    /// The oscillator, and what is varied.
    pub rows: Rows,
    /// What is looked at.
    pub look: Look,
}

impl Sweep {
    /// One run, from `begin` unless the row says otherwise (none: stuck at x = 0), as long as `go_on` says so.
    ///
    /// # Errors
    /// Values that make no sense.
    pub fn row(
        &self,
        index: usize,
        begin: Option<Begin>,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Steady, Error> {
        let mut run = Run {
            max_events: self.look.max_events,
            ..Run::stuck(1.0)
        };
        if let Some(Begin::State(x0, v0)) = begin {
            (run.x0, run.v0) = (x0, v0);
        }
        let mut row = || {
            let (oscillator, mut run) = self.rows.oscillator(index, run)?;
            let Some(Begin::Onward(onward)) = begin else {
                return steady(&oscillator, run, None, &self.look, go_on);
            };
            if self.varies_law() {
                // Lines and memory of one law say nothing under another.
                (run.x0, run.v0) = (onward.x, Some(oscillator.drive_velocity - onward.w));
                return steady(&oscillator, run, None, &self.look, go_on);
            }
            let (x0, v0, place) = onward.place(oscillator.drive_velocity, Clock::default());
            (run.x0, run.v0) = (x0, Some(v0));
            steady(&oscillator, run, Some(place), &self.look, go_on)
        };
        row().map_err(|error| self.rows.error(index, &error))
    }

    fn varies_law(&self) -> bool {
        self.rows.names.iter().any(|name| name.starts_with("law."))
    }

    /// The runs of a range of rows, each from where the one before ended, the first from `begin`: with its slip velocity, and
    /// with what the contact remembers unless it is the law that is varied.
    ///
    /// # Errors
    /// The first row whose values make no sense.
    pub fn chain(
        &self,
        range: Range<usize>,
        mut begin: Option<Begin>,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Vec<Steady>, Error> {
        let mut rows = Vec::with_capacity(range.len());
        for index in range {
            let row = self.row(index, begin, go_on)?;
            // What ran away or got stuck in time is no start for its neighbour.
            begin = row.onward.map(Begin::Onward);
            rows.push(row);
        }
        Ok(rows)
    }
}

/// The steady motion of an oscillator from the start of `run`, or from a place with its x and v; the time of `run` is that
/// of the look. It ends early once `go_on` says no.
///
/// # Errors
/// The first value of the oscillator, the run or the look that makes no sense.
pub fn steady(
    oscillator: &Oscillator,
    run: Run,
    from: Option<Place>,
    look: &Look,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Steady, Error> {
    match oscillator.forcing.len() {
        0 => look_at::<0>(oscillator, run, from, look, go_on),
        1 => look_at::<1>(oscillator, run, from, look, go_on),
        2 => look_at::<2>(oscillator, run, from, look, go_on),
        3 => look_at::<3>(oscillator, run, from, look, go_on),
        _ => look_at::<4>(oscillator, run, from, look, go_on),
    }
}

fn look_at<const H: usize>(
    oscillator: &Oscillator,
    run: Run,
    from: Option<Place>,
    look: &Look,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Steady, Error> {
    oscillator.validate()?;
    let period = match oscillator.forcing.first() {
        Some(harmonic) => TAU / harmonic.frequency,
        None => TAU * (oscillator.mass / oscillator.stiffness).sqrt(),
    };
    let surface = look.surface.unwrap_or_else(|| Surface::usual(oscillator));
    surface.validate()?;
    positive("tolerance", look.tolerance)?;
    let after = look.transient * period;
    let run = Run {
        t_end: (look.transient + look.window) * period,
        ..run
    };
    let mut watch = Watch::new(oscillator.drive_velocity, look.points, &surface, RETURNS, go_on);
    watch.end = (run.x0, run.v0);
    let (stop, events) = follow::<H>(oscillator, run, from, after, &mut watch)?;
    let compared = watch.returns.len();
    let row = watch.summary(look, stop, events, compared);
    let Some(onward) = row.onward.filter(|_| row.period == 0 && look.decide > 0) else {
        return Ok(row);
    };
    // The motion goes on for longer: a slow one may still settle, and the 0–1 test wants a long series.
    let after = run.t_end;
    let now = Clock {
        high: after,
        low: 0.0,
    };
    let (x0, v0, place) = onward.place(oscillator.drive_velocity, now);
    let run = Run {
        x0,
        v0: Some(v0),
        t_end: after + look.decide as f64 * period,
        ..run
    };
    let mut watch = Watch::new(
        oscillator.drive_velocity,
        look.points,
        &surface,
        RETURNS.max(look.decide),
        go_on,
    );
    let (stop, more) = follow::<H>(oscillator, run, Some(place), after, &mut watch)?;
    let series: Vec<f64> = watch.returns.iter().map(|(point, _)| point.x).collect();
    let mut row = watch.summary(look, stop, events + more, compared);
    if row.period == 0 {
        row.chaos = zero_one::growth(&series);
    }
    Ok(row)
}

/// A motion as it passes.
struct Watch<'a> {
    drive_velocity: f64,
    points: usize,
    passing: Passing,
    turns_x: Cut,
    turns_w: Cut,
    x: [f64; 2],
    v: [f64; 2],
    sticks: bool,
    stuck: f64,
    total: f64,
    loops: u32,
    rises: bool,
    /// Points of the section, and how many maxima of x came before.
    returns: VecDeque<(Point, u32)>,
    /// Points of the section in the course that passes.
    met: VecDeque<Point>,
    turning_x: VecDeque<f64>,
    turning_w: VecDeque<f64>,
    /// The most returns that are kept.
    most: usize,
    end: (f64, Option<f64>),
    place: Option<Place>,
    stuck_for: f64,
    go_on: &'a mut dyn FnMut() -> bool,
}

fn widen(range: &mut [f64; 2], value: f64) {
    *range = [range[0].min(value), range[1].max(value)];
}

impl<const H: usize> View<H> for Watch<'_> {
    fn pass(&mut self, course: &Course<H>, span: (f64, f64), last: bool) {
        let Self {
            points,
            x,
            v,
            loops,
            rises,
            most,
            returns,
            met,
            turning_x,
            turning_w,
            go_on,
            ..
        } = self;
        let mut work = Work::default();
        let watched = &mut Watched::new(&mut work, go_on);
        self.passing
            .pass(course, span, last, watched, &mut |point| met.push_back(point));
        let first = course.point(span.0);
        if x[0] > x[1] {
            *rises = first.v > 0.0;
        }
        widen(x, first.x);
        widen(v, first.v);
        self.turns_x.pass(course, span, watched, &mut |point| {
            widen(x, point.x);
            keep(turning_x, *points, point.x);
            // Returns and maxima in the order of time.
            while let Some(&before) = met.front().filter(|before| before.t < point.t) {
                keep(returns, *most, (before, *loops));
                met.pop_front();
            }
            *loops += u32::from(*rises);
            *rises = !*rises;
        });
        self.turns_w.pass(course, span, watched, &mut |point| {
            widen(v, point.v);
            keep(turning_w, *points, self.drive_velocity - point.v);
        });
        for point in met.drain(..) {
            keep(returns, *most, (point, *loops));
        }
        self.total += span.1 - span.0;
        if course.direction == 0.0 {
            self.sticks = true;
            self.stuck += span.1 - span.0;
        }
        if last {
            let end = course.point(span.1);
            widen(&mut self.x, end.x);
            widen(&mut self.v, end.v);
            let sticks = course.direction == 0.0;
            self.end = (end.x, (!sticks).then_some(end.v));
            self.stuck_for = if sticks { span.1 } else { 0.0 };
        }
    }

    fn event(&mut self, event: Event) {
        self.sticks |= matches!(event.kind, Kind::Release | Kind::Capture);
        // Told before the course that it ends has passed.
        self.met.extend(self.passing.event(&event));
    }

    fn go_on(&mut self) -> bool {
        (self.go_on)()
    }

    fn arrived(&mut self, place: Place) {
        self.place = Some(place);
    }
}

impl<'a> Watch<'a> {
    fn new(
        drive_velocity: f64,
        points: usize,
        surface: &Surface,
        most: usize,
        go_on: &'a mut dyn FnMut() -> bool,
    ) -> Self {
        Self {
            drive_velocity,
            points,
            passing: Passing::new(surface),
            turns_x: Cut::new([0.0, 1.0, 0.0], 0.0, 0),
            turns_w: Cut::new([0.0, 0.0, 1.0], 0.0, 0),
            x: [f64::INFINITY, f64::NEG_INFINITY],
            v: [f64::INFINITY, f64::NEG_INFINITY],
            sticks: false,
            stuck: 0.0,
            total: 0.0,
            loops: 0,
            rises: false,
            returns: VecDeque::new(),
            met: VecDeque::new(),
            turning_x: VecDeque::new(),
            turning_w: VecDeque::new(),
            most,
            end: (0.0, None),
            place: None,
            stuck_for: 0.0,
            go_on,
        }
    }

    /// What is kept of the motion; the last `compared` returns say whether it repeats.
    fn summary(mut self, look: &Look, stop: Stop, events: u64, compared: usize) -> Steady {
        let w = [self.drive_velocity - self.v[1], self.drive_velocity - self.v[0]];
        let stuck_share = self.stuck / self.total;
        let regime = match stop {
            Stop::Diverged => Regime::Diverged,
            Stop::End => Regime::of(stuck_share, self.sticks, w),
            _ => Regime::Unfinished,
        };
        let rests = matches!(regime, Regime::StableSlip | Regime::AtRest);
        let period = if rests {
            1
        } else if stop == Stop::End {
            self.repeats(look.tolerance, compared)
        } else {
            0
        };
        let (mut loops, mut period_time) = (0, f64::NAN);
        if period > 0 && !rests {
            let last = self.returns.len() - 1;
            let (now, before) = (self.returns[last], self.returns[last - period]);
            loops = now.1 - before.1;
            period_time = now.0.t - before.0.t;
        }
        // A motion that rests turns nowhere; its place stands for the points.
        if rests {
            self.turning_x = std::iter::repeat_n(self.end.0, look.points.min(1)).collect();
            let w = self.end.1.map_or(0.0, |v| self.drive_velocity - v);
            self.turning_w = std::iter::repeat_n(w, look.points.min(1)).collect();
        }
        let cycle = if period > 0 && !rests {
            period
        } else {
            self.returns.len()
        };
        let mean = |pick: fn(&Point) -> f64| {
            let recent = self.returns.iter().rev().take(cycle);
            recent.map(|(point, _)| pick(point)).sum::<f64>() / cycle as f64
        };
        let mean = if rests {
            (self.end.0, self.end.1.unwrap_or(self.drive_velocity))
        } else {
            (mean(|point| point.x), mean(|point| point.v))
        };
        let skipped = self.returns.len().saturating_sub(look.points);
        Steady {
            regime,
            period: u32::try_from(period).unwrap_or(0),
            chaos: f64::NAN,
            loops,
            period_time,
            x: self.x,
            w,
            mean,
            stuck_share,
            end: self.end,
            onward: self.place.map(|place| Onward {
                x: self.end.0,
                w: self.end.1.map_or(0.0, |v| self.drive_velocity - v),
                stuck_for: self.stuck_for,
                place,
            }),
            events,
            stop,
            turning_x: self.turning_x,
            turning_w: self.turning_w,
            section: self
                .returns
                .iter()
                .skip(skipped)
                .map(|&(point, _)| point)
                .collect(),
        }
    }

    /// The fewest returns to the section after which the last `compared` of them repeat; 0 where they do not.
    fn repeats(&self, tolerance: f64, compared: usize) -> usize {
        let count = compared.min(self.returns.len());
        let skipped = self.returns.len() - count;
        let near = |one: f64, other: f64, extent: f64| (one - other).abs() <= tolerance * extent;
        let (wide, fast) = (self.x[1] - self.x[0], self.v[1] - self.v[0]);
        let point = |index: usize| self.returns[skipped + index].0;
        (1..=count / 2)
            .find(|&period| {
                let lasts = point(count - 1).t - point(count - 1 - period).t;
                count >= period + 2
                    && (period..count).all(|index| {
                        let (now, before) = (point(index), point(index - period));
                        near(now.x, before.x, wide)
                            && near(now.v, before.v, fast)
                            && near(now.t - before.t, lasts, lasts)
                    })
            })
            .unwrap_or(0)
    }
}
