//! Where a motion in closed form crosses a surface.
//!
//! Samples lie at a constant distance, so the motion is turned from one to the next by the same numbers, without exponentials
//! or sines on the way. Its coefficients from a time on give all derivatives there, so the samples of one surface serve that on
//! which its rate is zero: where x turns, and where the slip velocity does.
//!
//! The enclosure of [`crate::flow::enclosure`] says of a cell between two samples that the surface is not met there, or by the
//! slope that it is met once at the most. Doubt halves the cell, and what is in doubt still is marched through, see
//! [`Cut::march`].

use crate::flow::enclosure::{Span, reach, sixth_and_seventh};
use crate::flow::exact::{Signal, Slip};
use crate::surface::{Cut, Guard, Point};
use crate::watch::Watched;

/// As a part of the reach of an enclosure, how far samples are apart.
const SAMPLE_SHARE: f64 = 0.65;
/// Samples between two that are evaluated exactly.
const CELLS_BETWEEN_EXACT: u32 = 16;
/// What is added to it is rounded to a whole number; the function that rounds up is a call on most processors.
const WHOLE: f64 = 1.5 / f64::EPSILON;
/// How often a cell is halved.
const MOST_CELL_HALVINGS: u32 = 3;
/// What so many multiplications can leave, in units of what is added up.
const MARCH_ROUNDING: f64 = 64.0 * f64::EPSILON;
/// A step so short, as a part of a cell, can be made along a Taylor expansion.
const SHORT_STEP: f64 = 0.01;
/// Steps to a root, at the most.
const MOST_ROOT_STEPS: u32 = 100;

/// What crosses zero: a signal, and its derivative for the second of two cuts.
pub(super) struct Crossings<'a, const H: usize> {
    slip: &'a Slip<H>,
    signal: Signal<H>,
    /// The powers of each exponent, see [`powers`].
    exponents: [[f64; BOUNDS]; 2],
    /// Bounds of the harmonics.
    waves: [f64; BOUNDS],
    /// The size of what does not vary.
    constant: [f64; MOST_CUTS],
}

/// Derivatives of which bounds are known: the signal and the first, and those that are six and seven orders higher.
const BOUNDS: usize = 5;

