//! Friction that weakens with the square of the speed, as a Lorentz curve, with a viscous part.

use super::static_kinetic::at_least_kinetic;
use super::{Curve, Fall, Friction, Rest};
use crate::error::Error;
use crate::law::declaration::{Limited, parameters};
use crate::scalar::Scalar;

parameters! {
    /// F(u) = f_k + (f_s − f_k)/(1 + (u/w_s)²) + b u, |F| ≤ f_s at rest (Hess & Soom, J. Tribology 112 (1990) 147).
    pub struct Lorentzian<N> {
        /// Break-away force f_s.
        pub break_away: N = 1.0 => [FORCE.not_negative()],
        /// Kinetic force f_k at high speed, but for the viscous part.
        pub kinetic: N = 0.5 => [FORCE.not_negative()],
        /// Slip speed w_s at which half of the difference is gone.
        pub scale: N = 0.1 => [VELOCITY.positive()],
        /// Viscous coefficient b.
        #[serde(default)]
        pub viscous: N = 0.2 => [Number::of("force velocity^-1")],
    }
}

impl<N: Scalar> Friction<N> for Lorentzian<N> {
    fn validate(&self) -> Result<(), Error> {
        self.within_limits()?;
        at_least_kinetic(self.break_away, self.kinetic)
    }

    fn static_limit(&self, _rest: Rest<N>) -> N {
        self.break_away
    }

    fn curve(&self) -> Option<Curve<N>> {
        let size = self.break_away - self.kinetic;
        Some(Curve::new(
            [self.kinetic, self.viscous],
            size,
            Fall::Lorentzian,
            self.scale,
        ))
    }
}
