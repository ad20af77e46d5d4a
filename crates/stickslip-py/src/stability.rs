//! Event sequences and their derivatives at the boundary. Per contact a state has 10 numbers after time, positions and
//! velocities, and at its end three flags (branch, reverses, released); phases are four columns: modes of every contact, ending,
//! contact, duration.
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "small whole numbers"
)]

use numpy::{IntoPyArray, PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use stickslip::event_sequence::{self as of_oscillator, EventSequence};
use stickslip::law::End;
use stickslip::lyapunov::spectrum;
use stickslip::network::{self, sequence as of_system};
use stickslip::simulate::Run;
use stickslip::variation::{self, ContactMode, Ending, Flags, Keep, Layout, Phase, State, Varied};

use crate::system::System;
use crate::watch::watched;
use crate::{Array, refused};

/// Endings by their number.
const ENDINGS: [Ending; 7] = [
    Ending::Release,
    Ending::Line(End::Low),
    Ending::Line(End::High),
    Ending::Line(End::Reversal { rising: false }),
    Ending::Line(End::Reversal { rising: true }),
    Ending::Section,
    Ending::Time,
];

/// Their names.
pub(crate) const ENDING_NAMES: [&str; 7] = ["release", "low", "high", "falling", "rising", "section", "time"];
/// Names of the test functions by their number.
pub(crate) const BOUNDARY_NAMES: [&str; 6] = ["low", "high", "entry", "crossing", "stick", "arrival"];

/// Numbers of the flags of a contact.
const FLAGS: usize = 3;

fn broken(what: &str, count: usize) -> PyErr {
    PyValueError::new_err(format!("{what} does not fit the system: it has {count} numbers"))
}

fn whole(value: f64) -> usize {
    value as usize
}

/// What contacts do by its number: 0 sticks, ± 1 slips in that direction, ± 2 holds its slip velocity of that sign.
fn contact_modes_from(modes: &[i8]) -> Vec<ContactMode> {
    let state = |&mode: &i8| match mode {
        0 => ContactMode::Stick,
        -1 | 1 => ContactMode::Slip(f64::from(mode)),
        _ => ContactMode::Hold(f64::from(mode.signum())),
    };
    modes.iter().map(state).collect()
}

fn number_of(contact_mode: &ContactMode) -> i8 {
    let sign = |direction: f64| if direction > 0.0 { 1 } else { -1 };
    match *contact_mode {
        ContactMode::Stick => 0,
        ContactMode::Slip(direction) => sign(direction),
        ContactMode::Hold(direction) => 2 * sign(direction),
    }
}

pub(crate) fn state_from(layout: Layout, row: &[f64]) -> PyResult<State> {
    let width = layout.width();
    if row.len() != width + FLAGS * layout.contacts {
        return Err(broken("a state", row.len()));
    }
    let flags = row[width..].chunks_exact(FLAGS).map(|flags| Flags {
        branch: u32::try_from(whole(flags[0])).unwrap_or_default(),
        reverses: flags[1] != 0.0,
        released: flags[2] != 0.0,
    });
    Ok(State {
        numbers: row[..width].to_vec(),
        flags: flags.collect(),
    })
}

pub(crate) fn contact_modes_of(layout: Layout, row: &[i8]) -> PyResult<Vec<ContactMode>> {
    if row.len() != layout.contacts {
        return Err(broken("a row of contact_modes", row.len()));
    }
    Ok(contact_modes_from(row))
}

fn row_of(state: &State) -> impl Iterator<Item = f64> {
    let flags = state.flags.iter().flat_map(|flags| {
        [
            f64::from(flags.branch),
            f64::from(u8::from(flags.reverses)),
            f64::from(u8::from(flags.released)),
        ]
    });
    state.numbers.iter().copied().chain(flags)
}

/// Modes of every contact phase by phase, endings, contacts, durations.
type Phases<'py> = (Array<'py, i8>, Array<'py, u8>, Array<'py, u32>, Array<'py, f64>);
/// Positions and velocities at t = 0.
type Origin = (Option<Vec<f64>>, Option<Vec<f64>>);
/// States, derivatives, durations, test functions.
type Followed<'py> = (
    Array<'py, f64>,
    Array<'py, f64>,
    Array<'py, f64>,
    (Array<'py, u8>, Array<'py, u32>, Array<'py, u32>, Array<'py, f64>),
);
/// Start, phases, kinds of their events, why it ended.
type EventSequenceColumns<'py> = (Array<'py, f64>, Phases<'py>, Vec<&'static str>, &'static str);

