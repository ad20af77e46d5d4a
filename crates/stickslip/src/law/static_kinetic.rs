//! Static and kinetic friction: the static limit exceeds the kinetic force.

use super::{Friction, Memory, Piece, Rest};
use crate::error::{Error, finite};
use crate::law::declaration::{Limited, parameters};
use crate::scalar::Scalar;

parameters! {
    /// |F| ≤ f_s at rest, F = f_k sgn w in motion, f_s ≥ f_k.
    pub struct StaticKinetic<N> {
        /// Break-away force f_s.
        pub break_away: N = 1.0 => [FORCE.not_negative()],
        /// Kinetic force f_k.
        pub kinetic: N = 0.6 => [FORCE.not_negative()],
    }
}

impl<N: Scalar> Friction<N> for StaticKinetic<N> {
    fn validate(&self) -> Result<(), Error> {
        self.within_limits()?;
        at_least_kinetic(self.break_away, self.kinetic)
    }

    fn static_limit(&self, _rest: Rest<N>) -> N {
        self.break_away
    }

    fn begin(&self, _u: N, _balance: N, _memory: &mut Memory<N>) -> Piece<N> {
        Piece::constant(self.kinetic)
    }
}

/// The static limit must be at least what slip produces at zero speed.
pub(super) fn at_least_kinetic<N: Scalar>(break_away: N, kinetic: N) -> Result<(), Error> {
    let [break_away, kinetic] = [break_away, kinetic].map(N::value);
    if finite("break_away", break_away)? < kinetic {
        return Err(Error::BreakAwayBelowKinetic { break_away, kinetic });
    }
    Ok(())
}
