//! The certified next event: when a mode ends, and by what.
//!
//! Of a step of many masses the guards are polynomials (`first_root`); what follows is of one mass.
//!
//! Where nothing forces the mass, slip is monotone between extrema known in closed form, and that is fastest: mostly its
//! end follows from a guess in closed form, one evaluation there and the signs of the slip acceleration (`free`). All
//! else is found by a `search` from sample to sample.

mod direct;
mod end_of_stick;
mod falling_limit;
pub(crate) mod first_root;
mod free;
mod search;
mod slip;

pub(crate) use end_of_stick::{Side, on_either_side};
pub use end_of_stick::{end_of_hold, end_of_stick};
pub use slip::{Arrival, SlipPhase, end_of_slip};

/// What finding events has cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Events that occurred.
    pub events: u64,
    /// Evaluations of the closed-form motion.
    pub evaluations: u64,
    /// Times that a motion touched an end of its mode within rounding and turned back: no events.
    pub grazes: u64,
    /// Times that a step looked like the last one to a root and what was left there was not rounding: the search went on.
    pub fallbacks: u64,
}

/// What is known of the slip speed where a mode starts; rounding must not contradict it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// Anywhere inside the piece.
    Inside,
    /// At the low end, moving up.
    Low,
    /// At the high end, moving down.
    High,
    /// Where the slip acceleration is zero, maybe at an end: a turn, or adhesion that broke at the force slip produces.
    Reversal,
}

impl Start {
    /// Whether the slip acceleration is zero there but for rounding: at an end it points inward, so one that does not is.
    fn reverses(self, slope: f64) -> bool {
        match self {
            Self::Inside => false,
            Self::Reversal => true,
            Self::Low => slope <= 0.0,
            Self::High => slope >= 0.0,
        }
    }
}

/// The certificate of an accepted root, checked in a debug build: a margin that is not below zero before it and not above zero
/// after it, but for rounding; `margin` gives its value and what may be rounding of it. It is evaluated anew, whatever search
/// found the root.
pub(crate) fn changes_sign(t: f64, width: f64, margin: impl Fn(f64) -> [f64; 2]) -> bool {
    let width = width + 16.0 * f64::EPSILON * t;
    let ([before, rounding], [after, more]) = (margin((t - width).max(0.0)), margin(t + width));
    // What is no number is a stop, not a root.
    !(before < -rounding || after > more)
}

/// How much of what rounding is to a search, which finds the root from a sample nearby, it may be to an evaluation anew.
const ANEW_ROUNDINGS: f64 = 512.0;
/// As a part of the time in which the motion changes, how far before and after a root its certificate looks.
const BESIDE_ROOT: f64 = 1e-9;
