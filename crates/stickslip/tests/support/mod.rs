//! What several tests of the core share.

/// Equal to a relative 1e-11.
pub(crate) fn close(got: f64, expected: f64) {
    let error = (got - expected).abs() / expected.abs();
    assert!(
        error < 1e-11,
        "got {got}, expected {expected}: relative error {error:.1e}"
    );
}
