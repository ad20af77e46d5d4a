//! The normal force of a contact that varies with time, position or velocity.

use serde::{Deserialize, Serialize};

use crate::clock::Clock;
use crate::error::{Error, finite};
use crate::harmonic::Harmonic;
use crate::harmonic::add_wave;
use crate::series::Series;

/// The normal force of a contact relative to that of its law, n = constant + Σ A cos(Ω t + φ) + position · x + velocity · ẋ,
/// and 0 where that is negative: friction is n times that of the law, at rest and in motion. x and ẋ are those of the mass, for a
/// contact of two masses those of the mass less those of the other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NormalForce {
    /// The constant part.
    #[serde(default = "crate::law::one")]
    pub constant: f64,
    /// What varies with time.
    #[serde(default)]
    pub harmonics: Vec<Harmonic>,
    /// ∂n/∂x.
    #[serde(default)]
    pub position: f64,
    /// ∂n/∂ẋ.
    #[serde(default)]
    pub velocity: f64,
}

impl NormalForce {
    pub(crate) fn validate(&self) -> Result<(), Error> {
        finite("the constant of the normal force", self.constant)?;
        finite("the position factor of the normal force", self.position)?;
        finite("the velocity factor of the normal force", self.velocity)?;
        self.harmonics.iter().try_for_each(Harmonic::validate)
    }

    /// The coefficients of what does not depend on the motion, from `clock` on.
    pub(crate) fn expand(&self, clock: Clock, series: &mut Series) {
        series.fill(0.0);
        series[0] = self.constant;
        for harmonic in &self.harmonics {
            add_wave(harmonic, clock, 1.0, series);
        }
    }

    /// Its value.
    pub(crate) fn at(&self, clock: Clock, x: f64, v: f64) -> f64 {
        let waves = self.harmonics.iter().map(|wave| wave.quadratures(clock).0);
        self.constant + waves.sum::<f64>() + self.position * x + self.velocity * v
    }

    /// The sizes of its parts, added up.
    pub(crate) fn size(&self, x: f64, v: f64) -> f64 {
        let waves = self.harmonics.iter().map(|wave| wave.amplitude.abs());
        self.constant.abs() + waves.sum::<f64>() + (self.position * x).abs() + (self.velocity * v).abs()
    }

    pub(crate) fn fastest(&self) -> f64 {
        let frequencies = self.harmonics.iter().map(|wave| wave.frequency);
        frequencies.fold(0.0, f64::max)
    }
}
