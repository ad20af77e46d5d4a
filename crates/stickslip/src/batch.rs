//! Many runs of one oscillator or system over parameters and starts, on all cores. Each run depends on its own row alone, so the
//! results are the same for any number of workers; memory grows only with what is asked back.

use std::collections::VecDeque;
use std::ops::Range;

use rayon::prelude::*;

use crate::error::Error;
use crate::mode::Kind;
use crate::network;
use crate::orbit::{Event, Orbit, Record, Segment, While};
use crate::rows::Rows;
use crate::simulate::{Run, Stop, observe};
use crate::system::System;

/// What is varied and what is kept of each run.
#[derive(Clone, Debug)]
pub struct Batch {
    /// An oscillator, or a system of masses whose starts are named `x0.1`.
    pub rows: Rows,
    /// Time to run.
    pub t_end: f64,
    /// Most events of each run.
    pub max_events: u64,
    /// The time from which on events count.
    pub after: f64,
    /// Which events make the section, if one is kept.
    pub section: Option<Kind>,
    /// How many of the last events of that kind are kept.
    pub keep: usize,
}

/// What is kept of one run.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Positions, then velocities, of all masses at `t_end` or where the run stopped before.
    pub last: Vec<f64>,
    /// Events after the transient, by kind.
    pub counts: [u64; Kind::ALL.len()],
    /// The sum of the stick times of those that are releases.
    pub stick_time: f64,
    /// (t, x, v) of the last events of the section, in time.
    pub section: VecDeque<[f64; 3]>,
    /// Why the run ended.
    pub stop: Stop,
}

/// A run as it is told: only the row and the present mode are kept.
struct Tally {
    after: f64,
    section: Option<Kind>,
    keep: usize,
    segment: Option<Segment>,
    row: Row,
}

impl Record for Tally {
    fn segment(&mut self, segment: Segment) {
        self.segment = Some(segment);
    }

    fn event(&mut self, event: Event) {
        if event.t < self.after {
            return;
        }
        self.row.counts[event.kind as usize] += 1;
        if event.kind == Kind::Release {
            self.row.stick_time += event.stick_time;
        }
        if self.section == Some(event.kind) && self.keep > 0 {
            if self.row.section.len() == self.keep {
                self.row.section.pop_front();
            }
            self.row.section.push_back([event.t, event.x, event.v]);
        }
    }
}

impl Batch {
    /// The runs of a range of rows, in their order, on the threads of the present rayon pool; once `go_on` says no, what is
    /// left of them is cut short.
    ///
    /// # Errors
    /// The first row, in their order, whose values make no sense.
    pub fn rows(&self, range: Range<usize>, go_on: &(impl Fn() -> bool + Sync)) -> Result<Vec<Row>, Error> {
        let rows: Vec<Result<Row, Error>> = range
            .into_par_iter()
            .map(|index| self.row(index, go_on))
            .collect();
        rows.into_iter().collect()
    }

    fn row(&self, index: usize, go_on: &impl Fn() -> bool) -> Result<Row, Error> {
        let row = if self.rows.document.get("contacts").is_some() {
            self.row_of_masses(index, go_on)
        } else {
            self.row_of_one(index, go_on)
        };
        row.map_err(|error| self.rows.error(index, &error))
    }

    fn row_of_one(&self, index: usize, go_on: &impl Fn() -> bool) -> Result<Row, Error> {
        let run = Run {
            max_events: self.max_events,
            ..Run::stuck(self.t_end)
        };
        let (oscillator, run) = self.rows.oscillator(index, run)?;
        if oscillator.resonates() {
            let v0 = run.v0.unwrap_or(oscillator.drive_velocity);
            return self.row_of_system(&System::from(&oscillator), vec![run.x0], vec![v0], go_on);
        }
        let mut tally = self.tally();
        let record = &mut tally;
        let (stop, _) = observe(&oscillator, run, &mut While { record, go_on })?;
        tally.row.stop = stop;
        if let Some(segment) = tally.segment {
            let end = if stop == Stop::End {
                self.t_end
            } else {
                segment.clock.high
            };
            let mut orbit = Orbit::new(oscillator, run);
            orbit.segments.push(segment);
            let state = orbit.states(&[end])[0];
            tally.row.last = vec![state.x, state.v];
        }
        Ok(tally.row)
    }

    /// The run of a system of masses; `x0.1` is where its mass 1 starts.
    fn row_of_masses(&self, index: usize, go_on: &impl Fn() -> bool) -> Result<Row, Error> {
        let mut starts = Vec::new();
        let system: System = self.rows.system(index, |name, value| {
            let start = name
                .split_once('.')
                .filter(|(start, _)| matches!(*start, "x0" | "v0"));
            starts.extend(start.map(|(start, mass)| ([start, mass].map(str::to_owned), value)));
            start.is_some()
        })?;
        let (mut x0, mut v0) = (vec![0.0; system.masses()], system.driven_velocities());
        for ([start, mass], value) in starts {
            let of = if start == "x0" { &mut x0 } else { &mut v0 };
            let place = mass.parse().ok().and_then(|mass: usize| of.get_mut(mass));
            *place.ok_or_else(|| Error::Document {
                reason: format!("{start} must name a mass, such as {start}.0, got {mass:?}"),
            })? = value;
        }
        self.row_of_system(&system, x0, v0, go_on)
    }

    fn row_of_system(
        &self,
        system: &System,
        x0: Vec<f64>,
        v0: Vec<f64>,
        go_on: &impl Fn() -> bool,
    ) -> Result<Row, Error> {
        let run = network::Run {
            x0: Some(x0),
            v0: Some(v0),
            t_end: self.t_end,
            max_events: self.max_events,
        };
        let mut tally = self.tally();
        let tell = |event: network::Event| {
            tally.event(Event {
                t: event.t,
                kind: event.kind,
                x: event.x,
                v: event.v,
                force: event.force,
                stick_time: event.stick_time,
                force_rate: event.force_rate,
            });
        };
        let (x, v, stop) = network::observe(system, &run, tell, go_on)?;
        tally.row.last = [x, v].concat();
        tally.row.stop = stop;
        Ok(tally.row)
    }

    fn tally(&self) -> Tally {
        Tally {
            after: self.after,
            section: self.section,
            keep: self.keep,
            segment: None,
            row: Row {
                last: Vec::new(),
                counts: [0; Kind::ALL.len()],
                stick_time: 0.0,
                section: VecDeque::new(),
                stop: Stop::End,
            },
        }
    }
}
