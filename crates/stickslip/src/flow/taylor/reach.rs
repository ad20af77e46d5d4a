//! How far a step goes: where the polynomials are good to rounding, and smooth laws agree with their series.

use super::{ForceLine, Frame, Motion};
use crate::elementary::{exp, ln, power};
use crate::law::{Friction, Law, Piece};
use crate::series::{at, curvature_bound, free_time, slope_at};

/// The last terms of a step may be this large compared with the motion.
const NEGLIGIBLE_TERM: f64 = 5e-17;
/// The longest step, in units of 1/L.
const LONGEST_STEP: f64 = 4.0;

/// From this power on nothing is left of a motion under constant forces alone.
const CONSTANT_FORCE_POWER: usize = 3;
/// The least number.
const LEAST_NUMBER: f64 = f64::from_bits(1);

/// At the end of a step a smooth law and its series may differ by as much as changes the speed by this share.
const SERIES_AGREES: f64 = 1e-14;
/// They are compared at so many slip speeds along a step at the most.
const MOST_COMPARISONS: u32 = 10_000;

impl Motion {
    /// Whether all numbers it is made of are in the range of double precision: the last coefficients are the largest.
    pub(crate) fn is_finite(&self, frame: &Frame) -> bool {
        let last = self.x.of(frame.order).iter().chain(self.v.of(frame.order));
        last.sum::<f64>().is_finite()
    }

    /// The size of the coefficients `k`, as a velocity.
    pub(crate) fn size(&self, rate: f64, k: usize) -> f64 {
        let sizes = self.x.of(k).iter().zip(self.v.of(k));
        sizes.fold(0.0, |most: f64, (x, v)| most.max(rate * x.abs()).max(v.abs()))
    }

    /// L without friction.
    pub(crate) fn rate(&self, frame: &Frame) -> f64 {
        self.slow.map_or(frame.rate, |pace| pace.rate)
    }

    /// L of the motion at the start, friction included.
    fn pace(&self, frame: &Frame, force_lines: &[ForceLine]) -> f64 {
        let mut rate = self.rate(frame);
        let share = self.slow.map_or(1.0, |pace| pace.share);
        for (c, force_line) in force_lines.iter().enumerate() {
            if force_line.slips() {
                let slope = self.slope(frame, c, force_line).abs() * frame.coupling(c, c);
                rate += share * slope * self.pressure(frame, c);
                if let Some(normal) = &frame.normals[c] {
                    let varies = normal.position.abs() / frame.rate + normal.velocity.abs();
                    rate += varies * self.friction[c][0].abs() * frame.coupling(c, c);
                }
            }
        }
        for (s, spring) in frame.springs.iter().enumerate() {
            let slope = 3.0 * spring.cubic.abs() * self.displacement[s][0] * self.displacement[s][0];
            rate += (slope * frame.inverse.at(spring.mass, spring.mass)).sqrt();
        }
        rate
    }

    /// The slope of friction over the slip speed at the start, under the normal force of the law.
    fn slope(&self, frame: &Frame, c: usize, force_line: &ForceLine) -> f64 {
        if !frame.is_smooth(c, force_line.direction) {
            return force_line.slope;
        }
        let along = if frame.normals[c].is_some() {
            self.friction[c][1]
        } else {
            self.force.of(1)[c]
        };
        let slope = along / self.u.of(1)[c];
        // Where the slip speed stays what it is, nothing is made of it.
        if slope.is_finite() { slope } else { 0.0 }
    }

    /// The speed at the start, or that which the acceleration gives before friction and springs have taken it away.
    pub(crate) fn speed(&self, frame: &Frame, force_lines: &[ForceLine]) -> f64 {
        let pace = self.pace(frame, force_lines);
        self.size(pace, 1) / pace
    }

