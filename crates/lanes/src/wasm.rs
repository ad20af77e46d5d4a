//! Two lanes in a register of WebAssembly, where the module is compiled for them.

use std::arch::wasm32::{
    f64x2, f64x2_abs, f64x2_add, f64x2_div, f64x2_extract_lane, f64x2_floor, f64x2_le, f64x2_lt, f64x2_mul,
    f64x2_neg, f64x2_replace_lane, f64x2_splat, f64x2_sqrt, f64x2_sub, i64x2_add, i64x2_extract_lane,
    i64x2_replace_lane, i64x2_shl, u64x2_shr, u64x2_splat, v128, v128_and, v128_any_true, v128_bitselect,
    v128_not, v128_or,
};
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use crate::{Lane, Mask};

/// A number in each of two lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Two(v128);

/// All bits of a lane are set, or none.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TwoFlags(v128);

macro_rules! operators {
    ($type:ident: $($name:ident $method:ident $instruction:ident),+) => {
        $(impl $name for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self($instruction(self.0, other.0))
            }
        })+
    };
}
operators!(Two: Add add f64x2_add, Sub sub f64x2_sub, Mul mul f64x2_mul, Div div f64x2_div);
operators!(TwoFlags: BitAnd bitand v128_and, BitOr bitor v128_or);

impl Neg for Two {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(f64x2_neg(self.0))
    }
}

impl Not for TwoFlags {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(v128_not(self.0))
    }
}

impl Mask for TwoFlags {
    #[inline(always)]
    fn none() -> Self {
        Self(u64x2_splat(0))
    }

    #[inline(always)]
    fn any(self) -> bool {
        v128_any_true(self.0)
    }

    #[inline(always)]
    fn at(self, i: usize) -> bool {
        0 != if i == 0 {
            i64x2_extract_lane::<0>(self.0)
        } else {
            i64x2_extract_lane::<1>(self.0)
        }
    }

    #[inline(always)]
    fn put(&mut self, i: usize, yes: bool) {
        let yes = -i64::from(yes);
        self.0 = if i == 0 {
            i64x2_replace_lane::<0>(self.0, yes)
        } else {
            i64x2_replace_lane::<1>(self.0, yes)
        };
    }
}

impl Lane for Two {
    const WIDTH: usize = 2;
    type Mask = TwoFlags;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self(f64x2_splat(x))
    }

    #[inline(always)]
    fn get(&self, i: usize) -> f64 {
        if i == 0 {
            f64x2_extract_lane::<0>(self.0)
        } else {
            f64x2_extract_lane::<1>(self.0)
        }
    }

    #[inline(always)]
    fn set(&mut self, i: usize, x: f64) {
        self.0 = if i == 0 {
            f64x2_replace_lane::<0>(self.0, x)
        } else {
            f64x2_replace_lane::<1>(self.0, x)
        };
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(f64x2_abs(self.0))
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(f64x2_sqrt(self.0))
    }

    #[inline(always)]
    fn floor(self) -> Self {
        Self(f64x2_floor(self.0))
    }

    #[inline(always)]
    fn below(self, other: Self) -> TwoFlags {
        TwoFlags(f64x2_lt(self.0, other.0))
    }

    #[inline(always)]
    fn at_most(self, other: Self) -> TwoFlags {
        TwoFlags(f64x2_le(self.0, other.0))
    }

    #[inline(always)]
    fn choose(mask: TwoFlags, yes: Self, no: Self) -> Self {
        Self(v128_bitselect(yes.0, no.0, mask.0))
    }

    #[inline(always)]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "only the lowest bits are wanted"
    )]
    fn pick<const T: usize>(self, table: &[f64; T]) -> Self {
        let entry = |bits: i64| table[bits as usize & (T - 1)];
        Self(f64x2(
            entry(i64x2_extract_lane::<0>(self.0)),
            entry(i64x2_extract_lane::<1>(self.0)),
        ))
    }

    #[inline(always)]
    fn stretch<const S: u32>(self, steps: Self) -> Self {
        Self(i64x2_add(self.0, i64x2_shl(u64x2_shr(steps.0, S), 52)))
    }
}
