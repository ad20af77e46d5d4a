//! The jump of the derivative at an event (saltation matrix): what vanishes there, and the state and memory that follow.
//!
//! An event at which the guard h(x, t) vanishes takes the state x to R(x, t), and the motion from ẋ = F⁻ to ẋ = F⁺. With
//! n = ∇h, a neighbouring motion that is off by δx before the event is off by S δx after it:
//!
//! ```text
//! S = D_xR + (F⁺ − D_xR F⁻ − D_tR) nᵀ / (nᵀF⁻ + h_t)
//! ```
//!
//! No such matrix is formed here. Every number is a [`Dual`] whose last rate is that by time along the phase, here written
//! with a dot; the rates along the other directions are written with a prime. The event comes later by −h′/ḣ
//! ([`VariedMotion::event_time_derivative`]). [`VariedMotion::state_after_event`] applies R to these numbers and then puts
//! that shift for time along the phase, which gives the first term and those with D_xR F⁻ and D_tR. The term with F⁺ follows in
//! the next phase, as the time at which that starts is one of the numbers and moves too.

use super::segment::{Expansion, VariedMotion};
use super::state::{
    ContactMode, Ending, Flags, HIGH, LOW, Layout, Moving, Phase, STICK_TIME, State, line_of,
};
use crate::clock::Clock;
use crate::dual::Dual;
use crate::jet::Jet;
use crate::law::{End, Friction, Memory, Piece, Rest};
use crate::scalar::Scalar;
use crate::series::ZERO;
use crate::system::System;

/// Where a phase of an event sequence ends.
pub(super) struct PhaseEnd<'a> {
    /// Which phase.
    pub(super) index: usize,
    pub(super) start: &'a Moving,
    pub(super) phase: &'a Phase,
    pub(super) tau: f64,
    pub(super) expansion: &'a Expansion,
    /// How far beyond the expansion.
    pub(super) rest: f64,
    /// What the contacts do then.
    pub(super) next: &'a [ContactMode],
}

