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

/// What shrinks to less in a phase is not well known, and below the other it is what rounding leaves, and lost.
const SMALL: f64 = 1e-8;
const LOST: f64 = 1e-12;
/// In so many parts a phase is cut in which that happens, and those again, down to so many in a natural period: damping takes
/// its time, a stick forgets at once.
const CUTS: usize = 4;
const MOST_PARTS: f64 = 1000.0;

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
    let mut direction = Direction {
        along: (0..width)
            .map(|i| if (first..moving).contains(&i) { 1.0 } else { 0.0 })
            .collect(),
        first,
        directions,
        shortest: model.natural_period() / MOST_PARTS,
    };
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
        for (index, phase) in phases.iter().enumerate() {
            let rates = &followed.rates[index * width * directions..][..width * directions];
            let duration = followed.durations[index];
            let begin = index
                .checked_sub(1)
                .map_or(&*start, |before| &followed.states[before]);
            let next = phases.get(index + 1).map_or(&last, |phase| &phase.contact_modes);
            let growth = direction.through(&varied, begin, phase, next, rates, go_on)?;
            // What rounding leaves of a direction that a stick forgets is nothing.
            if growth == f64::NEG_INFINITY {
                return Ok(Lyapunov {
                    exponent: growth,
                    error: f64::NAN,
                });
            }
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
                share[0] += growth;
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

/// A direction that a motion carries along.
struct Direction {
    along: Vec<f64>,
    /// The first number of a state that is one of it.
    first: usize,
    directions: usize,
    /// A phase of no more is not cut.
    shortest: f64,
}

impl Direction {
    /// Carry it through a phase by its derivatives; ln of its growth, −∞ where it is lost.
    fn through(
        &mut self,
        varied: &Varied,
        start: &State,
        phase: &Phase,
        next: &[ContactMode],
        rates: &[f64],
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<f64, Error> {
        let mut moved = vec![0.0; self.along.len()];
        let rows = rates.chunks_exact(self.directions);
        for (number, row) in moved.iter_mut().zip(rows).skip(self.first) {
            *number = (row.iter().zip(&self.along)).map(|(a, b)| a * b).sum();
        }
        let size = |of: &[f64]| of.iter().map(|one| one * one).sum::<f64>().sqrt();
        let (before, after) = (size(&self.along), size(&moved));
        if after < SMALL * before && phase.duration > self.shortest {
            let part = Phase {
                duration: phase.duration / CUTS as f64,
                ending: Ending::Time,
                ..phase.clone()
            };
            let mut parts = vec![part; CUTS];
            parts[CUTS - 1].ending = phase.ending;
            let followed = follow(varied, start, &parts, next, Keep::Phases, false, go_on)?;
            let mut growth = 0.0;
            for (index, rates) in followed.rates.chunks_exact(rates.len()).enumerate() {
                let begin = index
                    .checked_sub(1)
                    .map_or(start, |before| &followed.states[before]);
                let next = parts.get(index + 1).map_or(next, |part| &part.contact_modes);
                growth += self.through(varied, begin, &parts[index], next, rates, go_on)?;
                if growth == f64::NEG_INFINITY {
                    break;
                }
            }
            return Ok(growth);
        }
        if after < LOST * before {
            return Ok(f64::NEG_INFINITY);
        }
        self.along = moved.iter().map(|one| one / after).collect();
        Ok(ln(after / before))
    }
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

#[cfg(test)]
mod tests {
    use super::largest;
    use crate::harmonic::Harmonic;
    use crate::law::{Coulomb, StaticKinetic};
    use crate::model::Model;
    use crate::network::Run;
    use crate::oscillator::Oscillator;

    fn exponent(oscillator: Oscillator, t_end: f64) -> f64 {
        let run = Run::driven(t_end);
        let found = largest(&Model::Closed(oscillator), run, 0.1, &mut || true);
        found.expect("a run").exponent
    }

    #[test]
    fn what_damping_makes_small_between_two_events_is_not_lost() {
        // ẍ + D ẋ + x = cos Ω t with next to no friction: disturbances decay as e^(−D t/2), to 1e-14 in half a period.
        let found = exponent(
            Oscillator {
                forcing: vec![Harmonic::new(1.0, 0.05, 0.0)],
                ..Oscillator::new(1.0, 0.0, Coulomb { kinetic: 1e-9 })
            },
            3000.0,
        );
        assert!((found + 0.5).abs() < 5e-3, "{found}");
    }

    #[test]
    fn what_a_stick_forgets_is_lost() {
        let law = StaticKinetic {
            break_away: 1.0,
            kinetic: 0.6,
        };
        let found = exponent(Oscillator::new(0.0, 0.2, law), 500.0);
        assert_eq!(found, f64::NEG_INFINITY);
    }
}
