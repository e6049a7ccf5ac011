//! The arithmetic that a reflectance model may use.
//!
//! A model is written once, generic over [`Number`], and runs on f64 (golden values), on lanes of f32 (rendering) and on
//! dual numbers over either (derivatives for the fit).

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// An array made from its indices: `array!(|i| expression)`.
///
/// `std::array::from_fn` and `map` do the same, but neither they nor a closure are sure to be inlined, and what is not
/// inlined loses the instruction set, see `lanes`.
macro_rules! array {
    (|$i:ident| $element:expr) => {
        $crate::number::array_from(
            #[inline(always)]
            |$i| $element,
        )
    };
}
pub(crate) use array;

#[inline(always)]
pub fn array_from<T: Copy, const N: usize>(mut element: impl FnMut(usize) -> T) -> [T; N] {
    let mut result = [element(0); N];
    for (i, value) in result.iter_mut().enumerate().skip(1) {
        *value = element(i);
    }
    result
}

/// The outcome of a comparison, one truth value per lane.
pub trait Mask: Copy + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    fn any(self) -> bool;
}

/// A quantity that a model computes with: a plain number, or one that carries derivatives.
pub trait Number:
    Copy + Neg<Output = Self> + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// The same quantity without derivatives.
    type Real: Real;

    fn splat(value: f64) -> Self;
    fn constant(value: Self::Real) -> Self;
    fn value(self) -> Self::Real;
    fn sqrt(self) -> Self;
    fn exp(self) -> Self;
    /// ln(1 + self), accurate near 0.
    fn ln_1p(self) -> Self;
    /// self · factor + addend.
    fn mul_add(self, factor: Self, addend: Self) -> Self;
    /// self · factor + addend with a factor that has no derivatives, which saves multiplying them by zero.
    fn scale_add(self, factor: Self::Real, addend: Self) -> Self;
    /// `yes` where the mask holds, else `no`. Never multiply by a mask instead: 0 · ∞ is not 0.
    fn select(mask: <Self::Real as Real>::Mask, yes: Self, no: Self) -> Self;

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::select(self.value().lt(other.value()), self, other)
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(self.value().lt(other.value()), other, self)
    }

    #[inline(always)]
    fn scale(self, factor: Self::Real) -> Self {
        self.scale_add(factor, Self::splat(0.0))
    }

    #[inline(always)]
    fn squared(self) -> Self {
        self * self
    }

    /// self² + addend.
    #[inline(always)]
    fn square_add(self, addend: Self) -> Self {
        self.mul_add(self, addend)
    }
}

/// A number without derivatives, which can be compared.
pub trait Real: Number<Real = Self> {
    type Mask: Mask;

    fn lt(self, other: Self) -> Self::Mask;

    #[inline(always)]
    fn gt(self, other: Self) -> Self::Mask {
        other.lt(self)
    }

    #[inline(always)]
    fn positive(self) -> Self::Mask {
        Self::splat(0.0).lt(self)
    }
}

impl Mask for bool {
    fn any(self) -> bool {
        self
    }
}

impl Number for f64 {
    type Real = f64;

    fn splat(value: f64) -> f64 {
        value
    }
    fn constant(value: f64) -> f64 {
        value
    }
    fn value(self) -> f64 {
        self
    }
    fn sqrt(self) -> f64 {
        self.sqrt()
    }
    fn exp(self) -> f64 {
        self.exp()
    }
    fn ln_1p(self) -> f64 {
        self.ln_1p()
    }
    fn mul_add(self, factor: f64, addend: f64) -> f64 {
        self * factor + addend
    }
    fn scale_add(self, factor: f64, addend: f64) -> f64 {
        self * factor + addend
    }
    fn select(mask: bool, yes: f64, no: f64) -> f64 {
        if mask { yes } else { no }
    }
}

impl Real for f64 {
    type Mask = bool;

    fn lt(self, other: f64) -> bool {
        self < other
    }
}
