//! Many steady motions over parameters and starts. Rows may stand alone, or follow each other, each starting where the one
//! before ended.

use std::ops::Range;

use crate::engine::Engine;
use crate::error::Error;
use crate::lanes::{forward_all, forward_seen, forward_seen_along_curves};
use crate::model::{Model, Start};
use crate::oscillator::Oscillator;
use crate::regime::Regime;
use crate::rows::Rows;
use crate::steady_motion::{Look, Steady, steady};
use crate::surface::Surface;

/// So many runs go in SIMD lanes, one after the other in each lane.
const RUNS_ABREAST: usize = 256;

/// So many of them, where friction is a smooth curve, while they are looked at.
const CURVES_ABREAST: usize = 16;

/// Many runs of one oscillator.
#[derive(Clone, Debug)]
pub struct Sweep {
    /// The oscillator, and what is varied.
    pub rows: Rows,
    /// What is looked at.
    pub look: Look,
}

impl Sweep {
    /// One run, from `begin` unless the row says otherwise, as long as `go_on` says so.
    ///
    /// # Errors
    /// Values that make no sense.
    pub fn row(&self, index: usize, begin: &Start, go_on: &mut dyn FnMut() -> bool) -> Result<Steady, Error> {
        self.motion(self.rows.row(index), begin, &self.look, go_on)
            .map_err(|error| self.rows.error(index, &error))
    }

