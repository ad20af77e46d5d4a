//! What makes a section, and where a motion meets it.
//!
//! A new one: a variant of [`Surface`] with its check, and what `Passing` does with it. Whatever is a function of the state
//! is a [`Cut`], whose crossings every engine finds already. Python's words for it are in `dynamics/surface.py`.

use std::f64::consts::TAU;

use serde::Deserialize;

use crate::error::{Error, finite, positive, wrong};
use crate::mode::Kind;
use crate::model::Model;
use crate::observer::Course;
use crate::orbit::Event;
use crate::series::free_time;
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
    /// The stroboscopic section of a forced system, the maxima of x of another.
    #[must_use]
    pub fn usual(model: &Model) -> Self {
        Self::of_forcing(model.forcing_frequency())
    }

    /// The same by the frequency of the forcing.
    pub(crate) fn of_forcing(frequency: Option<f64>) -> Self {
        match frequency {
            Some(frequency) => Self::Strobe {
                period: TAU / frequency,
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
                    return wrong("the normal of a section must not be zero".into());
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
    /// Slip velocity of the contact.
    pub w: f64,
}

/// Points at regular times.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Strobe {
    period: f64,
    start: f64,
    /// The number of the next point, once the motion is seen.
    next: Option<f64>,
}

impl Strobe {
    fn pass(
        &mut self,
        course: &impl Course,
        contact: usize,
        (from, to): (f64, f64),
        last: bool,
        watched: &mut Watched,
        found: &mut impl FnMut(Point),
    ) {
        // The ends of a run are whole periods as a rule: rounding must not take or double a point there.
        let slack = 1e-9 * self.period;
        let to = if last { to + slack } else { to - slack };
        let (clock, start, period) = (course.clock(), self.start, self.period);
        let next = self.next.get_or_insert_with(|| {
            let since = clock.high - start + clock.low + (from - slack);
            (since / period).ceil()
        });
        loop {
            let tau = clock.until(start + *next * period);
            if tau >= to || watched.ends(tau) {
                return;
            }
            found(course.point(contact, tau.max(0.0)));
            *next += 1.0;
        }
    }
}

/// Motion smaller than this, in whatever units, has come to rest.
const DIED_OUT: f64 = 1e-150;

/// Crossings of normal · (x, ẋ, ẍ, ẇ) = level.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    pub(crate) normal: [f64; 4],
    pub(crate) level: f64,
    direction: f64,
    /// The side the motion was last seen on.
    side: f64,
    /// Where it came to rest on the surface, if it does.
    rest: Option<Point>,
}

impl Cut {
    /// Of all crossings (`direction` 0), those where the left side rises (1) or falls (−1).
    pub fn new(normal: [f64; 4], level: f64, direction: i8) -> Self {
        Self {
            normal,
            level,
            direction: f64::from(direction),
            side: 0.0,
            rest: None,
        }
    }

    /// The normal along (x, ẋ, ẍ) on a constant drive, where ẇ = −ẍ.
    #[inline]
    pub(crate) fn of_motion(&self) -> [f64; 3] {
        let [along_x, along_v, along_a, along_slip] = self.normal;
        [along_x, along_v, along_a - along_slip]
    }

    /// Whether this is zero where, on a constant drive, the rate of `other` is.
    pub(crate) fn follows(&self, other: &Self) -> bool {
        let ([x, v, a], [rate_of_v, rate_of_a, beyond]) = (self.of_motion(), other.of_motion());
        [x, v, a, beyond, self.level] == [0.0, rate_of_v, rate_of_a, 0.0, 0.0]
    }

    /// The motion is on the side `sign` at `point`; a crossing if it was on the other.
    pub(crate) fn see(&mut self, sign: f64, point: impl FnOnce() -> Point, found: &mut impl FnMut(Point)) {
        if self.side == -sign && (self.direction == 0.0 || self.direction == sign) {
            found(self.rest.unwrap_or_else(point));
        }
        self.rest = None;
        self.side = sign;
    }

    /// The motion rests on the surface from `point` on.
    pub(crate) fn stay(&mut self, point: impl FnOnce() -> Point) {
        self.rest = self.rest.or_else(|| Some(point()));
    }

    /// The side the motion was last seen on.
    pub(crate) fn side(&self) -> f64 {
        self.side
    }

    /// Go along a smooth guard, of whose curvature a bound is known at every time: no root is jumped over. `unit` is the time
    /// in which the guard changes.
    pub(crate) fn march(
        &mut self,
        (from, to): (f64, f64),
        unit: f64,
        watched: &mut Watched,
        guard: &impl Fn(f64) -> Guard,
        point: &impl Fn(f64) -> Point,
        found: &mut impl FnMut(Point),
    ) {
        let mut t = from;
        while t < to && !watched.ends(t) {
            let Guard {
                value,
                rate,
                curvature,
                noise,
                reach,
            } = guard(t);
            // The squares of what has died out further are no numbers.
            let noise = noise.max(DIED_OUT);
            if value.abs() > noise {
                self.see(value.signum(), || point(t), found);
            } else if rate.abs() * reach <= noise && curvature * reach * reach <= noise {
                // On the surface for good, as far as rounding can tell.
                self.stay(|| point(t));
                t += reach;
                continue;
            }
            let tiny = 4.0 * f64::EPSILON * t.max(unit);
            let mut step = free_time((self.side * value).max(0.0), self.side * rate, curvature);
            if step <= tiny {
                if self.side * rate < 0.0 {
                    self.see(-self.side, || point(t), found);
                    step = free_time(0.0, rate.abs(), curvature);
                } else {
                    // It touches: the square root of rounding leads past.
                    step = 1e-8 * unit;
                }
            }
            if value.abs() <= noise {
                // As long as it stays within rounding of the surface it has no side: a motion that has died out would be
                // walked along in steps of its own tiny slope.
                step = step.max(free_time(2.0 * noise - value.abs(), -rate.abs(), curvature));
            }
            t += step.max(tiny).min(reach);
        }
    }
}

/// A guard at one time.
pub(crate) struct Guard {
    pub(crate) value: f64,
    pub(crate) rate: f64,
    /// A bound of its curvature for a time `reach` from here.
    pub(crate) curvature: f64,
    /// A smaller value is zero within rounding.
    pub(crate) noise: f64,
    pub(crate) reach: f64,
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
            Surface::Strobe { period, start } => Self::Strobe(Strobe {
                period,
                start,
                next: None,
            }),
            Surface::Event(kind) => Self::Event(kind),
            Surface::Plane {
                normal,
                level,
                direction,
            } => {
                let [x, v, a] = normal;
                Self::Cut(Cut::new([x, v, a, 0.0], level, direction))
            }
        }
    }

    pub(crate) fn pass(
        &mut self,
        course: &impl Course,
        contact: usize,
        span: (f64, f64),
        last: bool,
        watched: &mut Watched,
        found: &mut impl FnMut(Point),
    ) {
        match self {
            Self::Strobe(strobe) => strobe.pass(course, contact, span, last, watched, found),
            Self::Cut(cut) => course.cross(contact, &mut [cut], span, watched, &mut |_, point| found(point)),
            Self::Event(_) => {}
        }
    }

    /// Whether the section has a point at an event of the contact.
    pub(crate) fn takes(&self, contact: usize, event: &Event) -> bool {
        matches!(self, Self::Event(kind) if *kind == event.kind) && event.contact as usize == contact
    }
}
