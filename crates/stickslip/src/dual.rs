//! Numbers that carry their derivatives along `N` directions (forward differentiation, without a difference).

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A value and its derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<const N: usize> {
    /// The value.
    pub value: f64,
    /// Its derivatives.
    pub rates: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// A number that does not vary.
    #[must_use]
    pub fn fixed(value: f64) -> Self {
        Self {
            value,
            rates: [0.0; N],
        }
    }

    /// The coordinate of direction `lane`.
    #[must_use]
    pub fn along(value: f64, lane: usize) -> Self {
        let mut rates = [0.0; N];
        rates[lane] = 1.0;
        Self { value, rates }
    }

    /// g(self) where g has this `value` and this `slope` here.
    #[must_use]
    pub fn chain(self, value: f64, slope: f64) -> Self {
        Self {
            value,
            rates: self.rates.map(|rate| slope * rate),
        }
    }

    /// This plus `slope` times the derivatives of `other`, whose value does not count.
    #[must_use]
    pub fn shifted(mut self, slope: f64, other: &Self) -> Self {
        for (rate, along) in self.rates.iter_mut().zip(other.rates) {
            *rate += slope * along;
        }
        self
    }

    /// e^self
    #[must_use]
    pub fn exp(self) -> Self {
        let value = self.value.exp();
        self.chain(value, value)
    }

    /// (sin self, cos self)
    #[must_use]
    pub fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.value.sin_cos();
        (self.chain(sin, cos), self.chain(cos, -sin))
    }

    /// √self
    #[must_use]
    pub fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, 0.5 / root)
    }

    /// |self|
    #[must_use]
    pub fn abs(self) -> Self {
        self.chain(self.value.abs(), self.value.signum())
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            ..self.shifted(1.0, &other)
        }
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self {
            value: self.value - other.value,
            ..self.shifted(-1.0, &other)
        }
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        self.chain(self.value * other.value, other.value)
            .shifted(self.value, &other)
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let ratio = self.value / other.value;
        self.chain(ratio, 1.0 / other.value)
            .shifted(-ratio / other.value, &other)
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        self.chain(factor * self.value, factor)
    }
}
