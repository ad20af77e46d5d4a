//! Static friction that grows while the contact rests.

use super::{Adhesion, Friction, Memory, Piece, Rest, StaticFriction};
use crate::law::declaration::parameters;

parameters! {
    /// f_s(t_s) = f_k + Δ∞ (1 − exp(−γ t_s^m)), F = f_k sgn w in motion (Kato, Sato & Matsubayashi, Wear 20 (1972) 315).
    pub struct DwellTime {
        /// Kinetic force f_k.
        pub kinetic: f64 = 0.5 => [FORCE.not_negative()],
        /// Growth of static friction after an infinite rest, Δ∞.
        pub limit: f64 = 0.5 => [FORCE.not_negative()],
        /// Rate γ, 1/time^m.
        pub rate: f64 = 0.4 => [RATE],
        /// Exponent m.
        #[serde(default = "crate::law::one")]
        pub exponent: f64 = 1.0 => [EXPONENT],
    }
}

impl DwellTime {
    fn static_friction(&self) -> StaticFriction {
        StaticFriction {
            limit: self.limit,
            rate: self.rate,
            exponent: self.exponent,
            ..StaticFriction::constant(self.kinetic)
        }
    }
}

impl Friction for DwellTime {
    fn static_limit(&self, rest: Rest) -> f64 {
        self.static_friction().force(rest)
    }

    fn exponential_growth(&self) -> Option<[f64; 2]> {
        self.static_friction().exponential_growth()
    }

    fn adhesion(&self, rest: Rest) -> Adhesion {
        self.static_friction().at(rest)
    }

    fn growth_bound(&self, stick_time: f64) -> f64 {
        self.static_friction().growth_bound(stick_time)
    }

    fn begin(&self, _u: f64, _balance: f64, _memory: &mut Memory) -> Piece {
        Piece::constant(self.kinetic)
    }
}
