//! Numbers that carry their derivatives along a few axes (forward differentiation, exact to rounding; the jets of Ceres).

use std::cmp::Ordering;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use crate::elementary::{ln, power};
use crate::scalar::Scalar;

/// So many derivatives go along: as many as a wide register holds.
pub const AXES: usize = 8;

/// A value and its derivatives. Comparisons are those of the values.
///
/// A core for a browser must be small: there what is computed with it is called, not put into each place.
#[derive(Clone, Copy, Debug, Default)]
pub struct Jet {
    /// The value.
    pub value: f64,
    /// Its derivatives, one an axis.
    pub slopes: [f64; AXES],
}

impl Jet {
    /// A number that is itself the axis.
    #[must_use]
    pub fn along(value: f64, axis: usize) -> Self {
        let mut jet = Self::from(value);
        if let Some(slope) = jet.slopes.get_mut(axis) {
            *slope = 1.0;
        }
        jet
    }

    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn with(value: f64, slope: impl FnMut(usize) -> f64) -> Self {
        let slopes = std::array::from_fn(slope);
        Self { value, slopes }
    }
}

impl From<f64> for Jet {
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn from(value: f64) -> Self {
        let slopes = [0.0; AXES];
        Self { value, slopes }
    }
}

impl Scalar for Jet {
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn value(self) -> f64 {
        self.value
    }

    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn vanishes(self) -> bool {
        self.value == 0.0 && self.slopes == [0.0; AXES]
    }

    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn chain(self, value: f64, slope: f64) -> Self {
        // What does not vary does not where the slope is infinite.
        Self::with(value, |i| {
            if self.slopes[i] == 0.0 {
                0.0
            } else {
                slope * self.slopes[i]
            }
        })
    }

    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn power(self, exponent: Self) -> Self {
        let (x, n) = (self.value, exponent.value);
        let value = power(x, n);
        let by_base = match x {
            0.0 if n == 1.0 => 1.0,
            0.0 if n > 1.0 => 0.0,
            0.0 => f64::INFINITY,
            _ => n * value / x,
        };
        let by_exponent = if value == 0.0 { 0.0 } else { value * ln(x) };
        self.chain(value, by_base) + exponent.chain(0.0, by_exponent)
    }
}

impl PartialEq for Jet {
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value
    }
}

impl PartialEq<f64> for Jet {
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn eq(&self, other: &f64) -> bool {
        self.value == *other
    }
}

impl PartialOrd for Jet {
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.value.partial_cmp(&other.value)
    }
}

impl PartialOrd<f64> for Jet {
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn partial_cmp(&self, other: &f64) -> Option<Ordering> {
        self.value.partial_cmp(other)
    }
}

impl Neg for Jet {
    type Output = Self;
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn neg(self) -> Self {
        Self::with(-self.value, |i| -self.slopes[i])
    }
}

impl Add for Jet {
    type Output = Self;
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn add(self, other: Self) -> Self {
        Self::with(self.value + other.value, |i| self.slopes[i] + other.slopes[i])
    }
}

impl Sub for Jet {
    type Output = Self;
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn sub(self, other: Self) -> Self {
        Self::with(self.value - other.value, |i| self.slopes[i] - other.slopes[i])
    }
}

impl Mul for Jet {
    type Output = Self;
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn mul(self, other: Self) -> Self {
        let (one, two) = (self * other.value, other * self.value);
        Self::with(one.value, |i| one.slopes[i] + two.slopes[i])
    }
}

impl Div for Jet {
    type Output = Self;
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn div(self, other: Self) -> Self {
        let (quotient, inverse) = (self.value / other.value, 1.0 / other.value);
        Self::with(quotient, |i| {
            inverse * (self.slopes[i] - quotient * other.slopes[i])
        })
    }
}

impl Add<f64> for Jet {
    type Output = Self;
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn add(self, other: f64) -> Self {
        Self {
            value: self.value + other,
            ..self
        }
    }
}

impl Sub<f64> for Jet {
    type Output = Self;
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn sub(self, other: f64) -> Self {
        self + -other
    }
}

impl Mul<f64> for Jet {
    type Output = Self;
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn mul(self, factor: f64) -> Self {
        Self::with(self.value * factor, |i| self.slopes[i] * factor)
    }
}

impl Div<f64> for Jet {
    type Output = Self;
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn div(self, divisor: f64) -> Self {
        Self::with(self.value / divisor, |i| self.slopes[i] / divisor)
    }
}

impl AddAssign for Jet {
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
