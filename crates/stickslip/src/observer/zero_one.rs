//! The 0–1 test for chaos: whether a series of returns is as irregular as a random walk.
//!
//! Of a series φ_j one forms p_c(n) = Σ φ_j cos jc, q_c(n) = Σ φ_j sin jc. They stay bounded for a regular motion and wander
//! for a chaotic one: the growth rate K of their mean square displacement is near 0 or near 1.
//! Source: Gottwald & Melbourne, SIAM Journal on Applied Dynamical Systems 8 (2009) 129, with the damped mean square
//! displacement of its Eq. (2.3) and the correlation method of its section 3.2.

use crate::elementary::sin_cos;

/// Angles c of which the median is taken.
const ANGLES: u32 = 64;

/// The median growth rate K of a series; not a number for fewer than 100 values, or a constant.
pub fn growth(series: &[f64]) -> f64 {
    let count = series.len();
    let lags = count / 10;
    let mean = series.iter().sum::<f64>() / count as f64;
    if lags < 10 || series.iter().all(|&value| value == series[0]) {
        return f64::NAN;
    }
    let mut rates: Vec<f64> = (0..ANGLES)
        .map(|index| rate(series, lags, mean, angle(index)))
        .collect();
    rates.sort_by(f64::total_cmp);
    0.5 * (rates[rates.len() / 2 - 1] + rates[rates.len() / 2])
}

/// Angles in (π/5, 4π/5), evenly spread by the golden ratio: near 0 and π a resonance with the motion would look like growth.
fn angle(index: u32) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let share = (0.5 + f64::from(index) * GOLDEN).fract();
    std::f64::consts::PI * (0.2 + 0.6 * share)
}

/// The correlation of the mean square displacement with time.
fn rate(series: &[f64], lags: usize, mean: f64, c: f64) -> f64 {
    let mut walk = Vec::with_capacity(series.len());
    let (mut p, mut q) = (0.0, 0.0);
    for (index, value) in series.iter().enumerate() {
        let (sin, cos) = sin_cos(c * (index + 1) as f64);
        p += value * cos;
        q += value * sin;
        walk.push((p, q));
    }
    let terms = series.len() - lags;
    let displacement: Vec<f64> = (1..=lags)
        .map(|lag| {
            let pairs = walk[..terms].iter().zip(&walk[lag..]);
            let sum: f64 = pairs
                .map(|(a, b)| (b.0 - a.0) * (b.0 - a.0) + (b.1 - a.1) * (b.1 - a.1))
                .sum();
            // The oscillating term that a mean other than zero brings is known, and taken off.
            let swing = mean * mean * (1.0 - sin_cos(lag as f64 * c).1) / (1.0 - sin_cos(c).1);
            sum / terms as f64 - swing
        })
        .collect();
    correlation(&displacement)
}

/// The correlation of values with their index.
fn correlation(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let (middle, mean) = (0.5 * (count - 1.0), values.iter().sum::<f64>() / count);
    let (mut both, mut times, mut spread) = (0.0, 0.0, 0.0);
    for (index, value) in values.iter().enumerate() {
        let (time, value) = (index as f64 - middle, value - mean);
        both += time * value;
        times += time * time;
        spread += value * value;
    }
    both / (times * spread).sqrt()
}

#[cfg(test)]
mod tests {
    use super::growth;

    #[test]
    fn the_logistic_map_is_chaotic_at_4_and_regular_where_it_has_period_3() {
        let orbit = |rate: f64| {
            let mut x = 0.3;
            let mut next = || {
                x = rate * x * (1.0 - x);
                x
            };
            (0..1500).map(|_| next()).skip(1000).collect::<Vec<f64>>()
        };
        assert!(growth(&orbit(4.0)) > 0.9);
        // The window of period 3 begins at 1 + √8 = 3.828… (May, Nature 261 (1976) 459).
        assert!(growth(&orbit(3.83)).abs() < 0.1);
    }

    #[test]
    fn two_frequencies_without_a_common_measure_are_regular() {
        let series: Vec<f64> = (0..500)
            .map(|n| (f64::from(n) * 2f64.sqrt()).cos() + 0.3)
            .collect();
        assert!(growth(&series).abs() < 0.1);
    }

    #[test]
    fn short_and_constant_series_say_nothing() {
        assert!(growth(&[1.0; 500]).is_nan());
        assert!(growth(&[0.0, 1.0, 0.5]).is_nan());
    }
}
