//! Factors of a microfacet lobe: D, the distribution of facet slopes, and G, shadowing and masking.

use super::{Coordinate, MAX_SHAPE, ShapeParameter, plain_coordinate, plain_coordinates, plain_shape};
use crate::geometry::Illumination;
use crate::number::Number;

/// D, with D = 1 where the facet's normal is the surface's.
pub trait Distribution {
    /// The first is the width of the lobe.
    const SHAPE: &'static [ShapeParameter];
    const TITLE: &'static str;
    const CITATION: &'static str;
    const STARTS: &'static [[f64; MAX_SHAPE]];
    /// `chord_squared` is |n − h|² = 2 (1 − n·h).
    fn evaluate<N: Number>(shape: &[N], chord_squared: N) -> N;

    // As the model's.
    #[inline(always)]
    fn shape<N: Number>(coordinates: [N; MAX_SHAPE]) -> [N; MAX_SHAPE] {
        plain_shape(Self::SHAPE, coordinates)
    }
    fn coordinates(shape: &[f64; MAX_SHAPE]) -> [f64; MAX_SHAPE] {
        plain_coordinates(Self::SHAPE, shape)
    }
    #[inline(always)]
    fn coordinate(index: usize) -> Coordinate {
        plain_coordinate(&Self::SHAPE[index])
    }
}

/// [TrowbridgeReitz1975], [Chen2007] Eq. 3: D = [c² / ((n·h)² (c² − 1) + 1)]².
///
/// c is the eccentricity of the ellipsoids, alpha in the form known as GGX: D = π α² D_GGX.
pub struct TrowbridgeReitz;

/// Above 1 the ellipsoids are prolate: facets lean, and the lobe grows towards grazing angles. A paint's highlight has none
/// of that, but light that returns from within some matte materials has.
pub const ECCENTRICITY: ShapeParameter = ShapeParameter {
    name: "c",
    lower: 0.004,
    upper: 30.0,
    prior: (0.15, 1.2),
    meaning: "eccentricity of the facets' ellipsoids, small is glossy",
};

/// sin² of the angle whose chord is given: the printed form of D, with cos² near 1, loses 2.4e-3 in f32 at c = 0.01, the
/// one with sin² 4e-6.
#[inline(always)]
fn sine_squared<N: Number>(chord_squared: N) -> N {
    chord_squared * chord_squared.scale_add(N::Real::splat(-0.25), N::splat(1.0))
}

impl Distribution for TrowbridgeReitz {
    const SHAPE: &'static [ShapeParameter] = &[ECCENTRICITY];
    const TITLE: &'static str = "Trowbridge-Reitz facets";
    const CITATION: &'static str = "TrowbridgeReitz1975";
    // Up to 0.9: with a grid that ends at 0.5 a fifth of the fits of c in 0.5 … 0.9 fail.
    const STARTS: &'static [[f64; MAX_SHAPE]] = &[
        [0.03, 0.0, 0.0],
        [0.06, 0.0, 0.0],
        [0.12, 0.0, 0.0],
        [0.22, 0.0, 0.0],
        [0.38, 0.0, 0.0],
        [0.55, 0.0, 0.0],
        [0.72, 0.0, 0.0],
        [0.92, 0.0, 0.0],
    ];

    #[inline(always)]
    fn evaluate<N: Number>(shape: &[N], chord_squared: N) -> N {
        // The denominator is c² + (1 − c²) sin².
        let c_squared = shape[0] * shape[0];
        let denominator = sine_squared(chord_squared).mul_add(N::splat(1.0) - c_squared, c_squared);
        (c_squared / denominator).squared()
    }
}

/// Trowbridge-Reitz with a free exponent ([Burley2012]): D = [c² / ((n·h)² (c² − 1) + 1)]^exponent; 2 is Trowbridge-Reitz
/// itself, a smaller one has longer tails.
pub struct GeneralisedTrowbridgeReitz;

impl Distribution for GeneralisedTrowbridgeReitz {
    const SHAPE: &'static [ShapeParameter] = &[
        ECCENTRICITY,
        ShapeParameter {
            name: "exponent",
            lower: 0.1,
            upper: 1000.0,
            prior: (2.0, 0.7),
            meaning: "of the facets' distribution: 2 is Trowbridge-Reitz, less has longer tails, many is a Gaussian",
        },
    ];
    const TITLE: &'static str = "generalised Trowbridge-Reitz facets";
    const CITATION: &'static str = "Burley2012";
    const STARTS: &'static [[f64; MAX_SHAPE]] = &[
        [0.08, 0.35, 0.0],
        [0.02, 0.9, 0.0],
        [0.06, 0.9, 0.0],
        [0.2, 0.9, 0.0],
        [0.03, 2.0, 0.0],
        [0.09, 2.0, 0.0],
        [0.25, 2.0, 0.0],
        [0.5, 2.5, 0.0],
        [0.9, 3.0, 0.0],
        // Nearly Gaussian.
        [0.8, 12.0, 0.0],
        [0.98, 150.0, 0.0],
    ];

    #[inline(always)]
    fn evaluate<N: Number>(shape: &[N], chord_squared: N) -> N {
        let c_squared = shape[0] * shape[0];
        // 1 + x is the ratio of the denominator to c².
        let x = sine_squared(chord_squared) * (N::splat(1.0) - c_squared) / c_squared;
        (-(shape[1] * x.ln_1p())).exp()
    }

    // Near the peak D is 1 − κ sin², κ = k (1 − c²) / c² for the exponent k, and as k grows D becomes exp(−κ sin²): data tell κ
    // and k, while c and k share a long curved valley. κ lies above −β, β = 20 k / (20 + k): the lobe may grow towards grazing
    // angles, but no faster than e²⁰. The coordinates are ln(κ + β) and ln k.
    #[inline(always)]
    fn shape<N: Number>(coordinates: [N; MAX_SHAPE]) -> [N; MAX_SHAPE] {
        let mut shape = coordinates;
        let exponent = coordinates[1].exp();
        // 1 / c² = 1 + κ / k.
        let raised = exponent / (exponent + N::splat(STEEPEST_GROWTH));
        shape[0] = N::splat(1.0) / (coordinates[0].exp() / exponent + raised).sqrt();
        shape[1] = exponent;
        shape
    }

    fn coordinates(shape: &[f64; MAX_SHAPE]) -> [f64; MAX_SHAPE] {
        let [c, exponent, rest] = *shape;
        let raised = exponent / (exponent + STEEPEST_GROWTH);
        [(exponent * (1.0 / (c * c) - raised)).ln(), exponent.ln(), rest]
    }

    #[inline(always)]
    fn coordinate(index: usize) -> Coordinate {
        if index == 0 {
            // c² of the prior's median is 0.0225, its exponent 2; κ goes with 1 / c².
            Coordinate { lower: -3.0, upper: 14.0, prior: (4.48, 2.4) }
        } else {
            plain_coordinate(&Self::SHAPE[index])
        }
    }
}

