//! From a model's name, the number of channels and the processor's instructions to the code compiled for them.
//!
//! The fit and the renderer are compiled twice, for any x86-64 and for one with AVX2 and FMA; which one runs is decided
//! when it is called. The inner functions are inlined whole, so that they inherit the instruction set from here.

use crate::joint::{JointFit, Options};
use crate::lanes::LANES;
use crate::models::{Model, Optics, ShapeParameter};
use crate::observations::Stack;
use crate::paper::{PaperFit, Sample};
use crate::record::{FitGroup, Layout};
use crate::render::{Parameters, View, render_group};
use rayon::prelude::*;

/// Pixels that one thread takes at a time: enough to hide the start of a task, few enough to share a tile evenly.
const BLOCK: usize = 64 * LANES;

/// What Python, the help and the documentation say of a model.
pub struct Entry {
    pub name: &'static str,
    pub title: String,
    pub citations: Vec<&'static str>,
    pub shape: &'static [ShapeParameter],
    pub lobes: usize,
    pub ambient_by_default: bool,
    pub reciprocal: bool,
}

/// A fitted tile: one row of numbers per pixel, as its layout says.
pub struct Fitted {
    pub layout: Layout,
    pub rows: Vec<f32>,
    pub status: Vec<u8>,
}

/// Whether the processor has the instructions of the fast version.
pub fn fast_instructions() -> bool {
    #[cfg(target_arch = "x86_64")]
    return std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma");
    #[cfg(not(target_arch = "x86_64"))]
    return cfg!(target_arch = "aarch64");
}

