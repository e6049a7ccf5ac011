//! Forward-mode automatic differentiation: a value and its derivatives with respect to P parameters.
//!
//! A [`Dual`] takes directions of light and view as plain numbers, since they are given; a [`Steered`] number takes them as
//! functions of the parameters too.

use crate::number::{Number, Real};
use std::ops::{Add, Div, Mul, Neg, Sub};

#[derive(Clone, Copy, Debug)]
pub struct Dual<R, const P: usize> {
    pub value: R,
    pub derivative: [R; P],
}

impl<R: Real, const P: usize> Dual<R, P> {
    /// The parameter number `index` itself, scaled so that its derivative is `slope`.
    #[inline(always)]
    pub fn parameter(value: R, index: usize, slope: R) -> Self {
        let mut dual = Self::constant(value);
        dual.derivative[index] = slope;
        dual
    }

    /// f(self), given f's value and its slope there.
    #[inline(always)]
    fn chain(self, value: R, slope: R) -> Self {
        let mut derivative = self.derivative;
        for d in derivative.iter_mut() {
            *d = *d * slope;
        }
        Dual { value, derivative }
    }
}

impl<R: Real, const P: usize> Neg for Dual<R, P> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        let mut derivative = self.derivative;
        for d in derivative.iter_mut() {
            *d = -*d;
        }
        Dual { value: -self.value, derivative }
    }
}

impl<R: Real, const P: usize> Add for Dual<R, P> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let mut derivative = self.derivative;
        for i in 0..P {
            derivative[i] = derivative[i] + other.derivative[i];
        }
        Dual { value: self.value + other.value, derivative }
    }
}

impl<R: Real, const P: usize> Sub for Dual<R, P> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let mut derivative = self.derivative;
        for i in 0..P {
            derivative[i] = derivative[i] - other.derivative[i];
        }
        Dual { value: self.value - other.value, derivative }
    }
}

impl<R: Real, const P: usize> Mul for Dual<R, P> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let mut derivative = self.derivative;
        for i in 0..P {
            derivative[i] = derivative[i].mul_add(other.value, self.value * other.derivative[i]);
        }
        Dual { value: self.value * other.value, derivative }
    }
}

impl<R: Real, const P: usize> Div for Dual<R, P> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let inverse = R::splat(1.0) / other.value;
        let value = self.value * inverse;
        let mut derivative = self.derivative;
        for i in 0..P {
            derivative[i] = (derivative[i] - value * other.derivative[i]) * inverse;
        }
        Dual { value, derivative }
    }
}

impl<R: Real, const P: usize> Number for Dual<R, P> {
    type Real = R;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self::constant(R::splat(value))
    }
    #[inline(always)]
    fn constant(value: R) -> Self {
        Dual { value, derivative: [R::splat(0.0); P] }
    }
    #[inline(always)]
    fn value(self) -> R {
        self.value
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, R::splat(0.5) / root)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        let value = self.value.exp();
        self.chain(value, value)
    }
    #[inline(always)]
    fn ln_1p(self) -> Self {
        self.chain(self.value.ln_1p(), R::splat(1.0) / (R::splat(1.0) + self.value))
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        let mut derivative = addend.derivative;
        for i in 0..P {
            derivative[i] = self.derivative[i].mul_add(factor.value, derivative[i]);
            derivative[i] = self.value.mul_add(factor.derivative[i], derivative[i]);
        }
        Dual { value: self.value.mul_add(factor.value, addend.value), derivative }
    }
    #[inline(always)]
    fn scale_add(self, factor: R, addend: Self) -> Self {
        let mut derivative = addend.derivative;
        for i in 0..P {
            derivative[i] = self.derivative[i].mul_add(factor, derivative[i]);
        }
        Dual { value: self.value.mul_add(factor, addend.value), derivative }
    }
    #[inline(always)]
    fn scale(self, factor: R) -> Self {
        self.chain(self.value * factor, factor)
    }
    #[inline(always)]
    fn select(mask: R::Mask, yes: Self, no: Self) -> Self {
        let mut derivative = no.derivative;
        for i in 0..P {
            derivative[i] = R::select(mask, yes.derivative[i], derivative[i]);
        }
        Dual { value: R::select(mask, yes.value, no.value), derivative }
    }
}

/// A dual number that is its own `Real`: all that a model computes with, directions included, may have derivatives.
///
/// It knows which parameters it depends on. Which those are follows from the code alone, so that the compiler decides it and
/// leaves out what would multiply and add zeros.
#[derive(Clone, Copy, Debug)]
pub struct Steered<R, const P: usize> {
    pub value: R,
    /// Zero where it does not depend on the parameter.
    pub derivative: [R; P],
    depends: [bool; P],
}

