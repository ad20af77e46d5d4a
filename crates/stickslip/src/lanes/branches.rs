//! Laws with branches in lanes: where a mode ends, each lane asks its law what follows, as the engine of single motions does.

use stickslip_lanes::{Lane, Mask};

use super::branch_slip;
use super::curve_slip::OnLaneStep;
use super::lane_oscillator::{Constants, LaneOscillator, State, lanes};
use super::mode_end::{Kind, Occupant, Outcome, SlipPath, break_away};
use crate::clock::Clock;
use crate::event::Start;
use crate::hybrid_state::HybridState;
use crate::law::{End, Memory};
use crate::mode::{self, Kind as EventKind, Mode};
use crate::orbit::{Event, Segment};

lanes! {
    /// The piece of friction that each lane slips along, or the branches between which its slip is held.
    LanePiece {
        mass,
        /// Friction, `offset` + `slope` · u, from the slip speed `low` to `high`; of a slip that is held, the ends of friction.
        offset, slope, low, high,
        /// 1 where slip is held, and where a turn of the slip speed ends it; else 0.
        held, turns,
        /// At the low end and moving up: 1; at the high one and moving down: −1; else 0.
        start,
    }
}

/// Pieces that follow one another as the law says.
pub(super) struct Branches;

impl Kind for Branches {
    type Of<L: Lane> = CurrentPieces<L>;
}

/// What each lane slips along, its mode and memory, and what has happened there last.
pub(super) struct CurrentPieces<L> {
    piece: LanePiece<L>,
    modes: Vec<Mode>,
    memories: Vec<Memory>,
    kinds: Vec<EventKind>,
    /// How many modes were handed over one after the other.
    handed: Vec<u32>,
}

/// A motion of which more modes are handed over one after the other leaves the lanes: it is near steady slip, where turns are
/// rounding.
const MOST_HANDED_IN_A_ROW: u32 = 8;

impl<L: Lane> CurrentPieces<L> {
    /// Write the piece of a mode.
    fn write(&mut self, i: usize, mode: Mode) {
        let start = |start| match start {
            Start::Low => 1.0,
            Start::High => -1.0,
            _ => 0.0,
        };
        let mass = self.piece.mass.get(i);
        let numbers = match mode {
            Mode::Stick => None,
            Mode::Slip { piece, start: at, .. } => Some(LanePiece {
                mass,
                offset: piece.offset,
                slope: piece.slope,
                low: piece.low,
                high: piece.high,
                held: 0.0,
                turns: f64::from(u8::from(piece.reverses)),
                start: start(at),
            }),
            Mode::Hold {
                between, start: at, ..
            } => Some(LanePiece {
                mass,
                offset: 0.0,
                slope: 0.0,
                low: between[0],
                high: between[1],
                held: 1.0,
                turns: 0.0,
                start: start(at),
            }),
        };
        if let Some(numbers) = numbers {
            self.piece.put(i, &numbers);
        }
        self.modes[i] = mode;
    }

    /// Go on in a mode.
    fn go_on(&mut self, i: usize, mode: Mode, state: &mut State<L>) {
        let (stuck, direction, at_reversal) = match mode {
            Mode::Stick => (1.0, 1.0, 0.0),
            Mode::Slip { direction, start, .. } => {
                (0.0, direction, f64::from(u8::from(start == Start::Reversal)))
            }
            Mode::Hold { direction, .. } => (0.0, direction, 0.0),
        };
        self.handed[i] = 0;
        state.stuck.set(i, stuck);
        state.direction.set(i, direction);
        state.at_reversal.set(i, at_reversal);
        self.write(i, mode);
    }
}

impl<L: Lane> SlipPath<L> for CurrentPieces<L> {
    fn splat(oscillator: &LaneOscillator, _line: f64) -> Self {
        let one = LanePiece {
            mass: oscillator.mass,
            offset: 0.0,
            slope: 0.0,
            low: 0.0,
            high: f64::INFINITY,
            held: 0.0,
            turns: 0.0,
            start: 0.0,
        };
        Self {
            piece: LanePiece::splat(&one),
            modes: vec![Mode::Stick; L::WIDTH],
            memories: vec![Memory::default(); L::WIDTH],
            kinds: vec![EventKind::Release; L::WIDTH],
            handed: vec![0; L::WIDTH],
        }
    }

    fn put(&mut self, i: usize, oscillator: &LaneOscillator, _line: f64) {
        self.piece.mass.set(i, oscillator.mass);
        self.handed[i] = 0;
    }

