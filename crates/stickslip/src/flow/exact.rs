//! Closed-form motion of one mass in a mode whose friction is linear in the slip speed: evaluated, never stepped.

use crate::clock::Clock;
use crate::elementary::{exp_m1, hypot, sin_cos};
use crate::error::Error;
use crate::flow::decay::Decay;
use crate::harmonic::{Harmonic, MOST_HARMONICS};
use crate::law::Piece;
use crate::oscillator::Oscillator;

/// A free motion, see [`Decay`], about a constant and Σ (p cos Ωτ + q sin Ωτ): any coordinate of the motion in one mode.
#[derive(Clone, Copy, Debug)]
pub struct Signal<const H: usize> {
    /// The part that rests.
    pub constant: f64,
    /// Coefficients of the free motion.
    pub free: [f64; 2],
    /// Coefficients of cos Ωτ.
    pub p: [f64; H],
    /// Coefficients of sin Ωτ.
    pub q: [f64; H],
}

/// The functions of time a [`Signal`] is made of, at one time.
#[derive(Clone, Copy, Debug)]
pub struct Basis<const H: usize> {
    pub(crate) c: f64,
    pub(crate) s: f64,
    cos: [f64; H],
    sin: [f64; H],
}

impl<const H: usize> Signal<H> {
    /// Its value.
    #[inline]
    pub fn at(&self, basis: &Basis<H>) -> f64 {
        let mut value = self.constant + self.free[0] * basis.c + self.free[1] * basis.s;
        for j in 0..H {
            value += self.p[j] * basis.cos[j] + self.q[j] * basis.sin[j];
        }
        value
    }

    /// What it is from a time on of which `basis` has the functions.
    #[inline]
    pub(crate) fn after(&self, basis: &Basis<H>, decay: &Decay) -> Self {
        let [a, b] = self.free;
        Self {
            constant: self.constant,
            free: if decay.separates() {
                [a * basis.c, b * basis.s]
            } else {
                let s = decay.kappa * (a * basis.s);
                [a * basis.c + b * basis.s, b * basis.c + s]
            },
            p: std::array::from_fn(|j| self.p[j] * basis.cos[j] + self.q[j] * basis.sin[j]),
            q: std::array::from_fn(|j| self.q[j] * basis.cos[j] - self.p[j] * basis.sin[j]),
        }
    }

    /// Its value and its first derivatives at τ = 0.
    #[inline]
    pub(crate) fn derivatives<const N: usize>(&self, decay: &Decay, frequency: &[f64; H]) -> [f64; N] {
        let mut each = [0.0; N];
        let mut free = self.free;
        for n in 0..N {
            each[n] = if n < 2 || decay.separates() {
                decay.start(free)
            } else {
                -(2.0 * decay.gamma) * each[n - 1] - decay.natural_squared * each[n - 2]
            };
            if n < 1 || decay.separates() {
                free = decay.derivative(free);
            }
        }
        each[0] += self.constant;
        for (j, frequency) in frequency.iter().enumerate() {
            let mut wave = [self.p[j], frequency * self.q[j]];
            for (n, value) in each.iter_mut().enumerate() {
                *value += wave[n % 2];
                wave[n % 2] *= -(frequency * frequency);
            }
        }
        each
    }

    /// Its value at τ = 0.
    #[inline]
    pub fn start(&self, decay: &Decay) -> f64 {
        self.constant + decay.start(self.free) + self.p.iter().sum::<f64>()
    }

    /// The same without its value at τ = 0, which is known to be zero but for rounding.
    pub(crate) fn started_at_zero(mut self, decay: &Decay) -> Self {
        let start = self.start(decay);
        let [a, b] = decay.coefficients(start, -decay.gamma * start);
        self.free[0] -= a;
        self.free[1] -= b;
        self
    }

    /// Its derivative in time.
    #[inline]
    #[must_use]
    pub fn derivative(&self, decay: &Decay, frequency: &[f64; H]) -> Self {
        Self {
            constant: 0.0,
            free: decay.derivative(self.free),
            p: std::array::from_fn(|j| frequency[j] * self.q[j]),
            q: std::array::from_fn(|j| -frequency[j] * self.p[j]),
        }
    }

