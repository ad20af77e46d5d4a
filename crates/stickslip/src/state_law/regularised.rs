//! A memoryless law whose sign is smoothed: what other codes call friction, offered under its name.

use serde::{Deserialize, Serialize};

use super::StateFriction;
use crate::elementary::{atan, tanh};
use crate::error::{Error, positive};
use crate::law::{Friction, Law, Memory};

/// The smooth sign.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Shape {
    /// (2/π) arctan(w/width).
    #[default]
    Arctan,
    /// tanh(w/width).
    Tanh,
}

/// F = s(w/width) f(|w|) with the kinetic force f of a memoryless law. It creeps where the law itself would stick.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Regularised {
    /// The law whose kinetic force is used.
    pub law: Law,
    /// Slip velocity over which the sign changes.
    pub width: f64,
    /// The smooth sign.
    #[serde(default)]
    pub shape: Shape,
}

impl StateFriction for Regularised {
    fn validate(&self) -> Result<(), Error> {
        self.law.validate()?;
        positive("width", self.width)?;
        let piece = self.law.begin(0.0, f64::INFINITY, &mut Memory::default());
        if piece.turns || self.law.feels_force_rate() || self.law.growth_bound(0.0) > 0.0 {
            return Err(Error::Remembers);
        }
        Ok(())
    }

    fn has_state(&self) -> bool {
        false
    }

    fn rates(&self, w: f64, _z: f64) -> (f64, f64) {
        let u = w.abs();
        let piece = self.law.begin(u, f64::INFINITY, &mut Memory::default());
        let sign = match self.shape {
            Shape::Arctan => std::f64::consts::FRAC_2_PI * atan(w / self.width),
            Shape::Tanh => tanh(w / self.width),
        };
        (sign * self.law.force(&piece, u), 0.0)
    }

    fn steady(&self, _w: f64) -> f64 {
        0.0
    }

    fn advance(&self, _w: f64, z: f64, _time: f64) -> f64 {
        z
    }
}
