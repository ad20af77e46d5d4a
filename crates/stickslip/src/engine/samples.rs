//! A smooth motion that was integrated elsewhere, between samples of it.

use super::steps::{Track, TrackStep};
use super::{Engine, Reached};
use crate::clock::Clock;
use crate::error::Error;
use crate::observer::Observer;
use crate::series::{Series, ZERO};
use crate::simulate::Stop;

/// Samples of the mass of one contact, by columns of one length: between two of them the motion is the polynomial of fifth
/// order that has their values and first two derivatives.
#[derive(Clone, Debug)]
pub struct Samples<'a> {
    /// Times, increasing.
    pub t: &'a [f64],
    /// Positions.
    pub x: &'a [f64],
    /// Velocities.
    pub v: &'a [f64],
    /// Accelerations.
    pub a: &'a [f64],
    /// Slip velocities.
    pub w: &'a [f64],
    /// Slip accelerations.
    pub slip_acceleration: &'a [f64],
    /// Whether the contact is as good as stuck.
    pub stuck: &'a [bool],
    /// Events of the run.
    pub events: u64,
    /// The state at the end.
    pub end: Reached,
}

impl Engine for Samples<'_> {
    fn go(&mut self, t_end: f64, after: f64, observer: &mut impl Observer) -> Result<Stop, Error> {
        let t = self.t;
        let last = t.partition_point(|&t| t < t_end).min(t.len().saturating_sub(1));
        let fastest = self.v.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        for i in 1..=last {
            let h = t[i] - t[i - 1];
            let from = (after - t[i - 1]).max(0.0);
            if from >= h && i < last {
                continue;
            }
            if i.is_multiple_of(1024) && !observer.go_on() {
                return Ok(Stop::MaxSeconds);
            }
            let ends = |values: &[f64]| [values[i - 1], values[i]];
            let [x, v, a] = [self.x, self.v, self.a].map(ends);
            let track = Track {
                x: hermite(x, v, a, h),
                v: slope(x, v, a, h),
                u: cubic(ends(self.w), ends(self.slip_acceleration), h),
                // Nothing sticks truly: the slip velocity has its own sign.
                direction: 1.0,
                rounding: 1e3 * f64::EPSILON * fastest,
                rate: 1.0 / h,
            };
            let course = TrackStep {
                clock: Clock::at(t[i - 1]),
                track,
                sticks: self.stuck[i - 1] && self.stuck[i],
            };
            observer.pass(&course, (from, h), i == last);
        }
        Ok(Stop::End)
    }

    fn events(&self) -> u64 {
        self.events
    }

    fn end(&self) -> &Reached {
        &self.end
    }
}

/// The polynomial of fifth order through values, slopes and curvatures at 0 and `h`.
fn hermite(x: [f64; 2], v: [f64; 2], a: [f64; 2], h: f64) -> Series {
    let mut series = ZERO;
    (series[0], series[1], series[2]) = (x[0], v[0], 0.5 * a[0]);
    let rise = x[1] - x[0] - h * (v[0] + 0.5 * h * a[0]);
    let slope = h * (v[1] - v[0] - h * a[0]);
    let curvature = h * h * (a[1] - a[0]);
    series[3] = (10.0 * rise - 4.0 * slope + 0.5 * curvature) / (h * h * h);
    series[4] = (-15.0 * rise + 7.0 * slope - curvature) / (h * h * h * h);
    series[5] = (6.0 * rise - 3.0 * slope + 0.5 * curvature) / (h * h * h * h * h);
    series
}

/// Its derivative.
fn slope(x: [f64; 2], v: [f64; 2], a: [f64; 2], h: f64) -> Series {
    crate::series::derivative(&hermite(x, v, a, h))
}

/// The cubic through values and slopes at 0 and `h`.
fn cubic(w: [f64; 2], rate: [f64; 2], h: f64) -> Series {
    let mut series = ZERO;
    (series[0], series[1]) = (w[0], rate[0]);
    let rise = w[1] - w[0] - h * rate[0];
    let slope = h * (rate[1] - rate[0]);
    series[2] = (3.0 * rise - slope) / (h * h);
    series[3] = (slope - 2.0 * rise) / (h * h * h);
    series
}
