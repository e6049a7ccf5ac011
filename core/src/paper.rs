//! The paper's procedure (its Fig. 3): diffuse term first, from lights far from the highlight; then, with one specular
//! magnitude for the whole sample, the shape of the lobe.
//!
//! Residuals are unweighted. In its literal form the shape is fitted with the view's tilt θv, ln(shape) and an empirical φn
//! free, φv = 0 and the diffuse term held. In its refined form the view is the calibrated one, and Ad, θn, φn and the shape
//! are fitted over all lights with As held.

use crate::dispatch::BLOCK;
use crate::geometry::{Illumination, dot, normalise};
use crate::joint::Options;
use crate::lanes::{Isa, LANES, Lane, LaneMask};
use crate::minimise::minimise;
use crate::models::{Basis, Lambert, MAX_SHAPE, Model, Optics, ShapeParameter};
use crate::number::{Number, Real, array};
use crate::observations::{Group, Stack};
use crate::paper_shape::{Left, ShapeFit, ShapeQueue, Waiting};
use crate::record::{FitBlock, Layout, Row, Status, groups};
use crate::robust::Loss;
use crate::separable::{Point, Scratch, Separable};
use crate::start::{Grey, diffuse_normal, grey};

/// What holds for the whole sample.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Lights at least this far from the highlight's peak, in radians, are taken to carry no specular term.
    pub threshold: f64,
    /// As, from the pixel that holds the highlight's peak.
    pub specular: f64,
    pub refined: bool,
    /// Unit vector towards the light of the whole sample's highlight; each pixel's own where there is none.
    pub peak: Option<[f64; 3]>,
}

/// The diffuse stage of Phong's form, Y = Ae + Ad max(0, n·l), with one Ae for all channels: as a basis function of
/// value 1 it stands where a lobe would.
struct UniformAmbient;

impl Model for UniformAmbient {
    type Seed = Self;
    const SHAPE: &'static [ShapeParameter] = &[];
    const LOBES: usize = 1;
    const RECIPROCAL: bool = true;
    const STARTS: &'static [[f64; MAX_SHAPE]] = &[[0.0; MAX_SHAPE]];

    fn title() -> String {
        "Lambert with one ambient term".into()
    }
    fn citations() -> Vec<&'static str> {
        vec!["Chen2007"]
    }

    #[inline(always)]
    fn basis<N: Number>(normal: [N; 3], shape: &[N], at: &Illumination<N::Real>, optics: &Optics) -> Basis<N> {
        let mut basis = Lambert::basis(normal, shape, at, optics);
        basis.specular[0] = N::splat(1.0);
        basis
    }

    #[inline(always)]
    fn specular_scale<N: Number>(_shape: &[N]) -> [N; 1] {
        [N::splat(1.0)]
    }
}

/// The result of the diffuse stage.
#[derive(Clone, Copy)]
struct Diffuse<const ISA: Isa, const C: usize> {
    normal: [Lane<ISA>; 3],
    magnitude: [Lane<ISA>; C],
    ambient: Lane<ISA>,
    /// Pixels with as many lights outside the threshold as the stage has unknowns.
    enough: LaneMask,
    converged: LaneMask,
    /// Usable samples of all lights and channels.
    samples: Lane<ISA>,
    all_clipped: LaneMask,
}

pub struct PaperFit<'a, M, const ISA: Isa, const C: usize> {
    stack: &'a Stack<'a>,
    sample: Sample,
    options: Options,
    colour: [Lane<ISA>; C],
    group: Group<ISA, C>,
    /// The group with the lights near the highlight left out.
    far: Group<ISA, C>,
    grey: Vec<Grey<ISA>>,
    shape_fit: ShapeFit<M, ISA>,
    left: Left<ISA>,
    /// Groups of a block whose diffuse stage is done, and whose shape is to be fitted.
    diffuse: Vec<Diffuse<ISA, C>>,
    waiting: Vec<Waiting<ISA>>,
    diffuse_scratch: Scratch<ISA, C, 2>,
    scratch: Scratch<ISA, C, 3>,
}

impl<'a, M: Model, const ISA: Isa, const C: usize> PaperFit<'a, M, ISA, C> {
    /// Whether the procedure is defined for the model: one lobe of one shape parameter.
    pub const APPLIES: bool = M::LOBES == 1 && M::SHAPE.len() == 1;

    pub fn new(stack: &'a Stack<'a>, colour: &[f64], sample: Sample, options: Options) -> Self {
        let group = Group::new(stack, options.optics.index);
        let specular = Lane::splat(sample.specular);
        PaperFit {
            shape_fit: ShapeFit::new(&group.illuminations, specular, options.optics),
            stack,
            sample,
            options,
            colour: std::array::from_fn(|k| Lane::splat(colour.get(k).copied().unwrap_or(0.0))),
            group,
            far: Group::new(stack, options.optics.index),
            grey: Vec::with_capacity(stack.lights.len()),
            left: Left::new(stack.lights.len()),
            diffuse: Vec::with_capacity(BLOCK / LANES),
            waiting: (0..if sample.refined { 0 } else { BLOCK / LANES })
                .map(|_| Waiting::new(stack.lights.len()))
                .collect(),
            diffuse_scratch: Scratch::new(stack.lights.len()),
            scratch: Scratch::new(stack.lights.len()),
        }
    }

