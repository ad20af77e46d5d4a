//! A steady motion, told while it runs: memory does not grow with its length.
//!
//! A run has a transient and then a window that is looked at: its extremes, how it meets a section, and after how many
//! returns to the section it repeats.

use std::collections::VecDeque;
use std::ops::Range;

use serde::Deserialize;

use crate::engine::{Engine, Reached};
use crate::error::{Error, positive, wrong};
use crate::event::Work;
use crate::mode::Kind;
use crate::observer::{Course, Observer};
use crate::orbit::Event;
use crate::regime::Regime;
use crate::section::keep;
use crate::simulate::Stop;
use crate::surface::{Cut, Passing, Point, Surface};
use crate::watch::Watched;
use crate::zero_one;

/// What is looked at in each run. A *period* is that of the first forcing, or the natural one 2π √(m/k).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Look {
    /// Periods that are left out.
    pub transient: f64,
    /// Periods that are looked at after them; more where a slow stick-slip asks for them.
    pub window: f64,
    /// A motion repeats where its states in the section do, to this part of its extent.
    pub tolerance: f64,
    /// The section; none: [`Surface::usual`].
    pub surface: Option<Surface>,
    /// Returns after the window by which a motion that does not repeat is told regular from chaotic; 0: not at all.
    #[serde(default)]
    pub decide: usize,
    /// Periods after which a motion counts as steady if all returns of the last half of them repeat, six at least. Others go
    /// through the whole transient. 0: all do.
    #[serde(default)]
    pub early: f64,
    /// How many turning points and points of the section are kept.
    pub points: usize,
    /// Most events of each run.
    pub max_events: u64,
    /// The contact that is looked at, with its mass.
    #[serde(default)]
    pub contact: usize,
}

impl Look {
    /// The usual section without its points, to a tolerance of 1e-6, after so many periods and over so many.
    #[must_use]
    pub fn new(transient: f64, window: f64) -> Self {
        Self {
            transient,
            window,
            tolerance: 1e-6,
            surface: None,
            decide: 0,
            early: 0.0,
            points: 0,
            max_events: 10_000_000,
            contact: 0,
        }
    }

    /// Check that what it looks at is there.
    ///
    /// # Errors
    /// No contact of that number.
    pub fn within(&self, contacts: usize) -> Result<(), Error> {
        if self.contact >= contacts {
            return wrong(format!(
                "contact must be less than {contacts}, got {}",
                self.contact
            ));
        }
        Ok(())
    }
}

/// Returns to the section that are compared with each other, at most.
const MOST_RETURNS: usize = 256;

/// Of a motion that repeats, what its returns differ by changes by no more than this part.
const REPEATING_CHANGE: f64 = 0.1;

/// So much of the tolerance is rounding.
const TOLERANCE_ROUNDING: f64 = 1e-3;

/// A motion that was further outside of what it does later, by this part of it, was not there yet.
const LEFT: f64 = 1e-2;

/// Returns that must agree before a motion is steady early, and that a slow one is to have.
const AGREEING_RETURNS: usize = 6;

/// A slow motion is looked at for no more than about twice as many windows.
const MOST_WINDOWS: f64 = 1e6;

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
    /// Where it ended, if it reached the end.
    pub end: Option<Reached>,
    /// Events of the whole run.
    pub events: u64,
    /// Why it ended.
    pub stop: Stop,
    /// Positions where ẋ changes its sign, the last of them in time.
    pub extrema_x: VecDeque<f64>,
    /// Slip velocities where ẇ changes its sign, 0 while the mass sticks.
    pub extrema_w: VecDeque<f64>,
    /// The last returns to the section.
    pub section: VecDeque<Point>,
}