    /// Its free part.
    pub(crate) fn free(&self, basis: &Basis<H>) -> f64 {
        self.free[0] * basis.c + self.free[1] * basis.s
    }

    /// Its part at frequency `j`.
    pub(crate) fn wave(&self, j: usize, basis: &Basis<H>) -> f64 {
        self.p[j] * basis.cos[j] + self.q[j] * basis.sin[j]
    }
}

/// Slip along one piece of friction in one direction: x(τ), closed.
#[derive(Clone, Copy, Debug)]
pub struct Slip<const H: usize> {
    /// How its free part decays.
    pub decay: Decay,
    /// Frequencies of the forcing.
    pub frequency: [f64; H],
    /// Position at τ = 0.
    pub start: f64,
    /// Position; to be evaluated by [`Slip::position`].
    pub x: Signal<H>,
    /// Velocity.
    pub v: Signal<H>,
}

/// Adhesion: the mass moves with the drive. The friction force that holds it is start + rate τ + Σ (p cos Ωτ + q sin Ωτ).
#[derive(Clone, Copy, Debug)]
pub struct Stick<const H: usize> {
    /// Frequencies of the forcing.
    pub frequency: [f64; H],
    /// Its part linear in time, at τ = 0.
    pub start: f64,
    /// The rate of that part.
    pub rate: f64,
    /// Coefficients of cos Ωτ.
    pub p: [f64; H],
    /// Coefficients of sin Ωτ.
    pub q: [f64; H],
}

/// What stays the same along an orbit.
#[derive(Clone, Debug)]
pub struct Frame<const H: usize> {
    /// Mass m.
    pub mass: f64,
    /// Stiffness k.
    pub stiffness: f64,
    /// Damping D.
    pub damping: f64,
    /// Drive velocity s.
    pub drive_velocity: f64,
    /// The constant force.
    pub constant: f64,
    /// Harmonic forces.
    pub forcing: [Harmonic; H],
}

impl<const H: usize> Frame<H> {
    /// The frame of an oscillator with `H` harmonics.
    ///
    /// # Panics
    /// Never: the slots are counted by the same harmonics.
    #[must_use]
    pub(crate) fn of(oscillator: &Oscillator) -> Self {
        let mut swinging = oscillator.swinging();
        let mut slot = Harmonic::new(0.0, 0.0, 0.0);
        Self {
            mass: oscillator.mass,
            stiffness: oscillator.stiffness,
            damping: oscillator.damping,
            drive_velocity: oscillator.drive_velocity,
            constant: oscillator.constant_force(),
            forcing: std::array::from_fn(|_| {
                // A slot that is left over has the frequency of the last one: no bound is another one for it.
                slot = swinging.next().unwrap_or(Harmonic {
                    amplitude: 0.0,
                    ..slot
                });
                slot
            }),
        }
    }

    /// The motion from (x, v) at `clock` along `piece`, slipping in `direction` (the sign of w).
    ///
    /// # Errors
    /// A harmonic that meets an undamped resonance of this mode.
    pub fn slip(
        &self,
        clock: Clock,
        x: f64,
        v: f64,
        direction: f64,
        piece: &Piece,
    ) -> Result<Slip<H>, Error> {
        self.bounded(piece.slope)?;
        Ok(self.closed(clock, x, v, direction, piece))
    }

    /// Refuse friction of this slope if a harmonic meets an undamped resonance there.
    pub(crate) fn bounded(&self, slope: f64) -> Result<(), Error> {
        for harmonic in &self.forcing {
            let real = 1.0 - self.mass / self.stiffness * harmonic.frequency * harmonic.frequency;
            let imaginary = (self.damping + slope) * harmonic.frequency / self.stiffness;
            if hypot(real, imaginary) < 1e-9 {
                return Err(Error::Resonance {
                    frequency: harmonic.frequency,
                });
            }
        }
        Ok(())
    }

