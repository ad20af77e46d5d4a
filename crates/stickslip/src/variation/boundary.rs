//! The boundaries of an event sequence: test functions that vanish where the real motion would take another one.

use super::saltation::{PhaseEnd, at_the_end};
use super::segment::{Expansion, VariedMotion};
use super::state::{ContactMode, Ending, HIGH, LOW, Moving};
use crate::dual::Dual;
use crate::law::End;

/// The test functions whose zeros are boundaries of an event sequence; positive inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Boundary {
    /// Least slip speed of a phase above the low end of its line.
    Low,
    /// Greatest slip speed of a phase below the high end.
    High,
    /// The static limit beyond the force where a phase ends in adhesion.
    Entry,
    /// The force beyond the static limit where the slip velocity crosses zero.
    Crossing,
    /// The least that adhesion bears beyond the force during a stick.
    Stick,
    /// How fast the slip speed falls where it reaches zero.
    Arrival,
}

/// A test function along an event sequence.
#[derive(Clone, Debug)]
pub struct Test {
    /// Which.
    pub boundary: Boundary,
    /// At which contact.
    pub contact: usize,
    /// On which phase.
    pub phase: usize,
    /// When, counted from the start of the phase.
    pub tau: f64,
    /// Its value and derivatives.
    pub value: Dual,
    /// What tells boundaries apart: for `Low` and `High` the speed at the end of the line; for `Entry` and `Crossing` the rate
    /// at which the size of the force that would hold the mass grows.
    pub detail: f64,
}

