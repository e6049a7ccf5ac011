//! Sixteen pixels side by side: one vector register with AVX-512, two with AVX2, four with SSE2.
//!
//! The lanes are an array in memory and vectors in the arithmetic: each operation loads, computes and stores, and the
//! compiler drops the loads and stores in between. (Loops over the array vectorise as well, but take the compiler a hundred
//! times longer.) `ISA` names the instructions of the function that the code is compiled into, see `dispatch`; everything
//! on the way there is `inline(always)`, or it would lose them.

use crate::number::{Mask, Number, Real};
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

pub const LANES: usize = 16;

/// The instructions that code is compiled for.
pub type Isa = u8;
/// What every processor of the architecture has: SSE2.
pub const PLAIN: Isa = 0;
/// AVX2 and FMA; on other architectures than x86-64, whatever has a fused multiply-add.
pub const FUSED: Isa = 1;
/// AVX-512 F, VL, DQ and BW.
pub const WIDE: Isa = 2;

#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Lane<const ISA: Isa>(pub [f32; LANES]);

/// All bits of a lane are set where the mask holds.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct LaneMask(pub [u32; LANES]);

#[cfg(target_arch = "x86_64")]
mod vector {
    //! The operations, register by register.
    // SAFETY, for the whole module: `ISA` names instructions that `dispatch` has found the processor to have, and every
    // pointer is to an array of sixteen elements aligned to 64 bytes.
    use super::{FUSED, Isa, LANES, Lane, LaneMask, WIDE};
    use std::arch::x86_64::*;

    macro_rules! operation {
        ($name:ident($($argument:ident),+), $wide:ident, $fused:ident, $plain:ident) => {
            #[inline(always)]
            pub fn $name<const ISA: Isa>($($argument: &Lane<ISA>),+) -> Lane<ISA> {
                let mut result = Lane([0.0; LANES]);
                let out = result.0.as_mut_ptr();
                $(let $argument = $argument.0.as_ptr();)+
                unsafe {
                    match ISA {
                        WIDE => _mm512_store_ps(out, $wide($(_mm512_load_ps($argument)),+)),
                        FUSED => {
                            for i in [0, 8] {
                                _mm256_store_ps(out.add(i), $fused($(_mm256_load_ps($argument.add(i))),+));
                            }
                        }
                        _ => {
                            for i in [0, 4, 8, 12] {
                                _mm_store_ps(out.add(i), $plain($(_mm_load_ps($argument.add(i))),+));
                            }
                        }
                    }
                }
                result
            }
        };
    }
    operation!(add(a, b), _mm512_add_ps, _mm256_add_ps, _mm_add_ps);
    operation!(sub(a, b), _mm512_sub_ps, _mm256_sub_ps, _mm_sub_ps);
    operation!(mul(a, b), _mm512_mul_ps, _mm256_mul_ps, _mm_mul_ps);
    operation!(div(a, b), _mm512_div_ps, _mm256_div_ps, _mm_div_ps);
    // Both return the second operand where either is not a number, unlike f32::min.
    operation!(min(a, b), _mm512_min_ps, _mm256_min_ps, _mm_min_ps);
    operation!(max(a, b), _mm512_max_ps, _mm256_max_ps, _mm_max_ps);
    operation!(sqrt(a), _mm512_sqrt_ps, _mm256_sqrt_ps, _mm_sqrt_ps);
    operation!(mul_add(a, b, c), _mm512_fmadd_ps, _mm256_fmadd_ps, plain_mul_add);

    #[inline(always)]
    unsafe fn plain_mul_add(a: __m128, b: __m128, c: __m128) -> __m128 {
        unsafe { _mm_add_ps(_mm_mul_ps(a, b), c) }
    }

    #[inline(always)]
    pub fn lt<const ISA: Isa>(a: &Lane<ISA>, b: &Lane<ISA>) -> LaneMask {
        let mut result = LaneMask([0; LANES]);
        let out = result.0.as_mut_ptr().cast::<f32>();
        let (a, b) = (a.0.as_ptr(), b.0.as_ptr());
        unsafe {
            match ISA {
                WIDE => {
                    let mask = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(_mm512_load_ps(a), _mm512_load_ps(b));
                    _mm512_store_si512(out.cast(), _mm512_movm_epi32(mask));
                }
                FUSED => {
                    for i in [0, 8] {
                        let mask = _mm256_cmp_ps::<_CMP_LT_OQ>(_mm256_load_ps(a.add(i)), _mm256_load_ps(b.add(i)));
                        _mm256_store_ps(out.add(i), mask);
                    }
                }
                _ => {
                    for i in [0, 4, 8, 12] {
                        _mm_store_ps(out.add(i), _mm_cmplt_ps(_mm_load_ps(a.add(i)), _mm_load_ps(b.add(i))));
                    }
                }
            }
        }
        result
    }

