//! The law of Popp and Stelter: a hyperbola that falls to a kinetic force, and a square that rises from it.

use super::static_kinetic::at_least_kinetic;
use super::{Curve, Fall, Friction, Rest};
use crate::error::Error;
use crate::law::declaration::{Limited, parameters};
use crate::scalar::Scalar;

parameters! {
    /// F(u) = (f_s − f_k)/(1 + λ₁ u) + f_k + λ₂ u², |F| ≤ f_s at rest (Popp & Stelter, Phil. Trans. R. Soc. A 332 (1990) 89).
    pub struct PoppStelter<N> {
        /// Break-away force f_s.
        pub break_away: N = 0.4 => [FORCE.not_negative()],
        /// Force the hyperbola falls to, f_k.
        pub kinetic: N = 0.1 => [FORCE.not_negative()],
        /// How fast it falls, λ₁ in 1/velocity.
        pub weakening: N = 1.42 => [Number::of("velocity^-1").not_negative()],
        /// The square part λ₂.
        #[serde(default)]
        pub square: N = 0.01 => [Number::of("force velocity^-2")],
    }
}

impl<N: Scalar> Friction<N> for PoppStelter<N> {
    fn validate(&self) -> Result<(), Error> {
        self.within_limits()?;
        at_least_kinetic(self.break_away, self.kinetic)
    }

    fn static_limit(&self, _rest: Rest<N>) -> N {
        self.break_away
    }

    fn curve(&self) -> Option<Curve<N>> {
        let (size, zero) = (self.break_away - self.kinetic, N::default());
        Some(Curve::new(
            [self.kinetic, zero, self.square],
            size,
            Fall::Rational,
            self.weakening,
        ))
    }
}
