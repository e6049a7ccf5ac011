//! The linear part of a reflectance model: magnitudes that are least squares given normal and shape.
//!
//! Diffuse (and ambient) magnitudes belong to one channel each, specular magnitudes to all of them. The normal equations
//! are therefore an arrow: a block per channel, bordered by the lobes. Eliminating the blocks leaves a system of the size
//! of the number of lobes.

use crate::lanes::{Isa, Lane, LaneMask, outlined};
use crate::minimise::solve_symmetric;
use crate::number::{Mask, Number, Real, array};

/// A vector shaped like the magnitudes: (diffuse, ambient) per channel, then one number per lobe.
#[derive(Clone, Copy)]
pub struct Magnitudes<const ISA: Isa, const C: usize, const L: usize = 1> {
    pub diffuse: [Lane<ISA>; C],
    pub ambient: [Lane<ISA>; C],
    pub specular: [Lane<ISA>; L],
}

impl<const ISA: Isa, const C: usize, const L: usize> Magnitudes<ISA, C, L> {
    #[inline(always)]
    pub fn zero() -> Self {
        let zero = Lane::splat(0.0);
        Magnitudes { diffuse: [zero; C], ambient: [zero; C], specular: [zero; L] }
    }

    #[inline(always)]
    pub fn select(mask: LaneMask, yes: &Self, no: &Self) -> Self {
        Magnitudes {
            diffuse: array!(|k| Lane::select(mask, yes.diffuse[k], no.diffuse[k])),
            ambient: array!(|k| Lane::select(mask, yes.ambient[k], no.ambient[k])),
            specular: array!(|j| Lane::select(mask, yes.specular[j], no.specular[j])),
        }
    }

    #[inline(always)]
    pub fn dot(&self, other: &Self) -> Lane<ISA> {
        let mut sum = Lane::splat(0.0);
        for k in 0..C {
            sum = self.diffuse[k].mul_add(other.diffuse[k], sum);
            sum = self.ambient[k].mul_add(other.ambient[k], sum);
        }
        for j in 0..L {
            sum = self.specular[j].mul_add(other.specular[j], sum);
        }
        sum
    }
}

/// Which magnitudes are free; the others are held at 0.
#[derive(Clone, Copy)]
struct Free<const C: usize, const L: usize> {
    diffuse: [LaneMask; C],
    ambient: [LaneMask; C],
    specular: [LaneMask; L],
}

impl<const C: usize, const L: usize> Free<C, L> {
    #[inline(always)]
    fn new(lobes: usize, ambient: bool) -> Self {
        Free {
            diffuse: [LaneMask::ALL; C],
            ambient: [if ambient { LaneMask::ALL } else { LaneMask::NONE }; C],
            specular: array!(|j| if j < lobes { LaneMask::ALL } else { LaneMask::NONE }),
        }
    }

    /// Holds the free magnitudes that are negative; returns the lanes that have one.
    #[inline(always)]
    fn hold_negative<const ISA: Isa>(
        &mut self,
        magnitudes: &Magnitudes<ISA, C, L>,
        lobes: usize,
        ambient: bool,
    ) -> LaneMask {
        let zero = Lane::splat(0.0);
        let mut violated = LaneMask::NONE;
        let mut hold = |free: &mut LaneMask, value: Lane<ISA>| {
            let negative = value.lt(zero) & *free;
            *free = *free & !negative;
            violated = violated | negative;
        };
        for j in 0..lobes {
            hold(&mut self.specular[j], magnitudes.specular[j]);
        }
        for k in 0..C {
            hold(&mut self.diffuse[k], magnitudes.diffuse[k]);
            if ambient {
                hold(&mut self.ambient[k], magnitudes.ambient[k]);
            }
        }
        violated
    }
}

/// How often magnitudes that were held at 0 may be released.
const RELEASES: usize = 3;
/// Share of a magnitude's right-hand side that its gradient must exceed to be more than rounding.
const LEAST_GRADIENT: f64 = 1e-4;

/// Weighted sums of products of the basis functions over the lights, for one channel.
#[derive(Clone, Copy)]
struct ChannelSums<const ISA: Isa, const L: usize> {
    diffuse_diffuse: Lane<ISA>,
    diffuse_one: Lane<ISA>,
    one_one: Lane<ISA>,
    diffuse_specular: [Lane<ISA>; L],
    one_specular: [Lane<ISA>; L],
}

/// The normal equations of the magnitudes: a matrix and a right-hand side.
#[derive(Clone, Copy)]
pub struct Arrow<const ISA: Isa, const C: usize, const L: usize = 1> {
    channel: [ChannelSums<ISA, L>; C],
    specular_specular: [[Lane<ISA>; L]; L],
    /// Whether the ambient magnitudes are fitted.
    ambient: bool,
    /// Projections of the data on the basis functions.
    pub right: Magnitudes<ISA, C, L>,
}

