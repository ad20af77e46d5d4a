//! Systems of masses and their orbits across the border.

use numpy::{IntoPyArray, PyReadonlyArray1};
use pyo3::prelude::*;
use stickslip::engine::ReplaySteps;
use stickslip::network::{self, Run, sequence};
use stickslip::system::System;
use stickslip::variation::Layout;

use crate::rows::{self, Counts};
use crate::stability::{phases_of, state_from};
use crate::watch::watched;
use crate::{Array, refused, sweep, system};

/// A whole run of a system, kept in the core.
#[pyclass(frozen, module = "stickslip._core")]
pub(crate) struct Network(network::Orbit);

type Start = (Option<Vec<f64>>, Option<Vec<f64>>, f64, u64);

fn run_of((x0, v0, t_end, max_events): Start) -> Run {
    Run {
        x0,
        v0,
        t_end,
        max_events,
    }
}

#[pymethods]
impl Network {
    /// Simulate the system of a JSON document.
    #[staticmethod]
    fn simulate(py: Python<'_>, document: &str, run: Start, max_seconds: Option<f64>) -> PyResult<Self> {
        let system = System::from_json(document).map_err(|error| refused(&error))?;
        let run = run_of(run);
        watched(py, max_seconds, |go_on| {
            network::simulate_while(&system, run, go_on)
        })
        .map(Self)
    }

    /// Go on from a state of a trail in which the contacts do what `phases` say.
    #[staticmethod]
    #[expect(
        clippy::needless_pass_by_value,
        reason = "that is how arrays cross the border"
    )]
    fn resume(
        py: Python<'_>,
        system: &system::System,
        state: PyReadonlyArray1<'_, f64>,
        phases: PyReadonlyArray1<'_, f64>,
        duration: f64,
    ) -> PyResult<Self> {
        let (system, _) = system.masses()?;
        let layout = Layout::of(system);
        let state = state_from(layout, state.as_slice()?)?;
        let phases = phases_of(layout, phases.as_slice()?)?;
        watched(py, None, |go_on| {
            sequence::resume(system, &state, &phases, duration, 10_000_000, go_on)
        })
        .map(Self)
    }

    /// An orbit from its saved columns.
    #[staticmethod]
    #[expect(
        clippy::needless_pass_by_value,
        reason = "that is how arrays cross the border"
    )]
    fn restore(
        document: &str,
        run: Start,
        stop: usize,
        work: Counts,
        steps: PyReadonlyArray1<'_, f64>,
        events: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<Self> {
        let system = System::from_json(document).map_err(|error| refused(&error))?;
        let orbit = network::Orbit {
            run: run_of(run),
            steps: steps.as_slice().map_err(|_| rows::broken())?.to_vec(),
            events: rows::read(&events)?,
            stop: rows::stop_of(stop)?,
            work: rows::work_of(work),
            system,
        };
        if orbit.steps.is_empty() || !orbit.steps.len().is_multiple_of(orbit.width()) {
            return Err(rows::broken());
        }
        Ok(Self(orbit))
    }

    /// The steps, row after row: time (high, low), x and v of each mass, direction, offset, slope, branch of each contact.
    fn segments<'py>(&self, py: Python<'py>) -> Array<'py, f64> {
        self.0.steps.clone().into_pyarray(py)
    }

    /// The events, one row of 8 numbers each: t, kind, contact, x, v, force, stick_time, force_rate.
    fn events<'py>(&self, py: Python<'py>) -> Array<'py, f64> {
        rows::laid_out(py, &self.0.events)
    }

    /// Positions, velocities, accelerations mass by mass; slip velocities, friction forces, adhesion contact by contact.
    #[expect(
        clippy::needless_pass_by_value,
        reason = "that is how arrays cross the border"
    )]
    #[expect(clippy::type_complexity, reason = "six columns")]
    fn states<'py>(
        &self,
        py: Python<'py>,
        times: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<(
        Array<'py, f64>,
        Array<'py, f64>,
        Array<'py, f64>,
        Array<'py, f64>,
        Array<'py, f64>,
        Array<'py, bool>,
    )> {
        let times = times.as_slice()?;
        let states = py.detach(|| self.0.states(times));
        Ok((
            states.x.into_pyarray(py),
            states.v.into_pyarray(py),
            states.a.into_pyarray(py),
            states.w.into_pyarray(py),
            states.force.into_pyarray(py),
            states.stuck.into_pyarray(py),
        ))
    }

    /// What is steady in the orbit, as a table of one row.
    fn steady<'py>(
        &self,
        py: Python<'py>,
        look: &str,
        period: f64,
        surface: &str,
    ) -> PyResult<sweep::Table<'py>> {
        sweep::steady_of(py, &mut ReplaySteps::new(&self.0), look, period, surface)
    }

    /// The points of a section from a time on.
    fn section<'py>(
        &self,
        py: Python<'py>,
        surface: &str,
        contact: usize,
        after: f64,
        most: usize,
    ) -> PyResult<(Array<'py, f64>, usize)> {
        let span = (after, self.0.t_last());
        sweep::section_of(
            py,
            &mut ReplaySteps::new(&self.0),
            surface,
            contact,
            span,
            most,
            None,
        )
    }

    /// What was asked: x0, v0, t_end, max_events.
    #[getter]
    fn run(&self) -> Start {
        let run = &self.0.run;
        (run.x0.clone(), run.v0.clone(), run.t_end, run.max_events)
    }

    #[getter]
    fn t_last(&self) -> f64 {
        self.0.t_last()
    }

    #[getter]
    fn stop(&self) -> (usize, &'static str, &'static str) {
        rows::stop_row(self.0.stop)
    }

    #[getter]
    fn work(&self) -> Counts {
        rows::work_row(self.0.work)
    }
}
