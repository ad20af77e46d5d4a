//! Sections and sweeps: documents and rows in, columns out.

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde::de::DeserializeOwned;
use stickslip::engine::{Engine, Reached};
use stickslip::model::Start;
use stickslip::regime::Regime;
use stickslip::restart::Restart;
use stickslip::rows::Rows;
use stickslip::section::{Point, Surface, section as points_of};
use stickslip::sweep::{Link, Look, Steady, Sweep, steady};
use stickslip::zero_one;

use crate::refused;
use crate::system::System;
use crate::watch::watched;

type Floats<'py> = Bound<'py, PyArray1<f64>>;

/// The columns of a run of a sweep.
pub(crate) const COLUMNS: [&str; 14] = [
    "regime",
    "period",
    "chaos",
    "loops",
    "period_time",
    "x_min",
    "x_max",
    "w_min",
    "w_max",
    "x_mean",
    "v_mean",
    "stuck_share",
    "events",
    "stop",
];

/// How many numbers say how a motion goes on.
pub(crate) const RESTART: usize = Restart::NUMBERS;

fn wrong(error: &impl ToString) -> PyErr {
    PyValueError::new_err(error.to_string())
}

pub(crate) fn rows_of(
    document: &str,
    names: Vec<String>,
    values: &PyReadonlyArray1<'_, f64>,
) -> PyResult<Rows> {
    Ok(Rows {
        document: serde_json::from_str(document).map_err(|error| wrong(&error))?,
        names,
        values: values.as_slice()?.to_vec(),
    })
}

type Run = (Option<Vec<f64>>, Option<Vec<f64>>, f64, u64);
/// Of one run after the other: [`COLUMNS`]; positions and velocities at the end (not a number: stuck), mass by mass; turning
/// points of x and of w; the section (t, x, v), each filled with what is not a number; and how the motion goes on.
pub(crate) type Table<'py> = (
    Floats<'py>,
    Floats<'py>,
    Floats<'py>,
    Floats<'py>,
    Floats<'py>,
    Floats<'py>,
    Floats<'py>,
);

fn read<T: DeserializeOwned>(document: &str) -> PyResult<T> {
    serde_json::from_str(document).map_err(|error| wrong(&error))
}

/// The last points of a section of a contact's mass, 7 numbers each: t, x, v, w, force, stick_time, force_rate; and why the run
/// ended.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one argument a setting")]
pub(crate) fn section<'py>(
    py: Python<'py>,
    system: &System,
    surface: &str,
    run: Run,
    contact: usize,
    after: f64,
    most: usize,
    max_seconds: Option<f64>,
) -> PyResult<(Floats<'py>, usize)> {
    let model = system.model()?;
    let (x, v, t_end, max_events) = run;
    let start = Start {
        x: x.unwrap_or_default(),
        v: v.unwrap_or_default(),
        restart: None,
    };
    let mut engine = model.run(&start, max_events).map_err(|error| refused(&error))?;
    section_of(
        py,
        &mut engine,
        surface,
        contact,
        (after, t_end),
        most,
        max_seconds,
    )
}

/// The same of any engine.
pub(crate) fn section_of<'py>(
    py: Python<'py>,
    engine: &mut (impl Engine + Send),
    surface: &str,
    contact: usize,
    span: (f64, f64),
    most: usize,
    max_seconds: Option<f64>,
) -> PyResult<(Floats<'py>, usize)> {
    let surface = read(surface)?;
    let (points, stop) = watched(py, max_seconds, |go_on| {
        points_of(engine, contact, &surface, span, most, go_on)
    })?;
    let rows = points.iter().flat_map(|row| {
        let Point { t, x, v, w } = row.point;
        [t, x, v, w, row.force, row.stick_time, row.force_rate]
    });
    Ok((rows.collect::<Vec<_>>().into_pyarray(py), stop as usize))
}

/// Run a sweep on the present thread. Each run starts from `start`: x, v (not a number: stuck) and how another went on; in a
/// chain only the first, the others where the one before ended; `before` has the values, the number of the regime and the
/// extent of x of the row before the first. Runs that are not done after `max_seconds` end where they are.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one argument a setting")]
#[expect(
    clippy::needless_pass_by_value,
    reason = "that is how arrays cross the border"
)]
pub(crate) fn sweep<'py>(
    py: Python<'py>,
    document: &str,
    names: Vec<String>,
    values: PyReadonlyArray1<'py, f64>,
    look: &str,
    chain: bool,
    start: Option<(Vec<f64>, Vec<f64>, Vec<f64>)>,
    before: Option<(Vec<f64>, usize, f64)>,
    max_seconds: Option<f64>,
) -> PyResult<Table<'py>> {
    let sweep = Sweep {
        rows: rows_of(document, names, &values)?,
        look: read(look)?,
    };
    let (x, v, restart) = start.unwrap_or_default();
    let begin = Start {
        x,
        v,
        restart: Restart::read(&restart),
    };
    let before = before.map(|(values, regime, extent)| Link {
        values,
        regime: Regime::ALL[regime],
        extent,
    });
    let rows = watched(py, max_seconds, |go_on| {
        if chain {
            sweep.chain(0..sweep.rows.len(), begin, before, go_on)
        } else {
            sweep.rows(0..sweep.rows.len(), &begin, go_on)
        }
    })?;
    let masses = sweep.rows.document["mass"].as_array().map_or(1, Vec::len);
    Ok(table(py, &rows, sweep.look.points, masses))
}

