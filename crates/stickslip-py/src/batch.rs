//! Batches: rows in, columns out, block after block.

use std::sync::atomic::{AtomicBool, Ordering};

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use stickslip::batch::{Batch, Row};
use stickslip::mode::Kind;

use crate::refused;
use crate::sweep::rows_of;
use crate::watch::{Watch, interruptibly};

/// Runs between two words about progress.
const BLOCK: usize = 256;

type Floats<'py> = Bound<'py, PyArray1<f64>>;

/// Run a batch. Returns, a row for each run: x and v of every mass, stop; counts (a column for each kind); sum of stick times; section
/// (keep × (t, x, v), not a number where there are fewer).
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one argument a setting")]
#[expect(
    clippy::needless_pass_by_value,
    reason = "that is how arrays cross the border"
)]
pub(crate) fn batch<'py>(
    py: Python<'py>,
    document: &str,
    names: Vec<String>,
    values: PyReadonlyArray1<'py, f64>,
    run: (f64, f64, u64),
    section: Option<usize>,
    keep: usize,
    workers: usize,
    max_seconds: Option<f64>,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<(Floats<'py>, Floats<'py>, Floats<'py>, Floats<'py>, Floats<'py>)> {
    let value = |text: String| pyo3::exceptions::PyValueError::new_err(text);
    let (t_end, after, max_events) = run;
    let batch = Batch {
        rows: rows_of(document, names, &values)?,
        t_end,
        max_events,
        after,
        section: section.and_then(|index| Kind::ALL.get(index).copied()),
        keep,
    };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(workers)
        .build()
        .map_err(|error| value(error.to_string()))?;
    let mut columns: [Vec<f64>; 5] = Default::default();
    let mut done = 0;
    let count = batch.rows.len();
    let mut watch = Watch::new(max_seconds);
    while done < count {
        let block = done..count.min(done + BLOCK * workers.max(1));
        done = block.end;
        let go_on = |halt: &AtomicBool| !halt.load(Ordering::Relaxed);
        let rows = interruptibly(py, &pool, &mut watch, |halt| batch.rows(block, &|| go_on(halt)))?
            .map_err(|error| refused(&error))?;
        for row in &rows {
            write(row, keep, &mut columns);
        }
        if let Some(progress) = &progress {
            progress.call1((done, count))?;
        }
    }
    let [state, stop, counts, stick_time, sections] = columns.map(|column| column.into_pyarray(py));
    Ok((state, stop, counts, stick_time, sections))
}

fn write(row: &Row, keep: usize, columns: &mut [Vec<f64>; 5]) {
    columns[0].extend(&row.last);
    columns[1].push(f64::from(row.stop as u8));
    columns[2].extend(row.counts.iter().map(|&count| count as f64));
    columns[3].push(row.stick_time);
    columns[4].extend(row.section.iter().flatten());
    columns[4].extend(std::iter::repeat_n(f64::NAN, 3 * (keep - row.section.len())));
}
