//! Static friction that grows with the logarithm of rest, without end.

use super::{Friction, Memory, Piece, Rest};
use crate::elementary::ln_1p;
use crate::law::declaration::parameters;

parameters! {
    /// f_s(t_s) = f_k + A ln(1 + t_s/t_c), F = f_k sgn w in motion (Dieterich, J. Geophysical Research 77 (1972) 3690).
    pub struct LogarithmicDwell {
        /// Kinetic force f_k.
        pub kinetic: f64 = 0.5 => [FORCE.not_negative()],
        /// Growth A for every e-fold of rest.
        pub growth: f64 = 0.1 => [FORCE.not_negative()],
        /// Rest t_c after which the logarithm sets in.
        pub onset: f64 = 0.5 => [Number::of("time").positive().ratio()],
    }
}

impl Friction for LogarithmicDwell {
    fn static_limit(&self, rest: Rest) -> f64 {
        self.kinetic + self.growth * ln_1p(rest.stick_time.max(0.0) / self.onset)
    }

    fn growth_bound(&self, stick_time: f64) -> f64 {
        self.growth / (self.onset + stick_time)
    }

    fn begin(&self, _u: f64, _balance: f64, _memory: &mut Memory) -> Piece {
        Piece::constant(self.kinetic)
    }
}
