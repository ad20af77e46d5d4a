//! The verdict on one run: every phase followed again, every event asked whether it is one.

mod events;
mod floor;
mod guards;
mod phase;

use serde_json::Value;

use crate::flow::{Model, ROUNDINGS, Rub, Sample};
use crate::law::{Kinetic, Line, piece_at};
use crate::number::Pair;
use crate::paper::Memory;
use crate::problem::Problem;
use crate::report::{Mark, Report, run};

/// Something that is not as it should be.
#[derive(Clone, Debug)]
pub struct Finding {
    /// What.
    pub what: String,
    /// When.
    pub t: f64,
    /// How far off.
    pub off: f64,
    /// What rounding and conditioning explain.
    pub tolerance: f64,
}

/// What was judged, and how.
#[derive(Clone, Debug, Default)]
pub struct Verdict {
    /// Events judged.
    pub events: u64,
    /// Phases judged.
    pub phases: u64,
    /// What is wrong.
    pub findings: Vec<Finding>,
    /// Guards that come within rounding of zero and go back: an event and none are both right.
    pub grazes: u64,
    /// Decisions at zero slip velocity with the force within rounding of what adhesion bears.
    pub edges: u64,
    /// Phases over which rounding grows beyond a millionth of the motion.
    pub sensitive: u64,
    /// Phases that would be too much work, or whose reactions are not determined.
    pub left: u64,
    /// The largest share of its tolerance that anything is off, where steps are judged.
    pub worst: f64,
    /// How often the engine's search for a root fell back to going on.
    pub fallbacks: u64,
    /// Why the run ended.
    pub stop: String,
    /// The engine's sentence, where it refused the document.
    pub refused: Option<String>,
}

/// A run that the engine calls diverged is not judged beyond so many times the size of its start and forces: every rounding
/// has grown as much.
const DIVERGED: f64 = 1e30;

/// So many events of one contact at one time are no motion.
const AT_ONCE: f64 = 20.0;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Mode {
    Stick([f64; 2]),
    Line(f64, Line),
    Curve(f64),
    Hold(f64, f64),
    /// The bodies are apart; the sign that was reported.
    Apart(f64),
}

impl Mode {
    fn rub(self) -> Rub {
        match self {
            Self::Stick(_) | Self::Hold(..) => Rub::Held,
            Self::Line(direction, line) => Rub::Line(direction, line),
            Self::Curve(direction) => Rub::Curve(direction),
            Self::Apart(_) => Rub::Apart,
        }
    }

    fn direction(self) -> f64 {
        match self {
            Self::Stick(_) => 0.0,
            Self::Line(direction, _)
            | Self::Curve(direction)
            | Self::Hold(direction, _)
            | Self::Apart(direction) => direction,
        }
    }
}

/// Judge a case: none where the judge does not understand its document.
#[must_use]
pub fn judge(case: &Value) -> Option<Verdict> {
    let problem = Problem::read(case)?;
    let report = match run(case, &problem) {
        Ok(report) => report,
        Err(sentence) => {
            return Some(Verdict {
                refused: Some(sentence),
                ..Verdict::default()
            });
        }
    };
    Some(judge_report(&problem, &report))
}

/// Judge what was reported of a problem.
#[must_use]
pub fn judge_report(problem: &Problem, report: &Report) -> Verdict {
    Verdict {
        fallbacks: report.fallbacks,
        ..Judge::new(problem, report).follow()
    }
}

#[derive(Clone)]
struct Judge<'a> {
    /// Whether it is asked how rounding grows over a phase.
    thorough: bool,
    problem: &'a Problem,
    report: &'a Report,
    modes: Vec<Mode>,
    /// The pieces that springs are on.
    pieces: Vec<usize>,
    memories: Vec<Memory>,
    verdict: Verdict,
    /// The largest position and speed so far.
    size: [f64; 2],
    /// What rounding of w did to its rate at the last event: along a steep piece that shifts the event in time.
    entry: Vec<f64>,
    /// Events in a row between which hardly any time passed.
    at_once: f64,
}

/// The value of a guard, which must not fall below zero, and what rounding may do to it.
#[derive(Clone, Debug)]
struct Guard {
    name: &'static str,
    contact: usize,
    value: f64,
    slack: f64,
}

impl<'a> Judge<'a> {
    fn new(problem: &'a Problem, report: &'a Report) -> Self {
        Self {
            thorough: false,
            problem,
            report,
            modes: Vec::new(),
            pieces: Vec::new(),
            memories: vec![Memory::default(); problem.contacts.len()],
            verdict: Verdict {
                stop: report.stop.to_owned(),
                ..Verdict::default()
            },
            size: [0.0; 2],
            at_once: 0.0,
            entry: vec![0.0; problem.contacts.len()],
        }
    }