    /// [`Frame::slip`] for a mode known to have a bounded forced response.
    pub(crate) fn closed(&self, clock: Clock, x: f64, v: f64, direction: f64, piece: &Piece) -> Slip<H> {
        self.response(piece.slope)
            .from(self, &self.forces(clock), (x, v), direction, piece)
    }

    /// The harmonic forces in and out of phase, (P, Q) of P cos Ωτ + Q sin Ωτ for τ counted from `clock`.
    pub(crate) fn forces(&self, clock: Clock) -> [[f64; 2]; H] {
        std::array::from_fn(|j| self.forcing[j].quadratures(clock).into())
    }

    /// How the oscillator answers along friction of this slope.
    pub(crate) fn response(&self, slope: f64) -> Response<H> {
        let damping = self.damping + slope;
        Response {
            slope,
            decay: Decay::new(self.mass, damping, self.stiffness),
            gain: std::array::from_fn(|j| {
                // (k − mΩ² + icΩ) X = F for x = Re X e^{iΩτ}.
                let frequency = self.forcing[j].frequency;
                let (real, imaginary) = (
                    self.stiffness - self.mass * frequency * frequency,
                    damping * frequency,
                );
                let size = real * real + imaginary * imaginary;
                [real / size, imaginary / size]
            }),
        }
    }

    /// The friction force that holds the mass on the drive, from position `x` at `clock`.
    pub fn stick(&self, clock: Clock, x: f64) -> Stick<H> {
        self.held(clock, x, self.drive_velocity)
    }

    /// The friction force that holds the mass at the velocity `v`, from position `x` at `clock`.
    pub fn held(&self, clock: Clock, x: f64, v: f64) -> Stick<H> {
        self.held_against(&self.forces(clock), x, v)
    }

    /// [`Frame::held`] from where the harmonic forces are known.
    pub(crate) fn held_against(&self, forces: &[[f64; 2]; H], x: f64, v: f64) -> Stick<H> {
        Stick {
            frequency: self.frequency(),
            start: self.damping * v + self.stiffness * x - self.constant,
            rate: self.stiffness * v,
            p: forces.map(|force| -force[0]),
            q: forces.map(|force| -force[1]),
        }
    }

    fn frequency(&self) -> [f64; H] {
        std::array::from_fn(|j| self.forcing[j].frequency)
    }
}

/// All of a motion along a piece of friction that depends on its slope alone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Response<const H: usize> {
    pub(crate) slope: f64,
    decay: Decay,
    /// What a unit of each force displaces in and behind its phase.
    gain: [[f64; 2]; H],
}

impl<const H: usize> Response<H> {
    /// The motion from (x, v) under `forces`.
    #[inline]
    pub(crate) fn from(
        &self,
        frame: &Frame<H>,
        forces: &[[f64; 2]; H],
        (x, v): (f64, f64),
        direction: f64,
        piece: &Piece,
    ) -> Slip<H> {
        let (decay, frequency) = (self.decay, frame.frequency());
        let (mut p, mut q) = ([0.0; H], [0.0; H]);
        for j in 0..H {
            let ([force_cos, force_sin], [within, behind]) = (forces[j], self.gain[j]);
            p[j] = force_cos * within - force_sin * behind;
            q[j] = force_sin * within + force_cos * behind;
        }
        let push = direction * piece.offset + piece.slope * frame.drive_velocity + frame.constant;
        let constant = push / frame.stiffness;
        let start = x;
        let free_position = x - constant - p.iter().sum::<f64>();
        let free_velocity = v - (0..H).map(|j| frequency[j] * q[j]).sum::<f64>();
        let x = Signal {
            constant,
            free: decay.coefficients(free_position, free_velocity),
            p,
            q,
        };
        Slip {
            decay,
            frequency,
            start,
            x,
            v: x.derivative(&decay, &frequency),
        }
    }
}

#[inline]
fn waves<const H: usize>(frequency: &[f64; H], t: f64) -> ([f64; H], [f64; H]) {
    if t == 0.0 {
        return ([1.0; H], [0.0; H]);
    }
    let (mut cos, mut sin) = ([0.0; H], [0.0; H]);
    for j in 0..H {
        (sin[j], cos[j]) = sin_cos(frequency[j] * t);
    }
    (cos, sin)
}

