//! M ẍ + D ẋ + K x + springs = Σ b_c N_c F_c(w_c, z_c) + forces and ż_c = g_c(w_c, z_c), with their derivatives.
//!
//! The variables are positions, velocities and states. A stiff law multiplies the rounding of s − ẋ: so velocities are slip
//! velocities for as many contacts as are independent of each other, and velocities of masses for the rest.

use super::law::StateLaw;
use crate::matrix::solve;
use crate::problem::Problem;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Velocity {
    Slip(usize),
    Mass(usize),
}

/// What is known of a moment.
#[derive(Clone, Debug)]
pub struct Moment {
    /// Velocities of masses.
    pub v: Vec<f64>,
    /// Slip velocities of contacts.
    pub w: Vec<f64>,
    /// Friction on the masses of contacts.
    pub force: Vec<f64>,
    /// Accelerations of masses.
    pub a: Vec<f64>,
    /// Slip accelerations of contacts.
    pub slip: Vec<f64>,
    /// What rounding of each term may do to forces.
    pub blur: Vec<f64>,
}

/// The equations of a problem.
#[derive(Clone, Debug)]
pub struct Equations<'a> {
    problem: &'a Problem<StateLaw>,
    inverse: Vec<f64>,
    velocities: Vec<Velocity>,
    /// Velocities of masses from s − w and the velocities that are variables.
    back: Vec<f64>,
    /// Where the states of each contact begin.
    begins: Vec<usize>,
    /// How many variables there are.
    pub width: usize,
}

/// Time, and a time on the piece of the drives' tables that counts.
pub type Time = [f64; 2];

impl<'a> Equations<'a> {
    /// Those of a problem; none where its masses have no inverse.
    pub fn new(problem: &'a Problem<StateLaw>) -> Option<Self> {
        let n = problem.n;
        let identity: Vec<f64> = (0..n * n)
            .map(|at| f64::from(u8::from(at % (n + 1) == 0)))
            .collect();
        let row = |velocity: Velocity| {
            let mut row = vec![0.0; n];
            match velocity {
                Velocity::Mass(mass) => row[mass] = 1.0,
                Velocity::Slip(c) => {
                    let contact = &problem.contacts[c];
                    row[contact.mass] += 1.0;
                    if let Some(other) = contact.other {
                        row[other] -= 1.0;
                    }
                }
            }
            row
        };
        // Rows that are left of each other by elimination: one that vanishes depends on those before.
        let (mut chosen, mut reduced): (Vec<Velocity>, Vec<(usize, Vec<f64>)>) = Default::default();
        let candidates = (0..problem.contacts.len())
            .map(Velocity::Slip)
            .chain((0..n).map(Velocity::Mass));
        for candidate in candidates {
            let mut left = row(candidate);
            for (pivot, other) in &reduced {
                let factor = left[*pivot] / other[*pivot];
                left.iter_mut().zip(other).for_each(|(a, b)| *a -= factor * b);
            }
            if let Some(pivot) = left.iter().position(|entry| entry.abs() > 0.5) {
                reduced.push((pivot, left));
                chosen.push(candidate);
            }
        }
        let rows: Vec<f64> = chosen.iter().flat_map(|&velocity| row(velocity)).collect();
        let mut begins = Vec::new();
        let mut width = 2 * n;
        for contact in &problem.contacts {
            begins.push(width);
            width += contact.law.states();
        }
        Some(Self {
            inverse: solve(&problem.mass, &identity, n, n)?,
            back: solve(&rows, &identity, n, n)?,
            velocities: chosen,
            problem,
            begins,
            width,
        })
    }

    /// The variables of what was reported.
    pub fn variables(&self, x: &[f64], v: &[f64], w: &[f64], z: &[f64]) -> Vec<f64> {
        let velocities = self.velocities.iter().map(|velocity| match *velocity {
            Velocity::Slip(c) => w[c],
            Velocity::Mass(mass) => v[mass],
        });
        x.iter()
            .copied()
            .chain(velocities)
            .chain(z.iter().copied())
            .collect()
    }

    /// s and ṡ of a contact.
    fn drive(&self, c: usize, time: Time) -> [f64; 2] {
        let drive = &self.problem.contacts[c].drive;
        let [height, slope] = drive.ramp(time[1]);
        let mut value = [drive.velocity + height + slope * (time[0] - time[1]), slope];
        for wave in &drive.waves {
            let [cos, sin] = wave.at([time[0], 0.0]);
            value[0] += wave.amplitude * cos;
            value[1] -= wave.amplitude * wave.frequency * sin;
        }
        value
    }

