//! Tables at the border: columns by name, each of its own type, a row for each run.

use numpy::{Element, IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Rows of `width` numbers; what a row has less is filled with what is not a number.
pub(crate) fn rows<R: IntoIterator<Item = f64>>(
    py: Python<'_>,
    width: usize,
    rows: impl ExactSizeIterator<Item = R>,
) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let shape = [rows.len(), width];
    let mut numbers = Vec::new();
    let size = shape[0].saturating_mul(width);
    numbers
        .try_reserve_exact(size)
        .map_err(|_| PyMemoryError::new_err(format!("no memory for {} rows of {width} numbers", shape[0])))?;
    for (index, row) in rows.enumerate() {
        numbers.extend(row);
        numbers.resize((index + 1) * width, f64::NAN);
    }
    numbers.into_pyarray(py).reshape(shape)
}

/// What is known of runs, one after the other.
pub(crate) struct Table<'py, 'a, T> {
    columns: Bound<'py, PyDict>,
    runs: &'a [T],
}

impl<'py, 'a, T> Table<'py, 'a, T> {
    pub(crate) fn new(py: Python<'py>, runs: &'a [T]) -> Self {
        let columns = PyDict::new(py);
        Self { columns, runs }
    }

    /// With a column of one value a run.
    pub(crate) fn with<V: Element>(self, name: &str, value: impl FnMut(&T) -> V) -> PyResult<Self> {
        let column = PyArray1::from_iter(self.columns.py(), self.runs.iter().map(value));
        self.columns.set_item(name, column)?;
        Ok(self)
    }

    /// With a column of `width` numbers a run.
    pub(crate) fn wide<R: IntoIterator<Item = f64>>(
        self,
        name: &str,
        width: usize,
        row: impl FnMut(&'a T) -> R,
    ) -> PyResult<Self> {
        let column = rows(self.columns.py(), width, self.runs.iter().map(row))?;
        self.columns.set_item(name, column)?;
        Ok(self)
    }

    pub(crate) fn columns(self) -> Bound<'py, PyDict> {
        self.columns
    }
}
