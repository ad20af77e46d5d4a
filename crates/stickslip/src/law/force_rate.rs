//! Static friction that grows while the contact rests and falls with the rate at which it is loaded.

use super::{Adhesion, Friction, Memory, Piece, Rest, StaticFriction};
use crate::law::declaration::parameters;

parameters! {
    /// f_s(t_s, δ) = f_k + Δ∞ (1 − exp(−γ t_s^m)) / (1 + (δ/δ₀)^q), F = f_k sgn w in motion.
    ///
    /// That static friction falls with the rate of loading is the finding of Johannes, Green & Brockley, Wear 24 (1973) 381,
    /// and of Richardson & Nolle, Wear 37 (1976) 87; the form of the fall is our own.
    pub struct ForceRate {
        /// Kinetic force f_k.
        pub kinetic: f64 = 0.5 => [FORCE.not_negative()],
        /// Growth of static friction after an infinite rest at a vanishing force rate, Δ∞.
        pub limit: f64 = 0.5 => [FORCE.not_negative()],
        /// Rate γ, 1/time^m.
        pub rate: f64 = 0.4 => [RATE],
        /// Force rate δ₀ at which the growth is halved.
        pub force_rate_scale: f64 = 0.3 => [FORCE_RATE],
        /// Exponent m.
        #[serde(default = "crate::law::one")]
        pub exponent: f64 = 1.0 => [EXPONENT],
        /// Exponent q.
        #[serde(default = "crate::law::one")]
        pub force_rate_exponent: f64 = 1.0 => [PURE.positive().search(0.05, 10.0)],
    }
}

impl ForceRate {
    fn static_friction(&self) -> StaticFriction {
        StaticFriction {
            limit: self.limit,
            rate: self.rate,
            exponent: self.exponent,
            force_rate_scale: Some(self.force_rate_scale),
            force_rate_exponent: self.force_rate_exponent,
            ..StaticFriction::constant(self.kinetic)
        }
    }
}

impl Friction for ForceRate {
    fn static_limit(&self, rest: Rest) -> f64 {
        self.static_friction().force(rest)
    }

    fn adhesion(&self, rest: Rest) -> Adhesion {
        self.static_friction().at(rest)
    }

    fn softening_bound(&self, rates: [f64; 2]) -> f64 {
        self.static_friction().softening_bound(rates)
    }

    fn growth_bound(&self, stick_time: f64) -> f64 {
        self.static_friction().growth_bound(stick_time)
    }

    fn feels_force_rate(&self) -> bool {
        self.limit > 0.0
    }

    fn begin(&self, _u: f64, _balance: f64, _memory: &mut Memory) -> Piece {
        Piece::constant(self.kinetic)
    }
}
