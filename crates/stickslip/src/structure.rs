//! The oscillator: one mass on a spring and a damper, rubbing on a drive.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::drive::{Harmonic, MOST_HARMONICS};
use crate::error::{Error, finite, not_negative, positive, read};
use crate::law::{Checked, Law};

/// m ẍ + D ẋ + k x = F(w, memory) + Σ A cos(Ω t + φ), w = s − ẋ; x is measured from the equilibrium of the moving drive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Oscillator<L = Law> {
    /// Mass m.
    pub mass: f64,
    /// Spring stiffness k.
    pub stiffness: f64,
    /// Viscous damping D.
    pub damping: f64,
    /// Drive velocity s.
    pub drive_velocity: f64,
    /// Friction between the mass and the drive.
    pub law: L,
    /// Harmonic forces on the mass.
    #[serde(default)]
    pub forcing: Vec<Harmonic>,
}

impl<L: Checked + DeserializeOwned> Oscillator<L> {
    /// An oscillator from its JSON document.
    ///
    /// # Errors
    /// What the document lacks, what it has too much, or the first value that makes no sense.
    pub fn from_json(document: &str) -> Result<Self, Error> {
        let oscillator: Self = read(document)?;
        oscillator.validate()?;
        Ok(oscillator)
    }

    /// Check every value.
    ///
    /// # Errors
    /// The first value that makes no sense.
    pub fn validate(&self) -> Result<(), Error> {
        positive("mass", self.mass)?;
        positive("stiffness", self.stiffness)?;
        not_negative("damping", self.damping)?;
        finite("drive_velocity", self.drive_velocity)?;
        if self.forcing.len() > MOST_HARMONICS {
            return Err(Error::TooManyHarmonics {
                most: MOST_HARMONICS,
                got: self.forcing.len(),
            });
        }
        for harmonic in &self.forcing {
            harmonic.validate()?;
        }
        self.law.check()
    }
}
