//! The reflectance of a pixel as a separable least-squares problem.
//!
//! Radiance is linear in the magnitudes and nonlinear only in the normal and the shape. Variable projection [Golub1973]
//! with Kaufman's simplification of the Jacobian [Kaufman1975] eliminates the magnitudes at every step: what remains has two
//! parameters for the normal and one for each shape parameter.

use crate::arrow::{Arrow, Factored, Magnitudes};
use crate::dual::Dual;
use crate::geometry::{Illumination, normalise, tangents};
use crate::lanes::{Isa, Lane, LaneMask, outlined};
use crate::minimise::{Objective, Quadratic};
use crate::models::{Basis, MAX_SHAPE, Model, Optics};
use crate::number::{Mask, Number, Real, array};
use crate::observations::{Group, Observation};
use crate::robust::{Loss, Robust};
use std::marker::PhantomData;

/// Normals may tilt up to 84° from the painting's normal: beyond that no camera in front sees the element.
pub const NORMAL_Z_MIN: f64 = 0.1;
/// A step turns the normal by at most this angle in radians …
const TURN_MAX: f64 = 0.5;
/// … and changes a coordinate of the shape by at most this.
const SHAPE_STEP_MAX: f64 = 1.2;
/// Standard deviation of a highlight's colour from white: gold reflects 0.4 times as much blue as red.
const COLOUR_SD: f64 = 1.0;

/// Normal and coordinates of the shape.
#[derive(Clone, Copy)]
pub struct Point<const ISA: Isa> {
    pub normal: [Lane<ISA>; 3],
    pub coordinates: [Lane<ISA>; MAX_SHAPE],
}

/// Independent normal priors: mean and inverse variance of each coordinate of the shape, and of each lobe's magnitude over
/// `Model::specular_scale`. Each counts as one observation among the pixel's, at whatever level the residuals are.
#[derive(Clone, Copy)]
pub struct Prior<const ISA: Isa, const L: usize> {
    pub shape: [(Lane<ISA>, Lane<ISA>); MAX_SHAPE],
    pub magnitude: [(Lane<ISA>, Lane<ISA>); L],
}

impl<const ISA: Isa, const L: usize> Prior<ISA, L> {
    /// The weak ones that hold for any material.
    #[inline(always)]
    pub fn of_model<M: Model<L>>() -> Self {
        let (zero, one) = (Lane::splat(0.0), Lane::splat(1.0));
        let mut prior = Prior { shape: [(zero, zero); MAX_SHAPE], magnitude: [(zero, one); L] };
        for i in 0..M::SHAPE.len() {
            let (mean, deviation) = M::coordinate(i).prior;
            prior.shape[i] = (Lane::splat(mean), Lane::splat(1.0 / (deviation * deviation)));
        }
        prior
    }
}

/// P is 2 + the number of shape parameters.
pub struct Separable<'a, M, const ISA: Isa, const C: usize, const P: usize, const L: usize = 1> {
    pub observations: &'a [Observation<ISA, C>],
    pub illuminations: &'a [Illumination<Lane<ISA>>],
    colour: [Lane<ISA>; C],
    optics: Optics,
    pub robust: Robust<ISA, C>,
    pub ambient: bool,
    pub channels: usize,
    /// Whether the normal keeps its place.
    pub hold_normal: bool,
    /// Specular magnitude where it is known beforehand, as one value for a whole sample.
    pub fixed_specular: Option<[Lane<ISA>; L]>,
    /// Stands in for highlights that no light has shown.
    pub prior: Option<Prior<ISA, L>>,
    /// 1 / degrees of freedom.
    pub per_freedom: Lane<ISA>,
    /// χ² per degree of freedom at the accepted point and at the one looked at last: the scale of the noise.
    noise_scale: Lane<ISA>,
    trial_noise_scale: Lane<ISA>,
    /// The magnitudes at these points.
    magnitudes: Magnitudes<ISA, C, L>,
    trial_magnitudes: Magnitudes<ISA, C, L>,
    basis: Vec<Basis<Dual<Lane<ISA>, P>, L>>,
    model: PhantomData<M>,
}

/// Buffers with one entry per light, handed from group to group.
pub struct Scratch<const ISA: Isa, const C: usize, const P: usize, const L: usize = 1> {
    robust: Vec<[Lane<ISA>; C]>,
    basis: Vec<Basis<Dual<Lane<ISA>, P>, L>>,
}

