//! The texture of a ground, which is alike from pixel to pixel: of sums over it the variance is larger than that of noise.

use numpy::ndarray::{Array2, Axis, Slice, Zip};

use super::ground::LEAST_GROUND;

/// Pixels up to which apart a ground with texture may be alike.
const TEXTURE_REACH: usize = 12;
/// Smaller correlations may be those of the few pixels around a spot.
const LEAST_CORRELATION: f64 = 0.15;

/// How alike noise is in pixels beside each other: the correlation of pixels that are (x, y) apart is `share` times that of its
/// part along rows at x times that along columns at y, from distance 1 on; without texture nothing is.
pub(super) struct Texture {
    share: f64,
    rows: Vec<f64>,
    columns: Vec<f64>,
}

impl Texture {
    /// That of what a picture is off its level, where it is ground.
    pub(super) fn of(off: &Array2<f64>, ground: &Array2<bool>) -> Self {
        let all = ground.iter().filter(|&&ground| ground).count().max(1);
        let mut own = off.clone();
        own.zip_mut_with(ground, |own, &ground| {
            if !ground {
                *own = 0.0;
            }
        });
        let mean = own.sum() / all as f64;
        own.zip_mut_with(ground, |own, &ground| {
            if ground {
                *own -= mean;
            }
        });
        // the mean product of pixels of the ground that are so far apart
        let moment = |along: Axis, apart: usize| {
            let length = own.len_of(along);
            if apart >= length {
                return None;
            }
            let (first, last) = (Slice::from(..length - apart), Slice::from(apart..));
            let pairs = Zip::from(ground.slice_axis(along, first))
                .and(ground.slice_axis(along, last))
                .fold(0_u32, |count, &one, &other| count + u32::from(one & other));
            let sum = Zip::from(own.slice_axis(along, first))
                .and(own.slice_axis(along, last))
                .fold(0.0, |sum, one, other| sum + one * other);
            (pairs >= LEAST_GROUND).then(|| sum / f64::from(pairs))
        };
        let square = moment(Axis(0), 0).unwrap_or(f64::INFINITY);
        let [rows, columns] = [Axis(1), Axis(0)].map(|along| {
            (1..=TEXTURE_REACH)
                .map_while(|apart| Some(moment(along, apart)? / square))
                .take_while(|&alike| alike > LEAST_CORRELATION)
                .collect::<Vec<f64>>()
        });
        // the rest is noise that no two pixels share
        let share = [&rows, &columns]
            .iter()
            .filter_map(|alike| alike.first())
            .fold(0.0, |most, &alike| alike.clamp(most, 1.0));
        let part = |alike: Vec<f64>| alike.into_iter().map(|alike| (alike / share).min(1.0)).collect();
        Self {
            share,
            rows: part(rows),
            columns: part(columns),
        }
    }

    /// What two pixels have in common in the variance of a sum of such noise with weights, over that of one pixel.
    pub(super) fn shared(&self, weights: impl FnOnce() -> Array2<f64>) -> f64 {
        if self.share == 0.0 {
            return 0.0;
        }
        let weights = weights();
        let mut sums = weights.clone();
        for (along, alike) in [(Axis(1), &self.rows), (Axis(0), &self.columns)] {
            let from = sums.clone();
            for (from, mut to) in from.lanes(along).into_iter().zip(sums.lanes_mut(along)) {
                for (apart, &alike) in (1..).zip(alike) {
                    for at in apart..from.len() {
                        to[at] += alike * from[at - apart];
                        to[at - apart] += alike * from[at];
                    }
                }
            }
        }
        self.share * (&weights * (&sums - &weights)).sum().max(0.0)
    }
}
