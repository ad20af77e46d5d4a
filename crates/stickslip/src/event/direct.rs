//! The end of unforced slip from at most one evaluation of the motion, where a guess in closed form is good enough.
//!
//! The slip acceleration vanishes every half period, or at most once where the motion does not oscillate. So its signs at
//! the start and at a root say how often it vanished between: if not at all or once, the root is the first. What is not
//! decided so is left to the search between extrema.

use std::f64::consts::PI;

use super::search::{integral, polynomial, rounding_of};
use super::{Arrival, SlipPhase, Start};
use crate::elementary::angle;
use crate::flow::decay::Decay;
use crate::law::End;
use crate::series::INVERSE;
use crate::watch::Watched;

/// Degree of the Taylor polynomial at the start of slip, and at a sample beside the root.
const START_DEGREE: usize = 12;
const ROOT_DEGREE: usize = 8;
/// In units of the time in which the motion changes: how far the first is good to rounding, how far it is a good guess.
const EXACT_REACH: f64 = 0.3;
const GUESS_REACH: f64 = 2.0;
/// How far the second is good to rounding, and how far Householder's step is.
const NEAR_ROOT: f64 = 0.05;
const HOUSEHOLDER_REACH: f64 = 1e-4;
/// A motion whose amplitude changes by less than this in a radian is nearly a cosine.
const SLOW_DECAY: f64 = 0.3;

/// The slip speed about its rest value: its value and rate at the start, and its coefficients and those of its rate.
pub(super) struct Direct<'a, const H: usize> {
    phase: &'a SlipPhase<'a, H>,
    decay: &'a Decay,
    value: f64,
    rate: f64,
    u: [f64; 2],
    du: [f64; 2],
}

/// Taylor coefficients of a free motion from its value and rate.
fn coefficients<const N: usize>(decay: &Decay, value: f64, rate: f64) -> [f64; N] {
    let mut coefficients = [0.0; N];
    (coefficients[0], coefficients[1]) = (value, rate);
    for k in 2..N {
        let damped = 2.0 * decay.gamma * coefficients[k - 1];
        coefficients[k] =
            -(damped + decay.natural_squared * coefficients[k - 2] * INVERSE[k - 1]) * INVERSE[k];
    }
    coefficients
}

/// Newton's step from `step` and the slope there, until it is below `settled`.
fn root(coefficients: &[f64], target: f64, mut step: f64, settled: f64) -> Option<(f64, f64)> {
    for _ in 0..5 {
        let [value, slope, _] = polynomial(coefficients, step);
        let newton = (target - value) / slope;
        step += newton;
        if newton.abs() <= settled {
            return Some((step, slope));
        }
    }
    None
}

impl<'a, const H: usize> Direct<'a, H> {
    pub(super) fn new(phase: &'a SlipPhase<'a, H>) -> Self {
        let decay = &phase.slip.decay;
        let mut u = phase.slip.v.free.map(|value| -phase.direction * value);
        let value = decay.start(u);
        if phase.start == Start::Reversal {
            u = decay.coefficients(value, 0.0);
        }
        let du = decay.derivative(u);
        Self {
            phase,
            decay,
            value,
            rate: decay.start(du),
            u,
            du,
        }
    }

    /// When and how the phase ends, if that is found at once.
    pub(super) fn end(&self, work: &mut Watched) -> Option<Arrival> {
        let SlipPhase { piece, start, .. } = *self.phase;
        let rest = self.phase.direction * self.phase.drive_velocity;
        let (low, high) = (piece.low - rest, piece.high - rest);
        let curvature = -2.0 * self.decay.gamma * self.rate - self.decay.natural_squared * self.value;
        let sense = if start == Start::Reversal {
            curvature
        } else {
            self.rate
        }
        .signum();
        let contrary = (start == Start::Low && sense < 0.0) || (start == Start::High && sense > 0.0);
        let ends = [(low, End::Low), (high, End::High)];
        let (ahead, behind) = (ends[usize::from(sense > 0.0)], ends[usize::from(sense < 0.0)]);
        let distance = sense * (ahead.0 - self.value);
        if contrary || distance <= 0.0 {
            return None;
        }
        if distance.is_finite()
            && let Some(arrival) = self.ahead(sense, curvature, ahead, work)
        {
            return Some(arrival);
        }
        let passes = distance.is_finite() && self.decay.gamma < 0.0;
        if piece.reverses || passes || !behind.0.is_finite() {
            return None;
        }
        self.behind(sense, ahead.0, behind, work)
    }

