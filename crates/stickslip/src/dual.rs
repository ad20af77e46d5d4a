//! Numbers that carry their derivatives along several directions (forward differentiation, without a difference).

use std::ops::{Add, Mul, Neg, Sub};

/// A value and its derivatives.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Dual {
    /// The value.
    pub value: f64,
    /// Its derivatives, one a direction.
    pub rates: Vec<f64>,
}

impl Dual {
    /// A number that does not vary along `lanes` directions.
    #[must_use]
    pub fn fixed(value: f64, lanes: usize) -> Self {
        Self {
            value,
            rates: vec![0.0; lanes],
        }
    }

    /// The coordinate of direction `lane`.
    #[must_use]
    pub fn along(value: f64, lane: usize, lanes: usize) -> Self {
        let mut number = Self::fixed(value, lanes);
        number.rates[lane] = 1.0;
        number
    }

    /// This plus `slope` times the derivatives of `other`, whose value does not count.
    #[must_use]
    pub fn shifted(mut self, slope: f64, other: &Self) -> Self {
        for (rate, along) in self.rates.iter_mut().zip(&other.rates) {
            *rate += slope * along;
        }
        self
    }

    /// |self|
    #[must_use]
    pub fn abs(self) -> Self {
        let sign = self.value.signum();
        self * sign
    }
}

impl Add<&Dual> for Dual {
    type Output = Self;
    fn add(mut self, other: &Self) -> Self {
        self.value += other.value;
        self.shifted(1.0, other)
    }
}

impl Sub<&Dual> for Dual {
    type Output = Self;
    fn sub(mut self, other: &Self) -> Self {
        self.value -= other.value;
        self.shifted(-1.0, other)
    }
}

impl Mul<f64> for Dual {
    type Output = Self;
    fn mul(mut self, factor: f64) -> Self {
        self.value *= factor;
        for rate in &mut self.rates {
            *rate *= factor;
        }
        self
    }
}

impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        self * -1.0
    }
}
