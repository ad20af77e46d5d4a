//! The derivative of a segment in closed form: one mass on one drive, while friction is linear in the slip speed.

use std::rc::Rc;

use super::saltation::grow;
use super::state::{ContactMode, Layout, Moving};
use super::varied::{Parameter, Varied, difference};
use crate::clock::Clock;
use crate::dual::Dual;
use crate::elementary::{exp, sin_cos};
use crate::harmonic::{Harmonic, MOST_HARMONICS};
use crate::system::System;

/// Numbers of the system: mass, damping, stiffness, drive velocity; then amplitude, frequency and phase of every force.
const SYSTEM: usize = 4;
/// Numbers of the state: position, velocity, time, offset and slope of the line of friction. They come first.
const STATE: usize = 5;
/// The most of both.
const MOST_SLOPES: usize = STATE + SYSTEM + 3 * MOST_HARMONICS;
/// (γ/ω)² up to which slip goes in closed form. Beyond critical damping the slow and the fast exponential cancel, which costs up
/// to γ/ω roundings of the largest term.
const MOST_OVERDAMPED: f64 = 1e4;
/// Below this ratio of its dynamic stiffness to the static one a force meets a resonance, which costs digits.
const RESONANT_STIFFNESS_RATIO: f64 = 0.05;

/// The oscillator behind a system, and how its numbers change with each parameter.
pub(super) struct Closed {
    /// Mass, damping, stiffness, drive velocity.
    system: [f64; SYSTEM],
    /// These, then amplitude, frequency and phase of every force.
    numbers: Vec<f64>,
    /// For each number the directions of the parameters that change it, and how much.
    rates: Vec<Vec<(usize, f64)>>,
}

/// A motion at a time, with derivatives; the last axis is the time along the phase. Of its contact only what is asked for is found.
#[derive(Clone)]
pub(super) struct Moved {
    closed: Rc<Closed>,
    t: Dual,
    pub(super) x: Dual,
    pub(super) v: Dual,
    /// Of slip, 0 while it sticks.
    direction: f64,
    /// Offset and slope of the line of friction.
    line: [Dual; 2],
}

const LAYOUT: Layout = Layout {
    masses: 1,
    contacts: 1,
};

/// The numbers of a system that is one mass on one drive of constant velocity, none for another.
fn numbers(system: &System) -> Option<Vec<f64>> {
    let [contact] = &system.contacts[..] else {
        return None;
    };
    let drive = &contact.drive_velocity;
    let plain = system.masses() == 1
        && system.springs.is_empty()
        && contact.other.is_none()
        && contact.normal_force.is_none()
        && drive.harmonics.is_empty()
        && drive.nodes.is_empty()
        && system.forcing.len() <= MOST_HARMONICS;
    plain.then(|| {
        let first = [
            system.mass[0][0],
            system.damping[0][0],
            system.stiffness[0][0],
            drive.velocity,
        ];
        let forces = system
            .forcing
            .iter()
            .flat_map(|force| [force.amplitude, force.frequency, force.phase]);
        first.into_iter().chain(forces).collect()
    })
}

impl Closed {
    pub(super) fn of(varied: &Varied) -> Option<Self> {
        let own = numbers(&varied.base)?;
        let mut rates = vec![Vec::new(); own.len()];
        for (parameter, axis) in varied.parameters.iter().zip(LAYOUT.width()..) {
            let Parameter::System(around, step) = parameter else {
                continue;
            };
            let [Some(a), Some(b), Some(c), Some(d)] = around.each_ref().map(numbers) else {
                return None;
            };
            for (i, rates) in rates.iter_mut().enumerate() {
                let rate = difference([a[i], b[i], c[i], d[i]], *step);
                if rate != 0.0 {
                    rates.push((axis, rate));
                }
            }
        }
        Some(Self {
            system: *own.first_chunk()?,
            numbers: own,
            rates,
        })
    }

    /// Add `slope` times what the parameters change of a number of the system.
    fn shift(&self, number: &mut Dual, slope: f64, which: usize) {
        // Without directions for them only time counts.
        if number.rates.len() > 1 {
            for &(axis, rate) in &self.rates[which] {
                number.rates[axis] += slope * rate;
            }
        }
    }

