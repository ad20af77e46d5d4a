//! The branches of the law of Bogacz and Ryczek, from the table "Reading" of `docs/paper-law.md`.

use serde_json::Value;

use crate::law::{Line, Table};

/// The branches, by the name of a line.
const FALL: usize = 0;
const UPPER: usize = 1;
const COMMON: usize = 2;
const LOWER: usize = 3;
const CLIMB: usize = 4;
const STEEP: usize = 5;

/// Its points and angles.
#[derive(Clone, Debug)]
pub struct Geometry {
    a: Option<[f64; 2]>,
    b: [f64; 2],
    c: Option<[f64; 2]>,
    d: Option<[f64; 2]>,
    l: [f64; 2],
    alpha: Table,
    beta: f64,
    /// tan φ, tan ψ, tan η.
    slopes: [f64; 3],
    /// Whether a turn on the upper branch goes back along it.
    back: bool,
}

/// Where the branches are: anchor and corner, and the force of the break-away, where that set the anchor.
#[derive(Clone, Copy, Debug, Default)]
pub struct Memory {
    anchor: [f64; 2],
    corner: [f64; 2],
    released: Option<f64>,
}

fn slope(from: [f64; 2], to: [f64; 2]) -> f64 {
    (to[1] - from[1]) / (to[0] - from[0])
}

/// Where two lines meet.
fn meet(one: &Line, other: &Line) -> f64 {
    let at_zero = |line: &Line| line.force(0.0);
    (at_zero(other) - at_zero(one)) / (one.slope - other.slope)
}

impl Geometry {
    /// From its document.
    pub fn read(document: &Value, alpha: Table) -> Option<Self> {
        let point = |name: &str| Some([document[name][0].as_f64()?, document[name][1].as_f64()?]);
        let tangent = |name: &str| Some(document[name].as_f64()?.to_radians().tan());
        Some(Self {
            a: point("A"),
            b: point("B")?,
            c: point("C"),
            d: point("D"),
            l: point("l")?,
            alpha,
            beta: document["beta"].as_f64()?,
            slopes: [tangent("phi")?, tangent("psi")?, tangent("eta")?],
            back: document["upper_turn"] == "back",
        })
    }

    fn remember(&self, anchor: [f64; 2], memory: &mut Memory) {
        let falls = self.a.map_or(self.slopes[0], |a| slope(a, anchor));
        let w = (anchor[1] - falls * anchor[0] - self.l[1]) / (self.l[0] - falls);
        memory.anchor = anchor;
        memory.corner = if w > anchor[0] {
            [w, self.l[0] * w + self.l[1]]
        } else {
            anchor
        };
    }

    fn fall(force: f64, memory: &Memory) -> Line {
        let start = [0.0, force];
        Line::through(FALL, start, slope(start, memory.anchor), 0.0, memory.anchor[0])
    }

    fn upper(&self, memory: &Memory) -> Line {
        let falls = self.a.map_or(self.slopes[0], |a| slope(a, memory.anchor));
        Line::through(UPPER, memory.anchor, falls, 0.0, memory.corner[0])
    }

    fn common(&self, memory: &Memory) -> Line {
        let rises = self.c.map_or(self.slopes[1], |c| slope(c, memory.corner));
        Line::through(COMMON, memory.corner, rises, memory.corner[0], f64::INFINITY)
    }

    fn lower(&self, memory: &Memory) -> Line {
        Line::through(
            LOWER,
            memory.corner,
            slope(self.b, memory.corner),
            0.0,
            memory.corner[0],
        )
    }

    /// What the slip speed rises along.
    fn rising(&self, u: f64, memory: &Memory) -> Line {
        match memory.released {
            Some(force) if u < memory.anchor[0] => Self::fall(force, memory),
            _ if u < memory.corner[0] => self.upper(memory),
            _ => self.common(memory),
        }
    }

    /// The steep line through a point, from the lower branch or w = 0 up to what the slip speed rises along.
    fn steep(&self, point: [f64; 2], memory: &Memory) -> Line {
        let mut line = Line::through(STEEP, point, self.slopes[2], point[0], point[0]);
        line.low = meet(&line, &self.lower(memory)).clamp(0.0, point[0]);
        let fall = memory.released.map(|force| Self::fall(force, memory));
        for above in fall.into_iter().chain([self.upper(memory), self.common(memory)]) {
            let high = meet(&line, &above);
            line.high = high.max(point[0]);
            if high <= above.high {
                break;
            }
        }
        line
    }

    /// The first slip after adhesion broke at a force.
    pub fn leave(&self, force: f64, memory: &mut Memory) -> Line {
        self.remember([self.beta, force - self.alpha.value(force)], memory);
        memory.released = (self.beta > 0.0).then_some(force);
        self.rising(0.0, memory).toward(1.0)
    }

    /// A start in slip under a balance of the other forces, with f_s(0, δ) of that moment.
    pub fn begin(&self, u: f64, balance: f64, top: f64, memory: &mut Memory) -> Line {
        self.leave(top, memory);
        let (rising, lower) = (self.rising(u, memory), self.lower(memory));
        if u >= memory.corner[0] || balance >= rising.force(u) || self.back {
            rising.toward(balance - rising.force(u))
        } else if balance <= lower.force(u) {
            lower.toward(-1.0)
        } else {
            self.steep([u, balance], memory)
        }
    }

    /// The slip acceleration changes its sign on a line.
    pub fn turn(&self, line: &Line, u: f64, rising: bool, top: f64, memory: &Memory) -> Line {
        let here = [u, line.force(u)];
        let next = match (line.name, rising) {
            (FALL | UPPER, false) if !self.back && self.lower(memory).force(u) < here[1] => Line {
                high: u,
                ..self.steep(here, memory)
            },
            (LOWER | COMMON, true) if here[1] < top => {
                let steepest = self.slopes[2];
                let climbs = match self.d {
                    Some(d) if u < d[0] && d[1] > here[1] => slope(here, d).min(steepest),
                    _ => steepest,
                };
                Line::through(CLIMB, here, climbs, u, u + (top - here[1]) / climbs)
            }
            (LOWER, true) => Line {
                low: u,
                ..self.steep(here, memory)
            },
            _ => *line,
        };
        next.toward(if rising { 1.0 } else { -1.0 })
    }

    /// The slip speed reaches an end of a line.
    pub fn end(&self, line: &Line, high: bool, memory: &mut Memory) -> Line {
        if !high {
            let common = line.name == CLIMB && line.low > memory.corner[0];
            let next = if common {
                self.common(memory)
            } else {
                self.lower(memory)
            };
            return next.toward(-1.0);
        }
        if line.name == CLIMB {
            self.remember([line.high, line.force(line.high)], memory);
            memory.released = None;
        }
        self.rising(line.high, memory).toward(1.0)
    }
}
