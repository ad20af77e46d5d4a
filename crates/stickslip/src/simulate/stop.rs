//! Why a run of any engine ends.
//!
//! The loops decide it: `one_mass.rs` beside this file, `network.rs`, `engine/`, `rosenbrock.rs`; in Python
//! `simulation/integration.py` and `scipy_solver.py`.

use crate::named::named;

/// A state beyond this has left the numbers: its square would overflow.
pub(super) const HUGE_STATE: f64 = 1e150;

named! {
    /// Why a run ended. Ending is a value, not an error.
    pub enum Stop {
        /// The asked time was reached.
        End = "t_end",
        /// As many events as allowed occurred.
        MaxEvents = "max_events",
        /// Events followed each other with hardly any time passing.
        Accumulation = "accumulation",
        /// The motion runs away: it grew beyond all numbers; by Taylor steps, to 1e9 times the speed of its start.
        Diverged = "diverged",
        /// The motion is too stiff for the steps that are possible.
        Stiff = "stiff",
        /// Whoever watches the run said that its time is up.
        MaxSeconds = "max_seconds",
        /// The motion is no number any more.
        NotANumber = "not_a_number",
        /// What is kept of the run fills the memory that it may take.
        Memory = "memory",
    }
}

impl Stop {
    /// What it means and what to do about it.
    pub fn sentence(self) -> &'static str {
        match self {
            Self::End => "the run reached t_end",
            Self::MaxEvents => "the run stopped at max_events: raise max_events to go on",
            Self::MaxSeconds => "the run stopped after max_seconds: raise max_seconds to go on",
            Self::NotANumber => {
                "the run stopped where its numbers leave the range of double precision: scale masses, stiffnesses and laws to units in which they are moderate"
            }
            Self::Memory => {
                "the run stopped as its orbit takes 1 GiB of memory: run shorter, or keep less by simulate_many or section"
            }
            Self::Accumulation => {
                "the run stopped where events accumulate with hardly any time passing: look at the last rows of the table of events"
            }
            Self::Diverged => {
                "the run stopped as the motion runs away: look for friction that falls without end, or a stiffness that is not symmetric, as of mode coupling"
            }
            Self::Stiff => {
                "the run stopped where friction changes so steeply, or damping is so large, that it takes 100,000 steps a natural time: look for a law that is stiff at the slip speeds of this motion, or take a mass with so large a damping out"
            }
        }
    }
}

/// Why a motion cannot go on from a state, if it cannot.
pub(crate) fn lost(state: &[f64]) -> Option<Stop> {
    if state.iter().any(|number| number.is_nan()) {
        Some(Stop::NotANumber)
    } else {
        let far = state.iter().any(|number| number.abs() >= HUGE_STATE);
        far.then_some(Stop::Diverged)
    }
}