fn columns<'py>(py: Python<'py>, event_sequence: &EventSequence) -> EventSequenceColumns<'py> {
    let phases = event_sequence.phases.iter();
    let modes = phases
        .clone()
        .flat_map(|phase| phase.contact_modes.iter().map(number_of));
    let ending = |phase: &Phase| ENDINGS.iter().position(|ending| *ending == phase.ending);
    (
        PyArray1::from_iter(py, row_of(&event_sequence.start)),
        (
            PyArray1::from_iter(py, modes),
            PyArray1::from_iter(
                py,
                phases
                    .clone()
                    .map(|phase| ending(phase).unwrap_or_default() as u8),
            ),
            PyArray1::from_iter(py, phases.clone().map(|phase| phase.contact as u32)),
            PyArray1::from_iter(py, phases.map(|phase| phase.duration)),
        ),
        event_sequence.kinds.iter().map(|kind| kind.name()).collect(),
        event_sequence.stop.name(),
    )
}

/// The event sequence of a run from x and v at t = 0.
#[pyfunction]
pub(crate) fn event_sequence<'py>(
    py: Python<'py>,
    system: &System,
    x0: Option<Vec<f64>>,
    v0: Option<Vec<f64>>,
    t_end: f64,
    max_events: u64,
) -> PyResult<EventSequenceColumns<'py>> {
    let (masses, oscillator) = system.masses()?;
    let run = network::Run {
        x0,
        v0,
        t_end,
        max_events,
    };
    let event_sequence = watched(py, None, |go_on| match oscillator {
        Some(oscillator) => of_oscillator::run(oscillator, Run::of_one(&run), go_on),
        None => of_system::run(masses, run, go_on),
    })?;
    Ok(columns(py, &event_sequence))
}

/// The event sequence from a state in a contact mode.
#[pyfunction]
pub(crate) fn event_sequence_from<'py>(
    py: Python<'py>,
    system: &System,
    state: PyReadonlyArray1<'py, f64>,
    contact_modes: PyReadonlyArray1<'py, i8>,
    duration: f64,
    max_events: u64,
) -> PyResult<EventSequenceColumns<'py>> {
    let (masses, oscillator) = system.masses()?;
    let layout = Layout::of(masses);
    let state = state_from(layout, state.as_slice()?)?;
    let contact_modes = contact_modes_of(layout, contact_modes.as_slice()?)?;
    let event_sequence = watched(py, None, |go_on| match oscillator {
        Some(oscillator) => {
            of_oscillator::from(oscillator, &state, contact_modes[0], duration, max_events, go_on)
        }
        None => of_system::from(masses, &state, &contact_modes, duration, max_events, go_on),
    })?;
    Ok(columns(py, &event_sequence))
}

