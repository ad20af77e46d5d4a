//! The border between the core and Python: conversions only. Documents cross it as JSON, numbers as arrays.

mod batch;
mod network;
mod stability;
mod state;
mod sweep;
mod watch;

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use stickslip::drive::Clock;
use stickslip::error::Error;
use stickslip::event::Work;
use stickslip::law::{self, Friction, Law};
use stickslip::mode::Kind;
use stickslip::orbit::{self, Segment};
use stickslip::regime::Regime;
use stickslip::simulate::{self, Run, Stop};
use stickslip::state_law::StateLaw;
use stickslip::structure::Oscillator;

use crate::watch::Watch;

fn refused(error: &Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}

fn law_from(document: &str) -> PyResult<Law> {
    serde_json::from_str(document).map_err(|error| PyValueError::new_err(error.to_string()))
}

type Array<'py, T> = Bound<'py, PyArray1<T>>;

/// A whole run, kept in the core.
#[pyclass(frozen, module = "stickslip._core")]
struct Orbit(orbit::Orbit);

#[pymethods]
impl Orbit {
    /// Simulate the oscillator of a JSON document.
    #[staticmethod]
    fn simulate(
        py: Python<'_>,
        document: &str,
        x0: f64,
        v0: Option<f64>,
        t_end: f64,
        max_events: u64,
        max_seconds: Option<f64>,
    ) -> PyResult<Self> {
        let oscillator = Oscillator::from_json(document).map_err(|error| refused(&error))?;
        let run = Run {
            x0,
            v0,
            t_end,
            max_events,
        };
        let mut watch = Watch::new(max_seconds);
        let orbit = py.detach(|| simulate::simulate_while(&oscillator, run, || watch.go_on()));
        watch.result()?;
        orbit.map(Self).map_err(|error| refused(&error))
    }

    /// An orbit from its saved columns.
    #[staticmethod]
    #[expect(
        clippy::needless_pass_by_value,
        reason = "that is how arrays cross the border"
    )]
    fn restore(
        document: &str,
        run: (f64, Option<f64>, f64, u64),
        stop: usize,
        work: (u64, u64, u64),
        segments: PyReadonlyArray1<'_, f64>,
        events: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<Self> {
        let broken = || PyValueError::new_err("the columns of the saved orbit do not fit together");
        let oscillator = Oscillator::from_json(document).map_err(|error| refused(&error))?;
        let (x0, v0, t_end, max_events) = run;
        let segments = segments.as_slice().map_err(|_| broken())?;
        let events = events.as_slice().map_err(|_| broken())?;
        if segments.is_empty() || segments.len() % 8 != 0 || events.len() % 7 != 0 {
            return Err(broken());
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "small whole numbers"
        )]
        let index = |value: f64| value as usize;
        Ok(Self(orbit::Orbit {
            oscillator,
            run: Run {
                x0,
                v0,
                t_end,
                max_events,
            },
            segments: segments
                .chunks_exact(8)
                .map(|row| Segment {
                    clock: Clock {
                        high: row[0],
                        low: row[1],
                    },
                    x: row[2],
                    v: row[3],
                    direction: row[4],
                    offset: row[5],
                    slope: row[6],
                    branch: u32::try_from(index(row[7])).unwrap_or(0),
                })
                .collect(),
            events: events
                .chunks_exact(7)
                .map(|row| {
                    Ok(orbit::Event {
                        t: row[0],
                        kind: *Kind::ALL.get(index(row[1])).ok_or_else(broken)?,
                        x: row[2],
                        v: row[3],
                        force: row[4],
                        stick_time: row[5],
                        force_rate: row[6],
                    })
                })
                .collect::<PyResult<_>>()?,
            stop: *Stop::ALL.get(stop).ok_or_else(broken)?,
            work: Work {
                events: work.0,
                evaluations: work.1,
                grazes: work.2,
            },
        }))
    }

    /// The segments, one row of 8 numbers each: time (high, low), x, v, direction, offset, slope, branch.
    fn segments<'py>(&self, py: Python<'py>) -> Array<'py, f64> {
        let rows = self.0.segments.iter().flat_map(|s| {
            [
                s.clock.high,
                s.clock.low,
                s.x,
                s.v,
                s.direction,
                s.offset,
                s.slope,
                f64::from(s.branch),
            ]
        });
        rows.collect::<Vec<_>>().into_pyarray(py)
    }

    /// The events, one row of 7 numbers each: t, kind, x, v, force, stick_time, force_rate.
    fn events<'py>(&self, py: Python<'py>) -> Array<'py, f64> {
        let rows = self.0.events.iter().flat_map(|e| {
            [
                e.t,
                f64::from(e.kind as u8),
                e.x,
                e.v,
                e.force,
                e.stick_time,
                e.force_rate,
            ]
        });
        rows.collect::<Vec<_>>().into_pyarray(py)
    }

    /// Position, velocity, acceleration, friction force and adhesion at times.
    #[expect(
        clippy::needless_pass_by_value,
        reason = "that is how arrays cross the border"
    )]
    #[expect(clippy::type_complexity, reason = "five columns")]
    fn states<'py>(
        &self,
        py: Python<'py>,
        times: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<(
        Array<'py, f64>,
        Array<'py, f64>,
        Array<'py, f64>,
        Array<'py, f64>,
        Array<'py, bool>,
    )> {
        let times = times.as_slice()?;
        let states = py.detach(|| self.0.states(times));
        let column =
            |pick: fn(&orbit::State) -> f64| states.iter().map(pick).collect::<Vec<_>>().into_pyarray(py);
        Ok((
            column(|state| state.x),
            column(|state| state.v),
            column(|state| state.a),
            column(|state| state.force),
            states
                .iter()
                .map(|state| state.stuck)
                .collect::<Vec<_>>()
                .into_pyarray(py),
        ))
    }

    /// What was asked: x0, v0, t_end, max_events.
    #[getter]
    fn run(&self) -> (f64, Option<f64>, f64, u64) {
        let run = self.0.run;
        (run.x0, run.v0, run.t_end, run.max_events)
    }

    #[getter]
    fn t_last(&self) -> f64 {
        self.0.t_last()
    }

    #[getter]
    fn stop(&self) -> (usize, &'static str, &'static str) {
        (self.0.stop as usize, self.0.stop.name(), self.0.stop.sentence())
    }

    #[getter]
    fn work(&self) -> (u64, u64, u64) {
        let work = self.0.work;
        (work.events, work.evaluations, work.grazes)
    }
}

