"""Write lobes.json: both basis values of every model over a grid of geometries, from the reference models.

Run from the repository root: python -m tests.golden.make_lobes
"""

import json
from pathlib import Path

import numpy as np
from tests.reference_models import basis

# Zenith and azimuth of normal, light and view in degrees.
GEOMETRIES = [
    [(0, 0), (0, 0), (0, 0)],
    [(0, 0), (30, 0), (30, 180)],  # the mirror direction
    [(0, 0), (33, 5), (30, 180)],  # beside it
    [(0, 0), (45, 0), (5, 90)],  # the paper's camera, 5° out of the arm's plane
    [(0, 0), (74, 0), (5, 90)],
    [(0, 0), (85, 0), (60, 180)],  # grazing: V-groove shadows
    [(0, 0), (20, 0), (80, 200)],  # grazing: V-groove masks
    [(12, 200), (40, 30), (5, 90)],
    [(25, 60), (60, 240), (15, 100)],
    [(0, 0), (50, 120), (50, 120)],  # towards the light
    [(30, 0), (70, 180), (0, 0)],  # n·l < 0
    [(40, 0), (10, 0), (60, 180)],  # n·v < 0
]
# Model, its shapes, index of refraction, Fresnel angle.
SETTINGS = [
    ("lambert", [None], 1.5, "facet"),
    ("oren-nayar", [0.05, 0.3, 0.8], 1.5, "facet"),
    ("phong", [1.0, 12.5, 800.0], 1.5, "facet"),
    ("torrance-sparrow", [0.02, 0.1, 0.4, 0.9], 1.5, "facet"),
    ("torrance-sparrow", [0.1, 0.4], 1.5, "element"),
    ("torrance-sparrow", [0.3], 2.4, "facet"),
    ("torrance-sparrow-gaussian", [0.03, 0.15, 0.6], 1.5, "facet"),
    ("torrance-sparrow-gaussian", [0.15], 1.5, "element"),
    ("torrance-sparrow-smith", [0.02, 0.1, 0.4, 0.9], 1.5, "facet"),
    ("torrance-sparrow-smith", [0.3], 1.33, "element"),
    ("torrance-sparrow-2", [[0.03, 0.3], [0.1, 0.9], [0.25, 4.0]], 1.5, "facet"),
    ("torrance-sparrow-2", [[0.1, 0.5]], 1.5, "element"),
    ("gtr", [[0.02, 1.5], [0.1, 0.8], [0.4, 2.0], [0.7, 5.0]], 1.5, "facet"),
    ("gtr", [[0.2, 1.2]], 1.5, "element"),
    ("ward", [0.03, 0.15, 0.6], 1.5, "facet"),
    ("ward-anisotropic", [[0.05, 0.2, 0.0], [0.2, 0.1, 0.6], [0.5, 0.4, -0.8]], 1.5, "facet"),
]


def direction(zenith_deg, azimuth_deg):
    zenith, azimuth = np.radians(zenith_deg), np.radians(azimuth_deg)
    return [
        float(np.sin(zenith) * np.cos(azimuth)),
        float(np.sin(zenith) * np.sin(azimuth)),
        float(np.cos(zenith)),
    ]


def cases():
    for model, shapes, index, fresnel in SETTINGS:
        for shape in shapes:
            for geometry in GEOMETRIES:
                normal, light, view = (direction(*angles) for angles in geometry)
                diffuse, specular = basis(model, shape, normal, light, view, index=index, fresnel=fresnel)
                yield {
                    "model": model,
                    "shape": [] if shape is None else np.atleast_1d(shape).tolist(),
                    "index": index,
                    "fresnel": fresnel,
                    "normal": normal,
                    "light": light,
                    "view": view,
                    "diffuse_basis": float(diffuse),
                    "specular_basis": specular.tolist(),
                }


def write(path, provenance, lists):
    """Write named lists of records as JSON, a record per line so that a changed value is a changed line."""
    parts = [f'"provenance": {json.dumps(provenance)}']
    for name, records in lists.items():
        lines = ",\n".join(json.dumps(record, ensure_ascii=False) for record in records)
        parts.append(f'"{name}": [\n{lines}\n]')
    path.write_text("{\n" + ",\n".join(parts) + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    write(
        Path(__file__).with_name("lobes.json"),
        "tests/reference_models.py in float64, written by tests/golden/make_lobes.py",
        {"cases": list(cases())},
    )
