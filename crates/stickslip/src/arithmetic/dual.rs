//! Numbers that carry their derivatives along several directions (forward differentiation, without a difference).

use std::ops::{Add, Deref, DerefMut, Mul, Neg, Sub};

/// So many directions lie in the number itself: those of one mass with one contact and of ten parameters.
const FEW: usize = 24;

/// Derivatives, one a direction. Few of them ask for no memory, which would cost more than the arithmetic.
#[derive(Clone, Debug)]
pub enum Rates {
    /// They, and how many count.
    Few([f64; FEW], usize),
    /// Any number.
    Many(Vec<f64>),
}

impl Rates {
    fn zero(lanes: usize) -> Self {
        if lanes <= FEW {
            Self::Few([0.0; FEW], lanes)
        } else {
            Self::Many(vec![0.0; lanes])
        }
    }
}

impl Deref for Rates {
    type Target = [f64];
    fn deref(&self) -> &[f64] {
        match self {
            Self::Few(rates, lanes) => &rates[..*lanes],
            Self::Many(rates) => rates,
        }
    }
}

impl DerefMut for Rates {
    fn deref_mut(&mut self) -> &mut [f64] {
        match self {
            Self::Few(rates, lanes) => &mut rates[..*lanes],
            Self::Many(rates) => rates,
        }
    }
}

/// A value and its derivatives.
#[derive(Clone, Debug)]
pub struct Dual {
    /// The value.
    pub value: f64,
    /// Its derivatives, one a direction.
    pub rates: Rates,
}

impl Dual {
    /// A number that does not vary along `lanes` directions.
    #[must_use]
    pub fn fixed(value: f64, lanes: usize) -> Self {
        Self {
            value,
            rates: Rates::zero(lanes),
        }
    }

    /// The coordinate of direction `lane`.
    #[must_use]
    pub fn along(value: f64, lane: usize, lanes: usize) -> Self {
        let mut number = Self::fixed(value, lanes);
        number.rates[lane] = 1.0;
        number
    }

    /// Add `slope` times the derivatives of `other`, whose value does not count.
    #[inline]
    pub fn shift(&mut self, slope: f64, other: &Self) {
        // As many as there is room for: a count that is known lets a processor take several at once.
        if let (Rates::Few(rates, lanes), Rates::Few(along, _)) = (&mut self.rates, &other.rates)
            && *lanes > FEW / 2
        {
            for (rate, along) in rates.iter_mut().zip(along) {
                *rate += slope * along;
            }
            return;
        }
        for (rate, along) in self.rates.iter_mut().zip(other.rates.iter()) {
            *rate += slope * along;
        }
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
        self.shift(1.0, other);
        self
    }
}

impl Sub<&Dual> for Dual {
    type Output = Self;
    fn sub(mut self, other: &Self) -> Self {
        self.value -= other.value;
        self.shift(-1.0, other);
        self
    }
}

impl Mul<f64> for Dual {
    type Output = Self;
    fn mul(mut self, factor: f64) -> Self {
        self.value *= factor;
        for rate in self.rates.iter_mut() {
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