    fn find(&mut self, what: impl Into<String>, t: f64, off: f64, tolerance: f64) {
        if !(off <= tolerance) {
            self.verdict.findings.push(Finding {
                what: what.into(),
                t,
                off,
                tolerance,
            });
        }
    }

    fn follow(mut self) -> Verdict {
        let marks = &self.report.marks;
        let Some(first) = marks.first() else {
            self.find("no start", 0.0, f64::NAN, 0.0);
            return self.verdict;
        };
        let given = self.problem.v0.clone();
        let v0 = given.unwrap_or_else(|| self.problem.driven());
        let start = [self.problem.x0.clone(), v0].concat();
        for (index, (got, wanted)) in first.state.iter().zip(&start).enumerate() {
            let tolerance = if index < self.problem.n || self.problem.v0.is_some() {
                0.0
            } else {
                ROUNDINGS
                    * start[self.problem.n..]
                        .iter()
                        .fold(0.0, |most: f64, v| most.max(v.abs()))
            };
            self.find(
                "start is not the start given",
                0.0,
                (got - wanted).abs(),
                tolerance,
            );
        }
        self.reach(&start);
        self.measure(first);
        let least = self.size;
        self.begin(first);
        for index in 0..marks.len() {
            let after = marks.get(index + 1);
            if after.is_none() && self.report.stop != "t_end" {
                break;
            }
            if !self.verdict.findings.is_empty() {
                break;
            }
            if marks[index].state.iter().any(|value| !value.is_finite()) {
                if self.report.stop != "diverged" {
                    self.find("not a number", marks[index].time[0], f64::NAN, 0.0);
                }
                break;
            }
            self.measure(&marks[(index + 1).min(marks.len() - 1)]);
            let grown = (0..2).any(|which| self.size[which] > DIVERGED * least[which]);
            if grown && self.report.stop == "diverged" {
                self.verdict.left += 1;
                break;
            }
            let mark = &marks[index];
            let followed = self.escalate(
                |judge| judge.phase::<f64>(mark, after),
                |judge| judge.phase::<Pair>(mark, after),
            );
            if followed.is_none() {
                self.verdict.left += 1;
                // What was left does not say how it ended: the state that was reported does.
                if let Some(after) = after {
                    self.take_over(mark, after);
                }
                continue;
            }
            self.verdict.phases += 1;
            if let Some(after) = after {
                self.verdict.events += after.events.len() as u64;
            }
        }
        self.verdict
    }

    /// In doubles without asking how rounding grows; what fails there anew with that asked; what still fails in pairs of doubles.
    fn escalate<T>(&mut self, plain: impl Fn(&mut Self) -> T, pairs: impl Fn(&mut Self) -> T) -> T {
        let before = self.clone();
        for thorough in [false, true] {
            self.thorough = thorough;
            let result = plain(self);
            if self.verdict.findings.is_empty() {
                return result;
            }
            self.clone_from(&before);
        }
        self.thorough = true;
        pairs(self)
    }

    /// Reaction, its rate, and their slack if contact c were held at this state. In pairs of doubles, as a law may remember it:
    /// under heavy damping the rate is a small difference of large terms.
    fn held(&self, c: usize, mark: &Mark) -> Option<Sample> {
        let mut rubs = self.rubs();
        rubs[c] = Rub::Held;
        let doing = (&rubs[..], &self.pieces[..]);
        let model = Model::<Pair>::new(self.problem, doing, mark.time, &mark.state, self.floor())?;
        Some(model.at_start())
    }

    fn rubs(&self) -> Vec<Rub> {
        self.modes.iter().map(|mode| mode.rub()).collect()
    }

    /// What adhesion would bear were contact c, of one mass, to stick this moment: the force rate is that of ẋ = s.
    fn top(&self, c: usize, mark: &Mark) -> f64 {
        let mut stuck = mark.clone();
        stuck.state[1] = self.problem.contacts[c].drive.value(mark.time);
        let rate = self.held(c, &stuck).map_or(f64::NAN, |held| held.force[c][1]);
        let law = self.problem.contacts[c].law.toward(self.modes[c].direction());
        law.adhesion.force(0.0, rate.abs())
    }

    /// w of contact c, as reported.
    fn slip_velocity(&self, c: usize, mark: &Mark) -> f64 {
        let contact = &self.problem.contacts[c];
        let v = |mass: usize| mark.state[self.problem.n + mass];
        contact.drive.value(mark.time) - v(contact.mass) + contact.other.map_or(0.0, v)
    }

