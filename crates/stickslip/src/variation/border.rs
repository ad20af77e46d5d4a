//! The borders of an event sequence: test functions that vanish where the real motion would take another one.

use super::saltation::{ArcEnd, settle};
use super::segment::{Course, Place};
use super::state::{Ending, HIGH, LOW, Moving, Phase};
use crate::dual::Dual;
use crate::law::End;

/// The test functions whose zeros are borders of an event sequence; positive inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Border {
    /// Least slip speed of an arc above the low end of its line.
    Low,
    /// Greatest slip speed of an arc below the high end.
    High,
    /// What adhesion bears beyond the force where an arc ends in adhesion.
    Entry,
    /// The force beyond what adhesion bears where the slip velocity crosses zero.
    Crossing,
    /// The least that adhesion bears beyond the force during a stick.
    Stick,
    /// How fast the slip speed falls where it reaches zero.
    Arrival,
}

/// A test function along a trail.
#[derive(Clone, Debug)]
pub struct Test {
    /// Which.
    pub border: Border,
    /// At which contact.
    pub contact: usize,
    /// On which arc.
    pub arc: usize,
    /// When, counted from the start of the arc.
    pub tau: f64,
    /// Its value and derivatives.
    pub value: Dual,
    /// What tells borders apart: for `Low` and `High` the speed at the end of the line; for `Entry` and `Crossing` the rate
    /// at which the size of the force that would hold the mass grows.
    pub detail: f64,
}

impl Course<'_> {
    /// The test functions inside an arc.
    pub(super) fn borders(&self, end: &ArcEnd, tests: &mut Vec<Test>) {
        if end.tau <= 0.0 {
            return;
        }
        let plain = end.start.values().still(1);
        let (mut places, mut last) = (Vec::new(), self.place());
        self.walk(&plain, &end.arc.phases, end.tau, &mut last, &mut |place| {
            places.push(place.clone());
        });
        places.push(last);
        for c in 0..self.layout.contacts {
            let mut before: Option<(f64, f64)> = None;
            for place in &mut places {
                // The last one ends where the arc does.
                let length = if place.begin + place.reach < end.tau {
                    place.reach
                } else {
                    (end.tau - place.begin) * (1.0 - 1e-9)
                };
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "a few dozen"
                )]
                let count = (length * self.frame.rate / 0.1).ceil().clamp(8.0, 1e4) as usize;
                for i in 0..=count {
                    // Where it begins an arc may have its extremum: that is not inside.
                    let share = if i == 0 && place.begin == 0.0 {
                        0.5
                    } else {
                        i as f64
                    };
                    let h = length * share / count as f64;
                    let mut watched = |h: f64| self.watched(&plain, end.arc.phases[c], c, place, h);
                    let now = (h, watched(h));
                    if let Some(earlier) = before.filter(|earlier| i > 0 && earlier.1 * now.1 < 0.0) {
                        let tau = root(&mut watched, earlier, now);
                        self.extremum(end, c, place.begin + tau, now.1 > 0.0, tests);
                    }
                    before = Some(now);
                }
            }
        }
    }

    /// What vanishes where a slip speed or a margin has an extremum.
    fn watched(&self, start: &Moving, phase: Phase, c: usize, place: &mut Place, h: f64) -> f64 {
        place.h = h;
        match phase {
            Phase::Slip(_) => place.turn(c).value,
            Phase::Stick => {
                let age = self.age(start, c, place.begin + h);
                self.room(c, &age, &place.force_rate(c), place.force(c)).rates[0]
            }
            Phase::Hold(_) => 1.0,
        }
    }

    fn extremum(&self, end: &ArcEnd, c: usize, tau: f64, least: bool, tests: &mut Vec<Test>) {
        let mut place = self.place();
        self.go(end.start, &end.arc.phases, tau, &mut place);
        match end.arc.phases[c] {
            Phase::Slip(_) => self.both_ends(end, c, tau, &still(place.u(c)), least, tests),
            _ if least => tests.push(Test {
                border: Border::Stick,
                contact: c,
                arc: end.index,
                tau,
                value: still(self.margin(end.start, c, tau, &place)),
                detail: 0.0,
            }),
            _ => {}
        }
    }

    /// The test functions where a slip velocity reaches zero; the end `moves`.
    pub(super) fn entry(&self, end: &ArcEnd, moves: &Dual, tests: &mut Vec<Test>) {
        let &ArcEnd { arc, tau, place, .. } = end;
        let c = arc.contact;
        if !matches!(arc.phases[c], Phase::Slip(_)) {
            return;
        }
        let sticks = end.next[c] == Phase::Stick;
        let settled = |mut number: Dual| {
            settle(&mut number, moves);
            number
        };
        let mut push = |border, value: Dual, detail| {
            tests.push(Test {
                border,
                contact: c,
                arc: end.index,
                tau,
                value: settled(value),
                detail,
            });
        };
        match arc.ending {
            Ending::Line(End::Turn { rising }) => {
                self.both_ends(end, c, tau, &settled(place.u(c)), rising, tests);
            }
            Ending::Section if sticks => push(Border::Low, place.u(c), 0.0),
            Ending::Line(End::Low) if end.start.numbers[self.layout.contact(c) + LOW].value <= 0.0 => {
                let [force, rate] = self.if_stuck(&end.moved, &arc.phases, c);
                let detail = rate.value * force.value.signum();
                let at_once = Dual::fixed(0.0, moves.rates.len());
                let margin = self.room(c, &at_once, &rate, force);
                if sticks {
                    push(Border::Entry, margin, detail);
                } else {
                    push(Border::Crossing, -margin, detail);
                }
                push(Border::Arrival, -place.turn(c), detail);
            }
            _ => {}
        }
    }

    /// How far an extremum of a slip speed lies from both ends of its line: from the one it may reach, and from the one
    /// behind it, where the arc itself may vanish.
    fn both_ends(&self, end: &ArcEnd, c: usize, tau: f64, u: &Dual, least: bool, tests: &mut Vec<Test>) {
        let at = self.layout.contact(c);
        let (low, high) = (&end.start.numbers[at + LOW], &end.start.numbers[at + HIGH]);
        let mut push = |border, value, bound: &Dual| {
            tests.push(Test {
                border,
                contact: c,
                arc: end.index,
                tau,
                value,
                detail: bound.value,
            });
        };
        // The end it may reach comes first.
        if least {
            push(Border::Low, u.clone() - low, low);
            push(Border::High, high.clone() - u, high);
        } else {
            push(Border::High, high.clone() - u, high);
            if low.value > 0.0 {
                push(Border::Low, u.clone() - low, low);
            }
        }
    }
}

/// A number at an extremum, where time does not count.
fn still(mut number: Dual) -> Dual {
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