    #[inline(always)]
    pub fn select<const ISA: Isa>(mask: &LaneMask, yes: &Lane<ISA>, no: &Lane<ISA>) -> Lane<ISA> {
        let mut result = Lane([0.0; LANES]);
        let out = result.0.as_mut_ptr();
        let (mask, yes, no) = (mask.0.as_ptr().cast::<f32>(), yes.0.as_ptr(), no.0.as_ptr());
        unsafe {
            match ISA {
                WIDE => {
                    let mask = _mm512_movepi32_mask(_mm512_load_si512(mask.cast()));
                    _mm512_store_ps(out, _mm512_mask_blend_ps(mask, _mm512_load_ps(no), _mm512_load_ps(yes)));
                }
                FUSED => {
                    for i in [0, 8] {
                        let (yes, no) = (_mm256_load_ps(yes.add(i)), _mm256_load_ps(no.add(i)));
                        _mm256_store_ps(out.add(i), _mm256_blendv_ps(no, yes, _mm256_load_ps(mask.add(i))));
                    }
                }
                _ => {
                    for i in [0, 4, 8, 12] {
                        let mask = _mm_load_ps(mask.add(i));
                        let yes = _mm_and_ps(mask, _mm_load_ps(yes.add(i)));
                        let no = _mm_andnot_ps(mask, _mm_load_ps(no.add(i)));
                        _mm_store_ps(out.add(i), _mm_or_ps(yes, no));
                    }
                }
            }
        }
        result
    }
}

#[cfg(not(target_arch = "x86_64"))]
mod vector {
    //! The operations as loops.
    use super::{Isa, Lane, LaneMask, PLAIN};
    use std::array::from_fn;

    macro_rules! operation {
        ($name:ident($($argument:ident),+), $function:expr) => {
            #[inline(always)]
            pub fn $name<const ISA: Isa>($($argument: &Lane<ISA>),+) -> Lane<ISA> {
                Lane(from_fn(|i| $function($($argument.0[i]),+)))
            }
        };
    }
    operation!(add(a, b), |a, b| a + b);
    operation!(sub(a, b), |a, b| a - b);
    operation!(mul(a, b), |a, b| a * b);
    operation!(div(a, b), |a, b| a / b);
    operation!(min(a, b), |a, b| if a < b { a } else { b });
    operation!(max(a, b), |a, b| if a > b { a } else { b });
    operation!(sqrt(a), f32::sqrt);
    operation!(mul_add(a, b, c), |a, b, c| if ISA == PLAIN { a * b + c } else { f32::mul_add(a, b, c) });

    #[inline(always)]
    pub fn lt<const ISA: Isa>(a: &Lane<ISA>, b: &Lane<ISA>) -> LaneMask {
        LaneMask(from_fn(|i| if a.0[i] < b.0[i] { u32::MAX } else { 0 }))
    }

    #[inline(always)]
    pub fn select<const ISA: Isa>(mask: &LaneMask, yes: &Lane<ISA>, no: &Lane<ISA>) -> Lane<ISA> {
        Lane(from_fn(|i| if mask.0[i] != 0 { yes.0[i] } else { no.0[i] }))
    }
}

/// Calls a function of lanes without inlining it, in a version compiled for the instructions that `ISA` names.
///
/// The fit's larger pieces are called so: inlined wherever they are used they would take minutes to compile.
#[inline(always)]
pub fn outlined<const ISA: Isa, T>(function: impl FnOnce() -> T) -> T {
    #[cfg(target_arch = "x86_64")]
    {
        #[inline]
        #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma")]
        fn wide<T>(function: impl FnOnce() -> T) -> T {
            function()
        }
        #[inline]
        #[target_feature(enable = "avx2,fma")]
        fn fused<T>(function: impl FnOnce() -> T) -> T {
            function()
        }
        // SAFETY: `ISA` names instructions that `dispatch` has found the processor to have.
        match ISA {
            WIDE => return unsafe { wide(function) },
            FUSED => return unsafe { fused(function) },
            _ => {}
        }
    }
    // Nothing else keeps the compiler from inlining it: the instructions are those of the caller.
    #[inline(never)]
    fn plain<T>(function: impl FnOnce() -> T) -> T {
        function()
    }
    plain(function)
}

