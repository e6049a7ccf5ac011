//! From a model's name, the number of channels and the processor's instructions to the code compiled for them.
//!
//! The fit and the renderer are compiled for several sets of instructions; which of them runs is decided when it is called.
//! The inner functions are inlined whole, so that they inherit the instructions from here.

use crate::geometry::Illumination;
use crate::joint::{JointFit, Options};
use crate::lanes::{FUSED, Isa, LANES, PLAIN, WIDE, outlined};
use crate::models::{Model, Optics, ShapeParameter, plain_coordinate};
use crate::observations::Stack;
use crate::paper::{PaperFit, Sample};
use crate::record::{FitBlock, Layout};
use crate::render::{self, Scene, Shader, Shading};
use crate::residual::{LeftOver, Residual};
use crate::slopes;
use crate::threads::on_all_threads;
use std::sync::LazyLock;

/// Pixels that one thread takes at a time: enough to hide the start of a task, few enough to share a tile evenly.
pub const BLOCK: usize = 32 * LANES;

/// Channels that the fit is compiled for: stacks of fewer leave the rest without weight.
pub const MAX_CHANNELS: usize = 3;

/// What Python, the help and the documentation say of a model.
pub struct Entry {
    pub name: &'static str,
    pub title: String,
    pub citations: Vec<&'static str>,
    pub shape: &'static [ShapeParameter],
    /// Mean and standard deviation of the weak prior of each shape parameter or its logarithm, if that is what the fit moves.
    pub prior: Vec<Option<(f64, f64)>>,
    pub lobes: usize,
    pub ambient_by_default: bool,
    pub reciprocal: bool,
}

/// A fitted tile: the maps that its layout names.
pub struct Fitted {
    pub maps: Vec<Map>,
    pub status: Vec<u8>,
}

/// One quantity of all pixels of a tile, `width` values for each.
pub struct Map {
    pub name: &'static str,
    pub width: usize,
    pub values: Vec<f32>,
}

/// The instructions that the fit and the renderer run with: the best that the processor has, unless the environment
/// names others that it has too (IMPASTO_INSTRUCTIONS).
pub fn instructions() -> Isa {
    static BEST: LazyLock<Isa> = LazyLock::new(|| {
        let asked = std::env::var("IMPASTO_INSTRUCTIONS").unwrap_or_default();
        let known = |isa: &&Isa| asked == instruction_name(**isa);
        *AVAILABLE.iter().find(known).unwrap_or(AVAILABLE.last().expect("at least the plain ones"))
    });
    *BEST
}

/// What this processor has, the best last.
static AVAILABLE: LazyLock<Vec<Isa>> = LazyLock::new(|| {
    #[cfg(target_arch = "x86_64")]
    let (fused, wide) = {
        use std::arch::is_x86_feature_detected as has;
        let fused = has!("avx2") && has!("fma");
        let wide = has!("avx512f") && has!("avx512vl") && has!("avx512dq") && has!("avx512bw");
        (fused, fused && wide)
    };
    #[cfg(not(target_arch = "x86_64"))]
    let (fused, wide) = (cfg!(target_arch = "aarch64"), false);
    let (plain, wide) = if cfg!(feature = "quick") { (false, false) } else { (true, wide) };
    let found = [(PLAIN, plain), (FUSED, fused), (WIDE, wide)];
    found.into_iter().filter_map(|(isa, has)| has.then_some(isa)).collect()
});

/// The names of the instructions that this processor has, the best last.
pub fn available_instructions() -> Vec<&'static str> {
    AVAILABLE.iter().map(|isa| instruction_name(*isa)).collect()
}

pub fn instruction_name(isa: Isa) -> &'static str {
    match isa {
        WIDE => "avx512",
        FUSED if cfg!(target_arch = "x86_64") => "avx2",
        FUSED => "fused",
        _ => "plain",
    }
}

/// Evaluates an expression in which `$isa` is the constant for the instructions that the processor has.
macro_rules! with_instructions {
    ($isa:ident => $expression:expr) => {
        match instructions() {
            #[cfg(all(target_arch = "x86_64", not(feature = "quick")))]
            WIDE => {
                const $isa: Isa = WIDE;
                $expression
            }
            FUSED => {
                const $isa: Isa = FUSED;
                $expression
            }
            #[cfg(not(feature = "quick"))]
            _ => {
                const $isa: Isa = PLAIN;
                $expression
            }
            #[cfg(feature = "quick")]
            _ => panic!("a core built with the feature `quick` needs a processor with AVX2 or Arm's vectors"),
        }
    };
}

