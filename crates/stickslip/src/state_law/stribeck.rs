//! The curve of steady slip that bristle models approach.

/// g(w) = f_k + (f_s − f_k) exp(−|w/w_s|^n).
pub(super) fn curve(w: f64, break_away: f64, kinetic: f64, scale: f64, exponent: f64) -> f64 {
    let ratio = (w / scale).abs();
    let power = if exponent == 2.0 {
        ratio * ratio
    } else {
        ratio.powf(exponent)
    };
    kinetic + (break_away - kinetic) * (-power).exp()
}
