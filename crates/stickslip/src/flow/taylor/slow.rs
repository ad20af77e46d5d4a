//! Slow motion under heavy damping, where a Taylor series of the whole motion would need steps as short as 1/δ.
//!
//! With z an eigenvector of the damping over the masses, at the rate δ, q = zᵀ M v obeys q′ = γ − δ q, γ what all other forces
//! give. After some 40/δ only its slow part q = (γ − q′)/δ is left. Its coefficients are q_k = (γ_k − (k + 1) q_{k+1})/δ, with
//! q_{k+1} from the pass before: each pass takes away all but the share ω/δ of the error (Hairer & Wanner, Solving Ordinary
//! Differential Equations II, 1996, section VI.2). All other velocities follow as ever.

use super::tangent::{Along, BLOCK, Block, Linear, Tangent};
use super::{Motion, VectorField};
use crate::matrix::Matrix;
use crate::series::INVERSE;
use crate::system::System;

/// Damping is heavy where it takes a velocity away so many times faster than the masses swing.
const HEAVY_DAMPING: f64 = 1e3;
/// So many passes are exact to rounding, as HEAVY_DAMPING to this power is beyond 1/ε.
const SLOW_PASSES: usize = 6;
/// What friction owes to the velocity itself is found by so many corrections in each pass.
const FRICTION_CORRECTIONS: usize = 2;
/// A velocity is slow where it differs from its slow part by no more roundings of what both are made of.
const ROUNDINGS: f64 = 64.0 * f64::EPSILON;
/// The same of a derivative, on whose fast part less depends. Its steps lose up to e⁴ roundings each, where the fast part of
/// their series would take as much away.
const TANGENT_ROUNDINGS: f64 = 4096.0 * f64::EPSILON;

/// The damping of a system that is heavy in some direction: M = L Lᵀ and L⁻¹ D L⁻ᵀ.
#[derive(Clone, Debug)]
pub(super) struct Heavy {
    lower: Matrix,
    damping: Matrix,
    undamped: f64,
    fastest: f64,
}

/// The directions of the velocities that damping leaves no other than a slow motion, as long as some contacts hold.
#[derive(Clone, Debug)]
pub(super) struct Slow {
    modes: Vec<Eigenmode>,
    pace: Pace,
}

/// How fast a slow motion is: its rate L, and by what share of its own rate a slope of friction speeds it up.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pace {
    pub(super) rate: f64,
    pub(super) share: f64,
}

/// One of them: z, M z and δ.
#[derive(Clone, Debug)]
struct Eigenmode {
    shape: Vec<f64>,
    dual: Vec<f64>,
    rate: f64,
}

impl Heavy {
    /// None where damping is light, or where its matrix is not symmetric.
    pub(super) fn of(system: &System, damping: f64, undamped: f64, fastest: f64) -> Option<Self> {
        let n = system.masses();
        let dampers = Matrix::from_rows(&system.damping);
        let symmetric = (0..n).all(|i| (0..i).all(|j| dampers.at(i, j) == dampers.at(j, i)));
        if !symmetric || damping.is_nan() || damping <= HEAVY_DAMPING * undamped {
            return None;
        }
        let lower = Matrix::from_rows(&system.mass).lower()?;
        let mut half = Matrix::zero(n);
        for j in 0..n {
            let column = forward(&lower, |i| dampers.at(i, j));
            (0..n).for_each(|i| half.set(j, i, column[i]));
        }
        let mut damping = Matrix::zero(n);
        for j in 0..n {
            let column = forward(&lower, |i| half.at(i, j));
            (0..n).for_each(|i| damping.set(i, j, column[i]));
        }
        Some(Self {
            lower,
            damping,
            undamped,
            fastest,
        })
    }

