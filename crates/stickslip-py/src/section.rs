//! Sections: the points where a motion passes a surface.

use numpy::PyArray2;
use pyo3::prelude::*;
use stickslip::engine::Engine;
use stickslip::model::Start;
use stickslip::section::section as points_of;
use stickslip::surface::Point;

use crate::orbit::Asked;
use crate::system::System;
use crate::watch::watched;
use crate::{read, refused, table};

/// Points row by row: t, x, v, w, force, stick_time, force_rate; and why the run ended.
pub(crate) type Points<'py> = (Bound<'py, PyArray2<f64>>, &'static str);

/// The last points of a section of a contact's mass.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one argument a setting")]
pub(crate) fn section<'py>(
    py: Python<'py>,
    system: &System,
    surface: &str,
    run: Asked,
    contact: usize,
    after: f64,
    most: usize,
    max_seconds: Option<f64>,
) -> PyResult<Points<'py>> {
    let model = system.model()?;
    let (x, v, t_end, max_events) = run;
    let start = Start {
        x: x.unwrap_or_default(),
        v: v.unwrap_or_default(),
        restart: None,
    };
    let mut engine = model.run(&start, max_events).map_err(refused)?;
    let span = (after, t_end);
    section_of(py, &mut engine, surface, contact, span, most, max_seconds)
}

/// The same of any engine.
pub(crate) fn section_of<'py>(
    py: Python<'py>,
    engine: &mut (impl Engine + Send),
    surface: &str,
    contact: usize,
    span: (f64, f64),
    most: usize,
    max_seconds: Option<f64>,
) -> PyResult<Points<'py>> {
    let surface = read(surface)?;
    let (points, stop) = watched(py, max_seconds, |go_on| {
        points_of(engine, contact, &surface, span, most, go_on)
    })?;
    let rows = points.iter().map(|row| {
        let Point { t, x, v, w } = row.point;
        [t, x, v, w, row.force, row.stick_time, row.force_rate]
    });
    Ok((table::rows(py, 7, rows)?, stop.name()))
}
