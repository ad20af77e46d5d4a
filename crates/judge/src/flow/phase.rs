//! The equations of a phase followed: by exp(A h) from sample to sample, or by the extrapolated midpoint rule.

use super::{Model, ROUNDINGS, Sample, add};
use crate::matrix::times;
use crate::number::Real;

/// Samples a radian of the fastest oscillation are one over this; fewer where each costs an extrapolation.
const SPACING: [f64; 2] = [0.15, 0.4];
/// More work than this in one phase is not judged.
const MOST_WORK: [f64; 2] = [4e6, 2e7];
/// From so many times of a phase rounding is followed.
const MARKS: usize = 4;
/// Along a curve from so many more, each half as far from the end as the one before. Friction that falls draws slips together
/// for long, lets go of them at a fold and spreads them until they end: of what was rounding before, next to nothing is left at
/// the end, and of what is rounding at the fold thousands of times as much.
const HALVINGS: usize = 12;
/// More extrapolations than this in one phase are not judged either: a curve may be stiff.
const MOST_EXTRAPOLATIONS: u64 = 100_000;

/// A phase that was followed.
#[derive(Clone, Debug)]
pub struct Phase<'a, R> {
    model: Model<'a, R>,
    times: Vec<f64>,
    states: Vec<Vec<R>>,
    /// What rounding may do to x and ẋ at the end, and at most on the way.
    pub slack: [Vec<f64>; 2],
}