/// The steady motion of an engine, as long as `go_on` says so; `period` is the unit of the transient and of what follows.
///
/// # Errors
/// The first value of the system, the surface or the look that makes no sense.
pub fn steady(
    engine: &mut impl Engine,
    period: f64,
    surface: &Surface,
    look: &Look,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Steady, Error> {
    surface.validate()?;
    positive("tolerance", look.tolerance)?;
    if look.early > 0.0 && look.early < look.transient {
        let until = look.early * period;
        let mut seen = Window::new(look, surface, MOST_RETURNS, go_on);
        let stop = engine.go(until, 0.5 * until, &mut seen)?;
        let compared = seen.returns.len();
        let (row, _) = seen.summary(look, stop, engine, compared);
        // Steady slip that has ceased to be stable is left but slowly.
        let settled = row.period > 0 && !row.regime.rests() && compared >= AGREEING_RETURNS;
        if stop != Stop::End || settled {
            return Ok(row);
        }
    }
    let (mut after, mut window) = (look.transient * period, look.window * period);
    let (row, compared) = loop {
        let mut seen = Window::new(look, surface, MOST_RETURNS, go_on);
        let stop = engine.go(after + window, after, &mut seen)?;
        let compared = seen.returns.len();
        let (row, settling) = seen.summary(look, stop, engine, compared);
        // A stick on a moving drive is no rest: a slow motion is looked at for longer, until it has come back often enough.
        let in_a_stick = settling
            || row.regime == Regime::AtRest
            || row.regime == Regime::StickSlip && row.period == 0 && compared < AGREEING_RETURNS;
        // Who asks for fewer periods than returns must agree does not ask for the kind of motion.
        let looks_on = look.window >= AGREEING_RETURNS as f64
            && window < MOST_WINDOWS * look.window * period
            && engine.must_break(look.contact);
        if !(stop == Stop::End && in_a_stick && looks_on) {
            break (row, compared);
        }
        after += window;
        window *= 2.0;
    };
    let end = after + window;
    if row.stop != Stop::End || row.period > 0 || look.decide == 0 {
        return Ok(row);
    }
    // The motion goes on for longer: a slow one may still settle, and the 0–1 test wants a long series.
    let mut seen = Window::new(look, surface, MOST_RETURNS.max(look.decide), go_on);
    let stop = engine.go(end + look.decide as f64 * period, end, &mut seen)?;
    let series: Vec<f64> = seen.returns.iter().map(|(point, ..)| point.x).collect();
    let (mut row, _) = seen.summary(look, stop, engine, compared);
    if row.period == 0 {
        row.chaos = zero_one::growth(&series);
    }
    Ok(row)
}

/// What is seen of a motion in its window.
struct Window<'a> {
    contact: usize,
    points: usize,
    passing: Passing,
    cut_x: Cut,
    cut_w: Cut,
    /// Since the last return.
    seen: Seen,
    /// Before the returns that are kept.
    before: Seen,
    stuck: f64,
    total: f64,
    loops: u32,
    rises: bool,
    /// Points of the section, how many maxima of x came before, and what was seen since the point before.
    returns: VecDeque<(Point, u32, Seen)>,
    /// Points of the section in the course that passes.
    met: VecDeque<Point>,
    extrema_x: VecDeque<f64>,
    extrema_w: VecDeque<f64>,
    /// The most returns that are kept.
    most: usize,
    /// Where it ended, if it did.
    end: Option<Point>,
    go_on: &'a mut dyn FnMut() -> bool,
}

/// What is seen of a part of a motion: the extremes of x and of w, and whether the mass sticks.
#[derive(Clone, Copy)]
struct Seen {
    x: [f64; 2],
    w: [f64; 2],
    sticks: bool,
}

impl Seen {
    /// Nothing.
    const NONE: Self = Self {
        x: [f64::INFINITY, f64::NEG_INFINITY],
        w: [f64::INFINITY, f64::NEG_INFINITY],
        sticks: false,
    };

    fn add(&mut self, part: &Self) {
        // Plain comparisons: `min` and `max` mind what is not a number, and are calls in WebAssembly.
        for (range, [low, high]) in [(&mut self.x, part.x), (&mut self.w, part.w)] {
            if low < range[0] {
                range[0] = low;
            }
            if high > range[1] {
                range[1] = high;
            }
        }
        self.sticks |= part.sticks;
    }

    fn pass(&mut self, point: &Point) {
        self.add(&Self {
            x: [point.x; 2],
            w: [point.w; 2],
            sticks: false,
        });
    }

    /// Whether it reached further than what came after it.
    fn beyond(&self, after: &Self) -> bool {
        let further = |[low, high]: [f64; 2], before: [f64; 2]| {
            (low - before[0]).max(before[1] - high) > LEFT * (high - low)
        };
        further(after.x, self.x) || further(after.w, self.w)
    }
}

/// One more return.
fn come_back(
    (point, loops): (Point, u32),
    most: usize,
    seen: &mut Seen,
    before: &mut Seen,
    returns: &mut VecDeque<(Point, u32, Seen)>,
) {
    seen.pass(&point);
    if returns.len() == most
        && let Some((_, _, first)) = returns.pop_front()
    {
        before.add(&first);
    }
    returns.push_back((point, loops, *seen));
    *seen = Seen::NONE;
    seen.pass(&point);
}

