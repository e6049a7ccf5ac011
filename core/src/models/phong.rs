//! Phong's model (paper, Eq. 1): Y = Ae + Ad max(0, n·l) + As max(0, r·v)^shininess.
//!
//! r = 2 (n·l) n − l is the mirror direction. The lobe is neither reciprocal nor normalised: As is the height of the peak.

use super::{Basis, MAX_SHAPE, Model, Optics, ShapeParameter};
use crate::geometry::{Illumination, facing};
use crate::number::{Number, Real, array};

pub struct Phong;

impl Model for Phong {
    type Seed = Self;
    const SHAPE: &'static [ShapeParameter] = &[ShapeParameter {
        name: "shininess",
        lower: 0.001,
        upper: 20_000.0,
        prior: (40.0, 2.4),
        meaning: "exponent of cos of the angle from the mirror direction",
    }];
    const LOBES: usize = 1;
    const RECIPROCAL: bool = false;
    const STARTS: &'static [[f64; MAX_SHAPE]] = &[
        [0.05, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [4.0, 0.0, 0.0],
        [15.0, 0.0, 0.0],
        [60.0, 0.0, 0.0],
        [250.0, 0.0, 0.0],
        [1000.0, 0.0, 0.0],
        [4000.0, 0.0, 0.0],
    ];

    fn title() -> String {
        "Phong".into()
    }
    fn citations() -> Vec<&'static str> {
        vec!["Phong1975", "Chen2007"]
    }

    #[inline(always)]
    fn basis<N: Number>(normal: [N; 3], shape: &[N], at: &Illumination<N::Real>, _optics: &Optics) -> Basis<N> {
        let zero = N::splat(0.0);
        let (normal_light, _, visible) = facing(normal, at);
        // r·v = 1 − |r − v|²/2 keeps its digits near the peak, where a high exponent needs them.
        let twice = normal_light + normal_light;
        let difference: [N; 3] = array!(|i| twice.mul_add(normal[i], N::constant(-(at.light[i] + at.view[i]))));
        let half_chord = difference[0]
            .mul_add(difference[0], difference[1].mul_add(difference[1], difference[2] * difference[2]))
            .scale(N::Real::splat(0.5));
        let lit = visible & half_chord.value().lt(N::Real::splat(1.0));
        let cosine_minus_one = -N::select(lit, half_chord, zero);
        let lobe = (shape[0] * cosine_minus_one.ln_1p()).exp();
        Basis { diffuse: N::select(visible, normal_light, zero), specular: [N::select(lit, lobe, zero)] }
    }

    /// A lobe of exponent s takes in as much light as facets of c² = 1/(2 s) do: As = κ F(0) s / 2.
    #[inline(always)]
    fn specular_scale<N: Number>(shape: &[N]) -> [N; 1] {
        [shape[0].scale(N::Real::splat(0.08))]
    }
}