    /// Slip from zero speed in a direction, adhesion having broken at a force.
    fn leave(&mut self, c: usize, direction: f64, force: f64) -> Mode {
        match &self.problem.contacts[c].law.toward(direction).kinetic {
            Kinetic::Lines(lines) => Mode::Line(direction, lines[0]),
            Kinetic::Branches(branches) => Mode::Line(direction, branches[1][0]),
            Kinetic::Paper(paper) => Mode::Line(direction, paper.leave(force, &mut self.memories[c])),
            _ => Mode::Curve(direction),
        }
    }

    /// Modes at the start.
    fn begin(&mut self, mark: &Mark) {
        let springs = self.problem.springs.iter();
        self.pieces = springs
            .map(|spring| {
                let at = spring.displacement(&mark.state);
                let mut pieces = 0..spring.nodes.len().saturating_sub(1);
                // At a node either piece will do: the next event says which.
                pieces.rfind(|&piece| at >= spring.ends(piece)[0]).unwrap_or(0)
            })
            .collect();
        // Each is asked of the others: first as reported, then one by one.
        for (c, &reported) in mark.directions.iter().enumerate() {
            let mode = if mark.apart[c] {
                Mode::Apart(reported)
            } else if reported == 0.0 {
                Mode::Stick(mark.time)
            } else {
                let law = self.problem.contacts[c].law.toward(reported);
                let limit = law.adhesion.force(0.0, 0.0);
                self.leave(c, reported, limit)
            };
            self.modes.push(mode);
        }
        for (c, &reported) in mark.directions.iter().enumerate() {
            self.enter(c, reported, mark, true);
        }
    }

    /// The mode a contact begins in, at any slip speed.
    fn enter(&mut self, c: usize, reported: f64, mark: &Mark, starting: bool) {
        let contact = &self.problem.contacts[c];
        let one = self.problem.n == 1;
        let Some(held) = self.held(c, mark) else {
            return;
        };
        let [w, _, w_slack, _] = held.w[c];
        let [force, _, slack, _] = held.force[c];
        let [normal, _, normal_slack, _] = held.normal[c];
        if contact.normal.is_some() && starting {
            let touch = normal.abs() <= normal_slack;
            self.verdict.edges += u64::from(touch);
            let apart = if touch { mark.apart[c] } else { normal < 0.0 };
            let off = f64::from(u8::from(apart != mark.apart[c]));
            self.find("bodies apart at the start, or not", mark.time[0], off, 0.0);
            if apart {
                return;
            }
        }
        let [limit, limit_slack] = self.limit(c, 0.0, &held);
        let stuck = if w.is_subnormal() {
            // Below the normal numbers there is no sign to insist on.
            reported == 0.0
        } else if one && starting {
            // Where rounding alone keeps the start off the drive, both slip and rest are right.
            let near = w != 0.0 && reported != w.signum() && w.abs() <= w_slack;
            self.verdict.edges += u64::from(near);
            w == 0.0 || near
        } else {
            w.abs() <= w_slack
        };
        if stuck && one && !w.is_subnormal() {
            let margin = limit - force.abs();
            let relieved = self.relief(self.margin_rate(c, 0.0, &held));
            if margin.abs() <= slack + limit_slack || margin < 0.0 && -margin <= relieved {
                self.verdict.edges += 1;
            } else {
                let wanted = if margin > 0.0 { 0.0 } else { force.signum() };
                self.find(
                    if wanted == 0.0 {
                        "slips where adhesion bears the force"
                    } else {
                        "sticks, or slips the wrong way, where adhesion cannot bear the force"
                    },
                    mark.time[0],
                    (reported - wanted).abs(),
                    0.0,
                );
            }
        }
        if stuck {
            self.modes[c] = if reported == 0.0 {
                Mode::Stick(mark.time)
            } else {
                self.leave(c, reported, limit)
            };
            return;
        }
        let direction = if w.is_subnormal() { reported } else { w.signum() };
        self.find(
            "direction at the start",
            mark.time[0],
            (direction - reported).abs(),
            0.0,
        );
        let (u, balance) = (w.abs(), direction * force);
        self.modes[c] = match &contact.law.toward(direction).kinetic {
            Kinetic::Lines(lines) => {
                let line = piece_at(lines, u, true);
                Mode::Line(direction, piece_at(lines, u, balance >= line.force(u)))
            }
            Kinetic::Paper(paper) => {
                let top = self.top(c, mark);
                Mode::Line(direction, paper.begin(u, balance, top, &mut self.memories[c]))
            }
            Kinetic::Branches([falling, rising]) => {
                let (down, up) = (piece_at(falling, u, false), piece_at(rising, u, true));
                if down.force(u) < balance && balance < up.force(u) {
                    Mode::Hold(direction, u)
                } else if balance >= up.force(u) {
                    Mode::Line(direction, up)
                } else {
                    Mode::Line(direction, down)
                }
            }
            _ => Mode::Curve(direction),
        };
    }
}
