//! Coulomb friction: the same force at rest and in motion.

use super::{Friction, Memory, Piece, Rest};
use crate::law::declaration::parameters;
use crate::scalar::Scalar;

parameters! {
    /// |F| ≤ f_k at rest, F = f_k sgn w in motion (Coulomb 1785; Den Hartog, Trans. ASME 53 (1931) 107).
    pub struct Coulomb<N> {
        /// Friction force f_k.
        pub kinetic: N = 0.6 => [FORCE.not_negative()],
    }
}

impl<N: Scalar> Friction<N> for Coulomb<N> {
    fn static_limit(&self, _rest: Rest<N>) -> N {
        self.kinetic
    }

    fn begin(&self, _u: N, _balance: N, _memory: &mut Memory<N>) -> Piece<N> {
        Piece::constant(self.kinetic)
    }
}
