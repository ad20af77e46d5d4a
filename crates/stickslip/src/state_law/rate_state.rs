//! Friction of rock: it depends on how fast a contact slips and how long its asperities have lived.

use super::StateFriction;
use crate::elementary::{asinh, exp, ln};
use crate::parameters::{parameters, words};

words! {
    /// How the state evolves.
    pub enum Evolution {
        /// θ̇ = 1 − |w| θ/L: contacts age at rest (Dieterich).
        #[default]
        Aging = "aging",
        /// θ̇ = −(|w| θ/L) ln(|w| θ/L): contacts evolve by slip alone (Ruina).
        Slip = "slip",
    }
}

parameters! {
    /// F = N a asinh((w/2V₀) exp((μ₀ + b ψ)/a)), the state ψ = ln(V₀ θ/L).
    ///
    /// For |w| ≫ V₀ exp(−μ₀/a) it is N (μ₀ + a ln(|w|/V₀) + b ψ) sgn w of Dieterich, J. Geophysical Research 84 (1979) 2161,
    /// and Ruina, ibid. 88 (1983) 10359; the inverse sine passes through w = 0 (Rice, Lapusta & Ranjith, J. Mechanics and
    /// Physics of Solids 49 (2001) 1865).
    pub struct RateState {
        /// Normal force N.
        pub normal_force: f64 = 1.0 => [FORCE.positive()],
        /// Direct effect a.
        pub a: f64 = 0.01 => [PURE.positive()],
        /// Evolution effect b.
        pub b: f64 = 0.015 => [PURE.search(0.0, f64::INFINITY)],
        /// Length of slip L (D_c) over which the state evolves.
        pub length: f64 = 1.0 => [Number::of("length").positive()],
        /// Reference velocity V₀.
        pub reference_velocity: f64 = 1.0 => [VELOCITY.positive()],
        /// Friction coefficient μ₀ of steady slip at V₀.
        #[serde(default = "rock")]
        pub reference_friction: f64 = 0.6 => [PURE.positive()],
        /// Evolution of the state.
        #[serde(default)]
        pub law: Evolution = Evolution::Aging => [],
    }
}

fn rock() -> f64 {
    0.6
}

impl RateState {
    fn coefficient(&self, w: f64, psi: f64) -> f64 {
        if w == 0.0 {
            return 0.0;
        }
        let exponent = (self.reference_friction + self.b * psi) / self.a;
        let log = ln(w.abs() / (2.0 * self.reference_velocity)) + exponent;
        // asinh y = ln 2y for y beyond 1e9, where y itself may overflow.
        let inverse = if log > 20.0 {
            log + std::f64::consts::LN_2
        } else {
            asinh(exp(log))
        };
        (self.a * inverse).copysign(w)
    }
}

impl StateFriction for RateState {
    fn rates(&self, w: f64, z: f64) -> (f64, f64) {
        let speed = w.abs();
        let rate = match self.law {
            Evolution::Aging => self.reference_velocity * exp(-z) - speed,
            Evolution::Slip if speed == 0.0 => 0.0,
            Evolution::Slip => -speed * (ln(speed / self.reference_velocity) + z),
        };
        (self.normal_force * self.coefficient(w, z), rate / self.length)
    }

    /// ψ = −ln(|w|/V₀); at rest, that of V₀.
    fn steady(&self, w: f64) -> f64 {
        if w == 0.0 {
            0.0
        } else {
            -ln(w.abs() / self.reference_velocity)
        }
    }

    /// The state is a logarithm.
    fn state_scale(&self, _speed: f64) -> f64 {
        1.0
    }

    fn advance(&self, w: f64, z: f64, time: f64) -> f64 {
        let speed = w.abs();
        let decay = exp(-speed * time / self.length);
        match self.law {
            Evolution::Aging => {
                // θ V₀/L is linear between its value now and V₀/|w|.
                let aged = if speed == 0.0 {
                    self.reference_velocity * time / self.length
                } else {
                    self.reference_velocity / speed * (1.0 - decay)
                };
                ln(exp(z) * decay + aged)
            }
            Evolution::Slip if speed == 0.0 => z,
            Evolution::Slip => {
                let steady = self.steady(w);
                steady + (z - steady) * decay
            }
        }
    }
}
