//! Static friction that grows while the contact rests.

use serde::{Deserialize, Serialize};

use super::{Adhesion, Friction, Hold, Memory, Piece, StaticFriction};
use crate::error::{Error, not_negative, positive};

/// f_s(t_s) = f_k + Δ∞ (1 − exp(−γ t_s^m)), F = f_k sgn w in motion (Kato, Sato & Matsubayashi, Wear 20 (1972) 315).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DwellTime {
    /// Kinetic force f_k.
    pub kinetic: f64,
    /// Growth of static friction after an infinite rest, Δ∞.
    pub limit: f64,
    /// Rate γ, 1/time^m.
    pub rate: f64,
    /// Exponent m.
    #[serde(default = "crate::law::one")]
    pub exponent: f64,
}

impl DwellTime {
    fn static_friction(&self) -> StaticFriction {
        StaticFriction {
            limit: self.limit,
            rate: self.rate,
            exponent: self.exponent,
            ..StaticFriction::constant(self.kinetic)
        }
    }
}

impl Friction for DwellTime {
    fn validate(&self) -> Result<(), Error> {
        not_negative("kinetic", self.kinetic)?;
        not_negative("limit", self.limit)?;
        positive("rate", self.rate)?;
        positive("exponent", self.exponent).map(drop)
    }

    fn break_away(&self, hold: Hold) -> f64 {
        self.static_friction().force(hold)
    }

    fn adhesion(&self, hold: Hold) -> Adhesion {
        self.static_friction().at(hold)
    }

    fn growth_bound(&self, stick_time: f64) -> f64 {
        self.static_friction().growth_bound(stick_time)
    }

    fn begin(&self, _u: f64, _balance: f64, _memory: &mut Memory) -> Piece {
        Piece::constant(self.kinetic)
    }
}
