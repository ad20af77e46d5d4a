//! Applies to every contact, at the start and after every event, what `who_sticks` has decided, and where on its law it then is.

use super::who_sticks::{ContactProblem, toward};
use super::{ContactState, Loop, SPEED_ROUNDING};
use crate::flow::taylor::{ForceLine, VectorField, holding};
use crate::law::{Friction, Rest};
use crate::mode::Kind;

/// What led to a new combination of modes.
pub(super) struct Passage {
    /// Contacts whose slip speed reached zero just now.
    pub(super) arrived: Vec<usize>,
    /// The contact whose adhesion broke, and the force it reached; of infinite size where forces jumped beyond its static limit.
    pub(super) released: Option<(usize, f64)>,
    /// The contact whose slip had begun with no slope and went back at once: within rounding it never began.
    pub(super) returned: Option<usize>,
    /// The rates of the friction forces just before.
    pub(super) rates: Vec<f64>,
    /// At the start nothing stuck before.
    pub(super) starting: bool,
}

impl Loop<'_> {
    /// Modes in which the motion starts.
    pub(super) fn start(&mut self) {
        // The start is known to rounding, not to the error with which an event was found.
        self.zero_share = SPEED_ROUNDING;
        self.motion.aim(&self.frame, self.clock);
        self.measure_scale();
        let mut required = Vec::new();
        self.motion.required(&self.frame, &self.x, &self.v, &mut required);
        let mut at_rest = Vec::new();
        let mut force = vec![0.0; self.contacts.len()];
        for c in 0..self.contacts.len() {
            let w = self.motion.slip(&self.frame, c, &self.v);
            if self.frame.normals[c].is_some() && self.normal(c) <= self.faint(c) {
                (self.contacts[c].direction, self.contacts[c].separated) = (w.signum(), true);
                continue;
            }
            if w.abs() <= SPEED_ROUNDING * self.scale {
                at_rest.push(c);
                continue;
            }
            let direction = w.signum();
            let others: f64 = (0..c)
                .map(|other| self.frame.coupling(c, other) * force[other])
                .sum();
            let balance = direction * (required[c] - others) / self.frame.coupling(c, c);
            let rate = self.rate_if_stuck(c);
            let between = self.branch_gap(c, direction, w.abs());
            let contact = &mut self.contacts[c];
            contact.memory.force_rate = rate;
            contact.direction = direction;
            contact.between = between.filter(|[falling, rising]| (falling..rising).contains(&&balance));
            contact.kept = if contact.between.is_some() { w } else { 0.0 };
            let law = self.laws[c].toward(direction);
            contact.piece = law.begin(w.abs(), balance, &mut contact.memory);
            force[c] = self.friction(c, w.abs());
        }
        // Whoever rests there has arrived just now; the start is no event.
        let rates = vec![0.0; self.contacts.len()];
        self.set_contact_states(&Passage {
            arrived: at_rest,
            released: None,
            returned: None,
            rates,
            starting: true,
        });
        self.events.clear();
        self.work.events = 0;
    }

    /// |dF/dt| that adhesion would feel if the contact stuck now; 0 where its law does not ask.
    pub(super) fn rate_if_stuck(&self, c: usize) -> f64 {
        if !self.laws[c].feels_force_rate() {
            return 0.0;
        }
        let mut force_lines: Vec<ForceLine> = self.contacts.iter().map(ContactState::force_line).collect();
        force_lines[c] = ForceLine::STUCK;
        let held = self.frame.held(holding(&force_lines));
        let (mut motion, mut v) = (self.motion.clone(), self.v.clone());
        motion.stop(&self.frame, &held, &mut v);
        let field = VectorField {
            frame: &self.frame,
            laws: &self.laws,
            force_lines: &force_lines,
            held: &held,
        };
        motion.expand(&field, &self.x, &v);
        motion.force.of(1)[c].abs()
    }

    /// Decide for all contacts with zero slip velocity at once.
    pub(super) fn set_contact_states(&mut self, passage: &Passage) {
        let mut new = vec![false; self.contacts.len()];
        for &c in &passage.arrived {
            new[c] = true;
        }
        let is_new = |c: usize| new[c];
        let zero: Vec<usize> = (0..self.contacts.len())
            .filter(|&c| self.contacts[c].direction == 0.0 && !passage.starting || is_new(c))
            .collect();
        if zero.is_empty() {
            return;
        }
        let all = self.frame.held(zero.clone());
        self.motion.stop(&self.frame, &all, &mut self.v);
        // The static limit, and what slip would start with.
        let of_law: Vec<[f64; 2]> = zero
            .iter()
            .map(|&c| {
                let rest = if is_new(c) {
                    Rest::new(0.0, self.rate_if_stuck(c))
                } else {
                    Rest::new(self.stick_time(c), passage.rates[c].abs())
                };
                [-1.0, 1.0].map(|direction| self.laws[c].toward(direction).static_limit(rest))
            })
            .collect();
        let normal: Vec<f64> = zero.iter().map(|&c| self.normal(c).max(0.0)).collect();
        let pressed = of_law.iter().zip(&normal);
        let limit: Vec<[f64; 2]> = pressed
            .map(|(limits, normal)| limits.map(|limit| normal * limit))
            .collect();
        let kinetic: Vec<[f64; 2]> = (0..zero.len())
            .map(|row| {
                [-1.0, 1.0].map(|direction| {
                    let law = self.laws[zero[row]].toward(direction);
                    let static_limit = toward(of_law[row], direction);
                    let piece = law.leave(static_limit, &mut self.contacts[zero[row]].memory.clone());
                    normal[row] * law.force(&piece, 0.0)
                })
            })
            .collect();
        let mut required = Vec::new();
        self.motion.required(&self.frame, &self.x, &self.v, &mut required);
        // The place of each among those with zero slip velocity.
        let mut row_of = vec![None; self.contacts.len()];
        for (row, &c) in zero.iter().enumerate() {
            row_of[c] = Some(row);
        }
        for (c, contact) in self.contacts.iter().enumerate() {
            if row_of[c].is_some() {
                continue;
            }
            let speed = contact.direction * self.motion.slip(&self.frame, c, &self.v);
            let force = self.friction(c, speed.max(0.0));
            self.frame.relieve(&mut required, c, force);
        }
        let row_of = |c: usize| row_of[c].unwrap_or(0);
        let question = ContactProblem {
            frame: &self.frame,
            zero: &zero,
            limit: &limit,
            kinetic: &kinetic,
            required,
            drives: self.motion.drives(),
            zero_acceleration: self.zero_share * self.acceleration,
            released: passage.released.map(|(c, force)| (row_of(c), force.signum())),
            returned: passage.returned.map(row_of),
        };
        let answer = question.answer();
        let idle: Vec<bool> = (0..zero.len()).map(|row| question.idle(&answer, row)).collect();
        for (row, &c) in zero.iter().enumerate() {
            let idle = idle[row];
            let direction = if idle { 0.0 } else { answer[row] };
            let static_limit = toward(limit[row], answer[row]);
            self.contacts[c].pinned = if idle { answer[row] * static_limit } else { 0.0 };
            if !is_new(c) && direction == 0.0 {
                continue;
            }
            let stick_time = self.stick_time(c);
            let was = self.friction(c, 0.0);
            let contact = &mut self.contacts[c];
            contact.direction = direction;
            contact.sense = 0.0;
            contact.at_reversal = false;
            if direction == 0.0 {
                contact.stuck_since = self.clock;
                self.tell(Kind::Capture, c, was);
                continue;
            }
            contact.piece = self.laws[c]
                .toward(direction)
                .leave(toward(of_law[row], direction), &mut contact.memory);
            // Adhesion that broke at the force slip starts with, within rounding: the slip velocity leaves zero with no slope.
            let rounding = SPEED_ROUNDING * (static_limit + self.acceleration / self.frame.coupling(c, c));
            contact.at_reversal = toward(kinetic[row], direction) >= static_limit - rounding;
            if is_new(c) {
                self.tell(Kind::Crossing, c, was);
            } else {
                // What held it; where forces jumped and asked for more than it can bear, what it can bear.
                let broken_by = passage
                    .released
                    .filter(|&(released, force)| released == c && force.is_finite());
                self.tell(
                    Kind::Release,
                    c,
                    broken_by.map_or(static_limit * direction, |(_, force)| force),
                );
                if let Some(event) = self.events.last_mut() {
                    (event.stick_time, event.force_rate) = (stick_time, passage.rates[c] * direction);
                }
            }
        }
    }
}
