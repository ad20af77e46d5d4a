//! What a friction law computes with: a number, or a number that carries derivatives ([`Jet`](crate::jet::Jet)).

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use crate::elementary;

/// A real number. A law written for any of them gives its exact derivatives for those that carry them.
pub trait Scalar:
    Copy
    + Debug
    + Default
    + From<f64>
    + PartialEq
    + PartialOrd
    + PartialEq<f64>
    + PartialOrd<f64>
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + AddAssign
{
    /// Without derivatives.
    fn value(self) -> f64;

    /// Whether it is 0 and does not vary.
    #[inline]
    fn vanishes(self) -> bool {
        self == 0.0
    }

    /// f(self): `value` and `slope` are f and f′ here.
    #[must_use]
    fn chain(self, value: f64, slope: f64) -> Self;

    /// |self|
    #[must_use]
    #[inline]
    fn abs(self) -> Self {
        if self.value().is_sign_negative() {
            -self
        } else {
            self
        }
    }

    /// The larger one; of a number and none the number.
    #[must_use]
    #[inline]
    fn max(self, other: Self) -> Self {
        if self > other || other.value().is_nan() {
            self
        } else {
            other
        }
    }

    /// The smaller one; of a number and none the number.
    #[must_use]
    #[inline]
    fn min(self, other: Self) -> Self {
        if self < other || other.value().is_nan() {
            self
        } else {
            other
        }
    }

    /// 1/self
    #[must_use]
    #[inline]
    fn inverse(self) -> Self {
        Self::from(1.0) / self
    }

    /// √self
    #[must_use]
    #[inline]
    fn sqrt(self) -> Self {
        let root = self.value().sqrt();
        self.chain(root, 0.5 / root)
    }

    /// eˣ
    #[must_use]
    #[inline]
    fn exp(self) -> Self {
        let value = elementary::exp(self.value());
        self.chain(value, value)
    }

    /// eˣ − 1 without cancellation
    #[must_use]
    #[inline]
    fn exp_m1(self) -> Self {
        let value = elementary::exp_m1(self.value());
        self.chain(value, value + 1.0)
    }

    /// ln(1 + x)
    #[must_use]
    #[inline]
    fn ln_1p(self) -> Self {
        let value = elementary::ln_1p(self.value());
        self.chain(value, 1.0 / (1.0 + self.value()))
    }

    /// tan of degrees
    #[must_use]
    #[inline]
    fn tan_degrees(self) -> Self {
        let value = elementary::tan(self.value().to_radians());
        self.chain(value, (1.0 + value * value).to_radians())
    }

    /// self^exponent for self ≥ 0
    #[must_use]
    fn power(self, exponent: Self) -> Self;
}

impl Scalar for f64 {
    #[inline]
    fn value(self) -> f64 {
        self
    }

    #[inline]
    fn chain(self, value: f64, _slope: f64) -> Self {
        value
    }

    #[inline]
    fn abs(self) -> Self {
        self.abs()
    }

    #[inline]
    fn max(self, other: Self) -> Self {
        self.max(other)
    }

    #[inline]
    fn min(self, other: Self) -> Self {
        self.min(other)
    }

    #[inline]
    fn power(self, exponent: Self) -> Self {
        elementary::power(self, exponent)
    }
}
