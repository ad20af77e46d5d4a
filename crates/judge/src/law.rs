//! Every law from its formula in `docs/laws.md`: the force adhesion bears and the force slip produces.

use serde_json::Value;

use crate::problem::Document;

/// A straight piece of friction over the slip speed u ≥ 0, from `low` to `high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// The slip speed at which it begins.
    pub low: f64,
    /// The slip speed at which it ends.
    pub high: f64,
    /// A point (u, f) on it.
    pub point: [f64; 2],
    /// df/du.
    pub slope: f64,
    /// Which line of the law.
    pub name: usize,
    /// The sense of the slip acceleration it holds for, 0: either.
    pub sense: f64,
}

impl Line {
    pub(crate) fn through(name: usize, point: [f64; 2], slope: f64, low: f64, high: f64) -> Self {
        Self {
            low,
            high,
            point,
            slope,
            name,
            sense: 0.0,
        }
    }

    /// The line, for one sense of the slip acceleration.
    pub(crate) fn toward(self, sense: f64) -> Self {
        Self {
            sense: if sense == 0.0 { 0.0 } else { sense.signum() },
            ..self
        }
    }

    /// Friction at slip speed u.
    pub fn force(&self, u: f64) -> f64 {
        self.point[1] + self.slope * (u - self.point[0])
    }
}

/// Nodes with straight lines between them, constant beyond the first and the last.
#[derive(Clone, Debug)]
pub struct Table(Vec<[f64; 2]>);

impl Table {
    fn read(value: &Value) -> Option<Self> {
        if let Some(number) = value.as_f64() {
            return Some(Self(vec![[0.0, number]]));
        }
        let node = |node: &Value| Some([node[0].as_f64()?, node[1].as_f64()?]);
        let nodes = value.as_array()?.iter().map(node).collect::<Option<Vec<_>>>()?;
        (!nodes.is_empty()).then_some(Self(nodes))
    }

    /// The value at `at`.
    pub fn value(&self, at: f64) -> f64 {
        let nodes = &self.0;
        if at <= nodes[0][0] {
            return nodes[0][1];
        }
        for pair in nodes.windows(2) {
            let ([a, p], [b, q]) = (pair[0], pair[1]);
            if at <= b {
                return p + (q - p) * ((at - a) / (b - a));
            }
        }
        nodes[nodes.len() - 1][1]
    }

    /// Its pieces; beyond the last node constant, or on along the last slope.
    fn lines(&self, goes_on: bool) -> Vec<Line> {
        let mut lines: Vec<Line> = Vec::new();
        for (index, pair) in self.0.windows(2).enumerate() {
            let ([a, p], [b, q]) = (pair[0], pair[1]);
            lines.push(Line::through(index, pair[0], (q - p) / (b - a), a, b));
        }
        let last = self.0[self.0.len() - 1];
        match lines.last_mut() {
            Some(line) if goes_on => line.high = f64::INFINITY,
            _ => lines.push(Line::through(lines.len(), last, 0.0, last[0], f64::INFINITY)),
        }
        lines
    }

    fn kinks(&self) -> Vec<f64> {
        self.0.iter().map(|node| node[0]).collect()
    }
}

/// 1/(1 + (rate/scale)^exponent).
fn softened(rate: f64, scale: f64, exponent: f64) -> f64 {
    1.0 / (1.0 + (rate / scale).powf(exponent))
}

/// f_s(t_s, δ).
#[derive(Clone, Debug)]
pub enum Static {
    /// One number.
    Constant(f64),
    /// Over stick time.
    Table(Table),
    /// f_k + A ln(1 + t_s/t_c).
    Logarithm {
        /// f_k.
        base: f64,
        /// A.
        growth: f64,
        /// t_c.
        onset: f64,
    },
    /// f_0 + Δ₀/(1 + (δ/δ₁)^p) + Δ₂/(1 + (δ/δ₂)^r) + Δ∞ (1 − exp(−γ t_s^m))/(1 + (δ/δ₀)^q).
    Surface {
        /// f_0.
        base: f64,
        /// Δ₀, δ₁, p and Δ₂, δ₂, r.
        drops: [[f64; 3]; 2],
        /// Δ∞, γ, m.
        growth: [f64; 3],
        /// δ₀, q; δ₀ infinite: no dependence.
        softening: [f64; 2],
    },
}

