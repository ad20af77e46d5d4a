//! The break-away force over stick time and force rate, f_s(t_s, δ), of the paper's law and of others with the same form of static
//! friction: their `static_limit` is [`StaticFriction::force`]. Other laws compute it in their own `static_limit`.

use super::{Adhesion, Rest, one};
use crate::error::Error;
use crate::law::declaration::{Kind, Limited, Limits, Parameters, Value, parameters};
use crate::scalar::Scalar;

parameters! {
    /// f_s(t_s, δ) = f_0 + Δ₀/(1 + (δ/δ₁)^p) + Δ₂/(1 + (δ/δ₂)^r) + Δ∞ (1 − exp(−γ t_s^m)) / (1 + (δ/δ₀)^q).
    ///
    /// The growth with rest is Kato's (Kato, Sato & Matsubayashi, Wear 20 (1972) 315); the fall with the force rate follows
    /// the finding of Johannes, Green & Brockley (Wear 24 (1973) 381) in a form of our own, for what rest adds and, with Δ₀, for
    /// what there is without rest, there in one step or two.
    #[derive(Copy)]
    pub struct StaticFriction<N> {
        /// f_0 = f_s(0, δ → ∞).
        pub initial: N = 0.68 => [FORCE.positive()],
        /// What f_s(0, δ) falls by from a vanishing to an infinite force rate, Δ₀.
        #[serde(default)]
        pub drop: N = 1.24 => [FORCE.not_negative()],
        /// Force rate δ₁ at which half of that is gone.
        #[serde(default = "crate::law::one")]
        pub drop_scale: N = 0.3695 => [FORCE_RATE],
        /// Exponent p.
        #[serde(default = "crate::law::one")]
        pub drop_exponent: N = 10.0 => [PURE.positive().search(0.05, 100.0).ratio()],
        /// Growth after an infinite rest at a vanishing force rate, Δ∞.
        #[serde(default)]
        pub limit: N = 0.39 => [FORCE.not_negative()],
        /// Rate γ, 1/time^m.
        #[serde(default = "crate::law::one")]
        pub rate: N = 0.3 => [RATE],
        /// Exponent m.
        #[serde(default = "crate::law::one")]
        pub exponent: N = 1.0 => [EXPONENT],
        /// Force rate δ₀ at which the growth is halved; none: no dependence on the force rate.
        #[serde(default)]
        pub force_rate_scale: Option<N> = Some(0.5) => [FORCE_RATE],
        /// Exponent q.
        #[serde(default = "crate::law::one")]
        pub force_rate_exponent: N = 1.0 => [PURE.positive().search(0.05, 10.0)],
        /// What f_s(0, δ) falls by in a second step, Δ₂.
        #[serde(default)]
        pub second_drop: N = 0.0 => [FORCE.not_negative()],
        /// Force rate δ₂ at which half of that is gone.
        #[serde(default = "crate::law::one")]
        pub second_drop_scale: N = 1.0 => [FORCE_RATE],
        /// Exponent r.
        #[serde(default = "crate::law::one")]
        pub second_drop_exponent: N = 1.0 => [PURE.positive().search(0.05, 100.0).ratio()],
    }
}

impl<N: Scalar> StaticFriction<N> {
    /// The same force whatever the rest.
    pub(super) fn constant(initial: N) -> Self {
        let [zero, one] = [N::default(), one()];
        Self {
            initial,
            drop: zero,
            drop_scale: one,
            drop_exponent: one,
            limit: zero,
            rate: one,
            exponent: one,
            force_rate_scale: None,
            force_rate_exponent: one,
            second_drop: zero,
            second_drop_scale: one,
            second_drop_exponent: one,
        }
    }

    /// The steps in which f_s(0, δ) falls: how far, at which force rate and how steeply.
    fn drops(&self) -> impl Iterator<Item = [N; 3]> {
        let first = [self.drop, self.drop_scale, self.drop_exponent];
        let second = [
            self.second_drop,
            self.second_drop_scale,
            self.second_drop_exponent,
        ];
        [first, second].into_iter().filter(|[drop, ..]| !drop.vanishes())
    }

    /// Whether static friction depends on the force rate.
    pub(super) fn feels_force_rate(&self) -> bool {
        self.drops().next().is_some() || !self.limit.vanishes() && self.force_rate_scale.is_some()
    }

    /// Where it grows as 1 − e^(−γ t_s), at a force rate that stays or whatever it is: how far, and γ.
    pub(super) fn exponential_growth(&self, force_rate: Option<N>) -> Option<[N; 2]> {
        let share = match force_rate {
            Some(force_rate) => self.softened(force_rate)[0],
            None if self.feels_force_rate() => return None,
            None => one(),
        };
        (self.exponent == 1.0).then_some([self.limit * share, self.rate])
    }

