//! The jump of the derivative at an event: what vanishes there, and the state and memory that follow.

use super::segment::Frame;
use super::state::{Arc, Ending, LINE, Phase, SINCE, State};
use super::varied::{LINE_STEP, RELATIVE_STEP};
use crate::dual::Dual;
use crate::law::{End, Friction, Hold, Law, Memory, Piece};

impl<const N: usize> Frame<'_, N> {
    /// What vanishes where the arc ends, given the motion there.
    pub(super) fn guard(&self, state: &State<N>, arc: &Arc, tau: Dual<N>) -> Dual<N> {
        let t = state.numbers[0] + tau;
        let [x, v, a] = self.motion(state, arc.phase, tau);
        match (arc.phase, arc.ending) {
            (_, Ending::Time) => tau - Dual::fixed(arc.duration),
            (Phase::Stick, _) => self.margin(state, t, x),
            (Phase::Hold(direction), ending) => {
                let rising = usize::from(ending == Ending::Line(End::High));
                let u = self.speed(direction, state.numbers[2]);
                let [between] = self.varied.ask([u], LINE_STEP, |law, [u]| {
                    [law.branches(u).map_or(f64::NAN, |pair| pair[rising])]
                });
                self.holding(t, x, v).0 * direction - between
            }
            (Phase::Slip(direction), Ending::Line(End::Low)) => {
                self.speed(direction, v) - state.numbers[LINE + 2]
            }
            (Phase::Slip(direction), Ending::Line(End::High)) => {
                self.speed(direction, v) - state.numbers[LINE + 3]
            }
            (Phase::Slip(_), _) => a,
        }
    }

    /// What adhesion bears beyond the force that holds the mass.
    pub(super) fn margin(&self, state: &State<N>, t: Dual<N>, x: Dual<N>) -> Dual<N> {
        let (force, rate) = self.holding(t, x, self.drive);
        self.bears(t - state.numbers[SINCE], rate) - force.abs()
    }

    pub(super) fn bears(&self, stick_time: Dual<N>, rate: Dual<N>) -> Dual<N> {
        let [bears] = self.varied.ask(
            [stick_time, rate.abs()],
            RELATIVE_STEP,
            |law, [stick_time, force_rate]| {
                [law.break_away(Hold {
                    stick_time: stick_time.max(0.0),
                    force_rate: force_rate.abs(),
                })]
            },
        );
        bears
    }

    /// The law names the line of friction that comes next.
    fn turn_to(
        &self,
        state: &mut State<N>,
        u: Dual<N>,
        next: impl Fn(&Law, &Piece, f64, &mut Memory) -> Piece,
    ) {
        // What adhesion would feel now; the law reads it where a slip turns or starts.
        let rate = self
            .holding(state.numbers[0], state.numbers[1], self.drive)
            .1
            .abs();
        let mut inputs = [u; 11];
        inputs[10] = rate;
        inputs[..9].copy_from_slice(&state.numbers[LINE..SINCE]);
        let (branch, turns, released) = (state.branch, state.turns, state.released);
        let answer = |law: &Law, z: [f64; 11]| {
            let mut memory = Memory {
                anchor: [z[4], z[5]],
                corner: [z[6], z[7]],
                released_at: released.then_some(z[8]),
                force_rate: z[10],
            };
            let piece = Piece {
                offset: z[0],
                slope: z[1],
                low: z[2],
                high: z[3],
                branch,
                turns,
            };
            (next(law, &piece, z[9], &mut memory), memory)
        };
        let (piece, memory) = answer(&self.varied.base.law, inputs.map(|input| input.value));
        let numbers = self.varied.ask(inputs, LINE_STEP, |law, z| {
            let (piece, memory) = answer(law, z);
            [
                piece.offset,
                piece.slope,
                piece.low,
                piece.high,
                memory.anchor[0],
                memory.anchor[1],
                memory.corner[0],
                memory.corner[1],
                memory.released_at.unwrap_or(0.0),
            ]
        });
        state.numbers[LINE..SINCE].copy_from_slice(&numbers);
        (state.branch, state.turns) = (piece.branch, piece.turns);
        state.released = memory.released_at.is_some();
    }

    /// The state after `arc`, whose end `tau` is known; `next` is what follows.
    pub(super) fn pass(&self, state: &State<N>, arc: &Arc, tau: Dual<N>, next: Phase) -> State<N> {
        let mut after = *state;
        let [x, v, _] = self.motion(state, arc.phase, tau);
        let t = state.numbers[0] + tau;
        (after.numbers[0], after.numbers[1], after.numbers[2]) = (t, x, v);
        let Ending::Line(end) = arc.ending else {
            if arc.ending == Ending::Release {
                after.numbers[2] = self.drive;
                let (_, rate) = self.holding(t, x, self.drive);
                let force = self.bears(t - state.numbers[SINCE], rate);
                self.turn_to(&mut after, force, |law, _, force, memory| {
                    law.leave(force, memory)
                });
            }
            return after;
        };
        let (Phase::Slip(direction) | Phase::Hold(direction)) = arc.phase else {
            return after;
        };
        if let Phase::Hold(_) = arc.phase {
            let balance = if end == End::High {
                f64::INFINITY
            } else {
                f64::NEG_INFINITY
            };
            let u = self.speed(direction, v);
            self.turn_to(&mut after, u, |law, _, u, memory| law.begin(u, balance, memory));
            return after;
        }
        let u = match end {
            End::Low => state.numbers[LINE + 2],
            End::High => state.numbers[LINE + 3],
            End::Turn { .. } => self.speed(direction, v),
        };
        if !matches!(end, End::Turn { .. }) {
            after.numbers[2] = self.drive - u * direction;
        }
        match next {
            Phase::Stick => after.numbers[SINCE] = t,
            _ if end == End::Low && u.value <= 0.0 => {
                let (_, rate) = self.holding(t, x, self.drive);
                let force = self.bears(Dual::fixed(0.0), rate);
                self.turn_to(&mut after, force, |law, _, force, memory| {
                    law.leave(force, memory)
                });
            }
            Phase::Slip(_) => self.turn_to(&mut after, u, |law, piece, u, memory| {
                law.next(piece, end, u, memory)
            }),
            Phase::Hold(_) => {}
        }
        after
    }
}
