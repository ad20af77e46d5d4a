//! The derivative of a segment: the motion between two events with the derivatives of its numbers.
//!
//! Along a line of friction it is the closed form, under a smooth law extrapolation (Gragg 1965; Bulirsch & Stoer 1966) of the
//! variational equation.

use super::state::{LINE, Phase, State};
use super::varied::Varied;
use crate::dual::Dual;
use crate::law::Friction;

/// The numbers of the oscillator with their derivatives.
pub(super) struct Frame<'a, const N: usize> {
    pub(super) varied: &'a Varied,
    mass: Dual<N>,
    damping: Dual<N>,
    stiffness: Dual<N>,
    pub(super) drive: Dual<N>,
    forcing: Vec<[Dual<N>; 3]>,
    smooth: bool,
    /// The fastest rate at which anything moves.
    pub(super) rate: f64,
}

/// Position, velocity and acceleration.
pub(super) type Motion<const N: usize> = [Dual<N>; 3];

impl<'a, const N: usize> Frame<'a, N> {
    pub(super) fn new(varied: &'a Varied) -> Self {
        let base = &varied.base;
        let harmonics = 0..base.forcing.len();
        let natural = (base.stiffness / base.mass).sqrt();
        Self {
            mass: varied.number(|o| o.mass),
            damping: varied.number(|o| o.damping),
            stiffness: varied.number(|o| o.stiffness),
            drive: varied.number(|o| o.drive_velocity),
            forcing: harmonics
                .map(|j| {
                    [
                        varied.number(|o| o.forcing[j].amplitude),
                        varied.number(|o| o.forcing[j].frequency),
                        varied.number(|o| o.forcing[j].phase),
                    ]
                })
                .collect(),
            smooth: base.law.smooth(),
            rate: base.forcing.iter().map(|f| f.frequency).fold(natural, f64::max),
            varied,
        }
    }

    /// The forcing and its rate at `t`.
    fn force(&self, t: Dual<N>) -> (Dual<N>, Dual<N>) {
        let (mut force, mut rate) = (Dual::fixed(0.0), Dual::fixed(0.0));
        for [amplitude, frequency, phase] in &self.forcing {
            let (sin, cos) = (*frequency * t + *phase).sin_cos();
            force = force + *amplitude * cos;
            rate = rate - *amplitude * *frequency * sin;
        }
        (force, rate)
    }

    /// The friction that holds the mass at the velocity `v`, and its rate.
    pub(super) fn holding(&self, t: Dual<N>, x: Dual<N>, v: Dual<N>) -> (Dual<N>, Dual<N>) {
        let (force, rate) = self.force(t);
        (
            self.damping * v + self.stiffness * x - force,
            self.stiffness * v - rate,
        )
    }

    /// The slip speed.
    pub(super) fn speed(&self, direction: f64, v: Dual<N>) -> Dual<N> {
        (self.drive - v) * direction
    }

    fn acceleration(&self, state: &State<N>, direction: f64, t: Dual<N>, [x, v]: [Dual<N>; 2]) -> Dual<N> {
        let u = self.speed(direction, v);
        let friction = if self.smooth {
            self.varied.smooth_force(u)
        } else {
            state.numbers[LINE] + state.numbers[LINE + 1] * u
        };
        (friction * direction + self.force(t).0 - self.damping * v - self.stiffness * x) / self.mass
    }

    /// The motion at `tau` from the start of the arc.
    pub(super) fn motion(&self, state: &State<N>, phase: Phase, tau: Dual<N>) -> Motion<N> {
        let [t, x, v] = [state.numbers[0], state.numbers[1], state.numbers[2]];
        let (x, v, direction) = match phase {
            Phase::Stick => return [x + self.drive * tau, self.drive, Dual::fixed(0.0)],
            Phase::Hold(_) => return [x + v * tau, v, Dual::fixed(0.0)],
            Phase::Slip(direction) if self.smooth => {
                let [x, v] = self.extrapolated(state, direction, tau.value);
                let a = self.acceleration(state, direction, t + Dual::fixed(tau.value), [x, v]);
                (x.shifted(v.value, &tau), v.shifted(a.value, &tau), direction)
            }
            Phase::Slip(direction) => {
                let [x, v] = self.closed(state, direction, tau);
                (x, v, direction)
            }
        };
        [x, v, self.acceleration(state, direction, t + tau, [x, v])]
    }