/// Fits a tile with all threads, each with a fit that `make` makes; `fit_block` fits the pixels of a block.
#[inline]
fn fit_tile<F: FitBlock>(
    pixels: usize,
    layout: Layout,
    make: impl Fn() -> F + Sync + Send,
    fit_block: impl Fn(&mut F, usize, &mut [f32], &mut [u8]) + Sync + Send,
) -> Fitted {
    let width = layout.width();
    let used = layout.columns.into_iter().filter(|(_, width)| *width > 0);
    let mut maps: Vec<_> = used.map(|(name, width)| Map { name, width, values: vec![0.0; pixels * width] }).collect();
    let mut status = vec![0; pixels];
    let mut blocks: Vec<_> = status.chunks_mut(BLOCK).map(|status| (Vec::new(), status)).collect();
    for map in &mut maps {
        for (part, (parts, _)) in map.values.chunks_mut(BLOCK * map.width).zip(&mut blocks) {
            parts.push((map.width, part));
        }
    }
    let make = || (make(), vec![0.0; BLOCK * width]);
    on_all_threads(blocks.into_iter().enumerate(), make, |(fit, rows), (block, (parts, status))| {
        let rows = &mut rows[..status.len() * width];
        fit_block(fit, block * BLOCK, rows, status);
        let mut first = 0;
        for (columns, part) in parts {
            for (row, values) in rows.chunks(width).zip(part.chunks_mut(columns)) {
                values.copy_from_slice(&row[first..first + columns]);
            }
            first += columns;
        }
    });
    Fitted { maps, status }
}

fn plain_priors<M: Model<L>, const L: usize>() -> Vec<Option<(f64, f64)>> {
    let coordinates = M::SHAPE.iter().enumerate().map(|(i, parameter)| (M::coordinate(i), plain_coordinate(parameter)));
    coordinates.map(|(coordinate, plain)| (coordinate == plain).then_some(plain.prior)).collect()
}

