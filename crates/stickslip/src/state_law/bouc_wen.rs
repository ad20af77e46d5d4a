//! A loop of restoring force over displacement, whose shape two numbers turn from softening to hardening.

use super::StateFriction;
use crate::elementary::power;
use crate::error::Error;
use crate::law::declaration::{Limited, parameters};

parameters! {
    /// ż = A w − β |w| |z|^(n−1) z − γ w |z|^n, F = k z, rate-independent.
    ///
    /// Bouc (1967, n = 1); Wen, J. Engineering Mechanics Division ASCE 102 (1976) 249.
    pub struct BoucWen {
        /// Stiffness k of the hysteretic force.
        pub stiffness: f64 = 4.0 => [Number::of("stiffness").positive()],
        /// β > 0, 1/length^n.
        pub beta: f64 = 8.0 => [Number::of("length^-exponent").positive()],
        /// γ with |γ| ≤ β.
        pub gamma: f64 = 4.0 => [Number::of("length^-exponent")],
        /// Exponent n ≥ 1.
        #[serde(default = "crate::law::one")]
        pub exponent: f64 = 2.0 => [PURE.search(1.0, 3.0)],
        /// A > 0, 1 as a rule.
        #[serde(default = "crate::law::one")]
        pub amplitude: f64 = 1.0 => [PURE.positive()],
    }
}

impl BoucWen {
    fn largest(&self) -> f64 {
        power(self.amplitude / (self.beta + self.gamma), 1.0 / self.exponent)
    }
}

impl StateFriction for BoucWen {
    fn validate(&self) -> Result<(), Error> {
        self.within_limits()?;
        if self.gamma > self.beta || self.gamma <= -self.beta {
            return Err(Error::Geometry {
                what: "gamma must lie in (−beta, beta], as the contact would create energy or never slip",
                value: self.gamma,
            });
        }
        if self.exponent < 1.0 {
            return Err(Error::Geometry {
                what: "exponent must be at least 1",
                value: self.exponent,
            });
        }
        Ok(())
    }

    fn rates(&self, w: f64, z: &[f64], rates: &mut [f64]) -> f64 {
        let z = z[0];
        let raised = power(z.abs(), self.exponent);
        let sense = if z * w < 0.0 { -1.0 } else { 1.0 };
        rates[0] = w * (self.amplitude - raised * (self.beta * sense + self.gamma));
        self.stiffness * z
    }

    fn steady(&self, w: f64, z: &mut [f64]) {
        z[0] = if w == 0.0 { 0.0 } else { self.largest().copysign(w) };
    }

    fn pace(&self, w: f64) -> f64 {
        let curvature = self.exponent * power(self.largest(), self.exponent - 1.0);
        (self.beta + self.gamma.abs()) * curvature * w.abs()
    }
}
