//! The border between the core and Python: conversions only. Documents cross it as JSON, numbers as arrays.
#![warn(clippy::disallowed_methods)]

mod batch;
mod orbit;
mod rows;
mod stability;
mod state;
mod sweep;
mod system;
mod watch;

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde_json::Value;
use stickslip::error::Error;
use stickslip::law::{self, Friction, Law};
use stickslip::mode::Kind;
use stickslip::regime::Regime;
use stickslip::simulate::Stop;
use stickslip::state_law::StateLaw;

fn refused(error: &Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}

fn law_from(document: &str) -> PyResult<Law> {
    serde_json::from_str(document).map_err(|error| PyValueError::new_err(error.to_string()))
}

type Array<'py, T> = Bound<'py, PyArray1<T>>;

/// What is known of every law, as one JSON document.
#[pyfunction]
fn law_facts() -> PyResult<String> {
    serde_json::to_string(&[Law::facts(), StateLaw::facts()].concat())
        .map_err(|error| PyValueError::new_err(error.to_string()))
}

/// Check the JSON document of a law.
#[pyfunction]
fn check_law(document: &str) -> PyResult<()> {
    let table: Value = serde_json::from_str(document).unwrap_or_default();
    if system::has_state(&table) {
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
    module.add_class::<orbit::Orbit>()?;
    module.add_class::<watch::Halt>()?;
    module.add_class::<sweep::Samples>()?;
    module.add_function(wrap_pyfunction!(watch::halted, module)?)?;
    module.add_function(wrap_pyfunction!(batch::batch, module)?)?;
    module.add_function(wrap_pyfunction!(regime, module)?)?;
    module.add_function(wrap_pyfunction!(sweep::chaos, module)?)?;
    module.add_function(wrap_pyfunction!(sweep::section, module)?)?;
    module.add_function(wrap_pyfunction!(sweep::sweep, module)?)?;
    module.add_class::<system::System>()?;
    module.add("ENDINGS", stability::ENDING_NAMES)?;
    module.add("BORDERS", stability::BORDER_NAMES)?;
    module.add_function(wrap_pyfunction!(stability::trail, module)?)?;
    module.add_function(wrap_pyfunction!(stability::trail_from, module)?)?;
    module.add_function(wrap_pyfunction!(stability::follow, module)?)?;
    module.add_class::<state::Law>()?;
    module.add_class::<state::Masses>()?;
    module.add_function(wrap_pyfunction!(law_facts, module)?)?;
    module.add_function(wrap_pyfunction!(check_law, module)?)?;
    module.add_function(wrap_pyfunction!(break_away, module)?)?;
    module.add_function(wrap_pyfunction!(force_along, module)?)
}