impl<const ISA: Isa, const C: usize, const P: usize, const L: usize> Scratch<ISA, C, P, L> {
    pub fn new(lights: usize) -> Self {
        let zero = Dual::constant(Lane::splat(0.0));
        Scratch {
            robust: vec![[Lane::splat(1.0); C]; lights],
            basis: vec![Basis { diffuse: zero, specular: [zero; L] }; lights],
        }
    }
}

/// A point's magnitudes and everything that uncertainties are made from.
pub struct Solution<const ISA: Isa, const C: usize, const P: usize, const L: usize = 1> {
    pub quadratic: Quadratic<ISA, P>,
    pub magnitudes: Magnitudes<ISA, C, L>,
    pub factored: Factored<ISA, C, L>,
    /// For each nonlinear parameter, how the magnitudes follow it: −∂(magnitudes)/∂(parameter).
    pub following: [Magnitudes<ISA, C, L>; P],
}

/// sᵀ Σ s: the variance of a quantity with slopes s along parameters of covariance Σ.
#[inline(always)]
pub fn propagated<const ISA: Isa, const P: usize>(
    slopes: [Lane<ISA>; P],
    covariance: &[[Lane<ISA>; P]; P],
) -> Lane<ISA> {
    let mut sum = Lane::splat(0.0);
    for p in 0..P {
        for q in 0..P {
            sum = (slopes[p] * covariance[p][q]).mul_add(slopes[q], sum);
        }
    }
    sum
}

impl<const ISA: Isa, const C: usize, const P: usize, const L: usize> Solution<ISA, C, P, L> {
    /// Marginal variances of the magnitudes, from the covariance of the nonlinear parameters: those of the linear problem
    /// at a known normal and shape, plus what follows from not knowing these.
    #[inline(always)]
    pub fn magnitude_variances(&self, lobes: usize, covariance: &[[Lane<ISA>; P]; P]) -> Magnitudes<ISA, C, L> {
        let one = Lane::splat(1.0);
        let mut variances = Magnitudes::zero();
        for k in 0..C {
            let mut unit = Magnitudes::zero();
            unit.diffuse[k] = one;
            variances.diffuse[k] = self.factored.solve(&unit).diffuse[k]
                + propagated(array!(|p| self.following[p].diffuse[k]), covariance);
            if self.factored.ambient {
                let mut unit = Magnitudes::zero();
                unit.ambient[k] = one;
                variances.ambient[k] = self.factored.solve(&unit).ambient[k]
                    + propagated(array!(|p| self.following[p].ambient[k]), covariance);
            }
        }
        for j in 0..lobes {
            let mut unit = Magnitudes::zero();
            unit.specular[j] = one;
            variances.specular[j] = self.factored.solve(&unit).specular[j]
                + propagated(array!(|p| self.following[p].specular[j]), covariance);
        }
        variances
    }
}

impl<'a, M: Model<L>, const ISA: Isa, const C: usize, const P: usize, const L: usize> Separable<'a, M, ISA, C, P, L> {
    /// The problem of one group, with buffers that `give_back` returns.
    #[inline(always)]
    pub fn new(
        group: &'a Group<ISA, C>,
        colour: [Lane<ISA>; C],
        optics: Optics,
        loss: Loss,
        ambient: bool,
        scratch: &mut Scratch<ISA, C, P, L>,
    ) -> Self {
        let unknowns = P + M::LOBES + group.channels * (1 + usize::from(ambient));
        let freedom = group.usable_samples - Lane::splat(unknowns as f64);
        Separable {
            observations: &group.observations,
            illuminations: &group.illuminations,
            colour,
            optics,
            robust: Robust::new(loss, std::mem::take(&mut scratch.robust)),
            ambient,
            channels: group.channels,
            fixed_specular: None,
            hold_normal: false,
            prior: Some(Prior::of_model::<M>()),
            noise_scale: Lane::splat(1.0),
            trial_noise_scale: Lane::splat(1.0),
            magnitudes: Magnitudes::zero(),
            trial_magnitudes: Magnitudes::zero(),
            per_freedom: Lane::splat(1.0) / freedom.max(Lane::splat(1.0)),
            basis: std::mem::take(&mut scratch.basis),
            model: PhantomData,
        }
    }

    /// The magnitudes at the point that the minimisation has settled on.
    #[inline(always)]
    pub fn magnitudes(&self) -> Magnitudes<ISA, C, L> {
        self.magnitudes
    }

