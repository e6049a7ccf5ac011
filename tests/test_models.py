"""Every reflectance model against golden values, against physics and against the reference.

The tests run over the list of models that the core itself gives. `CLAIMS` says which properties each has; a
model that lacks one is tested to lack it, and one that claims nothing fails the first test.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import reference_models as reference
from impasto import _core
from impasto.geometry import dome_direction
from reference_models import unit

GOLDEN = Path(__file__).parent / "golden"
MODELS = {entry["name"]: entry for entry in _core.models()}


@dataclass(frozen=True)
class Claims:
    """What a model's specular lobe promises.

    Parameters
    ----------
    reciprocal : bool
        f(l, v) = f(v, l) for the lobe over n·l, with F at the facet's angle.
    furnace : dict of float or tuple of float to float, or None
        Least share of white light that the lossless lobe (F = 1, magnitude of a smooth interface) returns at
        any view, per shape: the rest was scattered more than once. None: there is no lossless magnitude.
    """

    reciprocal: bool
    furnace: dict[float, float] | None


CLAIMS = {
    "lambert": Claims(reciprocal=True, furnace=None),
    "oren-nayar": Claims(reciprocal=True, furnace=None),
    "phong": Claims(reciprocal=False, furnace=None),
    "torrance-sparrow": Claims(reciprocal=True, furnace={0.1: 0.94, 0.3: 0.86, 0.6: 0.61}),
    "torrance-sparrow-gaussian": Claims(reciprocal=True, furnace={0.1: 0.94, 0.3: 0.92, 0.6: 0.77}),
    "torrance-sparrow-smith": Claims(reciprocal=True, furnace={0.1: 0.89, 0.3: 0.82, 0.6: 0.59}),
    "torrance-sparrow-2": Claims(
        reciprocal=True, furnace={(0.1, 0.1): 0.94, (0.1, 0.6): 0.61, (0.3, 0.6): 0.61}
    ),
    "gtr": Claims(reciprocal=True, furnace={(0.1, 2.0): 0.94, (0.3, 2.0): 0.86, (0.3, 4.0): 0.92}),
    "ward": Claims(reciprocal=True, furnace=None),
    "ward-anisotropic": Claims(reciprocal=True, furnace=None),
}
SPECULAR = [name for name, entry in MODELS.items() if entry["lobes"]]


def basis(model, shape, normal, light, view, *, index=1.5, fresnel="facet"):
    """Return the core's diffuse and specular basis values in f64, arguments as in the reference."""
    normal, light, view = np.broadcast_arrays(
        *(np.atleast_2d(np.asarray(a, float)) for a in (normal, light, view))
    )
    shape = np.broadcast_to(np.asarray(shape, float), (len(normal), len(MODELS[model]["shape"])))
    arrays = (np.ascontiguousarray(a) for a in (normal, light, view, shape))
    values = _core.basis(model, *arrays, index=index, fresnel=fresnel)
    return values[:, 0], values[:, 1:]


def render(model, normal, diffuse, specular, shape, ambient=None, *, light_direction, **options):
    """Call the core's renderer with the reference's arguments and defaults."""
    lights, (pixels, channels) = len(light_direction), np.shape(diffuse)
    settings = {
        "light_position_mm": np.full((lights, 3), np.nan),
        "light_intensity": np.ones((lights, channels)),
        "specular_rgb": None,
        "view_tilt": None,
        "view_direction": np.array([0.0, 0.0, 1.0]),
        "camera_distance_mm": None,
        "position_mm": None,
        "light_rgb": np.ones(channels),
        "index": 1.5,
        "fresnel": "facet",
    } | options
    entry = MODELS[reference.base_name(model)]
    maps = {
        "normal": normal,
        "diffuse": diffuse,
        "specular": np.reshape(specular, (pixels, -1))[:, : entry["lobes"]],
        "shape": np.reshape(shape, (pixels, -1))[:, : len(entry["shape"])],
    }
    scene = {
        "model": model,
        **{name: np.ascontiguousarray(values, np.float32) for name, values in maps.items()},
        "ambient": None if ambient is None else np.ascontiguousarray(ambient, np.float32),
        "light_direction": np.ascontiguousarray(light_direction, float),
        **settings,
    }
    return _core.render(scene)