    /// What is slow while contacts hold.
    pub(super) fn slow(&self, ends: &[(usize, Option<usize>)], held: &[usize]) -> Slow {
        let n = self.lower.size;
        let mut damping = self.damping.clone();
        let mut fixed: Vec<Vec<f64>> = Vec::new();
        for &c in held {
            let (mass, other) = ends[c];
            let mut across = forward(&self.lower, |i| {
                f64::from(u8::from(i == mass)) - f64::from(u8::from(Some(i) == other))
            });
            let size = dot(&across, &across);
            for _ in 0..2 {
                for known in &fixed {
                    let share = dot(known, &across);
                    across
                        .iter_mut()
                        .zip(known)
                        .for_each(|(to, by)| *to -= share * by);
                }
            }
            let left = dot(&across, &across);
            // A contact that others hold already fixes nothing new.
            if left > 1e-12 * size {
                let length = left.sqrt();
                for entry in &mut across {
                    *entry /= length;
                }
                fixed.push(across);
            }
        }
        for known in &fixed {
            let damped: Vec<f64> = (0..n).map(|i| dot(damping.row(i), known)).collect();
            let own = dot(&damped, known);
            for i in 0..n {
                for j in 0..n {
                    let gone = known[i] * damped[j] + damped[i] * known[j] - own * known[i] * known[j];
                    damping.set(i, j, damping.at(i, j) - gone);
                }
            }
        }
        let (rates, vectors) = damping.eigen();
        let (mut modes, mut light, mut least) = (Vec::new(), 0.0_f64, f64::INFINITY);
        for (k, &rate) in rates.iter().enumerate() {
            if rate < HEAVY_DAMPING * self.undamped {
                light = light.max(rate.abs());
                continue;
            }
            least = least.min(rate);
            let vector: Vec<f64> = (0..n).map(|i| vectors.at(i, k)).collect();
            let dual = (0..n)
                .map(|i| dot(&self.lower.row(i)[..=i], &vector[..=i]))
                .collect();
            let mut shape = vector;
            for i in (0..n).rev() {
                let known: f64 = (i + 1..n).map(|j| self.lower.at(j, i) * shape[j]).sum();
                shape[i] = (shape[i] - known) / self.lower.at(i, i);
            }
            modes.push(Eigenmode { shape, dual, rate });
        }
        // What damping holds in every direction creeps at ω²/δ, or as it is driven.
        let pace = if !modes.is_empty() && modes.len() + fixed.len() == n {
            let rate = self.undamped * (self.undamped / least) + self.fastest;
            Pace {
                rate,
                share: rate / least,
            }
        } else {
            Pace {
                rate: self.undamped + light,
                share: 1.0,
            }
        };
        Slow { modes, pace }
    }
}

impl Motion {
    /// Expand the slow motion from (x, v); whether that is the motion from there.
    pub(super) fn expand_slow(&mut self, field: &VectorField, x: &[f64], v: &[f64]) -> bool {
        let (frame, force_lines, held) = (field.frame, field.force_lines, field.held);
        let Some(Slow { modes, pace }) = &held.slow else {
            return false;
        };
        if force_lines.iter().any(|line| line.zero_slope) {
            return false;
        }
        if modes.is_empty() {
            self.expand_many(field, x, v);
            self.slow = Some(*pace);
            return true;
        }
        let kind = self.ready(field, x, v);
        let (order, count) = (frame.order, modes.len());
        let mut before = vec![0.0; count * (order + 1)];
        let mut changed = vec![0.0; count];
        for _ in 0..SLOW_PASSES {
            let mut now = vec![0.0; count * (order + 1)];
            for k in 0..order {
                let next = (k + 1) as f64;
                for _ in 0..FRICTION_CORRECTIONS {
                    self.accelerate(field, k, kind);
                    for (m, mode) in modes.iter().enumerate() {
                        let rest = dot(&mode.dual, &self.acceleration) - next * before[(k + 1) * count + m];
                        let change = rest / mode.rate;
                        for (v, shape) in self.v.of_mut(k).iter_mut().zip(&mode.shape) {
                            *v += change * shape;
                        }
                    }
                }
                for (m, mode) in modes.iter().enumerate() {
                    now[k * count + m] = dot(&mode.dual, self.v.of(k));
                }
                self.accelerate(field, k, kind);
                self.follow(k, INVERSE[k + 1]);
            }
            for m in 0..count {
                changed[m] = now[m] - before[m];
            }
            before = now;
        }
        let pull = frame.undamped * frame.undamped * x.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let friction = (0..force_lines.len()).map(|c| self.force.of(0)[c].abs() * frame.coupling(c, c));
        let pull = friction.fold(pull, f64::max);
        let slow = modes.iter().enumerate().all(|(m, mode)| {
            let sizes = mode.dual.iter().zip(v);
            let size: f64 = sizes
                .map(|(dual, v)| dual.abs() * (v.abs() + pull / mode.rate))
                .sum();
            let off = (dot(&mode.dual, v) - before[m]).abs().max(changed[m].abs());
            off <= ROUNDINGS * size
        });
        if slow {
            self.slow = Some(*pace);
            self.finish(frame);
        }
        slow
    }
}

