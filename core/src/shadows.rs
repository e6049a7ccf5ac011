//! Cast shadows: samples much darker than the diffuse part of their pixel would be without anything in the light's way.

use crate::lanes::{Isa, Lane, LaneMask};
use crate::number::{Number, Real, array};
use crate::observations::Group;
use crate::start::Grey;

/// A sample in shadow has less than this share of the diffuse light …
const SHARE: f64 = 0.5;
/// … and lacks more than so many standard deviations of the noise.
const SIGMAS: f64 = 4.0;
/// How often shadows are looked for anew by the model that was fitted to the other samples.
pub const ROUNDS: usize = 3;

/// The samples of a group of pixels that lie in shadow, and what they weighed before they were left out.
pub struct Shadows<const ISA: Isa, const C: usize> {
    /// Per light, the pixels that lie in its shadow.
    pub dark: Vec<LaneMask>,
    weights: Vec<[Lane<ISA>; C]>,
    grey_weights: Vec<Lane<ISA>>,
    usable_samples: Lane<ISA>,
}

impl<const ISA: Isa, const C: usize> Shadows<ISA, C> {
    pub fn new(lights: usize) -> Self {
        Shadows {
            dark: Vec::with_capacity(lights),
            weights: Vec::with_capacity(lights),
            grey_weights: Vec::with_capacity(lights),
            usable_samples: Lane::splat(0.0),
        }
    }

    /// Begins with a group as it was gathered: nothing is known to lie in shadow.
    #[inline(always)]
    pub fn begin(&mut self, group: &Group<ISA, C>, grey: &[Grey<ISA>]) {
        self.dark.clear();
        self.weights.clear();
        self.grey_weights.clear();
        for (observation, grey) in group.observations.iter().zip(grey) {
            self.dark.push(LaneMask::NONE);
            self.weights.push(observation.weight);
            self.grey_weights.push(grey.weight);
        }
        self.usable_samples = group.usable_samples;
    }

    #[inline(always)]
    fn is_dark(&self, light: usize, diffuse: Lane<ISA>, ambient: Lane<ISA>, grey: &Grey<ISA>) -> LaneMask {
        let lacking = diffuse + ambient - grey.radiance;
        let sigmas_squared = lacking * lacking * self.grey_weights[light];
        lacking.gt(diffuse * Lane::splat(1.0 - SHARE)) & sigmas_squared.gt(Lane::splat(SIGMAS * SIGMAS))
    }

    /// Leaves out the samples in shadow where the diffuse part gives `diffuse` under each light, and what no light brings
    /// is `ambient`; takes in again those that were left out before and are not. Only the pixels of `among` are looked at.
    /// Of no pixel more than half of the lights are left out, nor so many that fewer than its `unknowns` remain. Returns
    /// the pixels of which the samples changed.
    #[inline(always)]
    pub fn leave_out(
        &mut self,
        diffuse: &[Lane<ISA>],
        ambient: Lane<ISA>,
        among: LaneMask,
        unknowns: usize,
        group: &mut Group<ISA, C>,
        grey: &mut [Grey<ISA>],
    ) -> LaneMask {
        let (zero, one) = (Lane::splat(0.0), Lane::splat(1.0));
        let mut found = zero;
        for (light, grey) in grey.iter().enumerate() {
            found = found + Lane::select(self.is_dark(light, diffuse[light], ambient, grey), one, zero);
        }
        let left = group.usable_lights - found;
        let trusted = !left.lt(found) & !left.lt(Lane::splat(unknowns as f64));
        let mut changed = LaneMask::NONE;
        group.usable_samples = self.usable_samples;
        for (light, grey) in grey.iter_mut().enumerate() {
            let now = self.is_dark(light, diffuse[light], ambient, grey) & trusted;
            let dark = (now & among) | (self.dark[light] & !among);
            changed = changed | (dark & !self.dark[light]) | (self.dark[light] & !dark);
            self.dark[light] = dark;
            grey.weight = Lane::select(dark, zero, self.grey_weights[light]);
            let weights = self.weights[light];
            group.observations[light].weight = array!(|k| Lane::select(dark, zero, weights[k]));
            // A sample in shadow has weight in all channels, or its mean had none.
            let samples = Lane::select(dark, Lane::splat(group.channels as f64), zero);
            group.usable_samples = group.usable_samples - samples;
        }
        changed
    }
}
