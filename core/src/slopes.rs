//! The basis functions of a model and their slopes, in f64: what expected uncertainties are computed from before any
//! photograph is taken, and which lights would lower them.

use crate::dual::Dual;
use crate::geometry::{Illumination, Place, tangents};
use crate::models::{MAX_SHAPE, Model, Optics};
use crate::number::{Number, array};
use rayon::prelude::*;

/// Pixels before a camera, under lights of unit intensity.
pub struct View<'a> {
    /// (pixel, 3).
    pub normal: &'a [f64],
    /// (pixel, shape parameter).
    pub shape: &'a [f64],
    pub lights: &'a [Place],
    pub camera: Place,
    /// (pixel, 2), read only where a light or the camera is near.
    pub position_mm: Option<&'a [f32]>,
}

/// Basis functions times the light's fall-off, shape (pixel, light, 1 + lobes, 1 + P): each function's value, then its
/// slopes by a turn of the normal along each of its two tangents, in radians, and by the logarithm of each shape parameter, or
/// by itself where it may be negative.
///
/// P is 2 + the number of shape parameters.
pub fn basis_slopes<M: Model<L>, const P: usize, const L: usize>(view: &View, optics: &Optics) -> Vec<f64> {
    let functions = 1 + M::LOBES;
    let width = view.lights.len() * functions * (1 + P);
    let mut slopes = vec![0.0; view.normal.len() / 3 * width];
    slopes.par_chunks_mut(width.max(1)).enumerate().for_each(|(pixel, rows)| {
        let (mut x_mm, mut y_mm) = (0.0, 0.0);
        if let Some(position) = view.position_mm {
            (x_mm, y_mm) = (f64::from(position[2 * pixel]), f64::from(position[2 * pixel + 1]));
        }
        let unturned: [f64; 3] = array!(|i| view.normal[3 * pixel + i]);
        let (first, second) = tangents(unturned);
        let normal = array!(|i| {
            let mut component = Dual::<f64, P>::constant(unturned[i]);
            component.derivative[0] = first[i];
            component.derivative[1] = second[i];
            component
        });
        let mut shape = [Dual::<f64, P>::constant(1.0); MAX_SHAPE];
        for i in 0..P - 2 {
            let value = view.shape[pixel * (P - 2) + i];
            shape[i] = Dual::parameter(value, 2 + i, if M::SHAPE[i].logarithmic() { value } else { 1.0 });
        }
        let towards_camera = view.camera.seen_from(x_mm, y_mm).0;
        for (light, rows) in view.lights.iter().zip(rows.chunks_exact_mut(functions * (1 + P))) {
            let (direction, falloff) = light.seen_from(x_mm, y_mm);
            let at = Illumination::new(direction, towards_camera, optics.index);
            let basis = M::basis(normal, &shape[..P - 2], &at, optics);
            let lobes = basis.specular.iter().take(M::LOBES);
            for (function, row) in std::iter::once(&basis.diffuse).chain(lobes).zip(rows.chunks_exact_mut(1 + P)) {
                row[0] = function.value * falloff;
                for p in 0..P {
                    row[1 + p] = function.derivative[p] * falloff;
                }
            }
        }
    });
    slopes
}
