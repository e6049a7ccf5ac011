//! Rendering: the radiance that fitted parameters give under any lights.

use crate::dispatch::BLOCK;
use crate::geometry::{Illumination, Place};
use crate::lanes::{Isa, LANES, Lane, LaneMask, outlined};
use crate::models::{MAX_SHAPE, Model, Optics};
use crate::number::{Number, Real, array};
use crate::residual::Residual;
use crate::threads::on_all_threads;

/// Parameter maps of a tile, each (pixel, width).
#[derive(Clone, Copy)]
pub struct Parameters<'a> {
    pub pixels: usize,
    pub normal: &'a [f32],
    pub diffuse: &'a [f32],
    pub specular: &'a [f32],
    pub shape: &'a [f32],
    /// Empty for a model without ambient term.
    pub ambient: &'a [f32],
    /// Colour of the highlight over that of the light; empty where that is 1.
    pub specular_rgb: &'a [f32],
    /// Tilt θv of the view in the arm's plane, which the paper's procedure fits per pixel; empty for the camera's own view.
    pub view_tilt: &'a [f32],
}

/// A tile, and where lights and camera stand.
pub struct Scene<'a> {
    pub parameters: Parameters<'a>,
    pub channels: usize,
    pub lights: Vec<Place>,
    /// (light, channel): irradiance at the centre of the painting.
    pub intensity: Vec<f32>,
    pub camera: Place,
    /// Colour of the specular term, per channel.
    pub colour: Vec<f64>,
    /// (pixel, 2), read only where a light or the camera is near.
    pub position_mm: Option<&'a [f32]>,
    pub optics: Optics,
}

impl Scene<'_> {
    pub fn near(&self) -> bool {
        self.camera.near() || self.lights.iter().any(Place::near)
    }

    /// The pixels of a group from `first` on; past the end of the tile the last one is repeated.
    #[inline(always)]
    pub fn group(&self, first: usize) -> [usize; LANES] {
        array!(|i| (first + i).min(self.parameters.pixels - 1))
    }
}

/// A group of pixels as the model has it, under all lights. The buffers are reused from group to group.
pub struct Shading<const ISA: Isa> {
    illuminations: Vec<Illumination<Lane<ISA>>>,
    /// Per light: the squared ratio of its distance from the centre of the painting to that from the pixels.
    pub falloff: Vec<Lane<ISA>>,
    /// (light, channel): radiance over irradiance; not a number where parameters are missing.
    pub relative: Vec<Lane<ISA>>,
}

impl<const ISA: Isa> Shading<ISA> {
    pub fn new(scene: &Scene) -> Self {
        let zero = Lane::splat(0.0);
        let mut shading = Shading {
            illuminations: Vec::with_capacity(scene.lights.len()),
            falloff: Vec::with_capacity(scene.lights.len()),
            relative: vec![zero; scene.lights.len() * scene.channels],
        };
        shading.illuminate(scene, zero, zero, None);
        shading
    }

    /// Directions for pixels at these positions that are seen from `view`, by default from where the camera stands.
    #[inline(always)]
    fn illuminate(&mut self, scene: &Scene, x_mm: Lane<ISA>, y_mm: Lane<ISA>, view: Option<[Lane<ISA>; 3]>) {
        let view = match view {
            Some(view) => view,
            None => scene.camera.seen_from(x_mm, y_mm).0,
        };
        self.illuminations.clear();
        self.falloff.clear();
        for place in &scene.lights {
            let (direction, falloff) = place.seen_from(x_mm, y_mm);
            self.illuminations.push(Illumination::new(direction, view, scene.optics.index));
            self.falloff.push(falloff);
        }
    }

    /// The irradiance of a light at the pixels.
    #[inline(always)]
    pub fn irradiance(&self, scene: &Scene, light: usize, channel: usize) -> Lane<ISA> {
        self.falloff[light] * Lane([scene.intensity[light * scene.channels + channel]; LANES])
    }
}

/// Evaluates a model at the pixels `first..first + LANES`.
pub type Shader<const ISA: Isa> = fn(scene: &Scene, first: usize, shading: &mut Shading<ISA>);