impl Tangent {
    /// Expand along a motion that is slow; whether these directions are slow there too. They obey linear equations of the same
    /// form, so that the same passes find their slow part. Where they are not, only velocities 0 are as they were.
    pub(crate) fn expand_slow(&mut self, along: &Along) -> bool {
        let (modes, order) = match &along.held.slow {
            Some(slow) if !slow.modes.is_empty() => (&slow.modes, along.order),
            _ => {
                self.expand(along);
                return true;
            }
        };
        let start: Vec<Block> = self.v.iter().map(|v| v[0]).collect();
        let count = modes.len();
        let mut before = vec![Block::NOTHING; count * (order + 1)];
        let mut changed = vec![Block::NOTHING; count];
        for _ in 0..SLOW_PASSES {
            let mut now = vec![Block::NOTHING; count * (order + 1)];
            for k in 0..order {
                let next = (k + 1) as f64;
                for _ in 0..FRICTION_CORRECTIONS {
                    self.accelerate(along, k);
                    for (m, mode) in modes.iter().enumerate() {
                        let mut rest = mode.part(|i| self.acceleration[i]);
                        rest.add(-next, before[(k + 1) * count + m]);
                        for (v, shape) in self.v.iter_mut().zip(&mode.shape) {
                            v[k].add(shape / mode.rate, rest);
                        }
                    }
                }
                for (m, mode) in modes.iter().enumerate() {
                    now[k * count + m] = mode.part(|i| self.v[i][k]);
                }
                self.accelerate(along, k);
                self.follow(k);
            }
            for m in 0..count {
                changed[m] = now[m];
                changed[m].add(-1.0, before[m]);
            }
            before = now;
        }
        let Along { frame, .. } = *along;
        let slow = (0..BLOCK).all(|lane| {
            let x = self.x.iter().map(|x| x[0][lane].abs()).fold(0.0, f64::max);
            let friction = |c: usize| self.force[c][0][lane].abs() * frame.coupling(c, c);
            let pull = (0..self.force.len())
                .map(friction)
                .fold(frame.undamped * frame.undamped * x, f64::max);
            modes.iter().enumerate().all(|(m, mode)| {
                let sizes = mode.dual.iter().zip(&start);
                let size: f64 = sizes
                    .map(|(dual, v)| dual.abs() * (v[lane].abs() + pull / mode.rate))
                    .sum();
                let off = (mode.part(|i| start[i])[lane] - before[m][lane])
                    .abs()
                    .max(changed[m][lane].abs());
                off <= TANGENT_ROUNDINGS * size
            })
        });
        if slow {
            self.finish(along);
        } else {
            for (v, start) in self.v.iter_mut().zip(start) {
                v[0] = start;
            }
        }
        slow
    }
}

impl Eigenmode {
    /// How much of it there is in velocities.
    fn part(&self, of: impl Fn(usize) -> Block) -> Block {
        let mut part = Block::NOTHING;
        for (i, dual) in self.dual.iter().enumerate() {
            part.add(*dual, of(i));
        }
        part
    }
}

/// L⁻¹ of a vector.
fn forward(lower: &Matrix, of: impl Fn(usize) -> f64) -> Vec<f64> {
    let mut solution = Vec::with_capacity(lower.size);
    for i in 0..lower.size {
        let known = dot(&lower.row(i)[..i], &solution);
        solution.push((of(i) - known) / lower.at(i, i));
    }
    solution
}

fn dot(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(a, b)| a * b).sum()
}