impl Static {
    /// The largest force adhesion bears after a rest at a force rate.
    pub fn force(&self, rest: f64, rate: f64) -> f64 {
        match self {
            Self::Constant(force) => *force,
            Self::Table(table) => table.value(rest),
            Self::Logarithm { base, growth, onset } => base + growth * (rest.max(0.0) / onset).ln_1p(),
            Self::Surface {
                base,
                drops,
                growth,
                softening,
            } => {
                let grown = -(-growth[1] * rest.max(0.0).powf(growth[2])).exp_m1();
                let there = drops.iter().filter(|drop| drop[0] > 0.0);
                let fallen: f64 = there.map(|drop| drop[0] * softened(rate, drop[1], drop[2])).sum();
                let share = if softening[0].is_finite() {
                    softened(rate, softening[0], softening[1])
                } else {
                    1.0
                };
                base + fallen + growth[0] * grown * share
            }
        }
    }

    /// Whether it feels the force rate.
    pub fn feels_rate(&self) -> bool {
        matches!(self, Self::Surface { drops, softening, .. }
            if drops.iter().any(|drop| drop[0] > 0.0) || softening[0].is_finite())
    }

    /// Stick times at which it has a corner.
    pub fn kinks(&self) -> Vec<f64> {
        match self {
            Self::Table(table) => table.kinks(),
            _ => Vec::new(),
        }
    }
}

/// The polynomial through some nodes, by the barycentric formula (Berrut & Trefethen, SIAM Rev. 46 (2004) 501).
#[derive(Clone, Debug)]
pub struct Polynomial {
    /// Each node, its weight, and the value and the slope there.
    nodes: Vec<[f64; 4]>,
}

impl Polynomial {
    fn through(nodes: &[[f64; 2]]) -> Self {
        let width = nodes[nodes.len() - 1][0] - nodes[0][0];
        let weights: Vec<f64> = (nodes.iter().enumerate())
            .map(|(i, [u, _])| {
                let others = nodes.iter().enumerate().filter(|&(j, _)| j != i);
                1.0 / others.map(|(_, [other, _])| (u - other) / width).product::<f64>()
            })
            .collect();
        // The slope is a polynomial of lower degree, so its values at the nodes are all there is to know of it.
        let slope = |k: usize| -> f64 {
            let others = (0..nodes.len()).filter(|&i| i != k);
            let terms = others.map(|i| {
                let ([u, f], [at, value]) = (nodes[i], nodes[k]);
                weights[i] / weights[k] * ((f - value) / (at - u))
            });
            terms.sum()
        };
        Self {
            nodes: (0..nodes.len())
                .map(|k| [nodes[k][0], weights[k], nodes[k][1], slope(k)])
                .collect(),
        }
    }

    /// The first node and the last.
    fn ends(&self) -> [f64; 2] {
        [self.nodes[0][0], self.nodes[self.nodes.len() - 1][0]]
    }

    fn value_and_slope(&self, u: f64) -> [f64; 2] {
        let (mut sums, mut whole) = ([0.0; 2], 0.0);
        for &[at, weight, value, slope] in &self.nodes {
            let share = weight / (u - at);
            if !share.is_finite() {
                // On the node, or a denormal number beside it.
                return [value, slope];
            }
            whole += share;
            sums = [sums[0] + share * value, sums[1] + share * slope];
        }
        sums.map(|sum| sum / whole)
    }
}

/// Friction in slip.
#[derive(Clone, Debug)]
pub enum Kinetic {
    /// Straight pieces.
    Lines(Vec<Line>),
    /// f_s/(1 + δ u), as a hyperbola from f_s to f_k and a square: (f_s − f_k)/(1 + λ₁ u) + f_k + λ₂ u².
    Hyperbola([f64; 4]),
    /// μ_s − k₁ u + k₃ u³.
    Cubic([f64; 3]),
    /// f_k + (f_s − f_k) exp(−(u/w_s)ⁿ) + b u: f_s, f_k, w_s, b, n.
    Exponential([f64; 5]),
    /// f_k + (f_s − f_k)/(1 + (u/w_s)²) + b u: f_s, f_k, w_s, b.
    Lorentz([f64; 4]),
    /// A polynomial through some nodes, another through the next ones, and so on; beyond the last node its tangent.
    Polynomials(Vec<Polynomial>),
    /// One table while u rises, one while it falls.
    Branches([Vec<Line>; 2]),
    /// The paper's geometry.
    Paper(Box<crate::paper::Geometry>),
}

/// A friction law.
#[derive(Clone, Debug)]
pub struct Law {
    /// f_s(t_s, δ).
    pub adhesion: Static,
    /// F(u).
    pub kinetic: Kinetic,
    /// The law for w < 0 and adhesion that pulls that way, where that is another one.
    pub backward: Option<Box<Law>>,
}

