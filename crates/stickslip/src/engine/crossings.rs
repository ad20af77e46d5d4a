//! Where a motion in closed form crosses a surface.
//!
//! Samples lie at a constant distance, so what they are made of is multiplied from one to the next, without exponentials or
//! sines on the way. The enclosure of [`crate::flow::enclosure`] says of a cell between two samples that the surface is not
//! met there, or by the slope that it is met once at the most. Doubt halves the cell, and what is in doubt still is marched
//! through, see [`Cut::march`].

use crate::flow::enclosure::{ENCLOSURE_REACH, Span, bounds, larger, reach, sixth_and_seventh};
use crate::flow::exact::{Basis, Signal, Slip};
use crate::lanes::root_of_quintic;
use crate::surface::{Cut, Guard, Point};
use crate::watch::Watched;

/// As a part of the reach of an enclosure, how far samples are apart.
const SAMPLE_SHARE: f64 = 0.65;
/// Samples between two that are evaluated exactly.
const CELLS_BETWEEN_EXACT: u32 = 16;
/// How often a cell is halved.
const MOST_CELL_HALVINGS: u32 = 3;
/// What so many multiplications can leave, in units of what is added up.
const MARCH_ROUNDING: f64 = 64.0 * f64::EPSILON;
/// A step so short, as a part of a cell, leaves an error of its fourth power.
const SHORT_STEP: f64 = 1e-4;
/// Steps to a root, at the most.
const MOST_ROOT_STEPS: u32 = 100;

/// The functions a motion is made of, after a time between two samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stride<const H: usize> {
    h: f64,
    basis: Basis<H>,
}

impl<const H: usize> Stride<H> {
    /// Short enough for whatever moves like this.
    pub(super) fn of(slip: &Slip<H>) -> Self {
        let each = slip.decay.exponents().into_iter().chain(slip.frequency);
        let fastest = each.fold(slip.decay.growing(), f64::max);
        Self::over(slip, SAMPLE_SHARE * ENCLOSURE_REACH / fastest)
    }

    fn over(slip: &Slip<H>, h: f64) -> Self {
        let basis = slip.basis(h);
        Self { h, basis }
    }
}

/// What crosses zero.
pub(super) struct Crossings<'a, const H: usize> {
    slip: &'a Slip<H>,
    /// It and its first three derivatives.
    signals: [Signal<H>; 4],
    exponents: [f64; 2],
    /// Sixth and seventh power of them.
    powers: [[f64; 2]; 2],
    /// Bounds of the harmonics.
    waves: [f64; 3],
    /// The size of what does not vary.
    constant: f64,
}

/// The value and its first three derivatives at one time.
#[derive(Clone, Copy)]
struct Sample {
    t: f64,
    d: [f64; 4],
    /// Bounds of the varying part, and of the sixth and seventh derivative.
    bound: [f64; 3],
}

/// So many surfaces are looked for at once, at the most.
const MOST_CUTS: usize = 2;

/// Who receives the crossings.
struct Receiver<'a, 'w> {
    watched: &'a mut Watched<'w>,
    /// The point at a time, of a position and a velocity.
    point: &'a dyn Fn(f64, [f64; 2]) -> Point,
    found: &'a mut dyn FnMut(Point),
}

/// A root, as a short step from a time at which the motion is known.
struct Root<const H: usize> {
    t: f64,
    basis: Basis<H>,
    step: f64,
}

/// Tell of every crossing of some surfaces from one time to another, all of them seen at the same samples.
pub(super) fn between<const H: usize>(
    slip: &Slip<H>,
    cuts: &mut [&mut Cut],
    (from, to): (f64, f64),
    usual: &Stride<H>,
    watched: &mut Watched,
    point: &dyn Fn(f64, [f64; 2]) -> Point,
    found: &mut dyn FnMut(usize, Point),
) {
    let last = cuts.len() - 1;
    let crossings: [_; MOST_CUTS] = std::array::from_fn(|which| Crossings::new(slip, cuts[which.min(last)]));
    let mut t = from;
    while t < to {
        let mut basis = slip.basis(t);
        let mut left = crossings.each_ref().map(|crossings| crossings.sample(t, &basis));
        // What grows does so by a factor of e in a cell, at the most.
        let reaches = left.iter().map(|left| reach(left.bound[0], left.bound[1]));
        let reach = reaches.fold(1.0 / slip.decay.growing(), f64::min);
        let h = (SAMPLE_SHARE * reach).min(to - t).max(4.0 * f64::EPSILON * t);
        let own = (h > 2.0 * usual.h).then(|| Stride::over(slip, h));
        let Stride { h, basis: step } = own.as_ref().unwrap_or(usual);
        for _ in 0..CELLS_BETWEEN_EXACT {
            if watched.ends(t) {
                return;
            }
            basis = basis.after(step, &slip.decay);
            for which in 0..=last {
                let right = crossings[which].sample(t + h, &basis);
                let mut receiver = Receiver {
                    watched,
                    point,
                    found: &mut |point| found(which, point),
                };
                crossings[which].cell(
                    cuts[which],
                    (&left[which], &right),
                    to,
                    MOST_CELL_HALVINGS,
                    &mut receiver,
                );
                left[which] = right;
            }
            t += h;
            if t >= to {
                return;
            }
        }
    }
}

