//! What a model leaves over of the photographs, over the light's direction: docs/store.md, "The residual term".
//!
//! It is taken and added on the scale f(Y) = √(max(Y, 0) + a) − √a of radiance over irradiance; the constant √a drops out
//! of every difference here.

use crate::dispatch::BLOCK;
use crate::lanes::{Isa, LANES, Lane, outlined};
use crate::number::{Number, Real, array};
use crate::observations::Samples;
use crate::render::{Scene, Shader, Shading};
use crate::threads::on_all_threads;

/// Code of the coefficient 0.
const ZERO: f32 = 32768.0;

/// Components that are summed side by side: what registers hold with AVX2.
const SIDE_BY_SIDE: usize = 6;

/// Coefficients per pixel as stored, (pixel, component).
pub enum Codes<'a> {
    /// Counted from `ZERO`.
    U16(&'a [u16]),
    /// Of a published store, with the value of each code.
    U8(&'a [u8], &'a [f32]),
}

/// A residual term, to be added to renderings.
pub struct Residual<'a> {
    pub codes: Codes<'a>,
    pub components: usize,
    /// (light and channel, component): what one step of a coefficient adds.
    pub basis: &'a [f32],
    pub toe: f32,
}

/// √(max(Y, 0) + a); not a number where Y is none.
#[inline(always)]
fn encode<const ISA: Isa>(relative: Lane<ISA>, toe: Lane<ISA>) -> Lane<ISA> {
    // Of two operands `max` returns the second where either is not a number.
    (Lane::splat(0.0).max(relative) + toe).sqrt()
}

impl Residual<'_> {
    /// The coefficients of a group of pixels.
    #[inline(always)]
    pub fn decode<const ISA: Isa>(&self, pixel: &[usize; LANES], coefficients: &mut Vec<Lane<ISA>>) {
        let first: [usize; LANES] = array!(|i| pixel[i] * self.components);
        coefficients.clear();
        for k in 0..self.components {
            coefficients.push(match self.codes {
                Codes::U16(codes) => Lane(array!(|i| f32::from(codes[first[i] + k]))) - Lane([ZERO; LANES]),
                Codes::U8(codes, table) => Lane(array!(|i| table[usize::from(codes[first[i] + k])])),
            });
        }
    }

    /// Radiance over irradiance with the term, from the model's; `place` is that of light and channel.
    #[inline(always)]
    pub fn add<const ISA: Isa>(&self, relative: Lane<ISA>, coefficients: &[Lane<ISA>], place: usize) -> Lane<ISA> {
        let toe = Lane([self.toe; LANES]);
        let basis = &self.basis[place * self.components..(place + 1) * self.components];
        let mut value = encode(relative, toe);
        for (coefficient, basis) in coefficients.iter().zip(basis) {
            value = coefficient.mul_add(Lane([*basis; LANES]), value);
        }
        let value = value.max(toe.sqrt());
        value * value - toe
    }
}

/// Photographs and the fit whose model leaves something of them over.
pub struct LeftOver<'a> {
    pub scene: &'a Scene<'a>,
    pub samples: Samples<'a>,
    /// Relative radiance = scale · sample + offset.
    pub scale: f32,
    pub offset: f32,
    /// Per channel: samples from here on are clipped.
    pub clip_level: &'a [f32],
    pub toe: f32,
}

