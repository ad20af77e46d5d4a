//! The boundary between the core and Python: conversions, and loops over pixels and samples that need no core. Documents cross it as
//! JSON, numbers as arrays.
#![warn(clippy::disallowed_methods)]
#![expect(
    clippy::needless_pass_by_value,
    reason = "that is how arrays cross the border"
)]

mod batch;
mod displacement_error;
mod law;
mod orbit;
mod rows;
mod samples;
mod section;
mod slip_evidence;
mod spots;
mod stability;
mod state;
mod sweep;
mod system;
mod table;
mod watch;

use numpy::PyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde::de::DeserializeOwned;
use stickslip::law::{BRANCHES, Law};
use stickslip::mode::Kind;
use stickslip::regime::Regime;
use stickslip::simulate::Stop;
use stickslip::state_law::StateLaw;

fn refused(error: impl ToString) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// What a JSON document says.
fn read<T: DeserializeOwned>(document: &str) -> PyResult<T> {
    serde_json::from_str(document).map_err(refused)
}

type Array<'py, T> = Bound<'py, PyArray1<T>>;

/// What is known of every law, as one JSON document.
#[pyfunction]
fn law_facts() -> PyResult<String> {
    serde_json::to_string(&[Law::facts(), StateLaw::facts()].concat()).map_err(refused)
}

/// What the stop of a run says of its regime by itself, if anything.
#[pyfunction]
fn regime_of_stop(stop: &str, enough: bool) -> PyResult<Option<&'static str>> {
    let unknown = || PyValueError::new_err(format!("expected the name of a stop, got {stop:?}"));
    let stop = Stop::ALL
        .into_iter()
        .find(|one| one.name() == stop)
        .ok_or_else(unknown)?;
    Ok(Regime::of_stop(stop, enough).map(Regime::name))
}

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("KINDS", Kind::ALL.map(Kind::name))?;
    module.add("BRANCHES", BRANCHES)?;
    module.add("REGIMES", Regime::ALL.map(Regime::name))?;
    module.add("RESTART", sweep::RESTART)?;
    module.add("STOPS", Stop::ALL.map(Stop::name))?;
    module.add_class::<orbit::Orbit>()?;
    module.add_class::<watch::Halt>()?;
    module.add_class::<samples::Samples>()?;
    module.add_function(wrap_pyfunction!(watch::halted, module)?)?;
    module.add_function(wrap_pyfunction!(batch::batch, module)?)?;
    module.add_function(wrap_pyfunction!(regime_of_stop, module)?)?;
    module.add_function(wrap_pyfunction!(section::section, module)?)?;
    module.add_function(wrap_pyfunction!(sweep::sweep, module)?)?;
    module.add_class::<system::System>()?;
    module.add("ENDINGS", stability::ENDING_NAMES)?;
    module.add("BOUNDARIES", stability::BOUNDARY_NAMES)?;
    module.add_function(wrap_pyfunction!(stability::event_sequence, module)?)?;
    module.add_function(wrap_pyfunction!(stability::event_sequence_from, module)?)?;
    module.add_function(wrap_pyfunction!(stability::follow, module)?)?;
    module.add_function(wrap_pyfunction!(stability::lyapunov, module)?)?;
    module.add_class::<law::Law>()?;
    module.add_class::<state::Law>()?;
    module.add_class::<state::Masses>()?;
    module.add_function(wrap_pyfunction!(law::static_friction, module)?)?;
    module.add("ALIKE", spots::ALIKE_DIAMETERS)?;
    module.add("LEAST_ERROR", spots::LEAST_ERROR)?;
    module.add_function(wrap_pyfunction!(spots::blurred, module)?)?;
    module.add_function(wrap_pyfunction!(spots::spot_centre, module)?)?;
    module.add_function(wrap_pyfunction!(spots::spot_near, module)?)?;
    module.add_function(wrap_pyfunction!(slip_evidence::slip_evidence, module)?)?;
    module.add_function(wrap_pyfunction!(spots::spot_levels, module)?)?;
    module.add_function(wrap_pyfunction!(displacement_error::displacement_errors, module)?)?;
    module.add_function(wrap_pyfunction!(displacement_error::without, module)?)?;
    module.add_function(wrap_pyfunction!(law_facts, module)?)
}
