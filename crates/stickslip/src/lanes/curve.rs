//! Slip along a smooth curve of friction: its numbers in lanes, and its Taylor series.
//!
//! Time counts in units of the shortest time in which the motion changes, 1/rate, so that no coefficient leaves the numbers.

use stickslip_lanes::Lane;

use super::elementary::exp;
use super::lane_oscillator::{Constants, lanes};
use crate::law::{Curve, Fall, Friction};
use crate::oscillator::Oscillator;
use crate::series::INVERSE;

/// The highest power of a step.
pub(super) const CURVE_ORDER: usize = 28;
/// Its coefficients.
pub(super) type LaneSeries<L> = [L; CURVE_ORDER + 1];

lanes! {
    /// What stays the same in slip along a curve, beside [`Constants`].
    CurveNumbers {
        /// The polynomial, the size of the part that falls, over which slip speed, and one over that.
        p0, p1, p2, p3, fall, scale, per_scale,
        /// The time unit, its reciprocal, and times the former: 1/m, D/m and k/m.
        unit, rate, per_mass, damper, natural_squared,
        /// The forcing frequency times the time unit, squared.
        frequency_squared,
        /// Ω times the time unit.
        frequency,
    }
}

impl CurveNumbers<f64> {
    pub(super) fn of(oscillator: &Oscillator, constants: &Constants<f64>, curve: &Curve) -> Self {
        let [p0, p1, p2, p3] = curve.polynomial;
        let scale = match curve.fall {
            Fall::Nothing => 1.0,
            Fall::Rational => 1.0 / curve.constant,
            _ => curve.constant,
        };
        let (m, forced) = (oscillator.mass, constants.force > 0.0);
        let natural = constants.natural_squared.sqrt() + oscillator.damping / m;
        let rate = if forced {
            natural.max(constants.frequency)
        } else {
            natural
        };
        let unit = 1.0 / rate;
        let frequency = constants.frequency * unit;
        Self {
            p0,
            p1,
            p2,
            p3,
            fall: curve.size,
            scale,
            per_scale: 1.0 / scale,
            unit,
            rate,
            per_mass: unit / m,
            damper: unit * oscillator.damping / m,
            natural_squared: unit * constants.natural_squared,
            frequency_squared: frequency * frequency,
            frequency,
        }
    }
}

/// Where a step starts: position, slip speed, the sign of w, cos and sin of the force.
pub(super) struct StepStart<L: Lane> {
    pub(super) x: L,
    pub(super) u: L,
    pub(super) direction: L,
    pub(super) cos: L,
    pub(super) sin: L,
    /// Lanes whose slip speed starts without a slope.
    pub(super) flat: L::Mask,
}

/// A motion along a step: position, slip speed and friction, in powers of time over the unit.
pub(super) struct Expansion<L> {
    pub(super) x: LaneSeries<L>,
    pub(super) u: LaneSeries<L>,
    pub(super) force: LaneSeries<L>,
}