impl<const H: usize> Slip<H> {
    /// Whether the numbers it is made of are in the range of double precision: of all, these are the largest.
    pub(crate) fn is_finite(&self) -> bool {
        let [a, b] = self.v.free;
        (a + b).is_finite()
    }

    /// The functions of time at τ = t.
    #[inline]
    pub fn basis(&self, t: f64) -> Basis<H> {
        let (c, s) = if t == 0.0 && !self.decay.separates() {
            (1.0, 0.0)
        } else {
            self.decay.basis(t)
        };
        let (cos, sin) = waves(&self.frequency, t);
        Basis { c, s, cos, sin }
    }

    /// The position at τ = t. Where friction is steep, or the spring soft beside the damping, the mass rests far away, so that a
    /// sum that begins there would lose the digits of the way made: it is counted from the start.
    #[inline]
    pub fn position(&self, t: f64, basis: &Basis<H>) -> f64 {
        if self.decay.separates() {
            self.position_from_start(t, basis)
        } else {
            self.x.at(basis)
        }
    }

    #[cold]
    fn position_from_start(&self, t: f64, basis: &Basis<H>) -> f64 {
        let ((slow, fast), [a, b]) = (self.decay.roots(), self.x.free);
        let mut x = self.start + (a * exp_m1(slow * t) + b * exp_m1(fast * t));
        for j in 0..H {
            x += self.x.p[j] * (basis.cos[j] - 1.0) + self.x.q[j] * basis.sin[j];
        }
        x
    }

    /// The slip speed u = σ (s − ẋ) as a signal.
    pub fn speed(&self, direction: f64, drive_velocity: f64) -> Signal<H> {
        Signal {
            constant: direction * drive_velocity,
            free: self.v.free.map(|value| -direction * value),
            p: self.v.p.map(|value| -direction * value),
            q: self.v.q.map(|value| -direction * value),
        }
    }
}

impl<const H: usize> Stick<H> {
    /// The holding force, its rate and its second derivative.
    #[inline]
    pub fn at(&self, t: f64) -> (f64, f64, f64) {
        let (cos, sin) = self.waves(t);
        let (mut force, mut rate, mut curvature) = (self.start + self.rate * t, self.rate, 0.0);
        for j in 0..H {
            let wave = self.p[j] * cos[j] + self.q[j] * sin[j];
            force += wave;
            rate += self.frequency[j] * (self.q[j] * cos[j] - self.p[j] * sin[j]);
            curvature -= self.frequency[j] * self.frequency[j] * wave;
        }
        (force, rate, curvature)
    }

    /// How far the holding force and a `limit` may be apart at `t` by rounding alone.
    #[inline]
    pub(crate) fn rounding(&self, t: f64, limit: f64) -> f64 {
        let waves: f64 = (0..H).map(|j| self.p[j].abs() + self.q[j].abs()).sum();
        4.0 * f64::EPSILON * (limit + self.start.abs() + (self.rate * t).abs() + waves)
    }

    /// cos Ωτ and sin Ωτ at τ = t.
    #[inline]
    pub(crate) fn waves(&self, t: f64) -> ([f64; H], [f64; H]) {
        waves(&self.frequency, t)
    }

    /// The same with further harmonics of no size.
    pub(crate) fn padded(&self) -> Stick<MOST_HARMONICS> {
        let pad = |of: &[f64; H]| std::array::from_fn(|j| of.get(j).copied().unwrap_or(0.0));
        Stick {
            frequency: pad(&self.frequency),
            start: self.start,
            rate: self.rate,
            p: pad(&self.p),
            q: pad(&self.q),
        }
    }

    /// A bound of the second derivative of the holding force.
    pub(crate) fn curvature_bound(&self) -> f64 {
        (0..H)
            .map(|j| {
                self.frequency[j] * self.frequency[j] * (self.p[j] * self.p[j] + self.q[j] * self.q[j]).sqrt()
            })
            .sum()
    }
}
