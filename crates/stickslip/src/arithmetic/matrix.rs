//! Small dense matrices, row after row: what a system of masses needs and no more.

use crate::elementary::hypot;

/// A square matrix.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Matrix {
    pub(crate) size: usize,
    entries: Vec<f64>,
}

impl Matrix {
    pub(crate) fn zero(size: usize) -> Self {
        Self {
            size,
            entries: vec![0.0; size * size],
        }
    }

    pub(crate) fn from_rows(rows: &[Vec<f64>]) -> Self {
        Self {
            size: rows.len(),
            entries: rows.concat(),
        }
    }

    pub(crate) fn row(&self, i: usize) -> &[f64] {
        &self.entries[i * self.size..(i + 1) * self.size]
    }

    pub(crate) fn at(&self, i: usize, j: usize) -> f64 {
        self.entries[i * self.size + j]
    }

    pub(crate) fn set(&mut self, i: usize, j: usize, value: f64) {
        self.entries[i * self.size + j] = value;
    }

    pub(crate) fn scale(&mut self, factor: f64) {
        for entry in &mut self.entries {
            *entry *= factor;
        }
    }

    pub(crate) fn times(&self, other: &Self) -> Self {
        let mut product = Self::zero(self.size);
        for i in 0..self.size {
            let sums = &mut product.entries[i * self.size..][..self.size];
            for (k, factor) in filled(self.row(i)) {
                for (sum, entry) in sums.iter_mut().zip(other.row(k)) {
                    *sum += factor * entry;
                }
            }
        }
        product
    }

    /// The largest sum of sizes along a row.
    pub(crate) fn norm(&self) -> f64 {
        let sum = |i| self.row(i).iter().map(|value| value.abs()).sum();
        (0..self.size).map(sum).fold(0.0, f64::max)
    }

    /// L of a symmetric positive definite matrix L Lᵀ (Cholesky); none if it is not one.
    pub(crate) fn lower(&self) -> Option<Self> {
        let n = self.size;
        let mut lower = Self::zero(n);
        for j in 0..n {
            for i in j..n {
                let known: f64 = (0..j).map(|k| lower.at(i, k) * lower.at(j, k)).sum();
                let rest = self.at(i, j) - known;
                if i == j {
                    if rest.is_nan() || rest <= 1e-14 * self.at(j, j).abs() {
                        return None;
                    }
                    lower.set(j, j, rest.sqrt());
                } else {
                    lower.set(i, j, rest / lower.at(j, j));
                }
            }
        }
        Some(lower)
    }

    /// The inverse of a symmetric positive definite matrix (Cholesky); none if it is not one.
    pub(crate) fn inverse(&self) -> Option<Self> {
        let n = self.size;
        if (0..n).all(|i| filled(self.row(i)).all(|(j, _)| i == j)) {
            return self.inverse_of_diagonal();
        }
        let lower = self.lower()?;
        let mut inverse = Self::zero(n);
        for column in 0..n {
            let mut solution = vec![0.0; n];
            for i in 0..n {
                let known: f64 = (0..i).map(|k| lower.at(i, k) * solution[k]).sum();
                let unit = if i == column { 1.0 } else { 0.0 };
                solution[i] = (unit - known) / lower.at(i, i);
            }
            for i in (0..n).rev() {
                let known: f64 = (i + 1..n).map(|k| lower.at(k, i) * solution[k]).sum();
                solution[i] = (solution[i] - known) / lower.at(i, i);
            }
            for (i, value) in solution.into_iter().enumerate() {
                inverse.set(i, column, value);
            }
        }
        Some(inverse)
    }

    /// The same where all that is not on the diagonal is zero, with the same rounding.
    fn inverse_of_diagonal(&self) -> Option<Self> {
        let mut inverse = Self::zero(self.size);
        for i in 0..self.size {
            let entry = self.at(i, i);
            if entry.is_nan() || entry <= 1e-14 * entry.abs() {
                return None;
            }
            let lower = entry.sqrt();
            inverse.set(i, i, (1.0 / lower) / lower);
        }
        Some(inverse)
    }

    /// The eigenvalues of a symmetric matrix, and its eigenvectors as columns (Jacobi rotations).
    pub(crate) fn eigen(&self) -> (Vec<f64>, Self) {
        let n = self.size;
        let mut a = self.clone();
        let mut vectors = Self::zero(n);
        for i in 0..n {
            vectors.set(i, i, 1.0);
        }
        for _ in 0..60 {
            let mut off = 0.0;
            for p in 0..n {
                for q in p + 1..n {
                    off += a.at(p, q).abs();
                    if a.at(p, q) == 0.0 {
                        continue;
                    }
                    let theta = 0.5 * (a.at(q, q) - a.at(p, p)) / a.at(p, q);
                    let t = theta.signum() / (theta.abs() + hypot(theta, 1.0));
                    let c = 1.0 / hypot(t, 1.0);
                    let s = t * c;
                    for k in 0..n {
                        let (kp, kq) = (a.at(k, p), a.at(k, q));
                        a.set(k, p, c * kp - s * kq);
                        a.set(k, q, s * kp + c * kq);
                    }
                    for k in 0..n {
                        let (pk, qk) = (a.at(p, k), a.at(q, k));
                        a.set(p, k, c * pk - s * qk);
                        a.set(q, k, s * pk + c * qk);
                        let (kp, kq) = (vectors.at(k, p), vectors.at(k, q));
                        vectors.set(k, p, c * kp - s * kq);
                        vectors.set(k, q, s * kp + c * kq);
                    }
                }
            }
            if off <= 1e-300 {
                break;
            }
        }
        ((0..n).map(|i| a.at(i, i)).collect(), vectors)
    }