/// |x| to the power of the order of each of these derivatives.
fn powers(x: f64) -> [f64; BOUNDS] {
    let [sixth, seventh] = sixth_and_seventh(x);
    [1.0, x.abs(), sixth, seventh, sixth * (x * x)]
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

/// Tell of every crossing of some surfaces from one time to another.
pub(super) fn between<const H: usize>(
    slip: &Slip<H>,
    cuts: &mut [&mut Cut],
    span: (f64, f64),
    watched: &mut Watched,
    point: &dyn Fn(f64, [f64; 2]) -> Point,
    found: &mut dyn FnMut(usize, Point),
) {
    if let [one, other] = cuts
        && other.follows(one)
    {
        return along(slip, cuts, span, watched, point, found);
    }
    for (which, cut) in cuts.iter_mut().enumerate() {
        let found = &mut |_, point| found(which, point);
        along(slip, &mut [cut], span, watched, point, found);
    }
}

/// The same of one surface, or of two of which the second is where the rate of the first is zero: both are seen at the same
/// samples.
fn along<const H: usize>(
    slip: &Slip<H>,
    cuts: &mut [&mut Cut],
    (from, to): (f64, f64),
    watched: &mut Watched,
    point: &dyn Fn(f64, [f64; 2]) -> Point,
    found: &mut dyn FnMut(usize, Point),
) {
    let crossings = Crossings::new(slip, cuts[0]);
    let mut t = from;
    while t < to {
        let mut motion = crossings.from(t);
        let mut left = crossings.samples(t, &motion);
        // The same samples for one cut as for two, so that a crossing of one and the same surface has one time.
        let reaches = left.map(|left| reach(left.bound[0], left.bound[1]));
        // What grows does so by a factor of e in a cell, at the most.
        let reach = reaches.into_iter().fold(1.0 / slip.decay.growing(), f64::min);
        let widest = (SAMPLE_SHARE * reach).max(4.0 * f64::EPSILON * t);
        let cells = (((to - t) / widest + 0.5 + WHOLE) - WHOLE).max(1.0);
        let (begin, h) = (t, (to - t) / cells);
        let step = slip.basis(h);
        for cell in 1..=CELLS_BETWEEN_EXACT {
            if watched.ends(t) {
                return;
            }
            let cell = f64::from(cell);
            t = if cell < cells { begin + cell * h } else { to };
            motion = motion.after(&step, &slip.decay);
            let right = crossings.samples(t, &motion);
            for (which, cut) in cuts.iter_mut().enumerate() {
                let mut receiver = Receiver {
                    watched,
                    point,
                    found: &mut |point| found(which, point),
                };
                let ends = (&left[which], &right[which]);
                crossings.cell(cut, which, ends, MOST_CELL_HALVINGS, &mut receiver);
            }
            if t >= to {
                return;
            }
            left = right;
        }
    }
}

impl<'a, const H: usize> Crossings<'a, H> {
    /// Of n·(x, ẋ, ẍ, ẇ) − c.
    pub(super) fn new(slip: &'a Slip<H>, cut: &Cut) -> Self {
        let (x, v, a) = (&slip.x, &slip.v, slip.v.derivative(&slip.decay, &slip.frequency));
        let normal = cut.of_motion();
        let sum = |parts: [f64; 3]| normal[0] * parts[0] + normal[1] * parts[1] + normal[2] * parts[2];
        let signal = Signal {
            constant: sum([x.constant, v.constant, a.constant]) - cut.level,
            free: std::array::from_fn(|j| sum([x.free[j], v.free[j], a.free[j]])),
            p: std::array::from_fn(|j| sum([x.p[j], v.p[j], a.p[j]])),
            q: std::array::from_fn(|j| sum([x.q[j], v.q[j], a.q[j]])),
        };
        let mut waves = [0.0; BOUNDS];
        for j in 0..H {
            let size = signal.p[j].abs() + signal.q[j].abs();
            for (bound, power) in waves.iter_mut().zip(powers(slip.frequency[j])) {
                *bound += size * power;
            }
        }
        Self {
            slip,
            signal,
            exponents: slip.decay.exponents().map(powers),
            waves,
            constant: [signal.constant.abs() + cut.level.abs(), 0.0],
        }
    }

    /// The signal as it goes on from a time.
    fn from(&self, t: f64) -> Signal<H> {
        self.signal.after(&self.slip.basis(t), &self.slip.decay)
    }

    /// What [`Cut::march`] asks of a time: the bound of the curvature holds for `reach`, as the free motion decays.
    fn guard(&self, which: usize, t: f64, reach: f64) -> Guard {
        let decay = &self.slip.decay;
        let motion = self.from(t);
        let d = self.derivatives(&motion);
        let growth = decay.growth(reach);
        let (mut curvature, mut size) = (0.0, self.constant[which] + self.waves[which]);
        let (p, q) = (self.signal.p, self.signal.q);
        for (j, frequency) in self.slip.frequency.into_iter().enumerate() {
            let amplitude = (p[j].abs() + q[j].abs()) * powers(frequency)[which];
            curvature += amplitude * frequency * frequency;
        }
        for (amplitude, powers) in decay.amplitudes_of(motion.free).into_iter().zip(self.exponents) {
            let amplitude = amplitude * powers[which];
            curvature += growth * amplitude * powers[1] * powers[1];
            size += amplitude;
        }
        Guard {
            value: d[which],
            rate: d[which + 1],
            curvature,
            noise: 4.0 * f64::EPSILON * size,
            reach,
        }
    }

    /// All that the samples of both cuts have.
    #[inline]
    fn derivatives(&self, motion: &Signal<H>) -> [f64; 5] {
        motion.derivatives(&self.slip.decay, &self.slip.frequency)
    }

    #[inline]
    fn samples(&self, t: f64, motion: &Signal<H>) -> [Sample; MOST_CUTS] {
        let mut bound = self.waves;
        let amplitudes = self.slip.decay.amplitudes_of(motion.free);
        for (amplitude, powers) in amplitudes.into_iter().zip(self.exponents) {
            for (bound, power) in bound.iter_mut().zip(powers) {
                *bound += amplitude * power;
            }
        }
        let [value, slope, curvature, jerk, snap] = self.derivatives(motion);
        let of = |d, bound| Sample { t, d, bound };
        [
            of([value, slope, curvature, jerk], [bound[0], bound[2], bound[3]]),
            of([slope, curvature, jerk, snap], [bound[1], bound[3], bound[4]]),
        ]
    }

    fn exact(&self, which: usize, t: f64) -> Sample {
        self.samples(t, &self.from(t))[which]
    }

    /// Position and velocity at a time.
    fn state(&self, t: f64) -> [f64; 2] {
        let basis = self.slip.basis(t);
        [self.slip.position(t, &basis), self.slip.v.at(&basis)]
    }

    /// The bounds between two samples: what decays was largest at the left one.
    #[inline]
    fn bound(&self, left: &Sample, right: &Sample) -> [f64; 3] {
        if self.slip.decay.gamma < 0.0 {
            right.bound
        } else {
            left.bound
        }
    }

    /// How large the value may be by rounding where its varying part is no larger than `size`.
    #[inline]
    fn noise(&self, which: usize, size: f64) -> f64 {
        MARCH_ROUNDING * (self.constant[which] + size)
    }

    /// Tell of the crossings between two samples.
    #[inline]
    fn cell(
        &self,
        cut: &mut Cut,
        which: usize,
        (left, right): (&Sample, &Sample),
        halvings: u32,
        receiver: &mut Receiver,
    ) {
        let (bound, sign) = (self.bound(left, right), left.d[0].signum());
        if sign == right.d[0].signum() && least(left, right, 0, sign, bound[1]) > self.noise(which, bound[0])
        {
            let point = || (receiver.point)(left.t, self.state(left.t));
            cut.see(sign, point, &mut receiver.found);
        } else {
            self.near(cut, which, (left, right), halvings, receiver);
        }
    }

    /// The same where the surface may be met.
    fn near(
        &self,
        cut: &mut Cut,
        which: usize,
        (left, right): (&Sample, &Sample),
        halvings: u32,
        receiver: &mut Receiver,
    ) {
        let bound = self.bound(left, right);
        let noise = self.noise(which, bound[0]);
        let ([begin, ..], [end, ..]) = (left.d, right.d);
        let (starts, ends) = (begin.abs() > noise, end.abs() > noise);
        let slope = least(left, right, 1, (end - begin).signum(), bound[2]);
        // As the slope is larger than the value, so is its rounding.
        if (starts || ends) && slope * bound[1] > noise * bound[2] {
            // It is met once at the most.
            let at_left = || (receiver.point)(left.t, self.state(left.t));
            if starts {
                cut.see(begin.signum(), at_left, &mut receiver.found);
            }
            if ends && end.signum() != cut.side() {
                if starts {
                    let (t, state) = self.root(cut, left, right);
                    let point = || (receiver.point)(t, state);
                    cut.see(end.signum(), point, &mut receiver.found);
                } else {
                    cut.see(end.signum(), at_left, &mut receiver.found);
                }
            }
        } else if (starts || ends) && halvings > 0 {
            let middle = self.exact(which, 0.5 * (left.t + right.t));
            self.cell(cut, which, (left, &middle), halvings - 1, receiver);
            self.cell(cut, which, (&middle, right), halvings - 1, receiver);
        } else {
            let unit = self.slip.decay.time();
            let guard = |t| self.guard(which, t, unit);
            let point = |t| (receiver.point)(t, self.state(t));
            let span = (left.t, right.t);
            cut.march(span, unit, receiver.watched, &guard, &point, &mut receiver.found);
        }
    }

    /// The time and the state at the root between two samples on different sides, where the slope keeps its sign.
    fn root(&self, cut: &Cut, left: &Sample, right: &Sample) -> (f64, [f64; 2]) {
        let Slip {
            v, decay, frequency, ..
        } = self.slip;
        let normal = cut.of_motion();
        let along = |[x, v, a]: [f64; 3]| normal[0] * x + normal[1] * v + normal[2] * a;
        let (mut low, mut high) = (left.t, right.t);
        let short = SHORT_STEP * (high - low);
        let within = |t: f64, low: f64, high: f64| {
            if low < t && t < high {
                t
            } else {
                0.5 * (low + high)
            }
        };
        let scale = to_one(left.d[0] - right.d[0]);
        let left_is_nearer = (left.d[0] * right.d[1]).abs() < (right.d[0] * left.d[1]).abs();
        let nearer = if left_is_nearer { left } else { right };
        let mut t = within(nearer.t + householder(nearer.d, scale), low, high);
        for _ in 0..MOST_ROOT_STEPS {
            let basis = self.slip.basis(t);
            let [v, a, jerk, snap, fifth, sixth, seventh] =
                v.after(&basis, decay).derivatives(decay, frequency);
            let x = self.slip.position(t, &basis);
            let value = along([x, v, a]) - cut.level;
            let (slope, curvature) = (along([v, a, jerk]), along([a, jerk, snap]));
            let step = householder([value, slope, curvature, along([jerk, snap, fifth])], scale);
            let next = t + step;
            if low <= next && next <= high && step.abs() <= short {
                // Newton's step along the expansion takes what that leaves.
                let [x, v] = expanded([x, v, a, jerk, snap, fifth, sixth, seventh], step);
                let [a, jerk] = expanded([a, jerk, snap, fifth, sixth, seventh], step);
                let rest = (cut.level - along([x, v, a])) / along([v, a, jerk]);
                return (next + rest, [x + rest * v, v + rest * a]);
            }
            if value.signum() == left.d[0].signum() {
                low = t;
            } else {
                high = t;
            }
            t = within(next, low, high);
        }
        (t, self.state(t))
    }
}

/// Householder's step of the third order to where a function with these derivatives, times `scale`, is zero.
#[inline]
fn householder(d: [f64; 4], scale: f64) -> f64 {
    let [value, slope, curvature, jerk] = d.map(|d| scale * d);
    let (square, bend) = (slope * slope, value * curvature);
    -value * (square - 0.5 * bend) / (slope * (square - bend) + value * value * jerk * (1.0 / 6.0))
}

/// The power of two by which |x| comes to lie between one and two: the cubes of what has nearly died out are numbers then.
#[inline]
fn to_one(x: f64) -> f64 {
    const EXPONENT: u64 = f64::INFINITY.to_bits();
    f64::from_bits((2 * 1.0f64.to_bits()).wrapping_sub(x.to_bits() & EXPONENT))
}

/// Value and slope of a function with these derivatives after a time.
#[inline]
fn expanded<const N: usize>(d: [f64; N], by: f64) -> [f64; 2] {
    let (mut value, mut slope) = (0.0, 0.0);
    for k in (0..N).rev() {
        slope = slope * by + value;
        value = value * by + d[k] * PER_FACTORIAL[k];
    }
    [value, slope]
}

/// 1/k!
const PER_FACTORIAL: [f64; 8] = {
    let mut table = [1.0; 8];
    let mut k = 1;
    while k < table.len() {
        table[k] = table[k - 1] / k as f64;
        k += 1;
    }
    table
};

/// The least coefficient of the enclosure of a derivative, times `sign`.
#[inline]
fn least(left: &Sample, right: &Sample, order: usize, sign: f64, sixth: f64) -> f64 {
    let of = |d: &[f64; 4]| {
        [
            sign * d[order & 3],
            sign * d[(order + 1) & 3],
            sign * d[(order + 2) & 3],
        ]
    };
    Span::new(right.t - left.t).least(of(&left.d), of(&right.d), sixth)
}

#[cfg(test)]
mod tests {
    use super::{Crossings, between};
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
                let guard = |t| crossings.guard(0, t, unit);
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
                between(&slip, &mut [&mut cut], span, watched, &point, &mut found_one);
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