    /// The end towards which the slip speed goes, before it turns.
    fn ahead(
        &self,
        sense: f64,
        curvature: f64,
        (target, end): (f64, End),
        work: &mut Watched,
    ) -> Option<Arrival> {
        let distance = target - self.value;
        let discriminant = self.rate * self.rate + 2.0 * curvature * distance;
        if discriminant < 0.0 {
            return None;
        }
        let guess = 2.0 * distance / (self.rate + discriminant.sqrt().copysign(sense));
        let unit = 1.0 / self.decay.fastest();
        if guess.is_nan() || guess >= GUESS_REACH * unit {
            return None;
        }
        let polynomial: [f64; START_DEGREE + 1] = coefficients(self.decay, self.value, self.rate);
        let near = guess < EXACT_REACH * unit;
        let settled = if near { 1e-8 * guess } else { 1e-4 * unit };
        let (t, slope) = root(&polynomial, target, guess, settled)?;
        if t <= 0.0 || slope * sense <= 0.0 {
            return None;
        }
        if t < EXACT_REACH * unit && near {
            let start = self.phase.slip.start;
            return Some(self.arrive(
                t,
                end,
                start - self.phase.direction * integral(&polynomial, t),
                target,
            ));
        }
        let turns = if self.decay.oscillates() {
            PI
        } else {
            f64::INFINITY
        };
        self.beside(t, target, end, (sense, turns), work)
    }

    /// The other end, after the slip speed turned once at a distance from the first.
    fn behind(
        &self,
        sense: f64,
        ahead: f64,
        (target, end): (f64, End),
        work: &mut Watched,
    ) -> Option<Arrival> {
        let decay = self.decay;
        let slow = decay.gamma * decay.per_omega;
        if !(decay.oscillates() && slow.abs() < SLOW_DECAY) {
            return None;
        }
        // sense · u = e^{−γτ} amplitude cos(ωτ − phase), and at the root ωτ − phase is beyond 0.
        let (cosine, sine) = (sense * self.u[0], sense * self.u[1] * decay.per_omega);
        let square = cosine * cosine + sine * sine;
        let share = sense * target;
        let rest = square - share * share;
        if rest <= 0.0 || square >= ahead * ahead || sine <= 0.0 {
            return None;
        }
        let height = rest.sqrt();
        let mut turn = angle(cosine, sine) + angle(share, height);
        // That is the root without decay; Halley's step for e^{−γτ} cos(ωτ − phase) = share with it.
        let grown = slow * turn;
        let grown = 1.0 + grown * (1.0 + grown * (0.5 + grown * (1.0 / 6.0)));
        let (value, first) = (share * (1.0 - grown), -(slow * share + height));
        let newton = value / first;
        let second = (slow * slow - 1.0) * share + 2.0 * slow * height;
        turn -= newton / (1.0 - 0.5 * newton * second / first);
        self.beside(turn * decay.per_omega, target, end, (-sense, 2.0 * PI), work)
    }

    /// The root beside `t`, if the motion goes in this sense there and its angle is below `angle`.
    #[expect(
        clippy::inline_always,
        reason = "a fiftieth of what an event costs: every slip goes through here once"
    )]
    #[inline(always)]
    fn beside(
        &self,
        mut t: f64,
        target: f64,
        end: End,
        (sense, angle): (f64, f64),
        work: &mut Watched,
    ) -> Option<Arrival> {
        let decay = self.decay;
        let fastest = decay.fastest();
        for _ in 0..3 {
            if t.is_nan() || t <= 0.0 {
                return None;
            }
            work.evaluations += 1;
            let basis = self.phase.slip.basis(t);
            let value = self.u[0] * basis.c + self.u[1] * basis.s;
            let rate = self.du[0] * basis.c + self.du[1] * basis.s;
            let curvature = -2.0 * decay.gamma * rate - decay.natural_squared * value;
            let jerk = -2.0 * decay.gamma * curvature - decay.natural_squared * rate;
            // Householder's method of the third order.
            let newton = (target - value) / rate;
            let (half, third) = (newton * curvature, newton * newton * jerk);
            let step = newton * (rate + 0.5 * half) / (rate + half + third * (1.0 / 6.0));
            let far = step.abs() * fastest;
            let x = self.phase.slip.position(t, &basis);
            // Householder's step can vanish far from any root: what it leaves must be rounding.
            let left = value - target + step * (rate + step * (0.5 * curvature + step * (1.0 / 6.0) * jerk));
            let rounding = rounding_of([self.u[0] * basis.c, self.u[1] * basis.s, target]);
            if t + step <= 0.0 {
                return None;
            }
            let (step, slope, travel) = if far < HOUSEHOLDER_REACH && left.abs() <= rounding {
                let travel = step * (value + step * (0.5 * rate + step * (1.0 / 6.0) * curvature));
                (step, rate + step * curvature, travel)
            } else {
                work.fallbacks += u64::from(far < HOUSEHOLDER_REACH);
                if far >= NEAR_ROOT {
                    t += step;
                    continue;
                }
                let polynomial: [f64; ROOT_DEGREE + 1] = coefficients(decay, value, rate);
                let guess = step;
                let (step, slope) = root(&polynomial, target, guess, 1e-8 * guess.abs())?;
                if t + step <= 0.0 || step.abs() > 2.0 * guess.abs() {
                    return None;
                }
                (step, slope, integral(&polynomial, step))
            };
            t += step;
            return (slope * sense > 0.0 && t * decay.omega < angle)
                .then(|| self.arrive(t, end, x - self.phase.direction * travel, target));
        }
        None
    }

    /// v = −σ (u less its rest value).
    fn arrive(&self, t: f64, end: End, x: f64, speed: f64) -> Arrival {
        Arrival {
            t,
            end,
            x,
            v: -self.phase.direction * speed,
        }
    }
}
