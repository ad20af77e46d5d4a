//! The law of Popp and Stelter: a hyperbola that falls to a kinetic force, and a square that rises from it.

use super::static_kinetic::at_least_kinetic;
use super::{Curve, Fall, Friction, Memory, Piece, Rest};
use crate::error::Error;
use crate::law::declaration::{Limited, parameters};
use crate::scalar::Scalar;
use crate::series::{Grown, Series, product, reciprocal};

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

    fn force(&self, _piece: &Piece<N>, u: N) -> N {
        (self.break_away - self.kinetic) / (self.weakening * u + 1.0) + self.kinetic + self.square * u * u
    }

    fn extend(&self, u: &Series<N>, k: usize, grown: &mut Grown<N>) -> N {
        grown.first[k] = reciprocal(self.weakening, u, &grown.first, k);
        let rest = if k == 0 { self.kinetic } else { N::default() };
        rest + (self.break_away - self.kinetic) * grown.first[k] + self.square * product(u, u, k)
    }

    fn resolution(&self, u: N) -> Option<N> {
        Some((u.abs() + self.weakening.inverse()) * 0.5)
    }

    fn curve(&self) -> Option<Curve> {
        let [break_away, kinetic, square] = [self.break_away, self.kinetic, self.square].map(N::value);
        Some(Curve {
            polynomial: [kinetic, 0.0, square, 0.0],
            fall: break_away - kinetic,
            scale: 1.0 / self.weakening.value(),
            form: Fall::Rational,
        })
    }

    fn begin(&self, _u: N, _balance: N, _memory: &mut Memory<N>) -> Piece<N> {
        Piece::constant(self.break_away)
    }
}