/// The shader of model M. A pixel of which a magnitude or a shape of the lobes is missing has none.
#[inline(always)]
pub fn shade<M: Model<L>, const ISA: Isa, const L: usize>(scene: &Scene, first: usize, shading: &mut Shading<ISA>) {
    let parameters = &scene.parameters;
    let channels = scene.channels;
    let pixel = scene.group(first);
    let column = |map: &[f32], width: usize, index: usize| Lane::<ISA>(array!(|i| map[pixel[i] * width + index]));
    let infinity = Lane([f32::INFINITY; LANES]);
    let mut told = LaneMask::ALL;
    let mut specular = [Lane::splat(0.0); L];
    for j in 0..M::LOBES {
        specular[j] = column(parameters.specular, M::LOBES, j);
        told = told & specular[j].abs().lt(infinity);
    }
    let mut shape = [Lane::splat(1.0); MAX_SHAPE];
    for i in 0..M::SHAPE.len() {
        shape[i] = column(parameters.shape, M::SHAPE.len(), i);
        told = told & shape[i].abs().lt(infinity);
    }
    for value in &mut specular {
        *value = Lane::select(told, *value, Lane::splat(0.0));
    }
    for value in &mut shape {
        // Any shape will do for a lobe of no magnitude that is within the range of every parameter.
        *value = Lane::select(told, *value, Lane::splat(0.5));
    }
    let near = scene.near();
    if near || !parameters.view_tilt.is_empty() {
        let (mut x_mm, mut y_mm) = (Lane::splat(0.0), Lane::splat(0.0));
        if let (true, Some(position)) = (near, scene.position_mm) {
            (x_mm, y_mm) = (column(position, 2, 0), column(position, 2, 1));
        }
        let mut view = None;
        if !parameters.view_tilt.is_empty() {
            let tilt = Lane::select(told, column(parameters.view_tilt, 1, 0), Lane::splat(0.0)).0;
            view = Some([Lane(tilt.map(f32::sin)), Lane::splat(0.0), Lane(tilt.map(f32::cos))]);
        }
        shading.illuminate(scene, x_mm, y_mm, view);
    }
    let normal = array!(|i| column(parameters.normal, 3, i));
    for (light, at) in shading.illuminations.iter().enumerate() {
        let basis = M::basis(normal, &shape[..M::SHAPE.len()], at, &scene.optics);
        let mut lobes = Lane::splat(0.0);
        for j in 0..M::LOBES {
            lobes = specular[j].mul_add(basis.specular[j], lobes);
        }
        for k in 0..channels {
            let mut sum = lobes * Lane::splat(scene.colour[k]);
            if !parameters.specular_rgb.is_empty() {
                sum = sum * column(parameters.specular_rgb, channels, k);
            }
            if !parameters.ambient.is_empty() {
                sum = sum + column(parameters.ambient, channels, k);
            }
            sum = column(parameters.diffuse, channels, k).mul_add(basis.diffuse, sum);
            shading.relative[light * channels + k] = sum;
        }
    }
}

/// Renders a tile with all threads into `radiance`, (light, pixel, channel).
#[inline(always)]
pub fn render<const ISA: Isa>(shade: Shader<ISA>, scene: &Scene, residual: Option<&Residual>, radiance: &mut [f32]) {
    let (pixels, channels) = (scene.parameters.pixels, scene.channels);
    let mut blocks: Vec<Vec<&mut [f32]>> = (0..pixels.div_ceil(BLOCK)).map(|_| Vec::new()).collect();
    for frame in radiance.chunks_mut(pixels * channels) {
        for (block, part) in blocks.iter_mut().zip(frame.chunks_mut(BLOCK * channels)) {
            block.push(part);
        }
    }
    let make = || (Shading::<ISA>::new(scene), Vec::new());
    on_all_threads(blocks.iter_mut().enumerate(), make, |(shading, coefficients), (block, frames)| {
        for first in (block * BLOCK..pixels.min((block + 1) * BLOCK)).step_by(LANES) {
            shade(scene, first, shading);
            outlined::<ISA, _>(
                #[inline(always)]
                || write(scene, first, shading, residual, coefficients, frames),
            );
        }
    });
}

/// Writes a group into a block's part of each light's frame; `coefficients` is a buffer.
#[inline(always)]
fn write<const ISA: Isa>(
    scene: &Scene,
    first: usize,
    shading: &Shading<ISA>,
    residual: Option<&Residual>,
    coefficients: &mut Vec<Lane<ISA>>,
    frames: &mut [&mut [f32]],
) {
    if let Some(residual) = residual {
        residual.decode(&scene.group(first), coefficients);
    }
    let channels = scene.channels;
    let start = first % BLOCK * channels;
    for (light, frame) in frames.iter_mut().enumerate() {
        let end = frame.len().min(start + LANES * channels);
        for k in 0..channels {
            let relative = shading.relative[light * channels + k];
            let irradiance = shading.irradiance(scene, light, k);
            let mut result = relative * irradiance;
            if let Some(residual) = residual {
                let added = residual.add(relative, coefficients, light * channels + k) * irradiance;
                let known = irradiance.positive() & relative.abs().lt(Lane([f32::INFINITY; LANES]));
                result = Lane::select(known, added, result);
            }
            for (i, pixel) in frame[start..end].chunks_exact_mut(channels).enumerate() {
                pixel[k] = result.0[i];
            }
        }
    }
}