impl LeftOver<'_> {
    /// What is left over of each sample of a group, (light, channel). It is 0, the model itself, where a sample is missing or
    /// the pixel has no fit; of a clipped sample, which says only that the radiance was at least so large, as much as is certain.
    #[inline(always)]
    fn of_group<const ISA: Isa, const C: usize>(&self, first: usize, shading: &Shading<ISA>, rest: &mut [Lane<ISA>]) {
        let scene = self.scene;
        let (scale, offset, toe) = (Lane([self.scale; LANES]), Lane([self.offset; LANES]), Lane([self.toe; LANES]));
        let zero = Lane::splat(0.0);
        let pixel = scene.group(first);
        for light in 0..scene.lights.len() {
            let stored = self.samples.gather::<ISA, C>(scene.parameters.pixels, scene.channels, light, &pixel);
            for k in 0..scene.channels {
                let place = light * scene.channels + k;
                let measured = stored[k].mul_add(scale, offset);
                let difference =
                    encode(measured / shading.irradiance(scene, light, k), toe) - encode(shading.relative[place], toe);
                let clipped = !measured.lt(Lane([self.clip_level[k]; LANES]));
                let least = Lane::select(clipped, difference.max(zero), difference);
                let known = difference.abs().lt(Lane([f32::INFINITY; LANES]));
                rest[place] = Lane::select(known, least, zero);
            }
        }
    }

    /// Walks over the pixels with all threads, of each block with its slice of `out`, which has `width` elements per pixel.
    #[inline(always)]
    fn walk<const ISA: Isa, const C: usize, T: Send>(
        &self,
        shade: Shader<ISA>,
        width: usize,
        out: &mut [T],
        take: impl Fn(&[Lane<ISA>], &mut [T]) + Sync + Send,
    ) {
        let make = || {
            let shading = Shading::<ISA>::new(self.scene);
            let rest = shading.relative.clone();
            (shading, rest)
        };
        on_all_threads(out.chunks_mut(BLOCK * width).enumerate(), make, |(shading, rest), (block, out)| {
            for (group, out) in out.chunks_mut(LANES * width).enumerate() {
                let first = block * BLOCK + group * LANES;
                shade(self.scene, first, shading);
                outlined::<ISA, _>(
                    #[inline(always)]
                    || {
                        self.of_group::<ISA, C>(first, shading, rest);
                        take(rest, out);
                    },
                );
            }
        });
    }

    /// What is left over, (pixel, light, channel).
    #[inline(always)]
    pub fn samples<const ISA: Isa, const C: usize>(&self, shade: Shader<ISA>) -> Vec<f32> {
        let width = self.scene.lights.len() * self.scene.channels;
        let mut samples = vec![0.0; self.scene.parameters.pixels * width];
        self.walk::<ISA, C, _>(
            shade,
            width,
            &mut samples,
            #[inline(always)]
            |rest, out| {
                for (i, pixel) in out.chunks_exact_mut(width).enumerate() {
                    for (sample, rest) in pixel.iter_mut().zip(rest) {
                        *sample = rest.0[i];
                    }
                }
            },
        );
        samples
    }

    /// Codes of what is left over, (pixel, component); `encoder` is (component, light and channel).
    #[inline(always)]
    pub fn codes<const ISA: Isa, const C: usize>(&self, shade: Shader<ISA>, encoder: &[f32]) -> Vec<u16> {
        let width = self.scene.lights.len() * self.scene.channels;
        let components = encoder.len() / width;
        let mut codes = vec![0; self.scene.parameters.pixels * components];
        let parts: Vec<Vec<[f32; SIDE_BY_SIDE]>> = encoder
            .chunks(SIDE_BY_SIDE * width)
            .map(|rows| (0..width).map(|s| array!(|k| rows.get(k * width + s).copied().unwrap_or(0.0))).collect())
            .collect();
        self.walk::<ISA, C, _>(
            shade,
            components,
            &mut codes,
            #[inline(always)]
            |rest, out| {
                for (number, part) in parts.iter().enumerate() {
                    let mut sums = [Lane::splat(0.0); SIDE_BY_SIDE];
                    for (rest, weights) in rest.iter().zip(part) {
                        for k in 0..SIDE_BY_SIDE {
                            sums[k] = rest.mul_add(Lane([weights[k]; LANES]), sums[k]);
                        }
                    }
                    let first = number * SIDE_BY_SIDE;
                    for k in first..components.min(first + SIDE_BY_SIDE) {
                        let code = round(sums[k - first]);
                        for (i, pixel) in out.chunks_exact_mut(components).enumerate() {
                            pixel[k] = code.0[i] as u16;
                        }
                    }
                }
            },
        );
        codes
    }
}

/// The codes nearest to coefficients.
#[inline(always)]
fn round<const ISA: Isa>(coefficient: Lane<ISA>) -> Lane<ISA> {
    // Rounds to an integer when it is added, see `Lane::exp`.
    let shift = Lane([12_582_912.0; LANES]);
    let code = coefficient.max(Lane([-ZERO; LANES])).min(Lane([ZERO - 1.0; LANES]));
    code + shift - shift + Lane([ZERO; LANES])
}
