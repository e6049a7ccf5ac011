//! The Python module `impasto._core`: arrays in, arrays out. Nothing else in the crate knows Python.

use crate::codec;
use crate::correct::{Correction, Grid, Stored};
use crate::dispatch::{self, Fitted, Map};
use crate::geometry::{Illumination, Place};
use crate::joint::Options;
use crate::models::{FresnelAngle, Optics};
use crate::observations::{Belief, Noise, Samples, Stack};
use crate::paper::Sample;
use crate::render::{Parameters, Scene};
use crate::residual::{Codes, LeftOver, Residual};
use crate::robust::Loss;
use crate::slopes;
use numpy::ndarray::Dimension;
use numpy::{
    Element, IntoPyArray, PyArrayMethods, PyReadonlyArray, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3,
    PyReadwriteArray1, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

fn invalid(message: impl Into<String>) -> PyErr {
    PyValueError::new_err(message.into())
}

/// The values of an array in C's order. `as_slice` of the crate `numpy` takes Fortran's order as well, without a word.
trait InOrder<T> {
    fn values(&self) -> PyResult<&[T]>;
}

impl<T: Element, D: Dimension> InOrder<T> for PyReadonlyArray<'_, T, D> {
    fn values(&self) -> PyResult<&[T]> {
        if !self.is_c_contiguous() {
            return Err(invalid(format!("an array of shape {:?} is not C-contiguous", self.shape())));
        }
        Ok(self.as_slice()?)
    }
}

/// A model's name taken apart: "phong-no-ambient" is ("phong", false).
fn parse_model(name: &str) -> PyResult<(&'static str, bool)> {
    for entry in dispatch::entries() {
        let suffix = if entry.ambient_by_default { "-no-ambient" } else { "-ambient" };
        if name == entry.name {
            return Ok((entry.name, entry.ambient_by_default));
        }
        if name.strip_suffix(suffix) == Some(entry.name) {
            return Ok((entry.name, !entry.ambient_by_default));
        }
    }
    Err(invalid(format!("no model is named {name:?}")))
}

fn parse_optics(index: f64, fresnel: &str) -> PyResult<Optics> {
    let fresnel = match fresnel {
        "facet" => FresnelAngle::Facet,
        "element" => FresnelAngle::Element,
        other => return Err(invalid(format!("fresnel is {other:?}, not \"facet\" or \"element\""))),
    };
    Ok(Optics { index, fresnel })
}

fn parse_loss(loss: &str, scale: f32) -> PyResult<Loss> {
    match loss {
        "linear" => Ok(Loss::Linear),
        "cauchy" => Ok(Loss::Cauchy(scale)),
        "huber" => Ok(Loss::Huber(scale)),
        other => Err(invalid(format!("loss is {other:?}, not \"linear\", \"cauchy\" or \"huber\""))),
    }
}

/// Rows of (direction, position); a position that is not NaN wins.
fn parse_places(direction: &PyReadonlyArray2<f64>, position_mm: &PyReadonlyArray2<f64>) -> PyResult<Vec<Place>> {
    let (direction, position_mm) = (direction.as_array(), position_mm.as_array());
    if direction.ncols() != 3 || position_mm.dim() != direction.dim() {
        return Err(invalid("light_direction and light_position_mm must both have shape (L, 3)"));
    }
    Ok(direction
        .rows()
        .into_iter()
        .zip(position_mm.rows())
        .map(
            |(d, p)| {
                if p[0].is_nan() { Place::Direction([d[0], d[1], d[2]]) } else { Place::Position([p[0], p[1], p[2]]) }
            },
        )
        .collect())
}

fn parse_camera(view_direction: [f64; 3], distance_mm: Option<f64>) -> Place {
    match distance_mm {
        Some(distance) => Place::Position(view_direction.map(|x| x * distance)),
        None => Place::Direction(view_direction),
    }
}

fn check(name: &str, got: usize, expected: usize) -> PyResult<()> {
    if got == expected { Ok(()) } else { Err(invalid(format!("{name} has {got} elements, expected {expected}"))) }
}

