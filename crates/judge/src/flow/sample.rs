//! The motion at one time, with what rounding may do to each number.

use super::{Model, ROUNDINGS};
use crate::matrix::{Row, dot};
use crate::number::Real;

/// Everything at one time.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Time since the start of the phase.
    pub tau: f64,
    /// x and ẋ.
    pub state: Vec<f64>,
    /// Slip velocities, their rates, and what rounding may do to both.
    pub w: Vec<[f64; 4]>,
    /// Friction forces, their rates, and what rounding may do to both.
    pub force: Vec<[f64; 4]>,
    /// Normal forces over those of the laws, likewise.
    pub normal: Vec<[f64; 4]>,
    /// Displacements of springs, likewise.
    pub springs: Vec<[f64; 4]>,
    /// d²w/dt².
    pub second: Vec<f64>,
    /// ẍ.
    pub acceleration: Vec<f64>,
}

impl<R: Real> Model<'_, R> {
    /// Everything at the start.
    #[must_use]
    pub fn at_start(&self) -> Sample {
        let mut start = self.y0.clone();
        self.feed(&mut start);
        self.read(0.0, &start, &[])
    }

    pub(super) fn read(&self, tau: f64, y: &[R], slack: &[f64]) -> Sample {
        let mut rates = self.slope(y);
        for curve in &self.curves {
            rates[curve.at] = curve.rate(y, &rates);
        }
        let noise = 2 * self.n + 1;
        // What is not known of each variable, beside the rounding of its term.
        let mut known: Vec<f64> = (0..self.dim)
            .map(|j| slack.get(j).copied().unwrap_or_else(|| self.floor_of(j)))
            .collect();
        let size = |row: &Row<R>, known: &[f64]| -> f64 {
            let terms = row.iter().map(|&(j, r)| {
                let [size, start] = if j == noise {
                    [1.0, 0.0]
                } else {
                    [y[j].value().abs(), known[j]]
                };
                r.value().abs() * (ROUNDINGS * size + start)
            });
            terms.sum()
        };
        // A steep curve makes more of what is not known of w, for its contact and for all that hold against it.
        let mut of_curves = Vec::with_capacity(self.curves.len());
        for curve in &self.curves {
            let s = dot(&curve.along, y).value();
            let (force, slope) = (curve.shape.force(s).abs(), curve.shape.slope(s).abs());
            let [load, load_slack] = curve.load.as_ref().map_or([1.0, 0.0], |load| {
                [dot(load, y).value().abs(), size(load, &known)]
            });
            let along = size(&curve.along, &known);
            of_curves.push([force, slope, load, load_slack, along]);
        }
        for (curve, [force, slope, load, load_slack, along]) in self.curves.iter().zip(&of_curves) {
            known[curve.at] = load * slope * along + force * load_slack;
        }
        let size = |row: &Row<R>| size(row, &known);
        // What rounding does to a rate: to each term of each acceleration.
        let mut sizes: Vec<f64> = self.rows.iter().map(size).collect();
        for (curve, [force, slope, load, load_slack, along]) in self.curves.iter().zip(&of_curves) {
            let moved = |row: &Row<R>| row.iter().map(|&(j, r)| r.value().abs() * sizes[j]).sum::<f64>();
            let [load_rate, load_moved] = curve
                .load
                .as_ref()
                .map_or([0.0; 2], |row| [dot(row, &rates).value().abs(), moved(row)]);
            let rate = dot(&curve.along, &rates).value().abs();
            sizes[curve.at] = ROUNDINGS * rates[curve.at].value().abs()
                + load * slope * moved(&curve.along)
                + force * load_moved
                + slope * (load_slack * rate + load_rate * along);
        }
        let rate_size = |row: &Row<R>| -> f64 {
            let terms = row.iter().filter(|&&(j, _)| j != noise);
            terms.map(|&(j, r)| r.value().abs() * sizes[j]).sum()
        };
        let both = |row: &Row<R>| {
            [
                dot(row, y).value(),
                dot(row, &rates).value(),
                size(row),
                rate_size(row),
            ]
        };
        let second = self.slope(&rates);
        Sample {
            tau,
            second: self.w.iter().map(|row| dot(row, &second).value()).collect(),
            acceleration: rates[self.n..2 * self.n]
                .iter()
                .map(|rate| rate.value())
                .collect(),
            state: y[..2 * self.n].iter().map(|value| value.value()).collect(),
            w: self.w.iter().map(both).collect(),
            force: self.force.iter().map(both).collect(),
            normal: (self.normals.iter())
                .map(|normal| normal.as_ref().map_or([1.0, 0.0, 0.0, 0.0], both))
                .collect(),
            springs: self.springs.iter().map(both).collect(),
        }
    }
}
