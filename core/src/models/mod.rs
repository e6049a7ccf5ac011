//! Reflectance models: one file each, and one line in [`for_each_model!`].
//!
//! Relative radiance of channel k is Y_k = Ad_k · diffuse + s_k Σ_j As_j · specular_j + Ae_k, with s the colour of the
//! light. The basis functions `diffuse` and `specular_j` depend on the normal, the shape parameters and the directions of
//! light and view; a model is these functions. The magnitudes Ad, As and Ae are linear and no business of the model.

#[cfg(test)]
mod golden_tests;
mod lambert;
pub mod microfacet;
mod phong;
mod torrance_sparrow;
mod ward;

pub use lambert::Lambert;
pub use phong::Phong;
pub use torrance_sparrow::TorranceSparrow;
pub use ward::Ward;

use crate::geometry::Illumination;
use crate::number::Number;

/// The largest number of specular lobes and of shape parameters of any model.
pub const MAX_LOBES: usize = 1;
pub const MAX_SHAPE: usize = 3;
/// The largest number of shapes that a fit starts from.
pub const MAX_STARTS: usize = 10;

/// The basis functions of a model at one light.
#[derive(Clone, Copy, Debug)]
pub struct Basis<N> {
    pub diffuse: N,
    pub specular: [N; MAX_LOBES],
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

/// A nonlinear parameter besides the normal. All are positive and fitted in their logarithm.
#[derive(Clone, Copy, Debug)]
pub struct ShapeParameter {
    pub name: &'static str,
    pub lower: f64,
    pub upper: f64,
    /// Where the parameter is taken to be as long as the photographs do not tell: median and standard deviation of its
    /// logarithm.
    pub prior: (f64, f64),
    pub meaning: &'static str,
}

pub trait Model {
    /// Keys of docs/references.md.
    fn citations() -> Vec<&'static str>;
    fn title() -> String;
    const SHAPE: &'static [ShapeParameter];
    const LOBES: usize;
    /// Whether f(l, v) = f(v, l) holds for the specular basis divided by n · l.
    const RECIPROCAL: bool;
    /// Shapes from which the fit may start, one row per start.
    const STARTS: &'static [[f64; MAX_SHAPE]];

    fn basis<N: Number>(normal: [N; 3], shape: &[N], at: &Illumination<N::Real>, optics: &Optics) -> Basis<N>;

    /// The specular magnitude of a lobe that reflects four times what a smooth varnish does (κ = 4): the standard deviation
    /// of the magnitude's prior. A metal's can be six times that.
    fn specular_scale<N: Number>(shape: &[N]) -> N;
}

/// Calls `$callback! { (name, type, ambient) … }` with every model that has a name: the list that the fit, the renderer,
/// Python's choices, the help and the tests are made from. `ambient` says whether the plain name includes the term Ae, as
/// Phong's does (Eq. 1); the other form is reached by a suffix.
#[macro_export]
macro_rules! for_each_model {
    ($callback:ident) => {
        $callback! {
            ("lambert", $crate::models::Lambert, false),
            ("phong", $crate::models::Phong, true),
            ("torrance-sparrow", $crate::models::TorranceSparrow<$crate::models::microfacet::TrowbridgeReitz, $crate::models::microfacet::VGroove>, false),
            ("torrance-sparrow-gaussian", $crate::models::TorranceSparrow<$crate::models::microfacet::Gaussian, $crate::models::microfacet::VGroove>, false),
            ("torrance-sparrow-smith", $crate::models::TorranceSparrow<$crate::models::microfacet::TrowbridgeReitz, $crate::models::microfacet::Smith>, false),
            ("gtr", $crate::models::TorranceSparrow<$crate::models::microfacet::GeneralisedTrowbridgeReitz, $crate::models::microfacet::VGroove>, false),
            ("ward", $crate::models::Ward, false),
        }
    };
}
