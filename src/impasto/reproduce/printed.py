"""What the paper printed: its samples' gloss, their readings, and the ratios of its two models.

References
----------
[Chen2007]_, Tables I and II.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Printed:
    """One of the paper's samples.

    Parameters
    ----------
    gloss_level : str
    ratio_phong, ratio_torrance_sparrow : float
        As/Ad of the two models, Ad in luminance; Table II.
    gloss : dict of float to float
        Glossmeter readings by angle in degrees; Table I, which has four of the eight samples.
    """

    gloss_level: str
    ratio_phong: float
    ratio_torrance_sparrow: float
    gloss: dict[float, float]


PRINTED: dict[str, Printed] = {
    "a": Printed("high", 87.5, 5793.6, {20.0: 24.3, 60.0: 66.0, 85.0: 83.5}),
    "b": Printed("low", 0.2, 3.8, {20.0: 0.9, 60.0: 1.7, 85.0: 2.1}),
    "c": Printed("medium", 23.8, 1712.9, {20.0: 6.3, 60.0: 33.3, 85.0: 55.9}),
    "d": Printed("low", 0.7, 17.8, {20.0: 0.5, 60.0: 2.5, 85.0: 4.5}),
    "e": Printed("medium", 6.1, 142.6, {}),
    "f": Printed("low", 0.2, 4.3, {}),
    "g": Printed("high", 87.7, 1752.1, {}),
    "h": Printed("medium", 11.9, 560.9, {}),
}