const STEEPEST_GROWTH: f64 = 20.0;

/// [TorranceSparrow1967], [Blinn1977]: D = exp(−(δ/m)²) with δ = acos(n·h) the facet's angle.
pub struct Gaussian;

impl Distribution for Gaussian {
    const SHAPE: &'static [ShapeParameter] = &[ShapeParameter {
        name: "m",
        lower: 0.004,
        upper: 2.0,
        prior: (0.2, 1.2),
        meaning: "width of the distribution of facet angles in radians",
    }];
    const TITLE: &'static str = "Gaussian facets";
    const CITATION: &'static str = "TorranceSparrow1967";
    const STARTS: &'static [[f64; MAX_SHAPE]] = &[
        [0.03, 0.0, 0.0],
        [0.06, 0.0, 0.0],
        [0.12, 0.0, 0.0],
        [0.22, 0.0, 0.0],
        [0.38, 0.0, 0.0],
        [0.65, 0.0, 0.0],
        [1.1, 0.0, 0.0],
    ];

    #[inline(always)]
    fn evaluate<N: Number>(shape: &[N], chord_squared: N) -> N {
        (-(facet_angle_squared(chord_squared) / (shape[0] * shape[0]))).exp()
    }
}

/// δ² = 4 asin²(√x), x = q/4, from q = |n − h|², smooth at 0 where acos has no derivative.
///
/// The series asin²(√x) = ½ Σ (4x)^k / (k² C(2k, k)), economised by Chebyshev polynomials to degree 8 on x ≤ ½
/// (δ ≤ 90°): 6e-9 relative.
#[inline(always)]
fn facet_angle_squared<N: Number>(chord_squared: N) -> N {
    const SERIES: [f64; 9] = [
        1.00000000563,
        0.333331563364,
        0.177868763769,
        0.112501547467,
        0.0985616054666,
        -0.0306323304015,
        0.327472653687,
        -0.4184865884,
        0.372402458434,
    ];
    let x = chord_squared.scale(N::Real::splat(0.25));
    let mut sum = N::splat(SERIES[8]);
    for i in (0..8).rev() {
        sum = sum.mul_add(x, N::splat(SERIES[i]));
    }
    sum * chord_squared
}

/// G.
pub trait Masking {
    const TITLE: &'static str;
    const CITATION: &'static str;
    /// G / (n·v); only called where n·l and n·v are positive. `normal_half` is n·h, `shape` the distribution's.
    fn over_normal_view<N: Number>(
        shape: N,
        normal_light: N,
        normal_view: N,
        normal_half: N,
        at: &Illumination<N::Real>,
    ) -> N;
}

/// Symmetric V-grooves ([TorranceSparrow1967], [Blinn1977]): G = min(1, 2 (n·h)(n·v)/(v·h), 2 (n·h)(n·l)/(v·h)).
pub struct VGroove;

impl Masking for VGroove {
    const TITLE: &'static str = "V-groove masking";
    const CITATION: &'static str = "TorranceSparrow1967";

    #[inline(always)]
    fn over_normal_view<N: Number>(
        _shape: N,
        normal_light: N,
        normal_view: N,
        normal_half: N,
        at: &Illumination<N::Real>,
    ) -> N {
        let twice = (normal_half + normal_half).scale(at.per_light_half);
        (twice * normal_light.min(normal_view)).min(N::splat(1.0)) / normal_view
    }
}

/// Smith's masking for Trowbridge-Reitz facets, correlated by height ([Heitz2014], Eq. 99; [Walter2007]).
///
/// G = 2 (n·l)(n·v) / [(n·v) √(α² + (1 − α²)(n·l)²) + (n·l) √(α² + (1 − α²)(n·v)²)], α = c.
pub struct Smith;

impl Masking for Smith {
    const TITLE: &'static str = "Smith masking";
    const CITATION: &'static str = "Heitz2014";

    #[inline(always)]
    fn over_normal_view<N: Number>(
        alpha: N,
        normal_light: N,
        normal_view: N,
        _normal_half: N,
        _at: &Illumination<N::Real>,
    ) -> N {
        let alpha_squared = alpha * alpha;
        let rest = N::splat(1.0) - alpha_squared;
        let light_root = (rest * normal_light).mul_add(normal_light, alpha_squared).sqrt();
        let view_root = (rest * normal_view).mul_add(normal_view, alpha_squared).sqrt();
        (normal_light + normal_light) / normal_view.mul_add(light_root, normal_light * view_root)
    }
}
