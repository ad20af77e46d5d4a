//! Friction that weakens with the square of the speed, as a Lorentz curve, with a viscous part.

use super::static_kinetic::at_least_kinetic;
use super::{Curve, Fall, Friction, Memory, Piece, Rest};
use crate::error::Error;
use crate::law::declaration::{Limited, parameters};
use crate::scalar::Scalar;
use crate::series::{Grown, Series, product, reciprocal};

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

    fn force(&self, _piece: &Piece<N>, u: N) -> N {
        let speed = u / self.scale;
        self.kinetic + (self.break_away - self.kinetic) / (speed * speed + 1.0) + self.viscous * u
    }

    fn extend(&self, u: &Series<N>, k: usize, grown: &mut Grown<N>) -> N {
        let Grown { first, second, .. } = grown;
        second[k] = product(u, u, k);
        first[k] = reciprocal((self.scale * self.scale).inverse(), second, first, k);
        let rest = if k == 0 { self.kinetic } else { N::default() };
        rest + (self.break_away - self.kinetic) * first[k] + self.viscous * u[k]
    }

    fn resolution(&self, u: N) -> Option<N> {
        // Half of the way to the poles at ±i w_s.
        Some((u * u + self.scale * self.scale).sqrt() * 0.5)
    }

    fn curve(&self) -> Option<Curve> {
        let [break_away, kinetic, viscous] = [self.break_away, self.kinetic, self.viscous].map(N::value);
        Some(Curve {
            polynomial: [kinetic, viscous, 0.0, 0.0],
            fall: break_away - kinetic,
            scale: self.scale.value(),
            form: Fall::Lorentzian,
        })
    }

    fn begin(&self, _u: N, _balance: N, _memory: &mut Memory<N>) -> Piece<N> {
        Piece::constant(self.break_away)
    }
}
