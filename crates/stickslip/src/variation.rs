//! The derivative of a motion through its events: fundamental matrices of the segments and jumps at the events at once.
//!
//! An *event sequence* is a motion with the order of its events held fixed: phase after phase, each ended by the event that ended it in the
//! motion it was taken from. The state carries everything that what follows depends on, the time, the lines of friction and
//! the memory of the contacts included, and every number in it is a [`Dual`]: the derivative with respect to the start and to
//! every parameter comes along. At an event the time moves with the state by −h′/ḣ, which is the saltation matrix
//! S = D_xR + (F⁺ − D_xR F⁻ − D_tR) nᵀ/(nᵀF⁻ + h_t) in the augmented state (Aizerman & Gantmakher 1958; Müller, Chaos
//! Solitons Fractals 5 (1995) 1671), sensitivities of memory included.
//!
//! Segments are differentiated in closed form where that is at hand, for one mass under friction of linear pieces. Elsewhere
//! they are by the variational equation, whose Taylor series go along with those of the motion. A law is asked with numbers
//! that carry derivatives ([`Jet`](crate::jet::Jet)), so its own algebra (break-away force, next line) is exact. Only masses,
//! springs, dampers, drives and forces are differenced, to the fourth order, and in closed form all but that is exact.
//!
//! Held to its sequence, a motion goes on smoothly where the real one would change it. What vanishes there are the *boundaries*,
//! the test functions of the sliding bifurcations, and they carry their derivatives too.

mod boundary;
mod closed;
mod saltation;
mod segment;
mod state;
mod varied;

pub use boundary::{Boundary, Test};
pub use state::{CONTACT, ContactMode, Ending, Flags, Layout, Phase, State};
pub(crate) use state::{STICK_TIME, contact_of};
pub use varied::Varied;

use saltation::PhaseEnd;
use segment::{Expansion, VariedMotion};
use state::Moving;

use crate::dual::Dual;
use crate::error::{Error, wrong};
use crate::simulate::MOST_BYTES;
use crate::system::System;

/// An event sequence followed: states at the ends of the phases, durations, test functions.
#[derive(Clone, Debug, Default)]
pub struct Followed {
    /// The state after each phase.
    pub states: Vec<State>,
    /// The derivatives of its numbers that are kept, phase after phase, row after row: by those of the start, and by the
    /// parameters (zero where there is none).
    pub rates: Vec<f64>,
    /// How long each phase took.
    pub durations: Vec<f64>,
    /// The test functions.
    pub tests: Vec<Test>,
}

/// Which derivatives of an event sequence are found and kept: one of a hundred masses takes 11 MB a phase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// Those after each phase, by the start of the sequence.
    All,
    /// Those of each phase alone, by its own start; the start does not move with the parameters.
    Phases,
    /// Those after the last phase, by the start of the sequence.
    Last,
    /// None, and no test functions.
    Nothing,
}

/// So near its end, over the rate of the motion, the derivatives of a motion are those at its end.
const NEAR_PHASE_END: f64 = 1e-13;

/// Derivatives beyond this size are not taken through a phase, but multiplied with its own.
const MOST_TAKEN_THROUGH: f64 = 1e100;

fn lost(index: usize, why: &str) -> Error {
    Error::Document {
        reason: format!("the motion held to its event sequence {why} on phase {index}"),
    }
}

