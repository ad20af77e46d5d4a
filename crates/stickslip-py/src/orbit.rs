//! Whole runs, kept in the core: one class, whichever engine made them.

use numpy::{IntoPyArray, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use stickslip::engine::{Replay, ReplaySteps};
use stickslip::model::Orbit as Kept;
use stickslip::network::{self, Run, sequence};
use stickslip::orbit;
use stickslip::simulate::{self, Stop};
use stickslip::variation::Layout;

use crate::Array;
use crate::rows::{self, Counts};
use crate::section::{Points, section_of};
use crate::stability::{contact_modes_of, state_from};
use crate::sweep::steady_of;
use crate::system::System;
use crate::watch::watched;

/// A whole run, in closed form or of Taylor steps.
#[pyclass(frozen, module = "stickslip._core")]
pub(crate) struct Orbit(Kept);

/// What was asked of a run: x0, v0, t_end, max_events.
pub(crate) type Asked = (Option<Vec<f64>>, Option<Vec<f64>>, f64, u64);
type Columns<'py> = (
    Array<'py, f64>,
    Array<'py, f64>,
    Array<'py, f64>,
    Array<'py, f64>,
    Array<'py, f64>,
    Array<'py, bool>,
);

fn run_of((x0, v0, t_end, max_events): Asked) -> Run {
    Run {
        x0,
        v0,
        t_end,
        max_events,
    }
}

#[pymethods]
impl Orbit {
    /// Simulate from positions and velocities, mass by mass: t_end, most events.
    #[staticmethod]
    fn simulate(py: Python<'_>, system: &System, run: Asked, max_seconds: Option<f64>) -> PyResult<Self> {
        let model = system.model()?;
        let run = run_of(run);
        watched(py, max_seconds, |go_on| model.simulate(run, go_on)).map(Self)
    }

    /// Go on from a state of an event sequence in which the contacts do what `contact_modes` say, by Taylor steps.
    #[staticmethod]
    fn resume(
        py: Python<'_>,
        system: &System,
        state: PyReadonlyArray1<'_, f64>,
        contact_modes: PyReadonlyArray1<'_, i8>,
        duration: f64,
    ) -> PyResult<Self> {
        let (system, _) = system.masses()?;
        let layout = Layout::of(system);
        let state = state_from(layout, state.as_slice()?)?;
        let contact_modes = contact_modes_of(layout, contact_modes.as_slice()?)?;
        let orbit = watched(py, None, |go_on| {
            sequence::resume(system, &state, &contact_modes, duration, 10_000_000, go_on)
        });
        orbit.map(|orbit| Self(Kept::Steps(orbit)))
    }

    /// An orbit from its saved columns.
    #[staticmethod]
    fn restore(
        system: &System,
        run: Asked,
        stop: usize,
        work: Counts,
        segments: PyReadonlyArray1<'_, f64>,
        events: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<Self> {
        let (stop, work, run) = (
            rows::named(&Stop::ALL, stop, "stop")?,
            rows::work_of(work),
            run_of(run),
        );
        let events = rows::read(&events)?;
        let kept = match system.model()? {
            stickslip::model::Model::Closed(oscillator) => Kept::Closed(orbit::Orbit {
                oscillator,
                run: simulate::Run::of_one(&run),
                segments: rows::read(&segments)?,
                events,
                stop,
                work,
                end: None,
            }),
            stickslip::model::Model::Steps(system) => Kept::Steps(network::Orbit {
                system,
                run,
                steps: segments.as_slice().map_err(|_| rows::broken())?.to_vec(),
                events,
                stop,
                work,
            }),
        };
        let whole = match &kept {
            Kept::Closed(orbit) => !orbit.segments.is_empty(),
            Kept::Steps(orbit) => !orbit.steps.is_empty() && orbit.steps.len().is_multiple_of(orbit.width()),
        };
        if whole {
            Ok(Self(kept))
        } else {
            Err(rows::broken())
        }
    }

    /// The segments or steps, row after row: time (high, low), x and v of each mass, direction, offset, slope, branch of each
    /// contact.
    fn segments<'py>(&self, py: Python<'py>) -> Array<'py, f64> {
        match &self.0 {
            Kept::Closed(orbit) => rows::laid_out(py, &orbit.segments),
            Kept::Steps(orbit) => orbit.steps.clone().into_pyarray(py),
        }
    }

    /// The events, one row of 8 numbers each: t, kind, contact, x, v, force, stick_time, force_rate.
    fn events<'py>(&self, py: Python<'py>) -> Array<'py, f64> {
        rows::laid_out(py, self.0.events())
    }

    /// Positions, velocities, accelerations mass by mass; slip velocities, friction forces, adhesion contact by contact.
    fn states<'py>(&self, py: Python<'py>, times: PyReadonlyArray1<'py, f64>) -> PyResult<Columns<'py>> {
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
    ) -> PyResult<Bound<'py, PyDict>> {
        match &self.0 {
            Kept::Closed(orbit) => steady_of(py, (&mut Replay::new(orbit), 1), look, period, surface),
            Kept::Steps(orbit) => steady_of(
                py,
                (&mut ReplaySteps::new(orbit), orbit.system.contacts.len()),
                look,
                period,
                surface,
            ),
        }
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
        let span = (after, self.0.t_last());
        match &self.0 {
            Kept::Closed(orbit) => {
                section_of(py, &mut Replay::new(orbit), surface, contact, span, most, None)
            }
            Kept::Steps(orbit) => section_of(
                py,
                &mut ReplaySteps::new(orbit),
                surface,
                contact,
                span,
                most,
                None,
            ),
        }
    }

    /// What was asked: x0, v0, t_end, max_events.
    #[getter]
    fn run(&self) -> Asked {
        let run = self.0.run();
        (run.x0, run.v0, run.t_end, run.max_events)
    }

    #[getter]
    fn t_last(&self) -> f64 {
        self.0.t_last()
    }

    #[getter]
    fn stop(&self) -> (usize, &'static str, &'static str) {
        rows::stop_row(self.0.stop())
    }

    #[getter]
    fn work(&self) -> Counts {
        rows::work_row(self.0.work())
    }
}
