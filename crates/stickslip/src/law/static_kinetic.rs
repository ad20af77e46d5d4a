//! Static and kinetic friction: the static limit exceeds the kinetic force.

use super::{Friction, Memory, Piece, Rest};
use crate::error::{Error, finite};
use crate::law::declaration::{Limited, parameters};

parameters! {
    /// |F| ≤ f_s at rest, F = f_k sgn w in motion, f_s ≥ f_k.
    pub struct StaticKinetic {
        /// Break-away force f_s.
        pub break_away: f64 = 1.0 => [FORCE.not_negative()],
        /// Kinetic force f_k.
        pub kinetic: f64 = 0.6 => [FORCE.not_negative()],
    }
}

impl Friction for StaticKinetic {
    fn validate(&self) -> Result<(), Error> {
        self.within_limits()?;
        at_least_kinetic(self.break_away, self.kinetic)
    }

    fn static_limit(&self, _rest: Rest) -> f64 {
        self.break_away
    }

    fn begin(&self, _u: f64, _balance: f64, _memory: &mut Memory) -> Piece {
        Piece::constant(self.kinetic)
    }
}

/// The static limit must be at least what slip produces at zero speed.
pub(super) fn at_least_kinetic(break_away: f64, kinetic: f64) -> Result<(), Error> {
    if finite("break_away", break_away)? < kinetic {
        return Err(Error::BreakAwayBelowKinetic { break_away, kinetic });
    }
    Ok(())
}