impl VariedMotion<'_> {
    /// What vanishes where the phase ends, given the motion there.
    pub(super) fn guard(&self, start: &Moving, phase: &Phase, tau: f64, expansion: &Expansion) -> Dual {
        let c = phase.contact;
        let line = |which: usize| &start.numbers[self.layout.contact(c) + which];
        match (phase.contact_modes.get(c), phase.ending) {
            (Some(ContactMode::Stick), Ending::Release) => self.static_margin(start, c, tau, expansion),
            (Some(ContactMode::Hold(direction)), Ending::Line(end)) => {
                let rising = usize::from(end == End::High);
                let parameters = self.parameters(start.numbers[0].rates.len());
                let u = expansion.u(c);
                let mut between = [Dual::fixed(0.0, u.rates.len())];
                self.varied.ask(c, [&u], parameters, &mut between, |law, [u]| {
                    let branches = law.toward(*direction).branches(u);
                    [branches.map_or(f64::NAN.into(), |pair| pair[rising])]
                });
                let [between] = between;
                expansion.force(c) * *direction - &between
            }
            (Some(ContactMode::Slip(_)), Ending::Line(End::Low)) => expansion.u(c) - line(LOW),
            (Some(ContactMode::Slip(_)), Ending::Line(End::High)) => expansion.u(c) - line(HIGH),
            (Some(ContactMode::Slip(_)), Ending::Line(End::Reversal { .. }) | Ending::Section) => {
                expansion.slip_acceleration(c)
            }
            // A time on the clock: a phase that starts later takes less.
            _ => {
                let mut guard = later(&start.numbers[0], tau);
                guard.value = tau - phase.duration;
                guard
            }
        }
    }

    /// What adhesion of a contact bears beyond the force that holds it.
    pub(super) fn static_margin(&self, start: &Moving, c: usize, tau: f64, expansion: &Expansion) -> Dual {
        let normal = self.normal(c, || self.state_on_expansion(start, tau, expansion));
        self.static_limit_beyond(
            (c, normal),
            &self.stick_time(start, c, tau),
            || expansion.force_rate(c),
            expansion.force(c),
        )
    }

    /// The static limit beyond a force, under a normal force where that varies.
    pub(super) fn static_limit_beyond(
        &self,
        (c, normal): (usize, Option<Dual>),
        stick_time: &Dual,
        rate: impl FnOnce() -> Dual,
        force: Dual,
    ) -> Dual {
        let limit = self.static_limit(c, force.value, stick_time, rate);
        let pressed = match normal {
            Some(normal) => {
                let mut pressed = limit.clone() * normal.value;
                pressed.shift(limit.value, &normal);
                pressed
            }
            None => limit,
        };
        pressed - &force.abs()
    }

    /// The normal force of a contact over that of its law, where that varies, in a state.
    pub(super) fn normal(&self, c: usize, state: impl FnOnce() -> Moving) -> Option<Dual> {
        let normal = self.frame.normals[c].as_ref()?;
        let state = state();
        let clock = Clock::at(state.numbers[0].value);
        let across = |of: fn(Layout, usize) -> usize| {
            let contact = &self.varied.base.contacts[c];
            let own = state.numbers[of(self.layout, contact.mass)].clone();
            match contact.other {
                Some(other) => own - &state.numbers[of(self.layout, other)],
                None => own,
            }
        };
        let (x, v) = (across(Layout::x), across(Layout::v));
        let directions = x.rates.len();
        let mut number = Dual::fixed(normal.at(clock, x.value, v.value), directions);
        let mut series = ZERO;
        normal.expand(clock, &mut series);
        number.shift(series[1], &state.numbers[0]);
        number.shift(normal.position, &x);
        number.shift(normal.velocity, &v);
        let at = |system: &System| {
            let normal = system.contacts[c].normal_force.as_ref();
            normal.map_or(f64::NAN, |normal| normal.at(clock, x.value, v.value))
        };
        for (parameter, axis) in self.directions_of(directions) {
            number.rates[axis] += parameter.rate(at);
        }
        Some(number)
    }

    /// How long a stuck contact has stuck.
    pub(super) fn stick_time(&self, start: &Moving, c: usize, tau: f64) -> Dual {
        later(&start.numbers[self.layout.contact(c) + STICK_TIME], tau)
    }

    /// A force rate where static friction of the contact depends on it, else zero.
    fn felt_force_rate(&self, c: usize, directions: usize, rate: impl FnOnce() -> Dual) -> Dual {
        if self.laws[c].feels_force_rate() {
            rate()
        } else {
            Dual::fixed(0.0, directions)
        }
    }

    /// The static limit against slip in a direction.
    fn static_limit(&self, c: usize, direction: f64, stick_time: &Dual, rate: impl FnOnce() -> Dual) -> Dual {
        let directions = stick_time.rates.len();
        let rate = self.felt_force_rate(c, directions, rate).abs();
        let parameters = self.parameters(directions);
        let inputs = [stick_time, &rate];
        let mut limit = [Dual::fixed(0.0, directions)];
        (self.varied).ask(c, inputs, parameters, &mut limit, |law, [stick_time, rate]| {
            let rest = Rest::new(stick_time.max(Jet::default()), rate);
            [law.toward(direction).static_limit(rest)]
        });
        let [limit] = limit;
        limit
    }

    /// The force that would hold a contact, did it stick in this state, and its rate.
    pub(super) fn if_stuck(&self, mut state: Moving, contact_modes: &[ContactMode], c: usize) -> [Dual; 2] {
        let mut stuck = contact_modes.to_vec();
        stuck[c] = ContactMode::Stick;
        self.stop_stuck_masses(&mut state, &stuck);
        self.holding(&state, &stuck, c)
    }

    /// That rate where a phase ends.
    fn rate_if_stuck(&self, end: &PhaseEnd, c: usize) -> Dual {
        if let Some(closed) = &self.closed {
            return closed.holding_rate(&later(&end.start.numbers[0], end.tau));
        }
        let [_, rate] = self.if_stuck(self.state_at_end(end), &end.phase.contact_modes, c);
        rate
    }

    /// The state with the time, the positions and the velocities of an expansion.
    pub(super) fn state_on_expansion(&self, start: &Moving, tau: f64, expansion: &Expansion) -> Moving {
        let mut here = start.clone();
        self.move_with_expansion(&mut here, tau, expansion);
        here
    }

    /// A state at the start of an expansion moves on with it.
    fn move_with_expansion(&self, here: &mut Moving, tau: f64, expansion: &Expansion) {
        grow(&mut here.numbers[0], tau);
        for i in 0..self.layout.masses {
            here.numbers[self.layout.x(i)] = expansion.x(i);
            here.numbers[self.layout.v(i)] = expansion.v(i);
        }
    }

    /// The state with the time, the positions and the velocities where a phase ends.
    pub(super) fn state_at_end(&self, end: &PhaseEnd) -> Moving {
        let mut there = Moving::default();
        self.set_state_at_end(&mut there, end);
        there
    }

    /// The same in place of another state.
    fn set_state_at_end(&self, there: &mut Moving, end: &PhaseEnd) {
        there.clone_from(end.start);
        self.move_with_expansion(there, end.tau, end.expansion);
        for number in &mut there.numbers[1..self.layout.contact(0)] {
            number.value += end.rest * number.rates.last().copied().unwrap_or(0.0);
        }
    }

    /// The law of a contact names the line of friction that comes next: by the force at which it leaves adhesion, or by the slip
    /// speed and the rate of the force that adhesion would bear.
    fn take_line(&self, state: &mut Moving, (c, direction): (usize, f64), way: Way, by: &Dual, rate: &Dual) {
        let at = self.layout.contact(c);
        let mut flags = state.flags[c];
        let mut line = self.line.borrow_mut();
        line.clone_from_slice(&state.numbers[at..at + STICK_TIME]);
        let own = &line[..];
        let nothing = Dual::fixed(0.0, by.rates.len());
        let inputs: [&Dual; 11] = std::array::from_fn(|i| match i {
            9 => by,
            10 => rate,
            // Only what follows a line may depend on it.
            0..4 if !matches!(way, Way::Next(_)) => &nothing,
            _ => &own[i],
        });
        let before = flags;
        let parameters = self.parameters(by.rates.len());
        let numbers = &mut state.numbers[at..at + STICK_TIME];
        self.varied.ask(c, inputs, parameters, numbers, |law, z| {
            let mut memory = Memory {
                anchor: [z[4], z[5]],
                corner: [z[6], z[7]],
                released_at: before.released.then_some(z[8]),
                force_rate: z[10].abs(),
            };
            let law = law.toward(direction);
            let piece = match way {
                Way::Leave => law.leave(z[9], &mut memory),
                Way::Begin(balance) => law.begin(z[9], balance.into(), &mut memory),
                Way::Next(end) => {
                    let piece = Piece {
                        offset: z[0],
                        slope: z[1],
                        low: z[2],
                        high: z[3],
                        branch: before.branch,
                        reverses: before.reverses,
                    };
                    law.next(&piece, end, z[9], &mut memory)
                }
            };
            flags = Flags::of(&piece, &memory);
            line_of(&piece, &memory)
        });
        state.flags[c] = flags;
    }

    /// The lines of friction on which the contacts begin a motion from a state, along the directions of the parameters.
    pub(super) fn begun(&self, start: &State, contact_modes: &[ContactMode]) -> Moving {
        let directions = self.all_directions();
        let mut begun = start.without_derivatives(directions);
        let mut expansion = self.expansion();
        self.go(&begun, contact_modes, 0.0, &mut expansion);
        for (c, mode) in contact_modes.iter().enumerate() {
            let direction = mode.direction();
            if direction == 0.0 {
                continue;
            }
            let u = expansion.u(c);
            let rate = || self.if_stuck(start.without_derivatives(directions), contact_modes, c)[1].clone();
            let rate = self.felt_force_rate(c, directions, rate);
            let before = begun.clone();
            if start.flags[c].released && u.value <= begun.numbers[self.layout.contact(c) + LOW].value {
                let at_once = Dual::fixed(0.0, directions);
                let force = self.static_limit(c, direction, &at_once, || rate.clone());
                self.take_line(&mut begun, (c, direction), Way::Leave, &force, &at_once);
            } else {
                // The friction at which the slip speed would not change.
                let pull = expansion.slip_acceleration(c).value / self.frame.coupling(c, c);
                let balance = direction * expansion.force(c).value + pull;
                self.take_line(&mut begun, (c, direction), Way::Begin(balance), &u, &rate);
            }
            // Where rounding chooses another line, none is known.
            if begun.flags[c] != start.flags[c] {
                begun = before;
            }
        }
        begun
    }

    /// Make `after` the state after the event that ends a phase, given how the time of the event moves with the start.
    pub(super) fn state_after_event(&self, end: &PhaseEnd, event_shift: &Dual, after: &mut Moving) {
        let &PhaseEnd { phase, next, .. } = end;
        self.set_state_at_end(after, end);
        for (c, (mode, next)) in phase.contact_modes.iter().zip(next).enumerate() {
            if *mode == ContactMode::Stick {
                after.numbers[self.layout.contact(c) + STICK_TIME] = self.stick_time(end.start, c, end.tau);
            }
            let event = c == phase.contact && !matches!(phase.ending, Ending::Time | Ending::Section);
            if mode != next || event {
                self.contact_after_event(after, end, c);
            }
        }
        for number in &mut after.numbers {
            at_the_end(number, event_shift);
        }
        self.set_slip_speed_at_line_end(after, end);
        self.stop_stuck_masses(after, next);
    }

    /// How much later the guard vanishes, by its rate.
    pub(super) fn newton_step(guard: &Dual) -> f64 {
        -guard.value / guard.rates.last().copied().unwrap_or(0.0)
    }

    /// The derivative of the time of the event that ends a phase, −h′/ḣ.
    pub(super) fn event_time_derivative(guard: Dual) -> Dual {
        let rate = guard.rates.last().copied().unwrap_or(1.0);
        let mut derivative = guard * (-1.0 / rate);
        if let Some(along) = derivative.rates.last_mut() {
            *along = 0.0;
        }
        derivative
    }

    /// The slip speed at the end of a line of friction is that end, to the last digit.
    fn set_slip_speed_at_line_end(&self, after: &mut Moving, end: &PhaseEnd) {
        let &PhaseEnd {
            start, phase, next, ..
        } = end;
        let c = phase.contact;
        let (Some(ContactMode::Slip(direction)), Ending::Line(end @ (End::Low | End::High))) =
            (phase.contact_modes.get(c), phase.ending)
        else {
            return;
        };
        let contact = &self.varied.base.contacts[c];
        if contact.other.is_some() || next[c] == ContactMode::Stick {
            return;
        }
        let clock = Clock::at(after.numbers[0].value);
        let which = if end == End::High { HIGH } else { LOW };
        let u = start.numbers[self.layout.contact(c) + which].clone() * *direction;
        let drive = self.drives(clock, &after.numbers[0]).swap_remove(c);
        after.numbers[self.layout.v(contact.mass)] = drive - &u;
    }

    /// The memory and the line of friction of a contact after the event.
    fn contact_after_event(&self, after: &mut Moving, end: &PhaseEnd, c: usize) {
        let &PhaseEnd {
            start,
            phase,
            tau,
            expansion,
            next,
            ..
        } = end;
        let at = self.layout.contact(c);
        let directions = start.numbers[0].rates.len();
        let rate = || self.rate_if_stuck(end, c);
        let at_once = || Dual::fixed(0.0, directions);
        // That of the slip ahead.
        let ahead = (c, next[c].direction());
        match (phase.contact_modes[c], next[c]) {
            (_, ContactMode::Stick) => after.numbers[at + STICK_TIME] = at_once(),
            (ContactMode::Stick, _) => {
                let stick_time = self.stick_time(start, c, tau);
                let force = self.static_limit(c, ahead.1, &stick_time, || expansion.force_rate(c));
                after.numbers[at + STICK_TIME] = at_once();
                self.take_line(after, ahead, Way::Leave, &force, &at_once());
            }
            (ContactMode::Hold(_), _) => {
                let balance = if phase.ending == Ending::Line(End::High) {
                    f64::INFINITY
                } else {
                    f64::NEG_INFINITY
                };
                let rate = self.felt_force_rate(c, directions, rate);
                self.take_line(after, ahead, Way::Begin(balance), &expansion.u(c), &rate);
            }
            (ContactMode::Slip(_), ContactMode::Hold(_)) => {}
            (ContactMode::Slip(_), ContactMode::Slip(_)) => {
                let Ending::Line(end) = phase.ending else { return };
                let low = &start.numbers[at + LOW];
                if end == End::Low && low.value <= 0.0 {
                    let force = self.static_limit(c, ahead.1, &at_once(), rate);
                    self.take_line(after, ahead, Way::Leave, &force, &at_once());
                    return;
                }
                let u = match end {
                    End::Low => low,
                    End::High => &start.numbers[at + HIGH],
                    End::Reversal { .. } => &expansion.u(c),
                };
                // A law is told of it at a turn to rising slip speed alone ([`Memory`]).
                let rate = match end {
                    End::Reversal { rising: true } => self.felt_force_rate(c, directions, rate),
                    _ => at_once(),
                };
                self.take_line(after, ahead, Way::Next(end), u, &rate);
            }
        }
    }
}

/// How a contact comes to its next line of friction.
#[derive(Clone, Copy)]
enum Way {
    /// It breaks away.
    Leave,
    /// It begins to slip where friction of this size would keep its slip speed.
    Begin(f64),
    /// Its line ends.
    Next(End),
}

/// A number that grows with time, so much later.
pub(super) fn later(number: &Dual, tau: f64) -> Dual {
    let mut later = number.clone();
    grow(&mut later, tau);
    later
}

/// The same in its place.
pub(super) fn grow(number: &mut Dual, tau: f64) {
    number.value += tau;
    if let Some(rate) = number.rates.last_mut() {
        *rate = 1.0;
    }
}

/// Time along the phase is no direction of its own where the phase ends.
pub(super) fn at_the_end(number: &mut Dual, event_shift: &Dual) {
    let slope = number.rates.last().copied().unwrap_or(0.0);
    if slope != 0.0 {
        number.shift(slope, event_shift);
        if let Some(along) = number.rates.last_mut() {
            *along = 0.0;
        }
    }
}