/// Follow an event sequence. Returns the states after the phases, their derivatives (numbers × (numbers + parameters, one at
/// least) each), the durations, and the test functions: boundaries, contacts, phases; tau, detail, value and derivatives of each.
/// `keep` says of which phases the derivatives are: "all", "last", "nothing".
/// `origin` is x and v of a run that begins there, so that what its contacts do at the start moves with the numbers at `paths`.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one argument a thing")]
pub(crate) fn follow<'py>(
    py: Python<'py>,
    system: &System,
    paths: Vec<String>,
    state: PyReadonlyArray1<'py, f64>,
    phases: Phases<'py>,
    last: PyReadonlyArray1<'py, i8>,
    keep: &str,
    tests: bool,
    origin: Option<Origin>,
) -> PyResult<Followed<'py>> {
    let keep = match keep {
        "last" => Keep::Last,
        "nothing" => Keep::Nothing,
        _ => Keep::All,
    };
    let (masses, _) = system.masses()?;
    let mut varied = Varied::new(masses, system.document(), &paths).map_err(refused)?;
    let layout = Layout::of(masses);
    let start = state_from(layout, state.as_slice()?)?;
    let (modes, endings) = (phases.0.readonly(), phases.1.readonly());
    let (contacts, durations) = (phases.2.readonly(), phases.3.readonly());
    let columns = endings.as_slice()?.iter().zip(contacts.as_slice()?);
    let rows = modes.as_slice()?.chunks_exact(layout.contacts);
    let phases = columns
        .zip(rows.zip(durations.as_slice()?))
        .map(|((&ending, &contact), (modes, &duration))| {
            let (ending, contact) = (usize::from(ending), contact as usize);
            match ENDINGS.get(ending) {
                Some(&ending) if contact < layout.contacts => Ok(Phase {
                    contact_modes: contact_modes_from(modes),
                    contact,
                    ending,
                    duration,
                }),
                _ => Err(broken("a phase", layout.contacts)),
            }
        })
        .collect::<PyResult<Vec<_>>>()?;
    let last = contact_modes_of(layout, last.as_slice()?)?;
    if let Some((x0, v0)) = origin.filter(|_| !paths.is_empty()) {
        let run = network::Run {
            x0,
            v0,
            t_end: 0.0,
            max_events: 0,
        };
        let first = phases.first().map_or(&last, |phase| &phase.contact_modes);
        varied = varied.begun(first, |system| of_system::start(system, &run));
    }
    let followed = watched(py, None, |go_on| {
        variation::follow(&varied, &start, &phases, &last, keep, tests, go_on)
    })?;
    let states = followed.states.iter().flat_map(row_of).collect::<Vec<_>>();
    let directions = varied.directions();
    let tests = followed.tests.iter();
    let numbers = tests.clone().flat_map(|test| {
        let head = [test.tau, test.detail, test.value.value];
        head.into_iter()
            .chain(test.value.rates[..directions].iter().copied())
    });
    Ok((
        states.into_pyarray(py),
        followed.rates.into_pyarray(py),
        followed.durations.into_pyarray(py),
        (
            PyArray1::from_iter(py, tests.clone().map(|test| test.boundary as u8)),
            PyArray1::from_iter(py, tests.clone().map(|test| test.contact as u32)),
            PyArray1::from_iter(py, tests.map(|test| test.phase as u32)),
            PyArray1::from_iter(py, numbers),
        ),
    ))
}

/// How directions grow along a run: when each phase ends, from the end of the transient; ln of the growth of every direction up
/// to there, direction after direction; events; and whether a shift in time, whose exponent is 0, is none of them.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one argument a thing")]
pub(crate) fn lyapunov<'py>(
    py: Python<'py>,
    system: &System,
    x0: Option<Vec<f64>>,
    v0: Option<Vec<f64>>,
    t_end: f64,
    max_events: u64,
    transient: f64,
    seed: u64,
) -> PyResult<(Array<'py, f64>, Array<'py, f64>, u64, bool)> {
    let model = system.model()?;
    let run = network::Run {
        x0,
        v0,
        t_end,
        max_events,
    };
    let found = watched(py, None, |go_on| {
        spectrum(&model, run, transient, usize::MAX, seed, go_on)
    })?;
    let growths = found.growths.concat();
    Ok((
        found.times.into_pyarray(py),
        growths.into_pyarray(py),
        found.events,
        found.shift,
    ))
}
