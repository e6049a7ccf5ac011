//! The Torrance-Sparrow model (paper, Eq. 2): Y = Ad max(0, n·l) + As D F G / (n·v).
//!
//! F is not normalised: with c = α, As = κ / (4 c²) makes the lobe that of a smooth GGX interface times κ.

use super::microfacet::{Distribution, Masking};
use super::{Basis, Coordinate, FresnelAngle, MAX_SHAPE, Model, Optics, ShapeParameter};
use crate::fresnel::fresnel;
use crate::geometry::{Illumination, chord_squared, facing};
use crate::number::Number;
use std::marker::PhantomData;

pub struct TorranceSparrow<D, G>(PhantomData<(D, G)>);

impl<D: Distribution, G: Masking> Model for TorranceSparrow<D, G> {
    type Seed = Self;
    const SHAPE: &'static [ShapeParameter] = D::SHAPE;
    const LOBES: usize = 1;
    const RECIPROCAL: bool = true;
    const STARTS: &'static [[f64; MAX_SHAPE]] = D::STARTS;

    fn title() -> String {
        format!("Torrance-Sparrow, {}, {}", D::TITLE, G::TITLE)
    }
    fn citations() -> Vec<&'static str> {
        vec!["TorranceSparrow1967", "Chen2007", D::CITATION, G::CITATION]
    }

    #[inline(always)]
    fn basis<N: Number>(normal: [N; 3], shape: &[N], at: &Illumination<N::Real>, optics: &Optics) -> Basis<N> {
        let zero = N::splat(0.0);
        let (normal_light, normal_view, visible) = facing(normal, at);
        let chord = chord_squared(normal, at.half);
        let normal_half = chord.scale_add(N::Real::splat(-0.5), N::splat(1.0));
        let masked = G::over_normal_view(shape[0], normal_light, normal_view, normal_half, at);
        let lobe = D::evaluate(shape, chord) * masked;
        let lobe = match optics.fresnel {
            FresnelAngle::Facet => lobe.scale(at.facet_reflectance),
            FresnelAngle::Element => lobe * fresnel(normal_light, optics.index),
        };
        Basis { diffuse: N::select(visible, normal_light, zero), specular: [N::select(visible, lobe, zero)] }
    }

    /// As = κ / (4 c²); facets of Gaussian width m take in what those of c = m do.
    #[inline(always)]
    fn specular_scale<N: Number>(shape: &[N]) -> [N; 1] {
        [N::splat(1.0) / (shape[0] * shape[0])]
    }

    #[inline(always)]
    fn shape<N: Number>(coordinates: [N; MAX_SHAPE]) -> [N; MAX_SHAPE] {
        D::shape(coordinates)
    }
    fn coordinates(shape: &[f64; MAX_SHAPE]) -> [f64; MAX_SHAPE] {
        D::coordinates(shape)
    }
    #[inline(always)]
    fn coordinate(index: usize) -> Coordinate {
        D::coordinate(index)
    }
}
