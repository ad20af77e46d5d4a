//! Sections and sweeps: documents and rows in, columns out.

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use stickslip::rows::Rows;
use stickslip::section::section as points_of;
use stickslip::simulate::Run;
use stickslip::structure::Oscillator;
use stickslip::sweep::{Begin, Onward, Steady, Sweep};
use stickslip::zero_one;

use crate::refused;
use crate::watch::watched;

type Floats<'py> = Bound<'py, PyArray1<f64>>;

/// The columns of a run of a sweep.
pub(crate) const COLUMNS: [&str; 17] = [
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
    "x_end",
    "v_end",
    "stuck_end",
    "events",
    "stop",
];

/// How many numbers say how a motion goes on.
pub(crate) const ONWARD: usize = Onward::NUMBERS;

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

/// The last points of a section, 6 numbers each: t, x, v, force, stick_time, force_rate; and why the run ended.
#[pyfunction]
pub(crate) fn section<'py>(
    py: Python<'py>,
    document: &str,
    surface: &str,
    run: (f64, Option<f64>, f64, u64),
    after: f64,
    most: usize,
    max_seconds: Option<f64>,
) -> PyResult<(Floats<'py>, usize)> {
    let oscillator = Oscillator::from_json(document).map_err(|error| refused(&error))?;
    let surface = serde_json::from_str(surface).map_err(|error| wrong(&error))?;
    let (x0, v0, t_end, max_events) = run;
    let run = Run {
        x0,
        v0,
        t_end,
        max_events,
    };
    let (points, stop) = watched(py, max_seconds, |go_on| {
        points_of(&oscillator, run, &surface, after, most, go_on)
    })?;
    let rows = points.iter().flat_map(|row| {
        let point = row.point;
        [
            point.t,
            point.x,
            point.v,
            row.force,
            row.stick_time,
            row.force_rate,
        ]
    });
    Ok((rows.collect::<Vec<_>>().into_pyarray(py), stop as usize))
}

/// Run a sweep on the present thread. Returns, a row for each run: [`COLUMNS`]; turning points of x and of w; the section
/// (t, x, v), each filled with what is not a number; and how the motion goes on. Each run starts from `start`, position and
/// velocity (not a number: stuck) or how another went on; in a chain only the first, the others where the one before ended.
#[pyfunction]
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
    start: Option<Vec<f64>>,
) -> PyResult<(Floats<'py>, Floats<'py>, Floats<'py>, Floats<'py>, Floats<'py>)> {
    let sweep = Sweep {
        rows: rows_of(document, names, &values)?,
        look: serde_json::from_str(look).map_err(|error| wrong(&error))?,
    };
    let begin = start.and_then(|numbers| match numbers[..] {
        [x, v] => Some(Begin::State(x, (!v.is_nan()).then_some(v))),
        _ => Onward::read(&numbers).map(Begin::Onward),
    });
    let rows = watched(py, None, |go_on| {
        if chain {
            sweep.chain(0..sweep.rows.len(), begin, go_on)
        } else {
            (0..sweep.rows.len())
                .map(|index| sweep.row(index, begin, go_on))
                .collect()
        }
    })?;
    let points = sweep.look.points;
    let mut columns: [Vec<f64>; 5] = Default::default();
    for row in &rows {
        columns[0].extend(numbers(row));
        pad(&mut columns[1], row.turning_x.iter().copied(), points);
        pad(&mut columns[2], row.turning_w.iter().copied(), points);
        let section = row.section.iter().flat_map(|point| [point.t, point.x, point.v]);
        pad(&mut columns[3], section, 3 * points);
        let onward = row.onward.iter().flat_map(Onward::numbers);
        pad(&mut columns[4], onward, Onward::NUMBERS);
    }
    let [numbers, turning_x, turning_w, section, onward] = columns.map(|column| column.into_pyarray(py));
    Ok((numbers, turning_x, turning_w, section, onward))
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
    let (x_end, v_end) = row.end;
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
        known(x_end),
        v_end.map_or(f64::NAN, known),
        f64::from(u8::from(v_end.is_none())),
        row.events as f64,
        f64::from(row.stop as u8),
    ]
}

fn pad(column: &mut Vec<f64>, values: impl Iterator<Item = f64>, width: usize) {
    let full = column.len() + width;
    column.extend(values);
    column.resize(full, f64::NAN);
}
