//! The largest Lyapunov exponent: how fast motions that start close together part, through events, memory included.
//!
//! λ = lim (1/t) Σ ln |v′|/|v| of a direction v that each phase of the event sequence carries to v′ by its derivative.
//! Source: Müller, Chaos Solitons Fractals 5 (1995) 1671.

use crate::elementary::ln;
use crate::error::{Error, wrong};
use crate::event_sequence::{self as of_oscillator, EventSequence};
use crate::model::Model;
use crate::network::{self, sequence as of_system};
use crate::simulate::{Run, Stop};
use crate::system::System;
use crate::variation::{ContactMode, Ending, Keep, Layout, Phase, State, Varied, follow};

/// Natural periods of a part of the motion: each is run from the end of the one before, so that a chaotic motion and its
/// derivative do not part.
const PERIODS_A_PART: f64 = 20.0;
/// Averages over so many shares of the run give the error.
const AVERAGED_SHARES: usize = 20;

/// A direction of which a phase leaves less is lost.
const LOST_DIRECTION: f64 = 1e-12;

/// The largest exponent and its standard error, in 1/time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lyapunov {
    /// λ: −∞ where sticks forget everything; beside the 0 of a shift in time of a motion without forcing.
    pub exponent: f64,
    /// From the averages over 20 parts of the run.
    pub error: f64,
}

/// The largest exponent of a run, whose first `transient` (a share in [0, 1)) is left out.
///
/// # Errors
/// What makes no sense in the run, systems whose motion has no derivative, and runs that end early.
pub fn largest(
    model: &Model,
    run: network::Run,
    transient: f64,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Lyapunov, Error> {
    let system = match model {
        Model::Closed(oscillator) => System::from(oscillator),
        Model::Steps(system) => system.clone(),
    };
    let varied = Varied::new(&system, &serde_json::Value::Null, &[])?;
    let (end, most, part) = (run.t_end, run.max_events, PERIODS_A_PART * model.natural_period());
    // A clock that nothing reads is no direction.
    let first = usize::from(model.forcing_frequency().is_none());
    let (width, directions) = (Layout::of(&system).width(), varied.directions());
    let moving = 1 + 2 * system.masses();
    let mut direction: Vec<f64> = (0..width)
        .map(|i| if (first..moving).contains(&i) { 1.0 } else { 0.0 })
        .collect();
    let mut shares = [[0.0; 2]; AVERAGED_SHARES];
    let (mut now, mut length) = (0.0, part);
    let mut sequence = match model {
        Model::Closed(one) => {
            let of_one = Run::of_one(&network::Run {
                t_end: part.min(end),
                ..run
            });
            of_oscillator::run(one, of_one, &mut *go_on)?
        }
        Model::Steps(system) => {
            let of_some = network::Run {
                t_end: part.min(end),
                ..run
            };
            of_system::run(system, of_some, &mut *go_on)?
        }
    };
    let from =
        |state: &State, contacts: &[ContactMode], length: f64, go_on: &mut dyn FnMut() -> bool| match model {
            Model::Closed(one) => of_oscillator::from(one, state, contacts[0], length, most, go_on),
            Model::Steps(system) => of_system::from(system, state, contacts, length, most, go_on),
        };
    loop {
        let EventSequence {
            start,
            phases,
            kinds,
            stop,
        } = &mut sequence;
        if !matches!(stop, Stop::End | Stop::MaxEvents) {
            return wrong(format!("the run ended early: {}", stop.sentence()));
        }
        let over = now + phases.iter().map(|phase| phase.duration).sum::<f64>() >= end * (1.0 - 1e-12);
        let sticks = |phase: &Phase| phase.contact_modes.iter().all(|&one| one == ContactMode::Stick);
        if !over && kinds.is_empty() && sticks(&phases[0]) {
            // Stuck beyond this part: a stick must be followed from its begin.
            length *= 2.0;
            sequence = from(start, &phases[0].contact_modes, length.min(end - now), go_on)?;
            continue;
        }
        length = part;
        // What follows the last event of a run of the most events is not known; elsewhere a part ends with an event.
        let count = match (over || kinds.is_empty(), *stop) {
            (true, _) => phases.len(),
            (_, Stop::MaxEvents) => kinds.len() - 1,
            _ => kinds.len(),
        };
        let last = phases[count.min(phases.len() - 1)].contact_modes.clone();
        phases.truncate(count);
        short(phases, model.natural_period());
        let followed = follow(&varied, start, phases, &last, Keep::Phases, false, go_on)?;
        for (rates, &duration) in followed
            .rates
            .chunks_exact(width * directions)
            .zip(&followed.durations)
        {
            let moved: Vec<f64> = rates
                .chunks_exact(directions)
                .enumerate()
                .map(|(i, row)| {
                    let along = row[first..width].iter().zip(&direction[first..]);
                    if i < first {
                        0.0
                    } else {
                        along.map(|(a, b)| a * b).sum()
                    }
                })
                .collect();
            let size = |of: &[f64]| of.iter().map(|one| one * one).sum::<f64>().sqrt();
            let growth = size(&moved) / size(&direction);
            // What rounding leaves of a direction that a stick forgets is nothing.
            if growth < LOST_DIRECTION {
                return Ok(Lyapunov {
                    exponent: f64::NEG_INFINITY,
                    error: f64::NAN,
                });
            }
            let scale = 1.0 / size(&moved);
            direction = moved.iter().map(|one| one * scale).collect();
            now += duration;
            let counted = (now / end - transient) / (1.0 - transient);
            if counted > 0.0 {
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "a small number above 0"
                )]
                let share =
                    &mut shares[((counted * AVERAGED_SHARES as f64) as usize).min(AVERAGED_SHARES - 1)];
                share[0] += ln(growth);
                share[1] += duration;
            }
        }
        let Some(state) = followed.states.last().filter(|_| !over) else {
            break;
        };
        sequence = from(state, &last, part.min(end - now), go_on)?;
    }
    Ok(average(&shares))
}

/// The last phase, where it ends by time, in parts so short that no derivative underflows.
fn short(phases: &mut Vec<Phase>, natural: f64) {
    let Some(mut last) = phases.pop_if(|phase| phase.ending == Ending::Time) else {
        return;
    };
    let pieces = (last.duration / natural).ceil().max(1.0);
    last.duration /= pieces;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a small number above 0"
    )]
    phases.extend(std::iter::repeat_n(last, pieces as usize));
}

fn average(shares: &[[f64; 2]]) -> Lyapunov {
    let sum = |which: usize| shares.iter().map(|share| share[which]).sum::<f64>();
    let exponent = sum(0) / sum(1);
    let rates = shares.iter().map(|[growth, time]| growth / time);
    let square = rates
        .map(|rate| (rate - exponent) * (rate - exponent))
        .sum::<f64>();
    let count = AVERAGED_SHARES as f64;
    Lyapunov {
        exponent,
        error: (square / (count * (count - 1.0))).sqrt(),
    }
}