impl Document for Law {
    fn read(document: &Value) -> Option<Self> {
        let [adhesion, kinetic] = match document["type"].as_str()? {
            "Asymmetric" => {
                return Some(Self {
                    backward: Some(Box::new(Self::read(&document["backward"])?)),
                    ..Self::read(&document["forward"])?
                });
            }
            "Combined" => ["static", "kinetic"],
            _ => return Self::symmetric(document),
        }
        .map(|part| Self::read(&document[part]));
        Some(Self {
            adhesion: adhesion?.adhesion,
            kinetic: kinetic?.kinetic,
            backward: None,
        })
    }
}

impl Law {
    /// A law that is alike in both directions.
    fn symmetric(document: &Value) -> Option<Self> {
        let number = |name: &str| document[name].as_f64();
        let or = |name: &str, default: f64| document[name].as_f64().unwrap_or(default);
        let constant = |force: f64| Kinetic::Lines(Table(vec![[0.0, force]]).lines(false));
        Some(match document["type"].as_str()? {
            "Coulomb" => Self {
                backward: None,
                adhesion: Static::Constant(number("kinetic")?),
                kinetic: constant(number("kinetic")?),
            },
            "StaticKinetic" => Self {
                backward: None,
                adhesion: Static::Constant(number("break_away")?),
                kinetic: constant(number("kinetic")?),
            },
            "PiecewiseLinear" => Self {
                backward: None,
                adhesion: Static::Constant(number("break_away")?),
                kinetic: Kinetic::Lines(Table::read(&document["nodes"])?.lines(true)),
            },
            "DwellTime" | "ForceRate" => Self {
                backward: None,
                adhesion: Static::Surface {
                    base: number("kinetic")?,
                    drops: [[0.0, 1.0, 1.0]; 2],
                    growth: [number("limit")?, number("rate")?, or("exponent", 1.0)],
                    softening: [
                        or("force_rate_scale", f64::INFINITY),
                        or("force_rate_exponent", 1.0),
                    ],
                },
                kinetic: constant(number("kinetic")?),
            },
            "LogarithmicDwell" => Self {
                backward: None,
                adhesion: Static::Logarithm {
                    base: number("kinetic")?,
                    growth: number("growth")?,
                    onset: number("onset")?,
                },
                kinetic: constant(number("kinetic")?),
            },
            "Tabulated" => Self {
                backward: None,
                adhesion: Static::Table(Table::read(&document["break_away"])?),
                kinetic: Kinetic::Lines(Table::read(&document["kinetic"])?.lines(false)),
            },
            "PiecewisePolynomial" => {
                let degree = or("degree", 16.0);
                let degree = usize::from((2..=16_u8).find(|&whole| f64::from(whole) == degree)?);
                let nodes = Table::read(&document["nodes"])?.0;
                let firsts = (0..nodes.len() - 1).step_by(degree);
                let pieces =
                    firsts.map(|first| Some(Polynomial::through(nodes.get(first..=first + degree)?)));
                Self {
                    backward: None,
                    adhesion: Static::Constant(number("break_away")?),
                    kinetic: Kinetic::Polynomials(pieces.collect::<Option<_>>()?),
                }
            }
            "Rational" => Self {
                backward: None,
                adhesion: Static::Constant(number("break_away")?),
                kinetic: Kinetic::Hyperbola([number("break_away")?, 0.0, number("weakening")?, 0.0]),
            },
            "PoppStelter" => Self {
                backward: None,
                adhesion: Static::Constant(number("break_away")?),
                kinetic: Kinetic::Hyperbola([
                    number("break_away")?,
                    number("kinetic")?,
                    number("weakening")?,
                    or("square", 0.0),
                ]),
            },
            "Cubic" => Self {
                backward: None,
                adhesion: Static::Constant(number("static")?),
                kinetic: Kinetic::Cubic([number("static")?, number("linear")?, number("cubic")?]),
            },
            "ExponentialStribeck" => Self {
                backward: None,
                adhesion: Static::Constant(number("break_away")?),
                kinetic: Kinetic::Exponential([
                    number("break_away")?,
                    number("kinetic")?,
                    number("scale")?,
                    or("viscous", 0.0),
                    or("exponent", 1.0),
                ]),
            },
            "Lorentzian" => Self {
                backward: None,
                adhesion: Static::Constant(number("break_away")?),
                kinetic: Kinetic::Lorentz([
                    number("break_away")?,
                    number("kinetic")?,
                    number("scale")?,
                    or("viscous", 0.0),
                ]),
            },
            "TwoBranch" => {
                let branch = |name: &str, sense: f64| {
                    let mut lines = Table::read(&document[name])?.lines(false);
                    for line in &mut *lines {
                        line.sense = sense;
                    }
                    Some(lines)
                };
                Self {
                    backward: None,
                    adhesion: Static::Constant(number("break_away")?),
                    kinetic: Kinetic::Branches([branch("falling", -1.0)?, branch("rising", 1.0)?]),
                }
            }
            "BogaczRyczek" => {
                let surface = &document["static_friction"];
                let of = |name: &str, default: f64| surface[name].as_f64().unwrap_or(default);
                Self {
                    backward: None,
                    adhesion: Static::Surface {
                        base: surface["initial"].as_f64()?,
                        drops: ["", "second_"].map(|which| {
                            let of = |name: &str, default| of(&format!("{which}{name}"), default);
                            [of("drop", 0.0), of("drop_scale", 1.0), of("drop_exponent", 1.0)]
                        }),
                        growth: [of("limit", 0.0), of("rate", 1.0), of("exponent", 1.0)],
                        softening: [
                            of("force_rate_scale", f64::INFINITY),
                            of("force_rate_exponent", 1.0),
                        ],
                    },
                    kinetic: Kinetic::Paper(Box::new(crate::paper::Geometry::read(
                        document,
                        Table::read(&document["alpha"])?,
                    )?)),
                }
            }
            _ => return None,
        })
    }

