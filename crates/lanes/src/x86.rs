//! Lanes in the registers of AVX2 and AVX-512.
//!
//! These types are known to this module alone: they exist only inside a [`Task`] that was compiled for their instructions and
//! is called where the processor has them. That is what makes every call of an instruction below safe.

#[allow(clippy::wildcard_imports, reason = "instructions have no better names")]
use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use crate::{Lane, Mask, Task};

/// Do a task in two registers of four lanes.
#[target_feature(enable = "avx2")]
pub(crate) fn in_eight<T: Task>(task: T) -> T::Output {
    task.run::<Pair<Four>>()
}

/// Do a task in two registers of eight lanes.
#[target_feature(enable = "avx512f,avx512dq")]
pub(crate) fn in_sixteen<T: Task>(task: T) -> T::Output {
    task.run::<Pair<Eight>>()
}

/// An expression of instructions, see the top of this file.
macro_rules! safe {
    ($work:expr) => {
        // SAFETY: code with this type runs only where the processor has its instructions; what is read and written through
        // pointers are arrays of as many numbers, or entries of a table whose length the index is cut to.
        unsafe { $work }
    };
}

macro_rules! operators {
    ($type:ident: $($name:ident $method:ident $instruction:ident),+) => {
        $(impl $name for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(safe!($instruction(self.0, other.0)))
            }
        })+
    };
}

/// One number is read or written, not the whole register: many structures are read and written lane by lane.
macro_rules! by_lane {
    ($width:literal) => {
        #[inline(always)]
        fn get(&self, i: usize) -> f64 {
            assert!(i < $width, "a lane of the register");
            let first = std::ptr::from_ref(&self.0).cast::<f64>();
            // SAFETY: a register is so many numbers one after the other.
            unsafe { *first.add(i) }
        }

        #[inline(always)]
        fn set(&mut self, i: usize, x: f64) {
            assert!(i < $width, "a lane of the register");
            let first = std::ptr::from_mut(&mut self.0).cast::<f64>();
            // SAFETY: as above.
            unsafe { *first.add(i) = x };
        }
    };
}

#[derive(Clone, Copy, Debug)]
struct Eight(__m512d);

#[derive(Clone, Copy, Debug)]
struct EightFlags(__mmask8);

operators!(Eight: Add add _mm512_add_pd, Sub sub _mm512_sub_pd, Mul mul _mm512_mul_pd, Div div _mm512_div_pd);

impl Neg for Eight {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(safe!(_mm512_xor_pd(self.0, _mm512_set1_pd(-0.0))))
    }
}

impl BitAnd for EightFlags {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl BitOr for EightFlags {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl Not for EightFlags {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0)
    }
}

impl Mask for EightFlags {
    #[inline(always)]
    fn none() -> Self {
        Self(0)
    }

    #[inline(always)]
    fn any(self) -> bool {
        self.0 != 0
    }

    #[inline(always)]
    fn at(self, i: usize) -> bool {
        (self.0 >> i) & 1 == 1
    }

    #[inline(always)]
    fn put(&mut self, i: usize, yes: bool) {
        self.0 = self.0 & !(1 << i) | u8::from(yes) << i;
    }
}

impl Lane for Eight {
    const WIDTH: usize = 8;
    type Mask = EightFlags;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self(safe!(_mm512_set1_pd(x)))
    }

    by_lane!(8);

    #[inline(always)]
    fn abs(self) -> Self {
        Self(safe!(_mm512_abs_pd(self.0)))
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(safe!(_mm512_sqrt_pd(self.0)))
    }

    #[inline(always)]
    fn floor(self) -> Self {
        Self(safe!(_mm512_roundscale_pd::<_MM_FROUND_TO_NEG_INF>(self.0)))
    }

    #[inline(always)]
    fn below(self, other: Self) -> EightFlags {
        EightFlags(safe!(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, other.0)))
    }

    #[inline(always)]
    fn at_most(self, other: Self) -> EightFlags {
        EightFlags(safe!(_mm512_cmp_pd_mask::<_CMP_LE_OQ>(self.0, other.0)))
    }

    #[inline(always)]
    fn choose(mask: EightFlags, yes: Self, no: Self) -> Self {
        Self(safe!(_mm512_mask_blend_pd(mask.0, no.0, yes.0)))
    }

    #[inline(always)]
    #[expect(clippy::cast_possible_wrap, reason = "tables are short")]
    fn pick<const N: usize>(self, table: &[f64; N]) -> Self {
        const { assert!(N.is_power_of_two()) };
        Self(safe!({
            let place = _mm512_and_si512(_mm512_castpd_si512(self.0), _mm512_set1_epi64(N as i64 - 1));
            _mm512_i64gather_pd::<8>(place, table.as_ptr())
        }))
    }

    #[inline(always)]
    fn stretch<const S: u32>(self, steps: Self) -> Self {
        Self(safe!({
            let steps = _mm512_srli_epi64::<S>(_mm512_castpd_si512(steps.0));
            let bits = _mm512_add_epi64(_mm512_castpd_si512(self.0), _mm512_slli_epi64::<52>(steps));
            _mm512_castsi512_pd(bits)
        }))
    }
}

