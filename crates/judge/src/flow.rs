//! The motion between two events, from the judge's own equations.
//!
//! Positions, velocities, a one, the waves of forces and drives and the time since the start form one state y with ẏ = A y:
//! forcing, ramps and stuck contacts are all linear. Straight pieces of friction and of springs are as well, and then exp(A h)
//! leads from sample to sample, whatever is over-, near-critically or negatively damped or in resonance. A curved law, a normal
//! force that varies and a cubic spring feed their forces in as inputs; then Gragg's midpoint rule, extrapolated (Bulirsch &
//! Stoer 1966), does the steps.

mod curve;
mod phase;
mod sample;

use std::cell::Cell;

use crate::law::Line;
use crate::matrix::{Row, dot, exponential, norm, solve, sparse};
use crate::number::Real;
use crate::problem::{Problem, Wave};

use curve::{Curve, Shape};
pub use phase::Phase;
pub use sample::Sample;

/// What a contact does between two events.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rub {
    /// It sticks, or holds its slip speed: the reaction keeps w from changing faster than the drive.
    Held,
    /// It slips with this sign of w along a line.
    Line(f64, Line),
    /// It slips with this sign of w along a curve.
    Curve(f64),
    /// Its bodies are apart.
    Apart,
}

/// How many roundings an engine may lose on what conditioning does not explain.
pub const ROUNDINGS: f64 = 4096.0 * f64::EPSILON;
/// The equations of one phase and its start.
#[derive(Clone, Debug)]
pub struct Model<'a, R> {
    n: usize,
    dim: usize,
    a: Vec<R>,
    /// The rows of A without their zeros, and those of w and of the friction forces.
    rows: Vec<Row<R>>,
    w: Vec<Row<R>>,
    force: Vec<Row<R>>,
    /// Those of normal forces that vary, and of the displacements of springs.
    normals: Vec<Option<Row<R>>>,
    springs: Vec<Row<R>>,
    curves: Vec<Curve<'a, R>>,
    y0: Vec<R>,
    scale: Vec<f64>,
    /// The norm of A in its units.
    pace: f64,
    /// A few roundings of the largest position and speed of the run: below them nothing is known.
    floor: [f64; 2],
    /// One, but where the effect of a little more of every curved friction is asked for.
    gain: f64,
    /// The fastest that anything oscillates or grows.
    rate: f64,
    /// Extrapolations so far.
    steps: Cell<u64>,
}

fn add<R: Real>(row: &mut [R], factor: R, other: &[R]) {
    row.iter_mut()
        .zip(other)
        .for_each(|(row, &other)| *row = *row + factor * other);
}

