//! Laws with adhesion at the border, read and checked once.
#![expect(
    clippy::needless_pass_by_value,
    reason = "that is how arrays cross the border"
)]

use numpy::{IntoPyArray, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde_json::Value;
use stickslip::displacement::{self, Oscillator};
use stickslip::law::{self, Friction, Hold, StaticFriction};
use stickslip::replay;

use crate::{Array, refused};

/// The surface f_s(t_s, δ) of numbers that need not make a law, as a fit of its parts asks for: limit, rate, exponent, the force
/// rate that halves the growth (none: no dependence), drop, its scale and its exponent.
#[pyfunction]
pub(crate) fn static_friction<'py>(
    py: Python<'py>,
    growth: [f64; 3],
    force_rate_scale: Option<f64>,
    fall: [f64; 3],
    stick_time: PyReadonlyArray1<'py, f64>,
    force_rate: PyReadonlyArray1<'py, f64>,
) -> PyResult<Array<'py, f64>> {
    let ([limit, rate, exponent], [drop, drop_scale, drop_exponent]) = (growth, fall);
    let surface = StaticFriction {
        initial: 0.0,
        drop,
        drop_scale,
        drop_exponent,
        limit,
        rate,
        exponent,
        force_rate_scale,
        force_rate_exponent: 1.0,
        second_drop: 0.0,
        second_drop_scale: 1.0,
        second_drop_exponent: 1.0,
    };
    let pairs = stick_time.as_slice()?.iter().zip(force_rate.as_slice()?);
    let force = pairs.map(|(&stick_time, &force_rate)| {
        surface.force(Hold {
            stick_time,
            force_rate,
        })
    });
    Ok(force.collect::<Vec<_>>().into_pyarray(py))
}

/// Errors of the displacement from rest, and the motions that are left open, row by row: see [`Oscillator::errors`]. The
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
    let oscillator = Oscillator {
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

/// Residuals less what open motions, a row each, explain of them: see [`displacement::without`].
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
    Ok(displacement::without(&rows, residual, &prior, &lengths).into_pyarray(py))
}

/// That columns are as long as their stretches together.
fn alike<'a>(lengths: &[usize], columns: impl IntoIterator<Item = &'a [f64]>) -> PyResult<()> {
    let samples: usize = lengths.iter().sum();
    match columns.into_iter().find(|column| column.len() != samples) {
        Some(column) => Err(PyValueError::new_err(format!(
            "expected columns of {samples} samples, as long as their stretches, got {}",
            column.len()
        ))),
        None => Ok(()),
    }
}

/// A law that says the static limit, with its document.
#[pyclass(frozen, module = "stickslip._core")]
pub(crate) struct Law {
    law: law::Law,
    document: Value,
}

impl Law {
    fn of(document: Value) -> PyResult<Self> {
        let law: law::Law = serde_json::from_value(document.clone())
            .map_err(|error| PyValueError::new_err(error.to_string()))?;
        law.validate().map_err(|error| refused(&error))?;
        Ok(Self { law, document })
    }
}

#[pymethods]
impl Law {
    #[new]
    fn new(document: &str) -> PyResult<Self> {
        Self::of(serde_json::from_str(document).map_err(|error| PyValueError::new_err(error.to_string()))?)
    }

    /// The same with other numbers, each at its place in the document.
    fn with_numbers(&self, numbers: Vec<(String, f64)>) -> PyResult<Self> {
        let mut document = self.document.clone();
        for (path, number) in numbers {
            let missing =
                || PyValueError::new_err(format!("the law has no number {path} that could be {number}"));
            let number_there = document.pointer_mut(&path).filter(|_| number.is_finite());
            *number_there.ok_or_else(missing)? = number.into();
        }
        Self::of(document)
    }

    /// The break-away force for stick times and force rates, in the direction of the force rate.
    fn break_away<'py>(
        &self,
        py: Python<'py>,
        stick_time: PyReadonlyArray1<'py, f64>,
        force_rate: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Array<'py, f64>> {
        let pairs = stick_time.as_slice()?.iter().zip(force_rate.as_slice()?);
        let force = pairs.map(|(&stick_time, &force_rate)| {
            self.law.toward(force_rate).break_away(Hold {
                stick_time,
                force_rate: force_rate.abs(),
            })
        });
        Ok(force.collect::<Vec<_>>().into_pyarray(py))
    }

    /// The friction it predicts along a measured motion.
    fn force_along<'py>(
        &self,
        py: Python<'py>,
        t: PyReadonlyArray1<'py, f64>,
        w: PyReadonlyArray1<'py, f64>,
        stuck: PyReadonlyArray1<'py, bool>,
        force_rate: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Array<'py, f64>> {
        let (stuck, force_rate) = (stuck.as_slice()?, force_rate.as_slice()?);
        let force = replay::force_along(&self.law, t.as_slice()?, w.as_slice()?, stuck, force_rate);
        force
            .map(|force| force.into_pyarray(py))
            .map_err(|error| refused(&error))
    }
}