#[derive(Clone, Copy, Debug)]
struct Four(__m256d);

/// All bits of a lane are set, or none.
#[derive(Clone, Copy, Debug)]
struct FourFlags(__m256d);

operators!(Four: Add add _mm256_add_pd, Sub sub _mm256_sub_pd, Mul mul _mm256_mul_pd, Div div _mm256_div_pd);
operators!(FourFlags: BitAnd bitand _mm256_and_pd, BitOr bitor _mm256_or_pd);

impl Neg for Four {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(safe!(_mm256_xor_pd(self.0, _mm256_set1_pd(-0.0))))
    }
}

impl Not for FourFlags {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        let all = safe!(_mm256_castsi256_pd(_mm256_set1_epi64x(-1)));
        Self(safe!(_mm256_xor_pd(self.0, all)))
    }
}

impl Mask for FourFlags {
    #[inline(always)]
    fn none() -> Self {
        Self(safe!(_mm256_setzero_pd()))
    }

    #[inline(always)]
    fn any(self) -> bool {
        safe!(_mm256_movemask_pd(self.0)) != 0
    }

    #[inline(always)]
    fn at(self, i: usize) -> bool {
        (safe!(_mm256_movemask_pd(self.0)) >> i) & 1 == 1
    }

    #[inline(always)]
    fn put(&mut self, i: usize, yes: bool) {
        let mut lanes = [0.0; 4];
        safe!(_mm256_storeu_pd(lanes.as_mut_ptr(), self.0));
        lanes[i] = f64::from_bits(if yes { u64::MAX } else { 0 });
        self.0 = safe!(_mm256_loadu_pd(lanes.as_ptr()));
    }
}

impl Lane for Four {
    const WIDTH: usize = 4;
    type Mask = FourFlags;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self(safe!(_mm256_set1_pd(x)))
    }

    by_lane!(4);

    #[inline(always)]
    fn abs(self) -> Self {
        Self(safe!(_mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0)))
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(safe!(_mm256_sqrt_pd(self.0)))
    }

    #[inline(always)]
    fn floor(self) -> Self {
        Self(safe!(_mm256_floor_pd(self.0)))
    }

    #[inline(always)]
    fn below(self, other: Self) -> FourFlags {
        FourFlags(safe!(_mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0)))
    }

    #[inline(always)]
    fn at_most(self, other: Self) -> FourFlags {
        FourFlags(safe!(_mm256_cmp_pd::<_CMP_LE_OQ>(self.0, other.0)))
    }

    #[inline(always)]
    fn choose(mask: FourFlags, yes: Self, no: Self) -> Self {
        Self(safe!(_mm256_blendv_pd(no.0, yes.0, mask.0)))
    }

    #[inline(always)]
    #[expect(clippy::cast_possible_wrap, reason = "tables are short")]
    fn pick<const N: usize>(self, table: &[f64; N]) -> Self {
        const { assert!(N.is_power_of_two()) };
        Self(safe!({
            let place = _mm256_and_si256(_mm256_castpd_si256(self.0), _mm256_set1_epi64x(N as i64 - 1));
            _mm256_i64gather_pd::<8>(table.as_ptr(), place)
        }))
    }

    #[inline(always)]
    fn stretch<const S: u32>(self, steps: Self) -> Self {
        Self(safe!({
            let count = _mm_cvtsi32_si128(S.cast_signed());
            let steps = _mm256_srl_epi64(_mm256_castpd_si256(steps.0), count);
            let bits = _mm256_add_epi64(_mm256_castpd_si256(self.0), _mm256_slli_epi64::<52>(steps));
            _mm256_castsi256_pd(bits)
        }))
    }
}

