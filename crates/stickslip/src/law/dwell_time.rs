//! Static friction that grows while the contact rests, by the form that is computed in `break_away_force.rs`.

use super::{Adhesion, Friction, Memory, Piece, Rest, StaticFriction};
use crate::law::declaration::parameters;
use crate::scalar::Scalar;

parameters! {
    /// f_s(t_s) = f_k + Δ∞ (1 − exp(−γ t_s^m)), F = f_k sgn w in motion (Kato, Sato & Matsubayashi, Wear 20 (1972) 315).
    pub struct DwellTime<N> {
        /// Kinetic force f_k.
        pub kinetic: N = 0.5 => [FORCE.not_negative()],
        /// Growth of static friction after an infinite rest, Δ∞.
        pub limit: N = 0.5 => [FORCE.not_negative()],
        /// Rate γ, 1/time^m.
        pub rate: N = 0.4 => [RATE],
        /// Exponent m.
        #[serde(default = "crate::law::one")]
        pub exponent: N = 1.0 => [EXPONENT],
    }
}

impl<N: Scalar> DwellTime<N> {
    fn static_friction(&self) -> StaticFriction<N> {
        StaticFriction {
            limit: self.limit,
            rate: self.rate,
            exponent: self.exponent,
            ..StaticFriction::constant(self.kinetic)
        }
    }
}

impl<N: Scalar> Friction<N> for DwellTime<N> {
    fn static_limit(&self, rest: Rest<N>) -> N {
        self.static_friction().force(rest)
    }

    fn exponential_growth(&self, force_rate: Option<N>) -> Option<[N; 2]> {
        self.static_friction().exponential_growth(force_rate)
    }

    fn adhesion(&self, rest: Rest<N>) -> Adhesion<N> {
        self.static_friction().at(rest)
    }

    fn growth_bound(&self, stick_time: N) -> N {
        self.static_friction().growth_bound(stick_time)
    }

    fn begin(&self, _u: N, _balance: N, _memory: &mut Memory<N>) -> Piece<N> {
        Piece::constant(self.kinetic)
    }
}
