//! Time that adds up without losing its last digit.

use crate::elementary::{add, product, whole_turns_less};

/// Time as an unevaluated sum of two doubles: thousands of segments add up without losing the last digit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Clock {
    /// The rounded time.
    pub high: f64,
    /// What rounding took.
    pub low: f64,
}

impl Clock {
    /// The time `t`.
    #[must_use]
    pub fn at(t: f64) -> Self {
        Self { high: t, low: 0.0 }
    }

    /// This time plus `step`, rounded only in the low part.
    #[must_use]
    pub fn after(self, step: f64) -> Self {
        let (high, low) = add((self.high, self.low), (step, 0.0));
        Self { high, low }
    }

    /// `t` minus this time.
    pub fn until(self, t: f64) -> f64 {
        (t - self.high) - self.low
    }

    /// frequency · time reduced to (−π, π], good to an ulp for any number of turns.
    pub(crate) fn angle(self, frequency: f64) -> f64 {
        let (turned, rounding) = product(frequency, self.high);
        whole_turns_less(turned, rounding + frequency * self.low)
    }
}

#[cfg(test)]
mod tests {
    use super::Clock;

    #[test]
    fn ten_million_tenths_make_a_million() {
        let mut clock = Clock::default();
        for _ in 0..10_000_000 {
            clock = clock.after(0.1);
        }
        // 0.1 is not a tenth in binary: the exact sum exceeds 10^6 by 10^7 (0.1₂ − 1/10).
        let excess = 1e7 * 5.551_115_123_125_783e-18;
        assert!((clock.until(1e6) + excess).abs() < 1e-16);
    }

    #[test]
    fn angle_keeps_its_digits_after_many_turns() {
        let clock = Clock::at(1e9);
        // cos(10^9) to 17 digits (computed with 50 digits).
        assert!((clock.angle(1.0).cos() - 0.837_887_181_363_902_4).abs() < 1e-15);
    }
}