/// Samples as they are stored, of shape (L, N, C).
#[derive(FromPyObject)]
enum Photographs<'py> {
    #[pyo3(annotation = "uint16 array of shape (L, N, C)")]
    U16(PyReadonlyArray3<'py, u16>),
    #[pyo3(annotation = "float32 array of shape (L, N, C)")]
    F32(PyReadonlyArray3<'py, f32>),
}

impl Photographs<'_> {
    fn parse(&self) -> PyResult<(Samples<'_>, [usize; 3])> {
        let (samples, shape) = match self {
            Photographs::U16(array) => (Samples::U16(array.values()?), array.as_array().dim()),
            Photographs::F32(array) => (Samples::F32(array.values()?), array.as_array().dim()),
        };
        let (lights, pixels, channels) = shape;
        if !(1..=dispatch::MAX_CHANNELS).contains(&channels) {
            return Err(invalid(format!("radiance has {channels} channels, not 1 to {}", dispatch::MAX_CHANNELS)));
        }
        Ok((samples, [lights, pixels, channels]))
    }
}

/// The names, shape parameters and properties of all models.
#[pyfunction]
fn models(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    dispatch::entries()
        .into_iter()
        .map(|entry| {
            let shape = entry.shape.iter().zip(entry.prior);
            let shape: Vec<_> = shape.map(|(s, prior)| (s.name, s.lower, s.upper, s.meaning, prior)).collect();
            let dict = PyDict::new(py);
            dict.set_item("name", entry.name)?;
            dict.set_item("title", entry.title)?;
            dict.set_item("citations", entry.citations)?;
            dict.set_item("shape", shape)?;
            dict.set_item("lobes", entry.lobes)?;
            dict.set_item("ambient_by_default", entry.ambient_by_default)?;
            dict.set_item("reciprocal", entry.reciprocal)?;
            Ok(dict)
        })
        .collect()
}

/// The names of the instructions that this processor has, the best last.
#[pyfunction]
fn available_instructions() -> Vec<&'static str> {
    dispatch::available_instructions()
}

/// The name of those that the fit and the renderer run with.
#[pyfunction]
fn instructions() -> &'static str {
    dispatch::instruction_name(dispatch::instructions())
}

/// Fits a model to every pixel of a tile; see `impasto.fit`. `paper` is (threshold in radians, As of the sample, refined, direction of the sample's peak or None for each pixel's own)
/// for the paper's procedure; an As of NaN stops after its diffuse stage. `belief` is what is known of each pixel beforehand:
/// normal, shape, mean and deviation; see `observations::Belief`.
#[pyfunction]
#[pyo3(signature = (model, radiance, *, scale, offset, light_direction, light_position_mm, light_intensity,
    view_direction, camera_distance_mm, position_mm, light_rgb, clip_level, shadow_level, sample_mask, noise, index,
    fresnel, loss, loss_scale, max_steps, shadows=false, coloured=false, paper=None, normal=None, belief=None))]