impl<'a, const H: usize> Crossings<'a, H> {
    /// Of n·(x, ẋ, ẍ, ẇ) − c.
    pub(super) fn new(slip: &'a Slip<H>, cut: &Cut) -> Self {
        let derivative = |of: &Signal<H>| of.derivative(&slip.decay, &slip.frequency);
        let a = derivative(&slip.v);
        let (x, v) = (&slip.x, &slip.v);
        let [along_x, along_v, along_a, along_slip] = cut.normal;
        let normal = [along_x, along_v, along_a - along_slip];
        let sum = |parts: [f64; 3]| normal[0] * parts[0] + normal[1] * parts[1] + normal[2] * parts[2];
        let signal = Signal {
            constant: sum([x.constant, v.constant, a.constant]) - cut.level,
            free: std::array::from_fn(|j| sum([x.free[j], v.free[j], a.free[j]])),
            p: std::array::from_fn(|j| sum([x.p[j], v.p[j], a.p[j]])),
            q: std::array::from_fn(|j| sum([x.q[j], v.q[j], a.q[j]])),
        };
        let first = derivative(&signal);
        let second = derivative(&first);
        let exponents = slip.decay.exponents();
        Self {
            slip,
            signals: [signal, first, second, derivative(&second)],
            exponents,
            powers: exponents.map(sixth_and_seventh),
            waves: bounds(&signal.p, &signal.q, &slip.frequency),
            constant: signal.constant.abs() + cut.level.abs(),
        }
    }

    /// What [`Cut::march`] asks of a time: the bound of the curvature holds for `reach`, as the free motion decays.
    fn guard(&self, t: f64, reach: f64) -> Guard {
        let Self { slip, signals, .. } = self;
        let basis = slip.basis(t);
        let [value, rate, ..] = signals;
        let amplitudes = slip.decay.amplitudes(value.free(&basis), rate.free(&basis));
        let growth = slip.decay.growth(reach);
        let (mut curvature, mut size) = (0.0, self.constant + self.waves[0]);
        for j in 0..H {
            let amplitude = value.p[j].abs() + value.q[j].abs();
            curvature += slip.frequency[j] * slip.frequency[j] * amplitude;
        }
        for (amplitude, exponent) in amplitudes.into_iter().zip(self.exponents) {
            curvature += growth * amplitude * exponent * exponent;
            size += amplitude;
        }
        Guard {
            value: value.at(&basis),
            rate: rate.at(&basis),
            curvature,
            noise: 4.0 * f64::EPSILON * size,
            reach,
        }
    }

    /// It and its first three derivatives, term by term: a compiler for size makes a call of every closure.
    #[inline]
    fn values(&self, basis: &Basis<H>) -> [f64; 4] {
        let [value, rate, second, third] = &self.signals;
        [value.at(basis), rate.at(basis), second.at(basis), third.at(basis)]
    }

    #[inline]
    fn sample(&self, t: f64, basis: &Basis<H>) -> Sample {
        let [value, rate, ..] = &self.signals;
        let amplitudes = self.slip.decay.amplitudes(value.free(basis), rate.free(basis));
        let mut bound = self.waves;
        for (amplitude, [sixth, seventh]) in amplitudes.into_iter().zip(self.powers) {
            bound[0] += amplitude;
            bound[1] += amplitude * sixth;
            bound[2] += amplitude * seventh;
        }
        Sample {
            t,
            d: self.values(basis),
            bound,
        }
    }

