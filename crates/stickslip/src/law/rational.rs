//! Friction that weakens with speed as a hyperbola.

use super::{Curve, Fall, Friction, Rest};
use crate::law::declaration::parameters;
use crate::scalar::Scalar;

parameters! {
    /// F(u) = f_s/(1 + δ u), |F| ≤ f_s at rest (Leine, van Campen, de Kraker & van den Steen, Nonlinear Dynamics 16 (1998) 41).
    pub struct Rational<N> {
        /// Break-away force f_s.
        pub break_away: N = 1.0 => [FORCE.not_negative()],
        /// How fast friction weakens, δ in 1/velocity.
        pub weakening: N = 3.0 => [Number::of("velocity^-1").not_negative()],
    }
}

impl<N: Scalar> Friction<N> for Rational<N> {
    fn static_limit(&self, _rest: Rest<N>) -> N {
        self.break_away
    }

    fn curve(&self) -> Option<Curve<N>> {
        Some(Curve::new([], self.break_away, Fall::Rational, self.weakening))
    }
}