/// Follow an event sequence from `start`; `last` is what the contacts do after it.
/// It ends early once `go_on` says no, asked before every phase.
///
/// # Errors
/// The phase whose end is not found near where it was.
pub fn follow(
    varied: &Varied,
    start: &State,
    phases: &[Phase],
    last: &[ContactMode],
    keep: Keep,
    tests: bool,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Followed, Error> {
    let motion = VariedMotion::new(varied);
    let (width, directions) = (motion.layout.width(), varied.directions());
    let reseed = keep == Keep::Phases;
    let kept = match keep {
        Keep::All | Keep::Phases => phases.len(),
        Keep::Last => 1,
        Keep::Nothing => 0,
    };
    if kept.saturating_mul(width * directions * size_of::<f64>()) > MOST_BYTES.saturating_mul(4) {
        return wrong(format!(
            "the derivatives of {} events of this system take more than 4 GiB: follow fewer at a time",
            phases.len()
        ));
    }
    let mut followed = Followed {
        rates: Vec::with_capacity(kept * width * directions),
        ..Followed::default()
    };
    let (mut carried, mut seeded, mut after) = (false, Moving::default(), Moving::default());
    // The derivatives so far, row after row; what a phase adds is found by its own start.
    let unit = identity(width, directions);
    let mut begun = unit.clone();
    if !varied.start.is_empty() {
        let parameters = directions - width;
        for (row, rates) in begun
            .chunks_exact_mut(directions)
            .zip(varied.start.chunks_exact(parameters))
        {
            row[width..].copy_from_slice(rates);
        }
    }
    let mut rows = vec![0.0; width * directions];
    let mut expansion = motion.expansion();
    for (index, phase) in phases.iter().enumerate() {
        if !go_on() {
            break;
        }
        let next = phases.get(index + 1).map_or(last, |phase| &phase.contact_modes);
        let rates = match index {
            _ if reseed => &unit,
            0 => &begun,
            _ => &rows,
        };
        // A series costs the more, the more directions move along; a closed form does not, and takes all derivatives so far
        // through the phase, while their products are numbers.
        let through = motion.is_closed()
            && (rates[..motion.layout.contact(0) * directions].iter())
                .all(|rate| rate.abs() < MOST_TAKEN_THROUGH);
        let state = followed.states.last().unwrap_or(start);
        if keep == Keep::Nothing {
            seeded = state.without_derivatives(1);
        } else if carried && through && !reseed {
            std::mem::swap(&mut seeded, &mut after);
        } else if through {
            seeded = state.moving(motion.all_directions(), rates, directions);
        } else {
            seeded = state.seeded(motion.all_directions());
        }
        let mut tau = phase.duration;
        motion.go(&seeded, &phase.contact_modes, tau, &mut expansion);
        let mut guard = motion.guard(&seeded, phase, tau, &expansion);
        let mut rest = VariedMotion::newton_step(&guard);
        // A motion so near its end moves there by its rates.
        if rest.is_nan() || rest.abs() > NEAR_PHASE_END / expansion.pace(&motion.frame) {
            tau = end_of(&motion, &state.without_derivatives(1), phase, &mut expansion)
                .ok_or_else(|| lost(index, "does not end"))?;
            motion.go(&seeded, &phase.contact_modes, tau, &mut expansion);
            guard = motion.guard(&seeded, phase, tau, &expansion);
            rest = 0.0;
        }
        let event_shift = VariedMotion::event_time_derivative(guard);
        let end = PhaseEnd {
            index,
            phase,
            start: &seeded,
            tau: tau + rest,
            expansion: &expansion,
            rest,
            next,
        };
        motion.state_after_event(&end, &event_shift, &mut after);
        let strays = |number: &Dual| !number.rates.iter().all(|rate| rate.is_finite());
        let moved = &after.numbers[..motion.layout.contact(0)];
        if moved
            .iter()
            .any(|number| !number.value.is_finite() || strays(number))
        {
            return Err(lost(index, "leaves the numbers"));
        }
        if keep == Keep::Nothing {
            followed.durations.push(tau);
            followed.states.push(after.values());
            continue;
        }
        if tests && cfg!(feature = "continuation") {
            let first = followed.tests.len();
            motion.boundaries(&end, &mut followed.tests);
            motion.entry(&end, &event_shift, &mut followed.tests);
            for test in followed.tests[first..].iter_mut().filter(|_| !through) {
                let mut row = vec![0.0; directions];
                chain(&test.value, rates, width, &mut row);
                test.value.rates[..directions].copy_from_slice(&row);
            }
        }
        if through {
            for (number, row) in after.numbers.iter().zip(rows.chunks_exact_mut(directions)) {
                row.copy_from_slice(&number.rates[..directions]);
            }
        } else {
            let mut chained = vec![0.0; width * directions];
            for (number, row) in after.numbers.iter().zip(chained.chunks_exact_mut(directions)) {
                chain(number, rates, width, row);
            }
            rows = chained;
        }
        if keep != Keep::Last || index + 1 == phases.len() {
            followed.rates.extend_from_slice(&rows);
        }
        followed.durations.push(tau);
        followed.states.push(after.values());
        carried = through;
    }
    Ok(followed)
}

/// Every number of a state moves with itself.
fn identity(width: usize, directions: usize) -> Vec<f64> {
    let mut rows = vec![0.0; width * directions];
    for axis in 0..width {
        rows[axis * directions + axis] = 1.0;
    }
    rows
}

/// The derivatives of a number by the start of the event sequence, from those by the start of
/// the phase and the derivatives of that by the start of the event sequence.
fn chain(number: &Dual, rates: &[f64], width: usize, row: &mut [f64]) {
    let directions = row.len();
    row[width..].copy_from_slice(&number.rates[width..directions]);
    for (slope, from) in number.rates.iter().zip(rates.chunks_exact(row.len())) {
        if *slope != 0.0 {
            for (rate, from) in row.iter_mut().zip(from) {
                *rate += slope * from;
            }
        }
    }
}

/// Whether drives of constant velocity carry all masses along lines, so that nothing swings.
fn carried(system: &System, contact_modes: &[ContactMode]) -> bool {
    system.forcing.is_empty()
        && system.contacts.len() == system.masses()
        && (contact_modes.iter()).all(|&mode| mode == ContactMode::Stick)
        && (system.contacts.iter())
            .all(|contact| contact.normal_force.is_none() && contact.drive_velocity.harmonics.is_empty())
}

/// When the phase ends, near where it did: Newton. The start needs the derivative by time alone.
fn end_of(motion: &VariedMotion, start: &Moving, phase: &Phase, expansion: &mut Expansion) -> Option<f64> {
    let mut tau = phase.duration;
    if phase.ending == Ending::Time {
        return Some(tau);
    }
    motion.go(start, &phase.contact_modes, tau, expansion);
    let carried = carried(&motion.varied.base, &phase.contact_modes);
    let mut best = f64::INFINITY;
    for round in 0..60 {
        let rate = expansion.pace(&motion.frame);
        // A guard that turns nowhere has no end beyond the next.
        let longest = if carried {
            0.5 * tau.abs().max(1.0 / rate)
        } else {
            0.3 / rate
        };
        let guard = motion.guard(start, phase, tau, expansion);
        let step = VariedMotion::newton_step(&guard);
        if !step.is_finite() {
            return (guard.value == 0.0).then_some(tau);
        }
        // What Newton leaves after so small a step is its square. Beside a tangency another would run away from an end that was
        // known from the start.
        if round == 0 && step.abs() < 1e-9 / rate {
            return Some(tau + step);
        }
        // Rounding ends the descent.
        if step == 0.0 || (round > 3 && step.abs() >= 0.5 * best && step.abs() < 1e-9 / rate) {
            return Some(tau);
        }
        best = best.min(step.abs());
        let step = step.clamp(-longest, longest);
        tau += step;
        motion.shift(start, &phase.contact_modes, tau, expansion);
        if step.abs() <= 1e-16 * tau.abs() {
            return Some(tau);
        }
    }
    None
}