    fn motion(
        &self,
        values: &[f64],
        begin: &Start,
        look: &Look,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Steady, Error> {
        let (model, start) = self.model(None, values, begin)?;
        steady_of(&model, &mut model.run(&start, look.max_events)?, look, go_on)
    }

    /// The runs of a range of rows, each from `begin` unless the row says otherwise, up to the end of their windows in SIMD
    /// lanes where that is possible (see [`crate::lanes`]), as long as `go_on` says so.
    ///
    /// # Errors
    /// The first row whose values make no sense.
    pub fn rows(
        &self,
        range: Range<usize>,
        begin: &Start,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Vec<Steady>, Error> {
        self.rows_asking(range, begin, &mut |_| go_on())
    }

    /// The same, asking with the row that goes on alone; with none while they go in lanes.
    ///
    /// # Errors
    /// The first row whose values make no sense.
    pub fn rows_asking(
        &self,
        range: Range<usize>,
        begin: &Start,
        go_on: &mut dyn FnMut(Option<usize>) -> bool,
    ) -> Result<Vec<Steady>, Error> {
        let mut rows = Vec::with_capacity(range.len());
        let own = self.rows.oscillator();
        for first in range.clone().step_by(RUNS_ABREAST) {
            let block = first..range.end.min(first + RUNS_ABREAST);
            let models: Vec<_> = block
                .clone()
                .map(|index| {
                    self.model(own.as_ref(), self.rows.row(index), begin)
                        .map_err(|error| self.rows.error(index, &error))
                })
                .collect::<Result<_, Error>>()?;
            let mut runs: Vec<_> = models
                .iter()
                .zip(block.clone())
                .map(|((model, start), index)| {
                    let run = model.run(start, self.look.max_events);
                    // What is looked at early begins sooner.
                    let unseen = if self.look.early > 0.0 {
                        0.5 * self.look.early
                    } else {
                        self.look.transient
                    };
                    let transient = unseen * model.period();
                    Ok((run.map_err(|error| self.rows.error(index, &error))?, transient))
                })
                .collect::<Result<_, Error>>()?;
            forward_all(&mut runs, &mut || go_on(None), None);
            if self.look.early == 0.0 {
                for ((model, _), (_, end)) in models.iter().zip(&mut runs) {
                    *end = (self.look.transient + self.look.window) * model.period();
                }
                forward_seen(&mut runs, &mut || go_on(None));
            }
            let few = runs.chunks_mut(CURVES_ABREAST).zip(models.chunks(CURVES_ABREAST));
            let mut index = block.start;
            for (runs, models) in few {
                if self.look.early == 0.0 {
                    forward_seen_along_curves(runs, &mut || go_on(None));
                }
                for ((model, _), (engine, _)) in models.iter().zip(runs) {
                    let row = steady_of(model, engine, &self.look, &mut || go_on(Some(index)));
                    rows.push(row.map_err(|error| self.rows.error(index, &error))?);
                    index += 1;
                }
            }
        }
        Ok(rows)
    }

    /// The model of the values of a row, and where its run begins.
    fn model(
        &self,
        own: Option<&Oscillator>,
        values: &[f64],
        begin: &Start,
    ) -> Result<(Model, Start), Error> {
        let (model, mut start) = self.rows.model_beside(own, values, begin)?;
        if let Some(restart) = start.restart.filter(|_| self.varies_law()) {
            // Lines and memory of one law say nothing under another.
            start.restart = None;
            if let Model::Closed(oscillator) = &model {
                start.v = vec![oscillator.drive_velocity - restart.w];
            }
        }
        Ok((model, start))
    }

    fn varies_law(&self) -> bool {
        self.rows.names.iter().any(|name| name.starts_with("law."))
    }

    /// The runs of a range of rows, each from where the one before ended, the first from `begin`: with its slip velocity, and
    /// with what the contact remembers unless it is the law that is varied. `before` is the row before the first, if that is
    /// where it begins.
    ///
    /// A step of the parameter moves the steady motion, and can throw the state into the basin of another one while the motion
    /// still attracts. Where the motion changes in kind or size, the step is therefore made again in smaller ones.
    ///
    /// # Errors
    /// The first row whose values make no sense.
    pub fn chain(
        &self,
        range: Range<usize>,
        mut begin: Start,
        mut before: Option<Link>,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Vec<Steady>, Error> {
        let mut rows = Vec::with_capacity(range.len());
        for index in range {
            let mut row = self.row(index, &begin, go_on)?;
            if let Some(before) = before.filter(|before| row.end.is_some() && !before.continues(&row)) {
                row = self.approach(before, &begin, index, go_on).unwrap_or(row);
            }
            // What ran away or got stuck in time is no start for its neighbour.
            before = row.end.as_ref().map(|_| Link::new(self.rows.row(index), &row));
            begin = row.end.as_ref().map(Start::after).unwrap_or_default();
            rows.push(row);
        }
        Ok(rows)
    }

    /// The motion of a row in smaller steps from the one `before`, which ended at `begin`; none where it is lost on the way.
    fn approach(
        &self,
        mut before: Link,
        begin: &Start,
        index: usize,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Option<Steady> {
        let scout = Look {
            points: 0,
            decide: 0,
            ..self.look
        };
        let (from, to) = (before.values.clone(), self.rows.row(index));
        let (mut begin, mut done, mut step) = (begin.clone(), 0.0, 0.5);
        while step >= FINEST_STEP {
            let share = done + step;
            let arrives = share == 1.0;
            let values: Vec<f64> = from
                .iter()
                .zip(to)
                .map(|(from, to)| if arrives { *to } else { from + share * (to - from) })
                .collect();
            let look = if arrives { &self.look } else { &scout };
            let row = self.motion(&values, &begin, look, go_on).ok()?;
            let end = row.end.as_ref()?;
            if !before.continues(&row) {
                step *= 0.5;
            } else if arrives {
                return Some(row);
            } else {
                (before, begin, done) = (Link::new(&values, &row), Start::after(end), share);
            }
        }
        None
    }
}

/// The smallest part of a step in which a chain follows a motion.
const FINEST_STEP: f64 = 1.0 / 64.0;

/// A motion whose amplitude changes by more than this part from one step to the next may be another one.
const AMPLITUDE_JUMP: f64 = 0.25;

/// What a chain has come to: the values of the row, and the kind and size of the motion there.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// The values of the row.
    pub values: Vec<f64>,
    /// The kind of motion.
    pub regime: Regime,
    /// max x − min x.
    pub extent: f64,
}

impl Link {
    /// What a chain has come to with a row of these values.
    pub fn new(values: &[f64], row: &Steady) -> Self {
        Self {
            values: values.to_vec(),
            regime: row.regime,
            extent: row.x[1] - row.x[0],
        }
    }

    /// Whether a row goes on with the motion, as far as kind and size can tell.
    fn continues(&self, row: &Steady) -> bool {
        let extent = row.x[1] - row.x[0];
        let alike = (extent - self.extent).abs() <= AMPLITUDE_JUMP * extent.max(self.extent);
        self.regime == row.regime && (alike || self.regime.rests())
    }
}

fn steady_of(
    model: &Model,
    engine: &mut impl Engine,
    look: &Look,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Steady, Error> {
    look.within(model.contacts())?;
    let surface = look.surface.unwrap_or_else(|| Surface::usual(model));
    steady(engine, model.period(), &surface, look, go_on)
}
