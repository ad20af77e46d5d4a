//! A form of static friction over stick time and force rate, f_s(t_s, δ), which several laws share; each law's own answer is its
//! `static_limit`.

use super::{Adhesion, Rest};
use crate::elementary::{exp, exp_m1, power};
use crate::error::Error;
use crate::law::declaration::{Kind, Limited, Limits, Parameters, Value, parameters};

parameters! {
    /// f_s(t_s, δ) = f_0 + Δ₀/(1 + (δ/δ₁)^p) + Δ₂/(1 + (δ/δ₂)^r) + Δ∞ (1 − exp(−γ t_s^m)) / (1 + (δ/δ₀)^q).
    ///
    /// The growth with rest is Kato's (Kato, Sato & Matsubayashi, Wear 20 (1972) 315); the fall with the force rate follows
    /// the finding of Johannes, Green & Brockley (Wear 24 (1973) 381) in a form of our own, for what rest adds and, with Δ₀, for
    /// what there is without rest, there in one step or two.
    #[derive(Copy)]
    pub struct StaticFriction {
        /// f_0 = f_s(0, δ → ∞).
        pub initial: f64 = 0.68 => [FORCE.positive()],
        /// What f_s(0, δ) falls by from a vanishing to an infinite force rate, Δ₀.
        #[serde(default)]
        pub drop: f64 = 1.24 => [FORCE.not_negative()],
        /// Force rate δ₁ at which half of that is gone.
        #[serde(default = "crate::law::one")]
        pub drop_scale: f64 = 0.3695 => [FORCE_RATE],
        /// Exponent p.
        #[serde(default = "crate::law::one")]
        pub drop_exponent: f64 = 10.0 => [PURE.positive().search(0.05, 100.0).ratio()],
        /// Growth after an infinite rest at a vanishing force rate, Δ∞.
        #[serde(default)]
        pub limit: f64 = 0.39 => [FORCE.not_negative()],
        /// Rate γ, 1/time^m.
        #[serde(default = "crate::law::one")]
        pub rate: f64 = 0.3 => [RATE],
        /// Exponent m.
        #[serde(default = "crate::law::one")]
        pub exponent: f64 = 1.0 => [EXPONENT],
        /// Force rate δ₀ at which the growth is halved; none: no dependence on the force rate.
        #[serde(default)]
        pub force_rate_scale: Option<f64> = Some(0.5) => [FORCE_RATE],
        /// Exponent q.
        #[serde(default = "crate::law::one")]
        pub force_rate_exponent: f64 = 1.0 => [PURE.positive().search(0.05, 10.0)],
        /// What f_s(0, δ) falls by in a second step, Δ₂.
        #[serde(default)]
        pub second_drop: f64 = 0.0 => [FORCE.not_negative()],
        /// Force rate δ₂ at which half of that is gone.
        #[serde(default = "crate::law::one")]
        pub second_drop_scale: f64 = 1.0 => [FORCE_RATE],
        /// Exponent r.
        #[serde(default = "crate::law::one")]
        pub second_drop_exponent: f64 = 1.0 => [PURE.positive().search(0.05, 100.0).ratio()],
    }
}

impl StaticFriction {
    /// The same force whatever the rest.
    pub(super) const fn constant(initial: f64) -> Self {
        Self {
            initial,
            drop: 0.0,
            drop_scale: 1.0,
            drop_exponent: 1.0,
            limit: 0.0,
            rate: 1.0,
            exponent: 1.0,
            force_rate_scale: None,
            force_rate_exponent: 1.0,
            second_drop: 0.0,
            second_drop_scale: 1.0,
            second_drop_exponent: 1.0,
        }
    }

    /// The steps in which f_s(0, δ) falls: how far, at which force rate and how steeply.
    fn drops(&self) -> impl Iterator<Item = [f64; 3]> {
        let first = [self.drop, self.drop_scale, self.drop_exponent];
        let second = [
            self.second_drop,
            self.second_drop_scale,
            self.second_drop_exponent,
        ];
        [first, second].into_iter().filter(|[drop, ..]| *drop > 0.0)
    }

    /// Whether static friction depends on the force rate.
    pub(super) fn feels_force_rate(&self) -> bool {
        self.drops().next().is_some() || self.limit > 0.0 && self.force_rate_scale.is_some()
    }

    /// Where it grows as 1 − e^(−γ t_s) whatever the force rate: how far, and γ.
    pub(super) fn exponential_growth(&self) -> Option<[f64; 2]> {
        (self.exponent == 1.0 && !self.feels_force_rate()).then_some([self.limit, self.rate])
    }

