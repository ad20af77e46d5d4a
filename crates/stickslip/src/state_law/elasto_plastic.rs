//! Bristles that are purely elastic at first, so that a stuck contact does not drift.

use serde::{Deserialize, Serialize};

use super::{StateFriction, stribeck};
use crate::error::{Error, not_negative, positive};

/// ż = w (1 − α(z, w) z/z∞(w)), F = σ₀ z + σ₁ ż + σ₂ w, z∞ = g(w) sgn w/σ₀, g as for [`super::LuGre`].
///
/// α = 0 where |z| ≤ z_e or z and w differ in sign, 1 where |z| ≥ |z∞|, and ½ + ½ sin π (|z| − (|z∞| + z_e)/2)/(|z∞| − z_e)
/// between. Dupont, Hayward, Armstrong & Altpeter, IEEE Trans. Automatic Control 47 (2002) 787.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ElastoPlastic {
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
    /// The force up to which the contact is purely elastic, σ₀ z_e.
    pub elastic: f64,
    /// Exponent n of the fall, 2 as a rule.
    #[serde(default = "two")]
    pub exponent: f64,
}

fn two() -> f64 {
    2.0
}

impl ElastoPlastic {
    fn curve(&self, w: f64) -> f64 {
        stribeck::curve(w, self.break_away, self.kinetic, self.scale, self.exponent)
    }

    /// α for a bristle force σ₀ |z|.
    fn plastic(&self, force: f64, bears: f64) -> f64 {
        if force <= self.elastic {
            0.0
        } else if force >= bears {
            1.0
        } else {
            let middle = 0.5 * (bears + self.elastic);
            0.5 + 0.5 * (std::f64::consts::PI * (force - middle) / (bears - self.elastic)).sin()
        }
    }
}

impl StateFriction for ElastoPlastic {
    fn validate(&self) -> Result<(), Error> {
        positive("stiffness", self.stiffness)?;
        not_negative("damping", self.damping)?;
        not_negative("viscous", self.viscous)?;
        positive("kinetic", self.kinetic)?;
        positive("break_away", self.break_away)?;
        positive("scale", self.scale)?;
        positive("exponent", self.exponent)?;
        not_negative("elastic", self.elastic)?;
        let weakest = self.kinetic.min(self.break_away);
        if self.elastic >= weakest {
            return Err(Error::ElasticBeyondSlip {
                elastic: self.elastic,
                weakest,
            });
        }
        Ok(())
    }

    fn rates(&self, w: f64, z: f64) -> (f64, f64) {
        let bears = self.curve(w);
        let force = self.stiffness * z;
        let yielding = if z * w > 0.0 {
            self.plastic(force.abs(), bears)
        } else {
            0.0
        };
        let rate = w * (1.0 - yielding * force.abs() / bears);
        (force + self.damping * rate + self.viscous * w, rate)
    }

    fn steady(&self, w: f64) -> f64 {
        if w == 0.0 {
            0.0
        } else {
            self.curve(w).copysign(w) / self.stiffness
        }
    }

    fn pace(&self, w: f64) -> f64 {
        let bears = self.curve(w);
        let slope = 0.5 * std::f64::consts::PI / (bears - self.elastic) + 1.0 / bears;
        self.stiffness * w.abs() * slope
    }
}
