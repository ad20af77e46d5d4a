//! Where a motion under linear pieces goes on: what must be known beside its position and velocity.

use crate::clock::Clock;
use crate::event::Start;
use crate::law::{Memory, Piece};
use crate::mode::Mode;

/// The time, the mode and what the contact remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HybridState {
    /// The time, which counts for the forcing; a stick begins, or began, there.
    pub clock: Clock,
    /// The mode.
    pub mode: Mode,
    /// The memory.
    pub memory: Memory,
}

impl HybridState {
    /// How many numbers a mode and a memory are.
    pub const NUMBERS: usize = 13;

    /// In the middle of a mode that began at `clock` and has lasted for `elapsed`.
    #[must_use]
    pub(crate) fn inside(mut clock: Clock, elapsed: f64, mut mode: Mode, memory: Memory) -> Self {
        if let Mode::Slip { start, .. } | Mode::Hold { start, .. } = &mut mode {
            *start = Start::Inside;
            clock = clock.after(elapsed);
        }
        Self { clock, mode, memory }
    }

    /// Mode and memory as numbers, to be kept in a table; what there is none of is not a number.
    pub fn numbers(&self) -> [f64; Self::NUMBERS] {
        let memory = &self.memory;
        let mut numbers = [f64::NAN; Self::NUMBERS];
        numbers[0] = 0.0;
        match self.mode {
            Mode::Stick => {}
            Mode::Slip { direction, piece, .. } => {
                numbers[0] = direction;
                numbers[1..5].copy_from_slice(&[piece.offset, piece.slope, piece.low, piece.high]);
                numbers[5] = f64::from(piece.branch);
                numbers[6] = f64::from(u8::from(piece.reverses));
            }
            Mode::Hold {
                direction,
                u,
                between,
                ..
            } => {
                numbers[0] = 2.0 * direction;
                numbers[1..4].copy_from_slice(&[u, between[0], between[1]]);
            }
        }
        numbers[7..9].copy_from_slice(&memory.anchor);
        numbers[9..11].copy_from_slice(&memory.corner);
        numbers[11] = memory.released_at.unwrap_or(f64::NAN);
        numbers[12] = memory.force_rate;
        numbers
    }

    /// What [`HybridState::numbers`] gave, at another time; none where they are not a hybrid state.
    #[must_use]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the number of a branch is small"
    )]
    pub fn read(numbers: &[f64], clock: Clock) -> Option<Self> {
        let &[
            code,
            a,
            b,
            c,
            d,
            branch,
            reverses,
            ax,
            ay,
            cx,
            cy,
            released,
            force_rate,
        ] = numbers
        else {
            return None;
        };
        let mode = match code.abs() {
            0.0 => Mode::Stick,
            1.0 => Mode::Slip {
                direction: code,
                piece: Piece {
                    offset: a,
                    slope: b,
                    low: c,
                    high: d,
                    branch: branch as u32,
                    reverses: reverses != 0.0,
                },
                start: Start::Inside,
            },
            2.0 => Mode::Hold {
                direction: code.signum(),
                u: a,
                between: [b, c],
                start: Start::Inside,
            },
            _ => return None,
        };
        let memory = Memory {
            anchor: [ax, ay],
            corner: [cx, cy],
            released_at: (!released.is_nan()).then_some(released),
            force_rate,
        };
        Some(Self { clock, mode, memory })
    }
}

/// How a motion goes on under another drive or forcing: its position and its slip velocity, so that what sticks sticks on,
/// and what the contact does and remembers. Forcing begins anew.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Restart {
    /// Position.
    pub x: f64,
    /// Slip velocity.
    pub w: f64,
    /// How long a stick has lasted; 0 in slip.
    pub stuck_for: f64,
    /// Mode and memory.
    pub hybrid: HybridState,
}

impl Restart {
    /// How many numbers that is.
    pub const NUMBERS: usize = HybridState::NUMBERS + 3;

    /// As numbers, to be kept in a table.
    pub fn numbers(&self) -> [f64; Self::NUMBERS] {
        let mut numbers = [self.x; Self::NUMBERS];
        numbers[1..3].copy_from_slice(&[self.w, self.stuck_for]);
        numbers[3..].copy_from_slice(&self.hybrid.numbers());
        numbers
    }

    /// What [`Restart::numbers`] gave.
    pub fn read(numbers: &[f64]) -> Option<Self> {
        let (&[x, w, stuck_for], hybrid) = numbers.split_first_chunk()?;
        let hybrid = HybridState::read(hybrid, Clock::default())?;
        Some(Self {
            x,
            w,
            stuck_for,
            hybrid,
        })
    }

    /// The hybrid state, at the time `now`, and x and v there: those of the begin of a stick.
    pub(crate) fn hybrid(&self, drive_velocity: f64, now: Clock) -> (f64, f64, HybridState) {
        let hybrid = HybridState {
            clock: now.after(-self.stuck_for),
            ..self.hybrid
        };
        (
            self.x - drive_velocity * self.stuck_for,
            drive_velocity - self.w,
            hybrid,
        )
    }
}
