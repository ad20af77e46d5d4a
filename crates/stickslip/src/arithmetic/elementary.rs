//! Exponential, sine and cosine from additions and multiplications alone: the same bits on every machine, and short enough
//! to be inlined where a motion is evaluated. A library of the platform may choose other instructions on another processor.
//! What is seldom needed comes from the crate `libm`, which is made of the same.
//!
//! Each argument is reduced to a table value and a small rest (Tang, ACM Trans. Math. Softw. 15 (1989) 144), and the rest
//! goes through a Taylor polynomial; the tables are computed in twice the precision when the crate is compiled. Errors stay
//! below an ulp or, for sine and cosine, an ulp of one.

pub use libm::{acos, asinh, atan, atan2, atanh, hypot, log1p as ln_1p, tan, tanh};

/// An unevaluated sum of two doubles.
pub(crate) type Double = (f64, f64);

/// a + b without error (Knuth).
const fn sum(a: f64, b: f64) -> Double {
    let high = a + b;
    let shift = high - a;
    (high, (a - (high - shift)) + (b - shift))
}

/// a · b without error (Dekker, Numer. Math. 18 (1971) 224); for factors of moderate size.
pub(crate) const fn product(a: f64, b: f64) -> Double {
    const fn halves(a: f64) -> Double {
        let shifted = 134_217_729.0 * a;
        let high = shifted - (shifted - a);
        (high, a - high)
    }
    let high = a * b;
    let ((a1, a2), (b1, b2)) = (halves(a), halves(b));
    (high, ((a1 * b1 - high) + a1 * b2 + a2 * b1) + a2 * b2)
}

/// The sum of two unevaluated sums, rounded in its low part alone.
pub(crate) const fn add(a: Double, b: Double) -> Double {
    let (high, low) = sum(a.0, b.0);
    sum(high, low + (a.1 + b.1))
}

const fn multiply(a: Double, b: Double) -> Double {
    let (high, low) = product(a.0, b.0);
    sum(high, low + (a.0 * b.1 + a.1 * b.0))
}

/// a / n.
const fn divide(a: Double, n: f64) -> Double {
    let high = a.0 / n;
    let (back, lost) = product(high, n);
    sum(high, ((a.0 - back) - lost + a.1) / n)
}

/// Σ x^k / k! over the even or odd k, or all of them, with the signs of the trigonometric series or without.
const fn series(x: Double, first: usize, stride: usize, alternating: bool) -> Double {
    let (mut term, mut total): (Double, Double) = ((1.0, 0.0), (0.0, 0.0));
    let mut k = 0;
    while k < 32 {
        if k % stride == first % stride {
            let negative = alternating && (k / 2) % 2 == 1;
            let sign = if negative { -1.0 } else { 1.0 };
            total = add(total, (sign * term.0, sign * term.1));
        }
        k += 1;
        term = divide(multiply(term, x), k as f64);
    }
    total
}

pub(crate) const PI: Double = (std::f64::consts::PI, 1.224_646_799_147_353_2e-16);
pub(crate) const LN_2: Double = (std::f64::consts::LN_2, 2.319_046_813_846_299_6e-17);

/// Steps of the tables: ln 2 and π in so many.
pub(crate) const TABLE_STEPS: usize = 64;

/// 2^(j/64).
pub(crate) const POWERS: [f64; TABLE_STEPS] = {
    let mut table = [1.0; TABLE_STEPS];
    let mut j = 1;
    while j < TABLE_STEPS {
        let x = multiply(LN_2, (j as f64 / TABLE_STEPS as f64, 0.0));
        table[j] = series(x, 0, 1, false).0;
        j += 1;
    }
    table
};

