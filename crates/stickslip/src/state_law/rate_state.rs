//! Friction of rock: it depends on how fast a contact slips and how long its asperities have lived.

use std::f64::consts::LN_2;

use super::{StateFriction, runge_kutta};
use crate::elementary::{asinh, exp, exp_m1, ln, ln_1p, tanh};
use crate::error::{Error, wrong};
use crate::law::declaration::{Limited, parameters, words};

words! {
    /// How the state evolves.
    pub enum Evolution {
        /// θ̇ = 1 − |w| θ/L: contacts age at rest (Dieterich).
        #[default]
        Aging = "aging",
        /// θ̇ = −(|w| θ/L) ln(|w| θ/L): contacts evolve by slip alone (Ruina).
        Slip = "slip",
        /// θ̇ = 1 − (|w| θ/2L)²: contacts age at rest, and slip renews old ones faster than [`Self::Aging`] has it. Perrin, Rice &
        /// Zheng, J. Mechanics and Physics of Solids 43 (1995) 1461.
        PerrinRiceZheng = "perrin-rice-zheng",
        /// θ̇ = exp(−|w|/V_c) − (|w| θ/L) ln(|w| θ/L): contacts age where slip is slower than V_c. Kato & Tullis, Geophysical
        /// Research Letters 28 (2001) 1103.
        Composite = "composite",
    }
}

parameters! {
    /// F = N a asinh((w/2V₀) exp((μ₀ + b ψ + b₂ ψ₂)/a)), the states ψ = ln(V₀ θ/L); for the law of Perrin, Rice & Zheng, whose
    /// θ of steady slip is twice as long, ψ = ln(V₀ θ/2L).
    ///
    /// For |w| ≫ V₀ exp(−μ₀/a) it is N (μ₀ + a ln(|w|/V₀) + b ψ) sgn w of Dieterich, J. Geophysical Research 84 (1979) 2161,
    /// and Ruina, ibid. 88 (1983) 10359; the inverse sine passes through w = 0 (Rice, Lapusta & Ranjith, J. Mechanics and
    /// Physics of Solids 49 (2001) 1865). The second state is that of Ruina and of Gu, Rice, Ruina & Tse, ibid. 32 (1984) 167;
    /// it evolves by the same law over a length of its own.
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
        /// Evolution effect b₂ of a second state; none without it.
        pub second_b: Option<f64> = None => [PURE],
        /// Length of slip L₂ over which the second state evolves.
        pub second_length: Option<f64> = None => [Number::of("length").positive()],
        /// Velocity V_c of the composite law, above which contacts do not age.
        pub cutoff_velocity: Option<f64> = None => [VELOCITY.positive()],
    }
}

fn rock() -> f64 {
    0.6
}

/// The largest logarithm of |w|/V₀ that a variable u may stand for.
const LARGEST_LOG_SPEED: f64 = 200.0;

impl RateState {
    /// b ψ + b₂ ψ₂, and the same of rates.
    fn effect(&self, psi: &[f64]) -> f64 {
        let first = self.b * psi[0];
        match (self.second_b, psi.get(1)) {
            (Some(b), Some(psi)) => first + b * psi,
            _ => first,
        }
    }

    /// (μ₀ + b ψ + b₂ ψ₂)/a.
    fn exponent(&self, psi: &[f64]) -> f64 {
        (self.reference_friction + self.effect(psi)) / self.a
    }

    /// How much of the aging at rest the composite law keeps, exp(−|w|/V_c).
    fn aging(&self, speed: f64) -> f64 {
        exp(-speed / self.cutoff_velocity.unwrap_or(f64::INFINITY))
    }

    /// L ψ̇.
    fn rate(&self, speed: f64, psi: f64) -> f64 {
        let reference = self.reference_velocity;
        match self.law {
            Evolution::Aging => reference * exp(-psi) - speed,
            Evolution::Slip if speed == 0.0 => 0.0,
            Evolution::Slip => -speed * (ln(speed / reference) + psi),
            Evolution::PerrinRiceZheng => {
                0.5 * (reference * exp(-psi) - speed / reference * speed * exp(psi))
            }
            Evolution::Composite if speed == 0.0 => reference * exp(-psi),
            Evolution::Composite => {
                self.aging(speed) * reference * exp(-psi) - speed * (ln(speed / reference) + psi)
            }
        }
    }

    /// ψ of steady slip; at rest, where it would grow for ever, 0.
    fn steady_state(&self, speed: f64) -> f64 {
        if speed == 0.0 {
            return 0.0;
        }
        let slipping = -ln(speed / self.reference_velocity);
        match self.law {
            Evolution::Composite => slipping + product_logarithm(self.aging(speed)),
            _ => slipping,
        }
    }

    /// ψ after `time` at one speed.
    fn after(&self, speed: f64, psi: f64, length: f64, time: f64) -> f64 {
        let reference = self.reference_velocity;
        let decay = exp(-speed * time / length);
        match self.law {
            Evolution::Aging => {
                // θ V₀/L is linear between its value now and V₀/|w|.
                let aged = if speed == 0.0 {
                    reference * time / length
                } else {
                    reference / speed * (1.0 - decay)
                };
                ln(exp(psi) * decay + aged)
            }
            Evolution::Slip if speed == 0.0 => psi,
            Evolution::Slip => {
                let steady = self.steady_state(speed);
                steady + (psi - steady) * decay
            }
            Evolution::PerrinRiceZheng if speed == 0.0 => ln(exp(psi) + 0.5 * reference * time / length),
            Evolution::PerrinRiceZheng => {
                // |w| θ/2L = u tends to 1 as a hyperbolic tangent does: by the sum of two arguments.
                let (now, grown) = (exp(psi) * (speed / reference), tanh(0.5 * speed * time / length));
                ln((now + grown) / (1.0 + now * grown) * (reference / speed))
            }
            Evolution::Composite if speed == 0.0 => ln(exp(psi) + reference * time / length),
            Evolution::Composite => {
                let shift = ln(speed / reference);
                composite(self.aging(speed), psi + shift, speed * time / length) - shift
            }
        }
    }
}

