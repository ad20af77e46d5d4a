//! The connected parts of a picture above one height.

use numpy::ndarray::Array2;

use super::{Part, Picture};

/// The connected parts of what lies above a height, eight neighbours each, in the order of their first pixels; each with the
/// sums of its columns and rows. The numbers of a picture are those of the parts, from 1 on.
pub(super) fn parts(picture: Picture<'_>, cut: f64) -> (Array2<u32>, Vec<(Part, [usize; 2])>) {
    let (high, wide) = picture.dim();
    let mut labels = picture.map(|&value| if f64::from(value) > cut { u32::MAX } else { 0 });
    let mut found = Vec::new();
    let mut open = Vec::new();
    for top in 0..high {
        for first in 0..wide {
            if labels[[top, first]] != u32::MAX {
                continue;
            }
            let label = 1 + u32::try_from(found.len()).unwrap_or(u32::MAX - 2);
            let (mut area, mut sums, mut left, mut right, mut bottom) = (0, [0, 0], first, first, top);
            labels[[top, first]] = label;
            open.push((top, first));
            while let Some((row, column)) = open.pop() {
                area += 1;
                sums = [sums[0] + column, sums[1] + row];
                (left, right, bottom) = (left.min(column), right.max(column), bottom.max(row));
                for y in row.saturating_sub(1)..(row + 2).min(high) {
                    for x in column.saturating_sub(1)..(column + 2).min(wide) {
                        if labels[[y, x]] == u32::MAX {
                            labels[[y, x]] = label;
                            open.push((y, x));
                        }
                    }
                }
            }
            found.push(((cut, area, left, top, right + 1 - left, bottom + 1 - top), sums));
        }
    }
    (labels, found)
}
