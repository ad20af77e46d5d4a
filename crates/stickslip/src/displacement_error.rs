//! The motion nearest to a measured one that obeys a law: what an error of the displacement does to a force that was found
//! from it.

/// The oscillator m ε″ + (D + F′(w)) ε′ + k ε = e through which an error ε of the displacement, sampled every `step`, reaches
/// the force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DisplacementError {
    /// Sampling interval.
    pub step: f64,
    /// m.
    pub mass: f64,
    /// D.
    pub damping: f64,
    /// k.
    pub stiffness: f64,
}

/// A law that falls faster with w than m / h per unit of it cannot be followed with samples every h.
const STEEPEST_FALL: f64 = 0.9;
/// Of a motion that others make up no more than this part is left by rounding.
const DEPENDENT_REST: f64 = 1e-14;

impl DisplacementError {
    /// ε from rest at the first sample, and the motions that what is left open may add to it: a shift, a speed at the start
    /// and, where friction is `carried` on from the last turn, an error of that. Samples of stretches of these lengths follow
    /// each other, each begins anew. By central differences.
    ///
    /// # Panics
    /// Where a column is shorter than the stretches.
    pub fn errors(
        &self,
        difference: &[f64],
        slope: &[f64],
        carried: Option<&[f64]>,
        lengths: &[usize],
    ) -> Vec<Vec<f64>> {
        let h2 = self.step * self.step / self.mass;
        let elastic = self.stiffness * h2 - 2.0;
        let mut found = vec![vec![0.0; difference.len()]; 3 + usize::from(carried.is_some())];
        let mut begin = 0;
        for &length in lengths {
            // What each column had two rows and one row before, side by side: each waits for its own alone.
            let (mut before, mut now) = ([0.0, 1.0, 0.0, 0.0], [0.0, 1.0, self.step, 0.0]);
            for (k, i) in (begin..begin + length).enumerate() {
                let row = if k < 2 {
                    [before, now][k]
                } else {
                    let drag = (self.damping + slope[i - 1]) * self.step / (2.0 * self.mass);
                    let drag = drag.max(-STEEPEST_FALL);
                    let carried = carried.map_or(0.0, |carried| carried[i - 1]);
                    let pushed = [h2 * difference[i - 1], 0.0, 0.0, h2 * carried];
                    let (back, share) = (1.0 - drag, 1.0 / (1.0 + drag));
                    let next =
                        [0, 1, 2, 3].map(|c| (pushed[c] - elastic * now[c] - back * before[c]) * share);
                    (before, now) = (now, next);
                    next
                };
                for (column, number) in found.iter_mut().zip(row) {
                    column[i] = number;
                }
            }
            begin += length;
        }
        found
    }
}

/// Residuals less what open motions explain of them, as far as their priors let them (infinite: free); of each stretch the
/// residuals, then what each bounded motion took relative to its prior. A residual that is NaN was not measured and gives 0.
///
/// # Panics
/// Where a column is shorter than the stretches.
pub fn without(motions: &[&[f64]], residual: &[f64], prior: &[f64], lengths: &[usize]) -> Vec<f64> {
    let bounded: Vec<usize> = (0..motions.len())
        .filter(|&number| prior[number].is_finite())
        .collect();
    let mut left = Vec::with_capacity(residual.len() + lengths.len() * bounded.len());
    let mut basis = vec![Vec::new(); motions.len()];
    let mut begin = 0;
    for &length in lengths {
        let rows = begin..begin + length;
        let known = |column: &[f64], into: &mut Vec<f64>| {
            into.extend(
                column[rows.clone()]
                    .iter()
                    .zip(&residual[rows.clone()])
                    .map(|(value, residual)| if residual.is_nan() { 0.0 } else { *value }),
            );
        };
        for (number, motion) in motions.iter().enumerate() {
            let (before, others) = basis.split_at_mut(number);
            let column: &mut Vec<f64> = &mut others[0];
            column.clear();
            known(motion, column);
            column.extend(
                bounded
                    .iter()
                    .map(|&other| if other == number { 1.0 / prior[number] } else { 0.0 }),
            );
            // Of a law that falls steeply they grow beyond what a square may be.
            let largest = column.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
            if largest > 0.0 {
                for value in column.iter_mut() {
                    *value /= largest;
                }
            }
            let size = dot(column, column);
            // Twice is enough for a basis that is orthogonal to rounding (Kahan and Parlett).
            for _ in 0..2 {
                for other in before.iter() {
                    project_out(other, column);
                }
            }
            let rest = dot(column, column);
            // What the motions before it make up but for rounding explains nothing more.
            let scale = if rest > DEPENDENT_REST * DEPENDENT_REST * size {
                1.0 / rest.sqrt()
            } else {
                0.0
            };
            for value in column.iter_mut() {
                *value *= scale;
            }
        }
        let first = left.len();
        known(residual, &mut left);
        left.extend(bounded.iter().map(|_| 0.0));
        for column in &basis {
            project_out(column, &mut left[first..]);
        }
        begin += length;
    }
    left
}

/// Σ a b, in four sums side by side.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (a, b) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a.zip(b) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

fn project_out(unit: &[f64], column: &mut [f64]) {
    let share = dot(unit, column);
    for (value, unit) in column.iter_mut().zip(unit) {
        *value -= share * unit;
    }
}
