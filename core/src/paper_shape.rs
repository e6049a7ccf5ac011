//! Step 5 of the paper's procedure: the shape of the lobe at one pixel, with the diffuse term and As held.
//!
//! Free are the view's tilt θv in the arm's plane (φv = 0), the logarithm of the shape parameter, and an empirical tilt φn
//! of the normal out of that plane.

use crate::dual::Steered;
use crate::fresnel::fresnel_slope;
use crate::geometry::{Illumination, dot, normalise};
use crate::lanes::{Isa, LANES, Lane, LaneMask, outlined};
use crate::minimise::{Objective, Outcome, Quadratic, Queue, minimise_all};
use crate::models::{MAX_SHAPE, MAX_STARTS, Model, Optics};
use crate::number::{Number, Real, array};
use crate::observations::Group;
use crate::separable::Point;
use std::marker::PhantomData;

/// θv stays within this of its calibrated value, radians: more than any error of the normal should make of it.
const VIEW_RANGE: f64 = 0.35;
/// φn lies between 0 and this, radians: its sign cannot be seen.
const PHI_MAX: f64 = 0.7;
/// Out-of-plane tilts that the search starts from, radians: not 0, where the cost has no slope to leave it by.
const PHI_STARTS: [f64; 2] = [0.03, 0.12];

#[derive(Clone, Copy, Debug)]
pub struct Tilts<const ISA: Isa> {
    pub view: Lane<ISA>,
    pub shape_log: Lane<ISA>,
    pub phi: Lane<ISA>,
}

impl<const ISA: Isa> Tilts<ISA> {
    #[inline(always)]
    fn copy_lane(&mut self, lane: usize, from: &Self, pixel: usize) {
        self.view.0[lane] = from.view.0[pixel];
        self.shape_log.0[lane] = from.shape_log.0[pixel];
        self.phi.0[lane] = from.phi.0[pixel];
    }
}

/// What the diffuse term leaves of one light's samples, all channels in one.
///
/// The lobe reaches channel k as As s_k times its value, s the light's colour: of the channels' residuals only their
/// projection on s depends on the lobe, and that is one number with one weight.
#[derive(Clone, Copy)]
pub struct Remainder<const ISA: Isa> {
    value: Lane<ISA>,
    weight: Lane<ISA>,
}

/// What the diffuse stage leaves of a group of pixels for the shape to explain.
#[derive(Clone)]
pub struct Left<const ISA: Isa> {
    remainders: Vec<Remainder<ISA>>,
    /// The part of the cost that no lobe changes.
    constant: Lane<ISA>,
    normal: [Lane<ISA>; 3],
}

impl<const ISA: Isa> Left<ISA> {
    pub fn new(lights: usize) -> Self {
        let zero = Lane::splat(0.0);
        Left { remainders: vec![Remainder { value: zero, weight: zero }; lights], constant: zero, normal: [zero; 3] }
    }

    /// `magnitude` is the diffuse stage's; the diffuse term keeps the normal of that stage.
    #[inline(always)]
    pub fn take<const C: usize>(
        &mut self,
        group: &Group<ISA, C>,
        normal: [Lane<ISA>; 3],
        magnitude: [Lane<ISA>; C],
        colour: [Lane<ISA>; C],
    ) {
        let zero = Lane::splat(0.0);
        let mut constant = zero;
        for ((remainder, observation), at) in
            self.remainders.iter_mut().zip(&group.observations).zip(&group.illuminations)
        {
            let cosine = dot(normal, at.light).max(zero);
            let (mut weight, mut projected, mut squares) = (zero, zero, zero);
            for k in 0..C {
                let left = observation.radiance[k] - magnitude[k] * cosine;
                let coloured = observation.weight[k] * colour[k];
                weight = coloured.mul_add(colour[k], weight);
                projected = coloured.mul_add(left, projected);
                squares = (observation.weight[k] * left).mul_add(left, squares);
            }
            let value = Lane::select(weight.positive(), projected / weight, zero);
            constant = constant + squares - value * projected;
            *remainder = Remainder { value, weight };
        }
        self.constant = constant.max(zero);
        self.normal = normal;
    }

    #[inline(always)]
    pub fn normal(&self, phi: Lane<ISA>) -> [Lane<ISA>; 3] {
        let (sine, cosine) = sine_cosine(phi);
        rotated(self.normal, sine, cosine)
    }