    /// The drive velocity.
    pub(super) fn drive(&self, directions: usize) -> Dual {
        let mut drive = Dual::fixed(self.numbers[DRIVE], directions);
        self.shift(&mut drive, 1.0, DRIVE);
        drive
    }

    /// Every force at a time: amplitude and frequency, its wave of the amplitude 1, and that by the angle.
    fn waves(&self, t: f64) -> impl Iterator<Item = [f64; 4]> {
        let clock = Clock::at(t);
        self.numbers[SYSTEM..].chunks_exact(3).map(move |force| {
            let (cos, odd) = Harmonic::new(1.0, force[1], force[2]).quadratures(clock);
            [force[0], force[1], cos, odd]
        })
    }

    /// The forcing at a time, or its rate.
    fn forcing(&self, t: &Dual, rate: bool) -> Dual {
        let mut force = Dual::fixed(0.0, t.rates.len());
        let mut along = 0.0;
        for ([amplitude, frequency, cos, odd], first) in self.waves(t.value).zip((SYSTEM..).step_by(3)) {
            let (wave, turned) = (amplitude * cos, amplitude * odd);
            let (value, slope, by) = if rate {
                let by_frequency = turned - frequency * t.value * wave;
                let by = [frequency * odd, by_frequency, -frequency * wave];
                (frequency * turned, -(frequency * frequency * wave), by)
            } else {
                (wave, frequency * turned, [cos, t.value * turned, turned])
            };
            force.value += value;
            along += slope;
            for (slope, which) in by.into_iter().zip(first..) {
                self.shift(&mut force, slope, which);
            }
        }
        if !self.numbers[SYSTEM..].is_empty() {
            force.shift(along, t);
        }
        force
    }

    /// The force of the contact while it sticks at `x`.
    fn holding_force(&self, x: &Dual, t: &Dual) -> Dual {
        let [_, damping, stiffness, drive] = self.system;
        let mut force = -self.forcing(t, false);
        force.value += damping * drive + stiffness * x.value;
        force.shift(stiffness, x);
        for (slope, which) in [(damping, DRIVE), (drive, DAMPING), (x.value, STIFFNESS)] {
            self.shift(&mut force, slope, which);
        }
        force
    }

    /// Its rate.
    pub(super) fn holding_rate(&self, t: &Dual) -> Dual {
        let [_, _, stiffness, drive] = self.system;
        let mut rate = -self.forcing(t, true);
        rate.value += stiffness * drive;
        for (slope, which) in [(stiffness, DRIVE), (drive, STIFFNESS)] {
            self.shift(&mut rate, slope, which);
        }
        rate
    }

    /// The force of the contact and its rate while it sticks at `x`.
    pub(super) fn holding(&self, x: &Dual, t: &Dual) -> [Dual; 2] {
        [self.holding_force(x, t), self.holding_rate(t)]
    }

    /// To the motion `tau` from the start of a phase; to none where the closed form would lose digits, or is none.
    pub(super) fn go(
        self: &Rc<Self>,
        start: &Moving,
        contact_mode: ContactMode,
        tau: f64,
        moved: &mut Option<Moved>,
    ) {
        let at = LAYOUT.contact(0);
        let [t, x, v, offset, slope] =
            [0, LAYOUT.x(0), LAYOUT.v(0), at, at + 1].map(|number| &start.numbers[number]);
        let directions = t.rates.len();
        let there = moved.get_or_insert_with(|| Moved {
            closed: Rc::clone(self),
            t: t.clone(),
            x: x.clone(),
            v: v.clone(),
            direction: 0.0,
            line: [offset.clone(), slope.clone()],
        });
        there.direction = contact_mode.direction();
        there.t.clone_from(t);
        grow(&mut there.t, tau);
        match contact_mode {
            ContactMode::Stick => {
                there.v = self.drive(directions);
                there.x.clone_from(x);
                there.x.value += tau * there.v.value;
                there.x.shift(tau, &there.v);
            }
            ContactMode::Slip(direction) => {
                let own = [x, v, t, offset, slope];
                let Some(slipped) = self.slip(own.map(|number| number.value), direction, tau) else {
                    *moved = None;
                    return;
                };
                for (number, Slope { value, slopes }) in [&mut there.x, &mut there.v].into_iter().zip(slipped)
                {
                    *number = Dual::fixed(value, directions);
                    if directions > 1 {
                        for (from, slope) in own.into_iter().zip(slopes) {
                            number.shift(slope, from);
                        }
                        for (which, slope) in slopes[STATE..STATE + self.numbers.len()].iter().enumerate() {
                            self.shift(number, *slope, which);
                        }
                    }
                }
                there.line[0].clone_from(offset);
                there.line[1].clone_from(slope);
                there.v.rates[directions - 1] = there.acceleration_now();
            }
            ContactMode::Hold(_) => {
                *moved = None;
                return;
            }
        }
        there.x.rates[directions - 1] = there.v.value;
    }

