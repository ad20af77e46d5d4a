//! Numbers: those that carry derivatives, time in two parts, matrices, Taylor coefficients, functions with the same bits everywhere.

pub mod clock;
pub mod dual;
pub mod elementary;
pub mod jet;
pub(crate) mod matrix;
pub mod scalar;
pub mod series;
