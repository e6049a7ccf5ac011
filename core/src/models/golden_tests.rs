//! Every model against the golden values that Python and the viewer's shader are held to as well, and its derivatives
//! against differences.

use super::{FresnelAngle, MAX_SHAPE, Model, Optics};
use crate::dual::Dual;
use crate::geometry::{Illumination, normalise};
use crate::lanes::{LANES, Lane, PLAIN};
use crate::number::Number;
use serde_json::Value;

const FILES: [&str; 3] = [
    include_str!("../../../tests/golden/hand.json"),
    include_str!("../../../tests/golden/lobes.json"),
    include_str!("../../../tests/golden/mitsuba.json"),
];

struct Case {
    normal: [f64; 3],
    light: [f64; 3],
    view: [f64; 3],
    shape: [f64; MAX_SHAPE],
    optics: Optics,
    diffuse: f64,
    specular: Vec<f64>,
}

fn vector(value: &Value) -> [f64; 3] {
    std::array::from_fn(|i| value[i].as_f64().unwrap())
}

fn cases(name: &str) -> Vec<Case> {
    let files = FILES.map(|text| serde_json::from_str::<Value>(text).unwrap());
    let all = files.iter().flat_map(|file| file["cases"].as_array().unwrap());
    all.filter(|case| case["model"] == name)
        .map(|case| Case {
            normal: vector(&case["normal"]),
            light: vector(&case["light"]),
            view: vector(&case["view"]),
            shape: std::array::from_fn(|i| case["shape"].get(i).map_or(1.0, |value| value.as_f64().unwrap())),
            optics: Optics {
                index: case["index"].as_f64().unwrap(),
                fresnel: if case["fresnel"] == "element" { FresnelAngle::Element } else { FresnelAngle::Facet },
            },
            diffuse: case["diffuse_basis"].as_f64().unwrap(),
            specular: match &case["specular_basis"] {
                Value::Array(lobes) => lobes.iter().map(|lobe| lobe.as_f64().unwrap()).collect(),
                lobe => vec![lobe.as_f64().unwrap()],
            },
        })
        .collect()
}

fn assert_close(got: f64, want: f64, tolerance: f64, what: &str) {
    assert!((got - want).abs() <= tolerance * want.abs().max(1e-6), "{what}: {got}, want {want}");
}

fn check_lobes(got: &[f64], want: &[f64], tolerance: f64, what: &str) {
    assert_eq!(got.len(), want.len(), "{what}");
    for (got, want) in got.iter().zip(want) {
        assert_close(*got, *want, tolerance, what);
    }
}

fn check_values<M: Model<L>, const L: usize>(name: &str) {
    let cases = cases(name);
    assert!(cases.len() >= 10, "{name} has {} golden cases", cases.len());
    for case in cases {
        let shape = &case.shape[..M::SHAPE.len()];
        let at = Illumination::new(case.light, case.view, case.optics.index);
        let exact = M::basis(case.normal, shape, &at, &case.optics);
        assert_close(exact.diffuse, case.diffuse, 1e-5, name);
        check_lobes(&exact.specular, &case.specular, 1e-5, name);

        let lanes = |vector: [f64; 3]| vector.map(Lane::<PLAIN>::splat);
        let at = Illumination::new(lanes(case.light), lanes(case.view), case.optics.index);
        let shape: Vec<_> = shape.iter().map(|&value| Lane::splat(value)).collect();
        let single = M::basis(lanes(case.normal), &shape, &at, &case.optics);
        // Directions rounded to f32 move a lobe of width c by 1e-7 / c of it; an exponent of Phong multiplies them likewise.
        assert_close(f64::from(single.diffuse.0[LANES - 1]), case.diffuse, 1e-5, name);
        check_lobes(&single.specular.map(|lobe| f64::from(lobe.0[LANES - 1])), &case.specular, 2e-4, name);
    }
}

/// Derivatives by each component of the normal and by each coordinate of the shape, where neither a kink of G nor
/// the edge of what is lit lies within the difference.
fn check_derivatives<M: Model<L>, const L: usize>(name: &str) {
    let optics = Optics { index: 1.5, fresnel: FresnelAngle::Element };
    let at = Illumination::new(normalise([0.4, 0.1, 0.9]), normalise([-0.2, 0.15, 1.0]), optics.index);
    let normal = normalise([0.12, 0.03, 1.0]);
    let count = M::SHAPE.len();
    let coordinates: [f64; MAX_SHAPE] =
        std::array::from_fn(|i| if i < count { M::coordinate(i).prior.0 + 0.1 } else { 0.0 });
    let evaluate = |normal: [f64; 3], coordinates: [f64; MAX_SHAPE]| {
        let basis = M::basis(normal, &M::shape(coordinates)[..count], &at, &optics);
        [&[basis.diffuse][..], &basis.specular].concat()
    };
    let step = 1e-6;
    for p in 0..3 + count {
        let dual_normal = std::array::from_fn(|i| Dual::<f64, 1>::parameter(normal[i], 0, f64::from(i == p)));
        let dual_coordinates =
            std::array::from_fn(|i| Dual::<f64, 1>::parameter(coordinates[i], 0, f64::from(i + 3 == p)));
        let basis = M::basis(dual_normal, &M::shape(dual_coordinates)[..count], &at, &optics);
        let moved = |sign: f64| {
            let normal = std::array::from_fn(|i| normal[i] + if i == p { sign * step } else { 0.0 });
            let coordinates = std::array::from_fn(|i| coordinates[i] + if i + 3 == p { sign * step } else { 0.0 });
            evaluate(normal, coordinates)
        };
        let (ahead, behind) = (moved(1.0), moved(-1.0));
        let duals = [&[basis.diffuse][..], &basis.specular].concat();
        for (i, dual) in duals.iter().enumerate() {
            let difference = (ahead[i] - behind[i]) / (2.0 * step);
            assert!(
                (dual.derivative[0] - difference).abs() < 1e-6 * (1.0 + difference.abs()),
                "{name}, parameter {p}: {}, by differences {difference}",
                dual.derivative[0]
            );
        }
    }
}

/// The coordinates of a shape are those of the shape that they have.
fn check_coordinates<M: Model<L>, const L: usize>(name: &str) {
    for start in M::STARTS {
        let again = M::shape(M::coordinates(start));
        for (got, want) in again.iter().zip(start).take(M::SHAPE.len()) {
            assert_close(*got, *want, 1e-12, name);
        }
        for (i, value) in M::coordinates(start).iter().enumerate().take(M::SHAPE.len()) {
            let range = M::coordinate(i);
            assert!(range.lower < *value && *value < range.upper, "{name} starts beyond its range");
        }
    }
}

macro_rules! check {
    ($(($module:ident, $name:literal, $model:ty, $room:literal, $ambient:literal)),* $(,)?) => {
        #[test]
        fn all_models_meet_the_golden_values() {
            $(check_values::<$model, $room>($name);)*
        }

        #[test]
        fn all_models_have_the_derivatives_of_their_values() {
            $(check_derivatives::<$model, $room>($name);)*
        }

        #[test]
        fn all_models_have_the_shape_of_their_coordinates() {
            $(check_coordinates::<$model, $room>($name);)*
        }
    };
}
crate::for_each_model!(check);
