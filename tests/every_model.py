"""A store with a fit of every model, its maps drawn at random; half with coloured highlights and residual."""

import numpy as np

import impasto
from impasto.capture.simulate import simulate
from impasto.fit.light_process import hull_of
from impasto.geometry import dome_direction
from impasto.models import MODELS
from impasto.residual import ZERO
from impasto.store import (
    RESIDUAL,
    MapsWriter,
    fit_group,
    fit_maps,
    level_sizes,
    open_stack,
    residual_map,
    units,
)
from impasto.store.hierarchy import coarser_group
from store_files import fit_attributes

SEED = 8
COMPONENTS = 7  # no multiple of four, by which they lie in the page's textures


def write_every_model(folder, width, height):
    """Write a store with every model, and return it."""
    photographs = folder / "photos"
    simulate(photographs, preset="swatches", lights=4, size=(width, height), calibration=False)
    store = folder / "every-model.zarr"
    impasto.stack(photographs, store)
    channels = open_stack(store).shape[3]
    for spec in MODELS.values():
        maps = fit_maps(
            spec.shape_names,
            lobes=spec.lobes,
            ambient=spec.ambient,
            channels=channels,
            coloured=spec.ambient,  # for half of the models
        )
        attributes = fit_attributes(
            spec.name,
            index_of_refraction=1.45 if spec.name.startswith("gtr") else 1.5,
            fresnel="element" if spec.name.endswith("smith") else "facet",
            light_rgb=[1.04, 1.0, 0.96],
            status_meaning={},
        )
        if spec.ambient:
            *others, status = maps
            maps = (*others, residual_map(COMPONENTS), status)
            attributes[RESIDUAL] = _random_residual(channels, tabled=len(spec.shape) > 1)
        sizes = [(height, width), *level_sizes(height, width)]
        for level, size in enumerate(sizes):
            group = coarser_group(spec.name, level) if level else fit_group(spec.name)
            writer = MapsWriter(store, group, maps, *size, attributes)
            for unit in units(*size):
                writer.write(unit, _random_maps(spec, maps, unit))
            writer.finish({})
    return store


def _random_residual(channels, tabled):
    """Return functions of the light's direction, over lights up to 60°: others are outside of their hull.

    Strengths are told by a table, or as stores had it before there were tables.
    """
    rng = np.random.default_rng(SEED)
    direction = dome_direction(np.arccos(rng.uniform(0.5, 1, 24)), rng.uniform(0, 2 * np.pi, 24))
    return {
        "components": COMPONENTS,
        "zero": ZERO,
        "step": (1e-3 / np.arange(1, COMPONENTS + 1)).tolist(),
        "toe": 0.004,
        "direction": direction.tolist(),
        "length": 0.35,
        "weights": rng.normal(0, 0.02, (COMPONENTS, channels, 24)).tolist(),
        "hull": hull_of(direction).tolist(),
        "fade": 0.17,
        "strength": {"table": rng.normal(0, 0.1, (channels, 7, 12)).tolist()}
        if tabled
        else {"length": 0.5, "noise": 0.1, "weights": rng.normal(0, 0.1, (channels, 24)).tolist()},
    }


def _random_maps(spec, maps, unit):
    """Return maps with all that a pixel may be: glossy, matte, steep, without a highlight, without a fit."""
    rng = np.random.default_rng(SEED)
    size = (unit.height, unit.width)

    def between(low, high, *more):
        return np.exp(rng.uniform(np.log(low), np.log(high), (*size, *more)))

    values = {map.name: np.full(map.shape(*size), 0.01, map.dtype) for map in maps}
    slopes = rng.normal(0, 0.25, (*size, 2))
    normal = np.concatenate([slopes, np.ones((*size, 1))], axis=-1)
    values["normal"] = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    values["diffuse"] = between(0.01, 0.9, values["diffuse"].shape[2])
    if spec.lobes:
        high = 2.0 if spec.name.startswith(("phong", "ward")) else 40.0
        values["specular"] = between(1e-3, high, *values["specular"].shape[2:])
    for parameter in spec.shape:
        draw = between if parameter.lower > 0 else lambda low, high: rng.uniform(low, high, size)
        values[parameter.name] = draw(parameter.lower, parameter.upper)
    if "exponent" in values:
        # What a fit may find: a lobe that grows towards grazing angles does so by e²⁰ at most. One that grows
        # without bounds would be seen where rounding decides whether a light is above a pixel's horizon.
        values["c"] = np.minimum(values["c"], np.sqrt(1 + 20 / values["exponent"]))
    if spec.ambient:
        values["ambient"] = between(1e-3, 0.1, values["ambient"].shape[2])
    if "specular_rgb" in values:
        values["specular_rgb"] = between(0.3, 1.5, values["specular_rgb"].shape[2])
    values["status"][:] = 0
    if RESIDUAL in values:
        values[RESIDUAL] = ZERO + rng.normal(0, 1500, (*size, COMPONENTS)).clip(-ZERO, ZERO - 1)
    drawn = rng.random(size)
    for name in ("specular", *spec.shape_names):
        if name in values:
            values[name][drawn < 0.05] = np.nan
    for name in values:
        if name not in ("status", RESIDUAL):
            values[name][drawn < 0.02] = np.nan
    return {name: np.asarray(values[name], map.dtype) for name, map in ((map.name, map) for map in maps)}