    /// f_s(t_s, δ).
    pub fn force(&self, rest: Rest<N>) -> N {
        let initial = self.without_rest(rest.force_rate);
        if self.limit.vanishes() || rest.stick_time <= 0.0 {
            return initial;
        }
        let grown = -(-self.rate * rest.stick_time.power(self.exponent)).exp_m1();
        initial + self.limit * grown * self.softened(rest.force_rate)[0]
    }

    /// The force and its derivatives.
    pub(super) fn at(&self, rest: Rest<N>) -> Adhesion<N> {
        let mut at = Adhesion {
            force: self.initial,
            growth: N::default(),
            curvature: N::default(),
            softening: N::default(),
        };
        for [drop, scale, exponent] in self.drops() {
            let [share, falls] = fall(rest.force_rate, scale, exponent);
            at.force += drop * share;
            at.softening += drop * falls;
        }
        if self.limit > 0.0 && rest.stick_time > 0.0 {
            let [share, falls] = self.softened(rest.force_rate);
            let (m, t) = (self.exponent, rest.stick_time);
            let aged = self.rate * t.power(m);
            let (grown, slope) = (-(-aged).exp_m1(), m * aged / t);
            at.force += self.limit * grown * share;
            at.softening += self.limit * grown * falls;
            at.growth = self.limit * slope * (one::<N>() - grown) * share;
            at.curvature = at.growth * ((m - 1.0) / t - slope);
        } else if self.limit > 0.0 {
            (at.growth, at.curvature) = (self.growth_bound(N::default()), f64::INFINITY.into());
        }
        at
    }

    /// f_s(0, δ).
    pub(super) fn without_rest(&self, force_rate: N) -> N {
        self.drops().fold(self.initial, |force, [drop, scale, exponent]| {
            force + drop * fall(force_rate, scale, exponent)[0]
        })
    }

    /// The part of the growth with rest that is left at a force rate, and how fast it falls with that.
    fn softened(&self, force_rate: N) -> [N; 2] {
        self.force_rate_scale.map_or([one(), N::default()], |scale| {
            fall(force_rate, scale, self.force_rate_exponent)
        })
    }

    /// sup of −∂f_s/∂δ between two force rates, whatever the rest.
    pub(super) fn softening_bound(&self, rates: [N; 2]) -> N {
        let drop = self.drops().fold(N::default(), |sum, [drop, scale, exponent]| {
            sum + drop * steepest(rates, scale, exponent)
        });
        let growth = self.force_rate_scale.map_or(N::default(), |scale| {
            self.limit * steepest(rates, scale, self.force_rate_exponent)
        });
        drop + growth
    }

    /// sup of ∂f_s/∂t_s from `stick_time` on. With z = γ t^m the derivative is Δ∞ m z^(1 − 1/m) γ^(1/m) e^(−z); it falls
    /// throughout for m ≤ 1 and from z = 1 − 1/m on for m > 1.
    pub(super) fn growth_bound(&self, stick_time: N) -> N {
        if self.limit == 0.0 {
            return N::default();
        }
        let m = self.exponent;
        let peak = if m > 1.0 {
            ((one::<N>() - m.inverse()) / self.rate).power(m.inverse())
        } else {
            N::default()
        };
        let t = stick_time.max(peak);
        if t <= 0.0 && m < 1.0 {
            return f64::INFINITY.into();
        }
        let power = t.power(m);
        let slope = if m == 1.0 { one() } else { m * power / t };
        self.limit * self.rate * slope * (-self.rate * power).exp()
    }
}

/// 1/(1 + (δ/scale)^exponent) and minus its derivative.
fn fall<N: Scalar>(force_rate: N, scale: N, exponent: N) -> [N; 2] {
    let raised = (force_rate / scale).power(exponent);
    let share = (raised + 1.0).inverse();
    if raised == 0.0 || raised.value().is_infinite() {
        return [share, N::default()];
    }
    [share, exponent * raised * share * share / force_rate]
}

/// sup of minus that derivative, p z^(p−1)/(1 + z^p)²/scale, between two force rates.
fn steepest<N: Scalar>([low, high]: [N; 2], scale: N, p: N) -> N {
    let (low, high) = (low / scale, high / scale);
    let least = low.power(p) + 1.0;
    let most = if p == 1.0 {
        one()
    } else {
        (if p > 1.0 { high } else { low }).power(p - 1.0)
    };
    p * most / (least * least * scale)
}

impl<N: Scalar> Value for StaticFriction<N> {
    const KIND: Kind = Kind::Table(StaticFriction::PARAMETERS);

    fn check(&self, _name: &'static str, _limits: Limits) -> Result<(), Error> {
        self.within_limits()
    }
}
