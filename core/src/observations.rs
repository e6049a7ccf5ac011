//! What was measured at a group of pixels: radiance and weight of every sample, gathered from the stack as it was decoded.

use crate::geometry::{Illumination, Place};
use crate::lanes::{Isa, LANES, Lane, LaneMask};
use crate::number::{Number, Real, array};

/// Samples as stored: (light, pixel, channel), linear.
#[derive(Clone, Copy)]
pub enum Samples<'a> {
    U16(&'a [u16]),
    F32(&'a [f32]),
}

impl Samples<'_> {
    /// The samples of one light at a group of pixels, per channel, as stored; of so many pixels and channels.
    #[inline(always)]
    pub fn gather<const ISA: Isa, const C: usize>(
        &self,
        pixels: usize,
        channels: usize,
        light: usize,
        pixel: &[usize; LANES],
    ) -> [Lane<ISA>; C] {
        let first = light * pixels * channels;
        match self {
            Samples::U16(values) => per_channel(&values[first..], channels, pixel, f32::from),
            Samples::F32(values) => per_channel(&values[first..], channels, pixel, |value| value),
        }
    }
}

#[inline(always)]
fn per_channel<T: Copy, const ISA: Isa, const C: usize>(
    values: &[T],
    channels: usize,
    pixel: &[usize; LANES],
    number: impl Fn(T) -> f32,
) -> [Lane<ISA>; C] {
    let mut result = [Lane([0.0; LANES]); C];
    // Side by side, as all groups but a tile's last are, and as many channels as there is room for: loops of known length.
    if channels == C && pixel[LANES - 1] == pixel[0] + LANES - 1 {
        for (i, values) in values[pixel[0] * C..(pixel[0] + LANES) * C].chunks_exact(C).enumerate() {
            for k in 0..C {
                result[k].0[i] = number(values[k]);
            }
        }
        return result;
    }
    for i in 0..LANES {
        let values = &values[pixel[i] * channels..(pixel[i] + 1) * channels];
        for k in 0..channels {
            result[k].0[i] = number(values[k]);
        }
    }
    result
}

/// Standard deviation of a sample: variance = read² + photon · Y + (relative · Y)², in relative radiance.
#[derive(Clone, Copy, Debug)]
pub struct Noise {
    pub read: f32,
    pub photon: f32,
    pub relative: f32,
}

/// What is known of each pixel before its fit: where the search starts, and what stands in for the model's weak priors.
#[derive(Clone, Copy)]
pub struct Belief<'a> {
    /// (pixel, 3): unit normals to start from.
    pub normal: &'a [f32],
    /// (pixel, shape parameter): shapes to start from.
    pub shape: &'a [f32],
    /// (pixel, coordinates then lobes): means and standard deviations of `separable::Prior`.
    pub mean: &'a [f32],
    pub deviation: &'a [f32],
}

/// Photographs of a tile of pixels, and where lights and camera stood.
pub struct Stack<'a> {
    pub samples: Samples<'a>,
    pub pixels: usize,
    pub channels: usize,
    /// radiance = scale · sample + offset.
    pub scale: f32,
    pub offset: f32,
    pub lights: Vec<Place>,
    /// (light, channel): irradiance at the centre of the painting.
    pub intensity: Vec<f32>,
    pub camera: Place,
    /// (pixel, 2): X and Y in mm; read only where a light or the camera is near.
    pub position_mm: Option<&'a [f32]>,
    /// Per channel: samples from here on are clipped.
    pub clip_level: Vec<f32>,
    /// Samples below this are in shadow and left out.
    pub shadow_level: f32,
    /// (light, pixel): nonzero leaves a sample out.
    pub sample_mask: Option<&'a [u8]>,
    pub noise: Noise,
    /// (pixel, 3): the normals, where the surface is known; they are then not fitted, and nothing else is assumed of the
    /// material either: the weak priors are off.
    pub normal: Option<&'a [f32]>,
    pub belief: Option<Belief<'a>>,
}

impl Stack<'_> {
    pub fn near(&self) -> bool {
        self.camera.near() || self.lights.iter().any(Place::near)
    }

    /// The pixels of a group from `start` on; past the end of the tile the last one is repeated.
    #[inline(always)]
    pub fn group(&self, start: usize) -> [usize; LANES] {
        array!(|i| (start + i).min(self.pixels - 1))
    }

    /// The normals of a group of pixels from `start` on, where the surface is known.
    #[inline(always)]
    pub fn known_normal<const ISA: Isa>(&self, start: usize) -> Option<[Lane<ISA>; 3]> {
        let normal = self.normal?;
        let pixel = self.group(start);
        Some(array!(|axis| Lane(array!(|i| normal[3 * pixel[i] + axis]))))
    }
}

/// One light's samples at a group of pixels. Radiance is per unit of irradiance, so that models need not know of intensities.
#[derive(Clone, Copy)]
pub struct Observation<const ISA: Isa, const C: usize> {
    pub radiance: [Lane<ISA>; C],
    /// Inverse variance; 0 for a sample that is clipped, in shadow or missing.
    pub weight: [Lane<ISA>; C],
}