impl VariedMotion<'_> {
    /// The test functions inside a phase.
    pub(super) fn boundaries(&self, end: &PhaseEnd, tests: &mut Vec<Test>) {
        if end.tau <= 0.0 {
            return;
        }
        let plain = end.start.values().without_derivatives(1);
        let (mut expansions, mut last) = (Vec::new(), self.expansion());
        self.walk(
            &plain,
            &end.phase.contact_modes,
            end.tau,
            &mut last,
            &mut |expansion| {
                expansions.push(expansion.clone());
            },
        );
        expansions.push(last);
        for c in 0..self.layout.contacts {
            let mut before: Option<(f64, f64)> = None;
            for expansion in &mut expansions {
                // The last one ends where the phase does.
                let length = if expansion.begin + expansion.reach < end.tau {
                    expansion.reach
                } else {
                    (end.tau - expansion.begin) * (1.0 - 1e-9)
                };
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "a few dozen"
                )]
                let count = (length * expansion.pace(&self.frame) / 0.1)
                    .ceil()
                    .clamp(8.0, 1e4) as usize;
                for i in 0..=count {
                    // Where it begins a phase may have its extremum: that is not inside.
                    let share = if i == 0 && expansion.begin == 0.0 {
                        0.5
                    } else {
                        i as f64
                    };
                    let h = length * share / count as f64;
                    let mut watched =
                        |h: f64| self.watched(&plain, end.phase.contact_modes[c], c, expansion, h);
                    let now = (h, watched(h));
                    if let Some(earlier) = before.filter(|earlier| i > 0 && earlier.1 * now.1 < 0.0) {
                        let tau = root(&mut watched, earlier, now);
                        self.extremum(end, c, expansion.begin + tau, now.1 > 0.0, tests);
                    }
                    before = Some(now);
                }
            }
        }
    }

    /// What vanishes where a slip speed or a margin has an extremum.
    fn watched(
        &self,
        start: &Moving,
        contact_mode: ContactMode,
        c: usize,
        expansion: &mut Expansion,
        h: f64,
    ) -> f64 {
        expansion.h = h;
        match contact_mode {
            ContactMode::Slip(_) => expansion.slip_acceleration(c).value,
            ContactMode::Stick => self.static_margin(start, c, expansion.begin + h, expansion).rates[0],
            ContactMode::Hold(_) => 1.0,
        }
    }

    fn extremum(&self, end: &PhaseEnd, c: usize, tau: f64, least: bool, tests: &mut Vec<Test>) {
        let mut expansion = self.expansion();
        self.go(end.start, &end.phase.contact_modes, tau, &mut expansion);
        match end.phase.contact_modes[c] {
            ContactMode::Slip(_) => self.both_ends(end, c, tau, &at_extremum(expansion.u(c)), least, tests),
            _ if least => tests.push(Test {
                boundary: Boundary::Stick,
                contact: c,
                phase: end.index,
                tau,
                value: at_extremum(self.static_margin(end.start, c, tau, &expansion)),
                detail: 0.0,
            }),
            _ => {}
        }
    }

    /// The test functions where a slip velocity reaches zero; given how the time of that event moves with the start.
    pub(super) fn entry(&self, end: &PhaseEnd, event_shift: &Dual, tests: &mut Vec<Test>) {
        let &PhaseEnd {
            phase,
            tau,
            expansion,
            ..
        } = end;
        let c = phase.contact;
        if !matches!(phase.contact_modes[c], ContactMode::Slip(_)) {
            return;
        }
        let sticks = end.next[c] == ContactMode::Stick;
        let settled = |mut number: Dual| {
            at_the_end(&mut number, event_shift);
            number
        };
        let mut push = |boundary, value: Dual, detail| {
            tests.push(Test {
                boundary,
                contact: c,
                phase: end.index,
                tau,
                value: settled(value),
                detail,
            });
        };
        match phase.ending {
            Ending::Line(End::Reversal { rising }) => {
                self.both_ends(end, c, tau, &settled(expansion.u(c)), rising, tests);
            }
            Ending::Section if sticks => push(Boundary::Low, expansion.u(c), 0.0),
            // A section at the least slip speed: no extremum inside the phase tells how near it comes to the end of its line.
            Ending::Section
                if expansion
                    .slip_acceleration(c)
                    .rates
                    .last()
                    .is_some_and(|&jerk| jerk > 0.0) =>
            {
                self.both_ends(end, c, tau, &settled(expansion.u(c)), true, tests);
            }
            Ending::Line(End::Low) if end.start.numbers[self.layout.contact(c) + LOW].value <= 0.0 => {
                let [force, rate] = self.if_stuck(self.state_at_end(end), &phase.contact_modes, c);
                let detail = rate.value * force.value.signum();
                let at_once = Dual::fixed(0.0, event_shift.rates.len());
                let normal = self.normal(c, || self.state_at_end(end));
                let margin = self.static_limit_beyond((c, normal), &at_once, || rate, force);
                if sticks {
                    push(Boundary::Entry, margin, detail);
                } else {
                    push(Boundary::Crossing, -margin, detail);
                }
                push(Boundary::Arrival, -expansion.slip_acceleration(c), detail);
            }
            _ => {}
        }
    }

    /// How far an extremum of a slip speed lies from both ends of its line: from the one it may reach, and from the one
    /// behind it, where the phase itself may vanish.
    fn both_ends(&self, end: &PhaseEnd, c: usize, tau: f64, u: &Dual, least: bool, tests: &mut Vec<Test>) {
        let at = self.layout.contact(c);
        let (low, high) = (&end.start.numbers[at + LOW], &end.start.numbers[at + HIGH]);
        let mut push = |boundary, value, bound: &Dual| {
            tests.push(Test {
                boundary,
                contact: c,
                phase: end.index,
                tau,
                value,
                detail: bound.value,
            });
        };
        // The end it may reach comes first.
        if least {
            push(Boundary::Low, u.clone() - low, low);
            push(Boundary::High, high.clone() - u, high);
        } else {
            push(Boundary::High, high.clone() - u, high);
            if low.value > 0.0 || u.value < low.value {
                push(Boundary::Low, u.clone() - low, low);
            }
        }
    }
}

/// A number at an extremum, where time does not count.
fn at_extremum(mut number: Dual) -> Dual {
    if let Some(along) = number.rates.last_mut() {
        *along = 0.0;
    }
    number
}

/// The root of `function` in a bracket (Illinois).
fn root(
    function: &mut impl FnMut(f64) -> f64,
    (mut a, mut fa): (f64, f64),
    (mut b, mut fb): (f64, f64),
) -> f64 {
    for _ in 0..100 {
        let c = (a * fb - b * fa) / (fb - fa);
        let fc = function(c);
        if fc == 0.0 || (b - a).abs() <= 1e-15 * c.abs() {
            return c;
        }
        if fc * fb < 0.0 {
            (a, fa) = (b, fb);
        } else {
            fa *= 0.5;
        }
        if (c - b).abs() <= 1e-16 * c.abs() {
            return c;
        }
        (b, fb) = (c, fc);
    }
    b
}