    /// The times between which no table of a drive has a node.
    pub fn bends(&self, from: f64, to: f64) -> Vec<f64> {
        let nodes = self
            .problem
            .contacts
            .iter()
            .flat_map(|contact| &contact.drive.nodes);
        let mut times: Vec<f64> = nodes
            .map(|node| node[0])
            .filter(|&t| t > from && t < to)
            .collect();
        times.extend([from, to]);
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }

    fn across(&self, c: usize, values: &[f64]) -> f64 {
        let contact = &self.problem.contacts[c];
        values[contact.mass] - contact.other.map_or(0.0, |other| values[other])
    }

    /// Velocities and slip velocities.
    fn speeds(&self, drives: &[[f64; 2]], y: &[f64]) -> [Vec<f64>; 2] {
        let n = self.problem.n;
        let right: Vec<f64> = (self.velocities.iter().zip(&y[n..]))
            .map(|(velocity, &q)| match *velocity {
                Velocity::Slip(c) => drives[c][0] - q,
                Velocity::Mass(_) => q,
            })
            .collect();
        let v: Vec<f64> = self
            .back
            .chunks_exact(n)
            .map(|row| row.iter().zip(&right).map(|(a, b)| a * b).sum())
            .collect();
        let mut w: Vec<f64> = (0..drives.len())
            .map(|c| drives[c][0] - self.across(c, &v))
            .collect();
        for (velocity, &q) in self.velocities.iter().zip(&y[n..]) {
            if let Velocity::Slip(c) = *velocity {
                w[c] = q;
            }
        }
        [v, w]
    }

    /// d/dt of the variables, what is known of the moment, and, if asked for, the derivatives by the variables row by row.
    pub fn rates(&self, time: Time, y: &[f64], derivatives: Option<&mut [f64]>) -> (Vec<f64>, Moment) {
        self.rates_since(time[0], time, y, derivatives)
    }