/// Everything known of a group of pixels. The buffers are reused from group to group.
pub struct Group<const ISA: Isa, const C: usize> {
    /// Channels that the stack has, at most C; the others have no weight.
    pub channels: usize,
    index: f64,
    pub observations: Vec<Observation<ISA, C>>,
    /// The irradiance that each light's radiance was divided by.
    pub irradiance: Vec<[Lane<ISA>; C]>,
    per_irradiance: Vec<[Lane<ISA>; C]>,
    pub illuminations: Vec<Illumination<Lane<ISA>>>,
    /// Lights with at least one usable sample, per pixel.
    pub usable_lights: Lane<ISA>,
    /// Usable samples of all channels, per pixel.
    pub usable_samples: Lane<ISA>,
    /// Clipped samples, per pixel.
    pub clipped: Lane<ISA>,
}

impl<const ISA: Isa, const C: usize> Group<ISA, C> {
    /// `index` is that of refraction.
    pub fn new(stack: &Stack, index: f64) -> Self {
        let zero = [Lane::splat(0.0); C];
        let observation = Observation { radiance: zero, weight: zero };
        let mut group = Group {
            channels: stack.channels,
            index,
            observations: vec![observation; stack.lights.len()],
            irradiance: vec![zero; stack.lights.len()],
            per_irradiance: vec![zero; stack.lights.len()],
            illuminations: Vec::with_capacity(stack.lights.len()),
            usable_lights: Lane::splat(0.0),
            usable_samples: Lane::splat(0.0),
            clipped: Lane::splat(0.0),
        };
        group.illuminate(stack, Lane::splat(0.0), Lane::splat(0.0));
        group
    }

    /// Directions for pixels at these positions, and the irradiances.
    #[inline(always)]
    fn illuminate(&mut self, stack: &Stack, x_mm: Lane<ISA>, y_mm: Lane<ISA>) {
        let (view, _) = stack.camera.seen_from(x_mm, y_mm);
        self.illuminations.clear();
        for (light, place) in stack.lights.iter().enumerate() {
            let (direction, falloff) = place.seen_from(x_mm, y_mm);
            self.illuminations.push(Illumination::new(direction, view, self.index));
            for channel in 0..stack.channels {
                let irradiance = Lane([stack.intensity[light * stack.channels + channel]; LANES]) * falloff;
                self.irradiance[light][channel] = irradiance;
                self.per_irradiance[light][channel] = Lane::splat(1.0) / irradiance;
            }
        }
    }

    /// Reads a group of pixels from `start` on.
    #[inline(always)]
    pub fn gather(&mut self, stack: &Stack, start: usize) {
        let pixel = stack.group(start);
        if let (true, Some(position)) = (stack.near(), stack.position_mm) {
            let x_mm = Lane(array!(|i| position[2 * pixel[i]]));
            let y_mm = Lane(array!(|i| position[2 * pixel[i] + 1]));
            self.illuminate(stack, x_mm, y_mm);
        }
        let (zero, one) = (Lane::splat(0.0), Lane::splat(1.0));
        let (scale, offset) = (Lane([stack.scale; LANES]), Lane([stack.offset; LANES]));
        let read_variance = Lane::splat(f64::from(stack.noise.read).powi(2));
        let photon = Lane([stack.noise.photon; LANES]);
        let relative_variance = Lane::splat(f64::from(stack.noise.relative).powi(2));
        let shadow_level = Lane([stack.shadow_level; LANES]);
        self.usable_lights = zero;
        self.usable_samples = zero;
        self.clipped = zero;
        for (light, observation) in self.observations.iter_mut().enumerate() {
            let stored = stack.samples.gather::<ISA, C>(stack.pixels, stack.channels, light, &pixel);
            let mut left_out = LaneMask::NONE;
            if let Some(mask) = stack.sample_mask {
                left_out = Lane::<ISA>(array!(|i| f32::from(mask[light * stack.pixels + pixel[i]]))).positive();
            }
            let mut any_usable = LaneMask::NONE;
            for channel in 0..stack.channels {
                let value = stored[channel].mul_add(scale, offset);
                let missing = left_out | !value.abs().lt(Lane([f32::INFINITY; LANES]));
                let clipped = !value.lt(Lane([stack.clip_level[channel]; LANES])) & !missing;
                let usable = !(missing | clipped | value.lt(shadow_level));
                let radiance = Lane::select(missing, zero, value);
                let positive = radiance.max(zero);
                let variance = positive.mul_add(positive.mul_add(relative_variance, photon), read_variance);
                let irradiance = self.irradiance[light][channel];
                observation.radiance[channel] = radiance * self.per_irradiance[light][channel];
                observation.weight[channel] = Lane::select(usable, irradiance * irradiance / variance, zero);
                any_usable = any_usable | usable;
                self.usable_samples = self.usable_samples + Lane::select(usable, one, zero);
                self.clipped = self.clipped + Lane::select(clipped, one, zero);
            }
            self.usable_lights = self.usable_lights + Lane::select(any_usable, one, zero);
        }
    }
}
