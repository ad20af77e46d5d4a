//! The borders of an event sequence: test functions that vanish where the real motion would take another one.

use super::segment::Frame;
use super::state::{Arc, Ending, LANES, LINE, Phase, State};
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
#[derive(Clone, Copy, Debug)]
pub struct Test {
    /// Which.
    pub border: Border,
    /// On which arc.
    pub arc: usize,
    /// When, counted from the start of the arc.
    pub tau: f64,
    /// Its value and derivatives.
    pub value: Dual<LANES>,
    /// What tells borders apart: for `Low` and `High` the speed at the end of the line; for `Entry` and `Crossing` the rate
    /// at which the size of the force that would hold the mass grows.
    pub detail: f64,
}

impl Frame<'_, LANES> {
    /// The test functions inside an arc.
    pub(super) fn borders(
        &self,
        state: &State<LANES>,
        arc: &Arc,
        index: usize,
        end: f64,
        tests: &mut Vec<Test>,
    ) {
        let timed = Frame::<1>::new(self.varied);
        let plain: State<1> = state.as_seeds();
        // What has an extremum where its rate vanishes.
        let watched = |tau: f64| match arc.phase {
            Phase::Slip(direction) => -direction * timed.motion(&plain, arc.phase, Dual::fixed(tau))[2].value,
            Phase::Stick => {
                let tau = Dual::along(tau, 0);
                let [x, ..] = timed.motion(&plain, arc.phase, tau);
                timed.margin(&plain, plain.numbers[0] + tau, x).rates[0]
            }
            Phase::Hold(_) => 1.0,
        };
        if end <= 0.0 {
            return;
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a few hundred"
        )]
        let count = (end * timed.rate / 0.1).ceil().clamp(8.0, 1e5) as usize;
        let at = |i: usize| end * i as f64 / count as f64;
        let mut before = watched(at(1) * 0.5);
        let mut low = at(1) * 0.5;
        for i in 1..=count {
            let high = if i == count { end * (1.0 - 1e-9) } else { at(i) };
            let after = watched(high);
            if before * after < 0.0 {
                let rising = after > 0.0;
                let tau = root(&watched, (low, before), (high, after));
                self.extremum(state, arc, index, tau, rising, tests);
            }
            (low, before) = (high, after);
        }
    }

    fn extremum(
        &self,
        state: &State<LANES>,
        arc: &Arc,
        index: usize,
        tau: f64,
        least: bool,
        tests: &mut Vec<Test>,
    ) {
        let [x, v, _] = self.motion(state, arc.phase, Dual::fixed(tau));
        match arc.phase {
            Phase::Slip(direction) => {
                both_ends(state, (index, tau), self.speed(direction, v), least, tests);
            }
            _ if least => tests.push(Test {
                border: Border::Stick,
                arc: index,
                tau,
                value: self.margin(state, state.numbers[0] + Dual::fixed(tau), x),
                detail: 0.0,
            }),
            _ => {}
        }
    }

    /// The test functions where the slip velocity reaches zero.
    #[expect(clippy::too_many_arguments, reason = "the arc and what lies at both its ends")]
    pub(super) fn entry(
        &self,
        before: &State<LANES>,
        after: &State<LANES>,
        arc: &Arc,
        index: usize,
        tau: Dual<LANES>,
        next: Phase,
        tests: &mut Vec<Test>,
    ) {
        let Phase::Slip(direction) = arc.phase else { return };
        if let Ending::Line(End::Turn { rising }) = arc.ending {
            let u = self.speed(direction, after.numbers[2]);
            both_ends(before, (index, tau.value), u, rising, tests);
            return;
        }
        if arc.ending == Ending::Section && next == Phase::Stick {
            let u = self.speed(direction, self.motion(before, arc.phase, tau)[1]);
            tests.push(Test {
                border: Border::Low,
                arc: index,
                tau: tau.value,
                value: u,
                detail: 0.0,
            });
        }
        let at_rest = self.speed(direction, after.numbers[2]).value == 0.0;
        if arc.ending != Ending::Line(End::Low) || !at_rest {
            return;
        }
        let (force, rate) = self.holding(after.numbers[0], after.numbers[1], self.drive);
        let margin = self.bears(Dual::fixed(0.0), rate) - force.abs();
        let (border, value) = if next == Phase::Stick {
            (Border::Entry, margin)
        } else {
            (Border::Crossing, -margin)
        };
        let detail = rate.value * force.value.signum();
        let falls = self.motion(before, arc.phase, tau)[2] * direction;
        for (border, value) in [(border, value), (Border::Arrival, falls)] {
            tests.push(Test {
                border,
                arc: index,
                tau: tau.value,
                value,
                detail,
            });
        }
    }
}

/// How far an extremum of the slip speed lies from both ends of its line: from the one it may reach, and from the one
/// behind it, where the arc itself may vanish.
fn both_ends(
    state: &State<LANES>,
    (arc, tau): (usize, f64),
    u: Dual<LANES>,
    least: bool,
    tests: &mut Vec<Test>,
) {
    let (low, high) = (state.numbers[LINE + 2], state.numbers[LINE + 3]);
    let mut push = |border, value, end: Dual<LANES>| {
        tests.push(Test {
            border,
            arc,
            tau,
            value,
            detail: end.value,
        });
    };
    // The end it may reach comes first.
    if least {
        push(Border::Low, u - low, low);
        push(Border::High, high - u, high);
    } else {
        push(Border::High, high - u, high);
        if low.value > 0.0 {
            push(Border::Low, u - low, low);
        }
    }
}

/// The root of `function` in a bracket (Illinois).
fn root(function: &impl Fn(f64) -> f64, (mut a, mut fa): (f64, f64), (mut b, mut fb): (f64, f64)) -> f64 {
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
