//! The free motion of one mass under linear damping: two functions of time, and the exponents that bound them.

use crate::elementary::{exp, exp_m1, sin_cos};

/// How m ẍ + c ẋ + k x decays: γ = c/2m, κ = γ² − k/m, ω = √|κ|.
#[derive(Clone, Copy, Debug)]
pub struct Decay {
    /// γ = c/2m.
    pub gamma: f64,
    pub(crate) kappa: f64,
    /// ω = √|γ² − k/m|.
    pub omega: f64,
    /// 1/ω.
    pub(crate) per_omega: f64,
    /// k/m.
    pub(crate) natural_squared: f64,
    separates: bool,
}

/// Below this ratio of ω to γ the two exponents count as one.
const NEARLY_CRITICAL: f64 = 1e-3;
/// Above this ratio of ω to γ a motion that does not oscillate is the sum of its two exponentials.
const SEPARATE_EXPONENTS: f64 = 0.1;

impl Decay {
    /// Of mass, damping and stiffness.
    #[must_use]
    pub fn new(mass: f64, damping: f64, stiffness: f64) -> Self {
        let gamma = 0.5 * damping / mass;
        let natural_squared = stiffness / mass;
        let kappa = gamma * gamma - natural_squared;
        let omega = kappa.abs().sqrt();
        Self {
            gamma,
            kappa,
            omega,
            per_omega: 1.0 / omega,
            natural_squared,
            separates: kappa > 0.0 && omega > SEPARATE_EXPONENTS * gamma.abs(),
        }
    }

    /// Whether the free motion oscillates.
    pub fn oscillates(&self) -> bool {
        self.kappa < 0.0
    }

    /// The time in which the free motion changes much.
    pub(crate) fn time(&self) -> f64 {
        1.0 / self.omega.max(self.gamma.abs())
    }

    /// No exponent of the free motion is larger in size.
    #[inline]
    pub(crate) fn fastest(&self) -> f64 {
        self.omega + self.gamma.abs()
    }

    /// The sizes of the exponents −γ ± √κ.
    pub(crate) fn exponents(&self) -> [f64; 2] {
        if self.omega < NEARLY_CRITICAL * self.gamma.abs() || self.oscillates() {
            [self.natural_squared.sqrt(); 2]
        } else {
            let (one, two) = self.roots();
            [one.abs(), two.abs()]
        }
    }

    /// A free motion that has `value` and `rate` now is at any later time, as is each of its first eight derivatives, no
    /// larger than Σ amplitude · |exponent|ⁿ: these are its amplitudes. One that grows was no larger up to now.
    pub(crate) fn amplitudes(&self, value: f64, rate: f64) -> [f64; 2] {
        if self.omega < NEARLY_CRITICAL * self.gamma.abs() {
            // Nearly critical: value + (rate + γ value) t times an exponential.
            let amplitude = value.abs() + 16.0 * ((rate + self.gamma * value) / self.gamma).abs();
            return [1.1 * amplitude, 0.0];
        }
        if self.oscillates() {
            return [value.abs(), ((rate + self.gamma * value) * self.per_omega).abs()];
        }
        let (one, two) = self.roots();
        let first = (rate - two * value) / (one - two);
        [first.abs(), (value - first).abs()]
    }

    /// The same of one that has these coefficients.
    #[inline]
    pub(crate) fn amplitudes_of(&self, [a, b]: [f64; 2]) -> [f64; 2] {
        if self.separates() {
            [a.abs(), b.abs()]
        } else {
            self.amplitudes(a, b - self.gamma * a)
        }
    }

    /// The exponent at which a free motion can grow; 0 where it decays.
    pub(crate) fn growing(&self) -> f64 {
        if self.gamma >= 0.0 {
            0.0
        } else if self.oscillates() {
            -self.gamma
        } else {
            self.omega - self.gamma
        }
    }

    /// How much a free motion can have grown after `t`.
    pub(crate) fn growth(&self, t: f64) -> f64 {
        exp(self.growing() * t)
    }

    /// The two real exponents of a motion that does not oscillate, the smaller in size first.
    pub(crate) fn roots(&self) -> (f64, f64) {
        let fast = -(self.gamma + self.omega.copysign(self.gamma));
        (self.natural_squared / fast, fast)
    }

    /// Whether a free motion is written as the sum of its two exponentials. Under heavy damping that alone is exact: the rate
    /// of e^{−γτ} (a C + b S) would be a small difference of large terms.
    #[inline]
    pub(crate) fn separates(&self) -> bool {
        self.separates
    }

    /// The two functions a free motion is made of, at τ = t: e^{−γτ} C and e^{−γτ} S, where C, S = cos ωτ, sin(ωτ)/ω or their
    /// hyperbolic or linear counterparts; or, where it [separates](Decay::separates), the slow and the fast exponential.
    #[inline]
    pub(crate) fn basis(&self, t: f64) -> (f64, f64) {
        if self.oscillates() {
            let decay = exp(-self.gamma * t);
            let (sin, cos) = sin_cos(self.omega * t);
            return (decay * cos, decay * sin * self.per_omega);
        }
        let (slow, fast) = self.roots();
        let (slow, fast) = (exp(slow * t), exp(fast * t));
        if self.separates() {
            return (slow, fast);
        }
        let (upper, spread) = (slow.max(fast), 2.0 * self.omega * t);
        let s = if spread > f64::EPSILON {
            -exp_m1(-spread) * (0.5 * self.per_omega)
        } else {
            t
        };
        (0.5 * (slow + fast), upper * s)
    }

    /// The coefficients of the free motion that has this value and rate at τ = 0.
    #[inline]
    pub(crate) fn coefficients(&self, value: f64, rate: f64) -> [f64; 2] {
        if self.separates() {
            let (slow, fast) = self.roots();
            let width = slow - fast;
            return [(rate - fast * value) / width, (slow * value - rate) / width];
        }
        [value, rate + self.gamma * value]
    }

    /// The coefficients of its derivative.
    #[inline]
    pub(crate) fn derivative(&self, [a, b]: [f64; 2]) -> [f64; 2] {
        if self.separates() {
            let (slow, fast) = self.roots();
            return [slow * a, fast * b];
        }
        [b - self.gamma * a, self.kappa * a - self.gamma * b]
    }

    /// Its value at τ = 0.
    #[inline]
    pub(crate) fn start(&self, [a, b]: [f64; 2]) -> f64 {
        if self.separates() { a + b } else { a }
    }
}
