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
use std::sync::LazyLock;

/// Pixels that one thread takes at a time: enough to hide the start of a task, few enough to share a tile evenly.
const BLOCK: usize = 64 * LANES;

/// Channels that the fit is compiled for: stacks of fewer leave the rest without weight.
pub const MAX_CHANNELS: usize = 3;

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

/// Whether the fast version runs: the processor has its instructions, and IMPASTO_PLAIN is not set in the environment.
pub fn fast_instructions() -> bool {
    static FAST: LazyLock<bool> = LazyLock::new(|| {
        #[cfg(target_arch = "x86_64")]
        let has = std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma");
        #[cfg(not(target_arch = "x86_64"))]
        let has = cfg!(target_arch = "aarch64");
        has && std::env::var_os("IMPASTO_PLAIN").is_none()
    });
    *FAST
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
    fast: impl Fn() -> Fast + Sync + Send,
    plain: impl Fn() -> Plain + Sync + Send,
    layout: Layout,
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

fn fit_joint<M: Model, const P: usize>(stack: &Stack, colour: &[f64], options: Options) -> Fitted {
    fit_tile(
        stack.pixels,
        || JointFit::<M, true, MAX_CHANNELS, P>::new(stack, colour, options),
        || JointFit::<M, false, MAX_CHANNELS, P>::new(stack, colour, options),
        JointFit::<M, true, MAX_CHANNELS, P>::layout(stack.channels, options.ambient),
    )
}

fn fit_paper<M: Model>(stack: &Stack, colour: &[f64], sample: Sample, options: Options) -> Option<Fitted> {
    PaperFit::<M, true, MAX_CHANNELS>::APPLIES.then(|| {
        fit_tile(
            stack.pixels,
            || PaperFit::<M, true, MAX_CHANNELS>::new(stack, colour, sample, options),
            || PaperFit::<M, false, MAX_CHANNELS>::new(stack, colour, sample, options),
            Layout::paper(stack.channels),
        )
    })
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

        /// Fits a tile; `None` if no model has the name.
        pub fn fit(name: &str, stack: &Stack, colour: &[f64], options: Options) -> Option<Fitted> {
            match name {
                $(
                    $name => Some(fit_joint::<$model, { 2 + <$model>::SHAPE.len() }>(stack, colour, options)),
                                    )*
                _ => None,
            }
        }

        /// Fits a tile by the paper's procedure; `None` also where that is not defined for the model.
        pub fn paper(
            name: &str,
            stack: &Stack,
            colour: &[f64],
            sample: Sample,
            options: Options,
        ) -> Option<Fitted> {
            match name {
                $(
                    $name => fit_paper::<$model>(stack, colour, sample, options),
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
