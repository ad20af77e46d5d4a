//! Runs under laws with an internal state: own equations, own law, own integrator; each step judged by itself.
//!
//! | module | one sentence |
//! |---|---|
//! | [`law`] | friction and the rate of its state, from the formulas |
//! | [`equations`] | the right-hand side |
//! | [`march`] | the motion, by an extrapolation method for stiff equations |
//! | [`report`] | what an engine says |

pub mod equations;
pub mod law;
pub mod march;
pub mod report;

use serde_json::Value;

use crate::problem::Problem;
use equations::Equations;
use law::StateLaw;
use march::March;
use report::{Row, StateReport};

use crate::flow::ROUNDINGS;
use crate::verdict::{Finding, Verdict};

/// An integrator estimates the error of a step, which it keeps below its tolerance: so many times that is a failure,
/// at its end and in between.
const MOST_ESTIMATES: f64 = 100.0;
/// So many times more where friction has a corner or a layer inside the step, of which no estimate knows: there a step of the
/// judge has to be halved as often as this.
const CORNER_FACTOR: f64 = 100.0;
const CORNER_HALVINGS: u32 = 5;
/// More steps of the judge than this a run are not judged.
const MOST_STEPS: u64 = 40_000;

/// Judge what the core's own integrator makes of a case; none where the judge does not understand its document.
#[must_use]
pub fn judge(case: &Value) -> Option<Verdict> {
    let problem = Problem::read(case)?;
    Some(match report::run(case) {
        Ok(report) => judge_report(&problem, &report),
        Err(sentence) => Verdict {
            refused: Some(sentence),
            ..Verdict::default()
        },
    })
}

/// Judge a run that is told with its document: none where the judge does not understand it.
#[must_use]
pub fn judge_told(told: &Value) -> Option<Verdict> {
    let problem = Problem::read(&told["document"])?;
    Some(judge_report(&problem, &StateReport::read(told)?))
}

/// Judge what was reported of a problem.
#[must_use]
pub fn judge_report(problem: &Problem<StateLaw>, report: &StateReport) -> Verdict {
    let mut verdict = Verdict {
        stop: report.stop.clone(),
        ..Verdict::default()
    };
    if let Some(equations) = Equations::new(problem) {
        Judge {
            march: March::new(&equations, Vec::new(), MOST_STEPS),
            equations: &equations,
            problem,
            report,
            verdict: &mut verdict,
            allowed: vec![1.0; report.rows.len()],
        }
        .follow();
    } else {
        verdict.left += 1;
    }
    verdict
}

struct Judge<'a> {
    problem: &'a Problem<StateLaw>,
    report: &'a StateReport,
    equations: &'a Equations<'a>,
    march: March<'a>,
    verdict: &'a mut Verdict,
    /// How many times more the error of each step may be.
    allowed: Vec<f64>,
}

