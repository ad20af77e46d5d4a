//! Laws with an internal state from the formulas of `docs/laws.md`, each value with its derivatives.

use std::ops::{Add, Mul, Neg, Sub};

use serde_json::Value;

use crate::law::{self, Kinetic, piece_at};
use crate::problem::Document;

/// A number and its derivatives with respect to w and the two states.
#[derive(Clone, Copy, Debug)]
pub struct Jet {
    /// The number.
    pub value: f64,
    /// Its derivatives.
    pub slope: [f64; 3],
}

impl Jet {
    fn constant(value: f64) -> Self {
        Self {
            value,
            slope: [0.0; 3],
        }
    }

    fn variable(value: f64, which: usize) -> Self {
        let mut jet = Self::constant(value);
        jet.slope[which] = 1.0;
        jet
    }

    /// f of it, given f and f′ there.
    fn through(self, value: f64, slope: f64) -> Self {
        // Where a power has no slope at zero, none will do: it only steers a method that needs no exact one.
        let slope = if slope.is_finite() { slope } else { 0.0 };
        Self {
            value,
            slope: self.slope.map(|part| slope * part),
        }
    }

    fn exp(self) -> Self {
        let value = self.value.exp();
        self.through(value, value)
    }

    fn ln(self) -> Self {
        self.through(self.value.ln(), 1.0 / self.value)
    }

    fn abs(self) -> Self {
        if self.value < 0.0 { -self } else { self }
    }

    fn power(self, n: f64) -> Self {
        self.through(self.value.powf(n), n * self.value.powf(n - 1.0))
    }

    fn over(self, other: Self) -> Self {
        self * other.through(1.0 / other.value, -1.0 / (other.value * other.value))
    }

    fn times(self, factor: f64) -> Self {
        self * Self::constant(factor)
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let mut sum = self;
        sum.value += other.value;
        sum.slope.iter_mut().zip(other.slope).for_each(|(a, b)| *a += b);
        sum
    }
}

impl Neg for Jet {
    type Output = Self;
    fn neg(self) -> Self {
        Self {
            value: -self.value,
            slope: self.slope.map(|part| -part),
        }
    }
}

impl Sub for Jet {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let mut product = Self::constant(self.value * other.value);
        for part in 0..3 {
            product.slope[part] = self.slope[part] * other.value + self.value * other.slope[part];
        }
        product
    }
}

/// Bristles: σ₀, σ₁, σ₂, and f_k, f_s, w_s, n of the curve they yield along.
#[derive(Clone, Debug)]
pub struct Bristles {
    stiffness: f64,
    damping: f64,
    viscous: f64,
    curve: [f64; 4],
}

impl Bristles {
    /// g(w) = f_k + (f_s − f_k) exp(−|w/w_s|^n).
    fn curve(&self, w: Jet) -> Jet {
        let [kinetic, static_limit, scale, exponent] = self.curve;
        let fall = -w.abs().times(1.0 / scale).power(exponent);
        Jet::constant(kinetic) + fall.exp().times(static_limit - kinetic)
    }
}

/// How θ of a rate-and-state law evolves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aging {
    /// θ̇ = 1 − |w| θ/L: Dieterich (1979), in the form of Ruina (1983).
    Dieterich,
    /// θ̇ = −(|w| θ/L) ln(|w| θ/L): Ruina (1983).
    Ruina,
    /// θ̇ = 1 − (|w| θ/2L)²: Perrin, Rice & Zheng (1995).
    Perrin,
    /// θ̇ = exp(−|w|/V_c) − (|w| θ/L) ln(|w| θ/L): Kato & Tullis (2001).
    Kato(f64),
}

/// A law with an internal state.
#[derive(Clone, Debug)]
pub enum StateLaw {
    /// dF/dx = σ |1 − (F/f_k) sgn w|^i sgn(1 − (F/f_k) sgn w): Dahl (1968). σ, f_k, i.
    Dahl([f64; 3]),
    /// ż = w − σ₀ |w| z/g(w), F = σ₀ z + σ₁ ż + σ₂ w: Canudas de Wit, Olsson, Åström & Lischinsky (1995), eqs. 1 to 3.
    LuGre(Bristles),
    /// ż = w (1 − α(z, w) z/z_∞(w)): Dupont, Hayward, Armstrong & Altpeter (2002), eqs. 10 to 13. σ₀ z_e.
    ElastoPlastic(Bristles, f64),
    /// ż = A w − β |w| |z|^(n−1) z − γ w |z|^n, F = k z: Wen (1976), eq. 2. k, A, β, γ, n.
    BoucWen([f64; 5]),
    /// F = N a asinh((w/2V₀) exp((μ₀ + Σ b ψ)/a)): Rice, Lapusta & Ranjith (2001), eq. 15, with ψ = ln(V₀ θ/L).
    RateState {
        /// N, a, μ₀, V₀.
        direct: [f64; 4],
        /// b and L of each state.
        states: Vec<[f64; 2]>,
        /// The evolution of θ.
        aging: Aging,
    },
    /// F = s(w/width) f(|w|) with s = (2/π) arctan, or tanh.
    Regularised(Box<law::Law>, f64, bool),
}

