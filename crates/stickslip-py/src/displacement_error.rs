//! What an error of the displacement does to a force, at the border.

use numpy::{IntoPyArray, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use stickslip::displacement_error::{self, DisplacementError};

use crate::Array;

/// Errors of the displacement from rest, and the motions that are left open, row by row: see [`DisplacementError::errors`]. The
/// oscillator is its sampling interval, mass, damping and stiffness.
#[pyfunction]
pub(crate) fn displacement_errors<'py>(
    py: Python<'py>,
    oscillator: [f64; 4],
    difference: PyReadonlyArray1<'py, f64>,
    slope: PyReadonlyArray1<'py, f64>,
    carried: Option<PyReadonlyArray1<'py, f64>>,
    lengths: Vec<usize>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let [step, mass, damping, stiffness] = oscillator;
    let oscillator = DisplacementError {
        step,
        mass,
        damping,
        stiffness,
    };
    let carried = carried.as_ref().map(|carried| carried.as_slice()).transpose()?;
    let (difference, slope) = (difference.as_slice()?, slope.as_slice()?);
    alike(
        &lengths,
        [Some(difference), Some(slope), carried].into_iter().flatten(),
    )?;
    let rows = oscillator.errors(difference, slope, carried, &lengths);
    Ok(PyArray2::from_vec2(py, &rows)?)
}

/// Residuals less what open motions, a row each, explain of them: see [`displacement_error::without`].
#[pyfunction]
pub(crate) fn without<'py>(
    py: Python<'py>,
    motions: PyReadonlyArray2<'py, f64>,
    residual: PyReadonlyArray1<'py, f64>,
    prior: Vec<f64>,
    lengths: Vec<usize>,
) -> PyResult<Array<'py, f64>> {
    let residual = residual.as_slice()?;
    let rows: Vec<&[f64]> = motions.as_slice()?.chunks_exact(residual.len().max(1)).collect();
    alike(&lengths, rows.iter().copied().chain([residual]))?;
    if prior.len() != rows.len() {
        return Err(PyValueError::new_err("expected a prior for each open motion"));
    }
    Ok(displacement_error::without(&rows, residual, &prior, &lengths).into_pyarray(py))
}

/// That columns are as long as their stretches together.
fn alike<'a>(lengths: &[usize], columns: impl IntoIterator<Item = &'a [f64]>) -> PyResult<()> {
    let samples = lengths
        .iter()
        .fold(0, |sum: usize, &length| sum.saturating_add(length));
    match columns.into_iter().find(|column| column.len() != samples) {
        Some(column) => Err(PyValueError::new_err(format!(
            "expected columns of {samples} samples, as long as their stretches, got {}",
            column.len()
        ))),
        None => Ok(()),
    }
}
