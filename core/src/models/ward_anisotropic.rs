//! Ward's model of surfaces whose slopes differ by direction, such as brush strokes and fabrics ([Ward1992], Eq. 5a):
//! Y = Ad max(0, n·l) + As √(n·l / n·v) exp(−q), q = tan² δ (cos² φ / αx² + sin² φ / αy²) for facets at angle δ and azimuth φ.
//!
//! Ward's axes are known; those of a brush stroke are not, so here the slopes along x and y may go together, with
//! correlation ρ ([Heitz2014], section 5.4): q = [(u/αx)² − 2 ρ (u/αx) (v/αy) + (v/αy)²] / (1 − ρ²), u and v the facet's slopes. The
//! axes are the painting's X and Y, turned with the normal by the shortest way. At ρ = 0 this is Ward's own form.

use super::{Basis, MAX_SHAPE, Model, Optics, ShapeParameter};
use crate::geometry::{Illumination, chord_squared, facing};
use crate::number::{Number, array};

pub struct WardAnisotropic;

const SLOPE: ShapeParameter = ShapeParameter {
    name: "alpha_x",
    lower: 0.004,
    upper: 1.5,
    prior: (0.2, 1.2),
    meaning: "root mean square slope of the facets along x, small is glossy",
};

impl Model for WardAnisotropic {
    type Seed = Self;
    const SHAPE: &'static [ShapeParameter] = &[
        SLOPE,
        ShapeParameter {
            name: "alpha_y",
            meaning: "root mean square slope of the facets along y, small is glossy",
            ..SLOPE
        },
        ShapeParameter {
            name: "correlation",
            lower: -0.98,
            upper: 0.98,
            prior: (0.0, 0.5),
            meaning: "of the slopes along x and y: positive where strokes run from lower right to upper left",
        },
    ];
    const LOBES: usize = 1;
    const RECIPROCAL: bool = true;
    const STARTS: &'static [[f64; MAX_SHAPE]] = &[
        [0.03, 0.03, 0.0],
        [0.06, 0.06, 0.0],
        [0.12, 0.12, 0.0],
        [0.06, 0.24, 0.0],
        [0.24, 0.06, 0.0],
        [0.15, 0.15, 0.75],
        [0.15, 0.15, -0.75],
        [0.22, 0.22, 0.0],
        [0.38, 0.38, 0.0],
        [0.7, 0.7, 0.0],
    ];

    fn title() -> String {
        "Ward, anisotropic".into()
    }
    fn citations() -> Vec<&'static str> {
        vec!["Ward1992", "Heitz2014"]
    }

    #[inline(always)]
    fn basis<N: Number>(normal: [N; 3], shape: &[N], at: &Illumination<N::Real>, _optics: &Optics) -> Basis<N> {
        let (zero, one) = (N::splat(0.0), N::splat(1.0));
        let (normal_light, normal_view, visible) = facing(normal, at);
        // The half vector's components along the axes, from h − n, which keeps its digits near the peak: the axis of X is
        // (1, 0, 0) − n_x (n_x, n_y, 1 + n_z) / (1 + n_z), and n · (h − n) = −|h − n|²/2.
        let chord = chord_squared(normal, at.half);
        let offset: [N; 3] = array!(|i| N::constant(at.half[i]) - normal[i]);
        let common = chord.scale_add(N::Real::splat(-0.5), offset[2]) / (one + normal[2]);
        let normal_half = chord.scale_add(N::Real::splat(-0.5), one);
        let [alpha_x, alpha_y, correlation] = [shape[0], shape[1], shape[2]];
        let u = (offset[0] - normal[0] * common) / (normal_half * alpha_x);
        let v = (offset[1] - normal[1] * common) / (normal_half * alpha_y);
        let both = u * v;
        let slope = (u * u + v * v - correlation * (both + both)) / (one - correlation * correlation);
        let lobe = (-slope).exp() * (normal_light / normal_view).sqrt();
        Basis { diffuse: N::select(visible, normal_light, zero), specular: [N::select(visible, lobe, zero)] }
    }

    #[inline(always)]
    fn specular_scale<N: Number>(shape: &[N]) -> [N; 1] {
        let correlation = shape[2];
        [N::splat(1.0) / (shape[0] * shape[1] * (N::splat(1.0) - correlation * correlation).sqrt())]
    }
}
