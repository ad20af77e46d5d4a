//! Laws with an internal state at the border: the right-hand sides that an integrator in Python asks for.

use std::f64::consts::TAU;

use numpy::{IntoPyArray, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use stickslip::state_law::{self, StateFriction, StateLaw};
use stickslip::state_system::{Motion, StateSystem};
use stickslip::system::System;

use crate::watch::watched;
use crate::{Array, read, refused};

/// Numbers that should be so many.
fn so_many<'a>(numbers: &'a PyReadonlyArray1<'_, f64>, count: usize) -> PyResult<&'a [f64]> {
    let numbers = numbers.as_slice()?;
    if numbers.len() == count {
        Ok(numbers)
    } else {
        let message = format!("expected {count} numbers, got {}", numbers.len());
        Err(PyValueError::new_err(message))
    }
}

/// A law with an internal state, read once.
#[pyclass(frozen, name = "StateLaw", module = "stickslip._core")]
pub struct Law(StateLaw);

#[pymethods]
impl Law {
    #[new]
    pub fn new(document: &str) -> PyResult<Self> {
        let law: StateLaw = read(document)?;
        law.validate().map_err(refused)?;
        Ok(Self(law))
    }

    #[getter]
    fn has_state(&self) -> bool {
        self.0.has_state()
    }

    /// How many numbers a state is made of.
    #[getter]
    fn states(&self) -> usize {
        self.0.states()
    }

    /// Friction force and rate of the state, for slip velocities and states, these row after row.
    fn rates<'py>(
        &self,
        py: Python<'py>,
        w: PyReadonlyArray1<'py, f64>,
        z: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<(Array<'py, f64>, Array<'py, f64>)> {
        let (z, states) = (z.as_slice()?, self.0.states());
        let mut rate = vec![0.0; z.len()];
        let rows = z.chunks_exact(states).zip(rate.chunks_exact_mut(states));
        let each = w.as_slice()?.iter().zip(rows);
        let force: Vec<f64> = each.map(|(&w, (z, rates))| self.0.rates(w, z, rates)).collect();
        Ok((force.into_pyarray(py), rate.into_pyarray(py)))
    }

    /// The states of steady slip, row after row.
    fn steady<'py>(&self, py: Python<'py>, w: PyReadonlyArray1<'py, f64>) -> PyResult<Array<'py, f64>> {
        let (w, states) = (w.as_slice()?, self.0.states());
        let mut state = vec![0.0; w.len() * states];
        for (&w, z) in w.iter().zip(state.chunks_exact_mut(states)) {
            self.0.steady(w, z);
        }
        Ok(state.into_pyarray(py))
    }

    /// Force and states along a motion, from a state; the states row after row.
    fn follow<'py>(
        &self,
        py: Python<'py>,
        t: PyReadonlyArray1<'py, f64>,
        w: PyReadonlyArray1<'py, f64>,
        z: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<(Array<'py, f64>, Array<'py, f64>)> {
        let (t, w, z) = (t.as_slice()?, w.as_slice()?, z.as_slice()?);
        let (force, state) = watched(py, None, |go_on| state_law::follow(&self.0, t, w, z, go_on))?;
        Ok((force.into_pyarray(py), state.into_pyarray(py)))
    }
}

/// Masses under laws with an internal state, read once.
#[pyclass(frozen, name = "StateSystem", module = "stickslip._core")]
pub struct Masses(StateSystem);

#[pymethods]
impl Masses {
    #[new]
    fn new(document: &str) -> PyResult<Self> {
        System::from_json(document)
            .and_then(StateSystem::new)
            .map(Self)
            .map_err(refused)
    }

    /// Positions and velocity variables of a start, and the slip velocities there.
    fn start<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray1<'py, f64>,
        v: Option<Vec<f64>>,
    ) -> PyResult<(Array<'py, f64>, Array<'py, f64>)> {
        let masses = self.0.masses();
        if let Some(v) = &v
            && v.len() != masses
        {
            return Err(PyValueError::new_err(format!(
                "expected {masses} velocities, got {}",
                v.len()
            )));
        }
        let (y, w) = self.0.start(so_many(&x, masses)?, v);
        Ok((y.into_pyarray(py), w.into_pyarray(py)))
    }

    /// d/dt of the variables.
    fn rates<'py>(
        &self,
        py: Python<'py>,
        t: f64,
        y: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Array<'py, f64>> {
        Ok(self.0.rates(t, so_many(&y, self.0.width())?).into_pyarray(py))
    }

    /// The same at many times, row after row.
    fn slopes<'py>(
        &self,
        py: Python<'py>,
        t: PyReadonlyArray1<'py, f64>,
        y: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Array<'py, f64>> {
        let (t, width) = (t.as_slice()?, self.0.width());
        let rows = so_many(&y, t.len() * width)?.chunks_exact(width);
        let pairs = t.iter().zip(rows);
        let slopes: Vec<f64> = pairs.flat_map(|(&t, y)| self.0.rates(t, y)).collect();
        Ok(slopes.into_pyarray(py))
    }

    /// Whether nothing has a mass.
    #[getter]
    fn is_massless(&self) -> bool {
        self.0.is_massless()
    }

    /// The variables at t = 0 with velocities that balance the forces where there is no mass; else as they are.
    fn balanced<'py>(&self, py: Python<'py>, y: PyReadonlyArray1<'py, f64>) -> PyResult<Array<'py, f64>> {
        Ok(self
            .0
            .balanced(so_many(&y, self.0.width())?.to_vec())
            .into_pyarray(py))
    }

    /// 2π over the highest natural frequency, without mass over the rate of the fastest state.
    #[getter]
    fn natural_period(&self) -> f64 {
        TAU / self.0.natural_frequency()
    }

    /// Whether the motion is integrated in other variables.
    #[getter]
    fn is_steep(&self) -> bool {
        self.0.is_steep()
    }

    /// The variables of the integration, what counts as small in each, and which part of each does besides.
    fn regular<'py>(&self, py: Python<'py>, y: PyReadonlyArray1<'py, f64>) -> PyResult<[Array<'py, f64>; 3]> {
        let y = so_many(&y, self.0.width())?;
        let (scales, shares) = self.0.regular_scales(y);
        Ok([self.0.regular(y.to_vec()), scales, shares].map(|values| values.into_pyarray(py)))
    }

    /// d/dt of them.
    fn regular_rates<'py>(
        &self,
        py: Python<'py>,
        t: f64,
        regular: PyReadonlyArray1<'py, f64>,
        least: f64,
    ) -> PyResult<Array<'py, f64>> {
        Ok(self
            .0
            .regular_rates(t, so_many(&regular, self.0.width())?, least)
            .into_pyarray(py))
    }

    /// The variables from those of the integration, row after row.
    fn natural<'py>(
        &self,
        py: Python<'py>,
        regular: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Array<'py, f64>> {
        let rows = regular.as_slice()?.chunks_exact(self.0.width());
        let natural: Vec<f64> = rows.flat_map(|row| self.0.natural(row)).collect();
        Ok(natural.into_pyarray(py))
    }

    /// Velocities and accelerations mass by mass; slip velocities, forces, slip accelerations contact by contact; at times.
    fn states<'py>(
        &self,
        py: Python<'py>,
        t: PyReadonlyArray1<'py, f64>,
        y: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<[Array<'py, f64>; 5]> {
        let (t, width) = (t.as_slice()?, self.0.width());
        let rows = so_many(&y, t.len() * width)?.chunks_exact(width);
        let mut columns: [Vec<f64>; 5] = Default::default();
        for (&t, y) in t.iter().zip(rows) {
            let Motion {
                v,
                a,
                w,
                slip_acceleration,
                force,
                ..
            } = self.0.motion(t, y);
            for (column, values) in columns.iter_mut().zip([v, a, w, force, slip_acceleration]) {
                column.extend(values);
            }
        }
        Ok(columns.map(|column| column.into_pyarray(py)))
    }
}