    /// The closed form along a line of friction.
    fn closed(&self, state: &State<N>, direction: f64, tau: Dual<N>) -> [Dual<N>; 2] {
        let [t, x, v] = [state.numbers[0], state.numbers[1], state.numbers[2]];
        let [offset, slope] = [state.numbers[LINE], state.numbers[LINE + 1]];
        let damping = self.damping + slope;
        let gamma = damping / self.mass * 0.5;
        let kappa = gamma * gamma - self.stiffness / self.mass;
        let (c, s) = basis(kappa, tau);
        let decay = (-(gamma * tau)).exp();
        let rest = (offset * direction + slope * self.drive) / self.stiffness;
        let (mut a, mut b) = (x - rest, v);
        let (mut forced, mut forced_rate) = (rest, Dual::fixed(0.0));
        for [amplitude, frequency, phase] in &self.forcing {
            let real = self.stiffness - self.mass * *frequency * *frequency;
            let imaginary = damping * *frequency;
            let share = *amplitude / (real * real + imaginary * imaginary);
            let wave = |t: Dual<N>| {
                let (sin, cos) = (*frequency * t + *phase).sin_cos();
                (
                    share * (real * cos + imaginary * sin),
                    share * *frequency * (imaginary * cos - real * sin),
                )
            };
            let (before, after) = (wave(t), wave(t + tau));
            (a, b) = (a - before.0, b - before.1);
            (forced, forced_rate) = (forced + after.0, forced_rate + after.1);
        }
        b = b + gamma * a;
        [
            forced + decay * (a * c + b * s),
            forced_rate + decay * ((b - gamma * a) * c + (kappa * a - gamma * b) * s),
        ]
    }

    /// Extrapolation of the midpoint rule under a smooth law.
    fn extrapolated(&self, state: &State<N>, direction: f64, tau: f64) -> [Dual<N>; 2] {
        const COLUMNS: usize = 12;
        let t0 = state.numbers[0];
        let mut y = [state.numbers[1], state.numbers[2]];
        let (mut at, mut big) = (0.0, 0.5_f64.copysign(tau) / self.rate);
        let floor = 1e-3 * big.abs();
        let slope = |t: f64, [x, v]: [Dual<N>; 2]| {
            [
                v,
                self.acceleration(state, direction, t0 + Dual::fixed(t), [x, v]),
            ]
        };
        while at != tau {
            let last = (tau - at).abs() <= big.abs() * (1.0 + 1e-12);
            let step = if last { tau - at } else { big };
            let start = slope(at, y);
            let mut table: Vec<[Dual<N>; 2]> = Vec::with_capacity(COLUMNS);
            let mut error = f64::INFINITY;
            for column in 0..COLUMNS {
                let count = 2 * (column + 1);
                let h = step / count as f64;
                let advance = |from: [Dual<N>; 2], rate: [Dual<N>; 2], h: f64| {
                    [from[0] + rate[0] * h, from[1] + rate[1] * h]
                };
                let (mut before, mut now) = (y, advance(y, start, h));
                for n in 1..count {
                    (before, now) = (now, advance(before, slope(at + n as f64 * h, now), 2.0 * h));
                }
                let end = advance(before, slope(at + step, now), h);
                let raw: [Dual<N>; 2] = std::array::from_fn(|i| (now[i] + end[i]) * 0.5);
                let mut entry = raw;
                for k in (0..column).rev() {
                    let ratio = count as f64 / (2 * (k + 1)) as f64;
                    let weight = 1.0 / (ratio * ratio - 1.0);
                    let next: [Dual<N>; 2] =
                        std::array::from_fn(|i| entry[i] + (entry[i] - table[k][i]) * weight);
                    error = far(&next, &table[k]);
                    table[k] = next;
                    entry = next;
                }
                table.push(raw);
                if error <= 1e-14 {
                    break;
                }
            }
            // Rounding may keep it from the last digit; a step too long keeps it from the twelfth.
            if error > 1e-12 && step.abs() > floor {
                big = 0.5 * step;
                continue;
            }
            let end = table[0];
            y = end;
            at = if last { tau } else { at + step };
        }
        y
    }
}

/// How far apart two states are, derivatives included, relative to each.
fn far<const N: usize>(one: &[Dual<N>; 2], other: &[Dual<N>; 2]) -> f64 {
    let size = one[0].value.abs() + one[1].value.abs();
    let mut most = 0.0_f64;
    for (a, b) in one.iter().zip(other) {
        most = most.max((a.value - b.value).abs() / size.max(f64::MIN_POSITIVE));
        for (a, b) in a.rates.iter().zip(b.rates) {
            most = most.max((a - b).abs() / (1.0 + a.abs()));
        }
    }
    most
}

/// C and S of e^{−γτ}(a C + b S): cos ωτ and sin ωτ / ω, or what they become where ω² = −κ is not positive.
fn basis<const N: usize>(kappa: Dual<N>, tau: Dual<N>) -> (Dual<N>, Dual<N>) {
    let z = kappa * tau * tau;
    if z.value.abs() < 0.3 {
        // Σ zⁿ/(2n)! and Σ zⁿ/(2n+1)!: no root to differentiate at zero.
        let (mut c, mut s) = (Dual::fixed(0.0), Dual::fixed(0.0));
        for n in (0..10_u32).rev() {
            let k = f64::from(2 * n);
            c = Dual::fixed(1.0) + c * z * (1.0 / ((k + 1.0) * (k + 2.0)));
            s = Dual::fixed(1.0) + s * z * (1.0 / ((k + 2.0) * (k + 3.0)));
        }
        return (c, s * tau);
    }
    if kappa.value < 0.0 {
        let omega = (-kappa).sqrt();
        let (sin, cos) = (omega * tau).sin_cos();
        (cos, sin / omega)
    } else {
        let omega = kappa.sqrt();
        let (up, down) = ((omega * tau).exp(), (-(omega * tau)).exp());
        ((up + down) * 0.5, (up - down) * 0.5 / omega)
    }
}
