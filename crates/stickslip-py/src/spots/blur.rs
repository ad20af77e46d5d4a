//! A picture blurred by a Gaussian, with the bits of OpenCV: outlines are looked for in it.

use numpy::ndarray::{Array2, s};
use stickslip::elementary::exp;

use super::{Picture, whole};

/// Pixels of a line that are summed side by side.
const LANES: usize = 16;

/// Weights of a Gaussian in 256ths, rounded so that their sum is 256; OpenCV's for pictures of 8 bits.
fn gaussian(sigma: f64) -> Vec<u16> {
    let half = whole((6.0 * sigma + 1.0).round_ties_even()) / 2;
    let curve: Vec<f64> = (0..=half)
        .map(|i| (half - i) as f64 / sigma)
        .map(|off| exp(-off * off / 2.0))
        .collect();
    let sum = 2.0 * curve[..half].iter().sum::<f64>() + 1.0;
    let (mut weights, mut error, mut left) = (vec![0; 2 * half + 1], 0.0, 256);
    for i in 0..half {
        let exact = 256.0 * curve[i] / sum + error;
        let weight = exact.round_ties_even();
        error = exact - weight;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at most 128"
        )]
        let weight = weight as u16;
        left -= 2 * weight;
        weights[i] = weight;
        weights[2 * half - i] = weight;
    }
    weights[half] = left;
    weights
}

/// Index `at` of a line of `count` that goes on as in a mirror at its first and last.
fn mirrored(at: isize, count: usize) -> usize {
    let period = 2 * count.cast_signed() - 2;
    let there = if period > 0 { at.rem_euclid(period) } else { 0 };
    there.min(period - there).max(0).unsigned_abs()
}

pub(super) fn blur(picture: Picture<'_>, sigma: f64) -> Array2<u8> {
    let (high, wide) = picture.dim();
    if picture.is_empty() {
        return picture.to_owned();
    }
    let weights = gaussian(sigma);
    let reach = (weights.len() / 2).cast_signed();
    let padded = wide.next_multiple_of(LANES);
    let from = |count: usize| (-reach..count.cast_signed() + reach).map(move |at| mirrored(at, count));
    let columns: Vec<usize> = from(wide).collect();
    let mut line = vec![0_u16; padded + weights.len()];
    let mut across = Vec::with_capacity(high * padded);
    for row in picture.rows() {
        for (value, &column) in line.iter_mut().zip(&columns) {
            *value = row[column].into();
        }
        for first in (0..padded).step_by(LANES) {
            let mut sums = [0_u16; LANES];
            for (ahead, &weight) in line[first..].windows(LANES).zip(&weights) {
                for (sum, value) in sums.iter_mut().zip(ahead) {
                    *sum += weight * value;
                }
            }
            across.extend_from_slice(&sums);
        }
    }
    let rows: Vec<usize> = from(high).map(|row| row * padded).collect();
    let mut blurred = Vec::with_capacity(across.len());
    for near in rows.windows(weights.len()) {
        for first in (0..padded).step_by(LANES) {
            let mut sums = [1_u32 << 15; LANES];
            for (&row, &weight) in near.iter().zip(&weights) {
                for (sum, &value) in sums.iter_mut().zip(&across[row + first..][..LANES]) {
                    *sum += u32::from(weight) * u32::from(value);
                }
            }
            blurred.extend(sums.map(|sum| sum.to_le_bytes()[2]));
        }
    }
    let blurred =
        Array2::from_shape_vec((high, padded), blurred).expect("a row of sums for each of the picture");
    blurred.slice(s![.., ..wide]).to_owned()
}