impl<const ISA: Isa, const C: usize, const L: usize> Arrow<ISA, C, L> {
    #[inline(always)]
    pub fn new(ambient: bool) -> Self {
        let zero = Lane::splat(0.0);
        let sums = ChannelSums {
            diffuse_diffuse: zero,
            diffuse_one: zero,
            one_one: zero,
            diffuse_specular: [zero; L],
            one_specular: [zero; L],
        };
        Arrow { channel: [sums; C], specular_specular: [[zero; L]; L], ambient, right: Magnitudes::zero() }
    }

    /// Adds one light: its basis values, and per channel radiance and weight. `colour` is the light's.
    #[inline(always)]
    pub fn add(
        &mut self,
        lobes: usize,
        diffuse: Lane<ISA>,
        specular: &[Lane<ISA>; L],
        radiance: &[Lane<ISA>; C],
        weight: &[Lane<ISA>; C],
        colour: &[Lane<ISA>; C],
    ) {
        // Σ_k s_k² w and Σ_k s_k w y, so that the lobes' own sums are taken once and not once per channel.
        let mut lobe_weight = Lane::splat(0.0);
        let mut lobe_radiance = Lane::splat(0.0);
        for k in 0..C {
            let sums = &mut self.channel[k];
            let weighted = weight[k] * diffuse;
            let coloured = weight[k] * colour[k];
            sums.diffuse_diffuse = weighted.mul_add(diffuse, sums.diffuse_diffuse);
            self.right.diffuse[k] = weighted.mul_add(radiance[k], self.right.diffuse[k]);
            if self.ambient {
                sums.diffuse_one = sums.diffuse_one + weighted;
                sums.one_one = sums.one_one + weight[k];
                self.right.ambient[k] = weight[k].mul_add(radiance[k], self.right.ambient[k]);
            }
            if lobes > 0 {
                lobe_weight = coloured.mul_add(colour[k], lobe_weight);
                lobe_radiance = coloured.mul_add(radiance[k], lobe_radiance);
                let coloured_diffuse = coloured * diffuse;
                for j in 0..lobes {
                    sums.diffuse_specular[j] = coloured_diffuse.mul_add(specular[j], sums.diffuse_specular[j]);
                    if self.ambient {
                        sums.one_specular[j] = coloured.mul_add(specular[j], sums.one_specular[j]);
                    }
                }
            }
        }
        for i in 0..lobes {
            self.right.specular[i] = lobe_radiance.mul_add(specular[i], self.right.specular[i]);
            let weighted = lobe_weight * specular[i];
            for j in i..lobes {
                self.specular_specular[i][j] = weighted.mul_add(specular[j], self.specular_specular[i][j]);
            }
        }
    }

    /// Adds information from elsewhere: what a lobe's magnitude is, with this weight.
    #[inline(always)]
    pub fn add_ridge(&mut self, lobe: usize, weight: Lane<ISA>, magnitude: Lane<ISA>) {
        self.right.specular[lobe] = weight.mul_add(magnitude, self.right.specular[lobe]);
        self.specular_specular[lobe][lobe] = self.specular_specular[lobe][lobe] + weight;
    }