impl<'a, R: Real> Phase<'a, R> {
    /// Follow the model over a time; none where that is too much work.
    #[must_use]
    pub fn new(model: Model<'a, R>, length: R, least: usize, thorough: bool) -> Option<Self> {
        let dim = model.dim;
        let total = length.value();
        let curved = usize::from(!model.curves.is_empty());
        let wanted = (total * model.rate / SPACING[curved])
            .ceil()
            .max((least >> curved) as f64);
        let share = if model.curves.is_empty() { 1.0 } else { 60.0 };
        if !(wanted * share * (dim * dim) as f64 <= MOST_WORK[curved]) {
            return None;
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "checked above"
        )]
        let count = wanted as usize;
        let step = length / R::of(count as f64);
        let mut phase = Self {
            times: vec![0.0],
            states: Vec::with_capacity(count + 12),
            slack: [Vec::new(), Vec::new()],
            model,
        };
        let mut start = phase.model.y0.clone();
        phase.model.feed(&mut start);
        phase.states.push(start.clone());
        // Closer and closer to the start, where w may leave zero and what is heavily damped decays.
        let pace = phase.model.pace * step.value();
        let mut halvings = if curved == 1 { 3 } else { 5 };
        while pace * f64::exp2(-f64::from(halvings)) > 0.25 && halvings < 60 {
            halvings += 1;
        }
        for halving in (1..=halvings).rev() {
            let tau = step * R::of(f64::exp2(-f64::from(halving)));
            let (from, before) = (phase.states.last()?.clone(), *phase.times.last()?);
            let next = phase.move_on(&from, tau - R::of(before))?;
            phase.times.push(tau.value());
            phase.states.push(next);
        }
        let propagator = phase
            .model
            .curves
            .is_empty()
            .then(|| phase.model.propagator(step));
        let first = phase.states.len();
        let mut at_mark = start;
        for index in 1..=count {
            if index == count && propagator.is_none() {
                let before = step * R::of((count - 1) as f64);
                let mut part = step;
                for _ in 0..HALVINGS {
                    part = part * R::of(0.5);
                    at_mark = phase.move_on(&at_mark, part)?;
                    phase.times.push((before + step - part).value());
                    phase.states.push(at_mark.clone());
                }
                at_mark = phase.move_on(&at_mark, part)?;
                phase.times.push(length.value());
                phase.states.push(at_mark);
                break;
            }
            at_mark = match &propagator {
                Some(matrix) => times(matrix, &at_mark),
                None => phase.move_on(&at_mark, step)?,
            };
            phase.times.push((step * R::of(index as f64)).value());
            phase.states.push(at_mark.clone());
        }
        phase.weigh(first, propagator.as_deref(), thorough)?;
        Some(phase)
    }

    /// What rounding may do to the state; as if it did not grow unless `thorough`.
    ///
    /// Whatever way a motion is computed, at any time t_a it is known to some roundings of itself, which go on by the motion's
    /// own fundamental matrix: |δx_i(t)| ≤ ROUNDINGS · max_a Σ_j |Φ_ij(t, t_a)| |y_j(t_a)|, where constants and waves are
    /// states y_j as well; and each part of the way made costs a rounding of that part.
    fn weigh(&mut self, first: usize, propagator: Option<&[R]>, thorough: bool) -> Option<()> {
        let n = self.model.n;
        let mut way = vec![0.0; 2 * n];
        for pair in self.states.windows(2) {
            for i in 0..2 * n {
                way[i] += (pair[1][i].value() - pair[0][i].value()).abs();
            }
        }
        let start: Vec<f64> = self.states[0][..2 * n].iter().map(|y| y.value().abs()).collect();
        let [end, most] = match propagator {
            _ if !thorough => [start.clone(), start],
            Some(matrix) => self.carried(first, matrix),
            None => self.carried_by_curves(first, &way)?,
        };
        let slack = |carried: &[f64]| {
            (0..2 * n)
                .map(|i| ROUNDINGS * (carried[i] + way[i]) + self.model.floor_of(i))
                .collect()
        };
        self.slack = [slack(&end), slack(&most)];
        Some(())
    }

    /// The sum of [`Phase::weigh`] at the end and the most on the way: exp(A h) gives Φ from sample to sample, which from
    /// `first` on are as far apart.
    fn carried(&self, first: usize, matrix: &[R]) -> [Vec<f64>; 2] {
        let (n, dim, steps) = (self.model.n, self.model.dim, self.states.len() - first);
        let noise = 2 * n + 1;
        // Columns of Φ after so many steps.
        let unit = |j: usize| (0..dim).map(|i| R::of(f64::from(u8::from(i == j)))).collect();
        let mut phi: Vec<Vec<R>> = (0..dim).map(unit).collect();
        let marks: Vec<usize> = (0..MARKS).map(|mark| mark * steps / MARKS).collect();
        let (mut end, mut most) = (vec![0.0; 2 * n], vec![0.0; 2 * n]);
        for step in 0..=steps {
            for &mark in marks.iter().filter(|&&mark| mark + step <= steps) {
                // The first of the samples that are as far apart is one step after the start.
                let y = if mark == 0 {
                    &self.states[0]
                } else {
                    &self.states[first + mark - 1]
                };
                let size = |j: usize| if j == noise { 1.0 } else { y[j].value().abs() };
                for i in 0..2 * n {
                    let sum: f64 = (0..dim).map(|j| phi[j][i].value().abs() * size(j)).sum();
                    most[i] = f64::max(most[i], sum);
                    if mark + step == steps {
                        end[i] = f64::max(end[i], sum);
                    }
                }
            }
            for column in &mut phi {
                *column = times(matrix, column);
            }
        }
        [end, most]
    }

    /// The same by differences: move each state by what counts as rounding, then what the constants and curves give. Where
    /// that grows to the size of the motion, so does the difference.
    fn carried_by_curves(&self, first: usize, way: &[f64]) -> Option<[Vec<f64>; 2]> {
        let (n, count) = (self.model.n, self.states.len());
        let noise = 2 * n + 1;
        let (mut end, mut most) = (vec![0.0; 2 * n], vec![0.0; 2 * n]);
        let plain = self.model.plain();
        let equal = count - HALVINGS - first;
        let begins = (1..MARKS)
            .map(|mark| first + mark * equal / MARKS - 1)
            .chain(count - 1 - HALVINGS..count - 1);
        for begin in std::iter::once(0).chain(begins) {
            let mut moved: Vec<(Model<f64>, Vec<f64>)> = Vec::new();
            for j in 0..=2 * n {
                let mut model = plain.clone();
                let mut y: Vec<f64> = self.states[begin].iter().map(|y| y.value()).collect();
                if j < 2 * n {
                    let size = y[j].abs().max(way[j]);
                    if size == 0.0 {
                        continue;
                    }
                    y[j] += ROUNDINGS * size;
                } else if begin == 0 {
                    y[noise] = ROUNDINGS;
                    model.gain = 1.0 + ROUNDINGS;
                } else {
                    continue;
                }
                moved.push((model, y));
            }
            for at in begin + 1..count {
                let h = self.times[at] - self.times[at - 1];
                let mut sums = vec![0.0; 2 * n];
                for (model, y) in &mut moved {
                    if h > 0.0 {
                        *y = bulirsch_stoer(model, y, h, 0)?;
                    }
                    for (i, sum) in sums.iter_mut().enumerate() {
                        *sum += (y[i] - self.states[at][i].value()).abs() / ROUNDINGS;
                    }
                }
                for (i, sum) in sums.into_iter().enumerate() {
                    most[i] = f64::max(most[i], sum);
                    if at + 1 == count {
                        end[i] = f64::max(end[i], sum);
                    }
                }
            }
        }
        Some([end, most])
    }

    /// From a state on over a short time.
    fn move_on(&self, from: &[R], h: R) -> Option<Vec<R>> {
        let model = &self.model;
        if h.value() == 0.0 {
            return Some(from.to_vec());
        }
        if !model.curves.is_empty() {
            return bulirsch_stoer(model, from, h, 0);
        }
        if model.pace * h.value().abs() > 2.0 {
            return Some(times(&model.propagator(h), from));
        }
        let mut sum = from.to_vec();
        let mut term = from.to_vec();
        for order in 1..50 {
            let factor = h / R::of(f64::from(order));
            term = model.slope(&term);
            for entry in &mut term {
                *entry = *entry * factor;
            }
            sum.iter_mut()
                .zip(&term)
                .for_each(|(sum, &term)| *sum = *sum + term);
            let small = term
                .iter()
                .zip(&sum)
                .all(|(term, sum)| term.value().abs() <= R::ROUNDING * sum.value().abs());
            if small {
                break;
            }
        }
        Some(sum)
    }

    /// Everything at one of the sample times.
    #[must_use]
    pub fn sample(&self, index: usize) -> Sample {
        self.model
            .read(self.times[index], &self.states[index], &self.slack[1])
    }

    /// The variables at one of the sample times, x and ẋ first.
    #[must_use]
    pub fn state(&self, index: usize) -> &[R] {
        &self.states[index]
    }

    /// One of the sample times.
    #[must_use]
    pub fn time(&self, index: usize) -> f64 {
        self.times[index]
    }

    /// How many sample times there are.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.times.len()
    }

    /// Everything at any time.
    #[must_use]
    pub fn at(&self, tau: f64) -> Option<Sample> {
        let index = self.times.partition_point(|&time| time <= tau).max(1) - 1;
        let y = self.move_on(&self.states[index], R::of(tau) - R::of(self.times[index]))?;
        Some(self.model.read(tau, &y, &self.slack[1]))
    }

    /// Everything at the end.
    #[must_use]
    pub fn end(&self) -> Sample {
        let last = self.times.len() - 1;
        self.model
            .read(self.times[last], &self.states[last], &self.slack[0])
    }
}