impl Document for StateLaw {
    fn read(document: &Value) -> Option<Self> {
        let number = |name: &str| document[name].as_f64();
        let or = |name: &str, default: f64| number(name).unwrap_or(default);
        let bristles = || {
            Some(Bristles {
                stiffness: number("stiffness")?,
                damping: number("damping")?,
                viscous: number("viscous")?,
                curve: [
                    number("kinetic")?,
                    number("break_away")?,
                    number("scale")?,
                    or("exponent", 2.0),
                ],
            })
        };
        Some(match document["type"].as_str()? {
            "Dahl" => Self::Dahl([number("stiffness")?, number("kinetic")?, or("exponent", 1.0)]),
            "LuGre" => Self::LuGre(bristles()?),
            "ElastoPlastic" => Self::ElastoPlastic(bristles()?, number("elastic")?),
            "BoucWen" => Self::BoucWen([
                number("stiffness")?,
                or("amplitude", 1.0),
                number("beta")?,
                number("gamma")?,
                or("exponent", 1.0),
            ]),
            "RateState" => {
                let mut states = vec![[number("b")?, number("length")?]];
                if let (Some(b), Some(length)) = (number("second_b"), number("second_length")) {
                    states.push([b, length]);
                }
                let aging = match document["law"].as_str().unwrap_or("aging") {
                    "aging" => Aging::Dieterich,
                    "slip" => Aging::Ruina,
                    "perrin-rice-zheng" => Aging::Perrin,
                    "composite" => Aging::Kato(number("cutoff_velocity")?),
                    _ => return None,
                };
                Self::RateState {
                    direct: [
                        number("normal_force")?,
                        number("a")?,
                        or("reference_friction", 0.6),
                        number("reference_velocity")?,
                    ],
                    states,
                    aging,
                }
            }
            "Regularised" => {
                let law = law::Law::read(&document["law"])?;
                let remembers = matches!(law.kinetic, Kinetic::Branches(_) | Kinetic::Paper(_));
                (!remembers).then_some(())?;
                Self::Regularised(Box::new(law), number("width")?, document["shape"] == "tanh")
            }
            _ => return None,
        })
    }
}

impl StateLaw {
    /// How many numbers its state is, as documents count them: what has none keeps one at zero.
    pub fn states(&self) -> usize {
        if let Self::RateState { states, .. } = self {
            states.len()
        } else {
            1
        }
    }

    /// Friction, then the rates of the states.
    pub fn rates(&self, w: f64, z: &[f64]) -> [Jet; 3] {
        let none = Jet::constant(0.0);
        let (w, first) = (Jet::variable(w, 0), Jet::variable(z[0], 1));
        let sense = if w.value < 0.0 { -1.0 } else { 1.0 };
        match self {
            Self::Dahl([stiffness, kinetic, exponent]) => {
                let room = Jet::constant(1.0) - first.times(sense / kinetic);
                let softened = room.abs().power(*exponent).times(room.value.signum());
                [first, (softened * w).times(*stiffness), none]
            }
            Self::LuGre(bristles) => {
                let yielding = (w.abs() * first).over(bristles.curve(w));
                bristles.force(w, first, w - yielding.times(bristles.stiffness))
            }
            Self::ElastoPlastic(bristles, elastic) => {
                let limit = bristles.curve(w);
                let force = first.abs().times(bristles.stiffness);
                let share = if first.value * w.value <= 0.0 || force.value <= *elastic {
                    none
                } else if force.value >= limit.value {
                    Jet::constant(1.0)
                } else {
                    let elastic = Jet::constant(*elastic);
                    let turn = (force - (limit + elastic).times(0.5)).over(limit - elastic);
                    let angle = turn.times(std::f64::consts::PI);
                    let sine = angle.through(angle.value.sin(), angle.value.cos());
                    Jet::constant(0.5) + sine.times(0.5)
                };
                bristles.force(w, first, w - w * share * force.over(limit))
            }
            Self::BoucWen([stiffness, amplitude, beta, gamma, exponent]) => {
                let raised = first.abs().power(*exponent);
                let sign = if first.value < 0.0 { -1.0 } else { 1.0 };
                let bent = w.abs().times(beta * sign) + w.times(*gamma);
                [first.times(*stiffness), w.times(*amplitude) - bent * raised, none]
            }
            Self::RateState {
                direct: [normal, a, friction, velocity],
                states,
                aging,
            } => {
                let mut exponent = Jet::constant(*friction) + first.times(states[0][0]);
                let mut rates = [none; 3];
                for (index, [b, length]) in states.iter().enumerate() {
                    let state = Jet::variable(z[index], 1 + index);
                    if index > 0 {
                        exponent = exponent + state.times(*b);
                    }
                    rates[1 + index] = aging.rate(w.abs(), state, *velocity).times(1.0 / length);
                }
                let exponent = exponent.times(1.0 / a);
                let speed = w.abs().times(0.5 / velocity);
                let size = speed.value.ln() + exponent.value;
                let inverse = if size > 20.0 {
                    speed.ln() + exponent + Jet::constant(std::f64::consts::LN_2)
                } else {
                    let y = w.times(0.5 / velocity) * exponent.exp();
                    y.through(y.value.asinh(), 1.0 / y.value.hypot(1.0)).times(sense)
                };
                rates[0] = inverse.times(sense * normal * a);
                rates
            }
            Self::Regularised(law, width, tanh) => {
                let y = w.times(1.0 / width);
                let sign = if *tanh {
                    let value = y.value.tanh();
                    y.through(value, 1.0 - value * value)
                } else {
                    let turn = std::f64::consts::FRAC_2_PI;
                    y.through(turn * y.value.atan(), turn / (1.0 + y.value * y.value))
                };
                let u = w.abs();
                let [force, slope] = match &law.kinetic {
                    Kinetic::Lines(lines) => {
                        let line = piece_at(lines, u.value, true);
                        [line.force(u.value), line.slope]
                    }
                    _ => law.curve(u.value),
                };
                [sign * u.through(force, slope), none, none]
            }
        }
    }

