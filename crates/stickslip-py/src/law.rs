//! Laws with adhesion at the border, read and checked once.

use numpy::{IntoPyArray, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde_json::Value;
use stickslip::law::{self, Friction, Rest, StaticFriction};
use stickslip::replay;

use crate::{Array, read, refused};

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
    let force = pairs.map(|(&stick_time, &force_rate)| surface.force(Rest::new(stick_time, force_rate)));
    Ok(force.collect::<Vec<_>>().into_pyarray(py))
}

/// A law that says the static limit, with its document.
#[pyclass(frozen, module = "stickslip._core")]
pub(crate) struct Law {
    law: law::Law,
    document: Value,
}

impl Law {
    fn of(document: Value) -> PyResult<Self> {
        let law: law::Law = serde_json::from_value(document.clone()).map_err(refused)?;
        law.validate().map_err(refused)?;
        Ok(Self { law, document })
    }
}

#[pymethods]
impl Law {
    #[new]
    fn new(document: &str) -> PyResult<Self> {
        Self::of(read(document)?)
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
            self.law
                .toward(force_rate)
                .static_limit(Rest::new(stick_time, force_rate.abs()))
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
        force.map(|force| force.into_pyarray(py)).map_err(refused)
    }
}
