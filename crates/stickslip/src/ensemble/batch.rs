//! Many runs of one oscillator or system over parameters and starts, on all cores. Each run depends on its own row alone, so the
//! results are the same for any number of workers; memory grows only with what is asked back.

use std::collections::VecDeque;
use std::ops::Range;

#[cfg(feature = "parallel")]
use rayon::prelude::*;

use crate::engine::Engine;
use crate::error::{Error, positive};
use crate::lanes::{OnEvent, forward_all};
use crate::mode::Kind;
use crate::model::{Running, Start};
use crate::observer::Observer;
use crate::orbit::Event;
use crate::rows::Rows;
use crate::section::keep;
use crate::simulate::Stop;

/// So many runs are one task, and go in SIMD lanes.
const RUNS_ABREAST: usize = 64;

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
        let blocks: Vec<_> = range.clone().step_by(RUNS_ABREAST).collect();
        #[cfg(feature = "parallel")]
        let blocks = blocks.into_par_iter();
        #[cfg(not(feature = "parallel"))]
        let blocks = blocks.into_iter();
        let rows: Vec<Result<Vec<Row>, Error>> = blocks
            .map(|first| self.block(first..range.end.min(first + RUNS_ABREAST), go_on))
            .collect();
        Ok(rows.into_iter().collect::<Result<Vec<_>, _>>()?.concat())
    }

    /// Runs that go in SIMD lanes where that is possible.
    fn block(&self, range: Range<usize>, go_on: &impl Fn() -> bool) -> Result<Vec<Row>, Error> {
        let of = |index: usize| move |error| self.rows.error(index, &error);
        let own = self.rows.oscillator();
        let models = range.clone().map(|index| {
            let model = || {
                positive("t_end", self.t_end)?;
                self.rows
                    .model_beside(own.as_ref(), self.rows.row(index), &Start::default())
            };
            model().map_err(of(index))
        });
        let models: Vec<_> = models.collect::<Result<_, _>>()?;
        let runs = models.iter().zip(range.clone()).map(|((model, start), index)| {
            let run = model.run(start, self.max_events).map_err(of(index))?;
            Ok((run, self.t_end))
        });
        let mut runs: Vec<_> = runs.collect::<Result<_, Error>>()?;
        let mut tallies: Vec<_> = runs.iter().map(|_| self.tally(go_on)).collect();
        let on_event: OnEvent = &mut |index, event, _| {
            if event.t >= self.after {
                tallies[index].event(event);
            }
        };
        forward_all(&mut runs, &mut || go_on(), Some(on_event));
        let rows = runs
            .into_iter()
            .zip(tallies)
            .zip(range)
            .map(|(((engine, _), tally), index)| self.row(engine, tally).map_err(of(index)));
        rows.collect()
    }

    fn tally<'a, F>(&'a self, go_on: &'a F) -> Tally<'a, F> {
        Tally {
            batch: self,
            row: Row {
                last: Vec::new(),
                counts: [0; Kind::ALL.len()],
                stick_time: 0.0,
                section: VecDeque::new(),
                stop: Stop::End,
            },
            go_on,
        }
    }

    fn row(&self, mut engine: Running, mut tally: Tally<impl Fn() -> bool>) -> Result<Row, Error> {
        tally.row.stop = engine.go(self.t_end, self.after, &mut tally)?;
        let end = engine.end();
        tally.row.last = [&*end.x, &end.v].concat();
        Ok(tally.row)
    }
}