    /// The states of steady slip; of a contact that was never loaded at rest.
    pub fn steady(&self, w: f64) -> Vec<f64> {
        let none = w == 0.0;
        match self {
            Self::Regularised(..) => vec![0.0],
            Self::RateState {
                states,
                aging,
                direct: [.., velocity],
            } => {
                let psi = if none {
                    0.0
                } else {
                    aging.steady(w.abs(), *velocity)
                };
                vec![psi; states.len()]
            }
            _ if none => vec![0.0],
            Self::Dahl([_, kinetic, _]) => vec![kinetic.copysign(w)],
            Self::LuGre(bristles) | Self::ElastoPlastic(bristles, _) => {
                vec![bristles.curve(Jet::constant(w)).value.copysign(w) / bristles.stiffness]
            }
            Self::BoucWen([_, amplitude, beta, gamma, exponent]) => {
                vec![(amplitude / (beta + gamma)).powf(1.0 / exponent).copysign(w)]
            }
        }
    }

    /// The size of its states in slip at a speed.
    pub fn size(&self, speed: f64) -> Vec<f64> {
        if let Self::RateState { states, .. } = self {
            // A logarithm.
            return vec![1.0; states.len()];
        }
        let size = |state: f64| if state == 0.0 { 1.0 } else { state.abs() };
        self.steady(speed).into_iter().map(size).collect()
    }
}

impl Bristles {
    fn force(&self, w: Jet, z: Jet, rate: Jet) -> [Jet; 3] {
        let force = z.times(self.stiffness) + rate.times(self.damping) + w.times(self.viscous);
        [force, rate, Jet::constant(0.0)]
    }
}

impl Aging {
    /// L ψ̇ = L θ̇/θ.
    fn rate(self, speed: Jet, psi: Jet, velocity: f64) -> Jet {
        let none = Jet::constant(0.0);
        // L/θ, and |w| ln(|w| θ/L), which is zero at rest.
        let young = (-psi).exp().times(velocity);
        let slipping = if speed.value == 0.0 {
            none
        } else {
            speed * (speed.times(1.0 / velocity).ln() + psi)
        };
        match self {
            Self::Dieterich => young - speed,
            Self::Ruina => -slipping,
            Self::Perrin => (young - (speed * speed * psi.exp()).times(1.0 / velocity)).times(0.5),
            Self::Kato(cutoff) => speed.times(-1.0 / cutoff).exp() * young - slipping,
        }
    }

    /// ψ of steady slip.
    fn steady(self, speed: f64, velocity: f64) -> f64 {
        let shift = -(speed / velocity).ln();
        let Self::Kato(cutoff) = self else {
            return shift;
        };
        // φ = ln(|w| θ/L) of c exp(−φ) = φ, by halving.
        let c = (-speed / cutoff).exp();
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if c * f64::exp(-middle) > middle {
                low = middle;
            } else {
                high = middle;
            }
        }
        shift + low
    }
}
