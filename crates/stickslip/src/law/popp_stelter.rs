//! The law of Popp and Stelter: a hyperbola that falls to a kinetic force, and a square that rises from it.

use super::static_kinetic::at_least_kinetic;
use super::{Friction, Memory, Piece, Rest};
use crate::error::Error;
use crate::law::declaration::{Limited, parameters};
use crate::series::{Grown, Series, product, reciprocal};

parameters! {
    /// F(u) = (f_s − f_k)/(1 + λ₁ u) + f_k + λ₂ u², |F| ≤ f_s at rest (Popp & Stelter, Phil. Trans. R. Soc. A 332 (1990) 89).
    pub struct PoppStelter {
        /// Break-away force f_s.
        pub break_away: f64 = 0.4 => [FORCE.not_negative()],
        /// Force the hyperbola falls to, f_k.
        pub kinetic: f64 = 0.1 => [FORCE.not_negative()],
        /// How fast it falls, λ₁ in 1/velocity.
        pub weakening: f64 = 1.42 => [Number::of("velocity^-1").not_negative()],
        /// The square part λ₂.
        #[serde(default)]
        pub square: f64 = 0.01 => [Number::of("force velocity^-2")],
    }
}

impl Friction for PoppStelter {
    fn validate(&self) -> Result<(), Error> {
        self.within_limits()?;
        at_least_kinetic(self.break_away, self.kinetic)
    }

    fn static_limit(&self, _rest: Rest) -> f64 {
        self.break_away
    }

    fn force(&self, _piece: &Piece, u: f64) -> f64 {
        (self.break_away - self.kinetic) / (1.0 + self.weakening * u) + self.kinetic + self.square * u * u
    }

    fn extend(&self, u: &Series, k: usize, grown: &mut Grown) -> f64 {
        grown.first[k] = reciprocal(self.weakening, u, &grown.first, k);
        let rest = if k == 0 { self.kinetic } else { 0.0 };
        rest + (self.break_away - self.kinetic) * grown.first[k] + self.square * product(u, u, k)
    }

    fn resolution(&self, u: f64) -> Option<f64> {
        Some(0.5 * (u.abs() + 1.0 / self.weakening))
    }

    fn begin(&self, _u: f64, _balance: f64, _memory: &mut Memory) -> Piece {
        Piece::constant(self.break_away)
    }
}
