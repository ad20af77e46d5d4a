//! Motions that were integrated elsewhere, for the observers of the core.

use numpy::PyReadonlyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use stickslip::engine::{self, Reached};

use crate::section::{Points, section_of};
use crate::sweep::steady_of;

/// A motion of one contact's mass by its columns t, x, v, a, w, slip acceleration, and whether it is as good as stuck.
#[pyclass(frozen, module = "stickslip._core")]
pub(crate) struct Samples {
    columns: [Vec<f64>; 6],
    stuck: Vec<bool>,
    events: u64,
}

#[pymethods]
impl Samples {
    #[new]
    fn new(
        columns: [PyReadonlyArray1<'_, f64>; 6],
        stuck: PyReadonlyArray1<'_, bool>,
        events: u64,
    ) -> PyResult<Self> {
        let stuck = stuck.as_array().to_vec();
        let columns = columns.map(|column| column.as_array().to_vec());
        if columns.iter().any(|column| column.len() != stuck.len()) {
            return Err(PyValueError::new_err("expected six columns of one length"));
        }
        Ok(Self {
            columns,
            stuck,
            events,
        })
    }

    /// What is steady in it, as a table of one row.
    fn steady<'py>(
        &self,
        py: Python<'py>,
        look: &str,
        period: f64,
        surface: &str,
    ) -> PyResult<Bound<'py, PyDict>> {
        steady_of(py, (&mut self.engine(), 1), look, period, surface)
    }

    /// The points of a section from a time on.
    fn section<'py>(
        &self,
        py: Python<'py>,
        surface: &str,
        contact: usize,
        after: f64,
        most: usize,
    ) -> PyResult<Points<'py>> {
        let end = self.columns[0].last().copied().unwrap_or(0.0);
        section_of(py, &mut self.engine(), surface, contact, (after, end), most, None)
    }
}

impl Samples {
    fn engine(&self) -> engine::Samples<'_> {
        let [t, x, v, a, w, slip_acceleration] = &self.columns;
        engine::Samples {
            t,
            x,
            v,
            a,
            w,
            slip_acceleration,
            stuck: &self.stuck,
            events: self.events,
            end: Reached::default(),
        }
    }
}