/// Two registers side by side, so that one need not wait for the other.
#[derive(Clone, Copy, Debug)]
struct Pair<T>(T, T);

macro_rules! both {
    ($bound:ident: $($name:ident $method:ident $operator:tt),+) => {
        $(impl<T: $bound> $name for Pair<T> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0 $operator other.0, self.1 $operator other.1)
            }
        })+
    };
}
both!(Lane: Add add +, Sub sub -, Mul mul *, Div div /);

impl<T: Neg<Output = T>> Neg for Pair<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

/// The masks of both, and how many lanes the first has.
#[derive(Clone, Copy, Debug)]
struct PairFlags<M, const N: usize>(M, M);

macro_rules! both_flags {
    ($($name:ident $method:ident $operator:tt),+) => {
        $(impl<M: Mask, const N: usize> $name for PairFlags<M, N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0 $operator other.0, self.1 $operator other.1)
            }
        })+
    };
}
both_flags!(BitAnd bitand &, BitOr bitor |);

impl<M: Mask, const N: usize> Not for PairFlags<M, N> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0, !self.1)
    }
}

impl<M: Mask, const N: usize> Mask for PairFlags<M, N> {
    #[inline(always)]
    fn none() -> Self {
        Self(M::none(), M::none())
    }

    #[inline(always)]
    fn any(self) -> bool {
        self.0.any() | self.1.any()
    }

    #[inline(always)]
    fn at(self, i: usize) -> bool {
        if i < N { self.0.at(i) } else { self.1.at(i - N) }
    }

    #[inline(always)]
    fn put(&mut self, i: usize, yes: bool) {
        if i < N {
            self.0.put(i, yes);
        } else {
            self.1.put(i - N, yes);
        }
    }
}

macro_rules! pairs {
    ($type:ident, $width:literal) => {
        impl Lane for Pair<$type> {
            const WIDTH: usize = 2 * $width;
            type Mask = PairFlags<<$type as Lane>::Mask, $width>;

            #[inline(always)]
            fn splat(x: f64) -> Self {
                Self($type::splat(x), $type::splat(x))
            }

            #[inline(always)]
            fn get(&self, i: usize) -> f64 {
                if i < $width {
                    self.0.get(i)
                } else {
                    self.1.get(i - $width)
                }
            }

            #[inline(always)]
            fn set(&mut self, i: usize, x: f64) {
                if i < $width {
                    self.0.set(i, x);
                } else {
                    self.1.set(i - $width, x);
                }
            }

            #[inline(always)]
            fn abs(self) -> Self {
                Self(self.0.abs(), self.1.abs())
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                Self(self.0.sqrt(), self.1.sqrt())
            }

            #[inline(always)]
            fn floor(self) -> Self {
                Self(self.0.floor(), self.1.floor())
            }

            #[inline(always)]
            fn below(self, other: Self) -> Self::Mask {
                PairFlags(self.0.below(other.0), self.1.below(other.1))
            }

            #[inline(always)]
            fn at_most(self, other: Self) -> Self::Mask {
                PairFlags(self.0.at_most(other.0), self.1.at_most(other.1))
            }

            #[inline(always)]
            fn choose(mask: Self::Mask, yes: Self, no: Self) -> Self {
                Self(
                    $type::choose(mask.0, yes.0, no.0),
                    $type::choose(mask.1, yes.1, no.1),
                )
            }

            #[inline(always)]
            fn pick<const N: usize>(self, table: &[f64; N]) -> Self {
                Self(self.0.pick(table), self.1.pick(table))
            }

            #[inline(always)]
            fn stretch<const S: u32>(self, steps: Self) -> Self {
                Self(self.0.stretch::<S>(steps.0), self.1.stretch::<S>(steps.1))
            }
        }
    };
}
pairs!(Four, 4);
pairs!(Eight, 8);
