//! Where the fit of a pixel begins: a few plausible normals, each with a grid of shapes, the best by residual.

use crate::arrow::Arrow;
use crate::geometry::{Illumination, chord_squared, dot, normalise};
use crate::lanes::{Lane, outlined};
use crate::minimise::solve_symmetric;
use crate::models::{MAX_SHAPE, MAX_STARTS, Model, Optics};
use crate::number::{Number, Real, array};
use crate::observations::Group;
use crate::separable::{NORMAL_Z_MIN, Point};

/// Mean over the channels of one light's samples, and the weight of that mean.
#[derive(Clone, Copy)]
pub struct Grey<const FMA: bool> {
    pub radiance: Lane<FMA>,
    pub weight: Lane<FMA>,
}

#[inline(always)]
pub fn grey<const FMA: bool, const C: usize>(group: &Group<FMA, C>, into: &mut Vec<Grey<FMA>>) {
    into.clear();
    let share = Lane::splat(1.0 / group.channels as f64);
    for observation in &group.observations {
        let mut radiance = Lane::splat(0.0);
        let mut variance = Lane::splat(0.0);
        for k in 0..group.channels {
            radiance = radiance + observation.radiance[k] * share;
            // A channel without weight makes the mean's variance infinite and its weight 0.
            variance = variance + share * share / observation.weight[k];
        }
        into.push(Grey { radiance, weight: Lane::splat(1.0) / variance });
    }
}

#[inline(always)]
fn bounded<const FMA: bool>(vector: [Lane<FMA>; 3]) -> [Lane<FMA>; 3] {
    let length = dot(vector, vector).sqrt().max(Lane::splat(1e-20));
    let unit: [Lane<FMA>; 3] = array!(|i| vector[i] / length);
    normalise([unit[0], unit[1], unit[2].max(Lane::splat(NORMAL_Z_MIN))])
}

/// The centroid of the half vectors, weighted by radiance to the fourth power: where the highlight is. Clipped samples
/// count, for they are its brightest.
#[inline(always)]
fn highlight_normal<const FMA: bool>(grey: &[Grey<FMA>], illuminations: &[Illumination<Lane<FMA>>]) -> [Lane<FMA>; 3] {
    let mut brightest = Lane::splat(1e-20);
    for sample in grey {
        brightest = brightest.max(sample.radiance);
    }
    let scale = Lane::splat(1.0) / brightest;
    let mut sum = [Lane::splat(0.0); 3];
    for (sample, at) in grey.iter().zip(illuminations) {
        let weight = (sample.radiance * scale).squared().squared();
        for i in 0..3 {
            sum[i] = weight.mul_add(at.half[i], sum[i]);
        }
    }
    bounded(sum)
}

/// Lambert's normal by linear least squares over samples away from the highlight that `previous` would have, in Cauchy's
/// norm, so that shadows and what is left of the highlight do not pull.
#[inline(always)]
pub fn diffuse_normal<const FMA: bool>(
    grey: &[Grey<FMA>],
    illuminations: &[Illumination<Lane<FMA>>],
    rounds: usize,
) -> [Lane<FMA>; 3] {
    let zero = Lane::splat(0.0);
    let mut scaled_normal = [zero, zero, zero];
    let mut normal = [zero, zero, Lane::splat(1.0)];
    for round in 0..rounds {
        let mut matrix = [[zero; 3]; 3];
        let mut right = [zero; 3];
        let albedo_squared = dot(scaled_normal, scaled_normal).max(Lane::splat(1e-12));
        for (sample, at) in grey.iter().zip(illuminations) {
            let chord = chord_squared(normal, at.half);
            let sine_squared = chord * chord.mul_add(Lane::splat(-0.25), Lane::splat(1.0));
            let mut weight = sine_squared * sine_squared;
            if round > 0 {
                // Cauchy's scale: a tenth of the albedo, far above the noise and far below a highlight.
                let residual = sample.radiance - dot(scaled_normal, at.light).max(zero);
                let outlying = residual * residual / (albedo_squared * Lane::splat(0.01));
                weight = weight / (Lane::splat(1.0) + outlying);
            }
            weight = Lane::select(sample.weight.positive(), weight, zero);
            for i in 0..3 {
                let weighted = weight * at.light[i];
                right[i] = weighted.mul_add(sample.radiance, right[i]);
                for j in i..3 {
                    matrix[i][j] = weighted.mul_add(at.light[j], matrix[i][j]);
                }
            }
        }
        // Lights in one plane leave the third direction undetermined: a little ridge makes it 0.
        let ridge = (matrix[0][0] + matrix[1][1] + matrix[2][2]) * Lane::splat(1e-5) + Lane::splat(1e-20);
        for i in 0..3 {
            matrix[i][i] = matrix[i][i] + ridge;
        }
        scaled_normal = solve_symmetric(matrix, right);
        normal = bounded(scaled_normal);
    }
    normal
}

/// The better of the candidate normals and the best shape of the model's grid for it.
#[inline(always)]
pub fn start<M: Model, const FMA: bool>(
    grey: &[Grey<FMA>],
    illuminations: &[Illumination<Lane<FMA>>],
    optics: &Optics,
    ambient: bool,
) -> Point<FMA> {
    outlined::<FMA, _>(
        #[inline(always)]
        || start_inline::<M, FMA>(grey, illuminations, optics, ambient),
    )
}

#[inline(always)]
fn start_inline<M: Model, const FMA: bool>(
    grey: &[Grey<FMA>],
    illuminations: &[Illumination<Lane<FMA>>],
    optics: &Optics,
    ambient: bool,
) -> Point<FMA> {
    let candidates = [diffuse_normal(grey, illuminations, 3), highlight_normal(grey, illuminations)];
    let mut best_cost = Lane::splat(f64::from(f32::MAX));
    let mut best = Point { normal: candidates[0], shape_log: [Lane::splat(0.0); MAX_SHAPE] };
    let one = [Lane::splat(1.0)];
    for normal in candidates {
        let mut arrows = [Arrow::<FMA, 1>::new(ambient); MAX_STARTS];
        let mut data = Lane::splat(0.0);
        for (sample, at) in grey.iter().zip(illuminations) {
            let (radiance, weight) = ([sample.radiance], [sample.weight]);
            // The inner loop is over the shapes, so that what depends on the directions alone is computed once.
            for (arrow, shape) in arrows.iter_mut().zip(M::STARTS) {
                let shape: [Lane<FMA>; MAX_SHAPE] = array!(|i| Lane::splat(shape[i]));
                let basis = M::basis(normal, &shape[..M::SHAPE.len()], at, optics);
                arrow.add(M::LOBES, basis.diffuse, &basis.specular, &radiance, &weight, &one);
            }
            data = (sample.weight * sample.radiance).mul_add(sample.radiance, data);
        }
        for (arrow, shape) in arrows.iter().zip(M::STARTS) {
            let (magnitudes, _) = arrow.magnitudes(M::LOBES);
            let cost = data - magnitudes.dot(&arrow.right);
            let better = cost.lt(best_cost);
            best_cost = Lane::select(better, cost, best_cost);
            for i in 0..3 {
                best.normal[i] = Lane::select(better, normal[i], best.normal[i]);
            }
            for i in 0..M::SHAPE.len() {
                best.shape_log[i] = Lane::select(better, Lane::splat(shape[i].ln()), best.shape_log[i]);
            }
        }
    }
    best
}