impl<R: Real, const P: usize> Steered<R, P> {
    /// As [`Dual::parameter`].
    #[inline(always)]
    pub fn parameter(value: R, index: usize, slope: R) -> Self {
        let mut number = Self::given(value);
        number.derivative[index] = slope;
        number.depends[index] = true;
        number
    }

    /// A number that depends on no parameter.
    #[inline(always)]
    pub fn given(value: R) -> Self {
        Steered { value, derivative: [R::splat(0.0); P], depends: [false; P] }
    }

    /// f(self), given f's value and its slope there.
    #[inline(always)]
    fn chain(self, value: R, slope: R) -> Self {
        Self::given(value).plus(self, slope)
    }

    /// The same value, and its derivatives plus those of another number times a factor.
    #[inline(always)]
    fn plus(mut self, other: Self, factor: R) -> Self {
        for i in 0..P {
            if other.depends[i] {
                self.derivative[i] = if self.depends[i] {
                    other.derivative[i].mul_add(factor, self.derivative[i])
                } else {
                    other.derivative[i] * factor
                };
                self.depends[i] = true;
            }
        }
        self
    }

    /// The same derivatives, and another value.
    #[inline(always)]
    fn valued(mut self, value: R) -> Self {
        self.value = value;
        self
    }
}

impl<R: Real, const P: usize> Neg for Steered<R, P> {
    type Output = Self;
    #[inline(always)]
    fn neg(mut self) -> Self {
        for i in 0..P {
            if self.depends[i] {
                self.derivative[i] = -self.derivative[i];
            }
        }
        self.valued(-self.value)
    }
}

impl<R: Real, const P: usize> Add for Steered<R, P> {
    type Output = Self;
    #[inline(always)]
    fn add(mut self, other: Self) -> Self {
        for i in 0..P {
            if other.depends[i] {
                self.derivative[i] =
                    if self.depends[i] { self.derivative[i] + other.derivative[i] } else { other.derivative[i] };
                self.depends[i] = true;
            }
        }
        self.valued(self.value + other.value)
    }
}

impl<R: Real, const P: usize> Sub for Steered<R, P> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl<R: Real, const P: usize> Mul for Steered<R, P> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        other.chain(self.value * other.value, self.value).plus(self, other.value)
    }
}

impl<R: Real, const P: usize> Div for Steered<R, P> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let inverse = R::splat(1.0) / other.value;
        let value = self.value * inverse;
        self.plus(other, -value).chain(value, inverse)
    }
}

impl<R: Real, const P: usize> Number for Steered<R, P> {
    type Real = Self;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self::given(R::splat(value))
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
        let root = self.value.sqrt();
        self.chain(root, R::splat(0.5) / root)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        let value = self.value.exp();
        self.chain(value, value)
    }
    #[inline(always)]
    fn ln_1p(self) -> Self {
        self.chain(self.value.ln_1p(), R::splat(1.0) / (R::splat(1.0) + self.value))
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        let value = self.value.mul_add(factor.value, addend.value);
        addend.plus(self, factor.value).plus(factor, self.value).valued(value)
    }
    #[inline(always)]
    fn scale_add(self, factor: Self, addend: Self) -> Self {
        self.mul_add(factor, addend)
    }
    #[inline(always)]
    fn scale(self, factor: Self) -> Self {
        self * factor
    }
    #[inline(always)]
    fn squared(self) -> Self {
        self.chain(self.value * self.value, self.value + self.value)
    }
    #[inline(always)]
    fn square_add(self, addend: Self) -> Self {
        addend.plus(self, self.value + self.value).valued(self.value.mul_add(self.value, addend.value))
    }
    #[inline(always)]
    fn select(mask: R::Mask, yes: Self, no: Self) -> Self {
        let mut result = Self::given(R::select(mask, yes.value, no.value));
        for i in 0..P {
            result.depends[i] = yes.depends[i] | no.depends[i];
            if result.depends[i] {
                result.derivative[i] = R::select(mask, yes.derivative[i], no.derivative[i]);
            }
        }
        result
    }
}

impl<R: Real, const P: usize> Real for Steered<R, P> {
    type Mask = R::Mask;

    #[inline(always)]
    fn lt(self, other: Self) -> R::Mask {
        self.value.lt(other.value)
    }
}
