//! Where the fit of a pixel begins: a few plausible normals, each with a grid of shapes, the best by residual.

use crate::arrow::Arrow;
use crate::geometry::{Illumination, chord_squared, dot, normalise};
use crate::lanes::{Isa, Lane, outlined};
use crate::minimise::solve_symmetric;
use crate::models::{MAX_SHAPE, MAX_STARTS, Model, Optics};
use crate::number::{Number, Real, array};
use crate::observations::Group;
use crate::separable::{NORMAL_Z_MIN, Point};

/// Mean over the channels of one light's samples, and the weight of that mean.
#[derive(Clone, Copy)]
pub struct Grey<const ISA: Isa> {
    pub radiance: Lane<ISA>,
    pub weight: Lane<ISA>,
}

#[inline(always)]
pub fn grey<const ISA: Isa, const C: usize>(group: &Group<ISA, C>, into: &mut Vec<Grey<ISA>>) {
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
fn bounded<const ISA: Isa>(vector: [Lane<ISA>; 3]) -> [Lane<ISA>; 3] {
    let length = dot(vector, vector).sqrt().max(Lane::splat(1e-20));
    let unit: [Lane<ISA>; 3] = array!(|i| vector[i] / length);
    normalise([unit[0], unit[1], unit[2].max(Lane::splat(NORMAL_Z_MIN))])
}

/// The centroid of the half vectors, weighted by radiance to the fourth power: where the highlight is. Clipped samples
/// count, for they are its brightest.
#[inline(always)]
fn highlight_normal<const ISA: Isa>(grey: &[Grey<ISA>], illuminations: &[Illumination<Lane<ISA>>]) -> [Lane<ISA>; 3] {
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
/// norm, so that shadows and what is left of the highlight do not pull. The normal is multiplied by the albedo.
#[inline(always)]
fn scaled_normal<const ISA: Isa>(
    grey: &[Grey<ISA>],
    illuminations: &[Illumination<Lane<ISA>>],
    rounds: usize,
) -> [Lane<ISA>; 3] {
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
    scaled_normal
}

/// Lambert's normal by `rounds` of reweighted linear least squares.
#[inline(always)]
pub fn diffuse_normal<const ISA: Isa>(
    grey: &[Grey<ISA>],
    illuminations: &[Illumination<Lane<ISA>>],
    rounds: usize,
) -> [Lane<ISA>; 3] {
    bounded(scaled_normal(grey, illuminations, rounds))
}

/// The diffuse light of each pixel under each light, by Lambert's normal in `rounds` of reweighted least squares.
#[inline(always)]
pub fn diffuse_light<const ISA: Isa>(
    grey: &[Grey<ISA>],
    illuminations: &[Illumination<Lane<ISA>>],
    rounds: usize,
    into: &mut Vec<Lane<ISA>>,
) {
    let scaled = scaled_normal(grey, illuminations, rounds);
    into.clear();
    for at in illuminations {
        into.push(dot(scaled, at.light).max(Lane::splat(0.0)));
    }
}

/// Takes weight from samples that are darker than the diffuse light around them explains: cast shadows. A robust loss would
/// find them too, but not from a start that they have spoilt. Returns the share of weight that each light keeps.
#[inline(always)]
pub fn doubt_shadows<const ISA: Isa>(
    grey: &mut [Grey<ISA>],
    illuminations: &[Illumination<Lane<ISA>>],
    kept: &mut Vec<Lane<ISA>>,
) {
    let zero = Lane::splat(0.0);
    diffuse_light(grey, illuminations, 8, kept);
    for (sample, kept) in grey.iter_mut().zip(kept) {
        let expected = *kept;
        // A tenth darker than expected halves the weight.
        let missing = (expected - sample.radiance).max(zero) / (expected * Lane::splat(0.1)).max(Lane::splat(1e-20));
        *kept = Lane::splat(1.0) / missing.mul_add(missing, Lane::splat(1.0));
        sample.weight = sample.weight * *kept;
    }
}

/// Two normals that the fit may start from: where the diffuse light puts it, and where the highlight does.
#[inline(always)]
pub fn candidates<const ISA: Isa>(
    grey: &[Grey<ISA>],
    illuminations: &[Illumination<Lane<ISA>>],
) -> [[Lane<ISA>; 3]; 2] {
    [diffuse_normal(grey, illuminations, 3), highlight_normal(grey, illuminations)]
}

/// Angles, in radians, by which normals are tried aside of the plane in which all lights lie. There the error is the same on
/// both sides of a normal in the half vectors' own plane: a fit that starts in it has no slope to leave it by, and one that
/// starts on one side seldom comes to the other.
pub const ASIDE: [f64; 4] = [0.1, -0.1, 0.35, -0.35];

/// The candidates, moved by an angle along `across`.
#[inline(always)]
pub fn aside<const ISA: Isa, const N: usize>(
    candidates: &[[Lane<ISA>; 3]; N],
    across: [f64; 3],
    angle: f64,
) -> [[Lane<ISA>; 3]; N] {
    array!(|n| bounded(array!(|i| candidates[n][i] + Lane::splat(angle * across[i]))))
}

/// The best shape of the model's grid at the best of the candidate normals; of those whose first coordinate is not near
/// `avoided`, where that is given.
#[inline(always)]
pub fn start<M: Model, const ISA: Isa>(
    candidates: &[[Lane<ISA>; 3]],
    grey: &[Grey<ISA>],
    illuminations: &[Illumination<Lane<ISA>>],
    optics: &Optics,
    ambient: bool,
    avoided: Option<Lane<ISA>>,
) -> Point<ISA> {
    outlined::<ISA, _>(
        #[inline(always)]
        || start_inline::<M, ISA>(candidates, grey, illuminations, optics, ambient, avoided),
    )
}

/// Logarithmic widths that differ by less lead to one minimum.
const NEAR: f64 = 0.8;

/// Weighted sums for radiance = b · l + Ae + As · lobe, where the lobe belongs to a candidate normal and b is free.
///
/// To leave the diffuse normal b free costs nothing, for it is linear, and it keeps a broad lobe apart from a tilt of the
/// diffuse term that a candidate normal slightly off would otherwise pay for with a negative lobe.
#[derive(Clone, Copy)]
struct FreeDiffuse<const ISA: Isa> {
    /// Of (l, 1) with itself; the row of 1 is 0 without ambient term.
    matrix: [[Lane<ISA>; 4]; 4],
    right: [Lane<ISA>; 4],
    data: Lane<ISA>,
}

#[derive(Clone, Copy)]
struct LobeSums<const ISA: Isa> {
    cross: [Lane<ISA>; 4],
    square: Lane<ISA>,
    right: Lane<ISA>,
}

#[inline(always)]
fn start_inline<M: Model, const ISA: Isa>(
    candidates: &[[Lane<ISA>; 3]],
    grey: &[Grey<ISA>],
    illuminations: &[Illumination<Lane<ISA>>],
    optics: &Optics,
    ambient: bool,
    avoided: Option<Lane<ISA>>,
) -> Point<ISA> {
    let zero = Lane::splat(0.0);
    let one = Lane::splat(if ambient { 1.0 } else { 0.0 });
    let mut best_cost = Lane::splat(f64::from(f32::MAX));
    let mut best = Point { normal: candidates[0], coordinates: [zero; MAX_SHAPE] };
    let mut free_normal = candidates[0];
    for &normal in candidates {
        let mut sums = FreeDiffuse { matrix: [[zero; 4]; 4], right: [zero; 4], data: zero };
        let mut lobes = [LobeSums { cross: [zero; 4], square: zero, right: zero }; MAX_STARTS];
        for (sample, at) in grey.iter().zip(illuminations) {
            sums.data = (sample.weight * sample.radiance).mul_add(sample.radiance, sums.data);
            let weight = Lane::select(dot(normal, at.light).positive(), sample.weight, zero);
            let column = [at.light[0], at.light[1], at.light[2], one];
            let weighted: [Lane<ISA>; 4] = array!(|i| weight * column[i]);
            for i in 0..4 {
                sums.right[i] = weighted[i].mul_add(sample.radiance, sums.right[i]);
                for j in i..4 {
                    sums.matrix[i][j] = weighted[i].mul_add(column[j], sums.matrix[i][j]);
                }
            }
            // The inner loop is over the shapes, so that what depends on the directions alone is computed once.
            for (lobe, shape) in lobes.iter_mut().zip(M::STARTS) {
                let shape: [Lane<ISA>; MAX_SHAPE] = array!(|i| Lane::splat(shape[i]));
                let value = M::basis(normal, &shape[..M::SHAPE.len()], at, optics).specular[0];
                for i in 0..4 {
                    lobe.cross[i] = weighted[i].mul_add(value, lobe.cross[i]);
                }
                let weighted = weight * value;
                lobe.square = weighted.mul_add(value, lobe.square);
                lobe.right = weighted.mul_add(sample.radiance, lobe.right);
            }
        }
        // Lights in one plane leave the third direction undetermined: a little ridge makes it 0.
        let ridge = (sums.matrix[0][0] + sums.matrix[1][1] + sums.matrix[2][2]) * Lane::splat(1e-6);
        for i in 0..3 {
            sums.matrix[i][i] = sums.matrix[i][i] + ridge;
        }
        let diffuse = solve_symmetric(sums.matrix, sums.right);
        let base = sums.data - product(&diffuse, &sums.right);
        for (lobe, shape) in lobes.iter().zip(M::STARTS) {
            let absorbed = solve_symmetric(sums.matrix, lobe.cross);
            let square = (lobe.square - product(&absorbed, &lobe.cross)).max(lobe.square * Lane::splat(1e-5));
            let magnitude = (lobe.right - product(&absorbed, &sums.right)).max(zero) / square.max(Lane::splat(1e-30));
            let cost = base - magnitude * magnitude * square;
            let coordinates = M::coordinates(shape);
            let mut better = cost.lt(best_cost);
            if let Some(avoided) = avoided {
                better = better & (avoided - Lane::splat(coordinates[0])).abs().gt(Lane::splat(NEAR));
            }
            best_cost = Lane::select(better, cost, best_cost);
            for i in 0..3 {
                best.normal[i] = Lane::select(better, normal[i], best.normal[i]);
                let free = diffuse[i] - magnitude * absorbed[i];
                free_normal[i] = Lane::select(better, free, free_normal[i]);
            }
            for i in 0..M::SHAPE.len() {
                best.coordinates[i] = Lane::select(better, Lane::splat(coordinates[i]), best.coordinates[i]);
            }
        }
    }
    // The lobe's normal or the diffuse term's: whichever serves both better.
    let free_normal = bounded(free_normal);
    let costs = [
        one_normal_cost::<M, ISA, 1>(best.normal, &best.coordinates, grey, illuminations, optics, ambient),
        one_normal_cost::<M, ISA, 1>(free_normal, &best.coordinates, grey, illuminations, optics, ambient),
    ];
    let better = costs[1].lt(costs[0]);
    best.normal = array!(|i| Lane::select(better, free_normal[i], best.normal[i]));
    best
}

/// The best shape of the model's grid at a normal that is known, diffuse term and lobe alike.
#[inline(always)]
pub fn start_at<M: Model<L>, const ISA: Isa, const L: usize>(
    normal: [Lane<ISA>; 3],
    grey: &[Grey<ISA>],
    illuminations: &[Illumination<Lane<ISA>>],
    optics: &Optics,
    ambient: bool,
) -> Point<ISA> {
    let mut best_cost = Lane::splat(f64::from(f32::MAX));
    let mut best = Point { normal, coordinates: [Lane::splat(0.0); MAX_SHAPE] };
    for coordinates in starts::<M, ISA, L>() {
        let cost = outlined::<ISA, _>(
            #[inline(always)]
            || one_normal_cost::<M, ISA, L>(normal, &coordinates, grey, illuminations, optics, ambient),
        );
        let better = cost.lt(best_cost);
        best_cost = Lane::select(better, cost, best_cost);
        best.coordinates = array!(|i| Lane::select(better, coordinates[i], best.coordinates[i]));
    }
    best
}

/// The coordinates of the model's grid of shapes.
#[inline(always)]
pub fn starts<M: Model<L>, const ISA: Isa, const L: usize>() -> impl Iterator<Item = [Lane<ISA>; MAX_SHAPE]> {
    M::STARTS.iter().map(|shape| {
        let coordinates = M::coordinates(shape);
        array!(|i| Lane::splat(if i < M::SHAPE.len() { coordinates[i] } else { 0.0 }))
    })
}

/// The coordinates of the last of these shapes, moved half-way to the bound of the first: lobes so broad that only a search
/// which has time to lose should try them.
#[inline(always)]
pub fn wider_start<M: Model<L>, const ISA: Isa, const L: usize>() -> Option<[Lane<ISA>; MAX_SHAPE]> {
    let mut coordinates = starts::<M, ISA, L>().last()?;
    if M::SHAPE.is_empty() {
        return None;
    }
    coordinates[0] = (coordinates[0] + Lane::splat(M::coordinate(0).upper)) * Lane::splat(0.5);
    Some(coordinates)
}

#[inline(always)]
fn product<const ISA: Isa, const N: usize>(a: &[Lane<ISA>; N], b: &[Lane<ISA>; N]) -> Lane<ISA> {
    let mut sum = Lane::splat(0.0);
    for i in 0..N {
        sum = a[i].mul_add(b[i], sum);
    }
    sum
}

/// Least cost of a normal and a shape over all magnitudes that are not negative.
#[inline(always)]
fn one_normal_cost<M: Model<L>, const ISA: Isa, const L: usize>(
    normal: [Lane<ISA>; 3],
    coordinates: &[Lane<ISA>; MAX_SHAPE],
    grey: &[Grey<ISA>],
    illuminations: &[Illumination<Lane<ISA>>],
    optics: &Optics,
    ambient: bool,
) -> Lane<ISA> {
    let one = [Lane::splat(1.0)];
    let shape = M::shape(*coordinates);
    let mut arrow = Arrow::<ISA, 1, L>::new(ambient);
    let mut data = Lane::splat(0.0);
    for (sample, at) in grey.iter().zip(illuminations) {
        let (radiance, weight) = ([sample.radiance], [sample.weight]);
        let basis = M::basis(normal, &shape[..M::SHAPE.len()], at, optics);
        arrow.add(M::LOBES, basis.diffuse, &basis.specular, &radiance, &weight, &one);
        data = (sample.weight * sample.radiance).mul_add(sample.radiance, data);
    }
    data - arrow.magnitudes(M::LOBES).0.dot(&arrow.right)
}
