//! The events that end a phase: each asked whether it is one, and what follows it.

use super::{AT_ONCE, Finding, Judge, Mode};
use crate::flow::{ROUNDINGS, Rub, Sample};
use crate::law::{Kinetic, Line, piece_at, spread};
use crate::report::{Event, Mark};
use stickslip::mode::Kind;

impl Judge<'_> {
    /// Each event is one, and leads where it should.
    pub(super) fn occur(&mut self, after: &Mark, sample: &Sample, length: f64) {
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
                    Kind::Node | Kind::Spring => mode,
                    Kind::Parting => Mode::Apart(after.directions[c]),
                    Kind::Meeting => {
                        let direction = if after.directions[c] == 0.0 {
                            1.0
                        } else {
                            after.directions[c]
                        };
                        self.leave(c, direction, 0.0)
                    }
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
                    // The phase of a force is known to a rounding of its turn, and with it the time.
                    let turns = self.problem.forces.iter().map(|(_, wave)| wave.period());
                    let slack = ROUNDINGS * rest + f64::EPSILON * turns.fold(t, f64::max);
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
                    let law = self.problem.contacts[c].law.toward(direction);
                    let limit = law.adhesion.force(rest, rate.abs());
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
                    if let Kinetic::Paper(paper) = &self.problem.contacts[c].law.toward(direction).kinetic {
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
                    let lines: Vec<Line> = match &self.problem.contacts[c].law.toward(direction).kinetic {
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
                    if let Kinetic::Branches([falling, rising]) =
                        &self.problem.contacts[c].law.toward(direction).kinetic
                    {
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
                        // Where a drive changes its acceleration the reaction jumps, and it may jump over a branch.
                        let between = down.force(u) < force && force < up.force(u);
                        let off = if bends && !between { 0.0 } else { below.min(above) };
                        self.find(
                            "reaction at the end of a hold",
                            t,
                            off,
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
        let known = slack + rate.abs() * blur;
        let [over, under] = [(high - at).abs(), (at - low).abs()];
        // Where a piece is shorter than what is known of the displacement, the sense of the motion says which end it is.
        let up = if over.max(under) <= known {
            rate > 0.0
        } else {
            over < under
        };
        let end = if up { high } else { low };
        let tolerance = known + ROUNDINGS * end.abs();
        let (force, steep) = (-spring.force(piece, at), spring.steepness(piece, at));
        self.find(
            "displacement where a spring goes on to its next piece",
            t,
            (at - end).abs(),
            tolerance,
        );
        // The engine's displacement and the judge's may lie on either side of the end, each as far as the tolerance.
        // A flat piece has its force wherever it is, also where nothing is known of the displacement (0 times ∞).
        let more = 2.0 * (steep * tolerance).max(0.0) + ROUNDINGS * force.abs();
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
        let next = match &self.problem.contacts[c].law.toward(direction).kinetic {
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
}
