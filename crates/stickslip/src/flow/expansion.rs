//! The slip speed expanded about one time: between two evaluations of the closed form the search for events moves on a
//! polynomial, whose distance from the truth is bounded.
//!
//! The free part obeys h″ = −2γ h′ − (k/m) h and a harmonic h″ = −Ω² h, so every derivative follows from two without another
//! exponential or sine; and each derivative is bounded by Σ |amplitude| |exponent|ⁿ.

use super::exact::{Basis, Decay, Signal};

/// Degree of the polynomial.
const DEGREE: usize = 12;

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
        // Σ amplitude · |exponent|ⁿ for n = 0, 2, 3 and 13.
        let mut bound = [0.0; 4];
        let mut add = |(amplitude, exponent): Part, growth: f64| {
            let size = amplitude * growth;
            let square = exponent * exponent;
            bound[0] += size;
            bound[1] += size * square;
            bound[2] += size * square * exponent;
            bound[3] += size * twelfth(exponent) * exponent;
        };
        for part in parts {
            add(part, growth);
        }
        for wave in waves {
            add(wave, 1.0);
        }
        let remainder = bound[3] * INVERSE_FACTORIAL[DEGREE + 1];
        let reach = if parts[1].0 == 0.0 {
            far
        } else {
            // One exponent may be far larger than the other and its part long gone.
            (1e-7 * bound[0] / remainder).powf(1.0 / (DEGREE + 1) as f64)
        };
        let mut coefficient = derivative;
        for n in 0..=DEGREE {
            coefficient[n] *= INVERSE_FACTORIAL[n];
        }
        coefficient[0] += signal.constant;
        Self {
            coefficient,
            bend: bound[1],
            jerk: bound[2],
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

    /// The polynomials of u and u̇ at `h`, and of ü if it is asked for: even and odd powers apart, two short chains
    /// instead of a long one.
    #[inline]
    pub(crate) fn at(&self, h: f64, second: bool) -> (f64, f64, f64) {
        const PAIRS: usize = DEGREE / 2;
        let c = &self.coefficient;
        let z = h * h;
        let (mut even, mut even_slope, mut odd, mut odd_slope) = (c[DEGREE], 0.0, 0.0, 0.0);
        for k in (0..PAIRS).rev() {
            even_slope = even_slope * z + even;
            even = even * z + c[2 * k];
            odd_slope = odd_slope * z + odd;
            odd = odd * z + c[2 * k + 1];
        }
        let slope = 2.0 * h * even_slope + odd + 2.0 * z * odd_slope;
        let mut curve = 0.0;
        if second {
            let (mut even, mut odd) = (c[DEGREE] * (DEGREE * (DEGREE - 1)) as f64, 0.0);
            for k in (1..PAIRS).rev() {
                even = even * z + c[2 * k] * (2 * k * (2 * k - 1)) as f64;
                odd = odd * z + c[2 * k + 1] * (2 * k * (2 * k + 1)) as f64;
            }
            curve = even + h * odd;
        }
        (even + h * odd, slope, curve)
    }

    /// Bounds of |u − polynomial| and |u̇ − its derivative| up to `h`.
    pub(crate) fn error(&self, h: f64) -> (f64, f64) {
        let power = twelfth(h);
        (
            self.remainder * power * h,
            self.remainder * power * (DEGREE + 1) as f64,
        )
    }
}

/// x¹²
fn twelfth(x: f64) -> f64 {
    let fourth = x * x * (x * x);
    fourth * fourth * fourth
}

#[cfg(test)]
mod tests {
    use super::{DEGREE, Expansion};

    #[test]
    fn polynomial_and_its_derivatives() {
        let coefficient = std::array::from_fn(|n| 1.0 / (n as f64 + 2.0));
        let expansion = Expansion {
            coefficient,
            bend: 0.0,
            jerk: 0.0,
            remainder: 0.0,
            reach: 1.0,
        };
        let h: f64 = 0.7;
        let sum = |term: fn(f64) -> f64, drop: usize| -> f64 {
            (drop..=DEGREE)
                .map(|n| term(n as f64) * coefficient[n] * h.powf((n - drop) as f64))
                .sum()
        };
        let (value, slope, curve) = expansion.at(h, true);
        assert!((value - sum(|_| 1.0, 0)).abs() < 1e-14);
        assert!((slope - sum(|n| n, 1)).abs() < 1e-13);
        assert!((curve - sum(|n| n * (n - 1.0), 2)).abs() < 1e-12);
    }
}