/// sin and cos of jπ/64 over a whole turn; an eighth of it is computed, the rest is symmetry.
pub(crate) const CIRCLE: [Double; 2 * TABLE_STEPS] = {
    let mut table = [(0.0, 1.0); 2 * TABLE_STEPS];
    let mut j = 0;
    while j < 2 * TABLE_STEPS {
        let octant = j % (TABLE_STEPS / 2);
        let folded = if octant > TABLE_STEPS / 4 {
            TABLE_STEPS / 2 - octant
        } else {
            octant
        };
        let x = multiply(PI, (folded as f64 / TABLE_STEPS as f64, 0.0));
        let (sine, cosine) = (series(x, 1, 2, true).0, series(x, 0, 2, true).0);
        let (sine, cosine) = if octant > TABLE_STEPS / 4 {
            (cosine, sine)
        } else {
            (sine, cosine)
        };
        table[j] = match j / (TABLE_STEPS / 2) {
            0 => (sine, cosine),
            1 => (cosine, -sine),
            2 => (-sine, -cosine),
            _ => (-cosine, sine),
        };
        j += 1;
    }
    table
};

/// A double-double over 64 as three doubles, of which the first two have 33 bits: small whole multiples of them are exact.
const fn parts(x: Double) -> [f64; 3] {
    const fn short(x: f64) -> f64 {
        f64::from_bits(x.to_bits() & !((1 << 20) - 1))
    }
    let first = short(x.0);
    let rest = sum(x.0 - first, x.1);
    let second = short(rest.0);
    let third = (rest.0 - second) + rest.1;
    let steps = TABLE_STEPS as f64;
    [first / steps, second / steps, third / steps]
}

pub(crate) const ARCTANGENT: [f64; 3] = parts(PI);
pub(crate) const LOG: [f64; 3] = parts(LN_2);
/// ln 2 as a double of which small multiples are exact, and the rest.
const LOG_2: [f64; 2] = {
    let short = f64::from_bits(LN_2.0.to_bits() & !((1 << 20) - 1));
    [short, (LN_2.0 - short) + LN_2.1]
};

/// Added to a number below 2⁵¹ it leaves the nearest whole number in the low bits.
pub(crate) const ROUND: f64 = 6_755_399_441_055_744.0;

/// x as k steps and a rest; the low bits of the first number are those of k.
#[inline]
fn reduce(x: f64, per_unit: f64, step: &[f64; 3]) -> (u64, f64) {
    let shifted = x * per_unit + ROUND;
    let k = shifted - ROUND;
    (shifted.to_bits(), ((x - k * step[0]) - k * step[1]) - k * step[2])
}

#[expect(clippy::cast_possible_truncation, reason = "only the low bits are wanted")]
fn remainder(bits: u64, n: usize) -> usize {
    bits as usize % n
}

/// eˣ.
#[inline]
pub fn exp(x: f64) -> f64 {
    if x.abs() < 700.0 {
        let (bits, r) = reduce(x, TABLE_STEPS as f64 / LN_2.0, &LOG);
        let power = POWERS[remainder(bits, TABLE_STEPS)].to_bits();
        let scale = f64::from_bits(power.wrapping_add((bits / TABLE_STEPS as u64) << 52));
        let square = r * r;
        let tail = (0.5 + r * (1.0 / 6.0)) + square * (1.0 / 24.0 + r * (1.0 / 120.0));
        scale + scale * (r + square * tail)
    } else if x < -1000.0 {
        0.0
    } else if x > 1000.0 {
        f64::INFINITY
    } else if x.is_nan() {
        x
    } else {
        let half = exp(0.5 * x);
        half * half
    }
}

/// eˣ − 1 without cancellation.
#[inline]
pub fn exp_m1(x: f64) -> f64 {
    if x.abs() < 0.25 {
        let mut total = 0.0;
        for k in (2..=13).rev() {
            total = (total + 1.0) * x / f64::from(k);
        }
        x + x * total
    } else {
        exp(x) - 1.0
    }
}

/// 1/3, 1/5, 1/7 …: divided once, not in every logarithm.
const ODD: [f64; 11] = {
    let mut table = [0.0; 11];
    let mut n = 0;
    while n < table.len() {
        table[n] = 1.0 / (2 * n + 3) as f64;
        n += 1;
    }
    table
};

