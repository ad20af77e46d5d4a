//! Engines: a motion that is followed further and further, and shown to an observer.

mod closed;
mod crossings;
pub mod event_sequence;
pub mod hybrid_state;
pub mod mode;
mod samples;
pub(crate) mod steps;

pub use closed::{Closed, Replay};
pub use samples::Samples;
pub use steps::{ReplaySteps, Steps};

use crate::error::Error;
use crate::hybrid_state::Restart;
use crate::observer::Observer;
use crate::simulate::Stop;

/// A motion that is followed further and further.
pub trait Engine {
    /// Go on to the time `t_end` and show `observer` what happens from the time `after` on.
    ///
    /// # Errors
    /// What makes no sense in the system or the start.
    fn go(&mut self, t_end: f64, after: f64, observer: &mut impl Observer) -> Result<Stop, Error>;
    /// Events so far.
    fn events(&self) -> u64;
    /// The state that was reached.
    fn end(&self) -> &Reached;
    /// Whether it can go on for longer, and a stick of a contact then meets its limit in the end: the drive moves on and the
    /// masses are held.
    fn must_break(&self, _contact: usize) -> bool {
        false
    }
}

/// The state at the end of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reached {
    /// Positions, mass by mass.
    pub x: Vec<f64>,
    /// Velocities, mass by mass.
    pub v: Vec<f64>,
    /// Which masses stick on a drive.
    pub rides: Vec<bool>,
    /// Slip velocities, contact by contact.
    pub w: Vec<f64>,
    /// How a motion in closed form goes on, if it reached the end.
    pub restart: Option<Restart>,
}
