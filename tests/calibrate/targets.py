"""Photographs of colour targets and grey wedges, turned, tilted and spoilt, with the truth."""

from functools import cache

import numpy as np
from scipy import ndimage

from impasto.calibrate.known_targets import KNOWN_TARGETS
from impasto.calibrate.lattice import fit_homography, project
from impasto.capture.simulate.charts import colour_chart

CHART = (400, 600)
_BLACK = 0.009


def classic():
    """Return the simulator's chart (H, W, 3), and the boxes of its patches: row0, column0, row1, column1."""
    return colour_chart().image(CHART), np.array(colour_chart().boxes(CHART), float)


@cache
def sg():
    """Return the Digital SG as a camera of the wide gamut of ProPhoto RGB sees it, and its boxes."""
    import colour

    known = KNOWN_TARGETS["sg"]
    reflectance = colour.XYZ_to_RGB(known.xyz, "ProPhoto RGB", apply_cctf_encoding=False)
    return _patches(np.maximum(reflectance, 0), known.across, (56, 56), (50, 50))


@cache
def wedge(count=20, step=0.1, first=0.05, patch=(120, 40), gap=0, ground=0.004):
    """Return a wedge of densities, on a ground that is broader than it, and its boxes."""
    reflectance = np.repeat(10.0 ** -(first + step * np.arange(count))[:, None], 3, axis=1)
    cell = (patch[0], patch[1] + gap)
    image, boxes = _patches(reflectance, count, cell, patch, ground=ground)
    image = np.pad(image, ((40, 40), (30, 30), (0, 0)), constant_values=ground)
    return image, boxes + np.array([40, 30, 40, 30])


def _patches(reflectance, across, cell, patch, ground=_BLACK):
    rows = len(reflectance) // across
    image = np.full((rows * cell[0], across * cell[1], 3), ground)
    boxes = []
    for number, level in enumerate(reflectance):
        row, column = divmod(number, across)
        top, left = row * cell[0] + (cell[0] - patch[0]) // 2, column * cell[1] + (cell[1] - patch[1]) // 2
        boxes.append((top, left, top + patch[0], left + patch[1]))
        image[top : top + patch[0], left : left + patch[1]] = level
    return image, np.array(boxes, float)


def photograph(
    drawn=None,
    *,
    turns=0,
    angle_deg=0.0,
    perspective=0.0,
    mirrored=False,
    covered=None,
    haze=0.0,
    size=(480, 640),
    noise=0.003,
    gain=(0.7, 1.0, 0.5),
    around=0.2,
    fall_off=0.2,
    seed=0,
):
    """Return linear radiance (H, W, 3), and where the middles of the patches lie, column first.

    `drawn` is an image and boxes as the functions above return them, by default the classic chart. `turns`
    are quarter turns against the clock, `perspective` is by how much the lower end is wider than the upper
    one, as a share of the middle, `covered` are rows and columns of the chart under a grey card, `haze` is
    the share of light that is veiling glare. The light rises by `fall_off` across the frame.
    """
    chart, boxes = drawn or classic()
    chart = chart.copy()
    if covered is not None:
        chart[covered] = 0.5
    middles = np.column_stack([boxes[:, 1] + boxes[:, 3], boxes[:, 0] + boxes[:, 2]]) / 2
    height, width = chart.shape[:2]
    if mirrored:
        chart = chart[:, ::-1]
        middles[:, 0] = width - middles[:, 0]
    scale = _scale(turns, (height, width), size)
    corners = scale / 2 * np.array([[-width, -height], [width, -height], [width, height], [-width, height]])
    angle = np.radians(angle_deg - 90 * turns)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    corners = corners @ turn
    corners[:, 0] *= 1 + perspective * corners[:, 1] / np.ptp(corners[:, 1])
    corners += [size[1] / 2 + 9, size[0] / 2 - 7]
    flat = np.array([[0, 0], [width, 0], [width, height], [0, height]], float)
    rows, columns = np.indices(size)
    place = project(fit_homography(corners, flat), np.stack([columns, rows], axis=-1).astype(float) + 0.5)
    where = [place[..., 1] - 0.5, place[..., 0] - 0.5]
    image = np.stack(
        [ndimage.map_coordinates(chart[..., c], where, order=1, cval=around) for c in range(3)], axis=-1
    )
    image = ndimage.gaussian_filter(image, (0.7, 0.7, 0))
    image = (1 - haze) * image + haze * 0.2
    image = image * gain * (1 + fall_off * columns / size[1])[..., None]
    image = image + np.random.default_rng(seed).normal(0, noise, image.shape) * np.sqrt(image)
    return np.maximum(image, 0), project(fit_homography(flat, corners), middles) - 0.5


def _scale(turns, chart, size):
    """Return how large a chart is drawn: over half of the frame's height, and within its width."""
    if turns % 2 == 0:
        return min(0.55 * min(size) / min(chart), 0.8 * size[1] / chart[1])
    return 0.55 * min(size) / max(chart) * 1.3


def painting(size=(480, 640), seed=3):
    """Return radiance of a painting of a regular grid of coloured rectangles, as many abstract ones are."""
    rng = np.random.default_rng(seed)
    image = np.full((*size, 3), 0.05)
    step = 70
    for row in range(15, size[0] - step, step):
        for column in range(15, size[1] - step, step):
            image[row : row + 56, column : column + 56] = rng.uniform(0.03, 0.9, 3)
    image = ndimage.gaussian_filter(image, (0.7, 0.7, 0))
    return image + rng.normal(0, 0.003, image.shape) * np.sqrt(image)


def scattered(size=(480, 640), seed=4):
    """Return radiance of rectangles of all sizes and places."""
    rng = np.random.default_rng(seed)
    image = np.full((*size, 3), 0.2)
    for _ in range(60):
        row, column = rng.integers(0, size[0] - 20), rng.integers(0, size[1] - 20)
        height, width = rng.integers(15, 120, 2)
        image[row : row + height, column : column + width] = rng.uniform(0.03, 0.9, 3)
    return ndimage.gaussian_filter(image, (0.7, 0.7, 0))