    /// Makes one lane that of a pixel of another group.
    #[inline(always)]
    fn copy_lane(&mut self, lane: usize, from: &Left<ISA>, pixel: usize) {
        for (remainder, from) in self.remainders.iter_mut().zip(&from.remainders) {
            remainder.value.0[lane] = from.value.0[pixel];
            remainder.weight.0[lane] = from.weight.0[pixel];
        }
        self.constant.0[lane] = from.constant.0[pixel];
        for (axis, from) in self.normal.iter_mut().zip(&from.normal) {
            axis.0[lane] = from.0[pixel];
        }
    }
}

/// A light in the arm's plane, XZ, with sine and cosine of half its tilt θa.
#[derive(Clone, Copy)]
struct ArmLight<const ISA: Isa> {
    light: [Lane<ISA>; 3],
    half_tilt: (Lane<ISA>, Lane<ISA>),
}

impl<const ISA: Isa> ArmLight<ISA> {
    fn new(light: [Lane<ISA>; 3]) -> Self {
        let half: Lane<ISA> = Lane(array!(|i| 0.5 * light[0].0[i].atan2(light[2].0[i])));
        ArmLight { light, half_tilt: (Lane(array!(|i| half.0[i].sin())), Lane(array!(|i| half.0[i].cos()))) }
    }

    /// What `Illumination::new` makes of a view that is in the plane too and turns with the first parameter; `half_view` are
    /// sine and cosine of θv / 2. The half vector's tilt is (θa + θv) / 2, and l · h the cosine of (θa − θv) / 2: they take
    /// neither a root nor a division, nor do their slopes.
    #[inline(always)]
    fn seen_from(
        &self,
        view: [Steered<Lane<ISA>, 3>; 3],
        half_view: (Lane<ISA>, Lane<ISA>),
        index: f64,
    ) -> Illumination<Steered<Lane<ISA>, 3>> {
        let half = Lane::splat(0.5);
        let ((sin_a, cos_a), (sin_v, cos_v)) = (self.half_tilt, half_view);
        let (sine, cosine) = (sin_a.mul_add(cos_v, cos_a * sin_v), cos_a.mul_add(cos_v, -(sin_a * sin_v)));
        let light_half = cos_a.mul_add(cos_v, sin_a * sin_v);
        let slope = half * sin_a.mul_add(cos_v, -(cos_a * sin_v));
        let inverse = Lane::splat(1.0) / light_half;
        let (reflectance, reflectance_slope) = fresnel_slope(light_half, index);
        Illumination {
            light: array!(|i| Steered::given(self.light[i])),
            view,
            half: [
                Steered::parameter(sine, 0, half * cosine),
                Steered::given(Lane::splat(0.0)),
                Steered::parameter(cosine, 0, -(half * sine)),
            ],
            per_light_half: Steered::parameter(inverse, 0, -(slope * inverse * inverse)),
            facet_reflectance: Steered::parameter(reflectance, 0, slope * reflectance_slope),
        }
    }
}

/// The fit of the shape: what it is for all pixels, under distant lights in the plane XZ and a view that they share.
pub struct ShapeFit<M, const ISA: Isa> {
    illuminations: Vec<Illumination<Lane<ISA>>>,
    /// The same for the view's θv at φv = 0.
    in_plane: Vec<Illumination<Lane<ISA>>>,
    arm: Vec<ArmLight<ISA>>,
    specular: Lane<ISA>,
    optics: Optics,
    /// θv and φv as calibrated.
    view: (Lane<ISA>, Lane<ISA>),
    model: PhantomData<M>,
}

#[inline(always)]
fn rotated<R: Real>(normal: [R; 3], sine: R, cosine: R) -> [R; 3] {
    // The paper's parametrisation keeps θn and gives the normal the tilt φ: (cos φ sin θ, sin φ, cos φ cos θ).
    let in_plane = (normal[0] * normal[0] + normal[2] * normal[2]).sqrt();
    [cosine * normal[0] / in_plane, sine, cosine * normal[2] / in_plane]
}

impl<M: Model, const ISA: Isa> ShapeFit<M, ISA> {
    pub fn new(illuminations: &[Illumination<Lane<ISA>>], specular: Lane<ISA>, optics: Optics) -> Self {
        let view = illuminations[0].view;
        let theta = Lane(array!(|i| view[0].0[i].atan2(view[2].0[i])));
        let phi = Lane(array!(|i| view[1].0[i].asin()));
        let (sine, cosine) = sine_cosine(theta);
        let in_plane = [sine, Lane::splat(0.0), cosine];
        ShapeFit {
            illuminations: illuminations.to_vec(),
            in_plane: illuminations.iter().map(|at| Illumination::new(at.light, in_plane, optics.index)).collect(),
            arm: illuminations.iter().map(|at| ArmLight::new(at.light)).collect(),
            specular,
            optics,
            view: (theta, phi),
            model: PhantomData,
        }
    }

