"""Groups of photographs for a test with observers: can they tell renderings made from few of them?"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from impasto.angles.placement import arm_angles_deg
from impasto.angles.study import Point, Study, least_lights
from impasto.geometry import Lights, zenith_azimuth
from impasto.output import write_json

TEST_LIGHTS, GROUPS = 7, 5


def choose_test_lights(lights: Lights) -> list[int]:
    """Return seven lights spread along the arm, or in elevation, without the outermost [Chen2007]_, Fig. 11.

    Parameters
    ----------
    lights : Lights

    Returns
    -------
    list of int
        In rising order; fewer where there are few lights.
    """
    angle = arm_angles_deg(lights.direction)
    order = np.argsort(zenith_azimuth(lights.direction)[0] if angle is None else angle, kind="stable")
    places = np.round(np.linspace(0, len(order) - 1, TEST_LIGHTS + 2)).astype(int)[1:-1]
    return sorted({int(order[place]) for place in places})


def group_sizes(recommended: int, least: int, most: int) -> list[int]:
    """Return five numbers of photographs: all, the recommended one, and others in equal ratios around it.

    Fewer than five where there are not so many between `least` and `most`.
    """
    below = np.geomspace(least, recommended, 3) if recommended > least else np.array([least])
    above = np.geomspace(recommended, most, 3)
    sizes = {int(size) for size in np.round([*below, *above])}
    for size in range(least, most + 1):
        if len(sizes) >= GROUPS:
            break
        sizes.add(size)
    return sorted(sizes)


def write_groups(
    path: Path, study: Study, recommended: Point, test_lights: Sequence[str], sizes: Sequence[int] = ()
) -> Path:
    """Write groups of photographs and the test lights, as ``impasto experiment create --groups`` reads them.

    Parameters
    ----------
    path : Path
    study : Study
    recommended : Point
        The group that calculation recommends; the others are chosen in the same way.
    test_lights : sequence of str
        Names of photographs.
    sizes : sequence of int, optional
        Of the groups, so that several paintings can have the same ones; the recommended group is then the
        smallest with at least as many photographs as `recommended`. By default five around that.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    chosen = sorted(set(sizes)) or group_sizes(
        recommended.size, least_lights(study.refit.model), len(study.candidates)
    )
    serves = next((size for size in chosen if size >= recommended.size), None)
    write_json(
        path,
        {
            "groups": [
                {
                    "name": f"{size} angles",
                    "photographs": list(study.point(recommended.strategy, size).photographs),
                    "recommended": size == serves,
                }
                for size in chosen
            ],
            "test_lights": list(test_lights),
        },
    )
    return path
