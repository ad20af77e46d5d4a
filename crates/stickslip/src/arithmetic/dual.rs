//! Numbers that carry their derivatives along several directions (forward differentiation, without a difference).

use std::ops::{Add, Deref, DerefMut, Mul, Neg, Sub};

/// So many directions lie in the number itself: those of one mass with one contact and of ten parameters.
const FEW_DIRECTIONS: usize = 24;

/// Derivatives, one a direction. Few of them ask for no memory, which would cost more than the arithmetic.
#[derive(Debug)]
pub enum Rates {
    /// They, and how many count.
    Few([f64; FEW_DIRECTIONS], usize),
    /// Any number.
    Many(Vec<f64>),
}

impl Rates {
    fn zero(directions: usize) -> Self {
        if directions <= FEW_DIRECTIONS {
            Self::Few([0.0; FEW_DIRECTIONS], directions)
        } else {
            Self::Many(vec![0.0; directions])
        }
    }
}

/// A copy into a number that is there moves its derivatives once.
impl Clone for Rates {
    #[inline]
    fn clone(&self) -> Self {
        match self {
            Self::Few(rates, directions) => Self::Few(*rates, *directions),
            Self::Many(rates) => Self::Many(rates.clone()),
        }
    }

    #[inline]
    fn clone_from(&mut self, other: &Self) {
        if let (Self::Few(own, count), Self::Few(rates, directions)) = (&mut *self, other) {
            (*own, *count) = (*rates, *directions);
        } else {
            *self = other.clone();
        }
    }
}

impl Deref for Rates {
    type Target = [f64];
    fn deref(&self) -> &[f64] {
        match self {
            Self::Few(rates, directions) => &rates[..*directions],
            Self::Many(rates) => rates,
        }
    }
}

impl DerefMut for Rates {
    fn deref_mut(&mut self) -> &mut [f64] {
        match self {
            Self::Few(rates, directions) => &mut rates[..*directions],
            Self::Many(rates) => rates,
        }
    }
}

/// A value and its derivatives.
#[derive(Debug)]
pub struct Dual {
    /// The value.
    pub value: f64,
    /// Its derivatives, one a direction.
    pub rates: Rates,
}

impl Clone for Dual {
    #[inline]
    fn clone(&self) -> Self {
        Self {
            value: self.value,
            rates: self.rates.clone(),
        }
    }

    #[inline]
    fn clone_from(&mut self, other: &Self) {
        self.value = other.value;
        self.rates.clone_from(&other.rates);
    }
}

impl Dual {
    /// A number that does not vary along `directions` directions.
    #[must_use]
    pub fn fixed(value: f64, directions: usize) -> Self {
        Self {
            value,
            rates: Rates::zero(directions),
        }
    }

    /// Add `slope` times the derivatives of `other`, whose value does not count.
    #[inline]
    pub fn shift(&mut self, slope: f64, other: &Self) {
        // As many as there is room for: a count that is known lets a processor take several at once.
        if let (Rates::Few(rates, directions), Rates::Few(along, _)) = (&mut self.rates, &other.rates)
            && *directions > FEW_DIRECTIONS / 2
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

    /// Whether it varies along any direction.
    #[inline]
    #[must_use]
    pub fn varies(&self) -> bool {
        // All bits but the signs: without a way out of the loop a processor looks at several at once.
        let bits = self.rates.iter().fold(0, |bits, rate| bits | rate.to_bits());
        bits << 1 != 0
    }

    /// |self|
    #[must_use]
    pub fn abs(mut self) -> Self {
        self.scale(self.value.signum());
        self
    }

    /// Multiply by a number that does not vary.
    #[inline]
    pub fn scale(&mut self, factor: f64) {
        self.value *= factor;
        for rate in self.rates.iter_mut() {
            *rate *= factor;
        }
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
        self.scale(factor);
        self
    }
}

impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        self * -1.0
    }
}
