//! The verdict on one run: every phase followed again, every event asked whether it is one.

use serde_json::Value;
use stickslip::mode::Kind;

use crate::flow::{Model, Phase, ROUNDINGS, Rub, Sample};
use crate::law::{Kinetic, Line, piece_at, spread};
use crate::number::{Pair, Real};
use crate::paper::Memory;
use crate::problem::{Contact, Problem};
use crate::report::{Event, Mark, Report, run};

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
    /// Why the run ended.
    pub stop: String,
    /// The engine's sentence, where it refused the document.
    pub refused: Option<String>,
}

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
    Judge::new(problem, report).follow()
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
        let drive = self.problem.contacts[0].drive.value([0.0; 2]);
        let v0 = self
            .problem
            .v0
            .clone()
            .unwrap_or_else(|| vec![drive; self.problem.n]);
        let start = [self.problem.x0.clone(), v0].concat();
        for (index, (got, wanted)) in first.state.iter().zip(&start).enumerate() {
            let tolerance = if index < self.problem.n || self.problem.v0.is_some() {
                0.0
            } else {
                ROUNDINGS * wanted.abs()
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

    /// The largest speed that the forces of the document can give in the run, and how far it leads; and how far the speed of
    /// the start leads against springs and dampers.
    fn reach(&mut self, start: &[f64]) {
        let problem = self.problem;
        for i in 0..problem.n {
            let at = i * (problem.n + 1);
            let (m, k, d) = (
                problem.mass[at],
                problem.stiffness[at].abs(),
                problem.damping[at].abs(),
            );
            let rubs = problem
                .contacts
                .iter()
                .filter(|contact| contact.mass == i || contact.other == Some(i));
            let pressed = |contact: &Contact| {
                contact.normal.as_ref().map_or(1.0, |normal| {
                    let waves = normal.waves.iter().map(|wave| wave.amplitude.abs());
                    normal.constant.abs() + waves.sum::<f64>()
                })
            };
            let friction: f64 = rubs
                .map(|contact| pressed(contact) * contact.law.adhesion.force(0.0, 0.0))
                .sum();
            let waves = problem
                .forces
                .iter()
                .filter(|force| force.0 == i)
                .map(|force| force.1.amplitude.abs());
            let force = friction + waves.sum::<f64>();
            let speed = (force / (k * m).sqrt())
                .min(force * problem.t_end / m)
                .min(force / d);
            self.size[1] = self.size[1].max(speed);
            self.size[0] = self.size[0].max((force / k).min(speed * problem.t_end));
            let way = start[problem.n + i].abs() * (m / k).sqrt().min(m / d).min(problem.t_end);
            self.size[0] = self.size[0].max(way);
            if problem.n > 1 {
                continue;
            }
            // Near resonance a motion is the small difference of a forced and a free one: a few roundings of those.
            for (_, wave) in &problem.forces {
                let (o, a) = (wave.frequency, 0.0625 * wave.amplitude.abs());
                let forced = a / (k - m * o * o).hypot(d * o).max(1e-3 * k);
                self.size[0] = self.size[0].max(forced);
                self.size[1] = self.size[1].max(o * forced);
            }
        }
    }

    fn measure(&mut self, mark: &Mark) {
        let n = self.problem.n;
        for (i, value) in mark.state.iter().enumerate() {
            let which = usize::from(i >= n);
            self.size[which] = self.size[which].max(value.abs());
        }
        for contact in &self.problem.contacts {
            self.size[1] = self.size[1].max(contact.drive.value(mark.time).abs());
        }
    }

    /// What is known of positions and speeds at best: some roundings of the largest, and what a steep piece made of so many
    /// roundings of w before: the slip acceleration that it was left with is off by that, and with it where the mass is.
    fn floor(&self) -> [f64; 2] {
        let mut floor = self.size.map(|size| 64.0 * f64::EPSILON * size);
        if self.problem.n == 1 {
            let off = self.entry[0] / 64.0;
            let natural = (self.problem.stiffness[0] / self.problem.mass[0]).sqrt();
            floor[0] += off / (natural * natural);
            floor[1] += off / natural;
        }
        floor
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
        self.problem.contacts[c].law.adhesion.force(0.0, rate.abs())
    }

    /// w of contact c, as reported.
    fn slip_velocity(&self, c: usize, mark: &Mark) -> f64 {
        let contact = &self.problem.contacts[c];
        let v = |mass: usize| mark.state[self.problem.n + mass];
        contact.drive.value(mark.time) - v(contact.mass) + contact.other.map_or(0.0, v)
    }

    /// Slip from zero speed in a direction, adhesion having broken at a force.
    fn leave(&mut self, c: usize, direction: f64, force: f64) -> Mode {
        match &self.problem.contacts[c].law.kinetic {
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
                let pieces = 0..spring.nodes.len().saturating_sub(1);
                // At a node either piece will do: the next event says which.
                pieces
                    .filter(|&piece| at >= spring.ends(piece)[0])
                    .last()
                    .unwrap_or(0)
            })
            .collect();
        // Each is asked of the others: first as reported, then one by one.
        for (c, &reported) in mark.directions.iter().enumerate() {
            let mode = if mark.apart[c] {
                Mode::Apart(reported)
            } else if reported == 0.0 {
                Mode::Stick(mark.time)
            } else {
                let limit = self.problem.contacts[c].law.adhesion.force(0.0, 0.0);
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
        self.modes[c] = match &contact.law.kinetic {
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

    /// What adhesion bears after a rest, and its slack.
    fn limit(&self, c: usize, rest: f64, sample: &Sample) -> [f64; 2] {
        let [_, rate, _, rate_slack] = sample.force[c];
        let [normal, _, normal_slack, _] = sample.normal[c];
        let of_law = self.problem.contacts[c].law.adhesion.force(rest, rate.abs());
        let slack = self.limit_slack(c, rest, rate, rate_slack);
        let normal = normal.max(0.0);
        [normal * of_law, normal * slack + normal_slack * of_law]
    }

    /// How fast the force moves away from the limit of adhesion.
    fn margin_rate(&self, c: usize, rest: f64, sample: &Sample) -> f64 {
        let [force, rate, ..] = sample.force[c];
        let of_law = self.problem.contacts[c].law.adhesion.force(rest, rate.abs());
        sample.normal[c][1] * of_law - rate * force.signum()
    }

    /// By how much a force may be beyond what adhesion bears, where it is less a moment later: slip between has a speed of
    /// rounding, (excess)²/(2 m |rate|).
    fn relief(&self, margin_rate: f64) -> f64 {
        if self.problem.n > 1 || margin_rate <= 0.0 {
            return 0.0;
        }
        (2.0 * self.problem.mass[0] * margin_rate * self.floor()[1]).sqrt()
    }

    /// The force that goes with what is not known of the slip acceleration since the last event.
    fn entry_force(&self, c: usize) -> f64 {
        if self.problem.n == 1 {
            self.problem.mass[0] * self.entry[c]
        } else {
            0.0
        }
    }

    /// What a rate within its slack does to what adhesion bears.
    fn limit_slack(&self, c: usize, rest: f64, rate: f64, slack: f64) -> f64 {
        let adhesion = &self.problem.contacts[c].law.adhesion;
        let at = |rate: f64| adhesion.force(rest, rate.abs());
        let moved = if adhesion.feels_rate() {
            (at(rate + slack) - at(rate))
                .abs()
                .max((at(rate - slack) - at(rate)).abs())
        } else {
            0.0
        };
        let earlier = adhesion.force(rest * (1.0 - ROUNDINGS), rate.abs());
        moved + (at(rate) - earlier).abs() + ROUNDINGS * at(rate)
    }

    /// What must stay above zero in the present modes.
    fn guards(&self, from: [f64; 2], sample: &Sample, into: &mut Vec<Guard>) {
        into.clear();
        // A time is good to an ulp of itself and of the phase.
        let blur = ROUNDINGS / 256.0 * sample.tau.abs();
        for (c, mode) in self.modes.iter().enumerate() {
            let [w, w_rate, w_slack, w_rate_slack] = sample.w[c];
            let [force, rate, slack, _] = sample.force[c];
            let mut guard = |name, value: f64, slack: f64| {
                into.push(Guard {
                    name,
                    contact: c,
                    value,
                    slack,
                });
            };
            if self.problem.contacts[c].normal.is_some() {
                let [normal, normal_rate, slack, _] = sample.normal[c];
                let slack = slack + normal_rate.abs() * blur;
                if let Mode::Apart(_) = mode {
                    guard("bodies apart that are pressed together", -normal, slack);
                } else {
                    guard("bodies together that are not pressed", normal, slack);
                }
            }
            match *mode {
                Mode::Apart(_) => {}
                Mode::Stick(since) => {
                    let rest = (from[0] - since[0]) + (from[1] - since[1]) + sample.tau;
                    let [limit, more] = self.limit(c, rest, sample);
                    let margin_rate = self.margin_rate(c, rest, sample);
                    let least = rate.abs().max(margin_rate.abs());
                    guard(
                        "adhesion beyond its limit",
                        limit - force.abs(),
                        slack + more + least * blur + self.relief(margin_rate),
                    );
                }
                Mode::Line(direction, line) => {
                    let (u, slack) = (direction * w, w_slack + w_rate.abs() * blur);
                    let low = if line.low == 0.0 {
                        "slip velocity changes its sign"
                    } else {
                        "slip below its piece"
                    };
                    guard(low, u - line.low, slack + ROUNDINGS * line.low);
                    if line.high.is_finite() {
                        guard(
                            "slip above its piece",
                            line.high - u,
                            slack + ROUNDINGS * line.high,
                        );
                    }
                    if line.sense != 0.0 {
                        // A speed of rounding has no sense; the wrong branch would soon make more of it.
                        let at_rest = if w.abs() <= w_slack { f64::INFINITY } else { 0.0 };
                        guard(
                            "slip acceleration of the other branch",
                            line.sense * direction * w_rate,
                            w_rate_slack + self.entry[c] + at_rest,
                        );
                    }
                }
                Mode::Curve(direction) => {
                    guard(
                        "slip velocity changes its sign",
                        direction * w,
                        w_slack + w_rate.abs() * blur,
                    );
                }
                Mode::Hold(direction, u) => {
                    if let Kinetic::Branches([falling, rising]) = &self.problem.contacts[c].law.kinetic {
                        let (down, up) = (piece_at(falling, u, false), piece_at(rising, u, true));
                        let more = slack + rate.abs() * blur + self.entry_force(c);
                        guard(
                            "held below its branches",
                            direction * force - down.force(u),
                            more + spread(falling, u, w_slack),
                        );
                        guard(
                            "held above its branches",
                            up.force(u) - direction * force,
                            more + spread(rising, u, w_slack),
                        );
                    }
                }
            }
        }
        self.spring_guards(sample, into);
    }

    /// The guards of springs: each stays on its piece.
    fn spring_guards(&self, sample: &Sample, into: &mut Vec<Guard>) {
        let blur = ROUNDINGS / 256.0 * sample.tau.abs();
        for (s, spring) in self.problem.springs.iter().enumerate() {
            let [at, rate, slack, _] = sample.springs[s];
            let [low, high] = spring.ends(self.pieces[s]);
            for (name, end, value) in [
                ("spring below its piece", low, at - low),
                ("spring above its piece", high, high - at),
            ] {
                if end.is_finite() {
                    into.push(Guard {
                        name,
                        contact: s,
                        value,
                        slack: slack + rate.abs() * blur + ROUNDINGS * end.abs(),
                    });
                }
            }
        }
    }

    /// Follow the motion from one mark to the next; none where it is not judged.
    fn phase<R: Real>(&mut self, mark: &Mark, after: Option<&Mark>) -> Option<()> {
        let until = after.map_or([self.report.t_last, 0.0], |after| after.time);
        let (mut time, mut state) = (mark.time, mark.state.clone());
        let mut slack = vec![0.0; state.len()];
        let order = (until[0] - time[0]) + (until[1] - time[1]);
        self.find("events out of order", until[0], -order, 0.0);
        if order < 0.0 {
            return Some(());
        }
        let still = order <= 4.0 * f64::EPSILON * until[0] && after.is_some();
        self.at_once = if still { self.at_once + 1.0 } else { 0.0 };
        self.find(
            "events without end at one time",
            until[0],
            self.at_once,
            AT_ONCE * self.modes.len() as f64,
        );
        let mut bends: Vec<f64> = self
            .problem
            .contacts
            .iter()
            .flat_map(|c| c.drive.nodes.iter().map(|node| node[0]))
            .collect();
        bends.retain(|&bend| bend > time[0] && bend < until[0]);
        for c in 0..self.modes.len() {
            if let Mode::Stick(since) = self.modes[c] {
                let kinks = self.problem.contacts[c].law.adhesion.kinks();
                bends.extend(
                    kinks
                        .iter()
                        .map(|kink| since[0] + kink)
                        .filter(|&at| at > time[0] && at < until[0]),
                );
            }
        }
        bends.sort_by(f64::total_cmp);
        bends.dedup();
        let ends = bends.into_iter().map(|bend| [bend, 0.0]).chain([until]);
        let rubs = self.rubs();
        let mut last = None;
        for end in ends {
            let length = R::of(end[0]) - R::of(time[0]) + (R::of(end[1]) - R::of(time[1]));
            let doing = (&rubs[..], &self.pieces[..]);
            let model = Model::<R>::new(self.problem, doing, time, &state, self.floor())?;
            if length.value() <= 0.0 {
                last = Some(model.at_start());
                continue;
            }
            let phase = Phase::new(model, length, 24, self.thorough)?;
            self.watch(time, &phase)?;
            let sample = phase.end();
            for (slack, more) in slack.iter_mut().zip(&phase.slack[0]) {
                *slack += more;
            }
            for share in [0.137, 0.618] {
                let tau = share * length.value();
                if let Some(inside) = phase.at(tau) {
                    self.compare_dense(time[0] + tau + time[1], &inside, &phase.slack[1]);
                }
            }
            state.clone_from(&sample.state);
            time = end;
            last = Some(sample);
        }
        let sample = last?;
        let n = self.problem.n;
        let motion: Vec<f64> = (0..2 * n)
            .map(|i| state[i].abs().max(mark.state[i].abs()))
            .collect();
        if (0..2 * n).any(|i| {
            slack[i] > 1e-6 * motion[i] && slack[i] > 1e-6 * motion.iter().copied().fold(0.0, f64::max)
        }) {
            self.verdict.sensitive += 1;
        }
        let Some(after) = after else {
            return Some(());
        };
        for i in 0..2 * n {
            let off = (after.state[i] - sample.state[i]).abs();
            let rate = if i < n { sample.state[n + i].abs() } else { 0.0 };
            let more = self.floor()[usize::from(i >= n)]
                + ROUNDINGS * (sample.state[i].abs() + rate * order / 256.0);
            let stuck = i >= n
                && self
                    .problem
                    .contacts
                    .iter()
                    .zip(&self.modes)
                    .any(|(c, _)| c.mass == i - n || c.other == Some(i - n));
            let more = more
                + if stuck {
                    sample.w.iter().map(|w| w[2]).fold(0.0, f64::max)
                } else {
                    0.0
                };
            self.find(
                format!(
                    "{} of mass {} at the end of the phase",
                    if i < n { "position" } else { "velocity" },
                    i % n
                ),
                until[0],
                off,
                slack[i] + more,
            );
        }
        self.occur(after, &sample, order);
        Some(())
    }

    /// No guard falls below zero between two events.
    fn watch<R: Real>(&mut self, from: [f64; 2], phase: &Phase<R>) -> Option<()> {
        let count = phase.samples();
        let mut rows: Vec<Vec<Guard>> = Vec::with_capacity(count);
        for index in 0..count {
            let mut row = Vec::new();
            self.guards(from, &phase.sample(index), &mut row);
            rows.push(row);
        }
        let times: Vec<f64> = (0..count).map(|index| phase.time(index)).collect();
        for g in 0..rows[0].len() {
            for index in 0..count {
                let now = &rows[index][g];
                let (name, c) = (now.name, now.contact);
                if !(now.value >= -now.slack) {
                    self.find(
                        format!("{name} (contact {c})"),
                        from[0] + times[index],
                        -now.value,
                        now.slack,
                    );
                    return Some(());
                }
                if index == 0 || index + 1 == count {
                    continue;
                }
                let (before, next) = (rows[index - 1][g].value, rows[index + 1][g].value);
                let drop = (before - now.value).max(next - now.value);
                if now.value > before || now.value > next || now.value > drop {
                    continue;
                }
                let (tau, low) = self.lowest(from, phase, g, times[index - 1], times[index + 1])?;
                self.find(
                    format!("{name} (contact {c})"),
                    from[0] + tau,
                    -low.value,
                    low.slack,
                );
                if low.value <= low.slack && index > 6 && index + 2 < count {
                    self.verdict.grazes += 1;
                }
            }
        }
        Some(())
    }

    /// The lowest value of a guard between two times, by golden section.
    fn lowest<R: Real>(
        &self,
        from: [f64; 2],
        phase: &Phase<R>,
        g: usize,
        mut low: f64,
        mut high: f64,
    ) -> Option<(f64, Guard)> {
        const SHARE: f64 = 0.381_966_011_250_105_1;
        let mut row = Vec::new();
        let mut value = |tau: f64| {
            self.guards(from, &phase.at(tau)?, &mut row);
            Some(row[g].clone())
        };
        let (mut one, mut two) = (low + SHARE * (high - low), high - SHARE * (high - low));
        let (mut first, mut second) = (value(one)?, value(two)?);
        for _ in 0..36 {
            if first.value <= second.value {
                (high, two, second) = (two, one, first);
                one = low + SHARE * (high - low);
                first = value(one)?;
            } else {
                (low, one, first) = (one, two, second);
                two = high - SHARE * (high - low);
                second = value(two)?;
            }
        }
        Some(if first.value <= second.value {
            (one, first)
        } else {
            (two, second)
        })
    }

    /// Each event is one, and leads where it should.
    fn occur(&mut self, after: &Mark, sample: &Sample, length: f64) {
        let t = after.time[0];
        let blur = ROUNDINGS / 256.0 * length;
        let one = self.problem.n == 1;
        for c in 0..self.modes.len().max(self.pieces.len()) {
            for springs in [false, true] {
                let same = |event: &&Event| event.contact == c && (event.kind == Kind::Spring) == springs;
                let here = after.events.iter().filter(same).count();
                self.find("events without end at one time", t, here as f64, AT_ONCE);
            }
        }
        let bends = self
            .problem
            .contacts
            .iter()
            .any(|c| c.drive.nodes.iter().any(|node| node[0] == t));
        for (index, event) in after.events.iter().enumerate() {
            let c = event.contact;
            if event.kind == Kind::Spring {
                self.spring(event, t, sample, blur);
                continue;
            }
            let later = |later: &Event| later.contact == c && later.kind != Kind::Spring;
            if after.events[index + 1..].iter().any(later) {
                // More happens to this contact at once: only where that leads is judged.
                let mode = self.modes[c];
                self.modes[c] = match event.kind {
                    Kind::Capture => Mode::Stick(after.time),
                    Kind::Release => self.leave(c, event.force.signum(), event.force.abs()),
                    Kind::Crossing => self.leave(c, -mode.direction(), event.force.abs()),
                    Kind::Reversal => self.turned(c, mode, after, sample),
                    Kind::Hold => {
                        Mode::Hold(mode.direction(), mode.direction() * self.slip_velocity(c, after))
                    }
                    Kind::Node => mode,
                    Kind::Parting => Mode::Apart(after.directions[c]),
                    Kind::Meeting => {
                        let direction = if after.directions[c] == 0.0 {
                            1.0
                        } else {
                            after.directions[c]
                        };
                        self.leave(c, direction, 0.0)
                    }
                    Kind::Spring => mode,
                };
                continue;
            }
            let [w, w_rate, w_slack, w_rate_slack] = sample.w[c];
            let [force, rate, slack, rate_slack] = sample.force[c];
            let mode = self.modes[c];
            let more = slack + rate.abs() * blur;
            let alone = after.events.len() == 1;
            match (event.kind, mode) {
                (Kind::Release, Mode::Stick(since)) => {
                    let rest = (after.time[0] - since[0]) + (after.time[1] - since[1]);
                    let [limit, limit_slack] = self.limit(c, rest, sample);
                    let tolerance = more + limit_slack + self.margin_rate(c, rest, sample).abs() * blur;
                    let mut pull = force;
                    if bends {
                        // Where a drive changes its acceleration the reaction and its rate jump, and it may jump over the limit.
                        let Some(held) = self.held(c, after) else {
                            continue;
                        };
                        pull = held.force[c][0];
                        let limit = limit.min(self.limit(c, rest, &held)[0]);
                        self.find("release below the limit", t, limit - pull.abs(), tolerance);
                    } else if alone {
                        self.find("release off the limit", t, (force.abs() - limit).abs(), tolerance);
                        self.find(
                            "force reported at the release",
                            t,
                            (event.force - force).abs(),
                            tolerance,
                        );
                        let slope = rate * force.signum();
                        self.find(
                            "force rate reported at the release",
                            t,
                            (event.force_rate - slope).abs(),
                            rate_slack + ROUNDINGS * rate.abs(),
                        );
                    }
                    let slack = ROUNDINGS * rest + f64::EPSILON * t;
                    self.find(
                        "stick time reported at the release",
                        t,
                        (event.stick_time - rest).abs(),
                        slack,
                    );
                    let direction = if one { pull.signum() } else { after.directions[c] };
                    // What slip begins with must not be known less well than the state it begins at.
                    let known = (alone && !bends).then(|| self.held(c, after)).flatten();
                    let rate = known.map_or(rate, |held| held.force[c][1]);
                    let limit = self.problem.contacts[c].law.adhesion.force(rest, rate.abs());
                    self.modes[c] = self.leave(c, direction, limit);
                }
                (Kind::Parting, Mode::Stick(_) | Mode::Line(..) | Mode::Curve(_))
                | (Kind::Meeting, Mode::Apart(_)) => {
                    let [normal, normal_rate, slack, _] = sample.normal[c];
                    let tolerance = slack + normal_rate.abs() * blur;
                    self.find(
                        "normal force where bodies part or meet",
                        t,
                        normal.abs(),
                        tolerance,
                    );
                    self.find(
                        "force reported where bodies part or meet",
                        t,
                        event.force.abs(),
                        0.0,
                    );
                    if event.kind == Kind::Parting {
                        self.modes[c] = Mode::Apart(after.directions[c]);
                    } else {
                        self.enter(c, after.directions[c], after, false);
                    }
                }
                (Kind::Capture | Kind::Crossing, Mode::Line(..) | Mode::Curve(_)) => {
                    self.find(
                        "slip velocity at a capture or crossing",
                        t,
                        w.abs(),
                        w_slack + w_rate.abs() * blur,
                    );
                    if alone {
                        self.find(
                            "force reported at a capture or crossing",
                            t,
                            (event.force - force).abs(),
                            more,
                        );
                    }
                    let stuck = event.kind == Kind::Capture;
                    self.find(
                        "kind and mode",
                        t,
                        f64::from(u8::from(alone && stuck != (after.directions[c] == 0.0))),
                        0.0,
                    );
                    self.enter(c, after.directions[c], after, false);
                }
                (Kind::Node, Mode::Line(direction, line)) => {
                    let u = direction * w;
                    if let Kinetic::Paper(paper) = &self.problem.contacts[c].law.kinetic {
                        // A steep line may be shorter than rounding: the sense tells which of its ends is ahead.
                        let high = if line.sense == 0.0 {
                            (line.high - u).abs() < (line.low - u).abs()
                        } else {
                            line.sense > 0.0
                        };
                        let end = if high { line.high } else { line.low };
                        let tolerance = w_slack + w_rate.abs() * blur + ROUNDINGS * end;
                        let next = paper.end(&line, high, &mut self.memories[c]);
                        self.find("slip speed at a node", t, (u - end).abs(), tolerance);
                        self.modes[c] = Mode::Line(direction, next);
                        continue;
                    }
                    let lines: Vec<Line> = match &self.problem.contacts[c].law.kinetic {
                        Kinetic::Lines(lines) => lines.clone(),
                        Kinetic::Branches(branches) => branches[usize::from(line.sense > 0.0)].clone(),
                        _ => Vec::new(),
                    };
                    // Which one, the reported speed says: over a sensitive phase the motion does not.
                    let off = |line: &Line, u: f64| (line.high - u).abs();
                    let told = direction * self.slip_velocity(c, after);
                    let nearer =
                        |&p: &usize, &q: &usize| off(&lines[p], told).total_cmp(&off(&lines[q], told));
                    let Some(at) = (0..lines.len()).min_by(nearer) else {
                        self.find("node of a law without nodes", t, 1.0, 0.0);
                        return;
                    };
                    self.find(
                        "slip speed at a node",
                        t,
                        off(&lines[at], u),
                        w_slack + w_rate.abs() * blur + ROUNDINGS * u.abs(),
                    );
                    let rises = direction * w_rate;
                    let above = if rises.abs() > w_rate_slack {
                        rises > 0.0
                    } else {
                        self.verdict.grazes += 1;
                        line == lines[at]
                    };
                    self.modes[c] =
                        Mode::Line(direction, lines[(at + usize::from(above)).min(lines.len() - 1)]);
                }
                (Kind::Reversal | Kind::Hold, Mode::Line(direction, _)) => {
                    if one && !bends {
                        self.find(
                            "slip acceleration at a turn",
                            t,
                            w_rate.abs(),
                            w_rate_slack + self.entry[c] + sample.second[c].abs() * blur,
                        );
                    }
                    self.modes[c] = if event.kind == Kind::Hold {
                        Mode::Hold(direction, direction * self.slip_velocity(c, after))
                    } else {
                        self.turned(c, mode, after, sample)
                    };
                }
                (Kind::Reversal, Mode::Hold(direction, u)) => {
                    if let Kinetic::Branches([falling, rising]) = &self.problem.contacts[c].law.kinetic {
                        // A hold that ended when it began had no phase of its own.
                        let Some(held) = self.held(c, after) else {
                            continue;
                        };
                        let force = direction * held.force[c][0];
                        let (down, up) = (piece_at(falling, u, false), piece_at(rising, u, true));
                        let (below, above) = ((force - down.force(u)).abs(), (force - up.force(u)).abs());
                        let (next, branch) = if above < below {
                            (up, rising)
                        } else {
                            (down, falling)
                        };
                        self.find(
                            "reaction at the end of a hold",
                            t,
                            below.min(above),
                            more + ROUNDINGS * force.abs() + spread(branch, u, w_slack) + self.entry_force(c),
                        );
                        self.modes[c] = Mode::Line(direction, next);
                    }
                }
                (kind, mode) => {
                    self.find(format!("{} in mode {mode:?}", kind.name()), t, f64::NAN, 0.0);
                }
            }
        }
        for (c, w) in sample.w.iter().enumerate() {
            // A turn that came early or late by that is left with the same slip acceleration.
            let turns =
                |event: &&Event| event.contact == c && matches!(event.kind, Kind::Hold | Kind::Reversal);
            let before = if after.events.iter().any(|event| turns(&event)) {
                self.entry[c]
            } else {
                0.0
            };
            self.entry[c] = before + w[3];
        }
        for (c, mode) in self.modes.iter().enumerate() {
            if mode.direction() != after.directions[c] || (mode.rub() == Rub::Apart) != after.apart[c] {
                let what = format!(
                    "direction {}, apart {} of contact {c} after the event, judged {mode:?}",
                    after.directions[c], after.apart[c],
                );
                self.verdict.findings.push(Finding {
                    what,
                    t,
                    off: 1.0,
                    tolerance: 0.0,
                });
                return;
            }
        }
    }

    /// A spring goes on to its next piece.
    fn spring(&mut self, event: &Event, t: f64, sample: &Sample, blur: f64) {
        let s = event.contact;
        let spring = &self.problem.springs[s];
        let [at, rate, slack, _] = sample.springs[s];
        let piece = self.pieces[s];
        let [low, high] = spring.ends(piece);
        let up = (high - at).abs() < (at - low).abs();
        let end = if up { high } else { low };
        let tolerance = slack + rate.abs() * blur + ROUNDINGS * end.abs();
        let (force, steep) = (-spring.force(piece, at), spring.steepness(piece, at));
        self.find(
            "displacement where a spring goes on to its next piece",
            t,
            (at - end).abs(),
            tolerance,
        );
        let more = steep * tolerance + ROUNDINGS * force.abs();
        self.find("force reported of a spring", t, (event.force - force).abs(), more);
        if end.is_finite() {
            self.pieces[s] = if up { piece + 1 } else { piece - 1 };
        }
    }

    /// The mode after a turn of the slip acceleration along a line: it begins at the state that was reported, not at one that is
    /// the same within rounding, which a steep line would make more of.
    fn turned(&self, c: usize, mode: Mode, after: &Mark, sample: &Sample) -> Mode {
        let Mode::Line(direction, line) = mode else {
            return mode;
        };
        let u = direction * self.slip_velocity(c, after);
        let next = match &self.problem.contacts[c].law.kinetic {
            Kinetic::Paper(paper) => {
                let rising = line.sense < 0.0 || line.sense == 0.0 && direction * sample.second[c] > 0.0;
                paper.turn(&line, u, rising, self.top(c, after), &self.memories[c])
            }
            Kinetic::Branches(branches) => {
                let rising = line.sense < 0.0;
                piece_at(&branches[usize::from(rising)], u, rising)
            }
            _ => line,
        };
        Mode::Line(direction, next)
    }

    fn take_over(&mut self, mark: &Mark, after: &Mark) {
        let rubs = self.rubs();
        let length = after.time[0] - mark.time[0];
        let doing = (&rubs[..], &self.pieces[..]);
        if let Some(model) = Model::<f64>::new(self.problem, doing, after.time, &after.state, self.floor()) {
            let sample = model.at_start();
            self.occur(after, &sample, length);
            return;
        }
        for event in &after.events {
            let c = event.contact;
            let direction = after.directions[c];
            match event.kind {
                Kind::Capture => self.modes[c] = Mode::Stick(after.time),
                Kind::Release | Kind::Crossing => self.modes[c] = self.leave(c, direction, event.force.abs()),
                _ => self.enter(c, direction, after, false),
            }
        }
    }

    /// The orbit between its events is the motion too.
    fn compare_dense(&mut self, t: f64, sample: &Sample, slack: &[f64]) {
        let n = self.problem.n;
        let states = (self.report.dense)(&[t]);
        for i in 0..2 * n {
            let rate = if i < n {
                sample.state[n + i]
            } else {
                sample.acceleration[i - n]
            };
            let tolerance =
                slack[i] + ROUNDINGS * sample.state[i].abs() + 4.0 * f64::EPSILON * t * rate.abs();
            self.find(
                format!(
                    "orbit.at, {} of mass {}",
                    if i < n { "position" } else { "velocity" },
                    i % n
                ),
                t,
                (states[0][i] - sample.state[i]).abs(),
                tolerance,
            );
        }
    }
}
