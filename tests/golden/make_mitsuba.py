"""Write mitsuba.json: D, F, G1 and whole Smith lobes as Mitsuba 3 computes them.

Run from the repository root: python -m tests.golden.make_mitsuba

Mitsuba's D is normalised over the projected hemisphere, D = π c² D_GGX in the method's scale; its G is the
product of the two G1, while the method's Smith G is height-correlated: G = 1/(1 + Λ(l) + Λ(v)) with
Λ = 1/G1 − 1 [Heitz2014, Eqs. 43 and 99]. So the lobe is put together from Mitsuba's own D, F and G1.
Mitsuba computes in float32: values are good to about 5e-7.
"""

from pathlib import Path

import mitsuba as mi
import numpy as np
from tests.golden.make_lobes import GEOMETRIES, direction, write

mi.set_variant("scalar_rgb")

ALPHAS = [0.02, 0.05, 0.1, 0.3, 0.6, 0.9]
INDICES = [1.33, 1.5, 2.4]
INDEX = 1.5  # of the whole lobes


def vector(a):
    return mi.Vector3f(*(float(x) for x in a))


def ggx(alpha):
    return mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha, sample_visible=False)


def local_frame(normal):
    """Return rows (tangent, bitangent, normal) that turn vectors into the element's own frame."""
    normal = np.asarray(normal)
    tangent = np.cross([0.0, 1.0, 0.0], normal)
    tangent /= np.linalg.norm(tangent)
    return np.stack([tangent, np.cross(normal, tangent), normal])


def terms():
    for alpha in ALPHAS:
        distribution = ggx(alpha)
        for angle_deg in (0, 1, 5, 20, 45, 75):
            facet = np.array(direction(angle_deg, 0))
            yield {
                "term": "trowbridge_reitz",
                "arguments": [float(facet[2]), alpha],
                "value": np.pi * alpha**2 * distribution.eval(vector(facet)),
            }
        for angle_deg in (10, 45, 70, 85):
            toward = np.array(direction(angle_deg, 0))
            yield {
                "term": "smith_g1",
                "arguments": [float(toward[2]), alpha],
                "value": distribution.smith_g1(vector(toward), mi.Vector3f(0, 0, 1)),
            }
    for index in INDICES:
        for angle_deg in (0, 20, 45, 56.31, 75, 85, 89):
            cosine = float(np.cos(np.radians(angle_deg)))
            yield {
                "term": "fresnel_dielectric",
                "arguments": [cosine, index],
                "value": mi.fresnel(cosine, index)[0],
            }


def lobes():
    for alpha in ALPHAS:
        distribution = ggx(alpha)
        for geometry in GEOMETRIES:
            normal, light, view = (direction(*angles) for angles in geometry)
            frame = local_frame(normal)
            toward_light, toward_view = frame @ light, frame @ view
            if min(toward_light[2], toward_view[2]) <= 0:
                continue
            half = (toward_light + toward_view) / np.linalg.norm(toward_light + toward_view)
            d = np.pi * alpha**2 * distribution.eval(vector(half))
            f = mi.fresnel(float(half @ toward_view), INDEX)[0]
            g1_light, g1_view = (
                distribution.smith_g1(vector(a), vector(half)) for a in (toward_light, toward_view)
            )
            yield {
                "model": "torrance-sparrow-smith",
                "shape": [alpha],
                "index": INDEX,
                "fresnel": "facet",
                "normal": normal,
                "light": light,
                "view": view,
                "diffuse_basis": float(toward_light[2]),
                "specular_basis": float(d * f / (1 / g1_light + 1 / g1_view - 1) / toward_view[2]),
            }


if __name__ == "__main__":
    write(
        Path(__file__).with_name("mitsuba.json"),
        f"Mitsuba {mi.__version__}, scalar_rgb (float32): mi.MicrofacetDistribution (GGX) and mi.fresnel, "
        "written by tests/golden/make_mitsuba.py",
        {"terms": list(terms()), "cases": list(lobes())},
    )
