//! Motion between two events.

pub(crate) mod enclosure;
pub mod exact;
pub(crate) mod taylor;
