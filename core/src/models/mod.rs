//! Reflectance models: one file each, and one line in [`for_each_model!`].
//!
//! Relative radiance of channel k is Y_k = Ad_k · diffuse + s_k Σ_j As_j · specular_j + Ae_k, with s the colour of the
//! light. The basis functions `diffuse` and `specular_j` depend on the normal, the shape parameters and the directions of
//! light and view; a model is these functions. The magnitudes Ad, As and Ae are linear and no business of the model.

#[cfg(test)]
mod golden_tests;
mod lambert;
pub mod microfacet;
mod oren_nayar;
mod phong;
mod torrance_sparrow;
mod two_lobes;
mod ward;
mod ward_anisotropic;

pub use lambert::Lambert;
pub use oren_nayar::OrenNayar;
pub use phong::Phong;
pub use torrance_sparrow::TorranceSparrow;
pub use two_lobes::TwoLobes;
pub use ward::Ward;
pub use ward_anisotropic::WardAnisotropic;

use crate::geometry::Illumination;
use crate::number::{Number, Real};

/// The largest number of shape parameters of any model.
pub const MAX_SHAPE: usize = 3;
/// The largest number of shapes of one lobe that a fit starts from.
pub const MAX_STARTS: usize = 11;

/// The basis functions of a model at one light, with room for L lobes.
#[derive(Clone, Copy, Debug)]
pub struct Basis<N, const L: usize = 1> {
    pub diffuse: N,
    pub specular: [N; L],
}

/// The angle at which Fresnel's equations are taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FresnelAngle {
    /// The facet's own, between light and half vector: the physical one.
    Facet,
    /// The surface element's, between light and normal: the paper's words taken literally.
    Element,
}

/// Constants of the material and the choice among readings of the paper.
#[derive(Clone, Copy, Debug)]
pub struct Optics {
    /// Index of refraction of the dielectric.
    pub index: f64,
    pub fresnel: FresnelAngle,
}

/// A nonlinear parameter besides the normal. Those whose lower bound is positive are fitted in their logarithm.
#[derive(Clone, Copy, Debug)]
pub struct ShapeParameter {
    pub name: &'static str,
    pub lower: f64,
    pub upper: f64,
    /// Where the parameter is taken to be as long as the photographs do not tell: its median, and the standard deviation of
    /// its logarithm, or of itself where it is not fitted in its logarithm.
    pub prior: (f64, f64),
    pub meaning: &'static str,
}

impl ShapeParameter {
    pub const fn logarithmic(&self) -> bool {
        self.lower > 0.0
    }
}

/// A number that the fit moves to change the shape: its range, and mean and standard deviation of its weak prior.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coordinate {
    pub lower: f64,
    pub upper: f64,
    pub prior: (f64, f64),
}

/// A reflectance model whose arrays have room for L lobes: 1 also for one that has none.
pub trait Model<const L: usize = 1> {
    /// Keys of docs/references.md.
    fn citations() -> Vec<&'static str>;
    fn title() -> String;
    /// The model of one lobe whose highlight shows where the normal is: itself, where it has one or none.
    type Seed: Model;
    const SHAPE: &'static [ShapeParameter];
    const LOBES: usize;
    /// Whether f(l, v) = f(v, l) holds for the specular basis divided by n · l.
    const RECIPROCAL: bool;
    /// Shapes from which the fit may start, one row per start.
    const STARTS: &'static [[f64; MAX_SHAPE]];

    fn basis<N: Number>(normal: [N; 3], shape: &[N], at: &Illumination<N::Real>, optics: &Optics) -> Basis<N, L>;

    /// The specular magnitude of each lobe that reflects four times what a smooth varnish does (κ = 4): the standard
    /// deviation of the magnitude's prior. A metal's can be six times that.
    fn specular_scale<N: Number>(shape: &[N]) -> [N; L];

