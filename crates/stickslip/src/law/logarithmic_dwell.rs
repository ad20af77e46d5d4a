//! Static friction that grows with the logarithm of rest, without end.

use super::{Friction, Memory, Piece, Rest};
use crate::law::declaration::parameters;
use crate::scalar::Scalar;

parameters! {
    /// f_s(t_s) = f_k + A ln(1 + t_s/t_c), F = f_k sgn w in motion (Dieterich, J. Geophysical Research 77 (1972) 3690).
    pub struct LogarithmicDwell<N> {
        /// Kinetic force f_k.
        pub kinetic: N = 0.5 => [FORCE.not_negative()],
        /// Growth A for every e-fold of rest.
        pub growth: N = 0.1 => [FORCE.not_negative()],
        /// Rest t_c after which the logarithm sets in.
        pub onset: N = 0.5 => [Number::of("time").positive().ratio()],
    }
}

impl<N: Scalar> Friction<N> for LogarithmicDwell<N> {
    fn static_limit(&self, rest: Rest<N>) -> N {
        self.kinetic + self.growth * (rest.stick_time.max(N::default()) / self.onset).ln_1p()
    }

    fn growth_bound(&self, stick_time: N) -> N {
        self.growth / (self.onset + stick_time)
    }

    fn begin(&self, _u: N, _balance: N, _memory: &mut Memory<N>) -> Piece<N> {
        Piece::constant(self.kinetic)
    }
}