    fn leaves(&mut self, i: usize) -> bool {
        self.handed[i] += 1;
        self.handed[i] > MOST_HANDED_IN_A_ROW
    }

    fn enter(&mut self, i: usize, hybrid: &HybridState) {
        self.memories[i] = hybrid.memory;
        self.write(i, hybrid.mode);
    }

    fn hybrid(&self, i: usize, oscillator: &LaneOscillator, state: &State<f64>) -> (f64, f64, HybridState) {
        let hybrid = HybridState {
            clock: oscillator.clock(state.periods, state.t),
            mode: self.modes[i],
            memory: self.memories[i],
        };
        (state.x, state.v, hybrid)
    }

    fn event_row(
        &self,
        i: usize,
        _oscillator: &LaneOscillator,
        (clock, state): (Clock, &State<f64>),
        [force, stick_time, force_rate]: [f64; 3],
    ) -> (Event, Segment) {
        let event = Event {
            t: clock.high,
            kind: self.kinds[i],
            contact: 0,
            x: state.x,
            v: state.v,
            force,
            stick_time,
            force_rate,
        };
        (event, Segment::new(clock, state.x, state.v, &self.modes[i]))
    }

    #[inline(always)]
    fn break_away(
        &mut self,
        c: &Constants<L>,
        state: &mut State<L>,
        (horizon, stuck): (L, L::Mask),
        occupants: &[Option<Occupant>],
    ) -> Outcome<L> {
        let outcome = break_away(c, state, horizon, stuck);
        for i in (0..L::WIDTH).filter(|&i| outcome.at_event.at(i)) {
            if let Some(Occupant { law, .. }) = &occupants[i] {
                let pull = outcome.event[0].get(i);
                let mode = mode::slip_from_zero(law, pull, pull.abs(), &mut self.memories[i]);
                self.kinds[i] = EventKind::Release;
                self.go_on(i, mode, state);
            }
        }
        outcome
    }

    #[inline(always)]
    fn arrive(
        &mut self,
        c: &Constants<L>,
        state: &mut State<L>,
        (horizon, slips): (L, L::Mask),
        occupants: &[Option<Occupant>],
        _on_step: Option<OnLaneStep>,
    ) -> Outcome<L> {
        let (one, none) = (L::splat(1.0), L::splat(f64::NAN));
        let ending = branch_slip::ending(c, &self.piece, state, horizon, slips);
        let found = ending.end.found;
        let up = slips & (ending.lasts | (found & horizon.at_most(ending.end.lasted)));
        let go = found & !up;
        state.go_to(go, &ending.end, ending.v);
        state.events = L::choose(go, state.events + one, state.events);
        let holding = c.stiffness * state.x + c.damper * c.drive - c.force * state.cos;
        let rate = c.rise + c.force * c.frequency * state.sin;
        let mut forces = none;
        for i in (0..L::WIDTH).filter(|&i| go.at(i)) {
            let Some(Occupant { law, .. }) = &occupants[i] else {
                continue;
            };
            let (ahead, rose) = (ending.ahead.at(i), ending.heading.get(i) > 0.0);
            let memory = &mut self.memories[i];
            let (next, kind, force) = match self.modes[i] {
                Mode::Slip { direction, piece, .. } => {
                    let u = match (ahead, rose) {
                        (true, true) => piece.high,
                        (false, _) if piece.reverses => direction * (c.drive.get(i) - state.v.get(i)),
                        _ => piece.low,
                    };
                    let end = match (ahead, rose) {
                        (true, true) => End::High,
                        (false, _) if piece.reverses => End::Reversal { rising: !rose },
                        _ => End::Low,
                    };
                    let held = || [holding.get(i), rate.get(i)];
                    let (next, kind) = mode::after_slip(law, (direction, &piece), (end, u), held, memory);
                    (next, kind, direction * piece.force(u))
                }
                Mode::Hold {
                    direction,
                    u,
                    between,
                    ..
                } => {
                    let end = if ahead { End::High } else { End::Low };
                    let next = mode::after_hold(law, direction, u, end, memory);
                    (next, EventKind::Reversal, direction * between[usize::from(ahead)])
                }
                Mode::Stick => continue,
            };
            self.kinds[i] = kind;
            forces.set(i, force);
            self.go_on(i, next, state);
        }
        Outcome {
            at_event: go,
            at_horizon: up,
            unsettled: slips & !found & !up,
            event: [forces, none, none],
            evaluations: ending.evaluations,
        }
    }
}
