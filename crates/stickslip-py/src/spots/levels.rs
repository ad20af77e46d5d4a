//! Connected parts of a picture above each of some heights, all heights in one pass: a component tree by union-find.
//!
//! Source: Berger et al., Effective component tree computation, IEEE ICIP (2007) IV-41,
//! <https://doi.org/10.1109/ICIP.2007.4379949>.

#![expect(
    clippy::needless_pass_by_value,
    reason = "what Python hands over is an array of two words and a pointer, and some heights"
)]

use numpy::PyReadonlyArray2;
use numpy::ndarray::ArrayView2;
use pyo3::prelude::*;

/// The number of pixels, left, top, width and height of the box of a part, and the number of the part of the next lower
/// height that holds it, -1 where that is none of those kept.
type Level = (usize, usize, usize, usize, usize, i64);

/// A part is at least that share of its box, and its box as high as wide by that share or more.
const LEAST_FILL: f64 = 0.45;
const LEAST_WIDTH_RATIO: f64 = 0.25;

#[derive(Clone, Copy)]
struct Part {
    parent: u32,
    area: u32,
    left: u32,
    top: u32,
    right: u32,
    bottom: u32,
}

impl Part {
    fn sides(&self) -> (usize, usize) {
        let (width, height) = (self.right - self.left + 1, self.bottom - self.top + 1);
        (width as usize, height as usize)
    }

    fn compact(&self, smallest: f64, largest: f64) -> bool {
        let (area, (width, height)) = (f64::from(self.area), self.sides());
        let (width, height) = (width as f64, height as f64);
        area >= smallest
            && area <= largest
            && area >= LEAST_FILL * (width * height)
            && width.min(height) / width.max(height) >= LEAST_WIDTH_RATIO
    }
}

fn root(parts: &mut [Part], mut at: u32) -> u32 {
    loop {
        let up = parts[at as usize].parent;
        if up == at {
            return at;
        }
        let above = parts[up as usize].parent;
        parts[at as usize].parent = above;
        at = above;
    }
}

fn join(parts: &mut [Part], one: u32, other: u32) -> u32 {
    let (large, small) = if parts[one as usize].area >= parts[other as usize].area {
        (one, other)
    } else {
        (other, one)
    };
    let gone = parts[small as usize];
    parts[small as usize].parent = large;
    let kept = &mut parts[large as usize];
    kept.area += gone.area;
    kept.left = kept.left.min(gone.left);
    kept.top = kept.top.min(gone.top);
    kept.right = kept.right.max(gone.right);
    kept.bottom = kept.bottom.max(gone.bottom);
    large
}

/// Compact parts above each height, from the last height to the first; heights ascend.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    reason = "pictures have less than 2^32 pixels, which is checked"
)]
fn levels(picture: ArrayView2<'_, u8>, heights: &[f64], areas: (f64, f64)) -> Vec<Vec<Level>> {
    let (high, wide) = picture.dim();
    assert!(
        u32::try_from((high + 2) * (wide + 2)).is_ok(),
        "a picture has less than 2^32 pixels"
    );
    // how many heights each response is above
    let ranks: Vec<usize> = (0..=255)
        .map(|value| {
            heights
                .iter()
                .filter(|&&height| f64::from(value) > height)
                .count()
        })
        .collect();
    let mut starts = vec![0_usize; heights.len() + 2];
    for value in picture {
        starts[ranks[usize::from(*value)] + 1] += 1;
    }
    for rank in 0..=heights.len() {
        starts[rank + 1] += starts[rank];
    }
    let across = wide + 2; // a margin of one pixel that is above no height
    let mut next = starts.clone();
    let mut order = vec![0_u32; high * wide];
    for (row, line) in picture.outer_iter().enumerate() {
        for (column, value) in line.iter().enumerate() {
            let rank = ranks[usize::from(*value)];
            if rank > 0 {
                order[next[rank]] = ((row + 1) * across + column + 1) as u32;
                next[rank] += 1;
            }
        }
    }
    let around = [across + 1, across, across - 1, 1];
    let mut labels = vec![0_u32; (high + 2) * across];
    let empty = Part {
        parent: 0,
        area: 0,
        left: 0,
        top: 0,
        right: 0,
        bottom: 0,
    };
    let mut parts = vec![empty];
    let mut roots: Vec<u32> = Vec::new();
    let mut found: Vec<Vec<Level>> = Vec::new();
    let mut last: Vec<u32> = Vec::new();
    let mut numbers: Vec<i64> = Vec::new();
    for rank in (1..=heights.len()).rev() {
        for &pixel in &order[starts[rank]..starts[rank + 1]] {
            let at = pixel as usize;
            let mut own = 0;
            for off in around {
                for label in [labels[at - off], labels[at + off]] {
                    if label != 0 && label != own {
                        let other = root(&mut parts, label);
                        if own == 0 {
                            own = other;
                        } else if other != own {
                            own = join(&mut parts, own, other);
                        }
                    }
                }
            }
            let (row, column) = ((at / across - 1) as u32, (at % across - 1) as u32);
            if own == 0 {
                own = parts.len() as u32;
                parts.push(Part {
                    parent: own,
                    area: 1,
                    left: column,
                    top: row,
                    right: column,
                    bottom: row,
                });
                roots.push(own);
            } else {
                let part = &mut parts[own as usize];
                part.area += 1;
                part.left = part.left.min(column);
                part.top = part.top.min(row);
                part.right = part.right.max(column);
                part.bottom = part.bottom.max(row);
            }
            labels[at] = own;
        }
        roots.retain(|&one| parts[one as usize].parent == one);
        let mut good: Vec<u32> = roots
            .iter()
            .copied()
            .filter(|&one| parts[one as usize].compact(areas.0, areas.1))
            .collect();
        good.sort_by_key(|&one| (parts[one as usize].top, parts[one as usize].left, one));
        numbers.resize(parts.len(), -1);
        for (number, &one) in good.iter().enumerate() {
            numbers[one as usize] = number as i64;
        }
        if let Some(before) = found.last_mut() {
            for (spot, &one) in before.iter_mut().zip(&last) {
                spot.5 = numbers[root(&mut parts, one) as usize];
            }
        }
        for &one in &good {
            numbers[one as usize] = -1;
        }
        let spots = good.iter().map(|&one| {
            let part = parts[one as usize];
            let (width, height) = part.sides();
            (
                part.area as usize,
                part.left as usize,
                part.top as usize,
                width,
                height,
                -1,
            )
        });
        found.push(spots.collect());
        last = good;
    }
    found
}

/// Compact connected parts (of eight neighbours) of a picture above each height, from the last height to the first; heights
/// ascend. A part has between the smallest and the largest area, and fills its box as a spot does.
#[pyfunction]
pub(crate) fn spot_levels(
    py: Python<'_>,
    picture: PyReadonlyArray2<'_, u8>,
    heights: Vec<f64>,
    areas: (f64, f64),
) -> Vec<Vec<Level>> {
    let picture = picture.as_array();
    py.detach(|| levels(picture, &heights, areas))
}