    /// Position and velocity at the end of a slip, with their derivatives by the numbers of the state and of the system.
    fn slip(&self, own: [f64; STATE], direction: f64, tau: f64) -> Option<[Slope; 2]> {
        let [x0, v0, t0, offset, slope] = own;
        let clock = Clock::at(t0);
        let [mass, damping, stiffness, drive] = self.system;
        let drag = damping + slope;
        let (gamma, natural) = (0.5 * drag / mass, stiffness / mass);
        if !(stiffness > 0.0 && gamma * gamma < MOST_OVERDAMPED * natural) {
            return None;
        }
        let [free, by_gamma, by_natural] = Free::of(gamma, natural, tau);
        // Position and velocity of the equilibrium and the forced motion, at the start and at the end.
        let mut start = [Slope::NOTHING, Slope::NOTHING];
        let mut end = [Slope::NOTHING, Slope::NOTHING];
        let rest = (direction * offset + slope * drive) / stiffness;
        for [position, _] in [&mut start, &mut end] {
            position.value = rest;
            for (i, share) in [
                (OFFSET, direction),
                (SLOPE, drive),
                (STATE + STIFFNESS, -rest),
                (STATE + DRIVE, slope),
            ] {
                position.slopes[i] = share / stiffness;
            }
        }
        for (force, first) in self.numbers[SYSTEM..]
            .chunks_exact(3)
            .zip((STATE + SYSTEM..).step_by(3))
        {
            let harmonic = Harmonic::new(1.0, force[1], force[2]);
            let frequency = force[1];
            let dynamic = Complex(stiffness - mass * frequency * frequency, drag * frequency);
            if dynamic.size() < RESONANT_STIFFNESS_RATIO * stiffness {
                return None;
            }
            let (even, odd) = harmonic.quadratures(clock);
            let answer = dynamic.inverse();
            let unit = Complex(even, -odd).times(answer);
            let (sin, cos) = sin_cos(frequency * tau);
            for (moved, unit, time) in [
                (&mut start, unit, clock.high),
                (&mut end, unit.times(Complex(cos, sin)), clock.high + tau),
            ] {
                let wave = unit.scaled(force[0]);
                let given = wave.times(answer);
                // By the frequency that the answer sees; its angle grows with time beside it.
                let detuned = given.times(Complex(2.0 * mass * frequency, -drag));
                let parts = [
                    (first, unit),
                    (
                        first + 1,
                        Complex(detuned.0 - time * wave.1, detuned.1 + time * wave.0),
                    ),
                    (first + 2, wave.turned()),
                    (TIME, wave.turned().scaled(frequency)),
                    (STATE + MASS, given.scaled(frequency * frequency)),
                    (STATE + DAMPING, given.turned().scaled(-frequency)),
                    (SLOPE, given.turned().scaled(-frequency)),
                    (STATE + STIFFNESS, given.scaled(-1.0)),
                ];
                let [position, velocity] = moved;
                position.value += wave.0;
                velocity.value += wave.turned().0 * frequency;
                for (i, part) in parts {
                    position.slopes[i] += part.0;
                    velocity.slopes[i] += part.turned().0 * frequency;
                }
                velocity.slopes[first + 1] += wave.turned().0;
            }
        }
        let [apart, faster] = [x0 - start[0].value, v0 - start[1].value];
        let moved = [0, 1].map(|which| {
            let mut moved = Slope::NOTHING;
            let [from_apart, from_faster] = free[which];
            moved.value = end[which].value + from_apart * apart + from_faster * faster;
            for (i, slope) in moved.slopes.iter_mut().enumerate() {
                *slope =
                    end[which].slopes[i] - from_apart * start[0].slopes[i] - from_faster * start[1].slopes[i];
            }
            moved.slopes[POSITION] += from_apart;
            moved.slopes[VELOCITY] += from_faster;
            let along = |by: [[f64; 2]; 2]| by[which][0] * apart + by[which][1] * faster;
            let (by_gamma, by_natural) = (along(by_gamma), along(by_natural));
            moved.slopes[STATE + MASS] -= (by_gamma * gamma + by_natural * natural) / mass;
            moved.slopes[STATE + DAMPING] += by_gamma * 0.5 / mass;
            moved.slopes[SLOPE] += by_gamma * 0.5 / mass;
            moved.slopes[STATE + STIFFNESS] += by_natural / mass;
            moved
        });
        moved.iter().all(|moved| moved.value.is_finite()).then_some(moved)
    }
}