#[allow(clippy::too_many_arguments)]
fn fit<'py>(
    py: Python<'py>,
    model: &str,
    radiance: Photographs<'py>,
    scale: f32,
    offset: f32,
    light_direction: PyReadonlyArray2<f64>,
    light_position_mm: PyReadonlyArray2<f64>,
    light_intensity: PyReadonlyArray2<f64>,
    view_direction: [f64; 3],
    camera_distance_mm: Option<f64>,
    position_mm: Option<PyReadonlyArray2<f32>>,
    light_rgb: Vec<f64>,
    clip_level: Vec<f64>,
    shadow_level: f32,
    sample_mask: Option<PyReadonlyArray2<u8>>,
    noise: (f32, f32, f32),
    index: f64,
    fresnel: &str,
    loss: &str,
    loss_scale: f32,
    max_steps: usize,
    shadows: bool,
    coloured: bool,
    paper: Option<(f64, f64, bool, Option<[f64; 3]>)>,
    normal: Option<PyReadonlyArray2<f32>>,
    belief: Option<[PyReadonlyArray2<f32>; 4]>,
) -> PyResult<Bound<'py, PyDict>> {
    let (name, ambient) = parse_model(model)?;
    let optics = parse_optics(index, fresnel)?;
    let loss = parse_loss(loss, loss_scale)?;
    let options = Options { optics, loss, max_steps, ambient, shadows, coloured };
    let (samples, [lights, pixels, channels]) = radiance.parse()?;
    let places = parse_places(&light_direction, &light_position_mm)?;
    check("light_direction", places.len(), lights)?;
    check("light_intensity", light_intensity.len(), lights * channels)?;
    check("light_rgb", light_rgb.len(), channels)?;
    check("clip_level", clip_level.len(), channels)?;
    let intensity = light_intensity.as_array().iter().map(|&x| x as f32).collect();
    if let Some(mask) = &sample_mask {
        check("sample_mask", mask.len(), lights * pixels)?;
    }
    if let Some(normal) = &normal {
        check("normal", normal.len(), 3 * pixels)?;
    }
    if let Some(belief) = &belief {
        let entry = dispatch::entries().into_iter().find(|entry| entry.name == name).expect("parsed from this list");
        let shapes = entry.shape.len();
        let widths = [3, shapes, shapes + entry.lobes, shapes + entry.lobes];
        for ((what, array), width) in ["normal", "shape", "mean", "deviation"].iter().zip(belief).zip(widths) {
            check(&format!("belief's {what}"), array.len(), width * pixels)?;
        }
    }
    let stack = Stack {
        samples,
        pixels,
        channels,
        scale,
        offset,
        lights: places,
        intensity,
        camera: parse_camera(view_direction, camera_distance_mm),
        position_mm: position_mm.as_ref().map(|array| array.values()).transpose()?,
        clip_level: clip_level.iter().map(|&x| x as f32).collect(),
        shadow_level,
        sample_mask: sample_mask.as_ref().map(|array| array.values()).transpose()?,
        noise: Noise { read: noise.0, photon: noise.1, relative: noise.2 },
        normal: normal.as_ref().map(|array| array.values()).transpose()?,
        belief: match &belief {
            None => None,
            Some([normal, shape, mean, deviation]) => Some(Belief {
                normal: normal.values()?,
                shape: shape.values()?,
                mean: mean.values()?,
                deviation: deviation.values()?,
            }),
        },
    };
    if stack.near() {
        let Some(position) = stack.position_mm else {
            return Err(invalid("a light or the camera is near: position_mm must say where the pixels are"));
        };
        check("position_mm", position.len(), 2 * pixels)?;
    }
    if pixels == 0 {
        return Err(invalid("radiance has no pixels"));
    }
    let fitted = py
        .detach(|| match paper {
            None => dispatch::fit(name, &stack, &light_rgb, options),
            Some((threshold, specular, refined, peak)) => {
                let sample = Sample { threshold, specular, refined, peak };
                dispatch::paper(name, &stack, &light_rgb, sample, options)
            }
        })
        .ok_or_else(|| invalid(format!("the paper's procedure is not defined for {model}")))?;
    into_dict(py, fitted)
}

/// The maps of a fit as one array each.
fn into_dict(py: Python<'_>, fitted: Fitted) -> PyResult<Bound<'_, PyDict>> {
    let pixels = fitted.status.len();
    let dict = PyDict::new(py);
    for Map { name, width, values } in fitted.maps {
        let values = values.into_pyarray(py);
        if matches!(name, "chi2_reduced" | "residual_rms" | "normal_sd" | "view_tilt") {
            dict.set_item(name, values)?;
        } else {
            dict.set_item(name, values.reshape([pixels, width])?)?;
        }
    }
    dict.set_item("status", fitted.status.into_pyarray(py))?;
    Ok(dict)
}

/// Fitted pixels under lights, a dict of what `impasto.pixels.scene` says.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct SceneItems<'py> {
    model: String,
    normal: PyReadonlyArray2<'py, f32>,
    diffuse: PyReadonlyArray2<'py, f32>,
    specular: PyReadonlyArray2<'py, f32>,
    shape: PyReadonlyArray2<'py, f32>,
    ambient: Option<PyReadonlyArray2<'py, f32>>,
    specular_rgb: Option<PyReadonlyArray2<'py, f32>>,
    view_tilt: Option<PyReadonlyArray1<'py, f32>>,
    light_direction: PyReadonlyArray2<'py, f64>,
    light_position_mm: PyReadonlyArray2<'py, f64>,
    light_intensity: PyReadonlyArray2<'py, f64>,
    view_direction: [f64; 3],
    camera_distance_mm: Option<f64>,
    position_mm: Option<PyReadonlyArray2<'py, f32>>,
    light_rgb: Vec<f64>,
    index: f64,
    fresnel: String,
}