    fn exact(&self, t: f64) -> Sample {
        self.sample(t, &self.slip.basis(t))
    }

    /// Position and velocity at a time.
    fn state(&self, t: f64) -> [f64; 2] {
        let basis = self.slip.basis(t);
        [self.slip.position(t, &basis), self.slip.v.at(&basis)]
    }

    /// The same at a root.
    fn state_at(&self, &Root { t, ref basis, step }: &Root<H>) -> [f64; 2] {
        let Slip {
            v, decay, frequency, ..
        } = self.slip;
        let a = v.derivative(decay, frequency);
        let jerk = a.derivative(decay, frequency);
        let snap = jerk.derivative(decay, frequency).at(basis);
        let [v, a, jerk] = [v, &a, &jerk].map(|signal| signal.at(basis));
        let x = self.slip.position(t, basis);
        let by = |of: [f64; 4]| of[0] + step * (of[1] + step * (0.5 * of[2] + step * (1.0 / 6.0) * of[3]));
        [by([x, v, a, jerk]), by([v, a, jerk, snap])]
    }

    /// How large the value may be by rounding between two samples.
    fn noise(&self, left: &Sample, right: &Sample) -> f64 {
        MARCH_ROUNDING * (self.constant + larger(left.bound[0], right.bound[0]))
    }

    /// Tell of the crossings between two samples; those after `to` do not count.
    #[inline]
    fn cell(
        &self,
        cut: &mut Cut,
        (left, right): (&Sample, &Sample),
        to: f64,
        halvings: u32,
        receiver: &mut Receiver,
    ) {
        let (noise, sign) = (self.noise(left, right), left.d[0].signum());
        if least(left, right, 0, sign) > noise {
            let point = || (receiver.point)(left.t, self.state(left.t));
            cut.see(sign, point, &mut receiver.found);
        } else {
            self.near(cut, (left, right), to, halvings, receiver);
        }
    }

    /// The same where the surface may be met.
    fn near(
        &self,
        cut: &mut Cut,
        (left, right): (&Sample, &Sample),
        to: f64,
        halvings: u32,
        receiver: &mut Receiver,
    ) {
        let noise = self.noise(left, right);
        let ([begin, ..], [end, ..]) = (left.d, right.d);
        let (starts, ends) = (begin.abs() > noise, end.abs() > noise);
        let fastest = larger(left.bound[2], right.bound[2]) / larger(left.bound[1], right.bound[1]);
        if (starts || ends) && least(left, right, 1, (end - begin).signum()) > noise * fastest {
            // It is met once at the most.
            let at_left = || (receiver.point)(left.t, self.state(left.t));
            if starts {
                cut.see(begin.signum(), at_left, &mut receiver.found);
            }
            if ends && end.signum() != cut.side() {
                if !starts {
                    if left.t <= to {
                        cut.see(end.signum(), at_left, &mut receiver.found);
                    }
                    return;
                }
                let root = self.root(left, right);
                let t = root.t + root.step;
                if t <= to {
                    let point = || (receiver.point)(t, self.state_at(&root));
                    cut.see(end.signum(), point, &mut receiver.found);
                }
            }
        } else if right.t > to {
            self.cell(cut, (left, &self.exact(to)), to, halvings, receiver);
        } else if (starts || ends) && halvings > 0 {
            let middle = self.exact(0.5 * (left.t + right.t));
            self.cell(cut, (left, &middle), to, halvings - 1, receiver);
            self.cell(cut, (&middle, right), to, halvings - 1, receiver);
        } else {
            let unit = self.slip.decay.time();
            let guard = |t| self.guard(t, unit);
            let point = |t| (receiver.point)(t, self.state(t));
            let span = (left.t, right.t);
            cut.march(span, unit, receiver.watched, &guard, &point, &mut receiver.found);
        }
    }