    /// The shape of the grid and the tilt out of the plane, of `tilts`, that fit best.
    #[inline(always)]
    fn search(
        &self,
        left: &Left<ISA>,
        illuminations: &[Illumination<Lane<ISA>>],
        tilts: [Lane<ISA>; PHI_STARTS.len()],
    ) -> (Lane<ISA>, Lane<ISA>) {
        outlined::<ISA, _>(
            #[inline(always)]
            || self.search_inline(left, illuminations, tilts),
        )
    }

    #[inline(always)]
    fn search_inline(
        &self,
        left: &Left<ISA>,
        illuminations: &[Illumination<Lane<ISA>>],
        tilts: [Lane<ISA>; PHI_STARTS.len()],
    ) -> (Lane<ISA>, Lane<ISA>) {
        let normals: [_; PHI_STARTS.len()] = array!(|i| left.normal(tilts[i]));
        let mut shapes = [Lane::splat(0.0); MAX_STARTS];
        for (lane, shape) in shapes.iter_mut().zip(M::STARTS) {
            *lane = Lane::splat(shape[0]);
        }
        let shapes = &shapes[..M::STARTS.len()];
        let mut costs = [[Lane::splat(0.0); MAX_STARTS]; PHI_STARTS.len()];
        for (remainder, at) in left.remainders.iter().zip(illuminations) {
            for (normal, costs) in normals.iter().zip(&mut costs) {
                for (cost, shape) in costs.iter_mut().zip(shapes) {
                    let lobe = M::basis(*normal, std::slice::from_ref(shape), at, &self.optics).specular[0];
                    let residual = remainder.value - self.specular * lobe;
                    *cost = (remainder.weight * residual).mul_add(residual, *cost);
                }
            }
        }
        let mut best_cost = Lane::splat(f64::from(f32::MAX));
        let mut best = (Lane::splat(M::STARTS[0][0].ln()), tilts[0]);
        for (tilt, costs) in tilts.into_iter().zip(&costs) {
            for (cost, shape) in costs.iter().zip(M::STARTS) {
                let better = cost.lt(best_cost);
                best_cost = Lane::select(better, *cost, best_cost);
                best.0 = Lane::select(better, Lane::splat(shape[0].ln()), best.0);
                best.1 = Lane::select(better, tilt, best.1);
            }
        }
        best
    }

    /// The best of a grid of shapes and φn, with θv as calibrated.
    #[inline(always)]
    pub fn start(&self, left: &Left<ISA>) -> Tilts<ISA> {
        let (shape_log, phi) = self.search(left, &self.in_plane, array!(|i| Lane::splat(PHI_STARTS[i])));
        Tilts { view: self.view.0, shape_log, phi }
    }

    /// The same grid for the calibrated view. The highlight lies at φn = φv/2; its height does not tell on which side of it
    /// the normal is, so the search begins on the side of the painting's own normal.
    #[inline(always)]
    pub fn start_out_of_plane(&self, left: &Left<ISA>) -> Point<ISA> {
        let half = self.view.1 * Lane::splat(0.5);
        let away = Lane::select(half.lt(Lane::splat(0.0)), Lane::splat(1.0), Lane::splat(-1.0));
        let (shape, phi) = self.search(left, &self.illuminations, array!(|i| half + away * Lane::splat(PHI_STARTS[i])));
        let mut coordinates = [Lane::splat(0.0); MAX_SHAPE];
        coordinates[0] = shape;
        Point { normal: normalise(left.normal(phi)), coordinates }
    }

    #[inline(always)]
    fn quadratic(&self, left: &Left<ISA>, point: &Tilts<ISA>) -> Quadratic<ISA, 3> {
        let (sine, cosine) = sine_cosine(point.view);
        let view: [Steered<_, 3>; 3] =
            [Steered::parameter(sine, 0, cosine), Steered::splat(0.0), Steered::parameter(cosine, 0, -sine)];
        let shape = point.shape_log.exp();
        let shape = Steered::parameter(shape, 1, shape);
        let (sine, cosine) = sine_cosine(point.phi);
        let normal = rotated(left.normal, sine, cosine);
        let slope = rotated(left.normal, cosine, -sine);
        let normal = array!(|i| Steered::parameter(normal[i], 2, slope[i]));

        let mut quadratic = Quadratic::zero();
        quadratic.cost = left.constant;
        let half_view = sine_cosine(point.view * Lane::splat(0.5));
        for (remainder, light) in left.remainders.iter().zip(&self.arm) {
            let at = light.seen_from(view, half_view, self.optics.index);
            let lobe = M::basis(normal, &[shape], &at, &self.optics).specular[0];
            let residual = remainder.value - self.specular * lobe.value;
            quadratic.cost = (remainder.weight * residual).mul_add(residual, quadratic.cost);
            for p in 0..3 {
                let weighted = remainder.weight * lobe.derivative[p];
                quadratic.descent[p] = weighted.mul_add(residual, quadratic.descent[p]);
                for q in p..3 {
                    quadratic.hessian[p][q] = weighted.mul_add(lobe.derivative[q], quadratic.hessian[p][q]);
                }
            }
        }
        // The residual's slopes are As times the lobe's.
        for p in 0..3 {
            quadratic.descent[p] = self.specular * quadratic.descent[p];
            for q in p..3 {
                quadratic.hessian[p][q] = self.specular * self.specular * quadratic.hessian[p][q];
            }
        }
        quadratic
    }