impl SceneItems<'_> {
    fn parse(&self) -> PyResult<(&'static str, Scene<'_>)> {
        let (name, _) = parse_model(&self.model)?;
        let entry = dispatch::entries().into_iter().find(|entry| entry.name == name).expect("parsed from this list");
        let parameters = Parameters {
            pixels: self.normal.as_array().nrows(),
            normal: self.normal.values()?,
            diffuse: self.diffuse.values()?,
            specular: self.specular.values()?,
            shape: self.shape.values()?,
            ambient: self.ambient.as_ref().map_or(Ok(&[][..]), |array| array.values())?,
            specular_rgb: self.specular_rgb.as_ref().map_or(Ok(&[][..]), |array| array.values())?,
            view_tilt: self.view_tilt.as_ref().map_or(Ok(&[][..]), |array| array.values())?,
        };
        let scene = Scene {
            parameters,
            channels: self.light_rgb.len(),
            lights: parse_places(&self.light_direction, &self.light_position_mm)?,
            intensity: self.light_intensity.as_array().iter().map(|&x| x as f32).collect(),
            camera: parse_camera(self.view_direction, self.camera_distance_mm),
            colour: self.light_rgb.clone(),
            position_mm: self.position_mm.as_ref().map(|array| array.values()).transpose()?,
            optics: parse_optics(self.index, &self.fresnel)?,
        };
        let (pixels, channels) = (parameters.pixels, scene.channels);
        check("normal", parameters.normal.len(), 3 * pixels)?;
        check("diffuse", parameters.diffuse.len(), channels * pixels)?;
        check("specular", parameters.specular.len(), entry.lobes * pixels)?;
        check("shape", parameters.shape.len(), entry.shape.len() * pixels)?;
        if !parameters.ambient.is_empty() {
            check("ambient", parameters.ambient.len(), channels * pixels)?;
        }
        if !parameters.specular_rgb.is_empty() {
            check("specular_rgb", parameters.specular_rgb.len(), channels * pixels)?;
        }
        if !parameters.view_tilt.is_empty() {
            check("view_tilt", parameters.view_tilt.len(), pixels)?;
        }
        check("light_intensity", scene.intensity.len(), scene.lights.len() * channels)?;
        if scene.near() {
            check("position_mm", scene.position_mm.map_or(0, <[f32]>::len), 2 * pixels)?;
        }
        Ok((name, scene))
    }
}

/// A residual term under the lights of a scene; see `impasto.residual.ResidualTerm.under`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct ResidualItems<'py> {
    codes: CodeItems<'py>,
    table: Option<PyReadonlyArray1<'py, f32>>,
    basis: PyReadonlyArray3<'py, f32>,
    toe: f32,
}

