//! The Torrance-Sparrow model with two lobes: Y = Ad max(0, n·l) + (As1 D1 + As2 D2) F G / (n·v).
//!
//! Both lobes are Trowbridge-Reitz facets under V-groove masking; they differ in c alone, the narrower one first. What one
//! lobe cannot have at once, a sharp peak and long tails, two have: a varnish over a rough ground, or facets of two sizes.

use super::microfacet::{Distribution, ECCENTRICITY, Masking, TrowbridgeReitz, VGroove};
use super::{Basis, FresnelAngle, MAX_SHAPE, Model, Optics, ShapeParameter, TorranceSparrow};
use crate::fresnel::fresnel;
use crate::geometry::{Illumination, chord_squared, facing};
use crate::number::{Number, Real, array};

pub struct TwoLobes;

/// Far below the distance between lights, where a lobe is its tails alone: one of two lobes may be that.
const NARROWEST: f64 = 0.001;

impl Model<2> for TwoLobes {
    type Seed = TorranceSparrow<TrowbridgeReitz, VGroove>;
    const SHAPE: &'static [ShapeParameter] = &[
        ShapeParameter {
            lower: NARROWEST,
            prior: (0.1, 1.2),
            meaning: "eccentricity of the narrower lobe's ellipsoids",
            ..ECCENTRICITY
        },
        ShapeParameter {
            name: "c2",
            lower: NARROWEST,
            prior: (0.4, 1.2),
            meaning: "eccentricity of the broader lobe's ellipsoids",
            ..ECCENTRICITY
        },
    ];
    const LOBES: usize = 2;
    const RECIPROCAL: bool = true;
    const STARTS: &'static [[f64; MAX_SHAPE]] = &[
        [0.01, 0.08, 0.0],
        [0.01, 0.25, 0.0],
        [0.025, 0.08, 0.0],
        [0.025, 0.25, 0.0],
        [0.025, 0.7, 0.0],
        [0.06, 0.15, 0.0],
        [0.06, 0.35, 0.0],
        [0.06, 0.8, 0.0],
        [0.12, 0.3, 0.0],
        [0.12, 0.7, 0.0],
        [0.22, 0.5, 0.0],
        [0.25, 0.95, 0.0],
        [0.25, 3.0, 0.0],
        [0.38, 0.8, 0.0],
        [0.4, 3.0, 0.0],
        [0.6, 0.95, 0.0],
    ];

    fn title() -> String {
        format!("Torrance-Sparrow with two lobes, {}, {}", TrowbridgeReitz::TITLE, VGroove::TITLE)
    }
    fn citations() -> Vec<&'static str> {
        vec!["TorranceSparrow1967", "Chen2007", TrowbridgeReitz::CITATION]
    }

    #[inline(always)]
    fn basis<N: Number>(normal: [N; 3], shape: &[N], at: &Illumination<N::Real>, optics: &Optics) -> Basis<N, 2> {
        let zero = N::splat(0.0);
        let (normal_light, normal_view, visible) = facing(normal, at);
        let chord = chord_squared(normal, at.half);
        let normal_half = chord.scale_add(N::Real::splat(-0.5), N::splat(1.0));
        let masked = VGroove::over_normal_view(shape[0], normal_light, normal_view, normal_half, at);
        let factor = match optics.fresnel {
            FresnelAngle::Facet => masked.scale(at.facet_reflectance),
            FresnelAngle::Element => masked * fresnel(normal_light, optics.index),
        };
        let specular = array!(|j| {
            let lobe = TrowbridgeReitz::evaluate(&shape[j..], chord) * factor;
            N::select(visible, lobe, zero)
        });
        Basis { diffuse: N::select(visible, normal_light, zero), specular }
    }

    #[inline(always)]
    fn specular_scale<N: Number>(shape: &[N]) -> [N; 2] {
        array!(|j| N::splat(1.0) / (shape[j] * shape[j]))
    }

    #[inline(always)]
    fn ordered<R: Real>(coordinates: [R; MAX_SHAPE]) -> [R; MAX_SHAPE] {
        let [first, second, rest] = coordinates;
        [first.min(second), first.max(second), rest]
    }
}
