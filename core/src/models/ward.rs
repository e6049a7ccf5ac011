//! Ward's isotropic model ([Ward1992], Eq. 4): Y = Ad max(0, n·l) + As √(n·l / n·v) exp(−tan² δ / α²), δ the facet's angle.
//!
//! With α the root mean square slope of the facets, As = ρs / (4 α²).

use super::{Basis, MAX_SHAPE, Model, Optics, ShapeParameter};
use crate::geometry::{Illumination, chord_squared, facing};
use crate::number::Number;

pub struct Ward;

impl Model for Ward {
    type Seed = Self;
    const SHAPE: &'static [ShapeParameter] = &[ShapeParameter {
        name: "alpha",
        lower: 0.004,
        upper: 1.5,
        prior: (0.2, 1.2),
        meaning: "root mean square slope of the facets, small is glossy",
    }];
    const LOBES: usize = 1;
    const RECIPROCAL: bool = true;
    const STARTS: &'static [[f64; MAX_SHAPE]] = &[
        [0.03, 0.0, 0.0],
        [0.06, 0.0, 0.0],
        [0.12, 0.0, 0.0],
        [0.22, 0.0, 0.0],
        [0.38, 0.0, 0.0],
        [0.6, 0.0, 0.0],
        [0.9, 0.0, 0.0],
    ];

    fn title() -> String {
        "Ward, isotropic".into()
    }
    fn citations() -> Vec<&'static str> {
        vec!["Ward1992"]
    }

    #[inline(always)]
    fn basis<N: Number>(normal: [N; 3], shape: &[N], at: &Illumination<N::Real>, _optics: &Optics) -> Basis<N> {
        let zero = N::splat(0.0);
        let (normal_light, normal_view, visible) = facing(normal, at);
        let chord = chord_squared(normal, at.half);
        let normal_half = chord.scale_add(N::Real::splat(-0.5), N::splat(1.0));
        // tan² = sin² / cos², with sin² from the chord, which keeps its digits near the peak.
        let sine_squared = chord * chord.scale_add(N::Real::splat(-0.25), N::splat(1.0));
        let slope = sine_squared / (normal_half * normal_half * shape[0] * shape[0]);
        let lobe = (-slope).exp() * (normal_light / normal_view).sqrt();
        Basis { diffuse: N::select(visible, normal_light, zero), specular: [N::select(visible, lobe, zero)] }
    }

    #[inline(always)]
    fn specular_scale<N: Number>(shape: &[N]) -> [N; 1] {
        [N::splat(1.0) / (shape[0] * shape[0])]
    }
}
