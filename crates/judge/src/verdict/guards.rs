//! The guards of the contacts along a phase: whether one falls below zero before the event that was reported.

use super::{Guard, Judge, Mode};
use crate::flow::{Phase, ROUNDINGS, Sample};
use crate::law::{Kinetic, Static, piece_at, spread};
use crate::number::Real;

impl Judge<'_> {
    /// What adhesion bears after a rest, and its slack.
    pub(super) fn limit(&self, c: usize, rest: f64, sample: &Sample) -> [f64; 2] {
        let [force, rate, _, rate_slack] = sample.force[c];
        let [normal, _, normal_slack, _] = sample.normal[c];
        let adhesion = &self.problem.contacts[c].law.toward(force).adhesion;
        let of_law = adhesion.force(rest, rate.abs());
        let slack = Self::limit_slack(adhesion, rest, rate, rate_slack);
        let normal = normal.max(0.0);
        [normal * of_law, normal * slack + normal_slack * of_law]
    }

    /// How fast the force moves away from the limit of adhesion.
    pub(super) fn margin_rate(&self, c: usize, rest: f64, sample: &Sample) -> f64 {
        let [force, rate, ..] = sample.force[c];
        let law = self.problem.contacts[c].law.toward(force);
        let of_law = law.adhesion.force(rest, rate.abs());
        sample.normal[c][1] * of_law - rate * force.signum()
    }

    /// By how much a force may be beyond what adhesion bears, where it is less a moment later: slip between has a speed of
    /// rounding, (excess)²/(2 m |rate|).
    pub(super) fn relief(&self, margin_rate: f64) -> f64 {
        if self.problem.n > 1 || margin_rate <= 0.0 {
            return 0.0;
        }
        (2.0 * self.problem.mass[0] * margin_rate * self.floor()[1]).sqrt()
    }

    /// The force that goes with what is not known of the slip acceleration since the last event.
    pub(super) fn entry_force(&self, c: usize) -> f64 {
        if self.problem.n == 1 {
            self.problem.mass[0] * self.entry[c]
        } else {
            0.0
        }
    }

    /// What a rate within its slack does to what adhesion bears.
    fn limit_slack(adhesion: &Static, rest: f64, rate: f64, slack: f64) -> f64 {
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
                    if let Kinetic::Branches([falling, rising]) =
                        &self.problem.contacts[c].law.toward(direction).kinetic
                    {
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

    /// No guard falls below zero between two events.
    pub(super) fn watch<R: Real>(&mut self, from: [f64; 2], phase: &Phase<R>) -> Option<()> {
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
}
