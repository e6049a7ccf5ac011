//! The joint fit: normal, shape and magnitudes of a pixel over all its lights at once.

use crate::arrow::Magnitudes;
use crate::dual::Dual;
use crate::geometry::{Illumination, across};
use crate::lanes::{Isa, LANES, Lane, LaneMask};
use crate::minimise::{Objective, Outcome, inverse, minimise};
use crate::models::{MAX_SHAPE, Model, Optics};
use crate::number::{Mask, Number, Real, array};
use crate::observations::{Belief, Group, Stack};
use crate::record::{FitBlock, Layout, Row, Status, groups};
use crate::robust::Loss;
use crate::separable::{Point, Prior, Scratch, Separable, Solution, propagated};
use crate::shadows::{self, Shadows};
use crate::start::{
    ASIDE, Grey, aside, candidates, diffuse_light, doubt_shadows, grey, start, start_at, starts, wider_start,
};
use std::marker::PhantomData;

/// Reweightings of the fit by Lambert's law that tells the first shadows.
const LAMBERT_ROUNDS: usize = 4;
/// Rounds of a robust fit with a wider loss before the one with the loss asked for.
const ROBUST_STAGES: usize = 2;
/// Reduced χ² above which a fit may have ended at a lobe of the wrong width.
const MISFIT: f64 = 2.0;
/// A coordinate that is far from all.
const ANY_WIDTH: f64 = 1e9;
/// Steps from each start, where there are several.
const EXPLORING_STEPS: usize = 12;
/// How much greater the cost of a second start may be than that of the first one's end.
const PROMISING: f64 = 4.0;
/// Steps from a second start, after which the better lobe is told from the other.
const RETRYING_STEPS: usize = 8;

#[derive(Clone, Copy, Debug)]
pub struct Options {
    pub optics: Optics,
    pub loss: Loss,
    pub max_steps: usize,
    pub ambient: bool,
    /// Whether samples in cast shadows are found and left out.
    pub shadows: bool,
    /// Whether highlights have a colour of their own, as a metal's have.
    pub coloured: bool,
}

/// The fit of groups of pixels, with its buffers.
pub struct JointFit<'a, M, const ISA: Isa, const C: usize, const P: usize, const L: usize> {
    stack: &'a Stack<'a>,
    options: Options,
    colour: [Lane<ISA>; C],
    group: Group<ISA, C>,
    grey: Vec<Grey<ISA>>,
    /// Share of each light's weight that its samples keep at the start of a robust fit.
    kept: Vec<Lane<ISA>>,
    shadows: Shadows<ISA, C>,
    /// Diffuse light under each light, by which shadows are found.
    diffuse: Vec<Lane<ISA>>,
    scratch: Scratch<ISA, C, P, L>,
    /// Across the plane of the lights, where they lie in one and the view does not.
    across: Option<[f64; 3]>,
    model: PhantomData<M>,
}

impl<'a, M: Model<L>, const ISA: Isa, const C: usize, const P: usize, const L: usize> JointFit<'a, M, ISA, C, P, L> {
    pub fn layout(stack: &Stack, options: &Options) -> Layout {
        let ambient = if options.ambient { stack.channels } else { 0 };
        let lights = if options.shadows { stack.lights.len() } else { 0 };
        Layout::joint(stack.channels, M::LOBES, P - 2, ambient, Self::colours(stack, options), lights)
    }

    /// How many numbers say a highlight's colour.
    fn colours(stack: &Stack, options: &Options) -> usize {
        if options.coloured && M::LOBES > 0 && stack.channels > 1 { stack.channels } else { 0 }
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
            shadows: Shadows::new(stack.lights.len()),
            diffuse: Vec::with_capacity(stack.lights.len()),
            scratch: Scratch::new(stack.lights.len()),
            across: across(&stack.lights, &stack.camera),
            model: PhantomData,
        }
    }
}

impl<M: Model<L>, const ISA: Isa, const C: usize, const P: usize, const L: usize> FitBlock
    for JointFit<'_, M, ISA, C, P, L>
{
    fn layout(&self) -> Layout {
        Self::layout(self.stack, &self.options)
    }

    #[inline(always)]
    fn fit_block(&mut self, first: usize, rows: &mut [f32], status: &mut [u8]) {
        let width = FitBlock::layout(self).width();
        for (first, rows, status) in groups(first, width, rows, status) {
            self.fit_group(first, rows, status);
        }
    }
}

