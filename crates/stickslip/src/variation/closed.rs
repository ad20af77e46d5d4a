//! The derivative of a segment in closed form: one mass on one drive, while friction is linear in the slip speed.

use super::saltation::later;
use super::state::{ContactMode, Layout, Moving};
use super::varied::{Varied, difference};
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
const MOST: usize = STATE + SYSTEM + 3 * MOST_HARMONICS;
/// (γ/ω)² up to which slip goes in closed form. Beyond critical damping the slow and the fast exponential cancel, which costs up
/// to γ/ω roundings of the largest term.
const MOST_OVERDAMPED: f64 = 1e4;
/// Below this ratio of its dynamic stiffness to the static one a force meets a resonance, which costs digits.
const RESONANT: f64 = 0.05;

/// The oscillator behind a system, and how its numbers change with each parameter.
pub(super) struct Closed {
    /// Mass, damping, stiffness, drive velocity.
    system: [f64; SYSTEM],
    /// These, then amplitude, frequency and phase of every force.
    numbers: Vec<f64>,
    /// For each number the directions of the parameters that change it, and how much.
    rates: Vec<Vec<(usize, f64)>>,
}

/// A motion at a time, with derivatives; the last axis is the time along the phase.
#[derive(Clone)]
pub(super) struct Moved {
    pub(super) x: Dual,
    pub(super) v: Dual,
    /// Slip speed and its rate.
    pub(super) slip: [Dual; 2],
    /// Friction force and its rate.
    pub(super) force: [Dual; 2],
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
            let around = parameter.around.each_ref().map(numbers);
            let [Some(a), Some(b), Some(c), Some(d)] = around else {
                return None;
            };
            for (i, rates) in rates.iter_mut().enumerate() {
                let rate = difference([a[i], b[i], c[i], d[i]], parameter.step);
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

    /// The forcing at a time and its rate.
    fn forcing(&self, t: &Dual) -> [Dual; 2] {
        let [mut force, mut rate] = [0, 1].map(|_| Dual::fixed(0.0, t.rates.len()));
        let clock = Clock::at(t.value);
        let mut bend = 0.0;
        for (one, first) in self.numbers[SYSTEM..].chunks_exact(3).zip((SYSTEM..).step_by(3)) {
            let &[amplitude, frequency, phase] = one else {
                continue;
            };
            let harmonic = Harmonic::new(1.0, frequency, phase);
            let (cos, odd) = harmonic.quadratures(clock);
            let (wave, turned) = (amplitude * cos, amplitude * odd);
            force.value += wave;
            rate.value += frequency * turned;
            bend -= frequency * frequency * wave;
            self.shift(&mut force, cos, first);
            self.shift(&mut force, t.value * turned, first + 1);
            self.shift(&mut force, turned, first + 2);
            self.shift(&mut rate, frequency * odd, first);
            self.shift(&mut rate, turned - frequency * t.value * wave, first + 1);
            self.shift(&mut rate, -frequency * wave, first + 2);
        }
        if !self.numbers[SYSTEM..].is_empty() {
            force.shift(rate.value, t);
            rate.shift(bend, t);
        }
        [force, rate]
    }

    /// The force of the contact and its rate while it sticks at `x`.
    pub(super) fn holding(&self, x: &Dual, t: &Dual) -> [Dual; 2] {
        let [_, damping, stiffness, drive] = self.system;
        let [force, rate] = self.forcing(t);
        let [mut force, mut rate] = [-force, -rate];
        force.value += damping * drive + stiffness * x.value;
        force.shift(stiffness, x);
        rate.value += stiffness * drive;
        for (slope, which) in [(damping, DRIVE), (drive, DAMPING), (x.value, STIFFNESS)] {
            self.shift(&mut force, slope, which);
        }
        for (slope, which) in [(stiffness, DRIVE), (drive, STIFFNESS)] {
            self.shift(&mut rate, slope, which);
        }
        [force, rate]
    }

    /// The motion `tau` from the start of a phase; none where the closed form would lose digits, or is none.
    pub(super) fn go(&self, start: &Moving, contact_state: ContactMode, tau: f64) -> Option<Moved> {
        let directions = start.numbers[0].rates.len();
        let t = later(&start.numbers[0], tau);
        match contact_state {
            ContactMode::Stick => {
                let v = self.drive(directions);
                let mut x = start.numbers[LAYOUT.x(0)].clone();
                x.value += tau * v.value;
                x.shift(tau, &v);
                x.rates[directions - 1] = v.value;
                Some(Moved {
                    force: self.holding(&x, &t),
                    slip: [0, 1].map(|_| Dual::fixed(0.0, directions)),
                    x,
                    v,
                })
            }
            ContactMode::Slip(direction) => self.go_slipping(start, direction, &t, tau),
            ContactMode::Hold(_) => None,
        }
    }

    fn go_slipping(&self, start: &Moving, direction: f64, t: &Dual, tau: f64) -> Option<Moved> {
        let [mass, damping, stiffness, drive] = self.system;
        let at = LAYOUT.contact(0);
        let positions = [LAYOUT.x(0), LAYOUT.v(0), 0, at, at + 1];
        let own = positions.map(|position| start.numbers[position].value);
        let clock = Clock::at(own[TIME]);
        let directions = t.rates.len();
        let [mut x, mut v] = self
            .slip(own, direction, clock, tau)?
            .map(|Slope { value, slopes }| {
                let mut number = Dual::fixed(value, directions);
                if directions > 1 {
                    for (position, slope) in positions.into_iter().zip(slopes) {
                        number.shift(slope, &start.numbers[position]);
                    }
                    for (which, slope) in slopes[STATE..STATE + self.numbers.len()].iter().enumerate() {
                        self.shift(&mut number, *slope, which);
                    }
                }
                number
            });
        let (offset, slope) = (&start.numbers[at], &start.numbers[at + 1]);
        let w = drive - v.value;
        let mut friction = Dual::fixed(direction * offset.value + slope.value * w, directions);
        let [mut acceleration, _] = self.forcing(t);
        acceleration.value =
            (acceleration.value + friction.value - damping * v.value - stiffness * x.value) / mass;
        x.rates[directions - 1] = v.value;
        v.rates[directions - 1] = acceleration.value;
        friction.shift(direction, offset);
        friction.shift(w, slope);
        friction.shift(-slope.value, &v);
        self.shift(&mut friction, slope.value, DRIVE);
        for rate in acceleration.rates.iter_mut() {
            *rate /= mass;
        }
        acceleration.shift(1.0 / mass, &friction);
        acceleration.shift(-damping / mass, &v);
        acceleration.shift(-stiffness / mass, &x);
        for (slope, which) in [
            (acceleration.value, MASS),
            (v.value, DAMPING),
            (x.value, STIFFNESS),
        ] {
            self.shift(&mut acceleration, -slope / mass, which);
        }
        let mut friction_rate = acceleration.clone() * -slope.value;
        friction_rate.shift(-acceleration.value, slope);
        let u = (self.drive(directions) - &v) * direction;
        Some(Moved {
            x,
            v,
            slip: [u, acceleration * -direction],
            force: [friction, friction_rate],
        })
    }

    /// Position and velocity at the end of a slip, with their derivatives by the numbers of the state and of the system.
    fn slip(&self, own: [f64; STATE], direction: f64, clock: Clock, tau: f64) -> Option<[Slope; 2]> {
        let [x0, v0, _, offset, slope] = own;
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
            if dynamic.size() < RESONANT * stiffness {
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
    slopes: [f64; MOST],
}

impl Slope {
    const NOTHING: Self = Self {
        value: 0.0,
        slopes: [0.0; MOST],
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
