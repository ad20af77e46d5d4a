//! From one mark to the next: the motion leads there, and the orbit in between is it.

use stickslip::mode::Kind;

use super::{AT_ONCE, Judge, Mode};
use crate::flow::{Model, Phase, ROUNDINGS, Sample};
use crate::number::Real;
use crate::report::Mark;

impl Judge<'_> {
    /// Follow the motion from one mark to the next; none where it is not judged.
    pub(super) fn phase<R: Real>(&mut self, mark: &Mark, after: Option<&Mark>) -> Option<()> {
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
                let law = &self.problem.contacts[c].law;
                let sides = [-1.0, 1.0].map(|side| law.toward(side).adhesion.kinks());
                bends.extend(
                    sides
                        .iter()
                        .flatten()
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
            self.swing(&phase);
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

    pub(super) fn take_over(&mut self, mark: &Mark, after: &Mark) {
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
}
