//! Friction that weakens with speed as a hyperbola.

use super::{Friction, Memory, Piece, Rest};
use crate::law::declaration::parameters;
use crate::series::{Grown, Series, reciprocal};

parameters! {
    /// F(u) = f_s/(1 + δ u), |F| ≤ f_s at rest (Leine, van Campen, de Kraker & van den Steen, Nonlinear Dynamics 16 (1998) 41).
    pub struct Rational {
        /// Break-away force f_s.
        pub break_away: f64 = 1.0 => [FORCE.not_negative()],
        /// How fast friction weakens, δ in 1/velocity.
        pub weakening: f64 = 3.0 => [Number::of("velocity^-1").not_negative()],
    }
}

impl Friction for Rational {
    fn static_limit(&self, _rest: Rest) -> f64 {
        self.break_away
    }

    fn force(&self, _piece: &Piece, u: f64) -> f64 {
        self.break_away / (1.0 + self.weakening * u)
    }

    fn extend(&self, u: &Series, k: usize, grown: &mut Grown) -> f64 {
        grown.first[k] = reciprocal(self.weakening, u, &grown.first, k);
        self.break_away * grown.first[k]
    }

    fn resolution(&self, u: f64) -> Option<f64> {
        Some(0.5 * (u.abs() + 1.0 / self.weakening))
    }

    fn begin(&self, _u: f64, _balance: f64, _memory: &mut Memory) -> Piece {
        Piece::constant(self.break_away)
    }
}
