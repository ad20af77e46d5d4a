//! Sweeps: rows of parameters in, a table out.

use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use stickslip::engine::Engine;
use stickslip::hybrid_state::Restart;
use stickslip::model::Start;
use stickslip::regime::Regime;
use stickslip::rows::Rows;
use stickslip::steady_motion::{Look, Steady, steady};
use stickslip::surface::Surface;
use stickslip::sweep::{Link, Sweep};

use crate::table::Table;
use crate::watch::watched;
use crate::{read, refused, rows};

/// How many numbers say how a motion goes on.
pub(crate) const RESTART: usize = Restart::NUMBERS;

pub(crate) fn rows_of(
    document: &str,
    names: Vec<String>,
    values: &PyReadonlyArray1<'_, f64>,
) -> PyResult<Rows> {
    Ok(Rows {
        document: read(document)?,
        names,
        values: values.as_slice()?.to_vec(),
    })
}

/// Run a sweep on the present thread. Each run starts from `start`: x, v (not a number: stuck) and how another went on; in a
/// chain only the first, the others where the one before ended; `before` has the values, the number of the regime and the
/// extent of x of the row before the first. Runs that are not done after `max_seconds` end where they are.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one argument a setting")]
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
) -> PyResult<Bound<'py, PyDict>> {
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
    let link = |(values, regime, extent)| {
        let regime = rows::named(&Regime::ALL, regime, "regime")?;
        Ok::<_, PyErr>(Link {
            values,
            regime,
            extent,
        })
    };
    let before = before.map(link).transpose()?;
    let rows = watched(py, max_seconds, |go_on| {
        if chain {
            sweep.chain(0..sweep.rows.len(), begin, before, go_on)
        } else {
            sweep.rows(0..sweep.rows.len(), &begin, go_on)
        }
    })?;
    let masses = sweep.rows.document["mass"].as_array().map_or(1, Vec::len);
    table(py, &rows, sweep.look.points, masses)
}

/// What is steady in a motion that is there already, as a table of one row.
pub(crate) fn steady_of<'py>(
    py: Python<'py>,
    (engine, contacts): (&mut (impl Engine + Send), usize),
    look: &str,
    period: f64,
    surface: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let (look, surface): (Look, Surface) = (read(look)?, read(surface)?);
    look.within(contacts).map_err(refused)?;
    let row = watched(py, None, |go_on| steady(engine, period, &surface, &look, go_on))?;
    let masses = row.end.as_ref().map_or(1, |end| end.x.len());
    table(py, &[row], look.points, masses)
}

/// The regime and the stop as their numbers; positions and velocities at the end (not a number: stuck), mass by mass; turning
/// points of x and of w and the section, filled with what is not a number; and how the motion goes on.
fn table<'py>(
    py: Python<'py>,
    rows: &[Steady],
    points: usize,
    masses: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let known = |value: f64| if value.is_finite() { value } else { f64::NAN };
    let end = |row: &Steady| row.end.as_ref().map(Start::after).unwrap_or_default();
    let table = Table::new(py, rows)
        .with("regime", |row| row.regime as u8)?
        .with("stop", |row| row.stop as u8)?
        .with("period", |row| row.period)?
        .with("loops", |row| row.loops)?
        .with("events", |row| row.events)?
        .with("chaos", |row| row.chaos)?
        .with("period_time", |row| row.period_time)?
        .with("x_min", |row| known(row.x[0]))?
        .with("x_max", |row| known(row.x[1]))?
        .with("w_min", |row| known(row.w[0]))?
        .with("w_max", |row| known(row.w[1]))?
        .with("x_mean", |row| known(row.mean.0))?
        .with("v_mean", |row| known(row.mean.1))?
        .with("stuck_share", |row| row.stuck_share)?
        .wide("turning_x", points, |row| row.extrema_x.iter().copied())?
        .wide("turning_slip_velocity", points, |row| {
            row.extrema_w.iter().copied()
        })?
        .wide("section_t", points, |row| row.section.iter().map(|point| point.t))?
        .wide("section_x", points, |row| row.section.iter().map(|point| point.x))?
        .wide("section_v", points, |row| row.section.iter().map(|point| point.v))?
        .wide("x_end", masses, |row| end(row).x)?
        .wide("v_end", masses, |row| end(row).v)?
        .wide("restart", RESTART, |row| {
            end(row).restart.into_iter().flat_map(|restart| restart.numbers())
        })?;
    Ok(table.columns())
}