impl<'a, R: Real> Model<'a, R> {
    /// The equations while contacts do what `rubs` say and springs are on these pieces; none where reactions are not determined.
    #[must_use]
    pub fn new(
        problem: &'a Problem,
        (rubs, pieces): (&[Rub], &[usize]),
        time: [f64; 2],
        state: &[f64],
        floor: [f64; 2],
    ) -> Option<Self> {
        let n = problem.n;
        let (one, noise) = (2 * n, 2 * n + 1);
        let ramps: Vec<[f64; 2]> = problem
            .contacts
            .iter()
            .map(|c| c.drive.ramp(time[0] + time[1]))
            .collect();
        let mut dim = 2 * n + 2;
        let ramped = ramps.iter().any(|ramp| ramp[1] != 0.0);
        let clock = dim;
        dim += usize::from(ramped);
        let mut waves = Vec::new();
        for (_, wave) in &problem.forces {
            waves.push((dim, *wave));
            dim += 2;
        }
        let mut first_of = |of: &[Wave]| {
            let first = dim;
            for wave in of {
                waves.push((dim, *wave));
                dim += 2;
            }
            first
        };
        let contacts = problem.contacts.iter();
        let first_of_drive: Vec<usize> = contacts
            .clone()
            .map(|contact| first_of(&contact.drive.waves))
            .collect();
        let first_of_normal: Vec<usize> = contacts
            .map(|contact| first_of(contact.normal.as_ref().map_or(&[], |normal| &normal.waves)))
            .collect();
        let mut shapes = Vec::new();
        for (c, rub) in rubs.iter().enumerate() {
            let shape = match *rub {
                Rub::Curve(direction) => Shape::Law(direction, problem.contacts[c].law.toward(direction)),
                Rub::Line(direction, line) if problem.contacts[c].normal.is_some() => {
                    Shape::Line(direction, line)
                }
                _ => continue,
            };
            shapes.push((Some(c), c, shape, dim));
            dim += 1;
        }
        for (index, spring) in problem.springs.iter().enumerate() {
            if spring.cubic != 0.0 {
                shapes.push((None, index, Shape::Cubic(spring.cubic), dim));
                dim += 1;
            }
        }
        let zero = vec![R::of(0.0); dim];
        let mut a = vec![zero.clone(); dim];
        for i in 0..n {
            a[i][n + i] = R::of(1.0);
        }
        for (at, wave) in &waves {
            a[*at][at + 1] = R::of(-wave.frequency);
            a[at + 1][*at] = R::of(wave.frequency);
        }
        if ramped {
            a[clock][one] = R::of(1.0);
        }
        // s_c and w_c as rows.
        let mut drives = Vec::new();
        let mut w = Vec::new();
        for (c, contact) in problem.contacts.iter().enumerate() {
            let mut row = zero.clone();
            row[one] = R::of(contact.drive.velocity) + R::of(ramps[c][0]);
            row[noise] = R::of(contact.drive.velocity.abs() + ramps[c][0].abs());
            if ramped {
                row[clock] = R::of(ramps[c][1]);
            }
            for (index, wave) in contact.drive.waves.iter().enumerate() {
                row[first_of_drive[c] + 2 * index] = R::of(wave.amplitude);
            }
            drives.push(row.clone());
            row[n + contact.mass] = row[n + contact.mass] - R::of(1.0);
            if let Some(other) = contact.other {
                row[n + other] = row[n + other] + R::of(1.0);
            }
            w.push(row);
        }
        // n_c and ξ as rows.
        let normals: Vec<Option<Vec<R>>> = (problem.contacts.iter().enumerate())
            .map(|(c, contact)| {
                let normal = contact.normal.as_ref()?;
                let mut row = zero.clone();
                row[one] = R::of(normal.constant);
                // A wave that passes zero is known to roundings of its amplitude.
                let sizes = normal.waves.iter().map(|wave| wave.amplitude.abs());
                row[noise] = R::of(normal.constant.abs() + sizes.sum::<f64>());
                for (index, wave) in normal.waves.iter().enumerate() {
                    row[first_of_normal[c] + 2 * index] = R::of(wave.amplitude);
                }
                for (first, factor) in [(0, normal.position), (n, normal.velocity)] {
                    row[first + contact.mass] = R::of(factor);
                    if let Some(other) = contact.other {
                        row[first + other] = R::of(-factor);
                    }
                }
                Some(row)
            })
            .collect();
        let displacements = problem.springs.iter().map(|spring| {
            let mut row = zero.clone();
            row[spring.mass] = R::of(1.0);
            if let Some(other) = spring.other {
                row[other] = R::of(-1.0);
            }
            row
        });
        let displacements: Vec<Vec<R>> = displacements.collect();
        // Forces on the masses, without reactions.
        let mut pushes = vec![zero.clone(); n];
        for (i, push) in pushes.iter_mut().enumerate() {
            for j in 0..n {
                push[j] = R::of(-problem.stiffness[i * n + j]);
                push[n + j] = R::of(-problem.damping[i * n + j]);
            }
        }
        for ((mass, wave), (at, _)) in problem.forces.iter().zip(&waves) {
            pushes[*mass][*at] = pushes[*mass][*at] + R::of(wave.amplitude);
        }
        for (spring, (row, &piece)) in problem.springs.iter().zip(displacements.iter().zip(pieces)) {
            let mut pull = zero.clone();
            if let Some((from, slope)) = spring.piece(piece) {
                add(&mut pull, R::of(-slope), row);
                let run = R::of(slope) * R::of(from[0]);
                pull[one] = run - R::of(from[1]);
                pull[noise] = R::of(run.value().abs() + from[1].abs());
            }
            add(&mut pushes[spring.mass], R::of(1.0), &pull);
            if let Some(other) = spring.other {
                add(&mut pushes[other], R::of(-1.0), &pull);
                pushes[other][noise] = pushes[other][noise] + R::of(2.0) * pull[noise];
            }
        }
        let mut force = vec![zero.clone(); rubs.len()];
        for &(contact, index, _, at) in &shapes {
            if contact.is_some() {
                force[index][at] = R::of(1.0);
            } else {
                let spring = &problem.springs[index];
                pushes[spring.mass][at] = R::of(1.0);
                if let Some(other) = spring.other {
                    pushes[other][at] = R::of(-1.0);
                }
            }
        }
        for (c, rub) in rubs.iter().enumerate() {
            match *rub {
                Rub::Line(direction, line) if problem.contacts[c].normal.is_none() => {
                    add(&mut force[c], R::of(line.slope), &w[c]);
                    let run = R::of(line.slope) * R::of(line.point[0]);
                    force[c][one] = force[c][one] + R::of(direction) * (R::of(line.point[1]) - run);
                    force[c][noise] = R::of(line.slope.abs()) * w[c][noise]
                        + R::of(line.point[1].abs() + run.value().abs());
                }
                _ => {}
            }
        }
        let across = |rows: &[Vec<R>], c: usize| {
            let contact = &problem.contacts[c];
            let mut row = rows[contact.mass].clone();
            if let Some(other) = contact.other {
                add(&mut row, R::of(-1.0), &rows[other]);
            }
            row
        };
        for (c, row) in force.iter().enumerate() {
            let contact = &problem.contacts[c];
            add(&mut pushes[contact.mass], R::of(1.0), row);
            if let Some(other) = contact.other {
                add(&mut pushes[other], R::of(-1.0), row);
                pushes[other][noise] = pushes[other][noise] + R::of(2.0) * row[noise];
            }
        }
        let masses: Vec<R> = problem.mass.iter().map(|&m| R::of(m)).collect();
        let over_mass = |rows: &[Vec<R>]| -> Option<Vec<Vec<R>>> {
            let solved = solve(&masses, &rows.concat(), n, dim)?;
            Some(solved.chunks_exact(dim).map(<[R]>::to_vec).collect())
        };
        let mut accelerations = over_mass(&pushes)?;
        let held: Vec<usize> = (0..rubs.len()).filter(|&c| rubs[c] == Rub::Held).collect();
        if !held.is_empty() {
            // Reactions λ: b·v̇ = ṡ.
            let k = held.len();
            let mut gram = vec![R::of(0.0); k * k];
            for (q, &d) in held.iter().enumerate() {
                let contact = &problem.contacts[d];
                let mut unit = vec![vec![R::of(0.0)]; n];
                unit[contact.mass][0] = R::of(1.0);
                if let Some(other) = contact.other {
                    unit[other][0] = R::of(-1.0);
                }
                let moved = solve(&masses, &unit.concat(), n, 1)?;
                for (p, &c) in held.iter().enumerate() {
                    let contact = &problem.contacts[c];
                    let other = contact.other.map_or(R::of(0.0), |other| moved[other]);
                    gram[p * k + q] = moved[contact.mass] - other;
                }
            }
            let flat = a.concat();
            let wants: Vec<Vec<R>> = held
                .iter()
                .map(|&c| {
                    let mut row = zero.clone();
                    for (i, &entry) in drives[c].iter().enumerate() {
                        if entry.value() != 0.0 {
                            add(&mut row, entry, &flat[i * dim..(i + 1) * dim]);
                        }
                    }
                    add(&mut row, R::of(-1.0), &across(&accelerations, c));
                    row
                })
                .collect();
            let reactions = solve(&gram, &wants.concat(), k, dim)?;
            for (p, &c) in held.iter().enumerate() {
                force[c] = reactions[p * dim..(p + 1) * dim].to_vec();
                let contact = &problem.contacts[c];
                add(&mut pushes[contact.mass], R::of(1.0), &force[c]);
                if let Some(other) = contact.other {
                    add(&mut pushes[other], R::of(-1.0), &force[c]);
                }
            }
            accelerations = over_mass(&pushes)?;
        }
        for (i, row) in accelerations.into_iter().enumerate() {
            a[n + i] = row;
        }
        let rows = a.iter().map(|row| sparse(row)).collect();
        let a = a.concat();
        let curves = shapes.iter().map(|&(contact, index, shape, at)| Curve {
            contact,
            at,
            along: sparse(contact.map_or_else(|| &displacements[index], |c| &w[c])),
            shape,
            load: contact.and_then(|c| normals[c].as_deref()).map(sparse),
        });
        let curves = curves.collect();
        let mut y0: Vec<R> = state.iter().map(|&value| R::of(value)).collect();
        y0.resize(dim, R::of(0.0));
        y0[one] = R::of(1.0);
        for (at, wave) in &waves {
            let [cos, sin] = wave.at(time);
            (y0[*at], y0[at + 1]) = (R::of(cos), R::of(sin));
        }
        let mut model = Self {
            n,
            dim,
            a,
            rows,
            w: w.iter().map(|row| sparse(row)).collect(),
            force: force.iter().map(|row| sparse(row)).collect(),
            normals: normals.iter().map(|row| row.as_deref().map(sparse)).collect(),
            springs: displacements.iter().map(|row| sparse(row)).collect(),
            curves,
            y0,
            scale: Vec::new(),
            pace: 0.0,
            floor,
            gain: 1.0,
            rate: 0.0,
            steps: Cell::new(0),
        };
        model.measure(
            waves
                .iter()
                .map(|(_, wave)| wave.frequency.abs())
                .fold(0.0, f64::max),
        );
        Some(model)
    }

