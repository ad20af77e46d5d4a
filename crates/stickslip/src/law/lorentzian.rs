//! Friction that weakens with the square of the speed, as a Lorentz curve, with a viscous part.

use super::static_kinetic::at_least_kinetic;
use super::{Friction, Memory, Piece, Rest};
use crate::error::Error;
use crate::law::declaration::{Limited, parameters};
use crate::series::{Grown, Series, product, reciprocal};

parameters! {
    /// F(u) = f_k + (f_s − f_k)/(1 + (u/w_s)²) + b u, |F| ≤ f_s at rest (Hess & Soom, J. Tribology 112 (1990) 147).
    pub struct Lorentzian {
        /// Break-away force f_s.
        pub break_away: f64 = 1.0 => [FORCE.not_negative()],
        /// Kinetic force f_k at high speed, but for the viscous part.
        pub kinetic: f64 = 0.5 => [FORCE.not_negative()],
        /// Slip speed w_s at which half of the difference is gone.
        pub scale: f64 = 0.1 => [VELOCITY.positive()],
        /// Viscous coefficient b.
        #[serde(default)]
        pub viscous: f64 = 0.2 => [Number::of("force velocity^-1")],
    }
}

impl Friction for Lorentzian {
    fn validate(&self) -> Result<(), Error> {
        self.within_limits()?;
        at_least_kinetic(self.break_away, self.kinetic)
    }

    fn static_limit(&self, _rest: Rest) -> f64 {
        self.break_away
    }

    fn force(&self, _piece: &Piece, u: f64) -> f64 {
        let speed = u / self.scale;
        self.kinetic + (self.break_away - self.kinetic) / (1.0 + speed * speed) + self.viscous * u
    }

    fn extend(&self, u: &Series, k: usize, grown: &mut Grown) -> f64 {
        let Grown { first, second, .. } = grown;
        second[k] = product(u, u, k);
        first[k] = reciprocal(1.0 / (self.scale * self.scale), second, first, k);
        let rest = if k == 0 { self.kinetic } else { 0.0 };
        rest + (self.break_away - self.kinetic) * first[k] + self.viscous * u[k]
    }

    fn resolution(&self, u: f64) -> Option<f64> {
        // Half of the way to the poles at ±i w_s.
        Some(0.5 * (u * u + self.scale * self.scale).sqrt())
    }

    fn begin(&self, _u: f64, _balance: f64, _memory: &mut Memory) -> Piece {
        Piece::constant(self.break_away)
    }
}
