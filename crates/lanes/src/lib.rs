//! Numbers side by side in the registers of a processor: one a lane.
//!
//! Every operation is the one that IEEE 754 defines and none is fused, so a lane has the same bits in every [`Width`]. What is
//! written once over [`Lane`] as a [`Task`] is compiled for every width, and [`run`] takes one that the processor has.
//!
//! All that needs `unsafe` for the sake of speed is here: the instructions of one kind of processor, and the call of code that
//! was compiled for it.
#![expect(
    clippy::inline_always,
    reason = "what is not inlined is not compiled for the width"
)]
#![expect(
    clippy::return_self_not_must_use,
    reason = "these are numbers: the attribute would be noise"
)]

mod array;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
mod wasm;
#[cfg(target_arch = "x86_64")]
mod x86;

use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

pub use array::Array;

/// A number in every lane.
pub trait Lane:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// How many lanes there are.
    const WIDTH: usize;
    /// A yes or no in every lane.
    type Mask: Mask;
    /// The same number in every lane.
    fn splat(x: f64) -> Self;
    /// The number in lane `i`; of a register in memory no other is read.
    fn get(&self, i: usize) -> f64;
    /// Write the number in lane `i`.
    fn set(&mut self, i: usize, x: f64);
    /// |x|.
    fn abs(self) -> Self;
    /// √x.
    fn sqrt(self) -> Self;
    /// The largest whole number not above x, for |x| < 2⁵¹.
    fn floor(self) -> Self;
    /// x < y; no where one is not a number.
    fn below(self, other: Self) -> Self::Mask;
    /// x ≤ y; no where one is not a number.
    fn at_most(self, other: Self) -> Self::Mask;
    /// `yes` where the mask says so, else `no`.
    fn choose(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// The entry of a table whose place is in the lowest bits of x. N is a power of two.
    fn pick<const N: usize>(self, table: &[f64; N]) -> Self;
    /// x with the bits of `steps`, without the lowest S, added to its exponent.
    fn stretch<const S: u32>(self, steps: Self) -> Self;

    /// The smaller.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::choose(self.below(other), self, other)
    }

    /// The larger.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::choose(other.below(self), self, other)
    }
}

/// One number, on any processor.
pub type Single = Array<1>;

/// Two numbers, on any processor.
#[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
type Two = Array<2>;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
use wasm::Two;

/// A yes or no in every lane.
pub trait Mask: Copy + Debug + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    /// No in every lane.
    fn none() -> Self;
    /// Whether any lane has a yes.
    fn any(self) -> bool;
    /// That of lane `i`.
    fn at(self, i: usize) -> bool;
    /// Write that of lane `i`.
    fn put(&mut self, i: usize, yes: bool);
}

/// What is done in lanes. Everything it calls must be inlined, or it is not compiled for the width.
pub trait Task {
    /// What comes of it.
    type Output;
    /// Do it.
    fn run<L: Lane>(self) -> Self::Output;
}

/// How many lanes, and by which instructions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Width {
    /// One lane.
    One,
    /// Two lanes, on any processor; in a browser also for one.
    Two,
    /// Eight lanes in two registers of four.
    Avx2,
    /// Sixteen lanes in two registers of eight.
    Avx512,
}

impl Width {
    /// Every width, the widest first.
    pub const ALL: [Self; 4] = [Self::Avx512, Self::Avx2, Self::Two, Self::One];

    /// Whether this processor has it.
    pub fn available(self) -> bool {
        match self {
            Self::One | Self::Two => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq"),
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 | Self::Avx512 => false,
        }
    }

    /// One that so few or so many tasks can fill, if this processor has it.
    #[must_use]
    pub fn for_lanes(tasks: usize) -> Self {
        match tasks {
            0 | 1 => Self::One,
            2 | 3 => Self::Two,
            4..8 if Self::Avx2.available() => Self::Avx2,
            _ => Self::widest(),
        }
    }

    /// The widest that this processor has.
    #[must_use]
    pub fn widest() -> Self {
        let first = Self::ALL.into_iter().find(|width| width.available());
        first.unwrap_or(Self::One)
    }
}

/// Do a task in a width; in the widest there is where the processor does not have that one.
pub fn run<T: Task>(task: T, width: Width) -> T::Output {
    match if width.available() { width } else { Width::widest() } {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: this processor has the instructions.
        Width::Avx2 => unsafe { x86::in_eight(task) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as above.
        Width::Avx512 => unsafe { x86::in_sixteen(task) },
        // In a browser one copy of a task does: what is loaded must be small.
        Width::One if cfg!(not(target_arch = "wasm32")) => task.run::<Single>(),
        _ => task.run::<Two>(),
    }
}
