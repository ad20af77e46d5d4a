//! A loop of restoring force over displacement, whose shape two numbers turn from softening to hardening.

use super::{StateFriction, in_small_steps};
use crate::elementary::{exp, exp_m1, ln_1p, power};
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

    fn advance(&self, w: f64, z: &mut [f64], time: f64) {
        if self.exponent != 1.0 {
            in_small_steps(self, w, z, time);
            return;
        }
        if w == 0.0 {
            return;
        }
        // Of the exponent 1 exponentials of the distance; a fit that tries stiff loops would take a million steps else.
        let (mut along, mut left) = (z[0] * w.signum(), w.abs() * time);
        if along < 0.0 {
            let pace = self.beta - self.gamma;
            let gained = if pace > 0.0 {
                -exp_m1(-pace * left) / pace
            } else {
                left
            };
            let end = along + (self.amplitude - pace * along) * gained;
            if end <= 0.0 {
                z[0] = end * w.signum();
                return;
            }
            let to_zero = -along / self.amplitude;
            left -= if pace > 0.0 {
                ln_1p(pace * to_zero) / pace
            } else {
                to_zero
            };
            along = 0.0;
        }
        let largest = self.largest();
        let decayed = exp(-(self.beta + self.gamma) * left.max(0.0));
        z[0] = (largest + (along - largest) * decayed) * w.signum();
    }
}

#[cfg(test)]
mod tests {
    use super::BoucWen;
    use crate::law::declaration::Parameters;
    use crate::state_law::{StateFriction, in_small_steps};

    #[test]
    fn of_the_exponent_one_the_state_goes_on_as_small_steps_have_it() {
        for (beta, gamma) in [(8.0, 4.0), (8.0, -4.0), (8.0, 8.0)] {
            let law = BoucWen {
                beta,
                gamma,
                exponent: 1.0,
                ..BoucWen::example()
            };
            // from rest, through zero, short of it, from above the largest state, and far
            for (w, start, time) in [
                (0.2, 0.0, 0.3),
                (-0.2, 0.05, 0.7),
                (0.2, -0.05, 0.01),
                (0.1, 0.4, 0.5),
                (0.3, -0.02, 40.0),
            ] {
                let (mut z, mut small) = ([start], [start]);
                law.advance(w, &mut z, time);
                for _ in 0..100_000 {
                    // each of them is of a lower order where the state passes zero
                    in_small_steps(&law, w, &mut small, time / 1e5);
                }
                assert!(
                    (z[0] - small[0]).abs() < 1e-9,
                    "{beta} {gamma} {w} {start}: {} {}",
                    z[0],
                    small[0]
                );
            }
        }
    }
}