    /// How far the polynomials are good to rounding, for a motion of size `scale`.
    pub(crate) fn reach(&self, frame: &Frame, force_lines: &[ForceLine], scale: f64) -> f64 {
        let mut rate = self.pace(frame, force_lines);
        let bound = NEGLIGIBLE_TERM * scale;
        let order = frame.order;
        let mut sizes = [order, order - 1].map(|k| (k, self.size(self.rate(frame), k)));
        if sizes.iter().any(|(_, size)| *size == 0.0) {
            if (CONSTANT_FORCE_POWER..=order).all(|k| self.size(self.rate(frame), k) == 0.0) {
                // The series has come to its end, as that of a mass on a constant drive: only waves go on.
                rate = frame.fastest;
            } else if bound >= f64::MIN_POSITIVE {
                // In units in which the motion takes very long they are too small for a number, and no smaller than that.
                sizes = sizes.map(|(k, size)| (k, size.max(LEAST_NUMBER)));
            }
        }
        let exponents = sizes.map(|(k, size)| ln(bound / size) * (1.0 / k as f64));
        let mut shortest = exp(exponents[0].min(exponents[1])).min(LONGEST_STEP / rate);
        let mut held = [order - 2, order - 1].map(|k| (k, f64::INFINITY));
        for (c, force_line) in force_lines.iter().enumerate() {
            if let Some(normal) = &frame.normals[c] {
                // It may vary while the masses do not.
                let across = |of: &[f64]| frame.across(c, |i| of[i]);
                let size = normal.size(across(self.x.of(0)), across(self.v.of(0)));
                for k in [order - 1, order] {
                    let share = NEGLIGIBLE_TERM * size / self.normal[c][k].abs();
                    shortest = shortest.min(power(share, 1.0 / k as f64));
                }
            }
            // What holds a stuck contact may vary while the masses do not.
            if force_line.direction == 0.0 || force_line.holds() {
                let share = self.rate(frame) * bound / frame.coupling(c, c);
                for (k, least) in &mut held {
                    *least = least.min(share / self.force.of(*k)[c].abs());
                }
            } else if !frame.drives[c].harmonics.is_empty() {
                // A drive may vary while the mass below it does not.
                for k in [order - 1, order] {
                    shortest = shortest.min(power(bound / self.u.of(k)[c].abs(), 1.0 / k as f64));
                }
            }
        }
        // The smallest of the roots is that of the smallest share.
        let held = held.into_iter().filter(|(_, least)| least.is_finite());
        held.fold(shortest, |shortest, (k, least)| {
            shortest.min(power(least, 1.0 / k as f64))
        })
    }

    /// The longest part of `step` on which every smooth law agrees with its series, as long as its slip lasts. What grows
    /// only beyond the last coefficient is seen nowhere else: the exponential of a speed that has just begun to fall, or a
    /// Gaussian that had died out and comes back.
    pub(crate) fn agreed(
        &self,
        frame: &Frame,
        laws: &[&Law],
        force_lines: &[ForceLine],
        scale: f64,
        mut step: f64,
    ) -> f64 {
        for (s, spring) in frame
            .springs
            .iter()
            .enumerate()
            .filter(|(_, spring)| spring.cubic != 0.0)
        {
            let bound = SERIES_AGREES * scale / frame.inverse.at(spring.mass, spring.mass);
            let agrees = |t: f64| {
                let pull = spring.force(self.pieces[s], at(&self.displacement[s], t));
                t * (at(&self.pull[s], t) - pull).abs() <= bound
            };
            let shorter = (0..60).map(|halvings| step * power(0.5, f64::from(halvings)));
            step = shorter.clone().find(|&t| agrees(t)).unwrap_or(0.0);
        }
        for (c, force_line) in force_lines.iter().enumerate() {
            let (smooth, loaded) = (
                frame.is_smooth(c, force_line.direction),
                frame.normals[c].is_some(),
            );
            if !(smooth || loaded) || !force_line.slips() {
                continue;
            }
            let law = laws[c].toward(force_line.direction);
            let room = |speed: f64| law.resolution(speed).filter(|_| smooth).unwrap_or(f64::INFINITY);
            let bound = SERIES_AGREES * scale / frame.coupling(c, c);
            let (u, force) = (self.u.series(c), self.force.series(c));
            let agrees = |t: f64, speed: f64| {
                let line = Piece {
                    slope: force_line.slope,
                    ..Piece::constant(force_line.offset)
                };
                let friction = force_line.direction * law.force(&line, speed);
                let normal = if loaded { at(&self.normal[c], t) } else { 1.0 };
                t * (at(&force, t) - normal * friction).abs() <= bound
            };
            let curvature = curvature_bound(&u, step);
            let (mut t, mut speed, mut slope) = (0.0, u[0], u[1]);
            // Slip that begins may do so below zero, by rounding.
            let mut begun = false;
            for round in 0..=MOST_COMPARISONS {
                if !(t < step && (speed >= 0.0 || !begun)) {
                    break;
                }
                begun |= speed > 0.0;
                if round == MOST_COMPARISONS {
                    // So far they agree.
                    step = t;
                    break;
                }
                // An infinite one is no limit: `min` passes over what is not a number.
                let free = free_time(room(speed), -slope.abs(), curvature);
                let next = (t + free).min(step);
                (speed, slope) = slope_at(&u, next);
                if !agrees(next, speed) {
                    step = (1..60)
                        .map(|halvings| t + (next - t) * power(0.5, f64::from(halvings)))
                        .find(|&t| agrees(t, at(&u, t)))
                        .unwrap_or(t);
                    break;
                }
                t = next;
            }
        }
        step
    }

    /// How much more friction there is than by the law, at the start.
    fn pressure(&self, frame: &Frame, c: usize) -> f64 {
        if frame.normals[c].is_some() {
            self.normal[c][0].abs()
        } else {
            1.0
        }
    }
}
