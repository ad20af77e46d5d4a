//! The document of a run, read by the judge for itself.

use serde_json::Value;

use crate::law::Law;
use crate::number::angle;

/// A cos(Ω t + φ).
#[derive(Clone, Copy, Debug)]
pub struct Wave {
    /// A.
    pub amplitude: f64,
    /// Ω.
    pub frequency: f64,
    /// φ.
    pub phase: f64,
}

impl Wave {
    fn read(value: &Value) -> Option<Self> {
        Some(Self {
            amplitude: value["amplitude"].as_f64()?,
            frequency: value["frequency"].as_f64()?,
            phase: value["phase"].as_f64().unwrap_or(0.0),
        })
    }

    /// 2π/Ω; of a force that does not vary 0.
    pub fn period(&self) -> f64 {
        if self.frequency == 0.0 {
            0.0
        } else {
            std::f64::consts::TAU / self.frequency.abs()
        }
    }

    /// cos and sin of Ω t + φ.
    pub fn at(&self, time: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = angle(self.frequency, time, self.phase).sin_cos();
        [cos, sin]
    }
}

/// s(t): a constant, waves, and a table with straight pieces.
#[derive(Clone, Debug, Default)]
pub struct Drive {
    /// The constant.
    pub velocity: f64,
    /// The waves.
    pub waves: Vec<Wave>,
    /// The table.
    pub nodes: Vec<[f64; 2]>,
}

impl Drive {
    fn read(value: &Value) -> Option<Self> {
        if value.is_null() {
            return Some(Self::default());
        }
        if let Some(velocity) = value.as_f64() {
            return Some(Self {
                velocity,
                ..Self::default()
            });
        }
        let list = |name: &str| value[name].as_array().cloned().unwrap_or_default();
        Some(Self {
            velocity: value["velocity"].as_f64().unwrap_or(0.0),
            waves: list("harmonics").iter().map(Wave::read).collect::<Option<_>>()?,
            nodes: list("nodes")
                .iter()
                .map(|node| Some([node[0].as_f64()?, node[1].as_f64()?]))
                .collect::<Option<_>>()?,
        })
    }

    /// The table as value and slope from `t` on.
    pub fn ramp(&self, t: f64) -> [f64; 2] {
        let nodes = &self.nodes;
        let (Some(first), Some(last)) = (nodes.first(), nodes.last()) else {
            return [0.0; 2];
        };
        if t < first[0] {
            return [first[1], 0.0];
        }
        for pair in nodes.windows(2) {
            let ([a, p], [b, q]) = (pair[0], pair[1]);
            if t < b {
                let slope = (q - p) / (b - a);
                return [p + slope * (t - a), slope];
            }
        }
        [last[1], 0.0]
    }

    /// s(t).
    pub fn value(&self, time: [f64; 2]) -> f64 {
        let waves: f64 = self
            .waves
            .iter()
            .map(|wave| wave.amplitude * wave.at(time)[0])
            .sum();
        self.velocity + waves + self.ramp(time[0])[0]
    }
}

/// n(t, x, ẋ) = constant + Σ A cos(Ω t + φ) + position · x + velocity · ẋ, which friction is multiplied with where it is positive;
/// x and ẋ are those across the contact.
#[derive(Clone, Debug)]
pub struct Normal {
    /// The constant.
    pub constant: f64,
    /// What varies with time.
    pub waves: Vec<Wave>,
    /// ∂n/∂x.
    pub position: f64,
    /// ∂n/∂ẋ.
    pub velocity: f64,
}

impl Normal {
    fn read(value: &Value) -> Option<Self> {
        let or = |name: &str, default: f64| value[name].as_f64().unwrap_or(default);
        let waves = value["harmonics"].as_array().into_iter().flatten();
        Some(Self {
            constant: or("constant", 1.0),
            waves: waves.map(Wave::read).collect::<Option<_>>()?,
            position: or("position", 0.0),
            velocity: or("velocity", 0.0),
        })
    }
}

/// A spring whose force r(ξ) is straight between nodes and goes on beyond them, plus cubic · ξ³.
#[derive(Clone, Debug)]
pub struct Spring {
    /// The mass it pulls back.
    pub mass: usize,
    /// The mass it pulls the other way.
    pub other: Option<usize>,
    /// (ξ, r).
    pub nodes: Vec<[f64; 2]>,
    /// The factor of ξ³.
    pub cubic: f64,
}

impl Spring {
    fn read(value: &Value) -> Option<Self> {
        let nodes = value["nodes"].as_array().into_iter().flatten();
        Some(Self {
            mass: index(&value["mass"]).unwrap_or(0),
            other: index(&value["other"]),
            nodes: nodes
                .map(|node| Some([node[0].as_f64()?, node[1].as_f64()?]))
                .collect::<Option<_>>()?,
            cubic: value["cubic"].as_f64().unwrap_or(0.0),
        })
    }

    /// A point of a piece and its slope; none: the spring has no pieces.
    pub fn piece(&self, piece: usize) -> Option<([f64; 2], f64)> {
        let (from, to) = (self.nodes.get(piece)?, self.nodes.get(piece + 1)?);
        Some((*from, (to[1] - from[1]) / (to[0] - from[0])))
    }

    /// The displacements between which a piece lies.
    pub fn ends(&self, piece: usize) -> [f64; 2] {
        let inner = |at: usize| (at > 0 && at + 1 < self.nodes.len()).then(|| self.nodes[at][0]);
        [
            inner(piece).unwrap_or(f64::NEG_INFINITY),
            inner(piece + 1).unwrap_or(f64::INFINITY),
        ]
    }

