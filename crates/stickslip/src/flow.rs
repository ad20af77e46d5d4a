//! Motion between two events.

pub mod exact;