#[derive(FromPyObject)]
enum CodeItems<'py> {
    #[pyo3(annotation = "uint16 array of shape (N, K)")]
    U16(PyReadonlyArray2<'py, u16>),
    #[pyo3(annotation = "uint8 array of shape (N, K)")]
    U8(PyReadonlyArray2<'py, u8>),
}

impl ResidualItems<'_> {
    fn parse(&self, scene: &Scene) -> PyResult<Residual<'_>> {
        let codes = match (&self.codes, &self.table) {
            (CodeItems::U16(codes), None) => Codes::U16(codes.values()?),
            (CodeItems::U8(codes), Some(table)) => {
                check("table", table.len(), 256)?;
                Codes::U8(codes.values()?, table.values()?)
            }
            _ => return Err(invalid("codes must be uint16, or uint8 with a table")),
        };
        let components = self.basis.shape()[2];
        let found = match codes {
            Codes::U16(codes) => codes.len(),
            Codes::U8(codes, _) => codes.len(),
        };
        check("codes", found, scene.parameters.pixels * components)?;
        check("basis", self.basis.len(), scene.intensity.len() * components)?;
        Ok(Residual { codes, components, basis: self.basis.values()?, toe: self.toe })
    }
}

/// Renders a tile under each light, with what the model leaves over where `residual` says it; see `impasto.render`.
#[pyfunction]
#[pyo3(signature = (scene, residual=None))]
fn render<'py>(
    py: Python<'py>,
    scene: SceneItems<'py>,
    residual: Option<ResidualItems<'py>>,
) -> PyResult<Bound<'py, PyAny>> {
    let (name, scene) = scene.parse()?;
    let residual = residual.as_ref().map(|residual| residual.parse(&scene)).transpose()?;
    let shape = [scene.lights.len(), scene.parameters.pixels, scene.channels];
    let mut radiance = vec![0.0; shape.iter().product()];
    if !radiance.is_empty() {
        py.detach(|| dispatch::render(name, &scene, residual.as_ref(), &mut radiance)).expect("parsed from the list");
    }
    Ok(radiance.into_pyarray(py).reshape(shape)?.into_any())
}

/// What a model leaves over of photographs, (N, L, C), or its codes by an encoder (K, L * C), (N, K); see
/// `impasto.fit.remainder`.
#[pyfunction]
#[pyo3(signature = (scene, radiance, *, scale, offset, clip_level, toe, encoder=None))]
#[allow(clippy::too_many_arguments)]
fn left_over<'py>(
    py: Python<'py>,
    scene: SceneItems<'py>,
    radiance: Photographs<'py>,
    scale: f32,
    offset: f32,
    clip_level: Vec<f64>,
    toe: f32,
    encoder: Option<PyReadonlyArray2<'py, f32>>,
) -> PyResult<Bound<'py, PyAny>> {
    let (name, scene) = scene.parse()?;
    let (samples, shape) = radiance.parse()?;
    let [lights, pixels, channels] = shape;
    if shape != [scene.lights.len(), scene.parameters.pixels, scene.channels] {
        return Err(invalid("radiance and the scene differ in lights, pixels or channels"));
    }
    check("clip_level", clip_level.len(), channels)?;
    let clip_level: Vec<f32> = clip_level.iter().map(|&x| x as f32).collect();
    let found = LeftOver { scene: &scene, samples, scale, offset, clip_level: &clip_level, toe };
    let Some(encoder) = encoder else {
        let rest = py.detach(|| dispatch::left_over(name, &found)).expect("parsed from the list");
        return Ok(rest.into_pyarray(py).reshape([pixels, lights, channels])?.into_any());
    };
    check("encoder", encoder.len(), encoder.shape()[0] * lights * channels)?;
    let components = encoder.shape()[0];
    let encoder = encoder.values()?;
    let codes = py.detach(|| dispatch::codes(name, &found, encoder)).expect("parsed from the list");
    Ok(codes.into_pyarray(py).reshape([pixels, components])?.into_any())
}

