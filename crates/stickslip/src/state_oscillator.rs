//! The oscillator under a law with an internal state: the right-hand side that an integrator asks for.

use serde::{Deserialize, Serialize};

use crate::drive::Harmonic;
use crate::error::{Error, finite, not_negative, positive};
use crate::state_law::{StateFriction, StateLaw};

/// m ẍ + D ẋ + k x = F(w, z) + Σ A cos(Ω t + φ), ż = g(w, z), w = s − ẋ.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StateOscillator {
    /// Mass m.
    pub mass: f64,
    /// Stiffness k.
    pub stiffness: f64,
    /// Viscous damping D.
    pub damping: f64,
    /// Velocity of the drive, s.
    pub drive_velocity: f64,
    /// Friction.
    pub law: StateLaw,
    /// Harmonic forces.
    #[serde(default)]
    pub forcing: Vec<Harmonic>,
}

impl StateOscillator {
    /// An oscillator from its JSON document, checked.
    ///
    /// # Errors
    /// Where the document is none, or the first value that makes no sense.
    pub fn from_json(document: &str) -> Result<Self, Error> {
        let oscillator: Self = serde_json::from_str(document).map_err(|error| Error::Document {
            reason: error.to_string(),
        })?;
        oscillator.validate()?;
        Ok(oscillator)
    }

    /// Check every value.
    ///
    /// # Errors
    /// The first that makes no sense.
    pub fn validate(&self) -> Result<(), Error> {
        positive("mass", self.mass)?;
        positive("stiffness", self.stiffness)?;
        not_negative("damping", self.damping)?;
        finite("drive_velocity", self.drive_velocity)?;
        for harmonic in &self.forcing {
            harmonic.validate()?;
        }
        self.law.validate()
    }

    /// Time derivative of [x, w, z] and the friction force. The slip velocity is the variable rather than v = s − w, as a
    /// stiff law multiplies its rounding.
    #[must_use]
    pub fn rates(&self, t: f64, [x, w, z]: [f64; 3]) -> ([f64; 3], f64) {
        let (force, rate) = self.law.rates(w, z);
        let v = self.drive_velocity - w;
        let push: f64 = self
            .forcing
            .iter()
            .map(|harmonic| harmonic.amplitude * (harmonic.frequency * t + harmonic.phase).cos())
            .sum();
        let a = (force + push - self.damping * v - self.stiffness * x) / self.mass;
        ([v, -a, rate], force)
    }
}