impl<M: Model<L>, const ISA: Isa, const C: usize, const P: usize, const L: usize> JointFit<'_, M, ISA, C, P, L> {
    /// Leaves out the samples in cast shadows: first those that Lambert's law tells, then those that the model tells which
    /// is fitted to the others. Returns where that fit ends.
    #[inline(always)]
    fn leave_out_shadows(&mut self, first: usize, wanted: LaneMask) -> Point<ISA> {
        let unknowns = self.unknowns();
        let (optics, ambient) = (self.options.optics, self.options.ambient);
        diffuse_light(&self.grey, &self.group.illuminations, LAMBERT_ROUNDS, &mut self.diffuse);
        self.shadows.begin(&self.group, &self.grey);
        let zero = Lane::splat(0.0);
        self.shadows.leave_out(&self.diffuse, zero, wanted, unknowns, &mut self.group, &mut self.grey);
        let known = self.stack.known_normal::<ISA>(first);
        let illuminations = &self.group.illuminations;
        let normals = match known {
            Some(normal) => [normal; 2],
            None => candidates(&self.grey, illuminations),
        };
        let mut point = start_of::<M, ISA, L>(&normals, &self.grey, illuminations, &optics, ambient, None);
        let share = Lane::splat(1.0 / self.group.channels as f64);
        let mut changed = wanted;
        for _ in 0..shadows::ROUNDS {
            let mut problem = Separable::<M, ISA, C, P, L>::new(
                &self.group,
                self.colour,
                optics,
                Loss::Linear,
                ambient,
                &mut self.scratch,
            );
            problem.hold_normal = known.is_some();
            problem.prior = known.is_none().then(Prior::of_model::<M>);
            let outcome = minimise(&mut problem, &point, changed, self.options.max_steps);
            point = Separable::<M, ISA, C, P, L>::select(changed, &outcome.point, &point);
            let magnitudes = problem.solve(&point).magnitudes;
            let (mut diffuse, mut glow) = (zero, zero);
            for k in 0..self.group.channels {
                diffuse = magnitudes.diffuse[k].mul_add(share, diffuse);
                glow = magnitudes.ambient[k].mul_add(share, glow);
            }
            problem.diffuse_light(diffuse, &mut self.diffuse);
            problem.give_back(&mut self.scratch);
            changed = self.shadows.leave_out(&self.diffuse, glow, changed, unknowns, &mut self.group, &mut self.grey);
            if !changed.any() {
                break;
            }
        }
        point
    }

    #[inline(always)]
    fn fit_group(&mut self, first: usize, rows: &mut [f32], status: &mut [u8]) {
        self.group.gather(self.stack, first);
        grey(&self.group, &mut self.grey);
        let wanted = !self.group.usable_lights.lt(Lane::splat(self.unknowns() as f64));
        let unshadowed = if self.options.shadows { Some(self.leave_out_shadows(first, wanted)) } else { None };
        let illuminations = &self.group.illuminations;
        let (optics, ambient) = (self.options.optics, self.options.ambient);
        let robust = self.options.loss != Loss::Linear;
        if robust {
            doubt_shadows(&mut self.grey, illuminations, &mut self.kept);
        }
        let known = self.stack.known_normal::<ISA>(first);
        let find = |normals: &[[Lane<ISA>; 3]], avoided: Option<Lane<ISA>>| {
            start_of::<M, ISA, L>(normals, &self.grey, illuminations, &optics, ambient, avoided)
        };
        let mut problem = Separable::<M, ISA, C, P, L>::new(
            &self.group,
            self.colour,
            optics,
            self.options.loss,
            ambient,
            &mut self.scratch,
        );
        problem.hold_normal = known.is_some();
        let believed = self.stack.belief.map(|belief| believed::<M, ISA, L>(&belief, &self.stack.group(first)));
        problem.prior = match &believed {
            Some((_, prior)) => Some(*prior),
            None => known.is_none().then(Prior::of_model::<M>),
        };
        let mut begin = match (believed, known, self.across) {
            (Some((begin, prior)), _, _) => {
                // From where a fit without the belief ended it may not find what is believed.
                let believed = Point { coordinates: array!(|i| prior.shape[i].0), ..begin };
                explore(&mut problem, [begin, believed].into_iter(), wanted, EXPLORING_STEPS).point
            }
            (None, Some(normal), _) => {
                let shapes = starts::<M, ISA, L>().chain(wider_start::<M, ISA, L>());
                let points = shapes.map(|coordinates| Point { normal, coordinates });
                explore(&mut problem, points, wanted, EXPLORING_STEPS).point
            }
            (None, None, Some(across)) => {
                let normals = candidates(&self.grey, illuminations);
                let points = ASIDE.iter().flat_map(|&angle| {
                    let normals = aside(&normals, across, angle);
                    let first = find(&normals, None);
                    [first, find(&normals, Some(first.coordinates[0]))]
                });
                explore(&mut problem, points, wanted, EXPLORING_STEPS).point
            }
            (None, None, None) => unshadowed.unwrap_or_else(
                #[inline(always)]
                || find(&candidates(&self.grey, illuminations), None),
            ),
        };
        if robust {
            problem.robust.trust(&self.kept);
            // Far from the minimum every sample is an outlier: the loss first takes the residuals for noise.
            for _ in 0..ROBUST_STAGES {
                problem.scale_loss(Some(&begin));
                begin = minimise(&mut problem, &begin, wanted, self.options.max_steps).point;
            }
            problem.scale_loss(None);
        }
        let mut outcome = minimise(&mut problem, &begin, wanted, self.options.max_steps);
        let mut solution = problem.solve(&outcome.point);
        // A lobe of magnitude 0 gives its shape no gradient, so a fit that comes there cannot leave; and a weak lobe of a
        // material that the model does not describe has a narrow and a broad minimum. From the normal that was found the grid
        // of shapes may show a better lobe.
        let mut trapped = LaneMask::NONE;
        for j in 0..M::LOBES {
            trapped = trapped | !solution.magnitudes.specular[j].positive();
        }
        let mut doubtful = trapped;
        if M::LOBES == 1 && !robust {
            doubtful = doubtful | (solution.quadratic.cost * problem.per_freedom).gt(Lane::splat(MISFIT));
        }
        doubtful = doubtful & wanted;
        if believed.is_none() && known.is_none() && doubtful.any() {
            let avoided = Some(Lane::select(trapped, Lane::splat(ANY_WIDTH), outcome.point.coordinates[0]));
            let normal = [outcome.point.normal];
            // A lobe that is not the better one after a few steps will not become it.
            let tried = match self.across {
                Some(across) => {
                    let points = ASIDE.iter().map(|&angle| find(&aside(&normal, across, angle), avoided));
                    explore(&mut problem, points, doubtful, RETRYING_STEPS)
                }
                None => {
                    let begin = find(&normal, avoided);
                    let highest = solution.quadratic.cost * Lane::splat(PROMISING);
                    doubtful = doubtful & (trapped | problem.solve(&begin).quadratic.cost.lt(highest));
                    let steps = if L == 1 { RETRYING_STEPS } else { self.options.max_steps };
                    minimise(&mut problem, &begin, doubtful, steps)
                }
            };
            let better = tried.cost.lt(solution.quadratic.cost) & doubtful;
            if better.any() {
                let retried = minimise(&mut problem, &tried.point, better, self.options.max_steps);
                outcome.point = Separable::<M, ISA, C, P, L>::select(better, &retried.point, &outcome.point);
                outcome.converged = (outcome.converged & !better) | (retried.converged & better);
            }
            // Noise scale and weights are those of the second search's end.
            problem.solve(&outcome.point);
            problem.accepted(&outcome.point, doubtful);
            solution = problem.solve(&outcome.point);
        }
        if L > 1 {
            outcome.point.coordinates = M::ordered(outcome.point.coordinates);
            solution = problem.solve(&outcome.point);
        }
        let channels = self.stack.channels;
        let colours = Self::colours(self.stack, &self.options);
        let (magnitudes, colour) = if colours > 0 {
            problem.coloured(&solution.magnitudes)
        } else {
            (solution.magnitudes, [Lane::splat(1.0); C])
        };
        let summary = summarise(&problem, &magnitudes, &colour, colours, &self.group.irradiance);
        let at_bound = problem.at_bound(&outcome.point, &solution.magnitudes);
        let shape = problem.shape(&outcome.point);
        let deviations = Deviations::new(M::LOBES, &solution, &shape, summary.chi2_reduced);
        problem.give_back(&mut self.scratch);

        let ambients = if ambient { channels } else { 0 };
        let shadowed = if self.options.shadows { &self.shadows.dark[..] } else { &[] };
        let width = FitBlock::layout(self).width();
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
            write_row(
                Row::new(row),
                [channels, M::LOBES, P - 2, ambients, colours],
                lane,
                &outcome.point.normal,
                &array!(|i| shape[i].value),
                &magnitudes,
                &colour,
                &summary,
                &deviations,
                shadowed,
            );
        }
    }
}

