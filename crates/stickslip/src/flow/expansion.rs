//! The slip speed expanded about one time: between two evaluations of the closed form the search for events moves on a
//! polynomial, whose distance from the truth is bounded.
//!
//! The free part obeys h″ = −2γ h′ − (k/m) h and a harmonic h″ = −Ω² h, so every derivative follows from two without another
//! exponential or sine; and each derivative is bounded by Σ |amplitude| |exponent|ⁿ.

use super::exact::{Basis, Decay, Signal};

/// Degree of the polynomial.
const DEGREE: usize = 12;
/// The power of the first term left out.
const LEFT_OUT: i32 = 13;

/// How far, in units of the smallest time 1/|exponent|, the polynomial is good to 10⁻⁷ of the amplitude: (10⁻⁷ 13!)^(1/13).
const FAR: f64 = 1.64;

/// 1/n!
const INVERSE_FACTORIAL: [f64; DEGREE + 2] = {
    let mut table = [1.0; DEGREE + 2];
    let mut n = 1;
    while n < DEGREE + 2 {
        table[n] = table[n - 1] / n as f64;
        n += 1;
    }
    table
};

/// A polynomial in the time h since the expansion, with bounds of what it leaves out.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Expansion {
    coefficient: [f64; DEGREE + 1],
    /// Bounds of |ü| and |u⃛| for 0 ≤ h ≤ reach.
    pub(crate) bend: f64,
    pub(crate) jerk: f64,
    /// Bound of |u⁽ⁿ⁾|/n! with n = degree + 1, there too.
    remainder: f64,
    /// How far the polynomial is good to 10⁻⁷ of the amplitude.
    pub(crate) reach: f64,
}

/// A part of the motion: its amplitude and the size of its exponent.
type Part = (f64, f64);

impl Expansion {
    /// Of `signal`, whose derivative is `slope`, where `basis` was taken.
    pub(crate) fn new<const H: usize>(
        signal: &Signal<H>,
        slope: &Signal<H>,
        decay: &Decay,
        frequency: &[f64; H],
        basis: &Basis<H>,
    ) -> Self {
        let (value, rate) = (signal.free(basis), slope.free(basis));
        let natural = decay.natural_squared();
        let mut derivative = [0.0; DEGREE + 1];
        (derivative[0], derivative[1]) = (value, rate);
        for n in 2..=DEGREE {
            derivative[n] = -2.0 * decay.gamma * derivative[n - 1] - natural * derivative[n - 2];
        }
        let parts = decay.parts(value, rate);
        let mut fastest = parts[0].1.max(parts[1].1);
        let mut waves = [(0.0, 0.0); H];
        for j in 0..H {
            let (mut even, mut odd) = (signal.wave(j, basis), slope.wave(j, basis));
            let square = frequency[j] * frequency[j];
            for pair in derivative.chunks_mut(2) {
                pair[0] += even;
                even *= -square;
                if let Some(second) = pair.get_mut(1) {
                    *second += odd;
                    odd *= -square;
                }
            }
            let size = (signal.p[j] * signal.p[j] + signal.q[j] * signal.q[j]).sqrt();
            waves[j] = (size, frequency[j]);
            fastest = fastest.max(frequency[j]);
        }
        let far = FAR / fastest;
        // A reach longer than this one is never taken by a motion that grows.
        let growth = decay.growth(far);
        let bound = |power: i32| {
            let sum = |sum: f64, &(amplitude, exponent): &Part| sum + amplitude * exponent.powi(power);
            growth * parts.iter().fold(0.0, sum) + waves.iter().fold(0.0, sum)
        };
        let remainder = bound(LEFT_OUT) * INVERSE_FACTORIAL[DEGREE + 1];
        let reach = if parts[1].0 == 0.0 {
            far
        } else {
            // One exponent may be far larger than the other and its part long gone.
            (1e-7 * bound(0) / remainder).powf(1.0 / f64::from(LEFT_OUT))
        };
        let mut coefficient = derivative;
        for n in 0..=DEGREE {
            coefficient[n] *= INVERSE_FACTORIAL[n];
        }
        coefficient[0] += signal.constant;
        Self {
            coefficient,
            bend: bound(2),
            jerk: bound(3),
            remainder,
            reach,
        }
    }

    /// u, u̇ and ü at h = 0.
    pub(crate) fn start(&self) -> (f64, f64, f64) {
        (
            self.coefficient[0],
            self.coefficient[1],
            2.0 * self.coefficient[2],
        )
    }

    /// The polynomials of u, u̇ and ü at `h`.
    pub(crate) fn at(&self, h: f64) -> (f64, f64, f64) {
        let (mut value, mut slope, mut half_bend) = (self.coefficient[DEGREE], 0.0, 0.0);
        for n in (0..DEGREE).rev() {
            half_bend = half_bend * h + slope;
            slope = slope * h + value;
            value = value * h + self.coefficient[n];
        }
        (value, slope, 2.0 * half_bend)
    }

    /// Bounds of |u − polynomial| and |u̇ − its derivative| up to `h`.
    pub(crate) fn error(&self, h: f64) -> (f64, f64) {
        let power = h.powi(LEFT_OUT - 1);
        (
            self.remainder * power * h,
            self.remainder * power * f64::from(LEFT_OUT),
        )
    }
}
