//! The joint fit: normal, shape and magnitudes of a pixel over all its lights at once.

use crate::lanes::{Isa, Lane};
use crate::minimise::{Objective, inverse, minimise};
use crate::models::{MAX_LOBES, MAX_SHAPE, Model, Optics};
use crate::number::{Mask, Number, Real, array};
use crate::observations::{Group, Stack};
use crate::record::{FitGroup, Layout, Row, Status};
use crate::separable::{Loss, Point, Scratch, Separable, Solution};
use crate::start::{Grey, candidates, doubt_shadows, grey, start, start_at};
use std::marker::PhantomData;

/// Rounds of a robust fit with a wider loss before the one with the loss asked for.
const ROBUST_STAGES: usize = 2;

#[derive(Clone, Copy, Debug)]
pub struct Options {
    pub optics: Optics,
    pub loss: Loss,
    pub max_steps: usize,
    pub ambient: bool,
    /// The normal of every pixel, where the surface is known; it is then not fitted, and nothing else is assumed of the
    /// material either: the weak priors are off.
    pub normal: Option<[f64; 3]>,
}

/// The fit of groups of pixels, with its buffers.
pub struct JointFit<'a, M, const ISA: Isa, const C: usize, const P: usize> {
    stack: &'a Stack<'a>,
    options: Options,
    colour: [Lane<ISA>; C],
    group: Group<ISA, C>,
    grey: Vec<Grey<ISA>>,
    /// Share of each light's weight that its samples keep at the start of a robust fit.
    kept: Vec<Lane<ISA>>,
    scratch: Scratch<ISA, C, P>,
    model: PhantomData<M>,
}

impl<'a, M: Model, const ISA: Isa, const C: usize, const P: usize> JointFit<'a, M, ISA, C, P> {
    pub fn layout(channels: usize, ambient: bool) -> Layout {
        Layout::joint(channels, M::LOBES, P - 2, if ambient { channels } else { 0 })
    }

    /// Unknowns that each channel's samples must determine.
    fn unknowns(&self) -> usize {
        P + 1 + M::LOBES + usize::from(self.options.ambient)
    }

    pub fn new(stack: &'a Stack<'a>, colour: &[f64], options: Options) -> Self {
        const { assert!(P == 2 + M::SHAPE.len()) };
        JointFit {
            stack,
            options,
            colour: array!(|k| Lane::splat(colour.get(k).copied().unwrap_or(0.0))),
            group: Group::new(stack, options.optics.index),
            grey: Vec::with_capacity(stack.lights.len()),
            kept: Vec::with_capacity(stack.lights.len()),
            scratch: Scratch::new(stack.lights.len()),
            model: PhantomData,
        }
    }
}