    /// The inverse of a symmetric positive semidefinite matrix where it has one, and zero on its null space: the solution of
    /// least size (Jacobi rotations).
    pub(crate) fn pseudo_inverse(&self) -> Self {
        let n = self.size;
        if n == 1 {
            let mut inverse = Self::zero(1);
            inverse.set(0, 0, 1.0 / self.at(0, 0));
            return inverse;
        }
        if let Some(inverse) = self.inverse() {
            return inverse;
        }
        let (values, vectors) = self.eigen();
        let largest = values.iter().copied().fold(0.0, f64::max);
        let mut inverse = Self::zero(n);
        for k in (0..n).filter(|&k| values[k] > 1e-12 * largest) {
            for i in 0..n {
                for j in 0..n {
                    let part = vectors.at(i, k) * vectors.at(j, k) / values[k];
                    inverse.set(i, j, inverse.at(i, j) + part);
                }
            }
        }
        inverse
    }
}

/// A square matrix as a product of triangles, in its place, with the rows that were exchanged; none where it has no inverse.
pub(crate) fn factor(matrix: &mut [f64], n: usize) -> Option<Vec<usize>> {
    let mut pivots = Vec::with_capacity(n);
    for k in 0..n {
        let size = |i: usize| matrix[i * n + k].abs();
        let pivot = (k..n).fold(k, |best, i| if size(i) > size(best) { i } else { best });
        if !(size(pivot) > 0.0 && size(pivot).is_finite()) {
            return None;
        }
        pivots.push(pivot);
        for j in 0..n {
            matrix.swap(k * n + j, pivot * n + j);
        }
        for i in k + 1..n {
            let share = matrix[i * n + k] / matrix[k * n + k];
            matrix[i * n + k] = share;
            for j in k + 1..n {
                matrix[i * n + j] -= share * matrix[k * n + j];
            }
        }
    }
    Some(pivots)
}

/// The solution of a factored system, in the place of its right side.
pub(crate) fn solve(matrix: &[f64], pivots: &[usize], right: &mut [f64]) {
    let n = right.len();
    for (k, &pivot) in pivots.iter().enumerate() {
        right.swap(k, pivot);
    }
    for i in 0..n {
        for j in 0..i {
            right[i] -= matrix[i * n + j] * right[j];
        }
    }
    for i in (0..n).rev() {
        for j in i + 1..n {
            right[i] -= matrix[i * n + j] * right[j];
        }
        right[i] /= matrix[i * n + i];
    }
}

/// Rows of which only what is not zero is kept.
#[derive(Clone, Debug)]
pub(crate) struct Rows<T> {
    /// Where each row begins, and where the last one ends.
    starts: Vec<usize>,
    entries: Vec<(usize, T)>,
}

impl<T> Rows<T> {
    /// The entries of every row, each with its column.
    pub(crate) fn new<R: IntoIterator<Item = (usize, T)>>(rows: impl IntoIterator<Item = R>) -> Self {
        let (mut starts, mut entries) = (vec![0], Vec::new());
        for row in rows {
            entries.extend(row);
            starts.push(entries.len());
        }
        Self { starts, entries }
    }

    /// Those of a diagonal matrix.
    pub(crate) fn of_diagonal(entries: impl ExactSizeIterator<Item = T>) -> Self {
        Self {
            starts: (0..=entries.len()).collect(),
            entries: entries.enumerate().collect(),
        }
    }

    pub(crate) fn count(&self) -> usize {
        self.starts.len() - 1
    }

    pub(crate) fn row(&self, i: usize) -> &[(usize, T)] {
        &self.entries[self.starts[i]..self.starts[i + 1]]
    }
}

/// The numbers of a row but for zeros, each with its column.
pub(crate) fn filled(row: &[f64]) -> impl Iterator<Item = (usize, f64)> {
    row.iter().copied().enumerate().filter(|(_, value)| *value != 0.0)
}

#[cfg(test)]
mod tests {
    use super::Matrix;

    #[test]
    fn inverse_and_least_solution() {
        let matrix = Matrix::from_rows(&[vec![2.0, 1.0], vec![1.0, 3.0]]);
        let unit = matrix.times(&matrix.inverse().unwrap());
        assert!((unit.at(0, 0) - 1.0).abs() < 1e-15 && unit.at(0, 1).abs() < 1e-15);
        // Two contacts between the same bodies: they share the force.
        let twice = Matrix::from_rows(&[vec![1.0, 1.0], vec![1.0, 1.0]]);
        assert!(twice.inverse().is_none());
        assert!((twice.pseudo_inverse().at(0, 1) - 0.25).abs() < 1e-15);
    }
}