/// The start and the prior that are believed of a group of pixels.
#[inline(always)]
fn believed<M: Model<L>, const ISA: Isa, const L: usize>(
    belief: &Belief,
    pixel: &[usize; LANES],
) -> (Point<ISA>, Prior<ISA, L>) {
    let shapes = M::SHAPE.len();
    let width = shapes + M::LOBES;
    let normal = array!(|axis| Lane(array!(|i| belief.normal[3 * pixel[i] + axis])));
    let mut point = Point { normal, coordinates: [Lane::splat(0.0); MAX_SHAPE] };
    for (lane, pixel) in pixel.iter().enumerate() {
        let shape = &belief.shape[shapes * pixel..shapes * (pixel + 1)];
        let coordinates = M::coordinates(&array!(|i| shape.get(i).map_or(1.0, |&value| f64::from(value))));
        for i in 0..shapes {
            point.coordinates[i].0[lane] = coordinates[i] as f32;
        }
    }
    let normal = |column: usize| {
        let mean = Lane(array!(|i| belief.mean[width * pixel[i] + column]));
        let deviation: Lane<ISA> = Lane(array!(|i| belief.deviation[width * pixel[i] + column]));
        (mean, Lane::splat(1.0) / deviation.squared())
    };
    let mut prior = Prior::of_model::<M>();
    for i in 0..shapes {
        prior.shape[i] = normal(i);
    }
    for j in 0..M::LOBES {
        prior.magnitude[j] = normal(shapes + j);
    }
    (point, prior)
}