impl<M: Model, const ISA: Isa, const C: usize, const P: usize> FitGroup for JointFit<'_, M, ISA, C, P> {
    fn layout(&self) -> Layout {
        Self::layout(self.stack.channels, self.options.ambient)
    }

    #[inline(always)]
    fn fit_group(&mut self, first: usize, rows: &mut [f32], status: &mut [u8]) {
        self.group.gather(self.stack, first);
        grey(&self.group, &mut self.grey);
        let wanted = !self.group.usable_lights.lt(Lane::splat(self.unknowns() as f64));
        let illuminations = &self.group.illuminations;
        let (optics, ambient) = (self.options.optics, self.options.ambient);
        let robust = self.options.loss != Loss::Linear;
        if robust {
            doubt_shadows(&mut self.grey, illuminations, &mut self.kept);
        }
        let known: Option<[Lane<ISA>; 3]> = self.options.normal.map(|normal| array!(|i| Lane::splat(normal[i])));
        let mut begin = match known {
            Some(normal) => start_at::<M, ISA>(normal, &self.grey, illuminations, &optics, ambient),
            None => {
                start::<M, ISA>(&candidates(&self.grey, illuminations), &self.grey, illuminations, &optics, ambient)
            }
        };

        let mut problem = Separable::<M, ISA, C, P>::new(
            &self.group,
            self.colour,
            optics,
            self.options.loss,
            ambient,
            &mut self.scratch,
        );
        problem.hold_normal = known.is_some();
        problem.prior = known.is_none();
        if robust {
            problem.trust(&self.kept);
            // Far from the minimum every sample is an outlier: the loss first takes the residuals for noise.
            for _ in 0..ROBUST_STAGES {
                problem.scale_loss(Some(&begin));
                begin = minimise(&mut problem, &begin, wanted, self.options.max_steps).point;
            }
            problem.scale_loss(None);
        }
        let mut outcome = minimise(&mut problem, &begin, wanted, self.options.max_steps);
        let mut solution = problem.solve(&outcome.point);
        // A lobe of magnitude 0 gives its shape no gradient, so a fit that comes there cannot leave. From the normal that it
        // found the grid of shapes may show a better lobe.
        let trapped = wanted & !solution.magnitudes.specular[0].positive();
        if M::LOBES > 0 && known.is_none() && trapped.any() {
            let again = start::<M, ISA>(&[outcome.point.normal], &self.grey, illuminations, &optics, ambient);
            let retried = minimise(&mut problem, &again, trapped, self.options.max_steps);
            let better = retried.cost.lt(solution.quadratic.cost) & trapped;
            outcome.point = Separable::<M, ISA, C, P>::select(better, &retried.point, &outcome.point);
            outcome.converged = (outcome.converged & !better) | (retried.converged & better);
            solution = problem.solve(&outcome.point);
        }
        let summary = summarise(&problem, &solution, &self.group.irradiance);
        let at_bound = problem.at_bound(&outcome.point, &solution.magnitudes);
        let deviations = Deviations::new::<P>(M::LOBES, &solution, summary.chi2_reduced);
        problem.give_back(&mut self.scratch);

        let channels = self.stack.channels;
        let ambients = if ambient { channels } else { 0 };
        let width = FitGroup::layout(self).width();
        for (lane, status) in status.iter_mut().enumerate() {
            *status = if !wanted.holds(lane) {
                if self.group.clipped.0[lane] > 0.0 && self.group.usable_lights.0[lane] == 0.0 {
                    Status::AllClipped
                } else {
                    Status::TooFewLights
                }
            } else if !outcome.converged.holds(lane) {
                Status::StepLimit
            } else if at_bound.holds(lane) {
                Status::AtBound
            } else {
                Status::Converged
            } as u8;
            let row = &mut rows[lane * width..(lane + 1) * width];
            if !wanted.holds(lane) {
                row.fill(f32::NAN);
                continue;
            }
            write_row::<ISA, C, P>(
                Row::new(row),
                [channels, M::LOBES, P - 2, ambients],
                lane,
                &outcome.point,
                &solution,
                &summary,
                &deviations,
            );
        }
    }
}

struct Summary<const ISA: Isa> {
    chi2_reduced: Lane<ISA>,
    /// Root mean square over the usable samples, in relative radiance as measured.
    residual_rms: Lane<ISA>,
}

#[inline(always)]
fn summarise<M: Model, const ISA: Isa, const C: usize, const P: usize>(
    problem: &Separable<'_, M, ISA, C, P>,
    solution: &Solution<ISA, C, P>,
    irradiance: &[[Lane<ISA>; C]],
) -> Summary<ISA> {
    let (zero, one) = (Lane::splat(0.0), Lane::splat(1.0));
    let mut samples = zero;
    let mut chi2 = zero;
    let mut squares = zero;
    for (light, observation) in problem.observations.iter().enumerate() {
        let predicted = problem.predicted(&solution.magnitudes, light);
        for k in 0..C {
            let residual = observation.radiance[k] - predicted[k];
            let measured = residual * irradiance[light][k];
            let usable = observation.weight[k].positive();
            samples = samples + Lane::select(usable, one, zero);
            squares = squares + Lane::select(usable, measured * measured, zero);
            chi2 = chi2 + observation.weight[k] * residual * residual;
        }
    }
    let unknowns = P + M::LOBES + problem.channels * (1 + usize::from(problem.ambient));
    let freedom = (samples - Lane::splat(unknowns as f64)).max(one);
    Summary { chi2_reduced: chi2 / freedom, residual_rms: (squares / samples.max(one)).sqrt() }
}