impl Moved {
    /// The friction force of slip, without derivatives.
    fn friction_now(&self) -> f64 {
        let [offset, slope] = &self.line;
        self.direction * offset.value + slope.value * (self.closed.system[DRIVE] - self.v.value)
    }

    /// The acceleration during slip, without derivatives.
    fn acceleration_now(&self) -> f64 {
        let [mass, damping, stiffness, _] = self.closed.system;
        let mut forcing = 0.0;
        for [amplitude, _, cos, _] in self.closed.waves(self.t.value) {
            forcing += amplitude * cos;
        }
        (forcing + self.friction_now() - damping * self.v.value - stiffness * self.x.value) / mass
    }

    fn friction(&self) -> Dual {
        let [offset, slope] = &self.line;
        let mut friction = Dual::fixed(self.friction_now(), self.t.rates.len());
        friction.shift(self.direction, offset);
        friction.shift(self.closed.system[DRIVE] - self.v.value, slope);
        friction.shift(-slope.value, &self.v);
        self.closed.shift(&mut friction, slope.value, DRIVE);
        friction
    }

    fn acceleration(&self) -> Dual {
        let [mass, damping, stiffness, _] = self.closed.system;
        let mut acceleration = self.closed.forcing(&self.t, false);
        acceleration.value = self.acceleration_now();
        for rate in acceleration.rates.iter_mut() {
            *rate /= mass;
        }
        acceleration.shift(1.0 / mass, &self.friction());
        acceleration.shift(-damping / mass, &self.v);
        acceleration.shift(-stiffness / mass, &self.x);
        for (slope, which) in [
            (acceleration.value, MASS),
            (self.v.value, DAMPING),
            (self.x.value, STIFFNESS),
        ] {
            self.closed.shift(&mut acceleration, -slope / mass, which);
        }
        acceleration
    }

    fn sticks(&self) -> bool {
        self.direction == 0.0
    }

    /// Slip speed.
    pub(super) fn u(&self) -> Dual {
        let mut u = self.closed.drive(self.t.rates.len()) - &self.v;
        u.scale(self.direction);
        u
    }

    /// Its rate.
    pub(super) fn slip_acceleration(&self) -> Dual {
        if self.sticks() {
            return Dual::fixed(0.0, self.t.rates.len());
        }
        self.acceleration() * -self.direction
    }

    /// Friction force.
    pub(super) fn force(&self) -> Dual {
        if self.sticks() {
            return self.closed.holding_force(&self.x, &self.t);
        }
        self.friction()
    }

    /// Its rate.
    pub(super) fn force_rate(&self) -> Dual {
        if self.sticks() {
            return self.closed.holding_rate(&self.t);
        }
        let slope = &self.line[1];
        let acceleration = self.acceleration();
        let by_slope = -acceleration.value;
        let mut rate = acceleration * -slope.value;
        rate.shift(by_slope, slope);
        rate
    }
}

const POSITION: usize = 0;
const VELOCITY: usize = 1;
const TIME: usize = 2;
const OFFSET: usize = 3;
const SLOPE: usize = 4;
const MASS: usize = 0;
const DAMPING: usize = 1;
const STIFFNESS: usize = 2;
const DRIVE: usize = 3;

/// A number and its derivatives by the numbers of the state and of the system.
struct Slope {
    value: f64,
    slopes: [f64; MOST_SLOPES],
}

impl Slope {
    const NOTHING: Self = Self {
        value: 0.0,
        slopes: [0.0; MOST_SLOPES],
    };
}

