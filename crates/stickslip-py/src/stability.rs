//! Trails and their derivatives at the border. A state is 16 numbers (13 of the core, branch, turns, released), an arc is
//! (direction, hold, ending, duration).

use numpy::{IntoPyArray, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use stickslip::law::End;
use stickslip::simulate::Run;
use stickslip::structure::Oscillator;
use stickslip::trail::{self as sequence, Trail};
use stickslip::variation::{self, Arc, Ending, LANES, Phase, State, Varied, WIDTH};

use crate::{Array, refused};

/// Numbers of a state at the border.
const STATE: usize = WIDTH + 3;

/// Endings by their number.
const ENDINGS: [Ending; 7] = [
    Ending::Release,
    Ending::Line(End::Low),
    Ending::Line(End::High),
    Ending::Line(End::Turn { rising: false }),
    Ending::Line(End::Turn { rising: true }),
    Ending::Section,
    Ending::Time,
];

/// Their names.
pub(crate) const ENDING_NAMES: [&str; 7] = ["release", "low", "high", "falling", "rising", "section", "time"];

fn phase_of(direction: f64, hold: f64) -> Phase {
    if direction == 0.0 {
        Phase::Stick
    } else if hold == 0.0 {
        Phase::Slip(direction)
    } else {
        Phase::Hold(direction)
    }
}

fn plain(phase: Phase) -> [f64; 2] {
    match phase {
        Phase::Stick => [0.0, 0.0],
        Phase::Slip(direction) => [direction, 0.0],
        Phase::Hold(direction) => [direction, 1.0],
    }
}

fn state_from(row: &[f64]) -> PyResult<State<LANES>> {
    let broken = || PyValueError::new_err(format!("a state has {STATE} numbers, got {}", row.len()));
    let values: &[f64; WIDTH] = row
        .get(..WIDTH)
        .and_then(|row| row.try_into().ok())
        .ok_or_else(broken)?;
    let &[branch, turns, released] = row.get(WIDTH..).unwrap_or_default() else {
        return Err(broken());
    };
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a small whole number"
    )]
    let branch = branch as u32;
    Ok(variation::state_of(values, branch, turns != 0.0, released != 0.0))
}

fn row_of(state: &State<LANES>) -> impl Iterator<Item = f64> {
    let flags = [
        f64::from(state.branch),
        f64::from(u8::from(state.turns)),
        f64::from(u8::from(state.released)),
    ];
    state.numbers.map(|number| number.value).into_iter().chain(flags)
}

/// Start, arcs, kinds of their events, why it ended.
type Trailed<'py> = (Array<'py, f64>, Array<'py, f64>, Vec<&'static str>, &'static str);

fn columns<'py>(py: Python<'py>, trail: &Trail) -> Trailed<'py> {
    let arcs = trail.arcs.iter().flat_map(|arc| {
        let [direction, hold] = plain(arc.phase);
        let ending = ENDINGS
            .iter()
            .position(|ending| *ending == arc.ending)
            .unwrap_or_default();
        [direction, hold, ending as f64, arc.duration]
    });
    (
        row_of(&trail.start).collect::<Vec<_>>().into_pyarray(py),
        arcs.collect::<Vec<_>>().into_pyarray(py),
        trail.kinds.iter().map(|kind| kind.name()).collect(),
        trail.stop.name(),
    )
}

/// The trail of a run from x and v at t = 0.
#[pyfunction]
pub(crate) fn trail<'py>(
    py: Python<'py>,
    document: &str,
    x0: f64,
    v0: Option<f64>,
    t_end: f64,
    max_events: u64,
) -> PyResult<Trailed<'py>> {
    let oscillator = Oscillator::from_json(document).map_err(|error| refused(&error))?;
    let run = Run {
        x0,
        v0,
        t_end,
        max_events,
    };
    let trail = py
        .detach(|| sequence::run(&oscillator, run))
        .map_err(|error| refused(&error))?;
    Ok(columns(py, &trail))
}

/// The trail from a state in a phase.
#[pyfunction]
#[expect(
    clippy::needless_pass_by_value,
    reason = "that is how arrays cross the border"
)]
pub(crate) fn trail_from<'py>(
    py: Python<'py>,
    document: &str,
    state: PyReadonlyArray1<'py, f64>,
    phase: (f64, f64),
    duration: f64,
    max_events: u64,
) -> PyResult<Trailed<'py>> {
    let oscillator = Oscillator::from_json(document).map_err(|error| refused(&error))?;
    let state = state_from(state.as_slice()?)?;
    let phase = phase_of(phase.0, phase.1);
    let trail = py
        .detach(|| sequence::from(&oscillator, &state, phase, duration, max_events))
        .map_err(|error| refused(&error))?;
    Ok(columns(py, &trail))
}

/// Follow a trail. Returns the states after the arcs (16 numbers each), their derivatives (13 × 14 each), the durations, and
/// the test functions (border, arc, tau, detail, value, 14 derivatives each).
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one argument a thing")]
#[expect(
    clippy::needless_pass_by_value,
    reason = "that is how arrays cross the border"
)]
#[expect(clippy::type_complexity, reason = "four columns")]
pub(crate) fn follow<'py>(
    py: Python<'py>,
    document: &str,
    path: Option<&str>,
    state: PyReadonlyArray1<'py, f64>,
    arcs: PyReadonlyArray1<'py, f64>,
    last: (f64, f64),
    reseed: bool,
    tests: bool,
) -> PyResult<(Array<'py, f64>, Array<'py, f64>, Array<'py, f64>, Array<'py, f64>)> {
    let varied = Varied::new(document, path).map_err(|error| refused(&error))?;
    let start = state_from(state.as_slice()?)?;
    let arcs = arcs
        .as_slice()?
        .chunks_exact(4)
        .map(|row| {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a small whole number"
            )]
            let ending = ENDINGS.get(row[2] as usize);
            Ok(Arc {
                phase: phase_of(row[0], row[1]),
                ending: *ending.ok_or_else(|| PyValueError::new_err("no such ending of an arc"))?,
                duration: row[3],
            })
        })
        .collect::<PyResult<Vec<_>>>()?;
    let last = phase_of(last.0, last.1);
    let followed = py
        .detach(|| variation::follow(&varied, &start, &arcs, last, reseed, tests))
        .map_err(|error| refused(&error))?;
    let states = followed.states.iter().flat_map(row_of).collect::<Vec<_>>();
    let rates = followed
        .states
        .iter()
        .flat_map(|state| state.numbers.into_iter().flat_map(|number| number.rates));
    let rates = rates.collect::<Vec<_>>();
    let tests = followed.tests.iter().flat_map(|test| {
        let head = [
            test.border as usize as f64,
            test.arc as f64,
            test.tau,
            test.detail,
            test.value.value,
        ];
        head.into_iter().chain(test.value.rates)
    });
    Ok((
        states.into_pyarray(py),
        rates.into_pyarray(py),
        followed.durations.into_pyarray(py),
        tests.collect::<Vec<_>>().into_pyarray(py),
    ))
}