    #[inline(always)]
    fn shape_bounds() -> (Lane<ISA>, Lane<ISA>) {
        (Lane::splat(M::SHAPE[0].lower.ln()), Lane::splat(M::SHAPE[0].upper.ln()))
    }

    #[inline(always)]
    pub fn at_bound(&self, point: &Tilts<ISA>) -> LaneMask {
        let (lower, upper) = Self::shape_bounds();
        let range = Lane::splat(VIEW_RANGE * 0.999);
        !point.shape_log.gt(lower)
            | !point.shape_log.lt(upper)
            | !(point.view - self.view.0).abs().lt(range)
            | !point.phi.lt(Lane::splat(PHI_MAX * 0.999))
    }
}

/// Sine and cosine of small angles, by their series to the 9th and 8th power: 1e-7 up to 0.8.
#[inline(always)]
fn sine_cosine<R: Real>(angle: R) -> (R, R) {
    let square = angle * angle;
    let (mut sine, mut cosine) = (R::splat(1.0), R::splat(1.0));
    for (odd, even) in [(72.0, 56.0), (42.0, 30.0), (20.0, 12.0), (6.0, 2.0)] {
        sine = R::splat(1.0) - square * sine * R::splat(1.0 / odd);
        cosine = R::splat(1.0) - square * cosine * R::splat(1.0 / even);
    }
    (angle * sine, cosine)
}

/// A group of pixels whose shapes are to be fitted, and what came of it.
pub struct Waiting<const ISA: Isa> {
    pub left: Left<ISA>,
    pub wanted: LaneMask,
    /// Where the fits begin, then where they ended.
    pub point: Tilts<ISA>,
    pub cost: Lane<ISA>,
    pub converged: LaneMask,
}

impl<const ISA: Isa> Waiting<ISA> {
    pub fn new(lights: usize) -> Self {
        let zero = Lane::splat(0.0);
        Waiting {
            left: Left::new(lights),
            wanted: LaneMask::NONE,
            point: Tilts { view: zero, shape_log: zero, phi: zero },
            cost: zero,
            converged: LaneMask::NONE,
        }
    }
}

/// The pixels of several groups, fitted side by side, each lane with the next when it has done with one.
pub struct ShapeQueue<'a, M, const ISA: Isa> {
    fit: &'a ShapeFit<M, ISA>,
    waiting: &'a mut [Waiting<ISA>],
    /// The next pixel, counted over the groups.
    next: usize,
    /// The pixels that the lanes are at.
    pixels: [usize; LANES],
    lanes: &'a mut Left<ISA>,
}

impl<'a, M: Model, const ISA: Isa> ShapeQueue<'a, M, ISA> {
    /// Fits the wanted pixels of all groups; `lanes` is a buffer.
    #[inline(always)]
    pub fn run(fit: &'a ShapeFit<M, ISA>, waiting: &'a mut [Waiting<ISA>], lanes: &'a mut Left<ISA>, max_steps: usize) {
        let anywhere = waiting[0].point;
        let mut queue = ShapeQueue { fit, waiting, next: 0, pixels: [0; LANES], lanes };
        minimise_all(&mut queue, &anywhere, max_steps);
    }
}

impl<M: Model, const ISA: Isa> Queue<ISA, 3> for ShapeQueue<'_, M, ISA> {
    #[inline(always)]
    fn next(&mut self, lane: usize, point: &mut Tilts<ISA>) -> bool {
        while let Some(group) = self.waiting.get(self.next / LANES) {
            let pixel = self.next % LANES;
            self.next += 1;
            if group.wanted.holds(pixel) {
                self.lanes.copy_lane(lane, &group.left, pixel);
                point.copy_lane(lane, &group.point, pixel);
                self.pixels[lane] = self.next - 1;
                return true;
            }
        }
        false
    }

    #[inline(always)]
    fn finish(&mut self, lane: usize, outcome: &Outcome<Tilts<ISA>, ISA>) {
        let group = &mut self.waiting[self.pixels[lane] / LANES];
        let pixel = self.pixels[lane] % LANES;
        group.point.copy_lane(pixel, &outcome.point, lane);
        group.cost.0[pixel] = outcome.cost.0[lane];
        group.converged.set(pixel, outcome.converged.holds(lane));
    }
}