    /// r(ξ) on a piece.
    pub fn force(&self, piece: usize, displacement: f64) -> f64 {
        let line = self
            .piece(piece)
            .map_or(0.0, |(from, slope)| from[1] + slope * (displacement - from[0]));
        line + self.cubic * displacement * displacement * displacement
    }

    /// dr/dξ on a piece.
    pub fn slope(&self, piece: usize, displacement: f64) -> f64 {
        let line = self.piece(piece).map_or(0.0, |(_, slope)| slope);
        line + 3.0 * self.cubic * displacement * displacement
    }

    /// |dr/dξ| on a piece.
    pub fn steepness(&self, piece: usize, displacement: f64) -> f64 {
        self.slope(piece, displacement).abs()
    }

    /// ξ.
    pub fn displacement(&self, x: &[f64]) -> f64 {
        x[self.mass] - self.other.map_or(0.0, |other| x[other])
    }
}

fn index(value: &Value) -> Option<usize> {
    usize::try_from(value.as_u64()?).ok()
}

/// What is read from a document.
pub trait Document: Sized {
    /// It; none where the judge does not know it.
    fn read(document: &Value) -> Option<Self>;
}

/// A contact.
#[derive(Clone, Debug)]
pub struct Contact<L = Law> {
    /// The mass friction acts on.
    pub mass: usize,
    /// The mass it acts on the other way.
    pub other: Option<usize>,
    /// s(t).
    pub drive: Drive,
    /// F and f_s.
    pub law: L,
    /// What both are multiplied with, if it varies.
    pub normal: Option<Normal>,
}

impl<L: Document> Contact<L> {
    fn read(value: &Value) -> Option<Self> {
        let normal = &value["normal_force"];
        Some(Self {
            mass: index(&value["mass"]).unwrap_or(0),
            other: index(&value["other"]),
            drive: Drive::read(&value["drive_velocity"])?,
            law: L::read(&value["law"])?,
            normal: if normal.is_null() {
                None
            } else {
                Some(Normal::read(normal)?)
            },
        })
    }
}

/// M ẍ + D ẋ + K x + springs = Σ b_c F_c + forces, and a start.
#[derive(Clone, Debug)]
pub struct Problem<L = Law> {
    /// Masses.
    pub n: usize,
    /// M, K, D row by row.
    pub mass: Vec<f64>,
    /// K.
    pub stiffness: Vec<f64>,
    /// D.
    pub damping: Vec<f64>,
    /// Contacts.
    pub contacts: Vec<Contact<L>>,
    /// Springs that bend.
    pub springs: Vec<Spring>,
    /// Forces on masses.
    pub forces: Vec<(usize, Wave)>,
    /// x(0).
    pub x0: Vec<f64>,
    /// ẋ(0); none: the drive's.
    pub v0: Option<Vec<f64>>,
    /// How long.
    pub t_end: f64,
}

impl<L: Document> Problem<L> {
    /// The velocities at the start where none are given: each mass moves with the drive that it touches, itself or through
    /// others.
    pub fn driven(&self) -> Vec<f64> {
        let mut v = vec![None; self.n];
        for _ in 0..self.n {
            for contact in &self.contacts {
                let s = contact.drive.value([0.0; 2]);
                let known = |v: &[Option<f64>], mass: Option<usize>| mass.map_or(Some(0.0), |mass| v[mass]);
                if v[contact.mass].is_none() {
                    v[contact.mass] = known(&v, contact.other).map(|v| v + s);
                }
                if let Some(other) = contact.other
                    && v[other].is_none()
                {
                    v[other] = v[contact.mass].map(|v| v - s);
                }
            }
        }
        v.into_iter().map(|v| v.unwrap_or(0.0)).collect()
    }

    /// From {"sys": oscillator or system, "x0", "v0", "t_end"}; none where the judge does not understand it.
    pub fn read(case: &Value) -> Option<Self> {
        let document = &case["sys"];
        let rows = |name: &str| -> Option<Vec<Vec<f64>>> {
            let value = &document[name];
            if let Some(number) = value.as_f64() {
                return Some(vec![vec![number]]);
            }
            let row = |row: &Value| row.as_array()?.iter().map(Value::as_f64).collect();
            value.as_array()?.iter().map(row).collect()
        };
        let mass = rows("mass")?;
        let n = mass.len();
        // An oscillator is its own contact: its mass is a number, no index.
        let contacts = match document["contacts"].as_array() {
            Some(contacts) => contacts.iter().map(Contact::read).collect::<Option<Vec<_>>>()?,
            None => vec![Contact {
                mass: 0,
                ..Contact::read(document)?
            }],
        };
        let springs = document["springs"].as_array().into_iter().flatten();
        let forcing = match &document["forcing"] {
            Value::Null => Vec::new(),
            Value::Array(waves) => waves.clone(),
            one => vec![one.clone()],
        };
        let force = |force: &Value| {
            let mass = force["mass"].as_u64().unwrap_or(0);
            Some((usize::try_from(mass).ok()?, Wave::read(force)?))
        };
        let list = |value: &Value| -> Option<Vec<f64>> {
            match value {
                Value::Null => None,
                Value::Array(values) => values.iter().map(Value::as_f64).collect(),
                one => Some(vec![one.as_f64()?; 1]),
            }
        };
        Some(Self {
            n,
            mass: mass.concat(),
            stiffness: rows("stiffness")?.concat(),
            damping: rows("damping")?.concat(),
            contacts,
            springs: springs.map(Spring::read).collect::<Option<_>>()?,
            forces: forcing.iter().map(force).collect::<Option<_>>()?,
            x0: list(&case["x0"]).unwrap_or_else(|| vec![0.0; n]),
            v0: list(&case["v0"]),
            t_end: case["t_end"].as_f64()?,
        })
    }
}
