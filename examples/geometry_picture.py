"""Draw docs/images/geometry.png: the frame, the arm and the directions, after Fig. 2 of the paper.

    .venv/bin/python examples/geometry_picture.py docs/images/geometry.png

Every arrow is computed from its angles as docs/notation.md defines them, and drawn in parallel projection.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from impasto.geometry import arm_direction, tilt_direction

INK, SOFT = "#22201c", "#8b867b"
# Okabe and Ito's palette.
LIGHT, NORMAL, VIEW, MIRROR, HALF = "#e69f00", "#000000", "#0072b2", "#d55e00", "#009e73"
DARK = "#8a5a00"  # letters in the colour of the light
ARM_DEG = -56.0
NORMAL_DEG = (6.0, 20.0)
VIEW_DEG = (34.0, 26.0)
# Where the reader stands: to the right of the painting's foot, a little above its plane.
EYE_AZIMUTH_DEG, EYE_ELEVATION_DEG = -62.0, 20.0


def project(points):
    """Return points (..., 3) of the painting's frame on the page, (..., 2)."""
    azimuth, elevation = np.radians([EYE_AZIMUTH_DEG, EYE_ELEVATION_DEG])
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    level = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    eye = np.cos(elevation) * level + np.sin(elevation) * np.array([0.0, 0.0, 1.0])
    up = np.cross(eye, right)
    return np.asarray(points) @ np.stack([right, up], axis=1)


def main(path: Path) -> None:
    """Draw the picture and save it."""
    figure = Figure(figsize=(9.0, 6.0), dpi=120, facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set_axis_off()
    axes.set_aspect("equal")

    def line(points, **look):
        axes.plot(*project(points).T, **look)

    def arrow(direction, length, colour, label, offset=(0.0, 0.0)):
        tip = project(length * np.asarray(direction))
        look = {"arrowstyle": "-|>", "color": colour, "lw": 2.2, "shrinkB": 0}
        axes.annotate("", tip, (0, 0), arrowprops=look)
        axes.text(*(1.06 * tip + offset), label, color=colour, fontsize=13, ha="center", va="center")

    def arc(radius, angles, direction, label, beyond=1.14, colour=INK, at=20):
        angles = np.linspace(*angles, 40)
        points = radius * direction(np.radians(angles))
        line(points, color=colour, lw=1.2)
        axes.text(*project(beyond * points[at]), label, color=colour, fontsize=12, ha="center", va="center")

    corners = np.array([[-0.95, -0.75, 0], [0.95, -0.75, 0], [0.95, 0.75, 0], [-0.95, 0.75, 0]])
    axes.fill(*project(corners).T, color="#f4f1ea", ec=SOFT, zorder=0)
    axes.text(*project([-0.72, -0.62, 0]), "painting", color=SOFT, fontsize=11, ha="center", va="center")
    sweep = np.radians(np.linspace(-78, 78, 121))
    line(1.5 * arm_direction(sweep), color=LIGHT, lw=1.0, ls=(0, (5, 4)))
    place = project(1.57 * arm_direction(np.radians(42)))
    axes.text(*place, "arm, in the XZ plane", color=DARK, fontsize=11)
    for axis, name in zip(np.eye(3), "XYZ", strict=True):
        line([np.zeros(3), 1.25 * axis], color=SOFT, lw=1.2)
        axes.text(*project(1.34 * axis), name, color=SOFT, fontsize=12, ha="center", va="center")

    light = arm_direction(np.radians(ARM_DEG))
    normal, view = tilt_direction(*np.radians(NORMAL_DEG)), tilt_direction(*np.radians(VIEW_DEG))
    mirror = 2 * (normal @ light) * normal - light
    half = (light + view) / np.linalg.norm(light + view)
    arrow(light, 1.5, LIGHT, "l, light", (-0.2, -0.04))
    axes.plot(*project(1.5 * light), "o", color=LIGHT, markersize=11)
    arrow(normal, 1.08, NORMAL, "n, normal", (0.0, 0.05))
    arrow(view, 1.35, VIEW, "v, view", (0.1, 0.06))
    arrow(mirror, 1.25, MIRROR, "r, mirror", (-0.16, -0.1))
    arrow(half, 1.0, HALF, "h", (-0.03, 0.02))

    # The tilts of the view: θv in the arm's plane, then φv out of it.
    foot = arm_direction(np.radians(VIEW_DEG[0]))
    line([np.zeros(3), 1.02 * foot], color=VIEW, lw=0.9, ls=":")
    arc(1.02, (0, ARM_DEG), arm_direction, "θa", 1.1, DARK)
    arc(0.44, (0, VIEW_DEG[0]), arm_direction, "θv", 1.25, VIEW, at=30)
    arc(1.02, (0, VIEW_DEG[1]), lambda phi: tilt_direction(np.radians(VIEW_DEG[0]), phi), "φv", 1.12, VIEW)
    foot = arm_direction(np.radians(NORMAL_DEG[0]))
    line([np.zeros(3), 0.78 * foot], color=NORMAL, lw=0.9, ls=":")
    arc(0.78, (0, NORMAL_DEG[0]), arm_direction, "θn", 1.1, at=16)
    arc(
        0.78,
        (0, NORMAL_DEG[1]),
        lambda phi: tilt_direction(np.radians(NORMAL_DEG[0]), phi),
        "φn",
        1.12,
    )
    axes.margins(0.06)
    figure.savefig(path)
    print(path, path.stat().st_size)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