    /// Units in which the entries of A are alike, and the fastest rate.
    fn measure(&mut self, waves: f64) {
        let (n, dim) = (self.n, self.dim);
        let block = |column: usize| {
            let rows = (n..2 * n).map(|row| {
                (0..n)
                    .map(|j| self.a[row * dim + column + j].value().abs())
                    .sum::<f64>()
            });
            rows.fold(0.0, f64::max)
        };
        let (stiff, damped) = (block(0).sqrt(), block(n));
        let power = |value: f64| {
            if value > 0.0 && value.is_finite() {
                value.log2().round().exp2()
            } else {
                1.0
            }
        };
        let unit = power(stiff.max(1e-3 * damped).max(waves));
        let pace = match stiff.max(damped).max(waves) {
            // Held on a ramp, and nothing else goes on.
            0.0 => 1.0,
            pace => pace,
        };
        self.scale = vec![1.0; dim];
        for j in 0..dim {
            if j < n {
                self.scale[j] = 1.0 / unit;
            } else if j >= 2 * n {
                let column =
                    (0..2 * n).map(|i| self.a[i * dim + j].value().abs() * if i < n { unit } else { 1.0 });
                let largest = column.fold(0.0, f64::max);
                self.scale[j] = if largest > 0.0 {
                    1.0 / power(largest / pace)
                } else {
                    1.0
                };
            }
        }
        // A wave is a pair: one unit for both.
        for j in 2 * n..dim.saturating_sub(1) {
            if self.a[j * dim + j + 1].value() < 0.0 && self.a[(j + 1) * dim + j].value() > 0.0 {
                let unit = self.scale[j].min(self.scale[j + 1]);
                (self.scale[j], self.scale[j + 1]) = (unit, unit);
            }
        }
        let mut rate = stiff;
        if n == 1 && self.curves.is_empty() {
            // x″ = −p x − q x′: what decays without oscillation shows at the start only.
            let (p, q) = (-self.a[dim].value(), -self.a[dim + 1].value());
            let square = 0.25 * q * q - p;
            rate = if square < 0.0 { p.sqrt() } else { 0.0 };
            let grows = if square < 0.0 {
                -0.5 * q
            } else {
                square.sqrt() - 0.5 * q
            };
            rate = rate.max(grows);
        } else {
            let grows = (n..2 * n).any(|i| self.a[i * dim + i].value() > 0.0);
            if grows {
                rate = rate.max(damped);
            }
        }
        if !self.curves.is_empty() {
            // No step of the extrapolated midpoint rule may be long against what decays.
            rate = rate.max(0.3 * damped);
        }
        for curve in self.curves.iter().filter(|curve| curve.contact.is_none()) {
            // The stiffness of a cubic spring as far out as its speed may lead.
            let here = dot(&curve.along, &self.y0).value().abs();
            let speeds = (0..n).map(|i| self.y0[n + i].value().abs());
            let far = here + speeds.fold(0.0, f64::max) / rate.max(f64::MIN_POSITIVE);
            let response = (n..2 * n).map(|i| self.a[i * dim + curve.at].value().abs());
            rate = rate.max((curve.shape.slope(far).abs() * response.fold(0.0, f64::max)).sqrt());
        }
        self.rate = rate.max(waves);
        self.pace = norm(&self.scaled(), dim);
    }