/// ln x for x > 0, to about an ulp of the larger of it and one.
pub fn ln(x: f64) -> f64 {
    if !(f64::MIN_POSITIVE..f64::INFINITY).contains(&x) {
        return libm::log(x);
    }
    // x = 2^k m with √½ ≤ m < √2, and ln m = 2 artanh((m − 1)/(m + 1)).
    let shifted = x
        .to_bits()
        .wrapping_sub(std::f64::consts::FRAC_1_SQRT_2.to_bits());
    let k = shifted.cast_signed() >> 52;
    let m = f64::from_bits(x.to_bits().wrapping_sub((k << 52).cast_unsigned()));
    let s = (m - 1.0) / (m + 1.0);
    let square = s * s;
    let series = ODD
        .iter()
        .rev()
        .fold(0.0, |series, term| (series + term) * square);
    let k = k as f64;
    (k * LOG_2[0] + 2.0 * s) + (2.0 * s * series + k * LOG_2[1])
}

/// x^n for x ≥ 0; a whole n up to 64 by multiplications alone.
#[inline]
pub fn power(x: f64, n: f64) -> f64 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "other exponents are told from their rounded ones"
    )]
    let mut left = n.clamp(0.0, 64.0) as u32;
    if f64::from(left) != n {
        return exp(n * ln(x));
    }
    let (mut result, mut square) = (1.0, x);
    while left > 1 {
        if left % 2 == 1 {
            result *= square;
        }
        square *= square;
        left /= 2;
    }
    if left == 1 { result * square } else { result }
}

/// sin x and cos x.
#[inline]
pub fn sin_cos(x: f64) -> (f64, f64) {
    if x.abs() < 40_000.0 {
        let (bits, r) = reduce(x, TABLE_STEPS as f64 / PI.0, &ARCTANGENT);
        let (sine, cosine) = CIRCLE[remainder(bits, 2 * TABLE_STEPS)];
        let square = r * r;
        let s = r + r * square * (-1.0 / 6.0 + square * (1.0 / 120.0 - square * (1.0 / 5040.0)));
        let c = square * (-0.5 + square * (1.0 / 24.0 - square * (1.0 / 720.0)));
        (sine + (sine * c + cosine * s), cosine + (cosine * c - sine * s))
    } else if x.is_finite() {
        sin_cos(whole_turns_less(x, 0.0))
    } else {
        (f64::NAN, f64::NAN)
    }
}

/// The angle in [0, π] of the point (x, y), y ≥ 0, to 1e-5: a guess, from a polynomial fitted to the arctangent.
#[inline]
pub(crate) fn angle(x: f64, y: f64) -> f64 {
    let steep = y > x.abs();
    let z = if steep { x / y } else { y / x };
    let w = z * z;
    let arctangent = z
        * (((0.999_995_6 - 0.332_994_6 * w) + (w * w) * (0.195_635_9 - 0.121_239 * w))
            + (w * w) * (w * w) * (0.057_477_2 - 0.013_480_43 * w));
    if steep {
        0.5 * PI.0 - arctangent
    } else if x < 0.0 {
        PI.0 + arctangent
    } else {
        arctangent
    }
}

/// x + low less the whole turns in it, in about (−π, π]; good to an ulp of π for any number of turns below 2⁵⁰.
#[inline]
pub(crate) fn whole_turns_less(x: f64, low: f64) -> f64 {
    let turns = (x * (0.5 / PI.0) + ROUND) - ROUND;
    let (back, lost) = product(turns, 2.0 * PI.0);
    (x - back) + (low - lost - turns * (2.0 * PI.1))
}

#[cfg(test)]
mod tests {
    use super::{angle, exp, exp_m1, ln, power, sin_cos, whole_turns_less};

    /// How many units in the last place of `expected` lie between the two.
    fn ulps(got: f64, expected: f64) -> u64 {
        got.to_bits().abs_diff(expected.to_bits())
    }