/// One step by the extrapolated midpoint rule of order 14 at most, halved until two rows agree.
fn bulirsch_stoer<R: Real>(model: &Model<R>, from: &[R], h: R, depth: u32) -> Option<Vec<R>> {
    const PARTS: [u32; 7] = [2, 4, 6, 8, 10, 12, 14];
    model.steps.set(model.steps.get() + 1);
    // A corner of a curve is closed in on by halves.
    let cornered = model.curves.iter().any(|curve| curve.shape.cornered());
    if depth == if cornered { 48 } else { 12 } || model.steps.get() > MOST_EXTRAPOLATIONS {
        return None;
    }
    // The forces of curves come last and are no part of the state; waves and the clock are.
    let (state, dim) = (from.len() - model.curves.len(), from.len());
    let mut start = from.to_vec();
    model.feed(&mut start);
    let first = model.slope(&start);
    let known: Vec<f64> = (0..state)
        .map(|i| {
            let terms = model.rows[i].iter();
            let terms: f64 = terms.map(|&(j, a)| (a * start[j]).value().abs()).sum();
            h.value() * terms + model.floor_of(i) / ROUNDINGS
        })
        .collect();
    // The extrapolations of one row of the table, each `dim` long, and room for two states.
    let mut table: Vec<R> = Vec::with_capacity(PARTS.len() * dim);
    let (mut before, mut now) = (start.clone(), start.clone());
    let mut last = start.clone();
    for (index, &parts) in PARTS.iter().enumerate() {
        let step = h / R::of(f64::from(parts));
        before.copy_from_slice(&start);
        now.copy_from_slice(&start);
        add(&mut now, step, &first);
        for _ in 1..parts {
            model.feed(&mut now);
            model.add_slope(&mut before, step + step, &now);
            std::mem::swap(&mut before, &mut now);
        }
        model.feed(&mut now);
        for (before, &now) in before.iter_mut().zip(&now) {
            *before = R::of(0.5) * (*before + now);
        }
        model.add_slope(&mut before, step * R::of(0.5), &now);
        // Aitken and Neville: `before` becomes the extrapolation of every order in turn, what it replaces the next one's.
        for back in 1..=index {
            let ratio = R::of(f64::from(parts)) / R::of(f64::from(PARTS[index - back]));
            let factor = R::of(1.0) / (ratio * ratio - R::of(1.0));
            let old = &mut table[(back - 1) * dim..back * dim];
            for (new, old) in before.iter_mut().zip(old) {
                let better = *new + (*new - *old) * factor;
                (*old, *new) = (*new, better);
            }
        }
        if index >= R::ROWS {
            // Two rows, not two columns: those share the finest steps, and what these do not see is far more than their gap.
            let gap = |i: usize| {
                let size = start[i].value().abs().max(before[i].value().abs()) + known[i];
                (before[i] - last[i]).value().abs() / size.max(f64::MIN_POSITIVE)
            };
            if (0..state).all(|i| gap(i) <= R::AGREES) {
                model.feed(&mut before);
                return before
                    .iter()
                    .all(|value| value.value().is_finite())
                    .then_some(before);
            }
        }
        table.extend_from_slice(&before);
        last.copy_from_slice(&before);
    }
    let half = h * R::of(0.5);
    let middle = bulirsch_stoer(model, from, half, depth + 1)?;
    bulirsch_stoer(model, &middle, half, depth + 1)
}