/// Basis values of a model in f64: one row (diffuse, lobe, …) for each row of directions and shapes.
#[pyfunction]
#[pyo3(signature = (model, normal, light, view, shape, *, index, fresnel))]
#[allow(clippy::too_many_arguments)]
fn basis<'py>(
    py: Python<'py>,
    model: &str,
    normal: PyReadonlyArray2<f64>,
    light: PyReadonlyArray2<f64>,
    view: PyReadonlyArray2<f64>,
    shape: PyReadonlyArray2<f64>,
    index: f64,
    fresnel: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let (name, _) = parse_model(model)?;
    let optics = parse_optics(index, fresnel)?;
    let rows = normal.as_array().nrows();
    for (argument, array) in [("normal", &normal), ("light", &light), ("view", &view)] {
        check(argument, array.len(), 3 * rows)?;
    }
    let vector = |rows: &PyReadonlyArray2<f64>, row: usize| std::array::from_fn(|i| rows.as_array()[[row, i]]);
    let mut values = Vec::new();
    for row in 0..rows {
        let at = Illumination::new(vector(&light, row), vector(&view, row), optics.index);
        let shape: Vec<f64> = shape.as_array().row(row).to_vec();
        values.extend(dispatch::basis(name, vector(&normal, row), &shape, &at, &optics).expect("parsed from the list"));
    }
    let width = values.len().checked_div(rows).unwrap_or(0);
    Ok(values.into_pyarray(py).reshape([rows, width])?.into_any())
}

/// The specular magnitudes of shapes, (pixel, shape parameter), that reflect four times what a smooth varnish does (κ = 4),
/// one for each lobe.
#[pyfunction]
fn specular_scale<'py>(py: Python<'py>, model: &str, shape: PyReadonlyArray2<f64>) -> PyResult<Bound<'py, PyAny>> {
    let (name, _) = parse_model(model)?;
    let entry = dispatch::entries().into_iter().find(|entry| entry.name == name).expect("parsed from this list");
    let shape = shape.as_array();
    check("shape", shape.ncols(), entry.shape.len())?;
    let mut values = Vec::with_capacity(shape.nrows() * entry.lobes);
    for row in shape.rows() {
        values.extend(dispatch::specular_scale(name, &row.to_vec()).expect("parsed from the list"));
    }
    Ok(values.into_pyarray(py).reshape([shape.nrows(), entry.lobes])?.into_any())
}

/// Basis functions of pixels under lights, with their slopes; see `impasto.fit.information`.
#[pyfunction]
#[pyo3(signature = (model, normal, shape, *, light_direction, light_position_mm, view_direction, camera_distance_mm,
    position_mm, index, fresnel))]
#[allow(clippy::too_many_arguments)]
fn basis_slopes<'py>(
    py: Python<'py>,
    model: &str,
    normal: PyReadonlyArray2<f64>,
    shape: PyReadonlyArray2<f64>,
    light_direction: PyReadonlyArray2<f64>,
    light_position_mm: PyReadonlyArray2<f64>,
    view_direction: [f64; 3],
    camera_distance_mm: Option<f64>,
    position_mm: Option<PyReadonlyArray2<f32>>,
    index: f64,
    fresnel: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let (name, _) = parse_model(model)?;
    let entry = dispatch::entries().into_iter().find(|entry| entry.name == name).expect("parsed from this list");
    let optics = parse_optics(index, fresnel)?;
    let lights = parse_places(&light_direction, &light_position_mm)?;
    let pixels = normal.as_array().nrows();
    check("normal", normal.len(), 3 * pixels)?;
    check("shape", shape.len(), entry.shape.len() * pixels)?;
    let camera = parse_camera(view_direction, camera_distance_mm);
    let position_mm = position_mm.as_ref().map(|array| array.values()).transpose()?;
    if camera.near() || lights.iter().any(Place::near) {
        check("position_mm", position_mm.map_or(0, <[f32]>::len), 2 * pixels)?;
    }
    let view = slopes::View { normal: normal.values()?, shape: shape.values()?, lights: &lights, camera, position_mm };
    let slopes = py.detach(|| dispatch::basis_slopes(name, &view, &optics)).expect("parsed from this list");
    let shape = [pixels, lights.len(), 1 + entry.lobes, 3 + entry.shape.len()];
    Ok(slopes.into_pyarray(py).reshape(shape)?.into_any())
}

