//! Rendering: the radiance that fitted parameters give under any lights.

use crate::geometry::{Illumination, Place};
use crate::lanes::{Isa, LANES, Lane};
use crate::models::{MAX_SHAPE, Model, Optics};
use crate::number::{Number, array};

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
    /// Tilt θv of the view in the arm's plane, which the paper's procedure fits per pixel; empty for the camera's own view.
    pub view_tilt: &'a [f32],
}

/// One light and the camera.
#[derive(Clone, Copy)]
pub struct View<'a> {
    pub light: Place,
    pub camera: Place,
    pub intensity: &'a [f32],
    pub colour: &'a [f64],
    /// (pixel, 2), read only where light or camera is near.
    pub position_mm: Option<&'a [f32]>,
}

/// Renders pixels `first..first + LANES` into `radiance`, shape (pixel, channel). Missing parameters give missing radiance.
#[inline(always)]
pub fn render_group<M: Model<L>, const ISA: Isa, const L: usize>(
    parameters: &Parameters,
    view: &View,
    optics: &Optics,
    first: usize,
    radiance: &mut [f32],
) {
    let pixel: [usize; LANES] = array!(|i| (first + i).min(parameters.pixels - 1));
    let column = |map: &[f32], width: usize, index: usize| Lane::<ISA>(array!(|i| map[pixel[i] * width + index]));
    let channels = view.intensity.len();
    let (mut x_mm, mut y_mm) = (Lane::splat(0.0), Lane::splat(0.0));
    if let (true, Some(position)) = (view.light.near() || view.camera.near(), view.position_mm) {
        (x_mm, y_mm) = (column(position, 2, 0), column(position, 2, 1));
    }
    let (direction, falloff) = view.light.seen_from(x_mm, y_mm);
    let mut towards_camera = view.camera.seen_from(x_mm, y_mm).0;
    if !parameters.view_tilt.is_empty() {
        let tilt = column(parameters.view_tilt, 1, 0).0;
        towards_camera = [Lane(tilt.map(f32::sin)), Lane::splat(0.0), Lane(tilt.map(f32::cos))];
    }
    let at = Illumination::new(direction, towards_camera, optics.index);
    let normal = array!(|i| column(parameters.normal, 3, i));
    let mut shape = [Lane::splat(1.0); MAX_SHAPE];
    for (i, value) in shape.iter_mut().enumerate().take(M::SHAPE.len()) {
        *value = column(parameters.shape, M::SHAPE.len(), i);
    }
    let basis = M::basis(normal, &shape[..M::SHAPE.len()], &at, optics);
    let mut lobes = Lane::splat(0.0);
    for j in 0..M::LOBES {
        lobes = column(parameters.specular, M::LOBES, j).mul_add(basis.specular[j], lobes);
    }
    for k in 0..channels {
        let mut sum = lobes * Lane::splat(view.colour[k]);
        if !parameters.ambient.is_empty() {
            sum = sum + column(parameters.ambient, channels, k);
        }
        sum = column(parameters.diffuse, channels, k).mul_add(basis.diffuse, sum);
        let irradiance = falloff * Lane([view.intensity[k]; LANES]);
        let result = sum * irradiance;
        for (i, pixel) in radiance.chunks_exact_mut(channels).enumerate() {
            pixel[k] = result.0[i];
        }
    }
}