    /// Step 2: the lights within the threshold of the pixel's highlight lose their weight.
    #[inline(always)]
    fn leave_out_highlight(&mut self) {
        // Clipped samples are the highlight's brightest: several at once make their mean the peak.
        let mut brightest = Lane::splat(-1.0);
        for sample in &self.grey {
            brightest = brightest.max(sample.radiance);
        }
        let mut sum = [Lane::splat(0.0); 3];
        for (sample, at) in self.grey.iter().zip(&self.group.illuminations) {
            let at_peak = !sample.radiance.lt(brightest * Lane::splat(0.999));
            for i in 0..3 {
                sum[i] = sum[i] + Lane::select(at_peak, at.light[i], Lane::splat(0.0));
            }
        }
        let peak = match self.sample.peak {
            Some(direction) => array!(|i| Lane::splat(direction[i])),
            None => normalise(sum),
        };
        let nearest = Lane::splat(self.sample.threshold.cos());
        self.far.usable_lights = Lane::splat(0.0);
        for (light, observation) in self.group.observations.iter().enumerate() {
            let excluded = dot(peak, self.group.illuminations[light].light).gt(nearest);
            let grey = &mut self.grey[light];
            grey.weight = Lane::select(excluded, Lane::splat(0.0), grey.weight);
            let mut left = *observation;
            let mut usable = LaneMask::NONE;
            for k in 0..C {
                left.weight[k] = Lane::select(excluded, Lane::splat(0.0), left.weight[k]);
                usable = usable | left.weight[k].positive();
            }
            self.far.usable_lights = self.far.usable_lights + Lane::select(usable, Lane::splat(1.0), Lane::splat(0.0));
            self.far.observations[light] = left;
        }
    }

    /// Step 3. Lights in one plane leave φn undetermined: it stays 0, and Ad is then Ad cos φn.
    #[inline(always)]
    fn fit_diffuse<D: Model>(&mut self, colour: [Lane<ISA>; C]) -> Diffuse<ISA, C> {
        let begin = Point {
            normal: diffuse_normal(&self.grey, &self.far.illuminations, 1),
            coordinates: [Lane::splat(0.0); MAX_SHAPE],
        };
        let unknowns = 3 + usize::from(self.options.ambient);
        let enough = !self.far.usable_lights.lt(Lane::splat(unknowns as f64));
        let mut problem: Separable<'_, D, ISA, C, 2> =
            Separable::new(&self.far, colour, self.options.optics, Loss::Linear, false, &mut self.diffuse_scratch);
        problem.prior = None;
        let outcome = minimise(&mut problem, &begin, enough, self.options.max_steps);
        let magnitudes = problem.magnitudes();
        problem.give_back(&mut self.diffuse_scratch);
        Diffuse {
            normal: outcome.point.normal,
            magnitude: magnitudes.diffuse,
            ambient: magnitudes.specular[0],
            enough,
            converged: outcome.converged,
            samples: self.group.usable_samples,
            all_clipped: self.group.clipped.positive() & !self.group.usable_lights.positive(),
        }
    }

    /// Steps 2 and 3 for a group.
    #[inline(always)]
    fn first_stage(&mut self, first: usize) -> Diffuse<ISA, C> {
        self.group.gather(self.stack, first);
        grey(&self.group, &mut self.grey);
        self.leave_out_highlight();
        let diffuse = if self.options.ambient {
            self.fit_diffuse::<UniformAmbient>([Lane::splat(1.0); C])
        } else {
            self.fit_diffuse::<Lambert>(self.colour)
        };
        // From here on the ambient term is known: what remains is diffuse and specular.
        for observation in &mut self.group.observations {
            for k in 0..C {
                observation.radiance[k] = observation.radiance[k] - diffuse.ambient;
            }
        }
        diffuse
    }

    /// Step 5, literally, for all groups of a block.
    #[inline(always)]
    fn fit_shapes(&mut self) {
        let waiting = &mut self.waiting[..self.diffuse.len()];
        ShapeQueue::run(&self.shape_fit, waiting, &mut self.left, self.options.max_steps);
    }

    /// What step 5 found for a group.
    #[inline(always)]
    fn shape_of(&self, diffuse: &Diffuse<ISA, C>, found: &Waiting<ISA>) -> Shape<ISA, C> {
        let normal = found.left.normal(found.point.phi);
        // Ad cos φn is what the diffuse stage saw, as its φn was 0.
        let in_plane = (normal[0] * normal[0] + normal[2] * normal[2]).sqrt();
        let scale = (diffuse.normal[0] * diffuse.normal[0] + diffuse.normal[2] * diffuse.normal[2]).sqrt() / in_plane;
        Shape {
            normal,
            magnitude: array!(|k| diffuse.magnitude[k] * scale),
            shape_log: found.point.shape_log,
            view_tilt: found.point.view,
            cost: found.cost,
            converged: found.converged,
            at_bound: self.shape_fit.at_bound(&found.point),
        }
    }