    /// f_s(t_s, δ).
    pub fn force(&self, rest: Rest) -> f64 {
        let initial = self.without_rest(rest.force_rate);
        if self.limit == 0.0 || rest.stick_time <= 0.0 {
            return initial;
        }
        let grown = -exp_m1(-self.rate * power(rest.stick_time, self.exponent));
        initial + self.limit * grown * self.softened(rest.force_rate)[0]
    }

    /// The force and its derivatives.
    pub(super) fn at(&self, rest: Rest) -> Adhesion {
        let mut at = Adhesion {
            force: self.initial,
            growth: 0.0,
            curvature: 0.0,
            softening: 0.0,
        };
        for [drop, scale, exponent] in self.drops() {
            let [share, falls] = fall(rest.force_rate, scale, exponent);
            at.force += drop * share;
            at.softening += drop * falls;
        }
        if self.limit > 0.0 && rest.stick_time > 0.0 {
            let [share, falls] = self.softened(rest.force_rate);
            let (m, t) = (self.exponent, rest.stick_time);
            let aged = self.rate * power(t, m);
            let (grown, slope) = (-exp_m1(-aged), m * aged / t);
            at.force += self.limit * grown * share;
            at.softening += self.limit * grown * falls;
            at.growth = self.limit * slope * (1.0 - grown) * share;
            at.curvature = at.growth * ((m - 1.0) / t - slope);
        } else if self.limit > 0.0 {
            (at.growth, at.curvature) = (self.growth_bound(0.0), f64::INFINITY);
        }
        at
    }

    /// f_s(0, δ).
    pub(super) fn without_rest(&self, force_rate: f64) -> f64 {
        self.drops().fold(self.initial, |force, [drop, scale, exponent]| {
            force + drop * fall(force_rate, scale, exponent)[0]
        })
    }

    /// The part of the growth with rest that is left at a force rate, and how fast it falls with that.
    fn softened(&self, force_rate: f64) -> [f64; 2] {
        self.force_rate_scale.map_or([1.0, 0.0], |scale| {
            fall(force_rate, scale, self.force_rate_exponent)
        })
    }

    /// sup of −∂f_s/∂δ between two force rates, whatever the rest.
    pub(super) fn softening_bound(&self, rates: [f64; 2]) -> f64 {
        let drop = self.drops().fold(0.0, |sum, [drop, scale, exponent]| {
            sum + drop * steepest(rates, scale, exponent)
        });
        let growth = self.force_rate_scale.map_or(0.0, |scale| {
            self.limit * steepest(rates, scale, self.force_rate_exponent)
        });
        drop + growth
    }

    /// sup of ∂f_s/∂t_s from `stick_time` on. With z = γ t^m the derivative is Δ∞ m z^(1 − 1/m) γ^(1/m) e^(−z); it falls
    /// throughout for m ≤ 1 and from z = 1 − 1/m on for m > 1.
    pub(super) fn growth_bound(&self, stick_time: f64) -> f64 {
        if self.limit == 0.0 {
            return 0.0;
        }
        let m = self.exponent;
        let peak = if m > 1.0 {
            power((1.0 - 1.0 / m) / self.rate, 1.0 / m)
        } else {
            0.0
        };
        let t = stick_time.max(peak);
        if t <= 0.0 && m < 1.0 {
            return f64::INFINITY;
        }
        let power = power(t, m);
        let slope = if m == 1.0 { 1.0 } else { m * power / t };
        self.limit * self.rate * slope * exp(-self.rate * power)
    }
}

/// 1/(1 + (δ/scale)^exponent) and minus its derivative.
fn fall(force_rate: f64, scale: f64, exponent: f64) -> [f64; 2] {
    let raised = power(force_rate / scale, exponent);
    let share = 1.0 / (1.0 + raised);
    if raised == 0.0 || raised.is_infinite() {
        return [share, 0.0];
    }
    [share, exponent * raised * share * share / force_rate]
}

/// sup of minus that derivative, p z^(p−1)/(1 + z^p)²/scale, between two force rates.
fn steepest([low, high]: [f64; 2], scale: f64, p: f64) -> f64 {
    let (low, high) = (low / scale, high / scale);
    let least = 1.0 + power(low, p);
    let most = if p == 1.0 {
        1.0
    } else {
        power(if p > 1.0 { high } else { low }, p - 1.0)
    };
    p * most / (least * least * scale)
}

impl Value for StaticFriction {
    const KIND: Kind = Kind::Table(Self::PARAMETERS);

    fn check(&self, _name: &'static str, _limits: Limits) -> Result<(), Error> {
        self.within_limits()
    }
}