    /// That of the direction of the friction on the mass.
    pub fn toward(&self, direction: f64) -> &Self {
        match &self.backward {
            Some(backward) if direction < 0.0 => backward,
            _ => self,
        }
    }

    /// Whether slip needs an integrator, having no straight pieces.
    pub fn smooth(&self) -> bool {
        !matches!(
            self.kinetic,
            Kinetic::Lines(_) | Kinetic::Branches(_) | Kinetic::Paper(_)
        )
    }

    /// The smooth force at slip speed u and its slope.
    pub fn curve(&self, u: f64) -> [f64; 2] {
        match &self.kinetic {
            Kinetic::Hyperbola([fs, fk, weakening, square]) => {
                let share = 1.0 / (1.0 + weakening * u);
                [
                    (fs - fk) * share + fk + square * u * u,
                    -(fs - fk) * weakening * share * share + 2.0 * square * u,
                ]
            }
            Kinetic::Polynomials(pieces) => {
                let last = &pieces[pieces.len() - 1];
                let top = last.ends()[1];
                if u > top {
                    let [value, slope] = last.value_and_slope(top);
                    return [value + slope * (u - top), slope];
                }
                let piece = pieces.iter().find(|piece| u < piece.ends()[1]).unwrap_or(last);
                piece.value_and_slope(u)
            }
            Kinetic::Cubic([fs, linear, cubic]) => {
                [fs + u * (cubic * u * u - linear), 3.0 * cubic * u * u - linear]
            }
            Kinetic::Exponential([fs, fk, scale, viscous, exponent]) => {
                let y = u / scale;
                let (power, slope) = if *exponent == 1.0 {
                    (y, 1.0 / scale)
                } else {
                    (y * y, 2.0 * y / scale)
                };
                let fall = (fs - fk) * (-power).exp();
                [fk + fall + viscous * u, viscous - fall * slope]
            }
            Kinetic::Lorentz([fs, fk, scale, viscous]) => {
                let y = u / scale;
                let share = 1.0 / (1.0 + y * y);
                [
                    fk + (fs - fk) * share + viscous * u,
                    viscous - (fs - fk) * share * share * 2.0 * y / scale,
                ]
            }
            Kinetic::Lines(_) | Kinetic::Branches(_) | Kinetic::Paper(_) => [f64::NAN; 2],
        }
    }

    /// Whether its curve has corners, between its pieces.
    pub fn cornered(&self) -> bool {
        matches!(self.kinetic, Kinetic::Polynomials(_))
    }

    /// Over what slip speed its curve changes.
    pub fn width(&self) -> f64 {
        match &self.kinetic {
            Kinetic::Hyperbola(p) => 1.0 / p[2],
            Kinetic::Exponential(p) => p[2],
            Kinetic::Lorentz(p) => p[2],
            _ => f64::INFINITY,
        }
    }
}

/// What a slip speed that is known to `slack` alone does to friction along `lines`.
pub fn spread(lines: &[Line], u: f64, slack: f64) -> f64 {
    let [low, here, high] =
        [(u - slack).max(0.0), u, u + slack].map(|at| piece_at(lines, at, true).force(at));
    (low - here).abs().max((high - here).abs())
}

/// The piece of `lines` that holds u; at a node the one ahead.
pub fn piece_at(lines: &[Line], u: f64, rising: bool) -> Line {
    let holds = |line: &&Line| if rising { u < line.high } else { u <= line.high };
    *lines.iter().find(holds).unwrap_or(&lines[lines.len() - 1])
}