    /// The root between two samples on different sides, where the slope keeps its sign.
    fn root(&self, left: &Sample, right: &Sample) -> Root<H> {
        let (mut low, mut high) = (left.t, right.t);
        let sign = left.d[0].signum();
        let ends = [left, right].map(|sample| [0, 1, 2].map(|n| sign * sample.d[n]));
        let d = right.t - left.t;
        let mut t = left.t + root_of_quintic(ends[0], ends[1], d) * d;
        for _ in 0..MOST_ROOT_STEPS {
            let basis = self.slip.basis(t);
            let [value, slope, curvature, jerk] = self.values(&basis);
            if value.signum() == sign {
                low = t;
            } else {
                high = t;
            }
            // Householder's step of the third order.
            let newton = -value / slope;
            let (bend, third) = (newton * curvature, newton * newton * jerk);
            let step = newton * (slope + 0.5 * bend) / (slope + bend + third * (1.0 / 6.0));
            let next = t + step;
            let inside = low <= next && next <= high;
            if inside && step.abs() <= SHORT_STEP * d {
                return Root { t, basis, step };
            }
            t = if inside { next } else { 0.5 * (low + high) };
        }
        Root {
            t,
            basis: self.slip.basis(t),
            step: 0.0,
        }
    }
}

/// The least coefficient of the enclosure of a derivative, times `sign`.
#[inline]
fn least(left: &Sample, right: &Sample, order: usize, sign: f64) -> f64 {
    let of = |d: &[f64; 4]| {
        [
            sign * d[order & 3],
            sign * d[(order + 1) & 3],
            sign * d[(order + 2) & 3],
        ]
    };
    let bound = larger(left.bound[1 + order], right.bound[1 + order]);
    Span::new(right.t - left.t).least(of(&left.d), of(&right.d), bound)
}

#[cfg(test)]
mod tests {
    use super::{Crossings, Stride, between};
    use crate::clock::Clock;
    use crate::event::Work;
    use crate::flow::exact::Frame;
    use crate::harmonic::Harmonic;
    use crate::law::Piece;
    use crate::surface::{Cut, Point};
    use crate::watch::Watched;

    /// Slips that oscillate, creep and grow, free and forced: the crossings are those of the march alone.
    #[test]
    fn none_is_missed() {
        let mut total = 0;
        for case in 0..600 {
            let part = |n: u32| f64::from(case * n % 97) / 97.0;
            let frame = Frame::<1> {
                mass: 1.0,
                stiffness: 1.3,
                damping: [0.0, 0.1, 2.2, 2.0 * 1.3_f64.sqrt(), 40.0, -0.1][case as usize % 6],
                drive_velocity: 0.3,
                constant: 0.0,
                forcing: [Harmonic::new(
                    [0.0, 0.4, 1e-9][case as usize % 3],
                    [0.2, 1.7, 30.0][case as usize / 3 % 3],
                    part(3),
                )],
            };
            let piece = Piece::line([0.0, 0.5], 0.0, 0.0, f64::INFINITY, 0);
            let slip = frame.closed(Clock::default(), 2.0 * part(5) - 1.0, part(7) - 0.5, 1.0, &piece);
            let normals = [[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], [1.0, -0.3, 0.2, 0.0]];
            for normal in normals {
                let mut cut = Cut::new(normal, 0.1 * part(11) * normal[0], 0);
                let mut marched_cut = cut;
                let crossings = Crossings::new(&slip, &cut);
                let (mut found, mut marched) = (Vec::new(), Vec::new());
                let (mut work, mut go_on) = (Work::default(), || true);
                let watched = &mut Watched::new(&mut work, &mut go_on);
                let point = |t, [x, v]: [f64; 2]| Point { t, x, v, w: 0.3 - v };
                let (span, unit) = ((part(13), 30.0 + part(17)), slip.decay.time());
                let guard = |t| crossings.guard(t, unit);
                let exact = |t| point(t, crossings.state(t));
                marched_cut.march(span, unit, watched, &guard, &exact, &mut |point| {
                    marched.push(point.t);
                });
                let mut found_one = |_, point: Point| {
                    let off = exact(point.t);
                    let least = [point.x - off.x, point.v - off.v];
                    assert!(
                        least.iter().all(|off| off.abs() < 1e-13),
                        "{case} {normal:?}: {least:?}"
                    );
                    found.push(point.t);
                };
                between(
                    &slip,
                    &mut [&mut cut],
                    span,
                    &Stride::of(&slip),
                    watched,
                    &point,
                    &mut found_one,
                );
                assert_eq!(
                    found.len(),
                    marched.len(),
                    "{case} {normal:?}: {found:?} {marched:?}"
                );
                let near = found
                    .iter()
                    .zip(&marched)
                    .all(|(one, other)| (one - other).abs() < 1e-7);
                assert!(near, "{case} {normal:?}: {found:?} {marched:?}");
                total += found.len();
            }
        }
        assert!(total > 5000, "{total}");
    }
}
