//! Directions of light and view at a pixel (paper, Fig. 2; docs/notation.md).

use crate::fresnel::fresnel;
use crate::number::{Number, Real, array};

/// a · b, where b has no derivatives.
#[inline(always)]
pub fn dot<N: Number>(a: [N; 3], b: [N::Real; 3]) -> N {
    a[2].scale_add(b[2], a[1].scale_add(b[1], a[0].scale(b[0])))
}

/// |a − b|² of two unit vectors: 2 (1 − cos) of the angle between them, without cancellation where they nearly agree.
#[inline(always)]
pub fn chord_squared<N: Number>(a: [N; 3], b: [N::Real; 3]) -> N {
    let d: [N; 3] = array!(|i| a[i] - N::constant(b[i]));
    d[2].square_add(d[1].square_add(d[0].squared()))
}

#[inline(always)]
pub fn normalise<R: Real>(a: [R; 3]) -> [R; 3] {
    let scale = R::splat(1.0) / dot(a, a).sqrt();
    array!(|i| a[i] * scale)
}

/// What a reflectance model needs to know of one light, seen from one pixel.
///
/// Held per pixel because a light or a camera at a finite distance is seen in another direction from each; for distant
/// ones all pixels share one instance.
#[derive(Clone, Copy, Debug)]
pub struct Illumination<R> {
    /// Unit vector towards the light.
    pub light: [R; 3],
    /// Unit vector towards the camera.
    pub view: [R; 3],
    /// Half vector h = (l + v) / |l + v|.
    pub half: [R; 3],
    /// 1 / (l · h) = 1 / (v · h), of the cosine of the facet's angle of incidence.
    pub per_light_half: R,
    /// F at that angle: the same in every step of a fit.
    pub facet_reflectance: R,
}

impl<R: Real> Illumination<R> {
    /// `index` is that of refraction.
    #[inline(always)]
    pub fn new(light: [R; 3], view: [R; 3], index: f64) -> Self {
        let sum: [R; 3] = array!(|i| light[i] + view[i]);
        let squared = dot(sum, sum);
        let inverse = R::splat(1.0) / squared.sqrt();
        // l · h = |l + v| / 2.
        let light_half = squared * inverse * R::splat(0.5);
        Illumination {
            light,
            view,
            half: array!(|i| sum[i] * inverse),
            per_light_half: inverse + inverse,
            facet_reflectance: fresnel(light_half, index),
        }
    }
}

/// n · l and n · v, and where both are positive: elsewhere the element is not lit or not seen.
#[inline(always)]
pub fn facing<N: Number>(normal: [N; 3], at: &Illumination<N::Real>) -> (N, N, <N::Real as Real>::Mask) {
    let normal_light = dot(normal, at.light);
    let normal_view = dot(normal, at.view);
    let visible = normal_light.value().positive() & normal_view.value().positive();
    (normal_light, normal_view, visible)
}

/// Where a light or a camera stands, in the painting's frame.
#[derive(Clone, Copy, Debug)]
pub enum Place {
    /// Infinitely far away, in the direction of this unit vector.
    Direction([f64; 3]),
    /// At this position in mm.
    Position([f64; 3]),
}