    /// The platform's functions are good to an ulp and, as these, mostly to half of one.
    #[test]
    fn exponential_is_that_of_the_platform() {
        let mut other = 0;
        for i in -200_000..200_000 {
            let x = f64::from(i) * 1e-4 * std::f64::consts::E;
            let apart = ulps(exp(x), x.exp());
            assert!(apart <= 1, "exp({x}): {apart} ulp");
            other += apart;
        }
        assert!(other < 110_000, "{other} of 400000 differ");
        for x in [-800.0, -745.0, -720.0, -699.0, 0.0, 699.0, 705.0, 709.0] {
            assert!((exp(x) - x.exp()).abs() <= 1e-13 * x.exp(), "exp({x})");
        }
        assert!(exp(f64::NAN).is_nan());
        assert_eq!(
            (exp(720.0), exp(f64::INFINITY), exp(f64::NEG_INFINITY)),
            (f64::INFINITY, f64::INFINITY, 0.0)
        );
    }

    #[test]
    fn exponential_less_one_keeps_small_arguments() {
        for i in -60_000..60_000 {
            let x = f64::from(i) * 1e-5 * std::f64::consts::E;
            let expected = x.exp_m1();
            assert!((exp_m1(x) - expected).abs() <= 8e-16 * expected.abs(), "{x}");
        }
    }

    #[test]
    fn logarithms_and_powers_are_those_of_the_platform() {
        for i in 1..200_000 {
            let x = 1e-6 * f64::from(i).powi(3);
            let expected = x.ln();
            assert!(
                (ln(x) - expected).abs() <= 2.3e-16 * expected.abs().max(0.5),
                "ln({x})"
            );
            for n in [0.0, 0.5, 1.0, 3.0, 4.7, 10.0] {
                let expected = x.powf(n);
                let apart = (power(x, n) - expected).abs();
                assert!(apart <= 4e-16 * (1.0 + n * x.ln().abs()) * expected, "{x}^{n}");
            }
        }
        assert_eq!(
            (power(0.0, 0.5), power(0.0, 3.0), power(0.0, 0.0)),
            (0.0, 0.0, 1.0)
        );
        assert_eq!((ln(0.0), ln(f64::INFINITY)), (f64::NEG_INFINITY, f64::INFINITY));
    }

    #[test]
    fn sine_and_cosine_are_those_of_the_platform() {
        for i in -400_000..400_000 {
            let x = f64::from(i) * 1e-3 * std::f64::consts::E;
            let ((sin, cos), expected) = (sin_cos(x), x.sin_cos());
            // An ulp of one half, and relative where the sine is small.
            assert!(
                (sin - expected.0).abs() <= 1.2e-16_f64.min(4e-16 * expected.0.abs()).max(1e-300),
                "sin {x}"
            );
            assert!((cos - expected.1).abs() <= 1.2e-16_f64.max(0.0), "cos {x}");
        }
        assert!(sin_cos(f64::INFINITY).0.is_nan());
    }

    #[test]
    fn angles_are_good_guesses() {
        for i in 0..=10_000 {
            let (y, x) = (f64::from(i) * std::f64::consts::PI * 1e-4).sin_cos();
            assert!(
                (angle(x, y.max(0.0)) - y.max(0.0).atan2(x)).abs() < 1e-5,
                "{x} {y}"
            );
        }
    }

    #[test]
    fn large_angles_keep_their_digits() {
        // cos(10^9) and sin(10^15) to 17 digits (computed with 50 digits).
        assert!((sin_cos(1e9).1 - 0.837_887_181_363_902_4).abs() < 2e-16);
        assert!((sin_cos(1e15).0 - 0.858_272_793_170_235_8).abs() < 2e-16);
        assert!((whole_turns_less(7.0, 0.0) - 0.716_814_692_820_413_5).abs() < 2e-16);
    }
}
