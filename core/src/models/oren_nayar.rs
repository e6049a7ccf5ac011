//! Oren and Nayar's rough diffuse surface, in the qualitative form ([OrenNayar1994], Eq. 30): V-grooves of Lambertian facets.
//!
//! Y = Ad n·l [A + B max(0, cos(φl − φv)) sin α tan β], α the larger and β the smaller of the angles of light and view to the
//! normal, A = 1 − σ² / (2 (σ² + 0.33)), B = 0.45 σ² / (σ² + 0.09). As vectors, sin α tan β cos(φl − φv) =
//! (l·v − (n·l)(n·v)) / max(n·l, n·v). It is flatter than Lambert's, and brighter where the light stands behind the camera.

use super::{Basis, MAX_SHAPE, Model, Optics, ShapeParameter};
use crate::geometry::{Illumination, dot, facing};
use crate::number::Number;

pub struct OrenNayar;

impl Model for OrenNayar {
    type Seed = Self;
    const SHAPE: &'static [ShapeParameter] = &[ShapeParameter {
        name: "sigma",
        lower: 0.02,
        upper: 1.5,
        prior: (0.3, 1.0),
        meaning: "standard deviation of the facets' slope angle in radians; 0 is Lambert",
    }];
    const LOBES: usize = 0;
    const RECIPROCAL: bool = true;
    const STARTS: &'static [[f64; MAX_SHAPE]] = &[[0.4, 0.0, 0.0]];

    fn title() -> String {
        "Oren-Nayar, rough diffuse".into()
    }
    fn citations() -> Vec<&'static str> {
        vec!["OrenNayar1994"]
    }

    #[inline(always)]
    fn basis<N: Number>(normal: [N; 3], shape: &[N], at: &Illumination<N::Real>, _optics: &Optics) -> Basis<N> {
        let zero = N::splat(0.0);
        let (normal_light, normal_view, visible) = facing(normal, at);
        let sigma_squared = shape[0] * shape[0];
        let flat = N::splat(1.0) - sigma_squared / (sigma_squared + sigma_squared + N::splat(0.66));
        let backward = N::splat(0.45) * sigma_squared / (sigma_squared + N::splat(0.09));
        let together = N::constant(dot(at.light, at.view)) - normal_light * normal_view;
        let diffuse = normal_light * (flat + backward * together.max(zero) / normal_light.max(normal_view));
        Basis { diffuse: N::select(visible, diffuse, zero), specular: [zero] }
    }

    #[inline(always)]
    fn specular_scale<N: Number>(_shape: &[N]) -> [N; 1] {
        [N::splat(1.0)]
    }
}
