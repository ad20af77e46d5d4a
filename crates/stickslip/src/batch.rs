//! Many runs of one oscillator or system over parameters and starts, on all cores. Each run depends on its own row alone, so the
//! results are the same for any number of workers; memory grows only with what is asked back.

use std::collections::VecDeque;
use std::ops::Range;

#[cfg(feature = "parallel")]
use rayon::prelude::*;

use crate::engine::Engine;
use crate::error::{Error, positive};
use crate::mode::Kind;
use crate::model::Start;
use crate::observer::Observer;
use crate::orbit::Event;
use crate::rows::Rows;
use crate::section::keep;
use crate::simulate::Stop;

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

/// Counts the events of a run.
struct Tally<'a, F> {
    batch: &'a Batch,
    row: Row,
    go_on: &'a F,
}

impl<F: Fn() -> bool> Observer for Tally<'_, F> {
    const PASSES: bool = false;

    fn event(&mut self, event: &Event) {
        self.row.counts[event.kind as usize] += 1;
        if event.kind == Kind::Release {
            self.row.stick_time += event.stick_time;
        }
        if self.batch.section == Some(event.kind) {
            keep(
                &mut self.row.section,
                self.batch.keep,
                [event.t, event.x, event.v],
            );
        }
    }

    fn go_on(&mut self) -> bool {
        (self.go_on)()
    }
}

impl Batch {
    /// The runs of a range of rows, in their order, on the threads of the present rayon pool (feature `parallel`) or one
    /// after the other; once `go_on` says no, what is
    /// left of them is cut short.
    ///
    /// # Errors
    /// The first row, in their order, whose values make no sense.
    pub fn rows(&self, range: Range<usize>, go_on: &(impl Fn() -> bool + Sync)) -> Result<Vec<Row>, Error> {
        #[cfg(feature = "parallel")]
        let range = range.into_par_iter();
        let rows: Vec<Result<Row, Error>> = range.map(|index| self.row(index, go_on)).collect();
        rows.into_iter().collect()
    }

    fn row(&self, index: usize, go_on: &impl Fn() -> bool) -> Result<Row, Error> {
        let run = || {
            positive("t_end", self.t_end)?;
            let (model, start) = self.rows.model(index, &Start::default())?;
            let mut tally = Tally {
                batch: self,
                row: Row {
                    last: Vec::new(),
                    counts: [0; Kind::ALL.len()],
                    stick_time: 0.0,
                    section: VecDeque::new(),
                    stop: Stop::End,
                },
                go_on,
            };
            let mut engine = model.run(&start, self.max_events)?;
            tally.row.stop = engine.go(self.t_end, self.after, &mut tally)?;
            let end = engine.end();
            tally.row.last = [&*end.x, &end.v].concat();
            Ok(tally.row)
        };
        run().map_err(|error| self.rows.error(index, &error))
    }
}