impl Observer for Window<'_> {
    fn pass(&mut self, course: &impl Course, span: (f64, f64), last: bool) {
        let Self {
            contact,
            points,
            seen,
            before,
            loops,
            rises,
            most,
            returns,
            met,
            extrema_x,
            extrema_w,
            go_on,
            ..
        } = self;
        let (contact, sticks) = (*contact, course.sticks(*contact));
        let mut work = Work::default();
        let watched = &mut Watched::new(&mut work, go_on);
        self.passing
            .pass(course, contact, span, last, watched, &mut |point| {
                met.push_back(point);
            });
        let first = course.point(contact, span.0);
        if self.total == 0.0 {
            *rises = first.v > 0.0;
        }
        seen.pass(&first);
        seen.sticks |= sticks;
        let cuts = &mut [&mut self.cut_x, &mut self.cut_w];
        course.cross(contact, cuts, span, watched, &mut |which, point| {
            // Returns and turns in the order of time.
            while let Some(&earlier) = met.front().filter(|earlier| earlier.t < point.t) {
                come_back((earlier, *loops), *most, seen, before, returns);
                seen.sticks |= sticks;
                met.pop_front();
            }
            seen.pass(&point);
            if which == 1 {
                keep(extrema_w, *points, point.w);
                return;
            }
            keep(extrema_x, *points, point.x);
            *loops += u32::from(*rises);
            *rises = !*rises;
        });
        for point in met.drain(..) {
            come_back((point, *loops), *most, seen, before, returns);
            seen.sticks |= sticks;
        }
        self.total += span.1 - span.0;
        if sticks {
            self.stuck += span.1 - span.0;
        }
        if last {
            let end = course.point(contact, span.1);
            self.seen.pass(&end);
            self.end = Some(end);
        }
    }

    fn event(&mut self, event: &Event) {
        if event.contact as usize == self.contact {
            self.seen.sticks |= matches!(event.kind, Kind::Release | Kind::Capture);
        }
        if self.passing.takes(self.contact, event) {
            self.met.push_back(event.point());
        }
    }

    fn go_on(&mut self) -> bool {
        (self.go_on)()
    }
}

impl<'a> Window<'a> {
    fn new(look: &Look, surface: &Surface, most: usize, go_on: &'a mut dyn FnMut() -> bool) -> Self {
        Self {
            contact: look.contact,
            points: look.points,
            passing: Passing::new(surface),
            // Of such a sign that one is the derivative of the other.
            cut_x: Cut::new([0.0, -1.0, 0.0, 0.0], 0.0, 0),
            cut_w: Cut::new([0.0, 0.0, 0.0, 1.0], 0.0, 0),
            seen: Seen::NONE,
            before: Seen::NONE,
            stuck: 0.0,
            total: 0.0,
            loops: 0,
            rises: false,
            returns: VecDeque::new(),
            met: VecDeque::new(),
            extrema_x: VecDeque::new(),
            extrema_w: VecDeque::new(),
            most,
            end: None,
            go_on,
        }
    }

    /// What is kept of the motion; the last `compared` returns, or more for a longer period, say whether it repeats. And
    /// whether it has only just come to do so: before these it was where it is never again.
    fn summary(mut self, look: &Look, stop: Stop, engine: &impl Engine, compared: usize) -> (Steady, bool) {
        let stuck_share = self.stuck / self.total;
        let (mut before, mut after) = (self.before, self.seen);
        for (index, (_, _, seen)) in self.returns.iter().enumerate() {
            if index > 0 { &mut after } else { &mut before }.add(seen);
        }
        self.seen = after;
        let repeats = if stop == Stop::End {
            self.repeats(look.tolerance, compared)
        } else {
            0
        };
        let left_sticks = before.sticks && !after.sticks;
        let left = left_sticks || before.beyond(&after);
        self.seen.add(&before);
        let Seen { x, w, sticks } = self.seen;
        // What was seen is not the window that was asked for.
        let regime = Regime::of_stop(stop, false).unwrap_or_else(|| Regime::of(stuck_share, sticks, w));
        let rests = regime.rests();
        let period = match (rests, left) {
            (true, _) => 1,
            (_, true) => 0,
            _ => repeats,
        };
        let (mut loops, mut period_time) = (0, f64::NAN);
        if period > 0 && !rests {
            let last = self.returns.len() - 1;
            let (now, before) = (self.returns[last], self.returns[last - period]);
            loops = now.1 - before.1;
            period_time = now.0.t - before.0.t;
        }
        // A motion that rests turns nowhere; its place stands for the points.
        let resting = self.end.filter(|_| rests);
        if let Some(end) = resting {
            self.extrema_x = std::iter::repeat_n(end.x, look.points.min(1)).collect();
            self.extrema_w = std::iter::repeat_n(end.w, look.points.min(1)).collect();
        }
        let cycle = if period > 0 && !rests {
            period
        } else {
            self.returns.len()
        };
        let mean = |pick: fn(&Point) -> f64| {
            let recent = self.returns.iter().rev().take(cycle);
            recent.map(|(point, ..)| pick(point)).sum::<f64>() / cycle as f64
        };
        let mean = resting.map_or_else(
            || (mean(|point| point.x), mean(|point| point.v)),
            |end| (end.x, end.v),
        );
        let skipped = self.returns.len().saturating_sub(look.points);
        let row = Steady {
            regime,
            period: u32::try_from(period).unwrap_or(0),
            chaos: f64::NAN,
            loops,
            period_time,
            x,
            w,
            mean,
            stuck_share,
            end: (stop == Stop::End).then(|| engine.end().clone()),
            events: engine.events(),
            stop,
            extrema_x: self.extrema_x,
            extrema_w: self.extrema_w,
            section: self
                .returns
                .iter()
                .skip(skipped)
                .map(|&(point, ..)| point)
                .collect(),
        };
        (row, !rests && (left_sticks || left && repeats > 0))
    }