#[inline(always)]
fn fit_block<F: FitGroup>(fit: &mut F, block: usize, rows: &mut [f32], status: &mut [u8]) {
    let width = fit.layout().width();
    for (group, (rows, status)) in rows.chunks_mut(LANES * width).zip(status.chunks_mut(LANES)).enumerate() {
        fit.fit_group(block * BLOCK + group * LANES, rows, status);
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn fit_block_fast<F: FitGroup>(fit: &mut F, block: usize, rows: &mut [f32], status: &mut [u8]) {
    fit_block(fit, block, rows, status);
}

/// Fits a tile with all threads: `fast` makes the fit for AVX2 and FMA, `plain` the one for any processor.
fn fit_tile<Fast: FitGroup, Plain: FitGroup>(
    pixels: usize,
    layout: Layout,
    fast: impl Fn() -> Fast + Sync + Send,
    plain: impl Fn() -> Plain + Sync + Send,
) -> Fitted {
    let width = layout.width();
    let mut rows = vec![0.0; pixels * width];
    let mut status = vec![0; pixels];
    let blocks = rows.par_chunks_mut(BLOCK * width).zip(status.par_chunks_mut(BLOCK)).enumerate();
    if fast_instructions() {
        blocks.for_each_init(fast, |fit, (block, (rows, status))| {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: the processor has AVX2 and FMA, as `fast_instructions` has just said.
            unsafe {
                fit_block_fast(fit, block, rows, status);
            }
            #[cfg(not(target_arch = "x86_64"))]
            fit_block(fit, block, rows, status);
        });
    } else {
        blocks.for_each_init(plain, |fit, (block, (rows, status))| fit_block(fit, block, rows, status));
    }
    Fitted { layout, rows, status }
}

fn fit_joint<M: Model, const C: usize, const P: usize, const AMBIENT: bool>(
    stack: &Stack,
    colour: &[f64],
    options: Options,
) -> Option<Fitted> {
    Some(fit_tile(
        stack.pixels,
        JointFit::<M, true, C, P, AMBIENT>::LAYOUT,
        || JointFit::<M, true, C, P, AMBIENT>::new(stack, colour, options),
        || JointFit::<M, false, C, P, AMBIENT>::new(stack, colour, options),
    ))
}

fn fit_paper<M: Model, const C: usize>(
    ambient: bool,
    stack: &Stack,
    colour: &[f64],
    sample: Sample,
    options: Options,
) -> Option<Fitted> {
    if !PaperFit::<M, true, C>::APPLIES {
        return None;
    }
    Some(fit_tile(
        stack.pixels,
        PaperFit::<M, true, C>::LAYOUT,
        || PaperFit::<M, true, C>::new(stack, colour, sample, ambient, options),
        || PaperFit::<M, false, C>::new(stack, colour, sample, ambient, options),
    ))
}

#[inline(always)]
fn render_block<M: Model, const FMA: bool>(
    parameters: &Parameters,
    view: &View,
    optics: &Optics,
    block: usize,
    radiance: &mut [f32],
) {
    for (group, radiance) in radiance.chunks_mut(LANES * view.intensity.len()).enumerate() {
        render_group::<M, FMA>(parameters, view, optics, block * BLOCK + group * LANES, radiance);
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn render_block_fast<M: Model>(
    parameters: &Parameters,
    view: &View,
    optics: &Optics,
    block: usize,
    radiance: &mut [f32],
) {
    render_block::<M, true>(parameters, view, optics, block, radiance);
}

fn render_light<M: Model>(parameters: &Parameters, view: &View, optics: &Optics, radiance: &mut [f32]) {
    let fast = fast_instructions();
    radiance.par_chunks_mut(BLOCK * view.intensity.len()).enumerate().for_each(|(block, radiance)| {
        #[cfg(target_arch = "x86_64")]
        if fast {
            // SAFETY: the processor has AVX2 and FMA.
            return unsafe { render_block_fast::<M>(parameters, view, optics, block, radiance) };
        }
        if fast {
            render_block::<M, true>(parameters, view, optics, block, radiance);
        } else {
            render_block::<M, false>(parameters, view, optics, block, radiance);
        }
    });
}

macro_rules! dispatch {
    ($(($name:literal, $model:ty, $ambient:literal)),* $(,)?) => {
        /// Every model that has a name.
        pub fn entries() -> Vec<Entry> {
            vec![$(Entry {
                name: $name,
                title: <$model>::title(),
                citations: <$model>::citations(),
                shape: <$model>::SHAPE,
                lobes: <$model>::LOBES,
                ambient_by_default: $ambient,
                reciprocal: <$model>::RECIPROCAL,
            }),*]
        }

        /// Fits a tile; `None` if no model has the name or the number of channels is neither 1 nor 3.
        pub fn fit(name: &str, ambient: bool, stack: &Stack, colour: &[f64], options: Options) -> Option<Fitted> {
            match (name, colour.len(), ambient) {
                $(
                    ($name, 1, false) => fit_joint::<$model, 1, { 2 + <$model>::SHAPE.len() }, false>(stack, colour, options),
                    ($name, 1, true) => fit_joint::<$model, 1, { 2 + <$model>::SHAPE.len() }, true>(stack, colour, options),
                    ($name, 3, false) => fit_joint::<$model, 3, { 2 + <$model>::SHAPE.len() }, false>(stack, colour, options),
                    ($name, 3, true) => fit_joint::<$model, 3, { 2 + <$model>::SHAPE.len() }, true>(stack, colour, options),
                )*
                _ => None,
            }
        }

        /// Fits a tile by the paper's procedure; `None` also where that is not defined for the model.
        pub fn paper(
            name: &str,
            ambient: bool,
            stack: &Stack,
            colour: &[f64],
            sample: Sample,
            options: Options,
        ) -> Option<Fitted> {
            match (name, colour.len()) {
                $(
                    ($name, 1) => fit_paper::<$model, 1>(ambient, stack, colour, sample, options),
                    ($name, 3) => fit_paper::<$model, 3>(ambient, stack, colour, sample, options),
                )*
                _ => None,
            }
        }

        /// Renders one light into `radiance`, (pixel, channel); `false` if no model has the name.
        pub fn render(name: &str, parameters: &Parameters, view: &View, optics: &Optics, radiance: &mut [f32]) -> bool {
            match name {
                $($name => render_light::<$model>(parameters, view, optics, radiance),)*
                _ => return false,
            }
            true
        }

        /// Diffuse and specular basis values in f64, for golden values; `None` if no model has the name.
        pub fn basis(
            name: &str,
            normal: [f64; 3],
            shape: &[f64],
            at: &crate::geometry::Illumination<f64>,
            optics: &Optics,
        ) -> Option<Vec<f64>> {
            match name {
                $($name => {
                    let basis = <$model>::basis(normal, shape, at, optics);
                    let mut values = vec![basis.diffuse];
                    values.extend(&basis.specular[..<$model>::LOBES]);
                    Some(values)
                })*
                _ => None,
            }
        }
    };
}
crate::for_each_model!(dispatch);