impl LaneMask {
    pub const ALL: Self = LaneMask([u32::MAX; LANES]);
    pub const NONE: Self = LaneMask([0; LANES]);

    #[cfg(test)]
    pub fn new(holds: impl Fn(usize) -> bool) -> Self {
        let mut mask = [0; LANES];
        for (i, lane) in mask.iter_mut().enumerate() {
            *lane = if holds(i) { u32::MAX } else { 0 };
        }
        LaneMask(mask)
    }

    #[inline(always)]
    pub fn holds(self, lane: usize) -> bool {
        self.0[lane] != 0
    }

    #[inline(always)]
    pub fn set(&mut self, lane: usize, holds: bool) {
        self.0[lane] = if holds { u32::MAX } else { 0 };
    }
}

impl Mask for LaneMask {
    #[inline(always)]
    fn any(self) -> bool {
        self.0.iter().fold(0, |all, lane| all | lane) != 0
    }
}

// Element by element: the compiler makes the widest vectors of it that the instructions have. Spelt out in pieces of 128
// bits, this cost the fit a fifth of its time.
macro_rules! logic {
    ($trait:ident, $method:ident, $operator:tt) => {
        impl $trait for LaneMask {
            type Output = Self;
            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                for i in 0..LANES {
                    self.0[i] $operator other.0[i];
                }
                self
            }
        }
    };
}
logic!(BitAnd, bitand, &=);
logic!(BitOr, bitor, |=);
logic!(BitXor, bitxor, ^=);

impl Not for LaneMask {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        self ^ Self::ALL
    }
}

macro_rules! arithmetic {
    ($trait:ident, $method:ident) => {
        impl<const ISA: Isa> $trait for Lane<ISA> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                vector::$method(&self, &other)
            }
        }
    };
}
arithmetic!(Add, add);
arithmetic!(Sub, sub);
arithmetic!(Mul, mul);
arithmetic!(Div, div);

impl<const ISA: Isa> Neg for Lane<ISA> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        vector::sub(&Lane([-0.0; LANES]), &self)
    }
}

impl<const ISA: Isa> Lane<ISA> {
    #[inline(always)]
    pub fn abs(self) -> Self {
        self.max(-self)
    }

    /// Σ coefficients[i] · self^i by Horner's rule.
    #[inline(always)]
    fn polynomial<const N: usize>(self, coefficients: [f32; N]) -> Self {
        let mut sum = Lane([coefficients[N - 1]; LANES]);
        for i in (0..N - 1).rev() {
            sum = sum.mul_add(self, Lane([coefficients[i]; LANES]));
        }
        sum
    }

    /// Natural logarithm of positive normal numbers, to 2 units in the last place.
    #[inline(always)]
    pub fn ln(self) -> Self {
        // x = m · 2^e with m in [√½, √2): subtracting √½'s bits makes the exponent field count from there.
        const SQRT_HALF_BITS: i32 = 0x3f35_04f3;
        let mut exponent = [0.0f32; LANES];
        let mut mantissa = [0.0f32; LANES];
        for i in 0..LANES {
            let offset = self.0[i].to_bits() as i32 - SQRT_HALF_BITS;
            let e = offset >> 23;
            exponent[i] = e as f32;
            mantissa[i] = f32::from_bits((self.0[i].to_bits() as i32 - (e << 23)) as u32) - 1.0;
        }
        // Minimax polynomial of (ln(1 + f) − f + f²/2) / f³ on [√½ − 1, √2 − 1] (Cephes, logf).
        let f = Self(mantissa);
        let z = f * f;
        let tail = f.polynomial([
            3.333_333e-1,
            -2.499_999_4e-1,
            2.000_071_5e-1,
            -1.666_805_7e-1,
            1.424_932_3e-1,
            -1.242_014_1e-1,
            1.167_699_9e-1,
            -1.151_461e-1,
            7.037_683_6e-2,
        ]);
        let series = f * z * tail - Self([0.5; LANES]) * z + f;
        Self(exponent).mul_add(Self([std::f32::consts::LN_2; LANES]), series)
    }
}