/// Standard deviations from the Fisher information at the solution. Where the residuals exceed the noise model they are
/// raised by √χ²_reduced [Birge1932], for what the model does not describe is then the larger error.
struct Deviations<const ISA: Isa, const C: usize> {
    /// Root mean square angle between the fitted and the true normal, radians.
    normal: Lane<ISA>,
    /// Relative, for the parameters are fitted in their logarithm.
    shape_relative: [Lane<ISA>; MAX_SHAPE],
    diffuse: [Lane<ISA>; C],
    ambient: [Lane<ISA>; C],
    specular: [Lane<ISA>; MAX_LOBES],
}

#[inline(always)]
fn deviation<const ISA: Isa>(variance: Lane<ISA>, birge: Lane<ISA>) -> Lane<ISA> {
    (variance * birge).max(Lane::splat(0.0)).sqrt()
}

impl<const ISA: Isa, const C: usize> Deviations<ISA, C> {
    #[inline(always)]
    fn new<const P: usize>(lobes: usize, solution: &Solution<ISA, C, P>, chi2_reduced: Lane<ISA>) -> Self {
        let zero = Lane::splat(0.0);
        let birge = chi2_reduced.max(Lane::splat(1.0));
        let mut hessian = solution.quadratic.hessian;
        for p in 0..P {
            for q in 0..p {
                hessian[p][q] = hessian[q][p];
            }
        }
        let covariance = inverse(&hessian);
        let mut result = Deviations {
            normal: deviation(covariance[0][0] + covariance[1][1], birge),
            shape_relative: [zero; MAX_SHAPE],
            diffuse: [zero; C],
            ambient: [zero; C],
            specular: [zero; MAX_LOBES],
        };
        for i in 0..P - 2 {
            // A parameter that nothing depends on has an entry of 0 and is known not at all.
            let variance = covariance[2 + i][2 + i];
            result.shape_relative[i] =
                Lane::select(variance.positive(), deviation(variance, birge), Lane::splat(f64::from(f32::INFINITY)));
        }
        let variances = solution.magnitude_variances(lobes, &covariance);
        for k in 0..C {
            result.diffuse[k] = deviation(variances.diffuse[k], birge);
            result.ambient[k] = deviation(variances.ambient[k], birge);
        }
        for j in 0..MAX_LOBES {
            result.specular[j] = deviation(variances.specular[j], birge);
        }
        result
    }
}

#[inline(always)]
fn write_row<const ISA: Isa, const C: usize, const P: usize>(
    mut row: Row,
    [channels, lobes, shapes, ambient]: [usize; 4],
    lane: usize,
    point: &Point<ISA>,
    solution: &Solution<ISA, C, P>,
    summary: &Summary<ISA>,
    deviations: &Deviations<ISA, C>,
) {
    let magnitudes = &solution.magnitudes;
    let shape: [f32; MAX_SHAPE] = array!(|i| point.shape_log[i].0[lane].exp());
    row.extend(point.normal.iter().map(|x| x.0[lane]));
    row.extend(magnitudes.diffuse[..channels].iter().map(|x| x.0[lane]));
    row.extend(magnitudes.specular[..lobes].iter().map(|x| x.0[lane]));
    row.extend(shape[..shapes].iter().copied());
    row.extend(magnitudes.ambient[..ambient].iter().map(|x| x.0[lane]));
    row.push(summary.chi2_reduced.0[lane]);
    row.push(summary.residual_rms.0[lane]);
    row.push(deviations.normal.0[lane]);
    row.extend(deviations.diffuse[..channels].iter().map(|x| x.0[lane]));
    row.extend(deviations.specular[..lobes].iter().map(|x| x.0[lane]));
    row.extend((0..shapes).map(|i| shape[i] * deviations.shape_relative[i].0[lane]));
    row.extend(deviations.ambient[..ambient].iter().map(|x| x.0[lane]));
}