    /// Returns the buffers for the next group.
    #[inline(always)]
    pub fn give_back(self, scratch: &mut Scratch<ISA, C, P, L>) {
        (scratch.robust, scratch.basis) = (self.robust.into_factors(), self.basis);
    }

    #[inline(always)]
    fn free_lobes(&self) -> usize {
        if self.fixed_specular.is_some() { 0 } else { M::LOBES }
    }

    #[inline(always)]
    fn weight(&self, light: usize) -> [Lane<ISA>; C] {
        self.robust.weight(light, &self.observations[light].weight)
    }

    /// The basis functions at a point, with their derivatives by (tangent, tangent, coordinates of the shape).
    #[inline(always)]
    fn evaluate_basis(&mut self, point: &Point<ISA>) {
        let (mut first, mut second) = tangents(point.normal);
        if self.hold_normal {
            (first, second) = ([Lane::splat(0.0); 3], [Lane::splat(0.0); 3]);
        }
        let normal = array!(|i| {
            let mut component = Dual::constant(point.normal[i]);
            component.derivative[0] = first[i];
            component.derivative[1] = second[i];
            component
        });
        let shape = self.shape(point);
        for (basis, at) in self.basis.iter_mut().zip(self.illuminations) {
            *basis = M::basis(normal, &shape[..P - 2], at, &self.optics);
        }
    }

    #[inline(always)]
    fn lobe_sum(&self, magnitudes: &Magnitudes<ISA, C, L>, light: usize) -> Dual<Lane<ISA>, P> {
        let mut sum = Dual::constant(Lane::splat(0.0));
        for j in 0..M::LOBES {
            sum = self.basis[light].specular[j].scale_add(magnitudes.specular[j], sum);
        }
        sum
    }

    /// Solves for the magnitudes at a point, then takes the cost and its derivatives there.
    #[inline(always)]
    pub fn solve(&mut self, point: &Point<ISA>) -> Solution<ISA, C, P, L> {
        outlined::<ISA, _>(
            #[inline(always)]
            || self.solve_inline(point),
        )
    }