impl<const ISA: Isa> Number for Lane<ISA> {
    type Real = Self;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Lane([value as f32; LANES])
    }
    #[inline(always)]
    fn constant(value: Self) -> Self {
        value
    }
    #[inline(always)]
    fn value(self) -> Self {
        self
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        vector::sqrt(&self)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        // e^x = 2^k · e^r with |r| ≤ ln 2 / 2; k by adding and subtracting 1.5 · 2^23, which rounds to an integer.
        const ROUND: f32 = 12_582_912.0;
        // Beyond these bounds the result leaves f32's normal range.
        let x = self.max(Self::splat(-87.0)).min(Self::splat(88.0));
        let shifted = x.mul_add(Self::splat(std::f64::consts::LOG2_E), Self([ROUND; LANES]));
        let k = shifted - Self([ROUND; LANES]);
        // ln 2 in two parts, so that k · ln 2 is exact to twice f32's precision.
        let r = k.mul_add(Self([-0.693_359_4; LANES]), x);
        let r = k.mul_add(Self([2.121_944_4e-4; LANES]), r);
        let power =
            r.polynomial([1.0, 1.0, 0.5, 1.666_666_6e-1, 4.166_579_6e-2, 8.333_452e-3, 1.398_2e-3, 1.987_569_2e-4]);
        let mut result = [0.0; LANES];
        for i in 0..LANES {
            let exponent = (k.0[i] as i32 + 127) << 23;
            result[i] = power.0[i] * f32::from_bits(exponent as u32);
        }
        Lane(result)
    }
    #[inline(always)]
    fn ln_1p(self) -> Self {
        // ln(1 + x) = ln(u) · x / (u − 1) with u = 1 + x rounded ([Goldberg1991], theorem 4): u − 1 is exact.
        let u = Self::splat(1.0) + self;
        let difference = u - Self::splat(1.0);
        let rounded_away = !(difference.abs().positive());
        let divisor = Self::select(rounded_away, Self::splat(1.0), difference);
        Self::select(rounded_away, self, u.ln() * self / divisor)
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        vector::mul_add(&self, &factor, &addend)
    }
    #[inline(always)]
    fn scale_add(self, factor: Self, addend: Self) -> Self {
        self.mul_add(factor, addend)
    }
    #[inline(always)]
    fn select(mask: LaneMask, yes: Self, no: Self) -> Self {
        vector::select(&mask, &yes, &no)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        vector::min(&self, &other)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        vector::max(&self, &other)
    }
}

impl<const ISA: Isa> Real for Lane<ISA> {
    type Mask = LaneMask;

    #[inline(always)]
    fn lt(self, other: Self) -> LaneMask {
        vector::lt(&self, &other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(function: impl Fn(Lane<PLAIN>) -> Lane<PLAIN>, exact: impl Fn(f64) -> f64, range: (f64, f64), bound: f64) {
        for i in 0..=10_000 {
            let x = (range.0 + (range.1 - range.0) * i as f64 / 10_000.0) as f32;
            let (got, want) = (function(Lane([x; LANES])).0[3] as f64, exact(x as f64));
            assert!((got - want).abs() <= bound * want.abs() + 1e-37, "f({x}) = {got}, want {want}");
        }
    }

    #[test]
    fn exp_is_accurate_to_two_units_in_the_last_place() {
        check(|x| x.exp(), f64::exp, (-86.0, 87.0), 2.4e-7);
    }

    #[test]
    fn ln_is_accurate_to_two_units_in_the_last_place() {
        check(|x| x.ln(), f64::ln, (1.5, 1e6), 2.4e-7);
        check(|x| x.ln(), f64::ln, (1e-6, 0.7), 2.4e-7);
    }

    #[test]
    fn ln_1p_is_accurate_near_zero() {
        check(|x| x.ln_1p(), f64::ln_1p, (-1e-3, 1e-3), 4e-7);
        check(|x| x.ln_1p(), f64::ln_1p, (-0.999, -1e-3), 4e-7);
    }
}
