//! A harmonic of the drive velocity or of a force.

use serde::{Deserialize, Serialize};

use crate::clock::Clock;
use crate::elementary::sin_cos;
use crate::error::{Error, finite, not_negative};
use crate::series::Series;

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
    /// amplitude · cos(frequency · t + phase).
    #[must_use]
    pub fn new(amplitude: f64, frequency: f64, phase: f64) -> Self {
        Self {
            amplitude,
            frequency,
            phase,
        }
    }

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

/// Add factor · A cos(Ω (clock + h) + φ).
pub(crate) fn add_wave(harmonic: &Harmonic, clock: Clock, factor: f64, series: &mut Series) {
    let (mut even, mut odd) = harmonic.quadratures(clock);
    even *= factor;
    odd *= factor * harmonic.frequency;
    let square = harmonic.frequency * harmonic.frequency;
    for (index, pair) in series.chunks_mut(2).enumerate() {
        let k = (2 * index) as f64;
        pair[0] += even;
        even *= -square / ((k + 1.0) * (k + 2.0));
        if let Some(second) = pair.get_mut(1) {
            *second += odd;
            odd *= -square / ((k + 2.0) * (k + 3.0));
        }
    }
}