/// Σ a_j b_{k−j} for j from `from` to k, in four sums, as one would wait for each of its terms.
#[inline(always)]
fn convolve<L: Lane>(a: &LaneSeries<L>, b: &LaneSeries<L>, from: usize, k: usize) -> L {
    let mut sums = [L::splat(0.0); 4];
    let mut forward = a[from..=k].chunks_exact(4);
    let mut backward = b[..=k - from].rchunks_exact(4);
    for (a, b) in forward.by_ref().zip(backward.by_ref()) {
        for (lane, sum) in sums.iter_mut().enumerate() {
            *sum = *sum + a[lane] * b[3 - lane];
        }
    }
    let rest = forward.remainder().iter().zip(backward.remainder().iter().rev());
    for ((a, b), sum) in rest.zip(&mut sums) {
        *sum = *sum + *a * *b;
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

/// Σ term hⁱ for i < [`CURVE_ORDER`], in four sums side by side. No function of a function, which a compiler might leave out of
/// the code for the width.
macro_rules! in_fours {
    ($h:expr, $i:ident => $term:expr) => {{
        const { assert!(CURVE_ORDER.is_multiple_of(4)) }
        let h = $h;
        let square = h * h;
        let step = square * square;
        let mut sums = [L::splat(0.0); 4];
        let mut first = CURVE_ORDER;
        while first > 0 {
            first -= 4;
            for (lane, sum) in sums.iter_mut().enumerate() {
                let $i = first + lane;
                *sum = *sum * step + $term;
            }
        }
        (sums[0] + h * sums[1]) + square * (sums[2] + h * sums[3])
    }};
}
pub(super) use in_fours;

/// What of a curve is the same in all lanes, so that it need not be chosen in each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Form {
    fall: Fall,
    /// Whether there is one with u² or u³.
    bends: bool,
}

impl Form {
    /// None of an oscillator whose law is not smooth, or of no form known here.
    pub(super) fn of(oscillator: &Oscillator) -> Option<Self> {
        let curve = oscillator.law.curve()?;
        Some(Self {
            fall: curve.fall,
            bends: curve.polynomial[2..] != [0.0; 2],
        })
    }

    fn falls(self) -> bool {
        self.fall != Fall::Nothing
    }

    fn is_exponential(self) -> bool {
        matches!(self.fall, Fall::Exponential | Fall::Gaussian)
    }

    /// F at slip speed `u`.
    #[inline(always)]
    pub(super) fn force<L: Lane>(self, numbers: &CurveNumbers<L>, u: L) -> L {
        let mut force = numbers.p1 + u * (numbers.p2 + u * numbers.p3);
        force = numbers.p0 + u * force;
        if self.falls() {
            force = force + numbers.fall * self.fallen(self.argument(numbers, u));
        }
        force
    }

    /// y or y² of [`Fall`].
    #[inline(always)]
    fn argument<L: Lane>(self, numbers: &CurveNumbers<L>, u: L) -> L {
        let y = u * numbers.per_scale;
        if self.fall.squares() { y * y } else { y }
    }

    /// g by its argument.
    #[inline(always)]
    fn fallen<L: Lane>(self, argument: L) -> L {
        let n = L::splat;
        if self.is_exponential() {
            exp((-argument).max(n(-700.0)).min(n(700.0)))
        } else {
            n(1.0) / (n(1.0) + argument)
        }
    }

    /// How far the slip speed may move from `u` without passing over a feature of the force that its values at both ends do not
    /// show ([`crate::law::Friction::resolution`]).
    #[inline(always)]
    pub(super) fn resolution<L: Lane>(self, numbers: &CurveNumbers<L>, u: L) -> L {
        let (n, scale) = (L::splat, numbers.scale);
        match self.fall {
            Fall::Nothing => n(f64::INFINITY),
            Fall::Rational => n(0.5) * (u.abs() + scale),
            Fall::Lorentzian => n(0.5) * (u * u + scale * scale).sqrt(),
            Fall::Exponential => (u.abs() - n(36.0) * scale).max(scale),
            Fall::Gaussian => (u.abs() - n(6.0) * scale).max(scale),
        }
    }

    /// The Taylor series from a start.
    #[inline(always)]
    pub(super) fn expand<L: Lane>(
        self,
        c: &Constants<L>,
        numbers: &CurveNumbers<L>,
        start: &StepStart<L>,
    ) -> Expansion<L> {
        let (n, zero) = (L::splat, L::splat(0.0));
        let nothing = [zero; CURVE_ORDER + 1];
        let (mut x, mut u, mut force) = (nothing, nothing, nothing);
        // u², its share in the argument of g, that weighted by its power, and g.
        let (mut square, mut argument, mut weighted, mut fallen) = (nothing, nothing, nothing, nothing);
        let mut cube = zero;
        let sign = start.direction;
        (x[0], u[0]) = (start.x, start.u);
        let wave = c.force * numbers.per_mass;
        let mut input = [wave * start.cos, -(wave * numbers.frequency * start.sin)];
        let pull = sign * numbers.per_mass;
        for k in 0..CURVE_ORDER {
            if self.fall.squares() || self.bends {
                square[k] = convolve(&u, &u, 0, k);
            }
            if self.bends {
                cube = convolve(&square, &u, 0, k);
            }
            if self.falls() {
                argument[k] = if self.fall.squares() {
                    numbers.per_scale * numbers.per_scale * square[k]
                } else {
                    numbers.per_scale * u[k]
                };
                fallen[k] = if k == 0 {
                    self.fallen(self.argument(numbers, u[0]))
                } else if self.is_exponential() {
                    weighted[k] = n(k as f64) * argument[k];
                    -(convolve(&weighted, &fallen, 1, k) * n(INVERSE[k]))
                } else {
                    -(fallen[0] * convolve(&argument, &fallen, 1, k))
                };
            }
            let mut size = numbers.p1 * u[k] + numbers.fall * fallen[k];
            if self.bends {
                size = size + numbers.p2 * square[k] + numbers.p3 * cube;
            }
            if k == 0 {
                size = numbers.p0 + size;
            }
            force[k] = size;
            let v = if k == 0 {
                c.drive - sign * u[0]
            } else {
                -(sign * u[k])
            };
            let mut a = input[0] - numbers.natural_squared * x[k] - numbers.damper * v + pull * size;
            if k == 0 {
                a = L::choose(start.flat, zero, a);
            }
            let next = -(numbers.frequency_squared
                * n(INVERSE[k + 1] * if k + 2 <= CURVE_ORDER { INVERSE[k + 2] } else { 0.0 })
                * input[0]);
            input = [input[1], next];
            x[k + 1] = v * numbers.unit * n(INVERSE[k + 1]);
            u[k + 1] = -(sign * a * n(INVERSE[k + 1]));
        }
        Expansion { x, u, force }
    }
}