/// The free motion y″ + 2 γ y′ + q y = 0: how y and y′ at the end follow from those at the start.
struct Free;

impl Free {
    /// [[y/y₀, y/y₀′], [y′/y₀, y′/y₀′]], and its derivatives by γ and by q.
    ///
    /// With C = e^(−γτ) cos ωτ and S = e^(−γτ) sin(ωτ)/ω, ω² = q − γ², it is [[C + γS, S], [−qS, C − γS]]; by ω² the
    /// derivatives are ∂C = −τS/2 and ∂S = (τC − S)/2ω².
    fn of(gamma: f64, natural: f64, tau: f64) -> [[[f64; 2]; 2]; 3] {
        let square = natural - gamma * gamma;
        let z2 = square * tau * tau;
        let decay = exp(-gamma * tau);
        // cos z, sin z / z and (cos z − sin z / z)/z²
        let (cos, sinc, bent) = if z2.abs() < 0.5 {
            let (mut cos, mut sinc, mut bent, mut term) = (0.0, 0.0, 0.0, 1.0);
            for n in 0..10 {
                let n = f64::from(n);
                cos += term;
                sinc += term / (2.0 * n + 1.0);
                // The term after this one, over z².
                bent -= term * (2.0 * n + 2.0) / ((2.0 * n + 1.0) * (2.0 * n + 2.0) * (2.0 * n + 3.0));
                term *= -z2 / ((2.0 * n + 1.0) * (2.0 * n + 2.0));
            }
            (cos, sinc, bent)
        } else {
            let z = z2.abs().sqrt();
            let (cos, sinc) = if z2 > 0.0 {
                let (sin, cos) = sin_cos(z);
                (cos, sin / z)
            } else {
                let (up, down) = (exp(z), exp(-z));
                (0.5 * (up + down), 0.5 * (up - down) / z)
            };
            (cos, sinc, (cos - sinc) / z2)
        };
        let (c, s) = (decay * cos, decay * tau * sinc);
        let (c_q, s_q) = (-0.5 * tau * s, 0.5 * decay * tau * tau * tau * bent);
        let (c_g, s_g) = (-tau * c - 2.0 * gamma * c_q, -tau * s - 2.0 * gamma * s_q);
        [
            [[c + gamma * s, s], [-natural * s, c - gamma * s]],
            [
                [c_g + s + gamma * s_g, s_g],
                [-natural * s_g, c_g - s - gamma * s_g],
            ],
            [[c_q + gamma * s_q, s_q], [-s - natural * s_q, c_q - gamma * s_q]],
        ]
    }
}

/// Real and imaginary part.
#[derive(Clone, Copy)]
struct Complex(f64, f64);

impl Complex {
    fn size(self) -> f64 {
        self.0.abs().max(self.1.abs())
    }

    fn inverse(self) -> Self {
        let square = self.0 * self.0 + self.1 * self.1;
        Self(self.0 / square, -self.1 / square)
    }

    fn times(self, other: Self) -> Self {
        Self(
            self.0 * other.0 - self.1 * other.1,
            self.0 * other.1 + self.1 * other.0,
        )
    }

    fn scaled(self, factor: f64) -> Self {
        Self(self.0 * factor, self.1 * factor)
    }

    /// i times it.
    fn turned(self) -> Self {
        Self(-self.1, self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::Free;
    use crate::elementary::exp;

    /// Beyond critical damping the free motion is a slow and a fast exponential.
    #[test]
    fn overdamped_motion_keeps_its_digits() {
        for gamma in [1.5, 28.6, 99.0] {
            for tau in [1e-3, 0.1, 1.0, 5.0] {
                let fast = -gamma - f64::sqrt(gamma * gamma - 1.0);
                let slow = 1.0 / fast;
                let [s, f] = [slow, fast].map(|root| exp(root * tau));
                let expected = [[slow * f - fast * s, s - f], [f - s, slow * s - fast * f]];
                let [free, ..] = Free::of(gamma, 1.0, tau);
                for (own, expected) in free.as_flattened().iter().zip(expected.as_flattened()) {
                    let off = own - expected / (slow - fast);
                    assert!(off.abs() < 1e-15 * gamma * (1.0 + tau), "{gamma} {tau} {off}");
                }
            }
        }
    }
}