/// What is steady in a motion that is there already, as a table of one row.
pub(crate) fn steady_of<'py>(
    py: Python<'py>,
    engine: &mut (impl Engine + Send),
    look: &str,
    period: f64,
    surface: &str,
) -> PyResult<Table<'py>> {
    let (look, surface): (Look, Surface) = (read(look)?, read(surface)?);
    let row = watched(py, None, |go_on| steady(engine, period, &surface, &look, go_on))?;
    let masses = row.end.as_ref().map_or(1, |end| end.x.len());
    Ok(table(py, &[row], look.points, masses))
}

fn table<'py>(py: Python<'py>, rows: &[Steady], points: usize, masses: usize) -> Table<'py> {
    let mut columns: [Vec<f64>; 7] = Default::default();
    for row in rows {
        columns[0].extend(numbers(row));
        let end = row.end.as_ref().map(Start::after).unwrap_or_default();
        pad(&mut columns[1], end.x.into_iter(), masses);
        pad(&mut columns[2], end.v.into_iter(), masses);
        pad(&mut columns[3], row.extrema_x.iter().copied(), points);
        pad(&mut columns[4], row.extrema_w.iter().copied(), points);
        let section = row.section.iter().flat_map(|point| [point.t, point.x, point.v]);
        pad(&mut columns[5], section, 3 * points);
        let restart = end.restart.iter().flat_map(Restart::numbers);
        pad(&mut columns[6], restart, Restart::NUMBERS);
    }
    let [a, b, c, d, e, f, g] = columns.map(|column| column.into_pyarray(py));
    (a, b, c, d, e, f, g)
}

/// A motion of one contact's mass that was integrated elsewhere, by columns: t, x, v, a, w, slip acceleration, and whether it is
/// as good as stuck.
#[pyclass(frozen, module = "stickslip._core")]
pub(crate) struct Samples([Vec<f64>; 6], Vec<bool>, u64);

#[pymethods]
impl Samples {
    #[new]
    fn new(columns: Vec<Vec<f64>>, stuck: Vec<bool>, events: u64) -> PyResult<Self> {
        let fits = columns.iter().all(|column| column.len() == stuck.len());
        match columns.try_into() {
            Ok(columns) if fits => Ok(Self(columns, stuck, events)),
            _ => Err(PyValueError::new_err("expected six columns of one length")),
        }
    }

    /// What is steady in it, as a table of one row.
    fn steady<'py>(&self, py: Python<'py>, look: &str, period: f64, surface: &str) -> PyResult<Table<'py>> {
        steady_of(py, &mut self.engine(), look, period, surface)
    }

    /// The points of a section from a time on.
    fn section<'py>(
        &self,
        py: Python<'py>,
        surface: &str,
        contact: usize,
        after: f64,
        most: usize,
    ) -> PyResult<(Floats<'py>, usize)> {
        let end = self.0[0].last().copied().unwrap_or(0.0);
        section_of(py, &mut self.engine(), surface, contact, (after, end), most, None)
    }
}

impl Samples {
    fn engine(&self) -> stickslip::engine::Samples<'_> {
        let [t, x, v, a, w, slip_acceleration] = &self.0;
        stickslip::engine::Samples {
            t,
            x,
            v,
            a,
            w,
            slip_acceleration,
            stuck: &self.1,
            events: self.2,
            end: Reached::default(),
        }
    }
}

/// The growth rate of the 0–1 test for chaos.
#[pyfunction]
#[expect(
    clippy::needless_pass_by_value,
    reason = "that is how arrays cross the border"
)]
pub(crate) fn chaos(series: PyReadonlyArray1<'_, f64>) -> PyResult<f64> {
    Ok(zero_one::growth(series.as_slice()?))
}

fn numbers(row: &Steady) -> [f64; COLUMNS.len()] {
    let known = |value: f64| if value.is_finite() { value } else { f64::NAN };
    [
        f64::from(row.regime as u8),
        f64::from(row.period),
        row.chaos,
        f64::from(row.loops),
        row.period_time,
        known(row.x[0]),
        known(row.x[1]),
        known(row.w[0]),
        known(row.w[1]),
        known(row.mean.0),
        known(row.mean.1),
        row.stuck_share,
        row.events as f64,
        f64::from(row.stop as u8),
    ]
}

fn pad(column: &mut Vec<f64>, values: impl Iterator<Item = f64>, width: usize) {
    let full = column.len() + width;
    column.extend(values);
    column.resize(full, f64::NAN);
}
