//! Square matrices row by row, and their exponential by a Taylor series, halved and squared.

use crate::number::Real;

/// a · b.
pub fn product<R: Real>(a: &[R], b: &[R], n: usize) -> Vec<R> {
    let mut c = vec![R::of(0.0); n * n];
    for i in 0..n {
        for k in 0..n {
            let factor = a[i * n + k];
            if factor.value() == 0.0 {
                continue;
            }
            for j in 0..n {
                c[i * n + j] = c[i * n + j] + factor * b[k * n + j];
            }
        }
    }
    c
}

/// A row without its zeros: columns and entries.
pub type Row<R> = Vec<(usize, R)>;

/// The entries of a row that are not zero.
pub fn sparse<R: Real>(row: &[R]) -> Row<R> {
    let entries = row.iter().copied().enumerate();
    entries.filter(|(_, entry)| entry.value() != 0.0).collect()
}

/// a · y.
pub fn times<R: Real>(a: &[R], y: &[R]) -> Vec<R> {
    let row = |row: &[R]| {
        let terms = row.iter().zip(y);
        terms.fold(R::of(0.0), |sum, (&r, &y)| sum + r * y)
    };
    a.chunks_exact(y.len()).map(row).collect()
}

/// row · y.
pub fn dot<R: Real>(row: &Row<R>, y: &[R]) -> R {
    row.iter().fold(R::of(0.0), |sum, &(j, r)| sum + r * y[j])
}

/// The largest sum of sizes in a row.
pub fn norm<R: Real>(a: &[R], n: usize) -> f64 {
    let sums = a
        .chunks_exact(n)
        .map(|row| row.iter().map(|r| r.value().abs()).sum());
    sums.fold(0.0, f64::max)
}

/// exp(a h).
pub fn exponential<R: Real>(a: &[R], n: usize, h: R) -> Vec<R> {
    let mut halvings = 0;
    let mut factor = h;
    while norm(a, n) * factor.value().abs() > 0.5 {
        factor = factor * R::of(0.5);
        halvings += 1;
    }
    let small: Vec<R> = a.iter().map(|&entry| entry * factor).collect();
    let mut sum: Vec<R> = (0..n * n)
        .map(|index| R::of(f64::from(u8::from(index % (n + 1) == 0))))
        .collect();
    let mut term = sum.clone();
    for order in 1..60 {
        let inverse = R::of(1.0) / R::of(f64::from(order));
        term = product(&term, &small, n);
        for entry in &mut term {
            *entry = *entry * inverse;
        }
        sum.iter_mut()
            .zip(&term)
            .for_each(|(sum, &term)| *sum = *sum + term);
        let seen = |(term, sum): (&R, &R)| term.value().abs() > R::ROUNDING * sum.value().abs();
        if !term.iter().zip(&sum).any(seen) {
            break;
        }
    }
    for _ in 0..halvings {
        sum = product(&sum, &sum, n);
    }
    sum
}

/// The solution X of a X = b, b with `columns` columns; none where a is singular.
pub fn solve<R: Real>(a: &[R], b: &[R], n: usize, columns: usize) -> Option<Vec<R>> {
    let (mut a, mut b) = (a.to_vec(), b.to_vec());
    let largest = a.iter().map(|entry| entry.value().abs()).fold(0.0, f64::max);
    for k in 0..n {
        let size = |row: usize| a[row * n + k].value().abs();
        let best = (k..n).max_by(|&p, &q| size(p).total_cmp(&size(q)))?;
        if size(best) <= 1e-13 * largest || !size(best).is_finite() {
            return None;
        }
        for j in 0..n {
            a.swap(best * n + j, k * n + j);
        }
        for j in 0..columns {
            b.swap(best * columns + j, k * columns + j);
        }
        for i in 0..n {
            if i == k {
                continue;
            }
            let factor = a[i * n + k] / a[k * n + k];
            for j in k..n {
                a[i * n + j] = a[i * n + j] - factor * a[k * n + j];
            }
            for j in 0..columns {
                b[i * columns + j] = b[i * columns + j] - factor * b[k * columns + j];
            }
        }
    }
    for i in 0..n {
        for j in 0..columns {
            b[i * columns + j] = b[i * columns + j] / a[i * n + i];
        }
    }
    Some(b)
}
