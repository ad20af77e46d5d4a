//! Friction that yields before it slips, like a strained solid.

use super::StateFriction;
use crate::elementary::{exp, power};
use crate::law::declaration::parameters;

parameters! {
    /// dF/dx = σ |1 − (F/f_k) sgn w|^i sgn(1 − (F/f_k) sgn w), rate-independent; the state is F itself.
    ///
    /// Dahl, A solid friction model, Aerospace Corporation TOR-158(3107-18) (1968).
    pub struct Dahl {
        /// Stiffness σ at F = 0.
        pub stiffness: f64 = 4.0 => [Number::of("stiffness").positive()],
        /// Friction f_k of steady slip.
        pub kinetic: f64 = 1.0 => [FORCE.positive()],
        /// Exponent i: 1 as a rule, below for brittle, above for ductile contacts.
        #[serde(default = "crate::law::one")]
        pub exponent: f64 = 1.0 => [EXPONENT],
    }
}

impl StateFriction for Dahl {
    fn rates(&self, w: f64, z: &[f64], rates: &mut [f64]) -> f64 {
        let z = z[0];
        if w == 0.0 {
            rates[0] = 0.0;
            return z;
        }
        let room = 1.0 - z / self.kinetic * w.signum();
        let softened = if self.exponent == 1.0 {
            room
        } else {
            power(room.abs(), self.exponent).copysign(room)
        };
        rates[0] = self.stiffness * softened * w;
        z
    }

    fn steady(&self, w: f64, z: &mut [f64]) {
        z[0] = if w == 0.0 { 0.0 } else { self.kinetic.copysign(w) };
    }

    fn advance(&self, w: f64, z: &mut [f64], time: f64) {
        if w == 0.0 {
            return;
        }
        let steady = self.kinetic.copysign(w);
        let room = 1.0 - z[0] / steady;
        let distance = self.stiffness * (w * time).abs() / self.kinetic;
        // r' = −|r|^i sgn r over the distance: exponential for i = 1, a power of a straight line else.
        let left = if self.exponent == 1.0 {
            room * exp(-distance)
        } else {
            let rest = 1.0 - self.exponent;
            let line = power(room.abs(), rest) - rest * distance;
            if line <= 0.0 {
                0.0
            } else {
                power(line, 1.0 / rest).copysign(room)
            }
        };
        z[0] = steady * (1.0 - left);
    }
}
