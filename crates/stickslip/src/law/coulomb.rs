//! Coulomb friction: the same force at rest and in motion.

use super::{Friction, Memory, Piece, Rest};
use crate::law::declaration::parameters;

parameters! {
    /// |F| ≤ f_k at rest, F = f_k sgn w in motion (Coulomb 1785; Den Hartog, Trans. ASME 53 (1931) 107).
    pub struct Coulomb {
        /// Friction force f_k.
        pub kinetic: f64 = 0.6 => [FORCE.not_negative()],
    }
}

impl Friction for Coulomb {
    fn static_limit(&self, _rest: Rest) -> f64 {
        self.kinetic
    }

    fn begin(&self, _u: f64, _balance: f64, _memory: &mut Memory) -> Piece {
        Piece::constant(self.kinetic)
    }
}
