//! Laws with an internal state at the border: the right-hand sides that an integrator in Python asks for.

use numpy::{IntoPyArray, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use stickslip::state_law::{self, StateFriction, StateLaw};
use stickslip::state_oscillator::StateOscillator;

use crate::{Array, refused};

/// Whether the law of a JSON document, or of the oscillator in it, has an internal state.
pub(crate) fn has_state(document: &str) -> bool {
    let tag = |value: &serde_json::Value| value.get("type").and_then(|tag| tag.as_str().map(str::to_owned));
    serde_json::from_str::<serde_json::Value>(document)
        .ok()
        .and_then(|value| tag(&value).or_else(|| value.get("law").and_then(tag)))
        .is_some_and(|name| StateLaw::NAMES.contains(&name.as_str()))
}

/// A law with an internal state, read once.
#[pyclass(frozen, name = "StateLaw", module = "stickslip._core")]
pub struct Law(StateLaw);

#[pymethods]
impl Law {
    #[new]
    pub fn new(document: &str) -> PyResult<Self> {
        let law: StateLaw =
            serde_json::from_str(document).map_err(|error| PyValueError::new_err(error.to_string()))?;
        law.validate().map_err(|error| refused(&error))?;
        Ok(Self(law))
    }

    #[getter]
    fn has_state(&self) -> bool {
        self.0.has_state()
    }

    /// Friction force and rate of the state, for slip velocities and states.
    #[expect(
        clippy::needless_pass_by_value,
        reason = "that is how arrays cross the border"
    )]
    fn rates<'py>(
        &self,
        py: Python<'py>,
        w: PyReadonlyArray1<'py, f64>,
        z: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<(Array<'py, f64>, Array<'py, f64>)> {
        let pairs = w.as_slice()?.iter().zip(z.as_slice()?);
        let (force, rate): (Vec<f64>, Vec<f64>) = pairs.map(|(&w, &z)| self.0.rates(w, z)).unzip();
        Ok((force.into_pyarray(py), rate.into_pyarray(py)))
    }

    /// The states of steady slip.
    #[expect(
        clippy::needless_pass_by_value,
        reason = "that is how arrays cross the border"
    )]
    fn steady<'py>(&self, py: Python<'py>, w: PyReadonlyArray1<'py, f64>) -> PyResult<Array<'py, f64>> {
        let state: Vec<f64> = w.as_slice()?.iter().map(|&w| self.0.steady(w)).collect();
        Ok(state.into_pyarray(py))
    }

    /// Force and state along a motion, from a state.
    #[expect(
        clippy::needless_pass_by_value,
        reason = "that is how arrays cross the border"
    )]
    fn follow<'py>(
        &self,
        py: Python<'py>,
        t: PyReadonlyArray1<'py, f64>,
        w: PyReadonlyArray1<'py, f64>,
        z: f64,
    ) -> PyResult<(Array<'py, f64>, Array<'py, f64>)> {
        let (force, state) =
            state_law::follow(&self.0, t.as_slice()?, w.as_slice()?, z).map_err(|error| refused(&error))?;
        Ok((force.into_pyarray(py), state.into_pyarray(py)))
    }
}

/// An oscillator under such a law, read once.
#[pyclass(frozen, name = "StateOscillator", module = "stickslip._core")]
pub struct Oscillator(StateOscillator);

#[pymethods]
impl Oscillator {
    #[new]
    fn new(document: &str) -> PyResult<Self> {
        StateOscillator::from_json(document)
            .map(Self)
            .map_err(|error| refused(&error))
    }

    /// d/dt of x, w and the state.
    fn rates(&self, t: f64, x: f64, w: f64, z: f64) -> (f64, f64, f64) {
        let ([x, w, z], _) = self.0.rates(t, [x, w, z]);
        (x, w, z)
    }

    /// Acceleration and friction force at times.
    #[expect(
        clippy::needless_pass_by_value,
        reason = "that is how arrays cross the border"
    )]
    fn states<'py>(
        &self,
        py: Python<'py>,
        t: PyReadonlyArray1<'py, f64>,
        x: PyReadonlyArray1<'py, f64>,
        w: PyReadonlyArray1<'py, f64>,
        z: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<(Array<'py, f64>, Array<'py, f64>)> {
        let (t, x, w, z) = (t.as_slice()?, x.as_slice()?, w.as_slice()?, z.as_slice()?);
        let (a, force): (Vec<f64>, Vec<f64>) = (0..t.len())
            .map(|i| {
                let (rates, force) = self.0.rates(t[i], [x[i], w[i], z[i]]);
                (-rates[1], force)
            })
            .unzip();
        Ok((a.into_pyarray(py), force.into_pyarray(py)))
    }
}
