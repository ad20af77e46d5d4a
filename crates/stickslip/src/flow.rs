//! Motion between two events.

pub mod exact;
pub(crate) mod expansion;