    /// The refined form of steps 3 and 5.
    #[inline(always)]
    fn refine(&mut self, diffuse: &Diffuse<ISA, C>) -> Shape<ISA, C> {
        self.left.take(&self.group, diffuse.normal, diffuse.magnitude, self.colour);
        let begin = self.shape_fit.start_out_of_plane(&self.left);
        let mut problem: Separable<'_, M, ISA, C, 3> =
            Separable::new(&self.group, self.colour, self.options.optics, Loss::Linear, false, &mut self.scratch);
        problem.prior = None;
        problem.fixed_specular = Some([Lane::splat(self.sample.specular)]);
        let outcome = minimise(&mut problem, &begin, diffuse.enough, self.options.max_steps);
        let magnitudes = problem.magnitudes();
        let at_bound = problem.at_bound(&outcome.point, &magnitudes);
        problem.give_back(&mut self.scratch);
        let view = self.group.illuminations[0].view;
        Shape {
            normal: outcome.point.normal,
            magnitude: magnitudes.diffuse,
            shape_log: outcome.point.coordinates[0],
            view_tilt: Lane(array!(|i| view[0].0[i].atan2(view[2].0[i]))),
            cost: outcome.cost,
            converged: outcome.converged,
            at_bound,
        }
    }

    #[inline(always)]
    fn write(&self, diffuse: &Diffuse<ISA, C>, fitted: &Shape<ISA, C>, rows: &mut [f32], status: &mut [u8]) {
        let channels = self.stack.channels;
        let width = FitBlock::layout(self).width();
        let rms = (fitted.cost / diffuse.samples.max(Lane::splat(1.0))).sqrt();
        for (lane, status) in status.iter_mut().enumerate() {
            let row = &mut rows[lane * width..(lane + 1) * width];
            if !diffuse.enough.holds(lane) {
                *status = if diffuse.all_clipped.holds(lane) { Status::AllClipped } else { Status::TooFewLights } as u8;
                row.fill(f32::NAN);
                continue;
            }
            let identified = self.sample.specular.is_finite();
            *status = if !identified {
                Status::NotIdentified
            } else if !(fitted.converged & diffuse.converged).holds(lane) {
                Status::StepLimit
            } else if fitted.at_bound.holds(lane) {
                Status::AtBound
            } else {
                Status::Converged
            } as u8;
            let mut row = Row::new(row);
            if identified {
                row.extend(fitted.normal.iter().map(|x| x.0[lane]));
                row.extend(fitted.magnitude[..channels].iter().map(|x| x.0[lane]));
                row.push(self.sample.specular as f32);
                row.push(fitted.shape_log.0[lane].exp());
            } else {
                row.extend(diffuse.normal.iter().map(|x| x.0[lane]));
                row.extend(diffuse.magnitude[..channels].iter().map(|x| x.0[lane]));
                row.extend([f32::NAN, f32::NAN]);
            }
            row.extend(std::iter::repeat_n(diffuse.ambient.0[lane], channels));
            row.push(if identified { rms.0[lane] } else { f32::NAN });
            row.push(if identified { fitted.view_tilt.0[lane] } else { f32::NAN });
        }
    }
}

impl<M: Model, const ISA: Isa, const C: usize> FitBlock for PaperFit<'_, M, ISA, C> {
    fn layout(&self) -> Layout {
        Layout::paper(self.stack.channels)
    }

    #[inline(always)]
    fn fit_block(&mut self, first: usize, rows: &mut [f32], status: &mut [u8]) {
        let width = FitBlock::layout(self).width();
        self.diffuse.clear();
        for (number, (first, rows, status)) in groups(first, width, rows, status).enumerate() {
            let diffuse = self.first_stage(first);
            if self.sample.refined {
                let fitted = self.refine(&diffuse);
                self.write(&diffuse, &fitted, rows, status);
                continue;
            }
            let waiting = &mut self.waiting[number];
            waiting.left.take(&self.group, diffuse.normal, diffuse.magnitude, self.colour);
            waiting.wanted = diffuse.enough;
            waiting.point = self.shape_fit.start(&waiting.left);
            self.diffuse.push(diffuse);
        }
        if self.sample.refined {
            return;
        }
        self.fit_shapes();
        for (number, (_, rows, status)) in groups(first, width, rows, status).enumerate() {
            let diffuse = self.diffuse[number];
            let fitted = self.shape_of(&diffuse, &self.waiting[number]);
            self.write(&diffuse, &fitted, rows, status);
        }
    }
}

/// What the last stage adds.
struct Shape<const ISA: Isa, const C: usize> {
    normal: [Lane<ISA>; 3],
    magnitude: [Lane<ISA>; C],
    shape_log: Lane<ISA>,
    view_tilt: Lane<ISA>,
    cost: Lane<ISA>,
    converged: LaneMask,
    at_bound: LaneMask,
}
