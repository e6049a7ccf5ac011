//! Lambert's perfectly diffuse surface: Y = Ad max(0, n·l).

use super::{Basis, MAX_SHAPE, Model, Optics, ShapeParameter};
use crate::geometry::{Illumination, facing};
use crate::number::Number;

pub struct Lambert;

impl Model for Lambert {
    type Seed = Self;
    const SHAPE: &'static [ShapeParameter] = &[];
    const LOBES: usize = 0;
    const RECIPROCAL: bool = true;
    const STARTS: &'static [[f64; MAX_SHAPE]] = &[[0.0; MAX_SHAPE]];

    fn title() -> String {
        "Lambert".into()
    }
    fn citations() -> Vec<&'static str> {
        vec!["Lambert1760"]
    }

    #[inline(always)]
    fn basis<N: Number>(normal: [N; 3], _shape: &[N], at: &Illumination<N::Real>, _optics: &Optics) -> Basis<N> {
        let zero = N::splat(0.0);
        let (normal_light, _, visible) = facing(normal, at);
        Basis { diffuse: N::select(visible, normal_light, zero), specular: [zero] }
    }

    #[inline(always)]
    fn specular_scale<N: Number>(_shape: &[N]) -> [N; 1] {
        [N::splat(1.0)]
    }
}