/// The best of the model's starting shapes at the best of some normals, which a model of one lobe chooses.
#[inline(always)]
fn start_of<M: Model<L>, const ISA: Isa, const L: usize>(
    normals: &[[Lane<ISA>; 3]],
    grey: &[Grey<ISA>],
    illuminations: &[Illumination<Lane<ISA>>],
    optics: &Optics,
    ambient: bool,
    avoided: Option<Lane<ISA>>,
) -> Point<ISA> {
    let found = start::<M::Seed, ISA>(normals, grey, illuminations, optics, ambient, avoided);
    if L == 1 { found } else { start_at::<M, ISA, L>(found.normal, grey, illuminations, optics, ambient) }
}

/// The best of the points that a few steps from each of several starts lead to.
#[inline(always)]
fn explore<M: Model<L>, const ISA: Isa, const C: usize, const P: usize, const L: usize>(
    problem: &mut Separable<'_, M, ISA, C, P, L>,
    points: impl Iterator<Item = Point<ISA>>,
    wanted: LaneMask,
    steps: usize,
) -> Outcome<Point<ISA>, ISA> {
    let mut best: Option<Outcome<Point<ISA>, ISA>> = None;
    for point in points {
        let mut found = minimise(problem, &point, wanted, steps);
        if let Some(best) = best {
            let better = found.cost.lt(best.cost);
            found.point = Separable::<M, ISA, C, P, L>::select(better, &found.point, &best.point);
            found.cost = found.cost.min(best.cost);
        }
        best = Some(found);
    }
    best.expect("at least one start")
}

struct Summary<const ISA: Isa> {
    chi2_reduced: Lane<ISA>,
    /// Root mean square over the usable samples, in relative radiance as measured.
    residual_rms: Lane<ISA>,
}

#[inline(always)]
fn summarise<M: Model<L>, const ISA: Isa, const C: usize, const P: usize, const L: usize>(
    problem: &Separable<'_, M, ISA, C, P, L>,
    magnitudes: &Magnitudes<ISA, C, L>,
    colour: &[Lane<ISA>; C],
    colours: usize,
    irradiance: &[[Lane<ISA>; C]],
) -> Summary<ISA> {
    let (zero, one) = (Lane::splat(0.0), Lane::splat(1.0));
    let mut samples = zero;
    let mut chi2 = zero;
    let mut squares = zero;
    for (light, observation) in problem.observations.iter().enumerate() {
        let predicted = problem.predicted(magnitudes, colour, light);
        for k in 0..C {
            let residual = observation.radiance[k] - predicted[k];
            let measured = residual * irradiance[light][k];
            let usable = observation.weight[k].positive();
            samples = samples + Lane::select(usable, one, zero);
            squares = squares + Lane::select(usable, measured * measured, zero);
            chi2 = chi2 + observation.weight[k] * residual * residual;
        }
    }
    let unknowns = P + M::LOBES + problem.channels * (1 + usize::from(problem.ambient)) + colours.saturating_sub(1);
    let freedom = (samples - Lane::splat(unknowns as f64)).max(one);
    Summary { chi2_reduced: chi2 / freedom, residual_rms: (squares / samples.max(one)).sqrt() }
}

