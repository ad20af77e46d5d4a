//! What is known of positions and speeds at best: roundings of the largest ones of a run.

use super::Judge;
use crate::flow::Phase;
use crate::number::Real;
use crate::problem::Contact;
use crate::report::Mark;

impl Judge<'_> {
    /// The largest speed that the forces of the document can give in the run, and how far it leads; and how far the speed of
    /// the start leads against springs and dampers.
    pub(super) fn reach(&mut self, start: &[f64]) {
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
                .map(|contact| {
                    let either = [-1.0, 1.0].map(|side| contact.law.toward(side).adhesion.force(0.0, 0.0));
                    pressed(contact) * either[0].max(either[1])
                })
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

    pub(super) fn measure(&mut self, mark: &Mark) {
        let n = self.problem.n;
        for (i, value) in mark.state.iter().enumerate() {
            let which = usize::from(i >= n);
            self.size[which] = self.size[which].max(value.abs());
        }
        for contact in &self.problem.contacts {
            self.size[1] = self.size[1].max(contact.drive.value(mark.time).abs());
        }
    }

    /// What follows a phase has the rounding of how far and fast it went on the way.
    pub(super) fn swing<R: Real>(&mut self, phase: &Phase<R>) {
        let n = self.problem.n;
        for index in 0..phase.samples() {
            for (i, value) in phase.state(index).iter().take(2 * n).enumerate() {
                let size = &mut self.size[usize::from(i >= n)];
                *size = size.max(value.value().abs());
            }
        }
    }

    /// What is known of positions and speeds at best: some roundings of the largest, and what a steep piece made of so many
    /// roundings of w before: the slip acceleration that it was left with is off by that, and with it where the mass is. On the
    /// stiffest of its springs, or what is said here of a softer one would come back larger from each event on that.
    pub(super) fn floor(&self) -> [f64; 2] {
        let mut floor = self.size.map(|size| 64.0 * f64::EPSILON * size);
        if self.problem.n == 1 {
            let off = self.entry[0] / 64.0;
            let springs = self.problem.springs.iter();
            let steepest = springs.map(|spring| {
                let pieces = 0..spring.nodes.len().max(2) - 1;
                pieces
                    .map(|piece| spring.steepness(piece, self.size[0]))
                    .fold(0.0, f64::max)
            });
            let stiffness = self.problem.stiffness[0] + steepest.sum::<f64>();
            let natural = (stiffness / self.problem.mass[0]).sqrt();
            floor[0] += off / (natural * natural);
            floor[1] += off / natural;
        }
        floor
    }
}
