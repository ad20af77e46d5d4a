//! What the state of a system is made of, and what a phase of its motion does and ends with.

use crate::dual::Dual;
use crate::law::{End, Memory, Piece};
use crate::scalar::Scalar;
use crate::system::System;

/// Numbers of a contact in a state: line of friction (offset, slope, low, high), memory (anchor, corner, last break-away
/// force), and how long it has stuck.
pub const CONTACT: usize = 10;
/// Where among them the ends of the line and the time of adhesion stand.
pub(super) const LOW: usize = 2;
pub(super) const HIGH: usize = 3;
pub(crate) const STICK_TIME: usize = 9;

/// What a contact does along a phase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContactMode {
    /// It sticks.
    Stick,
    /// It slips in a direction.
    Slip(f64),
    /// It slips in a direction at a speed held between two branches.
    Hold(f64),
}

impl ContactMode {
    /// Of a contact on a line of friction: an infinite slope says that the slip speed is held.
    pub(crate) fn of(direction: f64, slope: f64) -> Self {
        if direction == 0.0 {
            Self::Stick
        } else if slope == f64::INFINITY {
            Self::Hold(direction)
        } else {
            Self::Slip(direction)
        }
    }

    /// The direction of its slip, 0 while it sticks.
    pub(super) fn direction(self) -> f64 {
        match self {
            Self::Stick => 0.0,
            Self::Slip(direction) | Self::Hold(direction) => direction,
        }
    }
}

/// What ends a phase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ending {
    /// Adhesion breaks.
    Release,
    /// The line of friction ends, or friction leaves the hold over that end.
    Line(End),
    /// A turn of the slip speed of which the law is told nothing: a section.
    Section,
    /// A given time.
    Time,
}

/// One phase of an event sequence.
#[derive(Clone, Debug)]
pub struct Phase {
    /// What every contact does.
    pub contact_modes: Vec<ContactMode>,
    /// What ends it.
    pub ending: Ending,
    /// At which contact.
    pub contact: usize,
    /// How long it took where it was taken from.
    pub duration: f64,
}

/// What of a contact is no number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Flags {
    /// Branch of the law.
    pub branch: u32,
    /// Whether the law wants to know of turns.
    pub reverses: bool,
    /// Whether the anchor was set by a break-away.
    pub released: bool,
}

impl Flags {
    pub(super) fn of<N>(piece: &Piece<N>, memory: &Memory<N>) -> Self {
        Self {
            branch: piece.branch,
            reverses: piece.reverses,
            released: memory.released_at.is_some(),
        }
    }
}

/// The numbers of a line of friction and of a memory, in the order of a state.
pub(super) fn line_of<N: Scalar>(piece: &Piece<N>, memory: &Memory<N>) -> [N; STICK_TIME] {
    [
        piece.offset,
        piece.slope,
        piece.low,
        piece.high,
        memory.anchor[0],
        memory.anchor[1],
        memory.corner[0],
        memory.corner[1],
        memory.released_at.unwrap_or_default(),
    ]
}

/// What of a contact belongs to a state; a stick begins now.
pub(crate) fn contact_of(piece: &Piece, memory: &Memory) -> ([f64; CONTACT], Flags) {
    let mut numbers = [0.0; CONTACT];
    numbers[..STICK_TIME].copy_from_slice(&line_of(piece, memory));
    (numbers, Flags::of(piece, memory))
}

/// The state at the start of a phase.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// t; positions; velocities; [`CONTACT`] numbers of every contact.
    pub numbers: Vec<f64>,
    /// The rest of every contact.
    pub flags: Vec<Flags>,
}

/// Where the numbers of a state stand.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    /// How many masses.
    pub masses: usize,
    /// How many contacts.
    pub contacts: usize,
}

impl Layout {
    /// Of the states of a system.
    #[must_use]
    pub fn of(system: &System) -> Self {
        Self {
            masses: system.masses(),
            contacts: system.contacts.len(),
        }
    }

    /// Position of a mass.
    pub fn x(self, mass: usize) -> usize {
        1 + mass
    }

    /// Velocity of a mass.
    pub fn v(self, mass: usize) -> usize {
        1 + self.masses + mass
    }

    /// The first number of a contact.
    pub fn contact(self, contact: usize) -> usize {
        1 + 2 * self.masses + CONTACT * contact
    }

    /// How many numbers.
    pub fn width(self) -> usize {
        self.contact(self.contacts)
    }
}

/// A state whose numbers carry derivatives.
#[derive(Debug, Default)]
pub(super) struct Moving {
    pub(super) numbers: Vec<Dual>,
    pub(super) flags: Vec<Flags>,
}

/// A copy into a state that is there asks for no memory.
impl Clone for Moving {
    fn clone(&self) -> Self {
        Self {
            numbers: self.numbers.clone(),
            flags: self.flags.clone(),
        }
    }

    fn clone_from(&mut self, other: &Self) {
        self.numbers.clone_from(&other.numbers);
        self.flags.clone_from(&other.flags);
    }
}

impl State {
    /// The line of friction and the memory of contact `c`, whose numbers begin at `at`: what [`contact_of`] took.
    pub(crate) fn contact(&self, at: usize, c: usize) -> (Piece, Memory) {
        let (number, flags) = (|i: usize| self.numbers[at + i], self.flags[c]);
        let piece = Piece {
            offset: number(0),
            slope: number(1),
            low: number(LOW),
            high: number(HIGH),
            branch: flags.branch,
            reverses: flags.reverses,
        };
        let memory = Memory {
            anchor: [number(4), number(5)],
            corner: [number(6), number(7)],
            released_at: flags.released.then_some(number(8)),
            ..Memory::default()
        };
        (piece, memory)
    }

    /// Without derivatives, but for room of `directions`.
    pub(super) fn without_derivatives(&self, directions: usize) -> Moving {
        Moving {
            numbers: self
                .numbers
                .iter()
                .map(|&value| Dual::fixed(value, directions))
                .collect(),
            flags: self.flags.clone(),
        }
    }

    /// Every finite number with its derivatives, row after row of so many `columns`.
    pub(super) fn moving(&self, directions: usize, rows: &[f64], columns: usize) -> Moving {
        let mut moving = self.without_derivatives(directions);
        for (number, row) in moving.numbers.iter_mut().zip(rows.chunks_exact(columns)) {
            if number.value.is_finite() {
                number.rates[..columns].copy_from_slice(row);
            }
        }
        moving
    }

    /// Every finite number a direction of its own.
    pub(super) fn seeded(&self, directions: usize) -> Moving {
        let mut moving = self.without_derivatives(directions);
        for (axis, number) in moving.numbers.iter_mut().enumerate() {
            if number.value.is_finite() {
                number.rates[axis] = 1.0;
            }
        }
        moving
    }
}

impl Moving {
    /// Its values.
    pub(super) fn values(&self) -> State {
        State {
            numbers: self.numbers.iter().map(|number| number.value).collect(),
            flags: self.flags.clone(),
        }
    }
}
