//! Friction that weakens exponentially with speed, with a viscous part.

use super::static_kinetic::at_least_kinetic;
use super::{Curve, Fall, Friction, Rest};
use crate::error::{Error, misshapen};
use crate::law::declaration::{Limited, parameters};
use crate::scalar::Scalar;

parameters! {
    /// F(u) = f_k + (f_s − f_k) exp(−(u/w_s)ⁿ) + b u, |F| ≤ f_s at rest.
    ///
    /// n = 1: Tustin, J. IEE 94 (1947) 143. n = 2, the Gaussian: Armstrong-Hélouvry, Dupont & Canudas de Wit, Automatica 30
    /// (1994) 1083, among the exponents of Bo & Pavelescu, Wear 82 (1982) 277.
    pub struct ExponentialStribeck<N> {
        /// Break-away force f_s.
        pub break_away: N = 1.0 => [FORCE.not_negative()],
        /// Kinetic force f_k at high speed, but for the viscous part: below zero where that part makes up for it. Fits look
        /// for one that is not.
        pub kinetic: N = 0.5 => [FORCE.search(0.0, f64::INFINITY)],
        /// Slip speed w_s over which friction falls.
        pub scale: N = 0.1 => [VELOCITY.positive()],
        /// Viscous coefficient b.
        #[serde(default)]
        pub viscous: N = 0.2 => [Number::of("force velocity^-1")],
        /// Exponent n, 1 or 2.
        #[serde(default = "crate::law::one")]
        pub exponent: N = 1.0 => [PURE.choices(&[1.0, 2.0])],
    }
}

impl<N: Scalar> Friction<N> for ExponentialStribeck<N> {
    fn validate(&self) -> Result<(), Error> {
        self.within_limits()?;
        at_least_kinetic(self.break_away, self.kinetic)?;
        if self.exponent != 1.0 && self.exponent != 2.0 {
            return misshapen(
                "exponent must be 1 or 2, as friction in between has no slope to start slip with",
                self.exponent.value(),
            );
        }
        Ok(())
    }

    fn static_limit(&self, _rest: Rest<N>) -> N {
        self.break_away
    }

    fn curve(&self) -> Option<Curve<N>> {
        let fall = if self.exponent == 2.0 {
            Fall::Gaussian
        } else {
            Fall::Exponential
        };
        let size = self.break_away - self.kinetic;
        Some(Curve::new([self.kinetic, self.viscous], size, fall, self.scale))
    }
}