/// Corrects a band of a photograph's codes; see `impasto.stack.corrections`. Returns the band and how many samples are
/// clipped: they are 65535, or infinite without `per_step`.
#[pyfunction]
#[pyo3(signature = (codes, *, row0, height, clip, table=None, dark=None, gain=None, per_step=None))]
#[allow(clippy::too_many_arguments)]
fn correct<'py>(
    py: Python<'py>,
    codes: PyReadonlyArray3<'py, u16>,
    row0: usize,
    height: usize,
    clip: u32,
    table: Option<PyReadonlyArray2<'py, f32>>,
    dark: Option<PyReadonlyArray3<'py, f32>>,
    gain: Option<PyReadonlyArray3<'py, f32>>,
    per_step: Option<f32>,
) -> PyResult<(Bound<'py, PyAny>, usize)> {
    let &[rows, width, channels] = codes.shape() else { unreachable!("three dimensions") };
    let table = table.as_ref().map(|table| Ok::<_, PyErr>((table.shape()[0], table.values()?))).transpose()?;
    if let Some((found, values)) = table {
        check("table", found, channels)?;
        if values.is_empty() {
            return Err(invalid("table is empty"));
        }
    }
    for (name, grid) in [("dark", &dark), ("gain", &gain)] {
        if let Some(grid) = grid {
            check(name, grid.shape()[2], channels)?;
            if grid.len() == 0 {
                return Err(invalid(format!("{name} is empty")));
            }
        }
    }
    let with = Correction {
        height,
        width,
        channels,
        table: table.map(|(_, values)| values),
        clip,
        dark: dark.as_ref().map(parse_grid).transpose()?,
        gain: gain.as_ref().map(parse_grid).transpose()?,
    };
    let codes = codes.values()?;
    fn run<T: Stored + Send + Sync>(
        py: Python<'_>,
        codes: &[u16],
        row0: usize,
        per_step: f32,
        with: &Correction,
        zero: T,
    ) -> (Vec<T>, usize) {
        py.detach(|| {
            let mut out = vec![zero; codes.len()];
            let clipped = crate::correct::correct(codes, row0, per_step, with, &mut out);
            (out, clipped)
        })
    }
    let shape = [rows, width, channels];
    Ok(match per_step {
        Some(per_step) => {
            let (out, clipped) = run(py, codes, row0, per_step, &with, 0u16);
            (out.into_pyarray(py).reshape(shape)?.into_any(), clipped)
        }
        None => {
            let (out, clipped) = run(py, codes, row0, 1.0, &with, 0f32);
            (out.into_pyarray(py).reshape(shape)?.into_any(), clipped)
        }
    })
}

fn parse_grid<'a>(grid: &'a PyReadonlyArray3<'_, f32>) -> PyResult<Grid<'a>> {
    Ok(Grid { values: grid.values()?, rows: grid.shape()[0], columns: grid.shape()[1] })
}

/// Compresses bytes by zstd, with a checksum; see `impasto.store.codecs`.
#[pyfunction]
fn zstd_encode<'py>(py: Python<'py>, data: PyReadonlyArray1<'py, u8>, level: i32) -> PyResult<Bound<'py, PyAny>> {
    let data = data.values()?;
    let frame = py.detach(|| codec::compress(data, level))?;
    Ok(frame.into_pyarray(py).into_any())
}

/// Decompresses a frame of zstd into `out`.
#[pyfunction]
fn zstd_decode(py: Python<'_>, frame: &[u8], mut out: PyReadwriteArray1<'_, u8>) -> PyResult<()> {
    let out = out.as_slice_mut()?;
    py.detach(|| codec::decompress(frame, out)).map_err(|error| invalid(error.to_string()))
}

/// Length of what a frame of zstd holds.
#[pyfunction]
fn zstd_length(frame: &[u8]) -> PyResult<usize> {
    codec::length(frame).map_err(|error| invalid(error.to_string()))
}

#[pymodule]
mod _core {
    #[pymodule_export]
    use super::{
        available_instructions, basis, basis_slopes, correct, fit, instructions, left_over, models, render,
        specular_scale, zstd_decode, zstd_encode, zstd_length,
    };
}
