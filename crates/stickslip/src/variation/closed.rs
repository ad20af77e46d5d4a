//! The derivative of a segment in closed form: one mass on one drive, while friction is linear in the slip speed.

use super::state::{ContactState, Layout, Moving};
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
/// Below this ratio of its dynamic stiffness to the static one a force meets a resonance, which costs digits.
const RESONANT: f64 = 0.05;

/// The oscillator behind a system, and how its numbers change with each parameter.
pub(super) struct Closed {
    numbers: Vec<f64>,
    /// For each parameter the numbers that it changes, and how much.
    rates: Vec<Vec<(usize, f64)>>,
}

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
        let rates = varied.parameters.iter().map(|parameter| {
            let around = parameter.around.each_ref().map(numbers);
            let [Some(a), Some(b), Some(c), Some(d)] = around else {
                return None;
            };
            let rate = |i: usize| difference([a[i], b[i], c[i], d[i]], parameter.step);
            Some(
                (0..own.len())
                    .map(|i| (i, rate(i)))
                    .filter(|(_, rate)| *rate != 0.0)
                    .collect(),
            )
        });
        Some(Self {
            rates: rates.collect::<Option<_>>()?,
            numbers: own,
        })
    }

    /// Move a state `tau` on along a phase of one contact; false where the closed form would lose digits, or is none.
    pub(super) fn move_on(
        &self,
        state: &mut Moving,
        contact_state: ContactState,
        clock: Clock,
        tau: f64,
    ) -> bool {
        let layout = Layout {
            masses: 1,
            contacts: 1,
        };
        let (x, v) = (layout.x(0), layout.v(0));
        let direction = match contact_state {
            ContactState::Stick => {
                let speed = state.numbers[v].clone();
                state.numbers[x].value += tau * speed.value;
                state.numbers[x].shift(tau, &speed);
                return true;
            }
            ContactState::Slip(direction) => direction,
            ContactState::Hold(_) => return false,
        };
        let at = layout.contact(0);
        let positions = [x, v, 0, at, at + 1];
        let own = positions.map(|position| state.numbers[position].value);
        let Some(moved) = self.slip(own, direction, clock, tau) else {
            return false;
        };
        let lanes = state.numbers[0].rates.len();
        let moved = moved.map(|Moved { value, slopes }| {
            let mut number = Dual::fixed(value, lanes);
            for (position, slope) in positions.into_iter().zip(slopes) {
                number.shift(slope, &state.numbers[position]);
            }
            // Where only time counts no parameter has a lane.
            if lanes > 1 {
                for (rates, lane) in self.rates.iter().zip(layout.width()..) {
                    number.rates[lane] += rates
                        .iter()
                        .map(|(i, rate)| rate * slopes[STATE + i])
                        .sum::<f64>();
                }
            }
            number
        });
        [state.numbers[x], state.numbers[v]] = moved;
        true
    }

    /// Position and velocity at the end of a slip, with their derivatives by the numbers of the state and of the system.
    fn slip(&self, own: [f64; STATE], direction: f64, clock: Clock, tau: f64) -> Option<[Moved; 2]> {
        let [x0, v0, _, offset, slope] = own;
        let [mass, damping, stiffness, drive] = *self.numbers.first_chunk::<SYSTEM>()?;
        let drag = damping + slope;
        let (gamma, natural) = (0.5 * drag / mass, stiffness / mass);
        if !(stiffness > 0.0 && gamma * gamma < 2.0 * natural) {
            return None;
        }
        let [free, by_gamma, by_natural] = Free::of(gamma, natural, tau);
        // Position and velocity of the equilibrium and the forced motion, at the start and at the end.
        let mut start = [Moved::NOTHING, Moved::NOTHING];
        let mut end = [Moved::NOTHING, Moved::NOTHING];
        let rest = (direction * offset + slope * drive) / stiffness;
        for [position, _] in [&mut start, &mut end] {
            position.value = rest;
            for (i, share) in [
                (OFFSET, direction),
                (SLOPE, drive),
                (STIFFNESS, -rest),
                (DRIVE, slope),
            ] {
                position.slopes[i] = share / stiffness;
            }
        }
        for (force, first) in self.numbers[SYSTEM..]
            .chunks_exact(3)
            .zip((STATE + SYSTEM..).step_by(3))
        {
            let harmonic = Harmonic {
                amplitude: 1.0,
                frequency: force[1],
                phase: force[2],
            };
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
                    (MASS, given.scaled(frequency * frequency)),
                    (DAMPING, given.turned().scaled(-frequency)),
                    (SLOPE, given.turned().scaled(-frequency)),
                    (STIFFNESS, given.scaled(-1.0)),
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
            let mut moved = Moved::NOTHING;
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
            moved.slopes[MASS] -= (by_gamma * gamma + by_natural * natural) / mass;
            moved.slopes[DAMPING] += by_gamma * 0.5 / mass;
            moved.slopes[SLOPE] += by_gamma * 0.5 / mass;
            moved.slopes[STIFFNESS] += by_natural / mass;
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
const MASS: usize = STATE;
const DAMPING: usize = STATE + 1;
const STIFFNESS: usize = STATE + 2;
const DRIVE: usize = STATE + 3;

/// A number and its derivatives by the numbers of the state and of the system.
struct Moved {
    value: f64,
    slopes: [f64; MOST],
}

impl Moved {
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
