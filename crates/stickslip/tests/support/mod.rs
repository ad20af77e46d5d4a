//! What several tests of the core share.

use stickslip::law::Law;
use stickslip::oscillator::Oscillator;

/// A mass of 1 on a spring of stiffness 1, unforced.
pub(crate) fn oscillator(law: impl Into<Law>, damping: f64, drive_velocity: f64) -> Oscillator {
    Oscillator {
        mass: 1.0,
        stiffness: 1.0,
        damping,
        drive_velocity,
        law: law.into(),
        forcing: vec![],
    }
}

/// Equal to a relative 1e-11.
pub(crate) fn close(got: f64, expected: f64) {
    let error = (got - expected).abs() / expected.abs();
    assert!(
        error < 1e-11,
        "got {got}, expected {expected}: relative error {error:.1e}"
    );
}
