//! Orbits as rows of numbers: segments and events, one layout for both ways across the border.

use numpy::{IntoPyArray, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use stickslip::clock::Clock;
use stickslip::event::Work;
use stickslip::mode::Kind;
use stickslip::orbit;
use stickslip::simulate::Stop;

use crate::Array;

/// What crosses the border as a row of N numbers.
pub(crate) trait Row<const N: usize>: Sized {
    fn row(&self) -> [f64; N];
    /// None where a number names nothing.
    fn read(row: &[f64; N]) -> Option<Self>;
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "small whole numbers"
)]
fn index(value: f64) -> usize {
    value as usize
}

pub(crate) fn broken() -> PyErr {
    PyValueError::new_err("the columns of the saved orbit do not fit together")
}

/// Row after row.
pub(crate) fn laid_out<'py, T: Row<N>, const N: usize>(py: Python<'py>, rows: &[T]) -> Array<'py, f64> {
    rows.iter()
        .flat_map(Row::row)
        .collect::<Vec<_>>()
        .into_pyarray(py)
}

/// The same back.
pub(crate) fn read<T: Row<N>, const N: usize>(columns: &PyReadonlyArray1<'_, f64>) -> PyResult<Vec<T>> {
    let (rows, rest) = columns.as_slice().map_err(|_| broken())?.as_chunks::<N>();
    if !rest.is_empty() {
        return Err(broken());
    }
    rows.iter().map(|row| T::read(row).ok_or_else(broken)).collect()
}

/// One of the values of a kind by its number.
pub(crate) fn named<T: Copy>(all: &[T], number: usize, kind: &str) -> PyResult<T> {
    let unknown = || {
        PyValueError::new_err(format!(
            "expected the number of a {kind}, below {}, got {number}",
            all.len()
        ))
    };
    all.get(number).copied().ok_or_else(unknown)
}

/// Number, name and sentence of the end of a run.
pub(crate) fn stop_row(stop: Stop) -> (usize, &'static str, &'static str) {
    (stop as usize, stop.name(), stop.sentence())
}

/// Events, evaluations, grazes, fallbacks.
pub(crate) type Counts = (u64, u64, u64, u64);

pub(crate) fn work_of((events, evaluations, grazes, fallbacks): Counts) -> Work {
    Work {
        events,
        evaluations,
        grazes,
        fallbacks,
    }
}

pub(crate) fn work_row(work: Work) -> Counts {
    (work.events, work.evaluations, work.grazes, work.fallbacks)
}

/// Time (high, low), x, v, direction, offset, slope, branch.
impl Row<8> for orbit::Segment {
    fn row(&self) -> [f64; 8] {
        let Clock { high, low } = self.clock;
        let branch = f64::from(self.branch);
        [
            high,
            low,
            self.x,
            self.v,
            self.direction,
            self.offset,
            self.slope,
            branch,
        ]
    }

    fn read(&[high, low, x, v, direction, offset, slope, branch]: &[f64; 8]) -> Option<Self> {
        Some(Self {
            clock: Clock { high, low },
            x,
            v,
            direction,
            offset,
            slope,
            branch: u32::try_from(index(branch)).ok()?,
        })
    }
}

/// t, kind, contact, x, v, force, stick_time, force_rate.
impl Row<8> for orbit::Event {
    fn row(&self) -> [f64; 8] {
        orbit::Event::row(self)
    }

    fn read(&[t, kind, contact, x, v, force, stick_time, force_rate]: &[f64; 8]) -> Option<Self> {
        Some(Self {
            t,
            kind: *Kind::ALL.get(index(kind))?,
            contact: u32::try_from(index(contact)).ok()?,
            x,
            v,
            force,
            stick_time,
            force_rate,
        })
    }
}
