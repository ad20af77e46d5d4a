//! Friction that weakens and then grows again, as a cubic.

use super::{Curve, Fall, Friction, Memory, Piece, Rest};
use crate::law::declaration::parameters;
use crate::scalar::Scalar;
use crate::series::{Grown, Series, product};

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

    fn force(&self, _piece: &Piece<N>, u: N) -> N {
        self.at_rest - self.linear * u + self.cubic * u * u * u
    }

    fn extend(&self, u: &Series<N>, k: usize, grown: &mut Grown<N>) -> N {
        grown.first[k] = product(u, u, k);
        let rest = if k == 0 { self.at_rest } else { N::default() };
        rest - self.linear * u[k] + self.cubic * product(&grown.first, u, k)
    }

    fn resolution(&self, _u: N) -> Option<N> {
        Some(f64::INFINITY.into())
    }

    fn curve(&self) -> Option<Curve> {
        let [at_rest, linear, cubic] = [self.at_rest, self.linear, self.cubic].map(N::value);
        Some(Curve {
            polynomial: [at_rest, -linear, 0.0, cubic],
            fall: 0.0,
            scale: 1.0,
            form: Fall::Rational,
        })
    }

    fn begin(&self, _u: N, _balance: N, _memory: &mut Memory<N>) -> Piece<N> {
        Piece::constant(self.at_rest)
    }
}
