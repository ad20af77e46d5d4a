//! The ground around a spot: which pixels it has, its level and scatter, and how much the light falls off on it.

use numpy::ndarray::{Array1, Array2, Axis, Slice, Zip};

use super::Picture;
use super::moments::Moments;

/// Pixels of ground at least around a spot, which its contrast is over.
pub(super) const LEAST_GROUND: u32 = 12;

/// Which pixels lie within `reach` rows and columns of one that is set.
pub(super) fn dilated(mask: &Array2<bool>, reach: usize) -> Array2<bool> {
    let mut found = mask.clone();
    for axis in [Axis(0), Axis(1)] {
        let (from, length) = (found.clone(), mask.len_of(axis));
        for apart in 1..=reach.min(length.saturating_sub(1)) {
            let (first, last) = (Slice::from(..length - apart), Slice::from(apart..));
            for (to, near) in [(first, last), (last, first)] {
                found
                    .slice_axis_mut(axis, to)
                    .zip_mut_with(&from.slice_axis(axis, near), |found, &set| *found |= set);
            }
        }
    }
    found
}

/// The first value up to which there are more than `count`.
pub(super) fn passing(counts: &[u32], count: u32) -> Option<usize> {
    let mut below = 0;
    counts.iter().position(|more| {
        below += more;
        below > count
    })
}

/// How many values there are in a mask, their upper median, and the median of what they are off it, values taken as rounded.
pub(super) fn level_and_scatter(values: Picture<'_>, mask: &Array2<bool>) -> (u32, usize, f64) {
    let mut counts = [0_u32; 256];
    Zip::from(values)
        .and(mask)
        .for_each(|&value, &set| counts[usize::from(value)] += u32::from(set));
    let count: u32 = counts.iter().sum();
    let median = passing(&counts, count / 2).unwrap_or(255);
    let mut apart = [0_u32; 256];
    for (value, more) in counts.iter().enumerate() {
        apart[value.abs_diff(median)] += more;
    }
    let off = passing(&apart, count / 2).unwrap_or(256);
    let nearer: u32 = apart[..off.min(255)].iter().sum();
    let share = (0.5 * f64::from(count) - f64::from(nearer)) / f64::from(apart[off.min(255)].max(1));
    let width = if off == 0 { 0.5 } else { 1.0 };
    (
        count,
        median,
        (off as f64 - 0.5).max(0.0) + width * share.clamp(0.0, 1.0),
    )
}

/// How much the light falls off over a picture: the plane through the ground around a spot, 0 at the centre of that. None where
/// it is no even ground but holds edges or texture.
pub(super) fn plane(
    window: Picture<'_>,
    around: &Array2<bool>,
    count: u32,
    ground: f64,
    spread: f64,
) -> Option<Array2<f64>> {
    let [low, high] = [-1.0, 1.0].map(|side| (ground + side * (3.0 * spread + 1.0)).round_ties_even());
    let mut plain = around.clone();
    plain.zip_mut_with(&window, |plain, &value| {
        *plain &= (low..=high).contains(&f64::from(value));
    });
    let of = Moments::of(&plain.view(), f64::from).central();
    if of.weight < 0.95 * f64::from(count) {
        return None;
    }
    let lit = Zip::from(window)
        .and(&plain)
        .map_collect(|&value, &plain| if plain { value } else { 0 });
    let bright = Moments::of(&lit.view(), f64::from);
    let determinant = of.xx * of.yy - of.xy * of.xy;
    if determinant <= 0.0 {
        return None;
    }
    let (x, y) = (bright.x - of.x * bright.weight, bright.y - of.y * bright.weight);
    let right = (x * of.yy - y * of.xy) / determinant;
    let down = (y * of.xx - x * of.xy) / determinant;
    let falls = |length: usize, slope: f64, centre: f64| {
        Array1::from_iter((0..length).map(|at| slope * (at as f64 - centre)))
    };
    let (high, wide) = window.dim();
    Some(falls(high, down, of.y).insert_axis(Axis(1)) + falls(wide, right, of.x))
}
