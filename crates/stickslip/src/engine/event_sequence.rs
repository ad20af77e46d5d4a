//! The event sequence of a motion, taken from a run: what `variation` follows.

use crate::clock::Clock;
use crate::elementary::sin_cos;
use crate::error::Error;
use crate::event::Start;
use crate::hybrid_state::HybridState;
use crate::law::{End, Friction, Law, Memory, Piece};
use crate::mode::{Kind, Mode};
use crate::network::{self, sequence};
use crate::orbit::{Event, Orbit};
use crate::oscillator::Oscillator;
use crate::simulate::{self, Run, Stop};
use crate::system::System;
use crate::variation::{ContactMode, Ending, Phase, State, contact_of};

/// A start, what follows, and why the run ended.
#[derive(Clone, Debug)]
pub struct EventSequence {
    /// Where it starts.
    pub start: State,
    /// Phases between events; the last one ends by time.
    pub phases: Vec<Phase>,
    /// The event at the end of each phase but the last.
    pub kinds: Vec<Kind>,
    /// Why the run ended.
    pub stop: Stop,
}

/// The event sequence of a run from x and v, as long as `go_on` says so.
///
/// # Errors
/// What makes no sense in the oscillator or the run.
pub fn run(oscillator: &Oscillator, run: Run, go_on: impl FnMut() -> bool) -> Result<EventSequence, Error> {
    if !oscillator.closed() {
        let run = network::Run {
            x0: Some(vec![run.x0]),
            v0: run.v0.map(|v| vec![v]),
            t_end: run.t_end,
            max_events: run.max_events,
        };
        return sequence::run(&System::from(oscillator), run, go_on);
    }
    let orbit = simulate::simulate_while(oscillator, run, go_on)?;
    let v0 = run.v0.unwrap_or(oscillator.drive_velocity);
    let HybridState { mode, memory, .. } = simulate::first_hybrid_state(oscillator, run);
    let piece = match mode {
        Mode::Slip { piece, .. } => piece,
        _ => Piece::constant(0.0),
    };
    Ok(of_orbit(
        &orbit,
        &start((0.0, run.x0, v0), &piece, &memory),
        run.t_end,
    ))
}

/// The event sequence from a state in a contact mode, for a duration and as long as `go_on` says so. A stick begins there.
///
/// # Errors
/// What makes no sense in the oscillator.
pub fn from(
    oscillator: &Oscillator,
    state: &State,
    contact_mode: ContactMode,
    duration: f64,
    max_events: u64,
    go_on: impl FnMut() -> bool,
) -> Result<EventSequence, Error> {
    if !oscillator.closed() {
        let system = System::from(oscillator);
        return sequence::from(&system, state, &[contact_mode], duration, max_events, go_on);
    }
    let number = |i: usize| state.numbers[i];
    let [t, x, v] = [0, 1, 2].map(number);
    let run = Run {
        x0: x,
        v0: Some(if contact_mode == ContactMode::Stick {
            oscillator.drive_velocity
        } else {
            v
        }),
        t_end: t + duration,
        max_events,
    };
    let (piece, memory) = state.contact(3, 0);
    let mode = match contact_mode {
        ContactMode::Stick => Mode::Stick,
        ContactMode::Slip(direction) => {
            let u = direction * (oscillator.drive_velocity - v);
            let forcing: f64 = oscillator
                .forcing
                .iter()
                .map(|f| f.amplitude * sin_cos(f.frequency * t + f.phase).1)
                .sum();
            let balance = direction * (oscillator.damping * v + oscillator.stiffness * x - forcing);
            let still = (balance - piece.force(u)).abs() <= 1e-9 * (balance.abs() + piece.force(u).abs());
            let start = if still {
                Start::Reversal
            } else if u <= piece.low {
                Start::Low
            } else if u >= piece.high {
                Start::High
            } else {
                Start::Inside
            };
            Mode::Slip {
                direction,
                piece,
                start,
            }
        }
        ContactMode::Hold(direction) => {
            let u = direction * (oscillator.drive_velocity - v);
            Mode::Hold {
                direction,
                u,
                between: oscillator
                    .law
                    .toward(direction)
                    .branches(u)
                    .unwrap_or([f64::NAN; 2]),
                start: Start::Inside,
            }
        }
    };
    let hybrid = HybridState {
        clock: Clock::at(t),
        mode,
        memory,
    };
    let orbit = simulate::simulate_on(oscillator, run, hybrid, go_on)?;
    Ok(of_orbit(&orbit, state, t + duration))
}

fn start((t, x, v): (f64, f64, f64), piece: &Piece, memory: &Memory) -> State {
    let (line, flags) = contact_of(piece, memory);
    State {
        numbers: [t, x, v].into_iter().chain(line).collect(),
        flags: vec![flags],
    }
}

fn of_orbit(orbit: &Orbit, start: &State, end: f64) -> EventSequence {
    let oscillator = &orbit.oscillator;
    let mut phases = Vec::with_capacity(orbit.segments.len());
    for (index, segment) in orbit.segments.iter().enumerate() {
        let contact_mode = ContactMode::of(segment.direction, segment.slope);
        let Some(event) = orbit.events.get(index) else {
            phases.push(Phase {
                contact_modes: vec![contact_mode],
                contact: 0,
                ending: Ending::Time,
                duration: segment.clock.until(end),
            });
            break;
        };
        let u = |v: f64| segment.direction * (oscillator.drive_velocity - v);
        // The slip acceleration is zero where it turns; at a node the speed may have turned before.
        let grows = || match event.kind {
            Kind::Node => segment.direction * orbit.states(&[event.t])[0].a < 0.0,
            _ => u(event.v) >= u(segment.v),
        };
        let ending = ending(event, contact_mode, &oscillator.law, grows, || u(event.v));
        let next = orbit
            .segments
            .get(index + 1)
            .map_or(segment.clock, |next| next.clock);
        phases.push(Phase {
            contact_modes: vec![contact_mode],
            contact: 0,
            ending,
            duration: (next.high - segment.clock.high) + (next.low - segment.clock.low),
        });
    }
    EventSequence {
        start: start.clone(),
        phases,
        kinds: orbit.events.iter().map(|event| event.kind).collect(),
        stop: orbit.stop,
    }
}

/// How a phase in which a contact did what `mode` says ended, by the event there: it is asked whether the slip speed grew up to
/// it, and at which one a hold was.
pub(crate) fn ending(
    event: &Event,
    mode: ContactMode,
    law: &Law,
    grows: impl FnOnce() -> bool,
    held: impl FnOnce() -> f64,
) -> Ending {
    match (event.kind, mode) {
        (Kind::Release, _) => Ending::Release,
        (Kind::Reversal, ContactMode::Hold(direction)) => {
            let [low, high] = law.toward(direction).branches(held()).unwrap_or([f64::NAN; 2]);
            let force = direction * event.force;
            let upper = (force - high).abs() < (force - low).abs();
            Ending::Line(if upper { End::High } else { End::Low })
        }
        (Kind::Reversal | Kind::Hold, _) => Ending::Line(End::Reversal { rising: !grows() }),
        (Kind::Node, _) if grows() => Ending::Line(End::High),
        _ => Ending::Line(End::Low),
    }
}
