//! Friction that weakens with speed as a hyperbola.

use super::{Curve, Fall, Friction, Memory, Piece, Rest};
use crate::law::declaration::parameters;
use crate::scalar::Scalar;
use crate::series::{Grown, Series, reciprocal};

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

    fn force(&self, _piece: &Piece<N>, u: N) -> N {
        self.break_away / (self.weakening * u + 1.0)
    }

    fn extend(&self, u: &Series<N>, k: usize, grown: &mut Grown<N>) -> N {
        grown.first[k] = reciprocal(self.weakening, u, &grown.first, k);
        self.break_away * grown.first[k]
    }

    fn resolution(&self, u: N) -> Option<N> {
        Some((u.abs() + self.weakening.inverse()) * 0.5)
    }

    fn curve(&self) -> Option<Curve> {
        let (fall, weakening) = (self.break_away.value(), self.weakening.value());
        Some(Curve {
            polynomial: [0.0; 4],
            fall,
            scale: 1.0 / weakening,
            form: Fall::Rational,
        })
    }

    fn begin(&self, _u: N, _balance: N, _memory: &mut Memory<N>) -> Piece<N> {
        Piece::constant(self.break_away)
    }
}
