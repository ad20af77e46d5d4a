//! Motion between two events.

pub mod decay;
pub(crate) mod enclosure;
pub mod exact;
pub(crate) mod taylor;
