//! What a run of a system returns: steps that are expanded again where they are asked for, and the table of events.

use crate::drive::Clock;
use crate::event::Work;
use crate::flow::taylor::{Frame, Motion, Rub};
use crate::law::Law;
use crate::mode::Kind;
use crate::network::Run;
use crate::series::{at, slope_at};
use crate::simulate::Stop;
use crate::system::System;

/// One event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// Time.
    pub t: f64,
    /// What happened.
    pub kind: Kind,
    /// At which contact.
    pub contact: usize,
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

/// A whole run.
#[derive(Clone, Debug)]
pub struct Orbit {
    /// What moved.
    pub system: System,
    /// From where and how long.
    pub run: Run,
    /// One row a step: time (high, low), positions, velocities, and for each contact direction, offset, slope, branch.
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
    #[must_use]
    pub fn width(&self) -> usize {
        2 + 2 * self.system.masses() + 4 * self.system.contacts.len()
    }

    /// The time up to which the orbit is known.
    #[must_use]
    pub fn t_last(&self) -> f64 {
        match self.stop {
            Stop::End => self.run.t_end,
            _ => self.steps[self.steps.len() - self.width()],
        }
    }

    /// The states at `times`, in any order; each step is expanded again when a time lies in it.
    #[must_use]
    pub fn states(&self, times: &[f64]) -> States {
        let frame = Frame::of(&self.system);
        let laws: Vec<&Law> = self.system.contacts.iter().map(|contact| &contact.law).collect();
        let mut motion = Motion::of(&frame);
        let (n, contacts, width) = (frame.masses, laws.len(), self.width());
        let rows: Vec<&[f64]> = self.steps.chunks_exact(width).collect();
        let (mut last, mut rubs) = (usize::MAX, Vec::new());
        let mut states = States::default();
        for &t in times {
            let clock = |row: &[f64]| Clock {
                high: row[0],
                low: row[1],
            };
            let index = rows.partition_point(|row| clock(row).until(t) >= 0.0).max(1) - 1;
            let row = rows[index];
            if index != last {
                last = index;
                rubs = row[2 + 2 * n..]
                    .chunks_exact(4)
                    .map(|rub| Rub {
                        direction: rub[0],
                        offset: rub[1],
                        slope: rub[2],
                    })
                    .collect();
                let held = frame.held((0..contacts).filter(|&c| rubs[c].holds()).collect());
                motion.aim(&frame, clock(row));
                motion.expand(
                    &frame,
                    &laws,
                    &rubs,
                    &held,
                    &row[2..2 + n],
                    &row[2 + n..2 + 2 * n],
                );
            }
            let h = clock(row).until(t);
            for i in 0..n {
                let (v, a) = slope_at(&motion.v[i], h);
                // The state at the start of a step is known and need not be added up again; that of the run is the one given,
                // also where the motion then goes on at the velocity of a drive that it has within rounding.
                let start = h == 0.0;
                let given =
                    |values: &Option<Vec<f64>>| values.as_ref().filter(|_| t == 0.0).map(|all| all[i]);
                states.x.push(if start {
                    given(&self.run.x0).unwrap_or(row[2 + i])
                } else {
                    at(&motion.x[i], h)
                });
                states.v.push(if start {
                    given(&self.run.v0).unwrap_or(row[2 + n + i])
                } else {
                    v
                });
                states.a.push(a);
            }
            for (c, rub) in rubs.iter().enumerate() {
                let stuck = rub.direction == 0.0;
                let w = rub.direction * at(&motion.u[c], h);
                states.w.push(w);
                states.force.push(at(&motion.force[c], h));
                states.stuck.push(stuck);
            }
        }
        states
    }
}