impl<M: Model, const ISA: Isa> Objective<ISA, 3> for ShapeQueue<'_, M, ISA> {
    type Point = Tilts<ISA>;

    #[inline(always)]
    fn quadratic(&mut self, point: &Tilts<ISA>) -> Quadratic<ISA, 3> {
        outlined::<ISA, _>(
            #[inline(always)]
            || self.fit.quadratic(self.lanes, point),
        )
    }

    #[inline(always)]
    fn moved(&self, point: &Tilts<ISA>, step: &[Lane<ISA>; 3]) -> Tilts<ISA> {
        let (lower, upper) = ShapeFit::<M, ISA>::shape_bounds();
        let (turn, stretch) = (Lane::splat(0.1), Lane::splat(1.2));
        let range = Lane::splat(VIEW_RANGE);
        let view = point.view + step[0].min(turn).max(-turn);
        let shape_log = point.shape_log + step[1].min(stretch).max(-stretch);
        let phi = point.phi + step[2].min(turn).max(-turn);
        Tilts {
            view: view.max(self.fit.view.0 - range).min(self.fit.view.0 + range),
            shape_log: shape_log.max(lower).min(upper),
            phi: phi.max(Lane::splat(0.0)).min(Lane::splat(PHI_MAX)),
        }
    }

    #[inline(always)]
    fn blocked(&self, point: &Tilts<ISA>, descent: &[Lane<ISA>; 3]) -> [LaneMask; 3] {
        let zero = Lane::splat(0.0);
        let (lower, upper) = ShapeFit::<M, ISA>::shape_bounds();
        let range = Lane::splat(VIEW_RANGE);
        let bounds = [
            (point.view, self.fit.view.0 - range, self.fit.view.0 + range),
            (point.shape_log, lower, upper),
            (point.phi, zero, Lane::splat(PHI_MAX)),
        ];
        array!(|i| (!bounds[i].0.gt(bounds[i].1) & descent[i].lt(zero))
            | (!bounds[i].0.lt(bounds[i].2) & descent[i].gt(zero)))
    }

    #[inline(always)]
    fn select(mask: LaneMask, yes: &Tilts<ISA>, no: &Tilts<ISA>) -> Tilts<ISA> {
        Tilts {
            view: Lane::select(mask, yes.view, no.view),
            shape_log: Lane::select(mask, yes.shape_log, no.shape_log),
            phi: Lane::select(mask, yes.phi, no.phi),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::PLAIN;

    #[test]
    fn in_the_arms_plane_half_vector_and_reflectance_are_those_of_the_general_form() {
        for (light_tilt, view_tilt) in [(-1.4f32, 0.1f32), (-0.3, -0.2), (0.25, 0.25), (0.9, 0.0), (1.5, -0.35)] {
            let lane = |value: f32| Lane::<PLAIN>([value; LANES]);
            let light = [lane(light_tilt.sin()), lane(0.0), lane(light_tilt.cos())];
            let (sine, cosine) = (lane(view_tilt.sin()), lane(view_tilt.cos()));
            let view: [Steered<_, 3>; 3] =
                [Steered::parameter(sine, 0, cosine), Steered::splat(0.0), Steered::parameter(cosine, 0, -sine)];
            let general = Illumination::new(array!(|i| Steered::given(light[i])), view, 1.5);
            let half_view = (lane((view_tilt / 2.0).sin()), lane((view_tilt / 2.0).cos()));
            let got = ArmLight::new(light).seen_from(view, half_view, 1.5);
            let numbers = |at: &Illumination<Steered<Lane<PLAIN>, 3>>| {
                [at.half[0], at.half[1], at.half[2], at.per_light_half, at.facet_reflectance]
            };
            for (got, want) in numbers(&got).iter().zip(numbers(&general)) {
                let pairs = [(got.value, want.value), (got.derivative[0], want.derivative[0])];
                for (got, want) in pairs.map(|(got, want)| (got.0[0], want.0[0])) {
                    assert!((got - want).abs() < 3e-6 * want.abs().max(1.0), "{got}, want {want}");
                }
            }
        }
    }
}