    /// The same where bodies touch that touch at these variables at a time before: a rule that asks for the rates of variables
    /// at a later time asks for a point off the motion, and which bodies touch there says nothing.
    pub fn rates_since(
        &self,
        before: f64,
        time: Time,
        y: &[f64],
        mut derivatives: Option<&mut [f64]>,
    ) -> (Vec<f64>, Moment) {
        let problem = self.problem;
        let (n, width) = (problem.n, self.width);
        let drives: Vec<[f64; 2]> = (0..problem.contacts.len()).map(|c| self.drive(c, time)).collect();
        let [v, w] = self.speeds(&drives, y);
        let earlier = if before == time[0] {
            v.clone()
        } else {
            let drives: Vec<[f64; 2]> = (0..problem.contacts.len())
                .map(|c| self.drive(c, [before, time[1]]))
                .collect();
            let [earlier, _] = self.speeds(&drives, y);
            earlier
        };
        // ∂v/∂q.
        let mut moved = self.back.clone();
        for (k, velocity) in self.velocities.iter().enumerate() {
            if let Velocity::Slip(_) = velocity {
                (0..n).for_each(|i| moved[i * n + k] = -moved[i * n + k]);
            }
        }
        let mut load = vec![0.0; n];
        let mut loads = vec![0.0; n * width];
        let mut blur = vec![0.0; n];
        for i in 0..n {
            for j in 0..n {
                let terms = [
                    problem.stiffness[i * n + j] * y[j],
                    problem.damping[i * n + j] * v[j],
                ];
                load[i] -= terms[0] + terms[1];
                blur[i] += terms[0].abs() + terms[1].abs();
                loads[i * width + j] -= problem.stiffness[i * n + j];
                for k in 0..n {
                    loads[i * width + n + k] -= problem.damping[i * n + j] * moved[j * n + k];
                }
            }
        }
        for (mass, wave) in &problem.forces {
            load[*mass] += wave.amplitude * wave.at([time[0], 0.0])[0];
            blur[*mass] += wave.amplitude.abs();
        }
        for spring in &problem.springs {
            let at = spring.displacement(y);
            let pieces = 0..spring.nodes.len().saturating_sub(1);
            let piece = pieces
                .clone()
                .rfind(|&piece| at >= spring.ends(piece)[0])
                .unwrap_or(0);
            let (force, steep) = (spring.force(piece, at), spring.slope(piece, at));
            for (end, sign) in [(Some(spring.mass), 1.0), (spring.other, -1.0)] {
                let Some(mass) = end else { continue };
                load[mass] -= sign * force;
                blur[mass] += force.abs() + steep.abs() * at.abs();
                loads[mass * width + spring.mass] -= sign * steep;
                if let Some(other) = spring.other {
                    loads[mass * width + other] += sign * steep;
                }
            }
        }
        let mut rates = vec![0.0; width];
        let mut force = Vec::new();
        for (c, contact) in problem.contacts.iter().enumerate() {
            let begin = self.begins[c];
            let states = contact.law.states();
            let [friction, first, second] = contact.law.rates(w[c], &y[begin..begin + states]);
            let (mut normal, mut by, mut sizes) = (1.0, [0.0; 2], 0.0);
            if let Some(varies) = &contact.normal {
                let pressed = |t: f64, v: &[f64]| {
                    let waves = (varies.waves.iter()).map(|wave| wave.amplitude * wave.at([t, 0.0])[0]);
                    let moved = varies.position * self.across(c, y) + varies.velocity * self.across(c, v);
                    varies.constant + waves.sum::<f64>() + moved
                };
                // Near zero a normal force has the rounding of its terms, and a velocity that of s and w.
                let swing: f64 = varies.waves.iter().map(|wave| wave.amplitude.abs()).sum();
                let ends = || [Some(contact.mass), contact.other].into_iter().flatten();
                let far: f64 = ends().map(|i| y[i].abs()).sum();
                let fast: f64 = ends().map(|i| v[i].abs()).sum::<f64>() + w[c].abs() + drives[c][0].abs();
                sizes = varies.constant.abs()
                    + swing
                    + varies.position.abs() * far
                    + varies.velocity.abs() * fast;
                normal = 0.0;
                if pressed(before, &earlier) > 0.0 {
                    normal = pressed(time[0], &v);
                    by = [varies.position, varies.velocity];
                }
            }
            let slip = |k: usize| -self.across(c, &(0..n).map(|i| moved[i * n + k]).collect::<Vec<_>>());
            force.push(normal * friction.value);
            for (end, sign) in [(Some(contact.mass), 1.0), (contact.other, -1.0)] {
                let Some(mass) = end else { continue };
                load[mass] += sign * normal * friction.value;
                let terms = friction.slope[0] * w[c] + friction.slope[1] * y[begin];
                blur[mass] += normal * (friction.value.abs() + terms.abs()) + sizes * friction.value.abs();
                let row = &mut loads[mass * width..(mass + 1) * width];
                for k in 0..n {
                    row[n + k] += sign * (normal * friction.slope[0] - by[1] * friction.value) * slip(k);
                }
                row[contact.mass] += sign * by[0] * friction.value;
                if let Some(other) = contact.other {
                    row[other] -= sign * by[0] * friction.value;
                }
                for state in 0..states {
                    row[begin + state] += sign * normal * friction.slope[1 + state];
                }
            }
            for (state, rate) in [first, second].into_iter().take(states).enumerate() {
                rates[begin + state] = rate.value;
                if let Some(matrix) = &mut derivatives {
                    let row = &mut matrix[(begin + state) * width..(begin + state + 1) * width];
                    row.fill(0.0);
                    for k in 0..n {
                        row[n + k] = rate.slope[0] * slip(k);
                    }
                    row[begin] += rate.slope[1];
                    if states > 1 {
                        row[begin + 1] += rate.slope[2];
                    }
                }
            }
        }
        let over_mass = |values: &dyn Fn(usize) -> f64, i: usize| -> f64 {
            (0..n).map(|j| self.inverse[i * n + j] * values(j)).sum()
        };
        let a: Vec<f64> = (0..n).map(|i| over_mass(&|j| load[j], i)).collect();
        rates[..n].copy_from_slice(&v);
        for (k, velocity) in self.velocities.iter().enumerate() {
            rates[n + k] = match *velocity {
                Velocity::Slip(c) => drives[c][1] - self.across(c, &a),
                Velocity::Mass(mass) => a[mass],
            };
        }
        if let Some(matrix) = derivatives {
            for i in 0..n {
                let row = &mut matrix[i * width..(i + 1) * width];
                row.fill(0.0);
                row[n..2 * n].copy_from_slice(&moved[i * n..(i + 1) * n]);
            }
            for column in 0..width {
                let by: Vec<f64> = (0..n)
                    .map(|i| over_mass(&|j| loads[j * width + column], i))
                    .collect();
                for (k, velocity) in self.velocities.iter().enumerate() {
                    matrix[(n + k) * width + column] = match *velocity {
                        Velocity::Slip(c) => -self.across(c, &by),
                        Velocity::Mass(mass) => by[mass],
                    };
                }
            }
        }
        let slip = (0..drives.len())
            .map(|c| drives[c][1] - self.across(c, &a))
            .collect();
        (
            rates,
            Moment {
                v,
                w,
                force,
                a,
                slip,
                blur,
            },
        )
    }
}
