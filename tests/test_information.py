"""Slopes of radiance, and the uncertainties that follow, against differences and fits of noisy data."""

import numpy as np
import pytest

from impasto.fit import fit_tile
from impasto.fit.information import fisher_information, in_grey, parameter_names, radiance_slopes
from impasto.geometry import Camera, Lights, dome_direction, tilt_direction
from impasto.models import MODELS
from impasto.pixels import pixels_of_maps, render_pixels

NOISE = (1e-4, 0.0, 0.005)
# What shape parameters are drawn from that are not widths like c.
RANGES = {"shininess": (0.2, 20_000.0), "exponent": (0.1, 300.0), "m": (0.004, 2.0)}


def dome(count=40):
    z = 0.97 - 0.7 * (np.arange(count) + 0.5) / count
    return Lights(tuple(map(str, range(count))), dome_direction(np.arccos(z), 2.39996 * np.arange(count)))


def some_pixels(model, count, seed=0, c=(0.1, 0.4), specular=(0.5, 8.0)):
    """Return pixels of a model with random parameters, in one colour each."""
    rng = np.random.default_rng(seed)
    spec = MODELS[model]
    maps = {
        "normal": tilt_direction(*np.radians(6.0) * rng.standard_normal((2, count))),
        "diffuse": rng.uniform(0.1, 0.6, (count, 3)),
        "specular": rng.uniform(*specular, (count, spec.lobes)),
        "ambient": rng.uniform(0.01, 0.05, (count, 3)),
    }
    for parameter in spec.shape:
        if parameter.lower < 0:
            maps[parameter.name] = rng.uniform(parameter.lower, parameter.upper, count)
            continue
        low, high = RANGES.get(parameter.name, c)
        maps[parameter.name] = np.exp(rng.uniform(np.log(low), np.log(high), count))
    attributes = {
        "model": model,
        "light_rgb": [1.1, 1.0, 0.9],
        "index_of_refraction": 1.5,
        "fresnel": "facet",
    }
    maps = {name: np.asarray(values, np.float32) for name, values in maps.items()}
    return pixels_of_maps(attributes, (1, count), np.zeros(count, int), np.arange(count), maps)


def moved(pixels, parameter, step):
    """Return pixels with one parameter changed as `parameter_names` counts them."""
    from dataclasses import replace

    names = parameter_names(pixels)
    name = names[parameter]
    if name.startswith("tilt"):
        n = pixels.normal.astype(np.float64)
        x, y, z = n.T
        a = -1 / (1 + z)
        tangents = np.array([[1 + x * x * a, x * y * a, -x], [x * y * a, 1 + y * y * a, -y]])
        turned = n + step * tangents[parameter].T
        return replace(pixels, normal=turned / np.linalg.norm(turned, axis=1, keepdims=True))
    for kind in ("specular", "diffuse", "ambient"):
        if name.startswith(kind):
            values = getattr(pixels, kind).astype(np.float64).copy()
            values[:, parameter - names.index(next(n for n in names if n.startswith(kind)))] *= np.exp(step)
            return replace(pixels, **{kind: values})
    shape = pixels.shape.astype(np.float64).copy()
    if pixels.model.shape[parameter - 2].lower < 0:
        shape[:, parameter - 2] += step
    else:
        shape[:, parameter - 2] *= np.exp(step)
    return replace(pixels, shape=shape)


@pytest.mark.parametrize("model", [*MODELS])
def test_slopes_are_those_of_the_radiance(model):
    pixels, lights, camera = some_pixels(model, 24), dome(12), Camera()
    radiance, slopes = radiance_slopes(pixels, lights, camera)
    rendered = np.swapaxes(render_pixels(pixels, lights, camera), 0, 1)
    assert radiance == pytest.approx(rendered, rel=2e-4, abs=1e-5)
    step = 1e-5
    for parameter in range(slopes.shape[-1]):
        above = radiance_slopes(moved(pixels, parameter, step), lights, camera)[0]
        below = radiance_slopes(moved(pixels, parameter, -step), lights, camera)[0]
        difference = (above - below) / (2 * step)
        # The masking term has kinks, at which a difference is no slope.
        near = np.isclose(difference, slopes[..., parameter], rtol=1e-4, atol=1e-6)
        assert near.mean() > 0.99, parameter_names(pixels)[parameter]


def test_near_lights_fall_off():
    from dataclasses import replace

    pixels = some_pixels("torrance-sparrow", 8)
    camera = Camera(np.array([0.0, 0.0, 1.0]), 800.0, 2.0)
    lights = replace(dome(6), position_mm=300.0 * dome(6).direction)
    radiance, _ = radiance_slopes(pixels, lights, camera)
    rendered = np.swapaxes(render_pixels(pixels, lights, camera), 0, 1)
    assert radiance == pytest.approx(rendered, rel=2e-4, abs=1e-5)


def test_luminance_is_that_of_the_colours():
    pixels, lights = some_pixels("phong", 8), dome(6)
    grey, _ = radiance_slopes(in_grey(pixels), lights, Camera())
    colours, _ = radiance_slopes(pixels, lights, Camera())
    assert grey[..., 0] == pytest.approx(colours @ [0.2126, 0.7152, 0.0722], rel=1e-5)


def test_expected_uncertainties_are_those_of_fits_to_noisy_photographs():
    """Where the highlight is seen, within 15 % of the spread of 400 fits to photographs with fresh noise."""
    kinds, draws = 12, 400
    pixels, lights, camera = some_pixels("torrance-sparrow", kinds), dome(), Camera()
    information = fisher_information(pixels, lights, camera, NOISE, np.full(3, np.inf))
    expected = np.sqrt(np.diagonal(np.linalg.inv(information), axis1=1, axis2=2))
    clean = np.repeat(render_pixels(pixels, lights, camera), draws, axis=1).astype(np.float64)
    rng = np.random.default_rng(7)
    noisy = clean + rng.standard_normal(clean.shape) * np.hypot(NOISE[0], NOISE[2] * clean)
    maps = fit_tile(
        MODELS["torrance-sparrow"],
        noisy.astype(np.float32),
        lights=lights,
        camera=camera,
        light_rgb=pixels.light_rgb,
        clip_level=np.full(3, np.inf),
        noise=NOISE,
    )
    names = parameter_names(pixels)
    normal = maps["normal"].reshape(kinds, draws, 3).astype(np.float64)
    found = {
        "tilt": np.hypot(*np.moveaxis(normal - normal.mean(axis=1, keepdims=True), -1, 0)[:2]),
        "c": np.log(maps["c"]).reshape(kinds, draws),
        "specular": np.log(maps["specular"]).reshape(kinds, draws),
        "diffuse_1": np.log(maps["diffuse"][:, 1]).reshape(kinds, draws),
    }
    for name, values in found.items():
        if name == "tilt":
            spread = np.sqrt((values**2).mean(axis=1))
            predicted = np.hypot(expected[:, 0], expected[:, 1])
        else:
            spread, predicted = values.std(axis=1), expected[:, names.index(name)]
        assert predicted == pytest.approx(spread, rel=0.15), name
