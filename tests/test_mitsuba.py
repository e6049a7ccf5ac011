"""The core against Mitsuba 3, a renderer that none of its authors wrote.

Mitsuba's GGX distribution is D/(π c²) in the method's scale, and a smooth interface has As = 1/(4 c²). Its G
is the product of the two G1, while the method's Smith G is correlated by height, G = 1/(1 + Λ(l) + Λ(v)) with
Λ = 1/G1 − 1: lobes are compared with Mitsuba's D, F and G1 put together so, renderings as they come.
"""

import mitsuba as mi
import numpy as np
import pytest

import reference_models as reference
from impasto import _core
from impasto.geometry import dome_direction

mi.set_variant("scalar_rgb")  # the one variant that needs no LLVM

MODEL = "torrance-sparrow-smith"
INDEX = 1.5
VARNISH = {
    "type": "roughdielectric",
    "distribution": "ggx",
    "int_ior": INDEX,
    "ext_ior": 1.0,
    "specular_transmittance": 0.0,
}
UPRIGHT = np.array([0.0, 0.0, 1.0])


def vector(a):
    return mi.Vector3f(*(float(x) for x in a))


def ggx(alpha):
    return mi.MicrofacetDistribution(mi.MicrofacetType.GGX, float(alpha), sample_visible=False)


def core_lobe(model, shape, light, view, *, index=INDEX):
    """Return the core's specular basis in f64 on an upright element, for directions of shape (N, 3)."""
    shape = np.full((len(light), 1), float(shape))
    normal = np.tile(UPRIGHT, (len(light), 1))
    return _core.basis(model, normal, light, view, shape, index=index, fresnel="facet")[:, 1]


@pytest.fixture(scope="module")
def directions():
    """Return 60 pairs of light and view, from near the normal to near grazing."""
    rng = np.random.default_rng(7)
    zenith, azimuth = np.radians(rng.uniform(0, 85, (2, 60))), rng.uniform(0, 2 * np.pi, (2, 60))
    return dome_direction(zenith, azimuth)


@pytest.mark.parametrize("c", [0.01, 0.05, 0.2, 0.6, 1.0])
def test_distribution(c, directions):
    light, view = directions
    # V-groove attenuation does not depend on c and D is 1 at c = 1: the ratio is the core's D alone.
    d = core_lobe("torrance-sparrow", c, light, view) / core_lobe("torrance-sparrow", 1.0, light, view)
    expected = [np.pi * c**2 * ggx(c).eval(vector(half)) for half in reference.unit(light + view)]
    np.testing.assert_allclose(d, expected, rtol=1e-5)


@pytest.mark.parametrize(("c", "c2"), [(0.02, 0.3), (0.1, 1.0)])
def test_distributions_of_two_lobes(c, c2, directions):
    light, view = directions
    normal = np.tile(UPRIGHT, (len(light), 1))
    shape = np.tile([c, c2], (len(light), 1))
    lobes = _core.basis("torrance-sparrow-2", normal, light, view, shape, index=INDEX, fresnel="facet")[:, 1:]
    flat = core_lobe("torrance-sparrow", 1.0, light, view)
    for lobe, width in zip(lobes.T, (c, c2), strict=True):
        expected = [np.pi * width**2 * ggx(width).eval(vector(half)) for half in reference.unit(light + view)]
        np.testing.assert_allclose(lobe / flat, expected, rtol=1e-5)


@pytest.mark.parametrize(
    ("alpha_x", "alpha_y", "correlation"), [(0.1, 0.3, 0.0), (0.3, 0.15, 0.6), (0.25, 0.25, -0.8)]
)
def test_anisotropic_slopes(alpha_x, alpha_y, correlation, directions):
    # Mitsuba's Beckmann distribution of slopes has axes of its own: those of the covariance.
    light, view = directions
    cross = correlation * alpha_x * alpha_y
    variances, axes = np.linalg.eigh([[alpha_x**2, cross], [cross, alpha_y**2]])
    alpha_u, alpha_v = (float(each) for each in np.sqrt(variances))
    beckmann = mi.MicrofacetDistribution(mi.MicrofacetType.Beckmann, alpha_u, alpha_v, sample_visible=False)
    half = reference.unit(light + view)
    turned = np.concatenate([half[:, :2] @ axes, half[:, 2:]], axis=1)
    expected = [np.pi * alpha_u * alpha_v * h[2] ** 4 * beckmann.eval(vector(h)) for h in turned]
    shape = np.tile([alpha_x, alpha_y, correlation], (len(light), 1))
    normal = np.tile(UPRIGHT, (len(light), 1))
    lobe = _core.basis("ward-anisotropic", normal, light, view, shape, index=INDEX, fresnel="facet")[:, 1]
    np.testing.assert_allclose(lobe / np.sqrt(light[:, 2] / view[:, 2]), expected, rtol=1e-4, atol=1e-12)