def typical_shape(model):
    return [reference.TYPICAL[parameter[0]] for parameter in MODELS[model]["shape"]]


def hemisphere(steps=300):
    """Return directions (M, 3) and solid angles (M,) that cover the hemisphere."""
    zenith = (np.arange(steps) + 0.5) / steps * np.pi / 2
    azimuth = (np.arange(2 * steps) + 0.5) / steps * np.pi
    zenith, azimuth = (a.ravel() for a in np.meshgrid(zenith, azimuth, indexing="ij"))
    return dome_direction(zenith, azimuth), np.sin(zenith) * (np.pi / 2 / steps) * (np.pi / steps)


def random_directions(rng, count, highest_zenith_deg=85):
    return dome_direction(
        np.radians(rng.uniform(0, highest_zenith_deg, count)), rng.uniform(0, 2 * np.pi, count)
    )


def test_every_model_states_its_claims():
    assert set(CLAIMS) == set(MODELS) == set(reference.MODELS)
    for name, entry in MODELS.items():
        assert entry["reciprocal"] == CLAIMS[name].reciprocal
        assert tuple(shape[0] for shape in entry["shape"]) == reference.MODELS[name][0]


@pytest.mark.parametrize(
    # The whole Smith lobe is to equal Mitsuba's to 1e-4; Mitsuba's own float32 costs 1e-6 of that.
    ("file", "tolerance"),
    [("hand.json", 1e-7), ("lobes.json", 1e-7), ("mitsuba.json", 1e-5)],
)
def test_golden_values(file, tolerance):
    for case in json.loads((GOLDEN / file).read_text(encoding="utf-8"))["cases"]:
        diffuse, specular = basis(
            case["model"],
            case["shape"],
            case["normal"],
            case["light"],
            case["view"],
            index=case["index"],
            fresnel=case["fresnel"],
        )
        assert diffuse[0] == pytest.approx(case["diffuse_basis"], rel=1e-12, abs=1e-15), case
        expected = np.atleast_1d(case["specular_basis"])[: specular.shape[1]]
        assert specular[0] == pytest.approx(expected, rel=tolerance, abs=1e-12), case


@pytest.mark.parametrize(
    ("light", "view", "attenuation"),
    [
        ([0.0, 0.0, 1.0], [0.0, 0.0, 1.0], 1.0),
        ([0.8, 0.0, 0.6], [0.0, 0.0, 1.0], 1.0),  # 2·0.6 > 1
        ([0.96, 0.0, 0.28], [0.0, 0.0, 1.0], 0.56),  # h = (0.6, 0, 0.8): 2·0.8·0.28/0.8
        ([0.0, 0.0, 1.0], [0.96, 0.0, 0.28], 0.56),
        ([0.96, 0.0, 0.28], [-0.6, 0.0, 0.8], 14 / 15),  # h = (1, 0, 3)/√10: 2·3·0.28/1.8
        ([0.0, 0.6, 0.8], [0.96, 0.0, 0.28], 42 / 85),  # h ∝ (0.96, 0.6, 1.08): 2·1.08·0.28/1.224
    ],
)
def test_v_groove_attenuation_worked_out_by_hand(light, view, attenuation):
    # D is 1 at c = 1 and F is 1 at an index of 1e9: what is left of the lobe is G/(n·v).
    lobe = basis("torrance-sparrow", 1.0, [0.0, 0.0, 1.0], light, view, index=1e9)[1]
    assert lobe[0, 0] * view[2] == pytest.approx(attenuation, rel=1e-7)


