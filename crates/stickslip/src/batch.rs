//! Many runs of one oscillator or system over parameters and starts, on all cores. Each run depends on its own row alone, so the
//! results are the same for any number of workers; memory grows only with what is asked back.

use std::collections::VecDeque;
use std::ops::Range;

use rayon::prelude::*;
use serde_json::Value;

use crate::error::Error;
use crate::mode::Kind;
use crate::network;
use crate::orbit::{Event, Orbit, Record, Segment, While};
use crate::simulate::{Run, Stop, observe};
use crate::structure::Oscillator;
use crate::system::System;

/// What is varied and what is kept of each run.
#[derive(Clone, Debug)]
pub struct Batch {
    /// The document of the oscillator or system that is varied.
    pub document: Value,
    /// What is varied: paths in the document such as `forcing.0.amplitude`, or `x0` and `v0`.
    pub names: Vec<String>,
    /// The values, a row for each run.
    pub values: Vec<f64>,
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
    /// How many runs there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.values.len() / self.names.len().max(1)
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

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
        let width = self.names.len();
        let values = &self.values[index * width..(index + 1) * width];
        let at = |error| placed(index, &self.names, values, &error);
        if self.document.get("contacts").is_some() {
            return self.row_of_masses(values, go_on).map_err(at);
        }
        let run = Run {
            max_events: self.max_events,
            ..Run::stuck(self.t_end)
        };
        let (oscillator, run) = varied(&self.document, &self.names, values, run).map_err(at)?;
        let mut tally = self.tally();
        let record = &mut tally;
        let (stop, _) = observe(&oscillator, run, &mut While { record, go_on }).map_err(at)?;
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
    fn row_of_masses(&self, values: &[f64], go_on: &impl Fn() -> bool) -> Result<Row, Error> {
        let mut document = self.document.clone();
        let mut starts = Vec::new();
        for (name, &value) in self.names.iter().zip(values) {
            match name.split_once('.') {
                Some((start @ ("x0" | "v0"), mass)) => starts.push((start, mass, value)),
                _ => *place(&mut document, name)? = value.into(),
            }
        }
        let system: System = serde_json::from_value(document).map_err(|error| Error::Document {
            reason: error.to_string(),
        })?;
        let (mut x0, mut v0) = (vec![0.0; system.masses()], system.driven_velocities());
        for (start, mass, value) in starts {
            let of = if start == "x0" { &mut x0 } else { &mut v0 };
            let place = mass.parse().ok().and_then(|mass: usize| of.get_mut(mass));
            *place.ok_or_else(|| Error::Document {
                reason: format!("{start} must name a mass, such as {start}.0, got {mass:?}"),
            })? = value;
        }
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
        let (x, v, stop) = network::observe(&system, &run, tell, go_on)?;
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

/// An oscillator and the run with `values` in the places of `names`: paths in the document, or `x0` and `v0` of the run.
pub(crate) fn varied(
    document: &Value,
    names: &[String],
    values: &[f64],
    mut run: Run,
) -> Result<(Oscillator, Run), Error> {
    let mut document = document.clone();
    for (name, &value) in names.iter().zip(values) {
        match name.as_str() {
            "x0" => run.x0 = value,
            "v0" => run.v0 = Some(value),
            path => *place(&mut document, path)? = value.into(),
        }
    }
    let oscillator = serde_json::from_value(document).map_err(|error| Error::Document {
        reason: error.to_string(),
    })?;
    Ok((oscillator, run))
}

/// An error with the run it belongs to.
pub(crate) fn placed(index: usize, names: &[String], values: &[f64], error: &Error) -> Error {
    let pairs = names.iter().zip(values);
    let row: Vec<String> = pairs.map(|(name, value)| format!("{name} = {value}")).collect();
    Error::Document {
        reason: format!("run {index} ({}): {error}", row.join(", ")),
    }
}

/// The number at a dotted path of the document.
fn place<'a>(document: &'a mut Value, path: &str) -> Result<&'a mut Value, Error> {
    let missing = || Error::Document {
        reason: format!("the system document has no number {path:?}"),
    };
    let pointer = format!("/{}", path.replace('.', "/"));
    let place = document.pointer_mut(&pointer).ok_or_else(missing)?;
    if place.is_number() {
        Ok(place)
    } else {
        Err(missing())
    }
}