    /// Eliminates the channels' blocks.
    #[inline(always)]
    fn factor(&self, lobes: usize, free: &Free<C, L>) -> Factored<ISA, C, L> {
        let zero = Lane::splat(0.0);
        let one = Lane::splat(1.0);
        let mut inverse = [BlockInverse { diffuse: zero, cross: zero, ambient: zero }; C];
        for k in 0..C {
            let sums = &self.channel[k];
            let lit = free.diffuse[k] & sums.diffuse_diffuse.gt(Lane::splat(1e-30));
            let alone = Lane::select(lit, one / sums.diffuse_diffuse, zero);
            inverse[k].diffuse = alone;
            if self.ambient {
                // Where all lights meet the surface at one angle, Ad and Ae are one: Ae is then 0.
                let product = sums.diffuse_diffuse * sums.one_one;
                let determinant = product - sums.diffuse_one * sums.diffuse_one;
                let both = lit & free.ambient[k] & determinant.gt(product * Lane::splat(1e-5));
                let only_ambient = free.ambient[k] & !lit & sums.one_one.gt(Lane::splat(1e-30));
                let scale = one / determinant;
                inverse[k].diffuse = Lane::select(both, sums.one_one * scale, alone);
                inverse[k].cross = Lane::select(both, -(sums.diffuse_one * scale), zero);
                inverse[k].ambient = Lane::select(
                    both,
                    sums.diffuse_diffuse * scale,
                    Lane::select(only_ambient, one / sums.one_one, zero),
                );
            }
        }
        let mut schur = self.specular_specular;
        for i in 0..lobes {
            for j in i..lobes {
                for k in 0..C {
                    let sums = &self.channel[k];
                    let (diffuse, ambient) =
                        inverse[k].apply(self.ambient, sums.diffuse_specular[j], sums.one_specular[j]);
                    schur[i][j] = schur[i][j] - sums.diffuse_specular[i] * diffuse;
                    if self.ambient {
                        schur[i][j] = schur[i][j] - sums.one_specular[i] * ambient;
                    }
                }
                if i == j {
                    // A lobe that differs from the diffuse term by rounding only carries no information.
                    let floor = self.specular_specular[i][i] * Lane::splat(1e-6);
                    let kept = free.specular[i] & schur[i][i].gt(floor);
                    schur[i][i] = Lane::select(kept, schur[i][i], zero);
                }
            }
            for j in i + 1..lobes {
                schur[i][j] = Lane::select(free.specular[i] & free.specular[j], schur[i][j], zero);
            }
        }
        Factored { channel: self.channel, lobes, ambient: self.ambient, inverse, schur }
    }

    /// The magnitudes that fit best, none of them negative, and the factored equations of those that are not held at 0.
    #[inline(always)]
    pub fn magnitudes(&self, lobes: usize) -> (Magnitudes<ISA, C, L>, Factored<ISA, C, L>) {
        outlined::<ISA, _>(
            #[inline(always)]
            || self.nonnegative(lobes),
        )
    }

    /// Releases the magnitudes held at 0 that the data would raise; returns the lanes that have one.
    #[inline(always)]
    fn release(&self, at: &Magnitudes<ISA, C, L>, lobes: usize, free: &mut Free<C, L>) -> LaneMask {
        let mut released = LaneMask::NONE;
        let mut release = |free: &mut LaneMask, right: Lane<ISA>, explained: Lane<ISA>| {
            let raised = (right - explained).gt(right.abs() * Lane::splat(LEAST_GRADIENT)) & !*free;
            *free = *free | raised;
            released = released | raised;
        };
        for k in 0..C {
            let sums = &self.channel[k];
            let mut diffuse = sums.diffuse_one * at.ambient[k];
            let mut ambient = sums.diffuse_one * at.diffuse[k];
            for j in 0..lobes {
                diffuse = sums.diffuse_specular[j].mul_add(at.specular[j], diffuse);
                ambient = sums.one_specular[j].mul_add(at.specular[j], ambient);
            }
            release(&mut free.diffuse[k], self.right.diffuse[k], diffuse);
            if self.ambient {
                release(&mut free.ambient[k], self.right.ambient[k], ambient);
            }
        }
        for i in 0..lobes {
            let mut explained = Lane::splat(0.0);
            for j in 0..lobes {
                explained = self.specular_specular[i.min(j)][i.max(j)].mul_add(at.specular[j], explained);
            }
            for k in 0..C {
                let sums = &self.channel[k];
                explained = sums.diffuse_specular[i].mul_add(at.diffuse[k], explained);
                explained = sums.one_specular[i].mul_add(at.ambient[k], explained);
            }
            release(&mut free.specular[i], self.right.specular[i], explained);
        }
        released
    }

    #[inline(always)]
    fn nonnegative(&self, lobes: usize) -> (Magnitudes<ISA, C, L>, Factored<ISA, C, L>) {
        let zero = Lane::splat(0.0);
        let mut free = Free::new(lobes, self.ambient);
        let (mut releases, mut held) = (0, LaneMask::NONE);
        let (mut best, factored) = loop {
            let factored = self.factor(lobes, &free);
            let best = factored.solve_inline(&self.right);
            let violated = free.hold_negative(&best, lobes, self.ambient);
            held = held | violated;
            // Each round holds one more magnitude at least, so this ends.
            if violated.any() {
                continue;
            }
            // Of those held at once some would be positive beside the others at 0. With one lobe and no ambient term to hold
            // and to release is Newton's method on a concave function of As; with one, a bound on the rounds serves. Two lobes
            // that take turns at 0 mislead the fit more than either held.
            if L > 1 || releases == RELEASES || !held.any() || !self.release(&best, lobes, &mut free).any() {
                break (best, factored);
            }
            releases += 1;
        };
        for k in 0..C {
            best.diffuse[k] = best.diffuse[k].max(zero);
            best.ambient[k] = best.ambient[k].max(zero);
        }
        for j in 0..lobes {
            best.specular[j] = best.specular[j].max(zero);
        }
        (best, factored)
    }
}