/// Standard deviations from the Fisher information at the solution. Where the residuals exceed the noise model they are
/// raised by √χ²_reduced [Birge1932], for what the model does not describe is then the larger error.
struct Deviations<const ISA: Isa, const C: usize, const L: usize> {
    /// Root mean square angle between the fitted and the true normal, radians.
    normal: Lane<ISA>,
    shape: [Lane<ISA>; MAX_SHAPE],
    diffuse: [Lane<ISA>; C],
    ambient: [Lane<ISA>; C],
    specular: [Lane<ISA>; L],
}

#[inline(always)]
fn deviation<const ISA: Isa>(variance: Lane<ISA>, birge: Lane<ISA>) -> Lane<ISA> {
    (variance * birge).max(Lane::splat(0.0)).sqrt()
}

impl<const ISA: Isa, const C: usize, const L: usize> Deviations<ISA, C, L> {
    /// `shape` with its derivatives by the coordinates.
    #[inline(always)]
    fn new<const P: usize>(
        lobes: usize,
        solution: &Solution<ISA, C, P, L>,
        shape: &[Dual<Lane<ISA>, P>; MAX_SHAPE],
        chi2_reduced: Lane<ISA>,
    ) -> Self {
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
            shape: [zero; MAX_SHAPE],
            diffuse: [zero; C],
            ambient: [zero; C],
            specular: [zero; L],
        };
        for i in 0..P - 2 {
            result.shape[i] = deviation(propagated(shape[i].derivative, &covariance), birge);
            for p in 2..P {
                // A coordinate that nothing depends on has an entry of 0 and is known not at all.
                let unknown = !covariance[p][p].positive() & shape[i].derivative[p].abs().positive();
                result.shape[i] = Lane::select(unknown, Lane::splat(f64::from(f32::INFINITY)), result.shape[i]);
            }
        }
        let variances = solution.magnitude_variances(lobes, &covariance);
        for k in 0..C {
            result.diffuse[k] = deviation(variances.diffuse[k], birge);
            result.ambient[k] = deviation(variances.ambient[k], birge);
        }
        for j in 0..L {
            result.specular[j] = deviation(variances.specular[j], birge);
        }
        result
    }
}

#[inline(always)]
#[allow(clippy::too_many_arguments)]
fn write_row<const ISA: Isa, const C: usize, const L: usize>(
    mut row: Row,
    [channels, lobes, shapes, ambient, colours]: [usize; 5],
    lane: usize,
    normal: &[Lane<ISA>; 3],
    shape: &[Lane<ISA>; MAX_SHAPE],
    magnitudes: &Magnitudes<ISA, C, L>,
    colour: &[Lane<ISA>; C],
    summary: &Summary<ISA>,
    deviations: &Deviations<ISA, C, L>,
    shadowed: &[LaneMask],
) {
    row.extend(normal.iter().map(|x| x.0[lane]));
    row.extend(magnitudes.diffuse[..channels].iter().map(|x| x.0[lane]));
    row.extend(magnitudes.specular[..lobes].iter().map(|x| x.0[lane]));
    row.extend(shape[..shapes].iter().map(|x| x.0[lane]));
    row.extend(magnitudes.ambient[..ambient].iter().map(|x| x.0[lane]));
    row.extend(colour[..colours].iter().map(|x| x.0[lane]));
    row.push(summary.chi2_reduced.0[lane]);
    row.push(summary.residual_rms.0[lane]);
    row.push(deviations.normal.0[lane]);
    row.extend(deviations.diffuse[..channels].iter().map(|x| x.0[lane]));
    row.extend(deviations.specular[..lobes].iter().map(|x| x.0[lane]));
    row.extend(deviations.shape[..shapes].iter().map(|x| x.0[lane]));
    row.extend(deviations.ambient[..ambient].iter().map(|x| x.0[lane]));
    row.extend(shadowed.iter().map(|dark| if dark.holds(lane) { 1.0 } else { 0.0 }));
}
