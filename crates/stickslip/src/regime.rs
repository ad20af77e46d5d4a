//! The kind of a steady motion, in one word; the criteria of every part of the package.

/// The kind of a motion after its transient.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Regime {
    /// Adhesion breaks again and again.
    StickSlip,
    /// It slips, the slip velocity oscillates and keeps its sign.
    AlmostHarmonic,
    /// The slip velocity is constant within [`STEADY`] of itself.
    StableSlip,
    /// The slip velocity changes its sign without a stick.
    BackAndForth,
    /// Stuck throughout.
    AtRest,
    /// Beyond all numbers.
    Diverged,
    /// The run ended before its time: too many events, or an accumulation of them.
    Unfinished,
}

/// A slip velocity that varies by no more than this part of its largest size is constant.
pub const STEADY: f64 = 2e-3;

impl Regime {
    /// Every regime, by its number.
    pub const ALL: [Self; 7] = [
        Self::StickSlip,
        Self::AlmostHarmonic,
        Self::StableSlip,
        Self::BackAndForth,
        Self::AtRest,
        Self::Diverged,
        Self::Unfinished,
    ];

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::StickSlip => "stick_slip",
            Self::AlmostHarmonic => "almost_harmonic",
            Self::StableSlip => "stable_slip",
            Self::BackAndForth => "reversing_slip",
            Self::AtRest => "at_rest",
            Self::Diverged => "diverged",
            Self::Unfinished => "unfinished",
        }
    }

    /// Whether the slip velocity is constant, or the contact sticks.
    #[must_use]
    pub fn rests(self) -> bool {
        matches!(self, Self::StableSlip | Self::AtRest)
    }

    /// From the share of the time in which the mass sticks, whether adhesion ever held or broke, and the extremes of w.
    #[must_use]
    pub fn of(stuck_share: f64, sticks: bool, [w_min, w_max]: [f64; 2]) -> Self {
        if stuck_share >= 1.0 {
            Self::AtRest
        } else if sticks {
            Self::StickSlip
        } else if w_max - w_min <= STEADY * w_min.abs().max(w_max.abs()) {
            Self::StableSlip
        } else if w_min * w_max > 0.0 {
            Self::AlmostHarmonic
        } else {
            Self::BackAndForth
        }
    }
}