@pytest.mark.parametrize("index", [1.33, 1.5, 2.4])
def test_fresnel(index, directions):
    light, view = directions
    # An interface of boundless index reflects everything.
    f = core_lobe(MODEL, 0.3, light, view, index=index) / core_lobe(MODEL, 0.3, light, view, index=1e9)
    half = reference.unit(light + view)
    expected = [mi.fresnel(float(cosine), index)[0] for cosine in reference.dot(light, half)]
    np.testing.assert_allclose(f, expected, rtol=1e-5)


@pytest.mark.parametrize("c", [0.02, 0.1, 0.4, 0.9])
def test_whole_smith_lobe(c, directions):
    light, view = directions
    half = reference.unit(light + view)
    d = np.array([np.pi * c**2 * ggx(c).eval(vector(h)) for h in half])
    f = np.array([mi.fresnel(float(cosine), INDEX)[0] for cosine in reference.dot(light, half)])
    g1_light, g1_view = (
        np.array([ggx(c).smith_g1(vector(a), vector(h)) for a, h in zip(towards, half, strict=True)])
        for towards in (light, view)
    )
    expected = d * f / (1 / g1_light + 1 / g1_view - 1) / view[:, 2]
    np.testing.assert_allclose(core_lobe(MODEL, c, light, view), expected, rtol=1e-4)


@pytest.mark.parametrize("c", [0.1, 0.4])
def test_scale_of_a_smooth_interface(c, directions):
    # The plugin's own BRDF times cosine, π f cos θ under unit irradiance, is κ = 1: As = 1/(4 c²).
    bsdf = mi.load_dict(VARNISH | {"alpha": c})
    light, view = directions
    evaluated, correction = [], []
    for towards_light, towards_view in zip(light, view, strict=True):
        interaction = mi.SurfaceInteraction3f()
        interaction.sh_frame = mi.Frame3f(vector(UPRIGHT))
        interaction.wi = vector(towards_view)
        evaluated.append(np.pi * bsdf.eval(mi.BSDFContext(), interaction, vector(towards_light))[0])
        g1 = [ggx(c).smith_g1(vector(a), vector(UPRIGHT)) for a in (towards_light, towards_view)]
        correction.append(g1[0] * g1[1] * (1 / g1[0] + 1 / g1[1] - 1))  # separable over height-correlated G
    specular = 1 / (4 * c**2)
    np.testing.assert_allclose(specular * core_lobe(MODEL, c, light, view) * correction, evaluated, rtol=1e-4)


SIZE_PX = 64
LIGHTS = 60
ALPHAS = np.geomspace(0.05, 0.5, 8)


def relief(x, y):
    """Height of brush strokes over a canvas of side 2; slopes stay below 18°, so no light casts a shadow."""
    return (
        0.02 * np.sin(7 * x + 2 * y) + 0.015 * np.cos(5 * y - 3 * x) + 0.01 * np.sin(13 * x) * np.sin(11 * y)
    )


def relief_mesh(bsdf, steps=129):
    axis = np.linspace(-1, 1, steps)
    x, y = np.meshgrid(axis, axis)
    slope_y, slope_x = np.gradient(relief(x, y), axis, axis)
    corner = np.arange(steps * steps).reshape(steps, steps)
    a, b, c, d = (corner[rows, columns].ravel() for rows, columns in _CORNERS)
    properties = mi.Properties()
    properties["bsdf"] = bsdf
    mesh = mi.Mesh(
        "relief", steps**2, 2 * len(a), props=properties, has_vertex_normals=True, has_vertex_texcoords=True
    )
    parameters = mi.traverse(mesh)
    for name, values in {
        "vertex_positions": np.stack([x, y, relief(x, y)], -1),
        "vertex_normals": reference.unit(np.stack([-slope_x, -slope_y, np.ones_like(x)], -1)),
        "vertex_texcoords": np.stack([(x + 1) / 2, (y + 1) / 2], -1),
    }.items():
        parameters[name] = values.astype(np.float32).ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    parameters["faces"] = faces.astype(np.uint32).ravel()
    parameters.update()
    return mesh


_HEAD, _TAIL = slice(None, -1), slice(1, None)
_CORNERS = [(_HEAD, _HEAD), (_HEAD, _TAIL), (_TAIL, _TAIL), (_TAIL, _HEAD)]


def patches(values):
    """Return a texture of flat patches, without interpolation or colour conversion."""
    bitmap = mi.Bitmap(np.ascontiguousarray(values, np.float32))
    return {"type": "bitmap", "bitmap": bitmap, "raw": True, "filter_type": "nearest"}


