//! Bristles that bend, yield along a Stribeck curve and damp.

use super::StateFriction;
use crate::elementary::{exp, power};
use crate::error::Error;
use crate::law::declaration::{Kind, Limited, Limits, Parameters, Value, parameters};

parameters! {
    /// ż = w − σ₀ |w| z/g(w), F = σ₀ z + σ₁ ż + σ₂ w, g(w) = f_k + (f_s − f_k) exp(−|w/w_s|^n).
    ///
    /// Canudas de Wit, Olsson, Åström & Lischinsky, IEEE Trans. Automatic Control 40 (1995) 419.
    pub struct LuGre {
        /// Stiffness of the bristles, σ₀.
        pub stiffness: f64 = 100.0 => [Number::of("stiffness").positive()],
        /// Damping of the bristles, σ₁.
        pub damping: f64 = 2.0 => [Number::of("damping").not_negative()],
        /// Viscous friction, σ₂.
        pub viscous: f64 = 0.1 => [Number::of("damping").not_negative()],
        /// Friction f_k of fast steady slip.
        pub kinetic: f64 = 1.0 => [FORCE.positive()],
        /// Friction f_s of vanishing steady slip.
        pub break_away: f64 = 1.5 => [FORCE.positive()],
        /// Velocity w_s over which friction falls.
        pub scale: f64 = 0.1 => [VELOCITY.positive()],
        /// Exponent n of the fall, 2 as a rule.
        #[serde(default = "two")]
        pub exponent: f64 = 2.0 => [EXPONENT],
    }
}

fn two() -> f64 {
    2.0
}

impl LuGre {
    /// g(w), the curve of steady slip that the bristles approach.
    pub(super) fn curve(&self, w: f64) -> f64 {
        let ratio = (w / self.scale).abs();
        self.kinetic + (self.break_away - self.kinetic) * exp(-power(ratio, self.exponent))
    }

    /// The deflection of the bristles in steady slip.
    fn deflection(&self, w: f64) -> f64 {
        if w == 0.0 {
            0.0
        } else {
            self.curve(w).copysign(w) / self.stiffness
        }
    }
}

impl StateFriction for LuGre {
    fn rates(&self, w: f64, z: &[f64], rates: &mut [f64]) -> f64 {
        rates[0] = w - self.stiffness * w.abs() * z[0] / self.curve(w);
        self.stiffness * z[0] + self.damping * rates[0] + self.viscous * w
    }

    fn steady(&self, w: f64, z: &mut [f64]) {
        z[0] = self.deflection(w);
    }

    fn advance(&self, w: f64, z: &mut [f64], time: f64) {
        let steady = self.deflection(w);
        let distance = self.stiffness * (w * time).abs() / self.curve(w);
        z[0] = steady + (z[0] - steady) * exp(-distance);
    }
}

impl Value for LuGre {
    const KIND: Kind = Kind::Beside(Self::PARAMETERS);

    fn check(&self, _name: &'static str, _limits: Limits) -> Result<(), Error> {
        self.within_limits()
    }
}