impl Place {
    /// The unit vector from a point (x, y, 0) of the painting, and the squared ratio of the place's distance from the
    /// origin to that from the point: the inverse-square law relative to the centre of the painting.
    #[inline(always)]
    pub fn seen_from<R: Real>(&self, x_mm: R, y_mm: R) -> ([R; 3], R) {
        match *self {
            Place::Direction(direction) => (array!(|i| R::splat(direction[i])), R::splat(1.0)),
            Place::Position(p) => {
                let offset = [R::splat(p[0]) - x_mm, R::splat(p[1]) - y_mm, R::splat(p[2])];
                let squared = dot(offset, offset);
                let inverse = R::splat(1.0) / squared.sqrt();
                let reference = R::splat(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
                (array!(|i| offset[i] * inverse), reference / squared)
            }
        }
    }

    pub fn near(&self) -> bool {
        matches!(self, Place::Position(_))
    }
}

/// The unit vector across the plane in which all lights lie, seen from the centre of the painting; `None` where they do not
/// lie in one, or on a line, or where a distant camera lies in it too: then no sample changes to first order with a tilt out
/// of the plane, a narrow lobe tilted out of it is a broad one in it, and normals may as well stay there.
pub fn across(lights: &[Place], camera: &Place) -> Option<[f64; 3]> {
    /// The sine of 1°: an arm that is set up by hand sweeps a plane no better.
    const FLAT: f64 = 0.0175;
    let directions: Vec<[f64; 3]> = lights.iter().map(|place| place.seen_from(0.0, 0.0).0).collect();
    let crosses = directions.iter().map(|direction| cross(directions[0], *direction));
    let widest = crosses.max_by(|a, b| dot(*a, *a).total_cmp(&dot(*b, *b)))?;
    if dot(widest, widest) < FLAT * FLAT {
        return None;
    }
    let across = normalise(widest);
    let in_plane = |direction: [f64; 3]| dot(direction, across).abs() < FLAT;
    let told = camera.near() || !in_plane(camera.seen_from(0.0, 0.0).0);
    (told && directions.into_iter().all(in_plane)).then_some(across)
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Two unit vectors that span the plane perpendicular to `normal`, whose z must be positive ([Duff2017]; their other
/// branch is for z < 0).
#[inline(always)]
pub fn tangents<R: Real>(normal: [R; 3]) -> ([R; 3], [R; 3]) {
    let [x, y, z] = normal;
    let one = R::splat(1.0);
    let a = -one / (one + z);
    let b = x * y * a;
    ([one + x * x * a, b, -x], [b, one + y * y * a, -y])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_arm_meets_the_papers_trigonometric_forms() {
        // cos θi = n·l = cos φn cos(θa − θn) for a light in the XZ plane.
        let (theta_a, theta_n, phi_n) = (0.7f64, -0.2f64, 0.3f64);
        let light = [theta_a.sin(), 0.0, theta_a.cos()];
        let normal = [phi_n.cos() * theta_n.sin(), phi_n.sin(), phi_n.cos() * theta_n.cos()];
        assert!((dot(normal, light) - phi_n.cos() * (theta_a - theta_n).cos()).abs() < 1e-12);
        // The mirror direction's tilt: sin φr = sin 2φn cos(θa − θn).
        let reflected: [f64; 3] = array!(|i| 2.0 * dot(normal, light) * normal[i] - light[i]);
        assert!((reflected[1] - (2.0 * phi_n).sin() * (theta_a - theta_n).cos()).abs() < 1e-12);
    }

    #[test]
    fn tilts_out_of_a_plane_are_tried_for_the_lights_of_an_arm_seen_from_aside() {
        let arm = [-0.6f64, 0.1, 0.9].map(|angle| Place::Direction([angle.sin(), 0.0, angle.cos()]));
        let camera = Place::Direction([0.0, 0.1, 0.995]);
        assert_eq!(across(&arm, &camera).map(|axis| axis[1].abs()), Some(1.0));
        let raised = Place::Position([0.0, 300.0, 1000.0]);
        assert_eq!(across(&[&arm[..], &[raised]].concat(), &camera), None);
        assert_eq!(across(&arm[..1], &camera), None);
        assert_eq!(across(&arm, &Place::Direction([0.2, 0.0, 0.98])), None);
        assert!(across(&arm, &Place::Position([0.0, 0.0, 900.0])).is_some());
    }

    #[test]
    fn tangents_are_orthonormal() {
        let normal = normalise([0.3f64, -0.6, 0.2]);
        let (a, b) = tangents(normal);
        for (left, right, want) in [(a, b, 0.0), (a, normal, 0.0), (b, normal, 0.0), (a, a, 1.0), (b, b, 1.0)] {
            assert!((dot(left, right) - want).abs() < 1e-12);
        }
    }

    #[test]
    fn a_near_light_falls_off_with_the_inverse_square() {
        let place = Place::Position([0.0, 0.0, 1000.0]);
        let (direction, falloff) = place.seen_from(1000.0, 0.0);
        assert!((falloff - 0.5).abs() < 1e-12);
        assert!((direction[0] + 0.5f64.sqrt()).abs() < 1e-12);
    }
}
