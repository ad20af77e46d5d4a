//! Lanes as an array: any processor, one lane or several.

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use crate::{Lane, Mask};

/// What is added to this number is rounded to a whole one.
const WHOLE: f64 = 1.5 * (1_u64 << 52) as f64;

/// A number in each of N lanes.
#[derive(Clone, Copy, Debug)]
pub struct Array<const N: usize>([f64; N]);

/// A yes or no in each of N lanes.
#[derive(Clone, Copy, Debug)]
pub struct Flags<const N: usize>([bool; N]);

impl<const N: usize> Array<N> {
    #[inline(always)]
    fn with(self, other: Self, of: impl Fn(f64, f64) -> f64) -> Self {
        Self(std::array::from_fn(|i| of(self.0[i], other.0[i])))
    }
}

macro_rules! arithmetic {
    ($($name:ident $method:ident $operator:tt),+) => {
        $(impl<const N: usize> $name for Array<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.with(other, |a, b| a $operator b)
            }
        })+
    };
}
arithmetic!(Add add +, Sub sub -, Mul mul *, Div div /);

impl<const N: usize> Neg for Array<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(|a| -a))
    }
}

macro_rules! logic {
    ($($name:ident $method:ident $operator:tt),+) => {
        $(impl<const N: usize> $name for Flags<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(std::array::from_fn(|i| self.0[i] $operator other.0[i]))
            }
        })+
    };
}
logic!(BitAnd bitand &, BitOr bitor |);

impl<const N: usize> Not for Flags<N> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(self.0.map(|yes| !yes))
    }
}

impl<const N: usize> Mask for Flags<N> {
    #[inline(always)]
    fn none() -> Self {
        Self([false; N])
    }

    #[inline(always)]
    fn any(self) -> bool {
        self.0.iter().fold(false, |any, &yes| any | yes)
    }

    #[inline(always)]
    fn at(self, i: usize) -> bool {
        self.0[i]
    }

    #[inline(always)]
    fn put(&mut self, i: usize, yes: bool) {
        self.0[i] = yes;
    }
}

impl<const N: usize> Lane for Array<N> {
    const WIDTH: usize = N;
    type Mask = Flags<N>;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self([x; N])
    }

    #[inline(always)]
    fn get(&self, i: usize) -> f64 {
        self.0[i]
    }

    #[inline(always)]
    fn set(&mut self, i: usize, x: f64) {
        self.0[i] = x;
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(f64::abs))
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f64::sqrt))
    }

    #[inline(always)]
    fn floor(self) -> Self {
        // Not every processor has an instruction for it, and a call costs five times as much.
        Self(self.0.map(|x| {
            let near = (x + WHOLE) - WHOLE;
            if near > x { near - 1.0 } else { near }
        }))
    }

    #[inline(always)]
    fn below(self, other: Self) -> Flags<N> {
        Flags(std::array::from_fn(|i| self.0[i] < other.0[i]))
    }

    #[inline(always)]
    fn at_most(self, other: Self) -> Flags<N> {
        Flags(std::array::from_fn(|i| self.0[i] <= other.0[i]))
    }

    #[inline(always)]
    fn choose(mask: Flags<N>, yes: Self, no: Self) -> Self {
        Self(std::array::from_fn(
            |i| if mask.0[i] { yes.0[i] } else { no.0[i] },
        ))
    }

    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "only the lowest bits are wanted")]
    fn pick<const T: usize>(self, table: &[f64; T]) -> Self {
        Self(self.0.map(|x| table[x.to_bits() as usize & (T - 1)]))
    }

    #[inline(always)]
    fn stretch<const S: u32>(self, steps: Self) -> Self {
        self.with(steps, |x, steps| {
            f64::from_bits(x.to_bits().wrapping_add((steps.to_bits() >> S) << 52))
        })
    }
}