    #[inline(always)]
    fn solve_inline(&mut self, point: &Point<ISA>) -> Solution<ISA, C, P, L> {
        self.evaluate_basis(point);
        let zero = Lane::splat(0.0);
        let lobes = self.free_lobes();

        let mut arrow = Arrow::new(self.ambient);
        for (light, observation) in self.observations.iter().enumerate() {
            let basis = &self.basis[light];
            let mut radiance = observation.radiance;
            if let Some(fixed) = self.fixed_specular {
                for j in 0..M::LOBES {
                    for k in 0..C {
                        radiance[k] = radiance[k] - self.colour[k] * fixed[j] * basis.specular[j].value;
                    }
                }
            }
            let specular = array!(|j| basis.specular[j].value);
            arrow.add(lobes, basis.diffuse.value, &specular, &radiance, &self.weight(light), &self.colour);
        }
        let specular_scale = M::specular_scale(&self.shape(point)[..P - 2]);
        let mut ridge = [zero; L];
        if let Some(prior) = &self.prior {
            for j in 0..lobes {
                let (mean, weight) = prior.magnitude[j];
                let scale = specular_scale[j].value;
                ridge[j] = self.noise_scale * weight / scale.squared();
                arrow.add_ridge(j, ridge[j], mean * scale);
            }
        }
        let (mut magnitudes, factored) = arrow.magnitudes(lobes);
        if let Some(fixed) = self.fixed_specular {
            magnitudes.specular = fixed;
        }

        let mut quadratic = Quadratic::zero();
        // JᵀWΦ, one vector of the magnitudes' shape for each nonlinear parameter.
        let mut projection = [Magnitudes::zero(); P];
        for (light, observation) in self.observations.iter().enumerate() {
            let basis = &self.basis[light];
            let weight = self.weight(light);
            let sum = self.lobe_sum(&magnitudes, light);
            let mut lobe_projection = [zero; P];
            for k in 0..C {
                let diffuse = magnitudes.diffuse[k];
                let mut residual = observation.radiance[k];
                if self.ambient {
                    residual = residual - magnitudes.ambient[k];
                }
                residual = residual - diffuse * basis.diffuse.value;
                if M::LOBES > 0 {
                    residual = residual - self.colour[k] * sum.value;
                }
                quadratic.cost = quadratic.cost + self.robust.cost(weight[k], observation.weight[k], residual);
                let weighted_residual = weight[k] * residual;
                let mut weighted_slope = [zero; P];
                let mut slope = [zero; P];
                for p in 0..P {
                    slope[p] = diffuse * basis.diffuse.derivative[p];
                    if M::LOBES > 0 {
                        slope[p] = self.colour[k].mul_add(sum.derivative[p], slope[p]);
                    }
                    weighted_slope[p] = weight[k] * slope[p];
                    quadratic.descent[p] = slope[p].mul_add(weighted_residual, quadratic.descent[p]);
                    projection[p].diffuse[k] = weighted_slope[p].mul_add(basis.diffuse.value, projection[p].diffuse[k]);
                    if self.ambient {
                        projection[p].ambient[k] = projection[p].ambient[k] + weighted_slope[p];
                    }
                    if lobes > 0 {
                        lobe_projection[p] = self.colour[k].mul_add(weighted_slope[p], lobe_projection[p]);
                    }
                }
                for p in 0..P {
                    for q in p..P {
                        quadratic.hessian[p][q] = weighted_slope[p].mul_add(slope[q], quadratic.hessian[p][q]);
                    }
                }
            }
            for p in 0..P {
                for j in 0..lobes {
                    projection[p].specular[j] =
                        lobe_projection[p].mul_add(basis.specular[j].value, projection[p].specular[j]);
                }
            }
        }

        self.trial_noise_scale = quadratic.cost * self.per_freedom;
        self.trial_magnitudes = magnitudes;
        if let Some(prior) = &self.prior {
            // The ridge on the specular magnitudes: what they are compared with follows the shape.
            for j in 0..lobes {
                let magnitude = magnitudes.specular[j];
                let scale = &specular_scale[j];
                let residual = prior.magnitude[j].0 * scale.value - magnitude;
                let weighted_residual = ridge[j] * residual;
                quadratic.cost = weighted_residual.mul_add(residual, quadratic.cost);
                let slope: [Lane<ISA>; P] = array!(|p| -magnitude * scale.derivative[p] / scale.value);
                for p in 2..P {
                    quadratic.descent[p] = slope[p].mul_add(weighted_residual, quadratic.descent[p]);
                    for q in p..P {
                        quadratic.hessian[p][q] = (ridge[j] * slope[p]).mul_add(slope[q], quadratic.hessian[p][q]);
                    }
                    projection[p].specular[j] = ridge[j].mul_add(slope[p], projection[p].specular[j]);
                }
            }
        }

        // What the magnitudes can absorb of a step is taken out of the Hessian.
        let mut following = [Magnitudes::zero(); P];
        for p in 0..P {
            following[p] = factored.solve(&projection[p]);
        }
        for p in 0..P {
            // Rounding may leave less than nothing of a parameter that the magnitudes absorb whole.
            let floor = quadratic.hessian[p][p] * Lane::splat(1e-6);
            for q in p..P {
                quadratic.hessian[p][q] = quadratic.hessian[p][q] - projection[q].dot(&following[p]);
            }
            quadratic.hessian[p][p] = quadratic.hessian[p][p].max(floor);
        }
        if let Some(prior) = &self.prior {
            self.add_shape_prior(&prior.shape, point, &mut quadratic);
        }
        Solution { quadratic, magnitudes, factored, following }
    }

    /// The shape at a point, with its derivatives by the coordinates.
    #[inline(always)]
    pub fn shape(&self, point: &Point<ISA>) -> [Dual<Lane<ISA>, P>; MAX_SHAPE] {
        let mut coordinates = [Dual::constant(Lane::splat(0.0)); MAX_SHAPE];
        for i in 0..P - 2 {
            coordinates[i] = Dual::parameter(point.coordinates[i], 2 + i, Lane::splat(1.0));
        }
        M::shape(coordinates)
    }

    /// The prior on the shape. The model's own is weak and decides only where no highlight was seen: without it a lobe too
    /// narrow to fall on any light, of any height, is as good as none.
    ///
    /// The noise is known only roughly, so its scale is taken from the residuals: to minimise n ln χ² + p, the log posterior
    /// of n degrees of freedom under a prior −p/2, is to minimise χ² (1 + p/n) near the minimum.
    #[inline(always)]
    fn add_shape_prior(
        &self,
        prior: &[(Lane<ISA>, Lane<ISA>); MAX_SHAPE],
        point: &Point<ISA>,
        quadratic: &mut Quadratic<ISA, P>,
    ) {
        for i in 0..P - 2 {
            let (mean, weight) = prior[i];
            let weight = self.trial_noise_scale * weight;
            let distance = mean - point.coordinates[i];
            quadratic.cost = (weight * distance).mul_add(distance, quadratic.cost);
            quadratic.descent[2 + i] = weight.mul_add(distance, quadratic.descent[2 + i]);
            quadratic.hessian[2 + i][2 + i] = quadratic.hessian[2 + i][2 + i] + weight;
        }
    }