@pytest.fixture(scope="module")
def photographs():
    """Render a varnished relief of eight widths and 64 pigments under a dome of 60 lights with Mitsuba."""
    albedo = np.random.default_rng(0).uniform(0.05, 0.8, (8, 8, 3))
    alpha = np.tile(ALPHAS[None, :, None], (8, 1, 1))
    # A blend halves both, so the irradiance is 2 π where a white diffuser is to read 1.
    mesh = relief_mesh(
        mi.load_dict(
            {
                "type": "blendbsdf",
                "weight": 0.5,
                "paint": {"type": "diffuse", "reflectance": patches(albedo)},
                "varnish": VARNISH | {"alpha": patches(alpha)},
            }
        )
    )
    film = {
        "type": "hdrfilm",
        "width": SIZE_PX,
        "height": SIZE_PX,
        "rfilter": {"type": "box"},
        "pixel_format": "rgb",
        "component_format": "float32",
    }
    sensor = {
        "type": "orthographic",
        "to_world": mi.ScalarTransform4f().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0]),
        "film": film,
        "sampler": {"type": "independent", "sample_count": 1},
    }

    def photograph(light, integrator):
        # One sample per pixel and always the same seed: every picture sees the same points of the surface.
        emitter = {
            "type": "directional",
            "direction": [-float(x) for x in light],
            "irradiance": {"type": "rgb", "value": 2 * np.pi},
        }
        scene = {"type": "scene", "integrator": integrator, "sensor": sensor, "light": emitter, "mesh": mesh}
        return np.array(mi.render(mi.load_dict(scene), seed=1, spp=1))

    step = np.arange(LIGHTS)
    lights = dome_direction(np.radians(70) * np.sqrt((step + 0.5) / LIGHTS), step * np.pi * (3 - np.sqrt(5)))
    truth = photograph(lights[0], {"type": "aov", "aovs": "normal:sh_normal,place:uv"}).reshape(-1, 5)
    direct = {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0}
    radiance = np.stack([photograph(light, direct) for light in lights])
    column, row = (np.clip((truth[:, i] * 8).astype(int), 0, 7) for i in (3, 4))
    return {
        "lights": lights,
        "radiance": radiance.reshape(LIGHTS, -1, 3).astype(np.float32),
        "normal": truth[:, :3].astype(float),
        "diffuse": albedo[row, column],
        "c": ALPHAS[column],
    }


def core_settings(lights):
    return {
        "light_direction": lights,
        "light_position_mm": np.full((len(lights), 3), np.nan),
        "light_intensity": np.ones((len(lights), 3)),
        "view_direction": UPRIGHT,
        "camera_distance_mm": None,
        "position_mm": None,
        "light_rgb": np.ones(3),
        "index": INDEX,
        "fresnel": "facet",
    }


def test_rendering_of_a_relief(photographs):
    scene = {
        "model": MODEL,
        "normal": photographs["normal"].astype(np.float32),
        "diffuse": photographs["diffuse"].astype(np.float32),
        "specular": (1 / (4 * photographs["c"] ** 2)).astype(np.float32)[:, None],
        "shape": photographs["c"].astype(np.float32)[:, None],
        "ambient": None,
        "specular_rgb": None,
        "view_tilt": None,
        **core_settings(photographs["lights"]),
    }
    rendered = _core.render(scene)
    difference = np.abs(rendered / photographs["radiance"] - 1)
    assert np.median(difference) < 1e-6
    assert difference.max() < 1e-3  # the two forms of G part at low lights


@pytest.mark.parametrize("relative_noise", [0.0, 0.005])
def test_fit_of_a_relief(photographs, relative_noise):
    noise = 1 + relative_noise * np.random.default_rng(1).standard_normal(photographs["radiance"].shape)
    fitted = _core.fit(
        MODEL,
        (photographs["radiance"] * noise).astype(np.float32),
        scale=1.0,
        offset=0.0,
        clip_level=np.full(3, np.inf),
        shadow_level=-np.inf,
        sample_mask=None,
        noise=(1e-4, 0.0, 0.005),
        loss="linear",
        loss_scale=1.0,
        max_steps=60,
        **core_settings(photographs["lights"]),
    )
    nothing = np.zeros_like(photographs["diffuse"])
    specular = reference.radiance(
        MODEL,
        photographs["normal"],
        nothing,
        1 / (4 * photographs["c"] ** 2),
        photographs["c"],
        light_direction=photographs["lights"],
        index=INDEX,
    ).max(axis=(0, 2))
    seen = specular > 0.5 * photographs["diffuse"].mean(axis=1)
    assert seen.sum() > 1000
    angle_deg = np.degrees(np.linalg.norm(fitted["normal"] - photographs["normal"], axis=1))
    c_error = np.abs(fitted["shape"][:, 0] / photographs["c"] - 1)
    assert np.median(angle_deg) < 0.5
    assert np.median(c_error[seen]) < 0.02
    assert np.median(np.abs(fitted["diffuse"] / photographs["diffuse"] - 1)) < 0.01
    assert np.mean(fitted["chi2_reduced"] > 2) < 0.002
