//! The event sequence of a motion, taken from a run: what `variation` follows.

use crate::drive::Clock;
use crate::elementary::sin_cos;
use crate::error::Error;
use crate::event::Start;
use crate::flow::exact::Frame;
use crate::law::{End, Friction, Memory, Piece};
use crate::mode::{self, Kind, Mode};
use crate::network::{self, sequence};
use crate::orbit::{Orbit, Segment, While};
use crate::place::Place;
use crate::simulate::{self, Run, Stop};
use crate::structure::{Oscillator, with_harmonics};
use crate::system::System;
use crate::variation::{Arc, Ending, Phase, State, contact_of};

/// A start, what follows, and why the run ended.
#[derive(Clone, Debug)]
pub struct Trail {
    /// Where it starts.
    pub start: State,
    /// Arcs between events; the last one ends by time.
    pub arcs: Vec<Arc>,
    /// The event at the end of each arc but the last.
    pub kinds: Vec<Kind>,
    /// Why the run ended.
    pub stop: Stop,
}

/// The trail of a run from x and v, as long as `go_on` says so.
///
/// # Errors
/// What makes no sense in the oscillator or the run.
pub fn run(oscillator: &Oscillator, run: Run, go_on: impl FnMut() -> bool) -> Result<Trail, Error> {
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
    let mut memory = Memory::default();
    let mode = with_harmonics!(oscillator, H, first::<H>(oscillator, (run.x0, v0), &mut memory));
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

fn first<const H: usize>(oscillator: &Oscillator, (x, v): (f64, f64), memory: &mut Memory) -> Mode {
    let frame = Frame::<H>::of(oscillator);
    let (holding, rate, _) = frame.stick(Clock::default(), x).at(0.0);
    mode::first(&frame, &oscillator.law, (v, holding, rate), memory)
}

/// The trail from a state in a phase, for a duration and as long as `go_on` says so. A stick begins there.
///
/// # Errors
/// What makes no sense in the oscillator.
pub fn from(
    oscillator: &Oscillator,
    state: &State,
    phase: Phase,
    duration: f64,
    max_events: u64,
    go_on: impl FnMut() -> bool,
) -> Result<Trail, Error> {
    if !oscillator.closed() {
        let system = System::from(oscillator);
        return sequence::from(&system, state, &[phase], duration, max_events, go_on);
    }
    let number = |i: usize| state.numbers[i];
    let [t, x, v] = [0, 1, 2].map(number);
    let run = Run {
        x0: x,
        v0: Some(if phase == Phase::Stick {
            oscillator.drive_velocity
        } else {
            v
        }),
        t_end: t + duration,
        max_events,
    };
    let flags = state.flags[0];
    let piece = Piece {
        offset: number(3),
        slope: number(4),
        low: number(5),
        high: number(6),
        branch: flags.branch,
        turns: flags.turns,
    };
    let memory = Memory {
        anchor: [number(7), number(8)],
        corner: [number(9), number(10)],
        released_at: flags.released.then_some(number(11)),
        ..Memory::default()
    };
    let mode = match phase {
        Phase::Stick => Mode::Stick,
        Phase::Slip(direction) => {
            let u = direction * (oscillator.drive_velocity - v);
            let forcing: f64 = oscillator
                .forcing
                .iter()
                .map(|f| f.amplitude * sin_cos(f.frequency * t + f.phase).1)
                .sum();
            let balance = direction * (oscillator.damping * v + oscillator.stiffness * x - forcing);
            let still = (balance - piece.force(u)).abs() <= 1e-9 * (balance.abs() + piece.force(u).abs());
            let start = if still {
                Start::Turning
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
        Phase::Hold(direction) => {
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
    let place = Place {
        clock: Clock { high: t, low: 0.0 },
        mode,
        memory,
    };
    let mut orbit = Orbit::new(oscillator.clone(), run);
    let record = &mut orbit;
    let (stop, _) = simulate::resume(oscillator, run, place, &mut While { record, go_on })?;
    orbit.stop = stop;
    Ok(of_orbit(&orbit, state, t + duration))
}

fn start((t, x, v): (f64, f64, f64), piece: &Piece, memory: &Memory) -> State {
    let (line, flags) = contact_of(piece, memory);
    State {
        numbers: [t, x, v].into_iter().chain(line).collect(),
        flags: vec![flags],
    }
}

fn phase_of(segment: &Segment) -> Phase {
    if segment.direction == 0.0 {
        Phase::Stick
    } else if segment.slope.is_infinite() {
        Phase::Hold(segment.direction)
    } else {
        Phase::Slip(segment.direction)
    }
}

fn of_orbit(orbit: &Orbit, start: &State, end: f64) -> Trail {
    let oscillator = &orbit.oscillator;
    let speed = |direction: f64, v: f64| direction * (oscillator.drive_velocity - v);
    let mut arcs = Vec::with_capacity(orbit.segments.len());
    for (index, segment) in orbit.segments.iter().enumerate() {
        let phase = phase_of(segment);
        let Some(event) = orbit.events.get(index) else {
            arcs.push(Arc {
                phases: vec![phase],
                contact: 0,
                ending: Ending::Time,
                duration: segment.clock.until(end),
            });
            break;
        };
        let u = speed(segment.direction, event.v);
        let ending = match (event.kind, phase) {
            (Kind::Release, _) => Ending::Release,
            (Kind::Capture | Kind::Crossing, _) => Ending::Line(End::Low),
            (Kind::Reversal, Phase::Hold(direction)) => {
                let [low, high] = oscillator
                    .law
                    .toward(direction)
                    .branches(u)
                    .unwrap_or([f64::NAN; 2]);
                let force = direction * event.force;
                let upper = (force - high).abs() < (force - low).abs();
                Ending::Line(if upper { End::High } else { End::Low })
            }
            (Kind::Reversal | Kind::Hold, _) => Ending::Line(End::Turn {
                rising: u < speed(segment.direction, segment.v),
            }),
            (Kind::Node, _) => {
                let rising = segment.direction * orbit.states(&[event.t])[0].a < 0.0;
                Ending::Line(if rising { End::High } else { End::Low })
            }
        };
        let next = orbit
            .segments
            .get(index + 1)
            .map_or(segment.clock, |next| next.clock);
        arcs.push(Arc {
            phases: vec![phase],
            contact: 0,
            ending,
            duration: (next.high - segment.clock.high) + (next.low - segment.clock.low),
        });
    }
    Trail {
        start: start.clone(),
        arcs,
        kinds: orbit.events.iter().map(|event| event.kind).collect(),
        stop: orbit.stop,
    }
}