@pytest.mark.parametrize("model", MODELS)
def test_float32_rendering_equals_the_reference(model):
    rng = np.random.default_rng(1)
    pixels = 203  # not a multiple of the lanes
    normal = random_directions(rng, pixels, 40).astype(np.float32)
    bounds = MODELS[model]["shape"]
    ranges = {"shininess": (1, 2000), "exponent": (0.7, 4)}
    limits = np.log([ranges.get(parameter[0], (0.02, 0.9)) for parameter in bounds] or [(1, 1)])
    lobes = MODELS[model]["lobes"]
    maps = {
        "normal": normal,
        "diffuse": rng.uniform(0, 1, (pixels, 3)).astype(np.float32),
        "specular": rng.uniform(0, 5, (pixels, lobes)).astype(np.float32),
        "shape": np.exp(rng.uniform(*limits.T, (pixels, len(limits)))).astype(np.float32),
    }
    options = {
        "light_direction": random_directions(rng, 7),
        "view_direction": unit([0.1, -0.2, 1.0]),
        "light_intensity": rng.uniform(0.5, 2, (7, 3)),
        "light_rgb": np.array([0.9, 1.0, 0.8]),
        "index": 1.6,
    }
    expected = reference.radiance(model, **maps, **options)
    # In float32 a normal is known to 6e-8 rad, which on the flank of a lobe of c = 0.02 is 1e-5 of D.
    np.testing.assert_allclose(render(model, **maps, **options), expected, rtol=3e-5, atol=1e-6)


@pytest.mark.parametrize("model", ["torrance-sparrow", "phong"])
def test_near_lights_and_perspective_camera(model):
    rng = np.random.default_rng(2)
    pixels, lights = 50, 5
    maps = {
        "normal": random_directions(rng, pixels, 20).astype(np.float32),
        "diffuse": rng.uniform(0, 1, (pixels, 3)).astype(np.float32),
        "specular": np.ones(pixels, np.float32),
        "shape": np.tile(np.float32(typical_shape(model)), (pixels, 1)),
        "ambient": rng.uniform(0, 0.1, (pixels, 3)).astype(np.float32),
    }
    direction = random_directions(rng, lights, 60)
    position = direction * 700.0
    position[2] = np.nan  # one light is far away
    options = {
        "light_direction": direction,
        "light_position_mm": position,
        "view_direction": unit([0.0, 0.1, 1.0]),
        "camera_distance_mm": 900.0,
        "position_mm": rng.uniform(-200, 200, (pixels, 2)).astype(np.float32),
    }
    if not MODELS[model]["ambient_by_default"]:
        model += "-ambient"
    expected = reference.radiance(model, **maps, **options)
    np.testing.assert_allclose(render(model, **maps, **options), expected, rtol=2e-5, atol=1e-6)


@pytest.mark.parametrize("fresnel", ["facet", "element"])
@pytest.mark.parametrize("model", SPECULAR)
def test_reciprocity(model, fresnel):
    rng = np.random.default_rng(3)
    light, view = random_directions(rng, 200), random_directions(rng, 200)
    normal = np.array([0.0, 0.0, 1.0])
    one_way, other_way = (
        basis(model, typical_shape(model), normal, a, b, fresnel=fresnel)[1].sum(axis=1) / a[:, 2]
        for a, b in [(light, view), (view, light)]
    )
    differs = np.abs(one_way - other_way) > 1e-9 * np.maximum(one_way, other_way)
    # F at the element's angle of incidence treats l and v unlike: the paper read literally is not reciprocal.
    # Ward's lobe has no F.
    if CLAIMS[model].reciprocal and (fresnel == "facet" or model.startswith("ward")):
        assert not differs.any()
    else:
        assert differs.mean() > 0.5


def test_lambert_returns_all_light_in_the_white_furnace():
    light, solid_angle = hemisphere()
    diffuse, specular = basis("lambert", [], [0.0, 0.0, 1.0], light, [0.6, 0.0, 0.8])
    assert (diffuse * solid_angle).sum() / np.pi == pytest.approx(1, abs=1e-4)
    assert not specular.any()


def test_oren_nayar_loses_light_in_the_white_furnace():
    # Without what passes between its facets more than once: at sigma 0 all light, at 0.3 and normal view
    # A = 1 − 0.045/0.42 = 0.8929 of it, and at no angle more than there was.
    light, solid_angle = hemisphere()
    for sigma, least in ((1e-9, 0.9999), (0.3, 0.88), (0.8, 0.65)):
        for zenith_deg in (0, 30, 60, 80):
            view = [np.sin(np.radians(zenith_deg)), 0.0, np.cos(np.radians(zenith_deg))]
            diffuse, specular = basis("oren-nayar", sigma, [0.0, 0.0, 1.0], light, view)
            assert least < (diffuse * solid_angle).sum() / np.pi < 1.0005, (sigma, zenith_deg)
            assert not specular.any()
    diffuse, _ = basis("oren-nayar", 0.3, [0.0, 0.0, 1.0], light, [0.0, 0.0, 1.0])
    assert (diffuse * solid_angle).sum() / np.pi == pytest.approx(1 - 0.045 / 0.42, abs=1e-4)


