//! Motion between two events.

pub mod exact;
pub(crate) mod expansion;
pub(crate) mod taylor;
