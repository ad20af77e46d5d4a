//! Static friction that grows while the contact rests and falls with the rate at which it is loaded, above a constant kinetic friction;
//! computed in `break_away_force.rs`. The paper's law is `bogacz_ryczek.rs`.

use super::{Adhesion, Friction, Memory, Piece, Rest, StaticFriction};
use crate::law::declaration::parameters;
use crate::scalar::Scalar;

parameters! {
    /// f_s(t_s, δ) = f_k + Δ∞ (1 − exp(−γ t_s^m)) / (1 + (δ/δ₀)^q), F = f_k sgn w in motion.
    ///
    /// That static friction falls with the rate of loading is the finding of Johannes, Green & Brockley, Wear 24 (1973) 381,
    /// and of Richardson & Nolle, Wear 37 (1976) 87; the form of the fall is our own.
    pub struct ForceRate<N> {
        /// Kinetic force f_k.
        pub kinetic: N = 0.5 => [FORCE.not_negative()],
        /// Growth of static friction after an infinite rest at a vanishing force rate, Δ∞.
        pub limit: N = 0.5 => [FORCE.not_negative()],
        /// Rate γ, 1/time^m.
        pub rate: N = 0.4 => [RATE],
        /// Force rate δ₀ at which the growth is halved.
        pub force_rate_scale: N = 0.3 => [FORCE_RATE],
        /// Exponent m.
        #[serde(default = "crate::law::one")]
        pub exponent: N = 1.0 => [EXPONENT],
        /// Exponent q.
        #[serde(default = "crate::law::one")]
        pub force_rate_exponent: N = 1.0 => [PURE.positive().search(0.05, 10.0)],
    }
}

impl<N: Scalar> ForceRate<N> {
    fn static_friction(&self) -> StaticFriction<N> {
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

impl<N: Scalar> Friction<N> for ForceRate<N> {
    fn static_limit(&self, rest: Rest<N>) -> N {
        self.static_friction().force(rest)
    }

    fn exponential_growth(&self, force_rate: Option<N>) -> Option<[N; 2]> {
        self.static_friction().exponential_growth(force_rate)
    }

    fn adhesion(&self, rest: Rest<N>) -> Adhesion<N> {
        self.static_friction().at(rest)
    }

    fn softening_bound(&self, rates: [N; 2]) -> N {
        self.static_friction().softening_bound(rates)
    }

    fn growth_bound(&self, stick_time: N) -> N {
        self.static_friction().growth_bound(stick_time)
    }

    fn feels_force_rate(&self) -> bool {
        self.limit > 0.0
    }

    fn begin(&self, _u: N, _balance: N, _memory: &mut Memory<N>) -> Piece<N> {
        Piece::constant(self.kinetic)
    }
}
