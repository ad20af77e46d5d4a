//! Friction that weakens and then grows again, as a cubic.

use super::{Friction, Memory, Piece, Rest};
use crate::law::declaration::parameters;
use crate::series::{Grown, Series, product};

parameters! {
    /// F(u) = μ_s − k₁ u + k₃ u³, |F| ≤ μ_s at rest (Thomsen & Fidlin, Int. J. Non-Linear Mech. 38 (2003) 389).
    pub struct Cubic {
        /// Friction at rest μ_s.
        pub at_rest: f64 as "static" = 0.4 => [FORCE.not_negative()],
        /// Linear fall k₁.
        pub linear: f64 = 0.45 => [Number::of("force velocity^-1")],
        /// Cubic rise k₃.
        pub cubic: f64 = 0.6 => [Number::of("force velocity^-3")],
    }
}

impl Friction for Cubic {
    fn static_limit(&self, _rest: Rest) -> f64 {
        self.at_rest
    }

    fn force(&self, _piece: &Piece, u: f64) -> f64 {
        self.at_rest - self.linear * u + self.cubic * u * u * u
    }

    fn extend(&self, u: &Series, k: usize, grown: &mut Grown) -> f64 {
        grown.first[k] = product(u, u, k);
        let rest = if k == 0 { self.at_rest } else { 0.0 };
        rest - self.linear * u[k] + self.cubic * product(&grown.first, u, k)
    }

    fn resolution(&self, _u: f64) -> Option<f64> {
        Some(f64::INFINITY)
    }

    fn begin(&self, _u: f64, _balance: f64, _memory: &mut Memory) -> Piece {
        Piece::constant(self.at_rest)
    }
}
