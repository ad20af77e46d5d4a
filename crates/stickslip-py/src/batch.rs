//! Batches: rows in, columns out, block after block.

use std::sync::atomic::{AtomicBool, Ordering};

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use stickslip::batch::Batch;
use stickslip::mode::Kind;

use crate::refused;
use crate::sweep::rows_of;
use crate::table::Table;
use crate::watch::{Watch, interruptibly};

/// Runs between two words about progress.
const RUNS_A_REPORT: usize = 256;

/// Run a batch. Returns a table: x and v of every mass, the number of the stop, events (a column for each kind), the sum of stick
/// times, and t, x, v of the events of the section, not a number where there are fewer than `keep`.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one argument a setting")]
pub(crate) fn batch<'py>(
    py: Python<'py>,
    document: &str,
    names: Vec<String>,
    values: PyReadonlyArray1<'py, f64>,
    run: (f64, f64, u64),
    section: Option<&str>,
    keep: usize,
    workers: usize,
    max_seconds: Option<f64>,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let (t_end, after, max_events) = run;
    let batch = Batch {
        rows: rows_of(document, names, &values)?,
        t_end,
        max_events,
        after,
        section: Kind::ALL.into_iter().find(|kind| Some(kind.name()) == section),
        keep,
    };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(workers)
        .build()
        .map_err(refused)?;
    let mut done = 0;
    let count = batch.rows.len();
    let mut rows = Vec::with_capacity(count);
    let mut watch = Watch::new(max_seconds);
    while done < count {
        let block = done..count.min(done + RUNS_A_REPORT * workers.max(1));
        done = block.end;
        let go_on = |halt: &AtomicBool| !halt.load(Ordering::Relaxed);
        let some = interruptibly(py, &pool, &mut watch, |halt| batch.rows(block, &|| go_on(halt)))?
            .map_err(refused)?;
        rows.extend(some);
        if let Some(progress) = &progress {
            progress.call1((done, count))?;
        }
    }
    let masses = rows.first().map_or(0, |row| row.last.len() / 2);
    let counts = rows.iter().flat_map(|row| row.counts);
    let counts = PyArray1::from_iter(py, counts).reshape([count, Kind::ALL.len()])?;
    let table = Table::new(py, &rows)
        .wide("x", masses, |row| row.last[..masses].iter().copied())?
        .wide("v", masses, |row| row.last[masses..].iter().copied())?
        .with("stop", |row| row.stop as u8)?
        .with("stick_time", |row| row.stick_time)?
        .wide("section_t", keep, |row| row.section.iter().map(|point| point[0]))?
        .wide("section_x", keep, |row| row.section.iter().map(|point| point[1]))?
        .wide("section_v", keep, |row| row.section.iter().map(|point| point[2]))?
        .columns();
    table.set_item("events", counts)?;
    Ok(table)
}
