//! The surface f_s(t_s, δ): static friction from stick time and force rate.

use serde::{Deserialize, Serialize};

use super::Hold;
use crate::error::{Error, not_negative, positive};

/// f_s(t_s, δ) = f_0 + Δ₀/(1 + (δ/δ₁)^p) + Δ∞ (1 − exp(−γ t_s^m)) / (1 + (δ/δ₀)^q).
///
/// The growth with rest is Kato's (Kato, Sato & Matsubayashi, Wear 20 (1972) 315); the fall with the force rate follows
/// the finding of Johannes, Green & Brockley (Wear 24 (1973) 381) in a form of our own, for what rest adds and, with Δ₀, for
/// what there is without rest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StaticFriction {
    /// f_0 = f_s(0, δ → ∞).
    pub initial: f64,
    /// What f_s(0, δ) falls by from a vanishing to an infinite force rate, Δ₀.
    #[serde(default)]
    pub drop: f64,
    /// Force rate δ₁ at which half of that is gone.
    #[serde(default = "crate::law::one")]
    pub drop_scale: f64,
    /// Exponent p.
    #[serde(default = "crate::law::one")]
    pub drop_exponent: f64,
    /// Growth after an infinite rest at a vanishing force rate, Δ∞.
    #[serde(default)]
    pub limit: f64,
    /// Rate γ, 1/time^m.
    #[serde(default = "crate::law::one")]
    pub rate: f64,
    /// Exponent m.
    #[serde(default = "crate::law::one")]
    pub exponent: f64,
    /// Force rate δ₀ at which the growth is halved; none: no dependence on the force rate.
    #[serde(default)]
    pub force_rate_scale: Option<f64>,
    /// Exponent q.
    #[serde(default = "crate::law::one")]
    pub force_rate_exponent: f64,
}

impl StaticFriction {
    /// The same force whatever the hold.
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
        }
    }

    pub(super) fn validate(&self) -> Result<(), Error> {
        positive("initial static friction", self.initial)?;
        not_negative("drop of static friction", self.drop)?;
        positive("drop_scale", self.drop_scale)?;
        positive("drop_exponent", self.drop_exponent)?;
        not_negative("limit of static friction", self.limit)?;
        positive("rate of static friction", self.rate)?;
        positive("exponent of static friction", self.exponent)?;
        if let Some(scale) = self.force_rate_scale {
            positive("force_rate_scale", scale)?;
        }
        positive("force_rate_exponent", self.force_rate_exponent).map(drop)
    }

    pub(super) fn force(&self, hold: Hold) -> f64 {
        let initial = self.without_rest(hold.force_rate);
        if self.limit == 0.0 || hold.stick_time <= 0.0 {
            return initial;
        }
        let grown = -(-self.rate * self.power(hold.stick_time)).exp_m1();
        let softened = match self.force_rate_scale {
            None => 1.0,
            Some(scale) => 1.0 + (hold.force_rate / scale).powf(self.force_rate_exponent),
        };
        initial + self.limit * grown / softened
    }

    /// f_s(0, δ).
    pub(super) fn without_rest(&self, force_rate: f64) -> f64 {
        if self.drop == 0.0 {
            return self.initial;
        }
        self.initial + self.drop / (1.0 + (force_rate / self.drop_scale).powf(self.drop_exponent))
    }

    /// sup of ∂f_s/∂t_s from `stick_time` on. With z = γ t^m the derivative is Δ∞ m z^(1 − 1/m) γ^(1/m) e^(−z); it falls
    /// throughout for m ≤ 1 and from z = 1 − 1/m on for m > 1.
    pub(super) fn growth_bound(&self, stick_time: f64) -> f64 {
        if self.limit == 0.0 {
            return 0.0;
        }
        let m = self.exponent;
        let peak = if m > 1.0 {
            ((1.0 - 1.0 / m) / self.rate).powf(1.0 / m)
        } else {
            0.0
        };
        let t = stick_time.max(peak);
        if t <= 0.0 && m < 1.0 {
            return f64::INFINITY;
        }
        let power = self.power(t);
        let slope = if m == 1.0 { 1.0 } else { m * power / t };
        self.limit * self.rate * slope * (-self.rate * power).exp()
    }

    fn power(&self, t: f64) -> f64 {
        if self.exponent == 1.0 {
            t
        } else {
            t.powf(self.exponent)
        }
    }
}