    /// The fewest returns to the section after which the last of them repeat, `compared` of them or twice as many as repeat, if
    /// that is more; 0 where they do not, or where they may be on their way to repeat after fewer.
    fn repeats(&self, tolerance: f64, compared: usize) -> usize {
        let known = self.returns.len();
        let count = |period: usize| known.min(compared.max(2 * period));
        (1..=known / 2)
            .find(|&period| {
                let from = known - count(period) + period;
                from + 2 <= known && (from..known).all(|index| self.apart(index, period, period) <= tolerance)
            })
            .filter(|&period| {
                let mut parts = (1..period).filter(|part| period.is_multiple_of(*part));
                parts.all(|part| self.stays_apart(part, period, count(period), tolerance))
            })
            .unwrap_or(0)
    }

    /// How far a return is from that `lag` before, relative to the extent of the motion, in the section and in the time that
    /// passed, of which the last `period` returns took their share.
    fn apart(&self, index: usize, lag: usize, period: usize) -> f64 {
        let point = |index: usize| self.returns[index].0;
        let [wide, fast] = [self.seen.x, self.seen.w].map(|[low, high]| high - low);
        let last = self.returns.len() - 1;
        let lasts = point(last).t - point(last - period).t;
        let (now, before) = (point(index), point(index - lag));
        // What does not extend is not apart.
        let relative = |gap: f64, extent: f64| if gap == 0.0 { 0.0 } else { gap.abs() / extent };
        relative(now.x - before.x, wide)
            .max(relative(now.v - before.v, fast))
            .max(relative(
                now.t - before.t - lag as f64 / period as f64 * lasts,
                lasts,
            ))
    }

    /// Whether the last `count` returns, which repeat after `period` of them, will not come to repeat after a `part` of it.
    ///
    /// On the way to a motion of the period `part` the multiplier near −1, or near another root of 1, makes returns of a whole
    /// `period` differ by less than those of the part. Both shrink; of a motion of this period those of the part stay as they
    /// are. Where they change, what is left to change is the sum of a geometric series.
    fn stays_apart(&self, part: usize, period: usize, count: usize, tolerance: f64) -> bool {
        let known = self.returns.len();
        let most = |range: Range<usize>, lag: usize| {
            range
                .map(|index| self.apart(index, lag, period))
                .fold(0.0, f64::max)
        };
        let blocks = (count - part) / period;
        let apart = |ago: usize| most(known - (ago + 1) * period..known - ago * period, part);
        let now = apart(0);
        if blocks < 3 {
            let changed = most(known - count + period..known, period);
            return changed
                <= (TOLERANCE_ROUNDING * tolerance).max(REPEATING_CHANGE * REPEATING_CHANGE * now);
        }
        let (middle, first) = (apart((blocks - 1) / 2), apart((blocks - 1) / 2 * 2));
        let (before, after) = (middle - first, now - middle);
        let (changed, ratio) = (before.abs() + after.abs(), after / before);
        // Rounding changes as much.
        if changed <= TOLERANCE_ROUNDING * tolerance {
            return true;
        }
        let to_come = if ratio < 0.0 {
            after.abs()
        } else if ratio < 1.0 {
            after.abs() * ratio / (1.0 - ratio)
        } else {
            f64::INFINITY
        };
        changed + to_come <= REPEATING_CHANGE * now
    }
}
