//! Coulomb friction: the same force at rest and in motion.

use serde::{Deserialize, Serialize};

use super::{Friction, Hold, Memory, Piece};
use crate::error::{Error, not_negative};

/// |F| ≤ f_k at rest, F = f_k sgn w in motion (Coulomb 1785; Den Hartog, Trans. ASME 53 (1931) 107).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Coulomb {
    /// Friction force f_k.
    pub kinetic: f64,
}

impl Friction for Coulomb {
    fn validate(&self) -> Result<(), Error> {
        not_negative("kinetic", self.kinetic).map(drop)
    }

    fn break_away(&self, _hold: Hold) -> f64 {
        self.kinetic
    }

    fn begin(&self, _u: f64, _balance: f64, _memory: &mut Memory) -> Piece {
        Piece::constant(self.kinetic)
    }
}