    fn scaled(&self) -> Vec<R> {
        let dim = self.dim;
        let entry = |index: usize| self.a[index] * R::of(self.scale[index % dim] / self.scale[index / dim]);
        (0..dim * dim).map(entry).collect()
    }

    fn propagator(&self, h: R) -> Vec<R> {
        let dim = self.dim;
        let mut matrix = exponential(&self.scaled(), dim, h);
        for (index, entry) in matrix.iter_mut().enumerate() {
            *entry = *entry * R::of(self.scale[index / dim] / self.scale[index % dim]);
        }
        matrix
    }

    fn feed(&self, y: &mut [R]) {
        for curve in &self.curves {
            y[curve.at] = curve.force(y) * R::of(self.gain);
        }
    }

    fn add_slope(&self, to: &mut [R], factor: R, y: &[R]) {
        for (to, row) in to.iter_mut().zip(&self.rows) {
            if !row.is_empty() {
                *to = *to + factor * dot(row, y);
            }
        }
    }

    fn slope(&self, y: &[R]) -> Vec<R> {
        self.rows.iter().map(|row| dot(row, y)).collect()
    }

    /// The same in doubles.
    fn plain(&self) -> Model<'a, f64> {
        let row = |row: &Row<R>| row.iter().map(|&(j, r)| (j, r.value())).collect();
        let values = |of: &[R]| of.iter().map(|value| value.value()).collect();
        Model {
            n: self.n,
            dim: self.dim,
            a: values(&self.a),
            rows: self.rows.iter().map(row).collect(),
            w: self.w.iter().map(row).collect(),
            force: self.force.iter().map(row).collect(),
            normals: self
                .normals
                .iter()
                .map(|normal| normal.as_ref().map(row))
                .collect(),
            springs: self.springs.iter().map(row).collect(),
            curves: (self.curves.iter())
                .map(|curve| Curve {
                    contact: curve.contact,
                    at: curve.at,
                    along: row(&curve.along),
                    shape: curve.shape,
                    load: curve.load.as_ref().map(row),
                })
                .collect(),
            y0: values(&self.y0),
            scale: self.scale.clone(),
            pace: self.pace,
            floor: self.floor,
            gain: self.gain,
            rate: self.rate,
            steps: Cell::new(0),
        }
    }

    fn floor_of(&self, j: usize) -> f64 {
        self.floor.get(j / self.n).copied().unwrap_or(0.0)
    }
}
