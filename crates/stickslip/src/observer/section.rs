//! Sections: the states in which a motion meets a surface, found while it runs.

use std::collections::VecDeque;

use crate::engine::Engine;
use crate::error::{Error, positive};
use crate::event::Work;
use crate::observer::{Course, Observer};
use crate::orbit::Event;
use crate::simulate::{MOST_BYTES, Stop};
use crate::surface::{Passing, Point, Surface};
use crate::watch::Watched;

/// Keep the last `most` of what comes.
pub(crate) fn keep<T>(ring: &mut VecDeque<T>, most: usize, value: T) {
    if ring.len() == most {
        ring.pop_front();
    }
    if most > 0 {
        ring.push_back(value);
    }
}

/// The last `most` points of a section of the motion of a contact's mass from the time `after` on, as long as `go_on` says so,
/// and why the run ended.
///
/// # Errors
/// The first value of the system, the run or the surface that makes no sense.
pub fn section(
    engine: &mut impl Engine,
    contact: usize,
    surface: &Surface,
    (after, t_end): (f64, f64),
    most: usize,
    go_on: impl FnMut() -> bool,
) -> Result<(Vec<SectionPoint>, Stop), Error> {
    surface.validate()?;
    positive("t_end", t_end)?;
    let mut gather = Gather {
        passing: Passing::new(surface),
        contact,
        most,
        points: VecDeque::new(),
        go_on,
    };
    let stop = engine.go(t_end, after, &mut gather)?;
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
    contact: usize,
    most: usize,
    points: VecDeque<SectionPoint>,
    go_on: F,
}

impl<F: FnMut() -> bool> Observer for Gather<F> {
    fn pass(&mut self, course: &impl Course, span: (f64, f64), last: bool) {
        let (points, most, contact) = (&mut self.points, self.most, self.contact);
        let mut work = Work::default();
        let watched = &mut Watched::new(&mut work, &mut self.go_on);
        self.passing
            .pass(course, contact, span, last, watched, &mut |point| {
                keep(points, most, point.into());
            });
    }

    fn event(&mut self, event: &Event) {
        if self.passing.takes(self.contact, event) {
            let point = SectionPoint {
                point: event.point(),
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