    /// The shape that has these coordinates, of which there are as many as shape parameters.
    #[inline(always)]
    fn shape<N: Number>(coordinates: [N; MAX_SHAPE]) -> [N; MAX_SHAPE] {
        plain_shape(Self::SHAPE, coordinates)
    }

    /// The coordinates of a shape.
    fn coordinates(shape: &[f64; MAX_SHAPE]) -> [f64; MAX_SHAPE] {
        plain_coordinates(Self::SHAPE, shape)
    }

    /// Range and prior of a coordinate.
    #[inline(always)]
    fn coordinate(index: usize) -> Coordinate {
        plain_coordinate(&Self::SHAPE[index])
    }

    /// Of all coordinates that describe the same reflectance, because lobes may change places, those to be written.
    #[inline(always)]
    fn ordered<R: Real>(coordinates: [R; MAX_SHAPE]) -> [R; MAX_SHAPE] {
        coordinates
    }
}

#[inline(always)]
fn plain_shape<N: Number>(parameters: &[ShapeParameter], mut coordinates: [N; MAX_SHAPE]) -> [N; MAX_SHAPE] {
    for (value, parameter) in coordinates.iter_mut().zip(parameters) {
        if parameter.logarithmic() {
            *value = value.exp();
        }
    }
    coordinates
}

fn plain_coordinates(parameters: &[ShapeParameter], shape: &[f64; MAX_SHAPE]) -> [f64; MAX_SHAPE] {
    let mut coordinates = *shape;
    for (value, parameter) in coordinates.iter_mut().zip(parameters) {
        if parameter.logarithmic() {
            *value = value.ln();
        }
    }
    coordinates
}

/// The coordinate of a parameter that is fitted in its logarithm, or as it is.
#[inline(always)]
pub fn plain_coordinate(parameter: &ShapeParameter) -> Coordinate {
    let ShapeParameter { lower, upper, prior: (median, deviation), .. } = *parameter;
    if parameter.logarithmic() {
        Coordinate { lower: lower.ln(), upper: upper.ln(), prior: (median.ln(), deviation) }
    } else {
        Coordinate { lower, upper, prior: (median, deviation) }
    }
}

/// Calls `$callback! { (module, name, type, room, ambient) … }` with every model that has a name: the list that the fit, the
/// renderer, Python's choices, the help and the tests are made from. `room` is for how many lobes its arrays have room.
/// `ambient` says whether the plain name includes the term Ae, as Phong's does (Eq. 1); the other form is reached by a suffix.
#[macro_export]
macro_rules! for_each_model {
    ($callback:ident) => {
        $callback! {
            (lambert, "lambert", $crate::models::Lambert, 1, false),
            (oren_nayar, "oren-nayar", $crate::models::OrenNayar, 1, false),
            (phong, "phong", $crate::models::Phong, 1, true),
            (torrance_sparrow, "torrance-sparrow", $crate::models::TorranceSparrow<$crate::models::microfacet::TrowbridgeReitz, $crate::models::microfacet::VGroove>, 1, false),
            (torrance_sparrow_gaussian, "torrance-sparrow-gaussian", $crate::models::TorranceSparrow<$crate::models::microfacet::Gaussian, $crate::models::microfacet::VGroove>, 1, false),
            (torrance_sparrow_smith, "torrance-sparrow-smith", $crate::models::TorranceSparrow<$crate::models::microfacet::TrowbridgeReitz, $crate::models::microfacet::Smith>, 1, false),
            (torrance_sparrow_2, "torrance-sparrow-2", $crate::models::TwoLobes, 2, false),
            (gtr, "gtr", $crate::models::TorranceSparrow<$crate::models::microfacet::GeneralisedTrowbridgeReitz, $crate::models::microfacet::VGroove>, 1, false),
            (ward, "ward", $crate::models::Ward, 1, false),
            (ward_anisotropic, "ward-anisotropic", $crate::models::WardAnisotropic, 1, false),
        }
    };
}
