//! Numbers to judge with: doubles, and pairs of doubles where doubles are not enough.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// What an integrator needs of a number.
pub trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// What a sum of terms near one no longer sees.
    const ROUNDING: f64;
    /// After how many rows of an extrapolation two that agree are believed: fewer may agree by chance.
    const ROWS: usize;
    /// To which share of the motion two rows must agree.
    const AGREES: f64;
    /// From a double.
    fn of(value: f64) -> Self;
    /// To the nearest double.
    fn value(self) -> f64;
}

impl Real for f64 {
    const ROUNDING: f64 = 1e-17;
    const ROWS: usize = 4;
    const AGREES: f64 = 1e-14;
    fn of(value: f64) -> Self {
        value
    }
    fn value(self) -> f64 {
        self
    }
}

/// An unevaluated sum of two doubles, good to about 31 digits (Dekker 1971).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    high: f64,
    low: f64,
}

impl Pair {
    /// The exact sum of two doubles.
    pub fn sum(a: f64, b: f64) -> Self {
        let high = a + b;
        let of_b = high - a;
        Self {
            high,
            low: (a - (high - of_b)) + (b - of_b),
        }
    }

    /// The exact product of two doubles.
    pub fn product(a: f64, b: f64) -> Self {
        let high = a * b;
        let halves = |value: f64| {
            let wide = 134_217_729.0 * value;
            let top = wide - (wide - value);
            (top, value - top)
        };
        let ((a1, a2), (b1, b2)) = (halves(a), halves(b));
        let low = ((a1 * b1 - high) + a1 * b2 + a2 * b1) + a2 * b2;
        Self { high, low }
    }

    fn short(high: f64, low: f64) -> Self {
        let sum = high + low;
        Self {
            high: sum,
            low: low - (sum - high),
        }
    }
}

impl Add for Pair {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let (top, rest) = (Self::sum(self.high, other.high), Self::sum(self.low, other.low));
        let once = Self::short(top.high, top.low + rest.high);
        Self::short(once.high, once.low + rest.low)
    }
}

impl Neg for Pair {
    type Output = Self;
    fn neg(self) -> Self {
        Self {
            high: -self.high,
            low: -self.low,
        }
    }
}

impl Sub for Pair {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Pair {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let top = Self::product(self.high, other.high);
        Self::short(
            top.high,
            top.low + (self.high * other.low + self.low * other.high),
        )
    }
}

impl Div for Pair {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let one = self.high / other.high;
        let rest = self - other * Self::of(one);
        let two = rest.high / other.high;
        let rest = rest - other * Self::of(two);
        Self::sum(one, two) + Self::of(rest.high / other.high)
    }
}

impl Real for Pair {
    const ROUNDING: f64 = 1e-33;
    const ROWS: usize = 6;
    const AGREES: f64 = 1e-16;
    fn of(value: f64) -> Self {
        Self {
            high: value,
            low: 0.0,
        }
    }
    fn value(self) -> f64 {
        self.high + self.low
    }
}

/// Ω (t₀ + t₁) + φ without whole turns, to a rounding of the result.
pub fn angle(frequency: f64, time: [f64; 2], phase: f64) -> f64 {
    const TURN: Pair = Pair {
        high: std::f64::consts::TAU,
        low: 2.449_293_598_294_706_4e-16,
    };
    let angle = Pair::product(frequency, time[0]) + Pair::of(frequency * time[1]) + Pair::of(phase);
    let turns = (angle.high / TURN.high).round();
    (angle - TURN * Pair::of(turns)).value()
}

#[cfg(test)]
mod tests {
    use super::{Pair, Real, angle};

    #[test]
    fn a_pair_has_thirty_digits() {
        let third = Pair::of(1.0) / Pair::of(3.0);
        let rest = third * Pair::of(3.0) - Pair::of(1.0);
        assert!(rest.value().abs() < 1e-31);
        assert!((angle(1.0, [1e9, 0.0], 0.0).cos() - 0.837_887_181_363_902_4).abs() < 1e-15);
    }
}