/// Whether a forcing of an oscillator meets a resonance at which the closed form would lose digits.
#[pyfunction]
fn resonates(document: &str) -> PyResult<bool> {
    let oscillator = Oscillator::from_json(document).map_err(|error| refused(&error))?;
    Ok(oscillator.resonates())
}

/// Check the JSON document of an oscillator.
#[pyfunction]
fn check_oscillator(document: &str) -> PyResult<()> {
    if state::has_state(document) {
        return Oscillator::<StateLaw>::from_json(document)
            .map(drop)
            .map_err(|error| refused(&error));
    }
    Oscillator::<Law>::from_json(document)
        .map(drop)
        .map_err(|error| refused(&error))
}

/// Check the JSON document of a law.
#[pyfunction]
fn check_law(document: &str) -> PyResult<()> {
    if state::has_state(document) {
        return state::Law::new(document).map(drop);
    }
    law_from(document)?.validate().map_err(|error| refused(&error))
}

/// The break-away force of a law for stick times and force rates.
#[pyfunction]
#[expect(
    clippy::needless_pass_by_value,
    reason = "that is how arrays cross the border"
)]
fn break_away<'py>(
    py: Python<'py>,
    document: &str,
    stick_time: PyReadonlyArray1<'py, f64>,
    force_rate: PyReadonlyArray1<'py, f64>,
) -> PyResult<Array<'py, f64>> {
    let law = law_from(document)?;
    law.validate().map_err(|error| refused(&error))?;
    let pairs = stick_time.as_slice()?.iter().zip(force_rate.as_slice()?);
    let force = pairs.map(|(&stick_time, &force_rate)| {
        law.break_away(law::Hold {
            stick_time,
            force_rate: force_rate.abs(),
        })
    });
    Ok(force.collect::<Vec<_>>().into_pyarray(py))
}

/// The friction a law predicts along a measured motion.
#[pyfunction]
#[expect(
    clippy::needless_pass_by_value,
    reason = "that is how arrays cross the border"
)]
fn force_along<'py>(
    py: Python<'py>,
    document: &str,
    t: PyReadonlyArray1<'py, f64>,
    w: PyReadonlyArray1<'py, f64>,
    stuck: PyReadonlyArray1<'py, bool>,
    force_rate: PyReadonlyArray1<'py, f64>,
) -> PyResult<Array<'py, f64>> {
    let law = law_from(document)?;
    stickslip::replay::force_along(
        &law,
        t.as_slice()?,
        w.as_slice()?,
        stuck.as_slice()?,
        force_rate.as_slice()?,
    )
    .map(|force| force.into_pyarray(py))
    .map_err(|error| refused(&error))
}

/// The kind of a steady motion, by its name.
#[pyfunction]
fn regime(stuck_share: f64, sticks: bool, w_min: f64, w_max: f64) -> &'static str {
    Regime::of(stuck_share, sticks, [w_min, w_max]).name()
}

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("KINDS", Kind::ALL.map(Kind::name))?;
    module.add("BRANCHES", law::BRANCHES)?;
    module.add("REGIMES", Regime::ALL.map(Regime::name))?;
    module.add("SWEEP_COLUMNS", sweep::COLUMNS)?;
    module.add("ONWARD", sweep::ONWARD)?;
    module.add("STOPS", Stop::ALL.map(Stop::name))?;
    module.add_class::<Orbit>()?;
    module.add_function(wrap_pyfunction!(batch::batch, module)?)?;
    module.add_function(wrap_pyfunction!(regime, module)?)?;
    module.add_function(wrap_pyfunction!(sweep::chaos, module)?)?;
    module.add_function(wrap_pyfunction!(sweep::section, module)?)?;
    module.add_function(wrap_pyfunction!(sweep::sweep, module)?)?;
    module.add_class::<network::Network>()?;
    module.add_function(wrap_pyfunction!(network::check_system, module)?)?;
    module.add("ENDINGS", stability::ENDING_NAMES)?;
    module.add("BORDERS", stability::BORDER_NAMES)?;
    module.add_function(wrap_pyfunction!(stability::trail, module)?)?;
    module.add_function(wrap_pyfunction!(stability::trail_from, module)?)?;
    module.add_function(wrap_pyfunction!(stability::follow, module)?)?;
    module.add_class::<state::Law>()?;
    module.add_class::<state::Masses>()?;
    module.add_function(wrap_pyfunction!(check_oscillator, module)?)?;
    module.add_function(wrap_pyfunction!(resonates, module)?)?;
    module.add_function(wrap_pyfunction!(check_law, module)?)?;
    module.add_function(wrap_pyfunction!(break_away, module)?)?;
    module.add_function(wrap_pyfunction!(force_along, module)?)
}
