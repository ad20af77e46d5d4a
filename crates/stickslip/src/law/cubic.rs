//! Friction that weakens and then grows again, as a cubic.

use super::{Curve, Fall, Friction, Rest};
use crate::law::declaration::parameters;
use crate::scalar::Scalar;

parameters! {
    /// F(u) = μ_s − k₁ u + k₃ u³, |F| ≤ μ_s at rest (Thomsen & Fidlin, Int. J. Non-Linear Mech. 38 (2003) 389).
    pub struct Cubic<N> {
        /// Friction at rest μ_s.
        pub at_rest: N as "static" = 0.4 => [FORCE.not_negative()],
        /// Linear fall k₁.
        pub linear: N = 0.45 => [Number::of("force velocity^-1")],
        /// Cubic rise k₃.
        pub cubic: N = 0.6 => [Number::of("force velocity^-3")],
    }
}

impl<N: Scalar> Friction<N> for Cubic<N> {
    fn static_limit(&self, _rest: Rest<N>) -> N {
        self.at_rest
    }

    fn curve(&self) -> Option<Curve<N>> {
        let zero = N::default();
        Some(Curve::new(
            [self.at_rest, -self.linear, zero, self.cubic],
            zero,
            Fall::Nothing,
            zero,
        ))
    }
}