macro_rules! dispatch {
    ($(($module:ident, $name:literal, $model:ty, $room:tt, $ambient:literal)),* $(,)?) => {
        $(
            /// One model. A module for each makes a unit of compilation for each, so that several are compiled at once: what is
            /// large is generic over the instructions and defined here, or inlined into what is.
            mod $module {
                use super::*;

                type This = $model;
                const P: usize = 2 + <This as Model<$room>>::SHAPE.len();
                type Joint<'a, const ISA: Isa> = JointFit<'a, This, ISA, MAX_CHANNELS, P, $room>;

                #[inline(never)]
                fn joint_block<const ISA: Isa>(
                    fit: &mut Joint<'_, ISA>,
                    first: usize,
                    rows: &mut [f32],
                    status: &mut [u8],
                ) {
                    outlined::<ISA, _>(
                        #[inline(always)]
                        || fit.fit_block(first, rows, status),
                    )
                }

                pub fn fit(stack: &Stack, colour: &[f64], options: Options) -> Fitted {
                    with_instructions!(ISA => {
                        let layout = Joint::<ISA>::layout(stack, &options);
                        let make = || Joint::<ISA>::new(stack, colour, options);
                        fit_tile(stack.pixels, layout, make, joint_block::<ISA>)
                    })
                }

                dispatch!(@paper $room);

                #[inline(never)]
                pub fn shade<const ISA: Isa>(scene: &Scene, first: usize, shading: &mut Shading<ISA>) {
                    outlined::<ISA, _>(
                        #[inline(always)]
                        || render::shade::<This, ISA, $room>(scene, first, shading),
                    )
                }

                pub fn basis_slopes(view: &slopes::View, optics: &Optics) -> Vec<f64> {
                    slopes::basis_slopes::<This, P, $room>(view, optics)
                }

                pub fn basis(normal: [f64; 3], shape: &[f64], at: &Illumination<f64>, optics: &Optics) -> Vec<f64> {
                    let basis = <This as Model<$room>>::basis(normal, shape, at, optics);
                    let mut values = vec![basis.diffuse];
                    values.extend(&basis.specular[..<This as Model<$room>>::LOBES]);
                    values
                }

                pub fn specular_scale(shape: &[f64]) -> Vec<f64> {
                    <This as Model<$room>>::specular_scale(shape)[..<This as Model<$room>>::LOBES].to_vec()
                }
            }
        )*

        /// Every model that has a name.
        pub fn entries() -> Vec<Entry> {
            vec![$(Entry {
                name: $name,
                title: <$model as Model<$room>>::title(),
                citations: <$model as Model<$room>>::citations(),
                shape: <$model as Model<$room>>::SHAPE,
                prior: plain_priors::<$model, $room>(),
                lobes: <$model as Model<$room>>::LOBES,
                ambient_by_default: $ambient,
                reciprocal: <$model as Model<$room>>::RECIPROCAL,
            }),*]
        }

        /// Fits a tile; `None` if no model has the name.
        pub fn fit(name: &str, stack: &Stack, colour: &[f64], options: Options) -> Option<Fitted> {
            match name {
                $($name => Some($module::fit(stack, colour, options)),)*
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
                $($name => $module::paper(stack, colour, sample, options),)*
                _ => None,
            }
        }

        /// The shader of a model, if one has the name.
        fn shader<const ISA: Isa>(name: &str) -> Option<Shader<ISA>> {
            match name {
                $($name => Some($module::shade::<ISA>),)*
                _ => None,
            }
        }

        /// The basis functions and their slopes; `None` if no model has the name.
        pub fn basis_slopes(name: &str, view: &slopes::View, optics: &Optics) -> Option<Vec<f64>> {
            match name {
                $($name => Some($module::basis_slopes(view, optics)),)*
                _ => None,
            }
        }

        /// Diffuse and specular basis values in f64, for golden values; `None` if no model has the name.
        pub fn basis(
            name: &str,
            normal: [f64; 3],
            shape: &[f64],
            at: &Illumination<f64>,
            optics: &Optics,
        ) -> Option<Vec<f64>> {
            match name {
                $($name => Some($module::basis(normal, shape, at, optics)),)*
                _ => None,
            }
        }

        /// The specular magnitude of each lobe of a shape where κ = 4; `None` if no model has the name.
        pub fn specular_scale(name: &str, shape: &[f64]) -> Option<Vec<f64>> {
            match name {
                $($name => Some($module::specular_scale(shape)),)*
                _ => None,
            }
        }
    };

    // The paper's procedure, which is defined for one lobe.
    (@paper 1) => {
        #[inline(never)]
        fn paper_block<const ISA: Isa>(
            fit: &mut PaperFit<'_, This, ISA, MAX_CHANNELS>,
            first: usize,
            rows: &mut [f32],
            status: &mut [u8],
        ) {
            outlined::<ISA, _>(
                #[inline(always)]
                || fit.fit_block(first, rows, status),
            )
        }

        pub fn paper(stack: &Stack, colour: &[f64], sample: Sample, options: Options) -> Option<Fitted> {
            with_instructions!(ISA => {
                // The compiler leaves out what this never reaches.
                if const { !PaperFit::<This, ISA, MAX_CHANNELS>::APPLIES } {
                    return None;
                }
                let make = || PaperFit::<This, ISA, MAX_CHANNELS>::new(stack, colour, sample, options);
                Some(fit_tile(stack.pixels, Layout::paper(stack.channels), make, paper_block::<ISA>))
            })
        }
    };
    (@paper $room:tt) => {
        pub fn paper(_: &Stack, _: &[f64], _: Sample, _: Options) -> Option<Fitted> {
            None
        }
    };
}
crate::for_each_model!(dispatch);

/// Renders a tile into `radiance`, (light, pixel, channel); `None` if no model has the name.
pub fn render(name: &str, scene: &Scene, residual: Option<&Residual>, radiance: &mut [f32]) -> Option<()> {
    with_instructions!(ISA => render::render(shader::<ISA>(name)?, scene, residual, radiance));
    Some(())
}

/// What a model leaves over of photographs, (pixel, light, channel); `None` if no model has the name.
pub fn left_over(name: &str, found: &LeftOver) -> Option<Vec<f32>> {
    with_instructions!(ISA => Some(found.samples::<ISA, MAX_CHANNELS>(shader(name)?)))
}

/// The same in codes, (pixel, component).
pub fn codes(name: &str, found: &LeftOver, encoder: &[f32]) -> Option<Vec<u16>> {
    with_instructions!(ISA => Some(found.codes::<ISA, MAX_CHANNELS>(shader(name)?, encoder)))
}
