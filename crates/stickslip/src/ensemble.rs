//! Many runs: rows of values in one document, batches, sweeps.

pub mod batch;
pub mod rows;
pub mod sweep;
