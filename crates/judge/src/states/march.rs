//! The linearly implicit Euler rule, extrapolated: Deuflhard, SIAM Review 27 (1985) 505, section 3.
//!
//! A step is made of 2, 3, 4 … steps of order 1, whose errors are polynomials in their length; what they extrapolate to is
//! believed where two rows of the table agree, else the step is halved.

use super::equations::Equations;

/// To which share of the motion two rows must agree, and a step over all its shares at most.
const ROWS_AGREE: f64 = 1e-13;
/// The rows, and from which on two that agree are believed: fewer may agree by chance.
const MOST_ROWS: usize = 11;
const FIRST_BELIEVED_ROW: usize = 4;
/// A step halved so often is shorter than any rounding.
const MOST_HALVINGS: u32 = 60;

/// A motion from time to time.
#[derive(Clone, Debug)]
pub struct March<'a> {
    equations: &'a Equations<'a>,
    /// What counts as small in each variable.
    sizes: Vec<f64>,
    /// How many more steps are not too much work.
    pub left: u64,
    /// How often a step was halved at most since this was last set to zero.
    pub deepest: u32,
}

impl<'a> March<'a> {
    /// So many steps of these equations.
    pub fn new(equations: &'a Equations<'a>, sizes: Vec<f64>, left: u64) -> Self {
        Self {
            equations,
            sizes,
            left,
            deepest: 0,
        }
    }

    /// The variables at a later time; none where that is too much work.
    pub fn on(&mut self, [from, to]: [f64; 2], y: &[f64]) -> Option<Vec<f64>> {
        let mut y = y.to_vec();
        for pair in self.equations.bends(from, to).windows(2) {
            let middle = 0.5 * (pair[0] + pair[1]);
            y = self.step([pair[0], middle], pair[1] - pair[0], &y, 0)?;
        }
        Some(y)
    }

    fn step(&mut self, [time, piece]: [f64; 2], h: f64, y: &[f64], depth: u32) -> Option<Vec<f64>> {
        self.left = self.left.checked_sub(1)?;
        self.deepest = self.deepest.max(depth);
        let width = self.equations.width;
        let mut matrix = vec![0.0; width * width];
        self.equations.rates([time, piece], y, Some(&mut matrix));
        let mut table: Vec<Vec<f64>> = Vec::with_capacity(MOST_ROWS);
        let mut before = f64::INFINITY;
        for row in 0..MOST_ROWS {
            let parts = (row + 2) as f64;
            let Some(factors) = Factors::of(&matrix, h / parts, width) else {
                break;
            };
            let mut now = y.to_vec();
            for index in 0..row + 2 {
                let [here, there] = [index, index + 1].map(|part| time + h * (part as f64 / parts));
                let (mut rates, _) = self.equations.rates_since(here, [there, piece], &now, None);
                for rate in &mut rates {
                    *rate *= h / parts;
                }
                factors.solve(&mut rates);
                now.iter_mut().zip(rates).for_each(|(y, by)| *y += by);
            }
            if now.iter().any(|value| !value.is_finite()) {
                break;
            }
            let last = table.last().cloned();
            // Aitken and Neville: each order of the row before gives one more of this one.
            for (order, old) in table.iter_mut().enumerate() {
                let ratio = parts / (row - order + 1) as f64;
                let better = now
                    .iter()
                    .zip(&*old)
                    .map(|(new, old)| new + (new - old) / (ratio - 1.0))
                    .collect();
                *old = std::mem::replace(&mut now, better);
            }
            if let Some(last) = last {
                let gap = |i: usize| {
                    let size = self.sizes[i] + y[i].abs().max(now[i].abs());
                    (now[i] - last[i]).abs() / size
                };
                let gap = (0..width).map(gap).fold(0.0, f64::max);
                if row >= FIRST_BELIEVED_ROW && gap <= ROWS_AGREE {
                    return Some(now);
                }
                // What does not come closer will not do so in the rows that are left.
                if row > FIRST_BELIEVED_ROW && gap > 0.5 * before || row >= FIRST_BELIEVED_ROW && gap > 1e-4 {
                    break;
                }
                before = gap;
            }
            table.push(now);
        }
        if depth == MOST_HALVINGS {
            return table.pop();
        }
        let half = 0.5 * h;
        let middle = self.step([time, piece], half, y, depth + 1)?;
        self.step([time + half, piece], half, &middle, depth + 1)
    }
}

/// 1 − h J as a product of triangles.
struct Factors {
    matrix: Vec<f64>,
    pivots: Vec<usize>,
}

impl Factors {
    /// None where it has no inverse.
    fn of(derivatives: &[f64], h: f64, n: usize) -> Option<Self> {
        let mut matrix: Vec<f64> = derivatives.iter().map(|entry| -h * entry).collect();
        (0..n).for_each(|i| matrix[i * n + i] += 1.0);
        // Rows of every unit: each is measured by its own largest entry.
        let largest: Vec<f64> = matrix
            .chunks_exact(n)
            .map(|row| row.iter().fold(0.0, |most: f64, entry| most.max(entry.abs())))
            .collect();
        let mut order: Vec<usize> = (0..n).collect();
        let mut pivots = Vec::with_capacity(n);
        for k in 0..n {
            let share = |i: usize| matrix[i * n + k].abs() / largest[order[i]];
            let best = (k..n).max_by(|&i, &j| share(i).total_cmp(&share(j)))?;
            if !(share(best) > 0.0 && share(best).is_finite()) {
                return None;
            }
            pivots.push(best);
            order.swap(k, best);
            (0..n).for_each(|j| matrix.swap(k * n + j, best * n + j));
            for i in k + 1..n {
                let factor = matrix[i * n + k] / matrix[k * n + k];
                matrix[i * n + k] = factor;
                for j in k + 1..n {
                    matrix[i * n + j] -= factor * matrix[k * n + j];
                }
            }
        }
        Some(Self { matrix, pivots })
    }

    fn solve(&self, right: &mut [f64]) {
        let n = right.len();
        for (k, &pivot) in self.pivots.iter().enumerate() {
            right.swap(k, pivot);
        }
        for i in 0..n {
            right[i] -= (0..i).map(|j| self.matrix[i * n + j] * right[j]).sum::<f64>();
        }
        for i in (0..n).rev() {
            let sum: f64 = (i + 1..n).map(|j| self.matrix[i * n + j] * right[j]).sum();
            right[i] = (right[i] - sum) / self.matrix[i * n + i];
        }
    }
}
