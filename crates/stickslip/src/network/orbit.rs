//! What a run of a system returns: steps that are expanded again where they are asked for, and the table of events.

use crate::clock::Clock;
use crate::event::Work;
use crate::flow::taylor::{ForceLine, Frame, Motion, VectorField, holding};
use crate::law::Law;
use crate::network::Run;
use crate::orbit::Event;
use crate::series::{at, slope_at};
use crate::simulate::Stop;
use crate::system::System;

/// The states at some times, each column mass by mass or contact by contact.
#[derive(Clone, Debug, Default)]
pub struct States {
    /// Positions.
    pub x: Vec<f64>,
    /// Velocities.
    pub v: Vec<f64>,
    /// Accelerations.
    pub a: Vec<f64>,
    /// Slip velocities of the contacts.
    pub w: Vec<f64>,
    /// Friction forces of the contacts.
    pub force: Vec<f64>,
    /// Whether they stick.
    pub stuck: Vec<bool>,
}

/// What a row of [`Orbit::steps`] has of a contact.
pub(super) fn contact_numbers(line: &ForceLine, branch: u32) -> [f64; 4] {
    let branch = f64::from(branch);
    let marked = if line.zero_slope { -1.0 - branch } else { branch };
    [line.direction, line.offset, line.slope, marked]
}

/// The lines of force that a row of [`Orbit::steps`] tells of, contact by contact.
pub(super) fn force_lines_of(row: &[f64], masses: usize, contacts: usize) -> impl Iterator<Item = ForceLine> {
    let numbers = row[2 + 2 * masses..].chunks_exact(4).take(contacts);
    numbers.map(|numbers| ForceLine {
        direction: numbers[0],
        offset: numbers[1],
        slope: numbers[2],
        zero_slope: numbers[3] < 0.0,
    })
}

/// The branch of a contact that a row of [`Orbit::steps`] tells of.
pub fn branch_of(number: f64) -> f64 {
    number.max(-1.0 - number)
}

/// A whole run.
#[derive(Clone, Debug)]
pub struct Orbit {
    /// What moved.
    pub system: System,
    /// From where and how long.
    pub run: Run,
    /// One row a step: time (high, low), positions, velocities, and for each contact direction, offset, slope, branch. A slip
    /// that begins without acceleration has −1 − branch: [`branch_of`].
    pub steps: Vec<f64>,
    /// The events, in time.
    pub events: Vec<Event>,
    /// Why it ended.
    pub stop: Stop,
    /// What it cost: events and Taylor steps.
    pub work: Work,
}

impl Orbit {
    /// Numbers in a row of [`Orbit::steps`].
    pub fn width(&self) -> usize {
        2 + 2 * self.system.masses() + 4 * self.system.contacts.len() + self.system.springs.len()
    }

    /// The time up to which the orbit is known.
    pub fn t_last(&self) -> f64 {
        match self.stop {
            Stop::End => self.run.t_end,
            _ => self.steps[self.steps.len() - self.width()],
        }
    }

    /// The states at `times`, in any order; each step is expanded again when a time lies in it.
    pub fn states(&self, times: &[f64]) -> States {
        let mut steps = ExpandedSteps::new(self);
        let n = self.system.masses();
        let mut last = usize::MAX;
        let mut states = States::default();
        for &t in times {
            let index = steps.index(t);
            if index != last {
                last = index;
                steps.expand(index);
            }
            let (row, motion) = (steps.rows[index], &steps.motion);
            let h = steps.clock(index).until(t);
            for i in 0..n {
                let (v, a) = slope_at(&motion.v.series(i), h);
                // The state at the start of a step is known and need not be added up again; that of the run is the one given,
                // also where the motion then goes on at the velocity of a drive that it has within rounding.
                let start = h == 0.0;
                let given =
                    |values: &Option<Vec<f64>>| values.as_ref().filter(|_| t == 0.0).map(|all| all[i]);
                states.x.push(if start {
                    given(&self.run.x0).unwrap_or(row[2 + i])
                } else {
                    at(&motion.x.series(i), h)
                });
                states.v.push(if start {
                    given(&self.run.v0).unwrap_or(row[2 + n + i])
                } else {
                    v
                });
                states.a.push(a);
            }
            for (c, force_line) in steps.force_lines.iter().enumerate() {
                let stuck = force_line.direction == 0.0;
                let w = force_line.direction * at(&motion.u.series(c), h);
                states.w.push(w);
                states.force.push(at(&motion.force.series(c), h));
                states.stuck.push(stuck);
            }
        }
        states
    }
}

/// The steps of an orbit, one of which is expanded again.
pub(crate) struct ExpandedSteps<'a> {
    pub(crate) frame: Frame,
    pub(crate) motion: Motion,
    pub(crate) force_lines: Vec<ForceLine>,
    laws: Vec<&'a Law>,
    rows: Vec<&'a [f64]>,
}

impl<'a> ExpandedSteps<'a> {
    pub(crate) fn new(orbit: &'a Orbit) -> Self {
        let frame = Frame::of(&orbit.system);
        Self {
            motion: Motion::of(&frame),
            frame,
            force_lines: Vec::new(),
            laws: orbit.system.contacts.iter().map(|contact| &contact.law).collect(),
            rows: orbit.steps.chunks_exact(orbit.width()).collect(),
        }
    }

    pub(crate) fn count(&self) -> usize {
        self.rows.len()
    }

    pub(crate) fn clock(&self, index: usize) -> Clock {
        Clock {
            high: self.rows[index][0],
            low: self.rows[index][1],
        }
    }

    /// The step in which a time lies.
    fn index(&self, t: f64) -> usize {
        let begun = |row: &&[f64]| {
            let clock = Clock {
                high: row[0],
                low: row[1],
            };
            clock.until(t) >= 0.0
        };
        self.rows.partition_point(begun).max(1) - 1
    }

    /// Expand a step again; when it begins.
    pub(crate) fn expand(&mut self, index: usize) -> Clock {
        let (n, row, clock) = (self.frame.masses, self.rows[index], self.clock(index));
        let pieces = row.len() - self.frame.springs.len();
        self.force_lines.clear();
        self.force_lines.extend(force_lines_of(row, n, self.laws.len()));
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a small whole number"
        )]
        for (piece, &number) in self.motion.pieces.iter_mut().zip(&row[pieces..]) {
            *piece = number as usize;
        }
        let held = self.frame.held_along(holding(&self.force_lines));
        self.motion.aim(&self.frame, clock);
        let (x, v) = (&row[2..2 + n], &row[2 + n..2 + 2 * n]);
        let field = VectorField {
            frame: &self.frame,
            laws: &self.laws,
            force_lines: &self.force_lines,
            held: &held,
        };
        self.motion.expand(&field, x, v);
        clock
    }
}