    /// The colour of the highlight over that of the light, and the diffuse and ambient magnitudes that go with it: each
    /// channel for itself, at normal, shape and specular magnitudes of the point that was solved last. A weak prior makes
    /// highlights that no light has shown white.
    #[inline(always)]
    pub fn coloured(&self, magnitudes: &Magnitudes<ISA, C, L>) -> (Magnitudes<ISA, C, L>, [Lane<ISA>; C]) {
        let one = Lane::splat(1.0);
        let mut arrows = [Arrow::<ISA, 1>::new(self.ambient); C];
        for (light, observation) in self.observations.iter().enumerate() {
            let highlight = self.lobe_sum(magnitudes, light).value;
            let (diffuse, weight) = (self.basis[light].diffuse.value, self.weight(light));
            for k in 0..C {
                let (radiance, weight, colour) = ([observation.radiance[k]], [weight[k]], [self.colour[k]]);
                arrows[k].add(1, diffuse, &[highlight], &radiance, &weight, &colour);
            }
        }
        let mut seen = LaneMask::NONE;
        for j in 0..M::LOBES {
            seen = seen | magnitudes.specular[j].positive();
        }
        let prior = self.noise_scale * Lane::splat(1.0 / (COLOUR_SD * COLOUR_SD));
        let (mut coloured, mut colour) = (*magnitudes, [one; C]);
        for (k, arrow) in arrows.iter_mut().enumerate().take(self.channels) {
            arrow.add_ridge(0, prior, one);
            let found = arrow.magnitudes(1).0;
            coloured.diffuse[k] = Lane::select(seen, found.diffuse[0], magnitudes.diffuse[k]);
            coloured.ambient[k] = Lane::select(seen, found.ambient[0], magnitudes.ambient[k]);
            colour[k] = Lane::select(seen, found.specular[0], one);
        }
        (coloured, colour)
    }

    /// The radiance that the model gives at a light, per unit of irradiance, with highlights of a colour.
    #[inline(always)]
    pub fn predicted(
        &self,
        magnitudes: &Magnitudes<ISA, C, L>,
        colour: &[Lane<ISA>; C],
        light: usize,
    ) -> [Lane<ISA>; C] {
        let sum = self.lobe_sum(magnitudes, light).value;
        array!(|k| {
            let diffuse = magnitudes.diffuse[k].mul_add(self.basis[light].diffuse.value, magnitudes.ambient[k]);
            (self.colour[k] * colour[k]).mul_add(sum, diffuse)
        })
    }

    /// The diffuse light of a magnitude under each light, at the point that was looked at last.
    #[inline(always)]
    pub fn diffuse_light(&self, magnitude: Lane<ISA>, into: &mut Vec<Lane<ISA>>) {
        into.clear();
        for basis in &self.basis {
            into.push(magnitude * basis.diffuse.value);
        }
    }

    /// The radiance that the model leaves over at a light.
    #[inline(always)]
    fn residual(&self, magnitudes: &Magnitudes<ISA, C, L>, light: usize) -> [Lane<ISA>; C] {
        let predicted = self.predicted(magnitudes, &[Lane::splat(1.0); C], light);
        array!(|k| self.observations[light].radiance[k] - predicted[k])
    }

    /// Sets the scale of the loss to the residuals' own at a point, by the samples that are trusted there, or back to 1.
    #[inline(always)]
    pub fn scale_loss(&mut self, point: Option<&Point<ISA>>) {
        self.robust.set_scale(Lane::splat(1.0));
        let Some(point) = point else { return };
        let magnitudes = self.solve(point).magnitudes;
        let (mut squares, mut trusted) = (Lane::splat(0.0), Lane::splat(1e-20));
        for (light, observation) in self.observations.iter().enumerate() {
            let sums = self.robust.trusted(light, &observation.weight, &self.residual(&magnitudes, light));
            (squares, trusted) = (squares + sums.0, trusted + sums.1);
        }
        self.robust.set_scale((squares / trusted).sqrt());
    }

    #[inline(always)]
    fn bounds(index: usize) -> (Lane<ISA>, Lane<ISA>) {
        let coordinate = M::coordinate(index);
        (Lane::splat(coordinate.lower), Lane::splat(coordinate.upper))
    }

