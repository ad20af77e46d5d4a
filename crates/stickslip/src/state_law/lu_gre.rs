//! Bristles that bend, yield along a Stribeck curve and damp.

use serde::{Deserialize, Serialize};

use super::StateFriction;
use crate::elementary::{exp, power};
use crate::error::{Error, not_negative, positive};

/// ż = w − σ₀ |w| z/g(w), F = σ₀ z + σ₁ ż + σ₂ w, g(w) = f_k + (f_s − f_k) exp(−|w/w_s|^n).
///
/// Canudas de Wit, Olsson, Åström & Lischinsky, IEEE Trans. Automatic Control 40 (1995) 419.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LuGre {
    /// Stiffness of the bristles, σ₀.
    pub stiffness: f64,
    /// Damping of the bristles, σ₁.
    pub damping: f64,
    /// Viscous friction, σ₂.
    pub viscous: f64,
    /// Friction f_k of fast steady slip.
    pub kinetic: f64,
    /// Friction f_s of vanishing steady slip.
    pub break_away: f64,
    /// Velocity w_s over which friction falls.
    pub scale: f64,
    /// Exponent n of the fall, 2 as a rule.
    #[serde(default = "two")]
    pub exponent: f64,
}

fn two() -> f64 {
    2.0
}

impl LuGre {
    /// g(w), the curve of steady slip that the bristles approach.
    pub(super) fn curve(&self, w: f64) -> f64 {
        let ratio = (w / self.scale).abs();
        self.kinetic + (self.break_away - self.kinetic) * exp(-power(ratio, self.exponent))
    }
}

impl StateFriction for LuGre {
    fn validate(&self) -> Result<(), Error> {
        positive("stiffness", self.stiffness)?;
        not_negative("damping", self.damping)?;
        not_negative("viscous", self.viscous)?;
        positive("kinetic", self.kinetic)?;
        positive("break_away", self.break_away)?;
        positive("scale", self.scale)?;
        positive("exponent", self.exponent).map(drop)
    }

    fn rates(&self, w: f64, z: f64) -> (f64, f64) {
        let rate = w - self.stiffness * w.abs() * z / self.curve(w);
        (self.stiffness * z + self.damping * rate + self.viscous * w, rate)
    }

    fn steady(&self, w: f64) -> f64 {
        if w == 0.0 {
            0.0
        } else {
            self.curve(w).copysign(w) / self.stiffness
        }
    }

    fn advance(&self, w: f64, z: f64, time: f64) -> f64 {
        let steady = self.steady(w);
        let distance = self.stiffness * (w * time).abs() / self.curve(w);
        steady + (z - steady) * exp(-distance)
    }
}