impl Judge<'_> {
    fn find(&mut self, what: impl Into<String>, t: f64, off: f64, tolerance: f64) {
        self.verdict.worst = self.verdict.worst.max(off / tolerance);
        if !(off <= tolerance) {
            self.verdict.findings.push(Finding {
                what: what.into(),
                t,
                off,
                tolerance,
            });
        }
    }

    fn follow(&mut self) {
        let rows = &self.report.rows;
        let Some(first) = rows.first() else {
            self.find("no start", 0.0, f64::NAN, 0.0);
            return;
        };
        self.start(first);
        let sizes = self.sizes(first);
        self.march = March::new(self.equations, sizes.clone(), MOST_STEPS);
        for row in rows {
            self.moment(row);
        }
        for (index, pair) in rows.windows(2).enumerate() {
            if !self.verdict.findings.is_empty() {
                return;
            }
            if self.step(pair, index, &sizes).is_none() {
                self.verdict.left += 1;
                if self.march.left == 0 {
                    return;
                }
                continue;
            }
            self.verdict.phases += 1;
        }
        if self.report.changes.is_some() && self.changes(&sizes).is_none() {
            self.verdict.left += 1;
        }
        if self.report.stop == "t_end" {
            let last = rows[rows.len() - 1].t;
            self.find(
                "end",
                last,
                (last - self.problem.t_end).abs(),
                ROUNDINGS * self.problem.t_end,
            );
        }
    }

    /// Velocities change their signs where it was reported, and nowhere else.
    fn changes(&mut self, sizes: &[f64]) -> Option<()> {
        let (report, n) = (self.report, self.problem.n);
        let fastest = report.rows.iter().flat_map(|row| row.v.iter().chain(&row.w));
        let size = fastest.fold(sizes[n], |most, v| most.max(v.abs()));
        let noise = MOST_ESTIMATES * report.tolerance * size;
        for (c, contact) in self.problem.contacts.iter().enumerate() {
            for slip in [true, false] {
                let name = if slip { "slip velocity" } else { "velocity" };
                let of = |row: &Row| if slip { row.w[c] } else { row.v[contact.mass] };
                let told = report.changes.iter().flatten();
                let told = told.filter(|change| change.slip == slip && change.contact == c);
                let told: Vec<f64> = told.map(|change| change.t).collect();
                for &t in &told {
                    self.verdict.events += 1;
                    let value = of(&self.at(t)?);
                    let before = report.rows.partition_point(|row| row.t < t);
                    let more = before.checked_sub(1).and_then(|step| self.allowed.get(step));
                    let more = more.copied().unwrap_or(1.0);
                    let rounding = 4.0 * f64::EPSILON * t * self.rate(t, c, slip)?.abs();
                    self.find(
                        format!("{name} where it changes its sign"),
                        t,
                        value.abs(),
                        more * noise + rounding,
                    );
                }
                // The last row at which the sign was known.
                let mut known: Option<&Row> = None;
                for (index, row) in report.rows.iter().enumerate() {
                    let value = of(row);
                    if let (Some(before), true) = (index.checked_sub(1).map(|i| &report.rows[i]), index > 0) {
                        self.hidden([before, row], c, slip, noise, &told)?;
                    }
                    if value.abs() <= noise {
                        continue;
                    }
                    if let Some(before) = known.replace(row) {
                        let count = told.iter().filter(|&&t| t > before.t && t <= row.t).count();
                        let differs = of(before) * value < 0.0;
                        let off = f64::from(u8::from((count % 2 == 1) != differs));
                        self.find(format!("changes of the sign of the {name}"), row.t, off, 0.5);
                    }
                }
            }
        }
        Some(())
    }

    /// No velocity changes its sign twice in a step without a word.
    fn hidden(
        &mut self,
        [before, after]: [&Row; 2],
        c: usize,
        slip: bool,
        noise: f64,
        told: &[f64],
    ) -> Option<()> {
        let mass = self.problem.contacts[c].mass;
        let of = |row: &Row| if slip { row.w[c] } else { row.v[mass] };
        let sign = of(before).signum();
        let turns = of(before).abs() > noise
            && of(after) * sign > noise
            && self.slope(before, c, slip) * sign < 0.0
            && self.slope(after, c, slip) * sign > 0.0;
        if !turns || told.iter().any(|&t| t > before.t && t <= after.t) {
            return Some(());
        }
        // Where it is least, by halving between a fall and a rise.
        let (mut low, mut high) = (before.t, after.t);
        for _ in 0..40 {
            let row = self.at(0.5 * (low + high))?;
            let value = sign * of(&row);
            if value < 0.0 {
                self.find("two changes of sign in one step", row.t, -value, noise);
            }
            if self.slope(&row, c, slip) * sign < 0.0 {
                low = row.t;
            } else {
                high = row.t;
            }
        }
        Some(())
    }

    /// d/dt of the slip velocity of a contact or of the velocity of its mass.
    fn slope(&self, row: &Row, c: usize, slip: bool) -> f64 {
        let (_, moment) = self.equations.rates([row.t, row.t], &self.variables(row), None);
        let mass = self.problem.contacts[c].mass;
        if slip { moment.slip[c] } else { moment.a[mass] }
    }

    fn rate(&mut self, t: f64, c: usize, slip: bool) -> Option<f64> {
        let row = self.at(t)?;
        Some(self.slope(&row, c, slip))
    }

    /// The motion at any time, from the row before.
    fn at(&mut self, t: f64) -> Option<Row> {
        let rows = &self.report.rows;
        let before = &rows[rows.partition_point(|row| row.t <= t).max(1) - 1];
        let y = self.variables(before);
        let y = self.march.on([before.t, t], &y)?;
        let n = self.problem.n;
        let (_, moment) = self.equations.rates([t, t], &y, None);
        Some(Row {
            t,
            x: y[..n].to_vec(),
            v: moment.v,
            a: moment.a,
            w: moment.w,
            force: moment.force,
            z: y[2 * n..].to_vec(),
        })
    }

    fn variables(&self, row: &Row) -> Vec<f64> {
        self.equations.variables(&row.x, &row.v, &row.w, &row.z)
    }

    /// The state at t = 0 is the one that was given, and that of steady slip.
    fn start(&mut self, first: &Row) {
        let problem = self.problem;
        let v0 = problem.v0.clone().unwrap_or_else(|| problem.driven());
        let drives: f64 = (problem.contacts.iter())
            .map(|contact| contact.drive.value([0.0, 0.0]).abs())
            .sum();
        let given = problem.x0.len() + problem.v0.as_ref().map_or(0, Vec::len);
        let starts = first.x.iter().chain(&first.v).zip(problem.x0.iter().chain(&v0));
        for (index, (got, wanted)) in starts.enumerate() {
            // The orbit keeps what of the start was given. The core's own integrator keeps w = s − v instead of v: each mass of a chain follows
            // by a difference, rounded once, from w, which was rounded once.
            let tolerance = if self.report.changes.is_some() && index < given {
                0.0
            } else {
                f64::EPSILON * (first.v.iter().chain(&first.w).map(|v| v.abs()).sum::<f64>() + drives)
            };
            self.find(
                "start is not the start given",
                0.0,
                (got - wanted).abs(),
                tolerance,
            );
        }
        let steady = (problem.contacts.iter().zip(&first.w)).flat_map(|(contact, &w)| contact.law.steady(w));
        for (got, wanted) in first.z.iter().zip(steady.collect::<Vec<_>>()) {
            let tolerance = ROUNDINGS * wanted.abs();
            self.find("state of steady slip", 0.0, (got - wanted).abs(), tolerance);
        }
    }

    /// What counts as small in each variable: a motion as fast as the drives, at the fastest frequency of the structure.
    fn sizes(&self, first: &Row) -> Vec<f64> {
        let problem = self.problem;
        let n = problem.n;
        let largest = |values: &[f64]| values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        let drives = problem.contacts.iter().map(|contact| {
            let drive = &contact.drive;
            let waves = drive.waves.iter().map(|wave| wave.amplitude.abs());
            let nodes = drive.nodes.iter().map(|node| node[1].abs());
            drive.velocity.abs() + waves.sum::<f64>() + nodes.fold(0.0, f64::max)
        });
        let square = (0..n).map(|i| problem.stiffness[i * (n + 1)] / problem.mass[i * (n + 1)]);
        let frequency = square.fold(0.0, f64::max).sqrt();
        let far = largest(&first.x);
        let fast = drives
            .fold(0.0, f64::max)
            .max(largest(&first.v))
            .max(largest(&first.w))
            .max(1e-3 * far * frequency);
        let fast = if fast > 0.0 { fast } else { 1.0 };
        let states = problem.contacts.iter().flat_map(|contact| contact.law.size(fast));
        let lengths = vec![(fast / frequency).max(1e-9 * far); n];
        lengths.into_iter().chain(vec![fast; n]).chain(states).collect()
    }

    /// Velocities, accelerations and forces are those of the variables.
    fn moment(&mut self, row: &Row) {
        let y = self.variables(row);
        let n = self.problem.n;
        let (_, moment) = self.equations.rates([row.t, row.t], &y, None);
        let speed: f64 = row.v.iter().chain(&row.w).map(|v| v.abs()).sum();
        // The phase of a drive is known to a rounding of its turn.
        let waves = self
            .problem
            .contacts
            .iter()
            .flat_map(|contact| &contact.drive.waves);
        let fastest: f64 = waves.map(|wave| (wave.amplitude * wave.frequency).abs()).sum();
        let known = ROUNDINGS * speed + 4.0 * f64::EPSILON * row.t * fastest;
        for (name, got, wanted) in [
            ("velocity", &row.v, &moment.v),
            ("slip velocity", &row.w, &moment.w),
        ] {
            for (got, wanted) in got.iter().zip(wanted) {
                self.find(name, row.t, (got - wanted).abs(), known);
            }
        }
        let blur: f64 = moment.blur.iter().sum();
        for (got, wanted) in row.force.iter().zip(&moment.force) {
            self.find("friction", row.t, (got - wanted).abs(), ROUNDINGS * blur);
        }
        let damped = self.problem.damping.iter().map(|d| d.abs()).sum::<f64>();
        let blur = blur + damped * speed;
        let lightest = (0..n)
            .map(|i| self.problem.mass[i * (n + 1)])
            .fold(f64::INFINITY, f64::min);
        for (got, wanted) in row.a.iter().zip(&moment.a) {
            self.find(
                "acceleration",
                row.t,
                (got - wanted).abs(),
                4.0 * ROUNDINGS * blur / lightest,
            );
        }
    }

    /// From one row to the next, by the tolerance of the integrator.
    fn step(&mut self, pair: &[Row], index: usize, sizes: &[f64]) -> Option<()> {
        let (from, to) = (self.variables(&pair[0]), self.variables(&pair[1]));
        let between = self.report.between.get(index).and_then(Option::as_ref);
        self.march.deepest = 0;
        let (mut t, mut y, mut middle) = (pair[0].t, from.clone(), None);
        if let Some(row) = between {
            y = self.march.on([t, row.t], &y)?;
            t = row.t;
            middle = Some((row, y.clone()));
        }
        y = self.march.on([t, pair[1].t], &y)?;
        let cornered = self.march.deepest >= CORNER_HALVINGS || self.corner(pair);
        let more = if cornered { CORNER_FACTOR } else { 1.0 };
        self.allowed[index] = more;
        self.compare("step", pair[1].t, [&y, &to, &from], sizes, more * MOST_ESTIMATES);
        if let Some((row, y)) = middle {
            let told = self.variables(row);
            self.compare(
                "between two steps",
                row.t,
                [&y, &told, &from],
                sizes,
                more * MOST_ESTIMATES,
            );
        }
        Some(())
    }

    /// Whether |w| or a normal force that is never below zero has its corner between two rows.
    fn corner(&self, pair: &[Row]) -> bool {
        let turned = |of: &dyn Fn(&Row, usize) -> f64, c: usize| of(&pair[0], c) * of(&pair[1], c) <= 0.0;
        (0..self.problem.contacts.len()).any(|c| {
            turned(&|row, c| row.w[c], c)
                || self.problem.contacts[c].normal.is_some() && turned(&|row, c| self.pressed(row, c), c)
        })
    }

    /// The normal force of a contact, where it varies, below zero where the bodies are apart.
    fn pressed(&self, row: &Row, c: usize) -> f64 {
        let contact = &self.problem.contacts[c];
        contact.normal.as_ref().map_or(1.0, |normal| {
            let across = |of: &[f64]| of[contact.mass] - contact.other.map_or(0.0, |other| of[other]);
            let waves = normal
                .waves
                .iter()
                .map(|wave| wave.amplitude * wave.at([row.t, 0.0])[0]);
            let moved = normal.position * across(&row.x) + normal.velocity * across(&row.v);
            normal.constant + waves.sum::<f64>() + moved
        })
    }

    fn compare(&mut self, what: &str, t: f64, [own, got, from]: [&[f64]; 3], sizes: &[f64], times: f64) {
        let n = self.problem.n;
        for i in 0..own.len() {
            let size = sizes[i] + from[i].abs().max(got[i].abs());
            let tolerance =
                times * self.report.tolerance * (own.len() as f64).sqrt() * size + ROUNDINGS * size;
            let kind = ["position", "velocity", "state"][(i / n).min(2)];
            self.find(format!("{kind} {what}"), t, (own[i] - got[i]).abs(), tolerance);
        }
    }
}