    /// Lanes with a parameter or a magnitude at its bound.
    #[inline(always)]
    pub fn at_bound(&self, point: &Point<ISA>, magnitudes: &Magnitudes<ISA, C, L>) -> LaneMask {
        let zero = Lane::splat(0.0);
        let mut bound = !point.normal[2].gt(Lane::splat(NORMAL_Z_MIN * 1.001));
        for i in 0..P - 2 {
            let (lower, upper) = Self::bounds(i);
            bound = bound | !point.coordinates[i].gt(lower) | !point.coordinates[i].lt(upper);
        }
        for k in 0..self.channels {
            bound = bound | !magnitudes.diffuse[k].gt(zero);
        }
        for j in 0..M::LOBES {
            bound = bound | !magnitudes.specular[j].gt(zero);
        }
        bound
    }
}

impl<M: Model<L>, const ISA: Isa, const C: usize, const P: usize, const L: usize> Objective<ISA, P>
    for Separable<'_, M, ISA, C, P, L>
{
    type Point = Point<ISA>;

    #[inline(always)]
    fn quadratic(&mut self, point: &Point<ISA>) -> Quadratic<ISA, P> {
        self.solve(point).quadratic
    }

    #[inline(always)]
    fn moved(&self, point: &Point<ISA>, step: &[Lane<ISA>; P]) -> Point<ISA> {
        let length = (step[0] * step[0] + step[1] * step[1]).sqrt().max(Lane::splat(1e-20));
        let shorten = (Lane::splat(TURN_MAX) / length).min(Lane::splat(1.0));
        let (first, second) = tangents(point.normal);
        let mut turned: [Lane<ISA>; 3] =
            array!(|i| point.normal[i] + shorten * (step[0] * first[i] + step[1] * second[i]));
        turned[2] = turned[2].max(Lane::splat(NORMAL_Z_MIN));
        let mut coordinates = point.coordinates;
        for i in 0..P - 2 {
            let (lower, upper) = Self::bounds(i);
            let limit = Lane::splat(SHAPE_STEP_MAX);
            let change = step[2 + i].min(limit).max(-limit);
            coordinates[i] = (coordinates[i] + change).max(lower).min(upper);
        }
        Point { normal: normalise(turned), coordinates }
    }

    #[inline(always)]
    fn blocked(&self, point: &Point<ISA>, descent: &[Lane<ISA>; P]) -> [LaneMask; P] {
        let zero = Lane::splat(0.0);
        let mut blocked = [LaneMask::NONE; P];
        for i in 0..P - 2 {
            let (lower, upper) = Self::bounds(i);
            let low = !point.coordinates[i].gt(lower) & descent[2 + i].lt(zero);
            let high = !point.coordinates[i].lt(upper) & descent[2 + i].gt(zero);
            blocked[2 + i] = low | high;
        }
        blocked
    }

    /// Of the two tilts of the normal, none by less than a thousandth of the other's. A normal near the plane that the lights
    /// are symmetric to has no slope across it: damped by its own element alone, every step would go far that way, and fail.
    #[inline(always)]
    fn damping_scale(&self, at: &Quadratic<ISA, P>) -> [Lane<ISA>; P] {
        let least = (at.hessian[0][0] + at.hessian[1][1]) * Lane::splat(1e-3);
        array!(|i| if i < 2 { at.hessian[i][i].max(least) } else { at.hessian[i][i] })
    }

    #[inline(always)]
    fn select(mask: LaneMask, yes: &Point<ISA>, no: &Point<ISA>) -> Point<ISA> {
        Point {
            normal: array!(|i| Lane::select(mask, yes.normal[i], no.normal[i])),
            coordinates: array!(|i| Lane::select(mask, yes.coordinates[i], no.coordinates[i])),
        }
    }

    #[inline(always)]
    fn accepted(&mut self, _point: &Point<ISA>, mask: LaneMask) {
        self.noise_scale = Lane::select(mask, self.trial_noise_scale, self.noise_scale);
        self.magnitudes = Magnitudes::select(mask, &self.trial_magnitudes, &self.magnitudes);
        if !self.robust.is_linear() && mask.any() {
            for (light, observation) in self.observations.iter().enumerate() {
                let residual = self.residual(&self.magnitudes, light);
                self.robust.reweight(light, &observation.weight, &residual, mask);
            }
        }
    }
}
