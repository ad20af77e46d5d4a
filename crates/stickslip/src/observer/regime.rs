//! The kind of a simulated motion, in one word, and its criteria. Of a measured record, where a stick is never exact,
//! `python/stickslip/measurement/regime.py` decides; a motion laid over a record is judged as that record is.

use crate::named::named;
use crate::simulate::Stop;

named! {
    /// The kind of a motion after its transient.
    pub enum Regime {
        /// Adhesion breaks again and again.
        StickSlip = "stick_slip",
        /// It slips, the slip velocity oscillates and keeps its sign.
        AlmostHarmonic = "almost_harmonic",
        /// The slip velocity is constant within [`STEADY`] of itself.
        StableSlip = "stable_slip",
        /// The slip velocity changes its sign without a stick.
        ReversingSlip = "reversing_slip",
        /// Stuck throughout.
        AtRest = "at_rest",
        /// Beyond all numbers.
        Diverged = "diverged",
        /// The run ended before its time: too many events, or an accumulation of them.
        Unfinished = "unfinished",
    }
}

/// A slip velocity that varies by no more than this part of its largest size is constant.
pub const STEADY: f64 = 2e-3;

/// One that is beyond zero by no more than this part of its largest size touches it.
const ROUNDING: f64 = 1e-12;

impl Regime {
    /// Whether the slip velocity is constant, or the contact sticks.
    pub fn rests(self) -> bool {
        matches!(self, Self::StableSlip | Self::AtRest)
    }

    /// What the stop of a run says by itself: nothing of one that reached its time, and of one that stopped before it nothing
    /// where `enough` of the motion was seen to be told from that.
    ///
    /// ```
    /// use stickslip::{regime::Regime, simulate::Stop};
    /// assert_eq!(Regime::of_stop(Stop::Accumulation, false), Some(Regime::Unfinished));
    /// assert_eq!(Regime::of_stop(Stop::Accumulation, true), None);
    /// ```
    pub fn of_stop(stop: Stop, enough: bool) -> Option<Self> {
        match stop {
            Stop::Diverged => Some(Self::Diverged),
            Stop::NotANumber => Some(Self::Unfinished),
            Stop::End => None,
            Stop::MaxEvents | Stop::Accumulation | Stop::Stiff | Stop::MaxSeconds | Stop::Memory => {
                (!enough).then_some(Self::Unfinished)
            }
        }
    }

    /// From the share of the time in which the mass sticks, whether adhesion ever held or broke, and the extremes of w.
    pub fn of(stuck_share: f64, sticks: bool, [w_min, w_max]: [f64; 2]) -> Self {
        let largest = w_min.abs().max(w_max.abs());
        let keeps_sign = w_max.min(-w_min) <= ROUNDING * largest;
        if stuck_share >= 1.0 {
            Self::AtRest
        } else if sticks {
            Self::StickSlip
        } else if w_max - w_min <= STEADY * largest {
            Self::StableSlip
        } else if keeps_sign {
            Self::AlmostHarmonic
        } else {
            Self::ReversingSlip
        }
    }
}
