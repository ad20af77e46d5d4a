//! Friction that weakens exponentially with speed, with a viscous part.

use serde::{Deserialize, Serialize};

use super::static_kinetic::at_least_kinetic;
use super::{End, Friction, Hold, Memory, Piece};
use crate::error::{Error, finite, not_negative, positive};
use crate::series::{Grown, Series, exponential};

/// F(u) = f_k + (f_s − f_k) exp(−u/w_s) + b u, |F| ≤ f_s at rest (Tustin, J. IEE 94 (1947) 143).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExponentialStribeck {
    /// Break-away force f_s.
    pub break_away: f64,
    /// Kinetic force f_k at high speed, but for the viscous part.
    pub kinetic: f64,
    /// Slip speed w_s over which friction falls.
    pub scale: f64,
    /// Viscous coefficient b.
    #[serde(default)]
    pub viscous: f64,
}

impl Friction for ExponentialStribeck {
    fn validate(&self) -> Result<(), Error> {
        let kinetic = not_negative("kinetic", self.kinetic)?;
        at_least_kinetic(self.break_away, kinetic)?;
        positive("scale", self.scale)?;
        finite("viscous", self.viscous).map(drop)
    }

    fn break_away(&self, _hold: Hold) -> f64 {
        self.break_away
    }

    fn smooth(&self) -> bool {
        true
    }

    fn force(&self, _piece: &Piece, u: f64) -> f64 {
        self.kinetic + (self.break_away - self.kinetic) * (-u / self.scale).exp() + self.viscous * u
    }

    fn extend(&self, u: &Series, k: usize, grown: &mut Grown) -> f64 {
        let Grown { first, second } = grown;
        first[k] = exponential(-1.0 / self.scale, u, second, first, k);
        let rest = if k == 0 { self.kinetic } else { 0.0 };
        rest + (self.break_away - self.kinetic) * first[k] + self.viscous * u[k]
    }

    fn leave(&self, _force: f64, _memory: &mut Memory) -> Piece {
        Piece::constant(self.break_away)
    }

    fn begin(&self, _u: f64, _balance: f64, _memory: &mut Memory) -> Piece {
        Piece::constant(self.break_away)
    }

    fn next(&self, piece: &Piece, _end: End, _u: f64, _memory: &mut Memory) -> Piece {
        *piece
    }
}
