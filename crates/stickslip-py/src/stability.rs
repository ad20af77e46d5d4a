//! Trails and their derivatives at the boundary. Per contact a state has 10 numbers after time, positions and velocities, and
//! at its end three flags (branch, turns, released); a phase is (direction, hold) of every contact, ending and contact as one
//! number, duration.

use numpy::{IntoPyArray, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use stickslip::event_sequence::{self as of_oscillator, EventSequence};
use stickslip::law::End;
use stickslip::network::{self, sequence as of_system};
use stickslip::simulate::Run;
use stickslip::variation::{self, ContactState, Ending, Flags, Layout, Phase, State, Varied};

use crate::system::System;
use crate::watch::watched;
use crate::{Array, refused};

/// Endings by their number; that of contact c is c times their count more.
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
/// Names of the test functions by their number; that of contact c is c times their count more.
pub(crate) const BOUNDARY_NAMES: [&str; 6] = ["low", "high", "entry", "crossing", "stick", "arrival"];

/// Numbers of the flags of a contact.
const FLAGS: usize = 3;

fn broken(what: &str, count: usize) -> PyErr {
    PyValueError::new_err(format!("{what} does not fit the system: it has {count} numbers"))
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a small whole number"
)]
fn whole(value: f64) -> usize {
    value as usize
}

fn contact_states_from(row: &[f64]) -> Vec<ContactState> {
    row.chunks_exact(2)
        .map(|pair| match pair {
            [0.0, _] => ContactState::Stick,
            [direction, 0.0] => ContactState::Slip(*direction),
            _ => ContactState::Hold(pair[0]),
        })
        .collect()
}

fn plain(contact_state: &ContactState) -> [f64; 2] {
    match *contact_state {
        ContactState::Stick => [0.0, 0.0],
        ContactState::Slip(direction) => [direction, 0.0],
        ContactState::Hold(direction) => [direction, 1.0],
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

pub(crate) fn contact_states_of(layout: Layout, row: &[f64]) -> PyResult<Vec<ContactState>> {
    if row.len() != 2 * layout.contacts {
        return Err(broken("a row of contact_states", row.len()));
    }
    Ok(contact_states_from(row))
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

/// Start, phases, kinds of their events, why it ended.
type EventSequenceRows<'py> = (Array<'py, f64>, Array<'py, f64>, Vec<&'static str>, &'static str);

fn columns<'py>(py: Python<'py>, event_sequence: &EventSequence) -> EventSequenceRows<'py> {
    let phases = event_sequence.phases.iter().flat_map(|phase| {
        let ending = ENDINGS
            .iter()
            .position(|ending| *ending == phase.ending)
            .unwrap_or_default();
        let tail = [(ending + ENDINGS.len() * phase.contact) as f64, phase.duration];
        phase.contact_states.iter().flat_map(plain).chain(tail)
    });
    (
        row_of(&event_sequence.start).collect::<Vec<_>>().into_pyarray(py),
        phases.collect::<Vec<_>>().into_pyarray(py),
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
) -> PyResult<EventSequenceRows<'py>> {
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

/// The event sequence from a state in a contact state.
#[pyfunction]
#[expect(
    clippy::needless_pass_by_value,
    reason = "that is how arrays cross the boundary"
)]
pub(crate) fn event_sequence_from<'py>(
    py: Python<'py>,
    system: &System,
    state: PyReadonlyArray1<'py, f64>,
    contact_states: PyReadonlyArray1<'py, f64>,
    duration: f64,
    max_events: u64,
) -> PyResult<EventSequenceRows<'py>> {
    let (masses, oscillator) = system.masses()?;
    let layout = Layout::of(masses);
    let state = state_from(layout, state.as_slice()?)?;
    let contact_states = contact_states_of(layout, contact_states.as_slice()?)?;
    let event_sequence = watched(py, None, |go_on| match oscillator {
        Some(oscillator) => {
            of_oscillator::from(oscillator, &state, contact_states[0], duration, max_events, go_on)
        }
        None => of_system::from(masses, &state, &contact_states, duration, max_events, go_on),
    })?;
    Ok(columns(py, &event_sequence))
}

/// Follow an event sequence. Returns the states after the phases, their derivatives (numbers × (numbers + parameters, one at least) each), the durations, and
/// the test functions (boundary and contact, phase, tau, detail, value, derivatives each).
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one argument a thing")]
#[expect(
    clippy::needless_pass_by_value,
    reason = "that is how arrays cross the boundary"
)]
#[expect(clippy::type_complexity, reason = "four columns")]
pub(crate) fn follow<'py>(
    py: Python<'py>,
    system: &System,
    paths: Vec<String>,
    state: PyReadonlyArray1<'py, f64>,
    phases: PyReadonlyArray1<'py, f64>,
    last: PyReadonlyArray1<'py, f64>,
    reseed: bool,
    tests: bool,
) -> PyResult<(Array<'py, f64>, Array<'py, f64>, Array<'py, f64>, Array<'py, f64>)> {
    let (masses, _) = system.masses()?;
    let varied = Varied::new(masses, system.document(), &paths).map_err(refused)?;
    let layout = Layout::of(masses);
    let start = state_from(layout, state.as_slice()?)?;
    let contacts = layout.contacts;
    let phases = phases
        .as_slice()?
        .chunks_exact(2 * contacts + 2)
        .map(|row| {
            let code = whole(row[2 * contacts]);
            Phase {
                contact_states: contact_states_from(&row[..2 * contacts]),
                contact: code / ENDINGS.len(),
                ending: ENDINGS[code % ENDINGS.len()],
                duration: row[2 * contacts + 1],
            }
        })
        .collect::<Vec<_>>();
    let last = contact_states_of(layout, last.as_slice()?)?;
    if phases.iter().any(|phase| phase.contact >= contacts) {
        return Err(broken("a row of phases", 2 * contacts + 2));
    }
    let followed = watched(py, None, |go_on| {
        variation::follow(&varied, &start, &phases, &last, reseed, tests, go_on)
    })?;
    let states = followed.states.iter().flat_map(row_of).collect::<Vec<_>>();
    let lanes = varied.lanes();
    let tests = followed.tests.iter().flat_map(|test| {
        let head = [
            (test.boundary as usize + BOUNDARY_NAMES.len() * test.contact) as f64,
            test.phase as f64,
            test.tau,
            test.detail,
            test.value.value,
        ];
        head.into_iter().chain(test.value.rates[..lanes].iter().copied())
    });
    Ok((
        states.into_pyarray(py),
        followed.rates.into_pyarray(py),
        followed.durations.into_pyarray(py),
        tests.collect::<Vec<_>>().into_pyarray(py),
    ))
}
