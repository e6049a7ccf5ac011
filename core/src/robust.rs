//! Residuals far outside the noise: how much they cost, and how much weight their samples keep.

use crate::lanes::{Isa, Lane, LaneMask};
use crate::number::{Number, Real, array};

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Loss {
    /// Plain least squares.
    Linear,
    /// ρ(r²) = k² ln(1 + r²/k²).
    Cauchy(f32),
    /// ρ(r²) = r² up to k, then 2 k |r| − k².
    Huber(f32),
}

/// The weights of a group's samples under a loss: iteratively reweighted least squares.
pub struct Robust<const ISA: Isa, const C: usize> {
    loss: Loss,
    /// The loss takes residuals this many times larger for noise.
    scale: Lane<ISA>,
    /// Factor of each sample's weight, refreshed at every accepted point.
    factors: Vec<[Lane<ISA>; C]>,
}

impl<const ISA: Isa, const C: usize> Robust<ISA, C> {
    /// `factors` is a buffer with one entry per light.
    #[inline(always)]
    pub fn new(loss: Loss, mut factors: Vec<[Lane<ISA>; C]>) -> Self {
        if loss != Loss::Linear {
            factors.fill([Lane::splat(1.0); C]);
        }
        Robust { loss, scale: Lane::splat(1.0), factors }
    }

    /// Returns the buffer.
    #[inline(always)]
    pub fn into_factors(self) -> Vec<[Lane<ISA>; C]> {
        self.factors
    }

    #[inline(always)]
    pub fn is_linear(&self) -> bool {
        self.loss == Loss::Linear
    }

    /// The weights of a light's samples, from the plain ones.
    #[inline(always)]
    pub fn weight(&self, light: usize, plain: &[Lane<ISA>; C]) -> [Lane<ISA>; C] {
        if self.is_linear() {
            return *plain;
        }
        array!(|k| plain[k] * self.factors[light][k])
    }

    /// ρ of a residual; `weight` includes the factor, `plain` does not.
    #[inline(always)]
    pub fn cost(&self, weight: Lane<ISA>, plain: Lane<ISA>, residual: Lane<ISA>) -> Lane<ISA> {
        match self.loss {
            Loss::Linear => weight * residual * residual,
            Loss::Cauchy(k) => {
                let k = self.scale * Lane::splat(f64::from(k));
                let k_squared = k * k;
                k_squared * (plain * residual * residual / k_squared).ln_1p()
            }
            Loss::Huber(k) => {
                let k = self.scale * Lane::splat(f64::from(k));
                let squared = plain * residual * residual;
                let linear = (k + k) * squared.sqrt() - k * k;
                Lane::select(squared.lt(k * k), squared, linear)
            }
        }
    }

    /// Takes a light's factors from its residuals, for the pixels of `mask`.
    #[inline(always)]
    pub fn reweight(&mut self, light: usize, plain: &[Lane<ISA>; C], residual: &[Lane<ISA>; C], mask: LaneMask) {
        let one = Lane::splat(1.0);
        let scale_squared = self.scale * self.scale;
        for k in 0..C {
            let squared = plain[k] * residual[k] * residual[k];
            let factor = match self.loss {
                Loss::Linear => one,
                Loss::Cauchy(k) => one / (one + squared / (Lane::splat(f64::from(k * k)) * scale_squared)),
                Loss::Huber(k) => (Lane::splat(f64::from(k)) * self.scale / squared.sqrt()).min(one),
            };
            self.factors[light][k] = Lane::select(mask, factor, self.factors[light][k]);
        }
    }

    /// Gives the samples of each light only a share of their weight, until the loss has residuals to go by.
    #[inline(always)]
    pub fn trust(&mut self, share: &[Lane<ISA>]) {
        for (factors, share) in self.factors.iter_mut().zip(share) {
            *factors = [*share; C];
        }
    }

    /// Of a light's samples, by the share that each is trusted: the sum of squared residuals, and that of the shares.
    #[inline(always)]
    pub fn trusted(&self, light: usize, plain: &[Lane<ISA>; C], residual: &[Lane<ISA>; C]) -> (Lane<ISA>, Lane<ISA>) {
        let (mut squares, mut trusted) = (Lane::splat(0.0), Lane::splat(0.0));
        for k in 0..C {
            let share = Lane::select(plain[k].positive(), self.factors[light][k], Lane::splat(0.0));
            squares = (share * plain[k] * residual[k]).mul_add(residual[k], squares);
            trusted = trusted + share;
        }
        (squares, trusted)
    }

    /// Makes the loss take residuals this many times larger for noise, at least those of the noise itself.
    #[inline(always)]
    pub fn set_scale(&mut self, scale: Lane<ISA>) {
        self.scale = scale.max(Lane::splat(1.0));
    }
}