/// The inverse of a channel's block of (diffuse, ambient).
#[derive(Clone, Copy)]
struct BlockInverse<const ISA: Isa> {
    diffuse: Lane<ISA>,
    cross: Lane<ISA>,
    ambient: Lane<ISA>,
}

impl<const ISA: Isa> BlockInverse<ISA> {
    #[inline(always)]
    fn apply(&self, with_ambient: bool, diffuse: Lane<ISA>, ambient: Lane<ISA>) -> (Lane<ISA>, Lane<ISA>) {
        if with_ambient {
            (self.diffuse.mul_add(diffuse, self.cross * ambient), self.cross.mul_add(diffuse, self.ambient * ambient))
        } else {
            (self.diffuse * diffuse, Lane::splat(0.0))
        }
    }
}

/// The normal equations, ready to be solved for any right-hand side.
#[derive(Clone, Copy)]
pub struct Factored<const ISA: Isa, const C: usize, const L: usize = 1> {
    channel: [ChannelSums<ISA, L>; C],
    lobes: usize,
    pub ambient: bool,
    inverse: [BlockInverse<ISA>; C],
    schur: [[Lane<ISA>; L]; L],
}

impl<const ISA: Isa, const C: usize, const L: usize> Factored<ISA, C, L> {
    #[inline(always)]
    pub fn solve(&self, right: &Magnitudes<ISA, C, L>) -> Magnitudes<ISA, C, L> {
        outlined::<ISA, _>(
            #[inline(always)]
            || self.solve_inline(right),
        )
    }

    #[inline(always)]
    fn solve_inline(&self, right: &Magnitudes<ISA, C, L>) -> Magnitudes<ISA, C, L> {
        let mut result = *right;
        for k in 0..C {
            (result.diffuse[k], result.ambient[k]) =
                self.inverse[k].apply(self.ambient, right.diffuse[k], right.ambient[k]);
        }
        if self.lobes == 0 {
            return result;
        }
        for j in 0..self.lobes {
            for k in 0..C {
                let sums = &self.channel[k];
                result.specular[j] = result.specular[j] - sums.diffuse_specular[j] * result.diffuse[k];
                if self.ambient {
                    result.specular[j] = result.specular[j] - sums.one_specular[j] * result.ambient[k];
                }
            }
        }
        result.specular = solve_symmetric(self.schur, result.specular);
        for k in 0..C {
            let sums = &self.channel[k];
            let mut diffuse = right.diffuse[k];
            let mut ambient = right.ambient[k];
            for j in 0..self.lobes {
                diffuse = diffuse - sums.diffuse_specular[j] * result.specular[j];
                if self.ambient {
                    ambient = ambient - sums.one_specular[j] * result.specular[j];
                }
            }
            (result.diffuse[k], result.ambient[k]) = self.inverse[k].apply(self.ambient, diffuse, ambient);
        }
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{LANES, PLAIN};

    /// Two lights, two channels: the lobe explains more of the dark channel than there is. At the unconstrained optimum both
    /// diffuse magnitudes are negative, at the constrained one the first is not.
    #[test]
    fn releases_what_was_held_only_together_with_others() {
        let lights = [(1.0, 1.0, [1.0, 0.05]), (0.2, 0.5, [0.9, 0.5])];
        let mut arrow = Arrow::<PLAIN, 2>::new(false);
        let (one, number) = ([Lane::splat(1.0); 2], |value: f64| Lane::<PLAIN>::splat(value));
        for (diffuse, lobe, radiance) in lights {
            arrow.add(1, number(diffuse), &[number(lobe)], &radiance.map(number), &one, &one);
        }
        let found = arrow.magnitudes(1).0;
        let cost = |diffuse: [f64; 2], specular: f64| -> f64 {
            let residual = |k: usize, (d, s, y): (f64, f64, [f64; 2])| (y[k] - diffuse[k] * d - specular * s).powi(2);
            lights.iter().map(|&light| residual(0, light) + residual(1, light)).sum()
        };
        let steps = || (0..=400).map(|step| f64::from(step) / 200.0);
        let mut least = f64::MAX;
        for specular in steps() {
            for first in steps() {
                for second in [0.0, 0.005, 0.05, 0.5] {
                    least = least.min(cost([first, second], specular));
                }
            }
        }
        for lane in 0..LANES {
            let diffuse = [0, 1].map(|k| f64::from(found.diffuse[k].0[lane]));
            assert!(cost(diffuse, f64::from(found.specular[0].0[lane])) < least + 1e-5);
        }
    }
}