impl StateFriction for RateState {
    fn validate(&self) -> Result<(), Error> {
        self.within_limits()?;
        if self.second_b.is_some() != self.second_length.is_some() {
            return wrong("second_b and second_length make a second state: give both of them or none".into());
        }
        match (self.law, self.cutoff_velocity) {
            (Evolution::Composite, None) => wrong("the composite law needs its cutoff_velocity".into()),
            (Evolution::Composite, Some(_)) | (_, None) => Ok(()),
            (_, Some(_)) => wrong("only the composite law has a cutoff_velocity: leave it out".into()),
        }
    }

    fn states(&self) -> usize {
        1 + usize::from(self.second_length.is_some())
    }

    fn rates(&self, w: f64, z: &[f64], rates: &mut [f64]) -> f64 {
        rates[0] = self.rate(w.abs(), z[0]) / self.length;
        if let Some(length) = self.second_length {
            rates[1] = self.rate(w.abs(), z[1]) / length;
        }
        self.direct_effect() * self.slip_variable(w, z)
    }

    fn is_steep(&self) -> bool {
        true
    }

    /// u = asinh((w/2V₀) exp((μ₀ + b ψ + b₂ ψ₂)/a)): friction is N a u, a line through rest.
    fn slip_variable(&self, w: f64, z: &[f64]) -> f64 {
        if w == 0.0 {
            return 0.0;
        }
        let log = ln(w.abs() / (2.0 * self.reference_velocity)) + self.exponent(z);
        // asinh y = ln 2y for y beyond 1e9, where y itself may overflow.
        let inverse = if log > 20.0 { log + LN_2 } else { asinh(exp(log)) };
        inverse.copysign(w)
    }

    fn at_slip_variable(&self, u: f64, z: &[f64], rates: &mut [f64]) -> [f64; 2] {
        // 2V₀ exp(−(μ₀ + …)/a) sinh u, and where an integrator tries what is out of range, a speed that is still a number.
        let grown = exp((u.abs() - self.exponent(z)).min(LARGEST_LOG_SPEED));
        let speed = -self.reference_velocity * grown * exp_m1(-2.0 * u.abs());
        self.rates(speed, z, rates);
        [speed.copysign(u), self.direct_effect() * u]
    }

    fn direct_effect(&self) -> f64 {
        self.normal_force * self.a
    }

    /// exp((μ₀ + …)/a)/(2V₀ cosh u) and tanh u (b ψ̇ + b₂ ψ̇₂)/a.
    fn slip_variable_slopes(&self, u: f64, z: &[f64], rates: &[f64], most: f64) -> [f64; 2] {
        let twice_cosh = u.abs() + ln_1p(exp(-2.0 * u.abs()));
        let slope = exp(self.exponent(z) - twice_cosh) / self.reference_velocity;
        [slope.min(most), tanh(u) * self.effect(rates) / self.a]
    }

    /// That of the shorter length; at rest, as at V₀.
    fn pace(&self, w: f64) -> f64 {
        let length = self.second_length.unwrap_or(f64::INFINITY).min(self.length);
        (if w == 0.0 {
            self.reference_velocity
        } else {
            w.abs()
        }) / length
    }

    /// ψ = −ln(|w|/V₀); at rest, that of V₀.
    fn steady(&self, w: f64, z: &mut [f64]) {
        z.fill(self.steady_state(w.abs()));
    }

    /// The state is a logarithm.
    fn state_scale(&self, _speed: f64, scale: &mut [f64]) {
        scale.fill(1.0);
    }

    fn advance(&self, w: f64, z: &mut [f64], time: f64) {
        z[0] = self.after(w.abs(), z[0], self.length, time);
        if let Some(length) = self.second_length {
            z[1] = self.after(w.abs(), z[1], length, time);
        }
    }
}

/// W(c) of W exp W = c for c in [0, 1], by Newton's method.
fn product_logarithm(c: f64) -> f64 {
    let mut w = c / (1.0 + c);
    for _ in 0..8 {
        let grown = exp(w);
        w -= (w * grown - c) / (grown * (1.0 + w));
    }
    w
}

/// φ = ln(|w| θ/L) of the composite law after a path, in lengths L: φ' = c exp(−φ) − φ.
fn composite(c: f64, from: f64, path: f64) -> f64 {
    let steady = product_logarithm(c);
    // Nothing but the steady state is left of any start after so many lengths.
    if path > 45.0 {
        return steady;
    }
    // Steps of 1/100 of the law's own time. Where θ is short, θ itself is the smooth variable.
    let mut left = path;
    if from > steady {
        let mut phi = from;
        while left > 0.0 {
            let h = left.min(0.01);
            phi = runge_kutta(&|phi| c * exp(-phi) - phi, phi, h);
            left -= h;
        }
        return phi;
    }
    let (mut share, log) = (exp(from), |share: f64| ln(share.max(f64::MIN_POSITIVE)));
    let rate = |share: f64| c - share * log(share);
    while left > 0.0 {
        // θ ln θ is not smooth at 0: no step is longer than a twentieth of θ, or of one that counts for nothing.
        let h = (0.01 / (1.0 + log(share).abs())).min(0.05 * (share + 1e-12) / rate(share).abs());
        let h = left.min(h);
        share = runge_kutta(&rate, share, h);
        left -= h;
    }
    ln(share)
}
