//! What acts on the mass from outside: harmonics of the drive velocity and of the force.

use serde::{Deserialize, Serialize};

use crate::elementary::{add, product, sin_cos, whole_turns_less};
use crate::error::{Error, finite, not_negative};

/// The most harmonics one oscillator carries; each is a compile-time slot of the closed-form flow.
pub const MOST_HARMONICS: usize = 4;

/// One harmonic, amplitude · cos(frequency · t + phase); one of the frequency 0 is constant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Harmonic {
    /// Amplitude, in the unit of what it is added to (force).
    pub amplitude: f64,
    /// Angular frequency Ω, 1/time.
    pub frequency: f64,
    /// Phase at t = 0, rad.
    #[serde(default)]
    pub phase: f64,
}

impl Harmonic {
    pub(crate) fn validate(&self) -> Result<(), Error> {
        finite("forcing amplitude", self.amplitude)?;
        not_negative("forcing frequency", self.frequency)?;
        finite("forcing phase", self.phase)?;
        Ok(())
    }

    /// Whether it varies with time.
    pub(crate) fn swings(&self) -> bool {
        self.frequency > 0.0
    }

    /// The coefficients (P, Q) of P cos Ωτ + Q sin Ωτ when τ is counted from `clock`.
    pub(crate) fn quadratures(&self, clock: Clock) -> (f64, f64) {
        let (sin, cos) = sin_cos(clock.angle(self.frequency) + self.phase);
        (self.amplitude * cos, -self.amplitude * sin)
    }
}

/// Time as an unevaluated sum of two doubles: thousands of segments add up without losing the last digit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Clock {
    /// The rounded time.
    pub high: f64,
    /// What rounding took.
    pub low: f64,
}

impl Clock {
    /// This time plus `step`, rounded only in the low part.
    #[must_use]
    pub fn after(self, step: f64) -> Self {
        let (high, low) = add((self.high, self.low), (step, 0.0));
        Self { high, low }
    }

    /// `t` minus this time.
    #[must_use]
    pub fn until(self, t: f64) -> f64 {
        (t - self.high) - self.low
    }

    /// frequency · time reduced to (−π, π], good to an ulp for any number of turns.
    fn angle(self, frequency: f64) -> f64 {
        let (turned, rounding) = product(frequency, self.high);
        whole_turns_less(turned, rounding + frequency * self.low)
    }
}

#[cfg(test)]
mod tests {
    use super::Clock;

    #[test]
    fn ten_million_tenths_make_a_million() {
        let mut clock = Clock::default();
        for _ in 0..10_000_000 {
            clock = clock.after(0.1);
        }
        // 0.1 is not a tenth in binary: the exact sum exceeds 10^6 by 10^7 (0.1₂ − 1/10).
        let excess = 1e7 * 5.551_115_123_125_783e-18;
        assert!((clock.until(1e6) + excess).abs() < 1e-16);
    }

    #[test]
    fn angle_keeps_its_digits_after_many_turns() {
        let clock = Clock { high: 1e9, low: 0.0 };
        // cos(10^9) to 17 digits (computed with 50 digits).
        assert!((clock.angle(1.0).cos() - 0.837_887_181_363_902_4).abs() < 1e-15);
    }
}
