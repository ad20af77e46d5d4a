//! The jump of the derivative at an event: what vanishes there, and the state and memory that follow.

use super::segment::{Course, Moment};
use super::state::{AGE, Arc, Ending, Flags, HIGH, LOW, Moving, Phase, line_of};
use super::varied::{LINE_STEP, RELATIVE_STEP};
use crate::drive::Clock;
use crate::dual::Dual;
use crate::law::{End, Friction, Hold, Law, Memory, Piece};

impl Course<'_> {
    /// What vanishes where the arc ends, given the motion there.
    pub(super) fn guard(&self, start: &Moving, arc: &Arc, tau: f64, moment: &Moment) -> Dual {
        let c = arc.contact;
        let line = |which: usize| &start.numbers[self.layout.contact(c) + which];
        match (arc.phases.get(c), arc.ending) {
            (Some(Phase::Stick), Ending::Release) => self.margin(start, c, tau, moment),
            (Some(Phase::Hold(direction)), Ending::Line(end)) => {
                let rising = usize::from(end == End::High);
                let parameter = self.parameter(moment.t.rates.len());
                let [between] = self
                    .varied
                    .ask(c, [&moment.u[c]], parameter, LINE_STEP, |law, [u]| {
                        [law.branches(u).map_or(f64::NAN, |pair| pair[rising])]
                    });
                moment.force[c].clone() * *direction - &between
            }
            (Some(Phase::Slip(_)), Ending::Line(End::Low)) => moment.u[c].clone() - line(LOW),
            (Some(Phase::Slip(_)), Ending::Line(End::High)) => moment.u[c].clone() - line(HIGH),
            (Some(Phase::Slip(_)), Ending::Line(End::Turn { .. }) | Ending::Section) => {
                moment.turn[c].clone()
            }
            // A time on the clock: an arc that starts later takes less.
            _ => {
                let mut guard = moment.t.clone();
                guard.value = tau - arc.duration;
                guard
            }
        }
    }

    /// What adhesion of a contact bears beyond the force that holds it.
    pub(super) fn margin(&self, start: &Moving, c: usize, tau: f64, moment: &Moment) -> Dual {
        self.bears(c, &self.age(start, c, tau), &moment.force_rate[c]) - &moment.force[c].clone().abs()
    }

    /// How long a stuck contact has stuck.
    pub(super) fn age(&self, start: &Moving, c: usize, tau: f64) -> Dual {
        let mut age = start.numbers[self.layout.contact(c) + AGE].clone();
        age.value += tau;
        if let Some(rate) = age.rates.last_mut() {
            *rate = 1.0;
        }
        age
    }

    pub(super) fn bears(&self, c: usize, stick_time: &Dual, rate: &Dual) -> Dual {
        let rate = rate.clone().abs();
        let parameter = self.parameter(rate.rates.len());
        let inputs = [stick_time, &rate];
        let [bears] = self
            .varied
            .ask(c, inputs, parameter, RELATIVE_STEP, |law, [stick_time, rate]| {
                [law.break_away(Hold {
                    stick_time: stick_time.max(0.0),
                    force_rate: rate.abs(),
                })]
            });
        bears
    }

    /// The force that would hold a contact, did it stick at this moment, and its rate.
    pub(super) fn if_stuck(
        &self,
        start: &Moving,
        phases: &[Phase],
        c: usize,
        tau: f64,
        moment: &Moment,
    ) -> [Dual; 2] {
        let mut here = self.moved(start, moment);
        here.numbers[0].value += tau;
        let mut stuck = phases.to_vec();
        stuck[c] = Phase::Stick;
        self.stop(&mut here, &stuck);
        let clock = Clock {
            high: here.numbers[0].value,
            low: 0.0,
        };
        let place = self.expand(&here, &stuck, clock);
        [0, 1].map(|k| place.coefficient(k, |motion| &motion.force[c], |tangent| &tangent.force[c]))
    }

    /// The state with the time, the positions and the velocities of the moment; the time is still that of the start.
    fn moved(&self, start: &Moving, moment: &Moment) -> Moving {
        let mut here = start.clone();
        here.numbers[0] = moment.t.clone();
        for i in 0..self.layout.masses {
            here.numbers[self.layout.x(i)] = moment.x[i].clone();
            here.numbers[self.layout.v(i)] = moment.v[i].clone();
        }
        here
    }

    /// The law of a contact names the line of friction that comes next.
    fn turn_to(
        &self,
        state: &mut Moving,
        c: usize,
        u: &Dual,
        force_rate: &Dual,
        next: impl Fn(&Law, &Piece, f64, &mut Memory) -> Piece,
    ) {
        let at = self.layout.contact(c);
        let flags = state.flags[c];
        let answer = |law: &Law, z: [f64; 11]| {
            let mut memory = Memory {
                anchor: [z[4], z[5]],
                corner: [z[6], z[7]],
                released_at: flags.released.then_some(z[8]),
                force_rate: z[10].abs(),
            };
            let piece = Piece {
                offset: z[0],
                slope: z[1],
                low: z[2],
                high: z[3],
                branch: flags.branch,
                turns: flags.turns,
            };
            (next(law, &piece, z[9], &mut memory), memory)
        };
        let own = &state.numbers[at..at + AGE];
        let inputs: [&Dual; 11] = std::array::from_fn(|i| match i {
            9 => u,
            10 => force_rate,
            _ => &own[i],
        });
        let (piece, memory) = answer(self.laws[c], inputs.map(|input| input.value));
        let parameter = self.parameter(u.rates.len());
        let numbers = self.varied.ask(c, inputs, parameter, LINE_STEP, |law, z| {
            let (piece, memory) = answer(law, z);
            line_of(&piece, &memory)
        });
        for (place, number) in state.numbers[at..].iter_mut().zip(numbers) {
            *place = number;
        }
        state.flags[c] = Flags::of(&piece, &memory);
    }

    /// The state after `arc`, which ends at `tau` and moves its end by `moves`; `next` is what follows.
    pub(super) fn pass(
        &self,
        start: &Moving,
        arc: &Arc,
        tau: f64,
        moment: &Moment,
        moves: &Dual,
        next: &[Phase],
    ) -> Moving {
        let mut after = self.moved(start, moment);
        after.numbers[0].value += tau;
        for c in 0..self.layout.contacts {
            let at = self.layout.contact(c);
            if arc.phases[c] == Phase::Stick {
                after.numbers[at + AGE] = self.age(start, c, tau);
            }
            let event = c == arc.contact && !matches!(arc.ending, Ending::Time | Ending::Section);
            if arc.phases[c] != next[c] || event {
                self.change(&mut after, start, arc, c, tau, moment, next);
            }
        }
        for number in &mut after.numbers {
            settle(number, moves);
        }
        self.arrive(&mut after, start, arc, next);
        self.stop(&mut after, next);
        after
    }

    /// How the end of the arc moves with the start, by −h′/ḣ.
    pub(super) fn moves(guard: &Dual) -> Dual {
        let rate = guard.rates.last().copied().unwrap_or(1.0);
        let mut moves = guard.clone() * (-1.0 / rate);
        if let Some(along) = moves.rates.last_mut() {
            *along = 0.0;
        }
        moves
    }

    /// The slip speed at the end of a line of friction is that end, to the last digit.
    fn arrive(&self, after: &mut Moving, start: &Moving, arc: &Arc, next: &[Phase]) {
        let c = arc.contact;
        let (Some(Phase::Slip(direction)), Ending::Line(end @ (End::Low | End::High))) =
            (arc.phases.get(c), arc.ending)
        else {
            return;
        };
        let contact = &self.varied.base.contacts[c];
        if contact.other.is_some() || next[c] == Phase::Stick {
            return;
        }
        let clock = Clock {
            high: after.numbers[0].value,
            low: 0.0,
        };
        let which = if end == End::High { HIGH } else { LOW };
        let u = start.numbers[self.layout.contact(c) + which].clone() * *direction;
        let drive = self.drives(clock, &after.numbers[0]).swap_remove(c);
        after.numbers[self.layout.v(contact.mass)] = drive - &u;
    }

    /// What a contact does anew.
    #[expect(
        clippy::too_many_arguments,
        reason = "the contact, and what lies before and after"
    )]
    fn change(
        &self,
        after: &mut Moving,
        start: &Moving,
        arc: &Arc,
        c: usize,
        tau: f64,
        moment: &Moment,
        next: &[Phase],
    ) {
        let at = self.layout.contact(c);
        let lanes = moment.t.rates.len();
        let rate = || {
            if self.laws[c].feels_force_rate() {
                let [_, rate] = self.if_stuck(start, &arc.phases, c, tau, moment);
                rate
            } else {
                Dual::fixed(0.0, lanes)
            }
        };
        let leave = |law: &Law, _: &Piece, force: f64, memory: &mut Memory| law.leave(force, memory);
        match (arc.phases[c], next[c]) {
            (_, Phase::Stick) => after.numbers[at + AGE] = Dual::fixed(0.0, lanes),
            (Phase::Stick, _) => {
                let force = self.bears(c, &self.age(start, c, tau), &moment.force_rate[c]);
                after.numbers[at + AGE] = Dual::fixed(0.0, lanes);
                self.turn_to(after, c, &force, &Dual::fixed(0.0, lanes), leave);
            }
            (Phase::Hold(_), _) => {
                let balance = if arc.ending == Ending::Line(End::High) {
                    f64::INFINITY
                } else {
                    f64::NEG_INFINITY
                };
                self.turn_to(after, c, &moment.u[c], &rate(), |law, _, u, memory| {
                    law.begin(u, balance, memory)
                });
            }
            (Phase::Slip(_), Phase::Hold(_)) => {}
            (Phase::Slip(_), Phase::Slip(_)) => {
                let Ending::Line(end) = arc.ending else { return };
                let low = &start.numbers[at + LOW];
                if end == End::Low && low.value <= 0.0 {
                    let force = self.bears(c, &Dual::fixed(0.0, lanes), &rate());
                    self.turn_to(after, c, &force, &Dual::fixed(0.0, lanes), leave);
                    return;
                }
                let u = match end {
                    End::Low => low,
                    End::High => &start.numbers[at + HIGH],
                    End::Turn { .. } => &moment.u[c],
                };
                self.turn_to(after, c, u, &rate(), |law, piece, u, memory| {
                    law.next(piece, end, u, memory)
                });
            }
        }
    }
}

/// Time along the arc is no direction of its own where the arc ends.
pub(super) fn settle(number: &mut Dual, moves: &Dual) {
    let slope = number.rates.last().copied().unwrap_or(0.0);
    if slope != 0.0 {
        *number = std::mem::take(number).shifted(slope, moves);
        if let Some(along) = number.rates.last_mut() {
            *along = 0.0;
        }
    }
}