@pytest.mark.parametrize("model", [name for name in SPECULAR if CLAIMS[name].furnace])
def test_white_furnace(model):
    light, solid_angle = hemisphere()
    normal = np.array([0.0, 0.0, 1.0])
    for shape, least in CLAIMS[model].furnace.items():
        # The facets' projected areas must add up to the surface's: with N = ∫ D cos δ dω, which is π c² for
        # Trowbridge-Reitz, the lossless magnitude is π/(4 N). The index 1e6 makes F 1.
        distribution = getattr(reference, reference.MODELS[model][1].replace("-", "_"))
        # Two lobes share the surface: each has half the facets.
        lobes = MODELS[model]["lobes"]
        of_each = np.atleast_2d(shape).T if lobes > 1 else [np.atleast_1d(shape)]
        of_facets = np.stack([distribution(light[:, 2], *each) for each in of_each], axis=1)
        normalisation = lobes * (of_facets * (light[:, 2] * solid_angle)[:, None]).sum(axis=0)
        if reference.MODELS[model][1] == "trowbridge-reitz":
            widths = np.ravel(of_each)
            np.testing.assert_allclose(normalisation, lobes * np.pi * widths**2, rtol=1e-3)
        for zenith_deg in (0, 30, 60, 80):
            view = [np.sin(np.radians(zenith_deg)), 0.0, np.cos(np.radians(zenith_deg))]
            lobe = basis(model, shape, normal, light, view, index=1e6)[1]
            returned = ((lobe * solid_angle[:, None]).sum(axis=0) / (4 * normalisation)).sum()
            assert least < returned < 1.0005, (shape, zenith_deg)


def test_phong_lobe_has_no_lossless_magnitude():
    # Its height is As whatever the shininess, so what it returns is 2 As/(shininess + 1) at normal view.
    light, solid_angle = hemisphere()
    for shininess in (10.0, 100.0):
        lobe = basis("phong", shininess, [0.0, 0.0, 1.0], light, [0.0, 0.0, 1.0])[1]
        returned = (lobe[:, 0] * solid_angle).sum() / np.pi
        assert returned == pytest.approx(2 / (shininess + 1), rel=1e-3)


@pytest.mark.parametrize("model", MODELS)
def test_positive_where_lit_and_zero_where_dark(model):
    rng = np.random.default_rng(4)
    light, view, normal = (unit(rng.standard_normal((3000, 3))) for _ in range(3))
    typical = typical_shape(model)
    # Each parameter at either end of its range, the others typical.
    shapes = [typical] + [
        [*typical[:index], parameter[end], *typical[index + 1 :]]
        for index, parameter in enumerate(MODELS[model]["shape"])
        for end in (1, 2)
    ]
    for shape in shapes:
        diffuse, specular = basis(model, shape, normal, light, view)
        dark = (reference.dot(normal, light) <= 0) | (reference.dot(normal, view) <= 0)
        assert np.isfinite(specular).all()
        assert (diffuse[~dark] > 0).all()
        assert (specular >= 0).all()
        assert not diffuse[dark].any()
        assert not specular[dark].any()
    for grazing in (1e-3, 1e-5):
        light = unit([[1.0, 0.0, grazing]])
        values = basis(model, typical, [0.0, 0.0, 1.0], light, unit([-1.0, 0.0, grazing]))
        assert all(np.isfinite(each).all() for each in values)


def test_arrays_in_fortrans_order_are_refused():
    codes = np.asfortranarray(np.zeros((4, 5, 3), np.uint16))
    with pytest.raises(ValueError, match=r"\[4, 5, 3\] is not C-contiguous"):
        _core.correct(codes, row0=0, height=4, clip=65535)
