"""The display that a rendering is asked for, and how its colours get there."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from impasto.calibrate.display import read_display
from impasto.colour.adaptation import ADAPTATIONS, WHITE_POINTS, Adaptation, xy_to_xyz
from impasto.colour.camera import CameraColour, camera_colour
from impasto.colour.displays import Display, display_p3, srgb_display
from impasto.colour.icc_display import icc_display
from impasto.colour.rendition import HIGHLIGHT_RULES, HighlightRule, Rendition
from impasto.errors import CaptureError, OptionError, Problem, raise_problems
from impasto.store import PublishedStack, Stack

_NAMED = {"srgb": srgb_display, "display-p3": display_p3}
_LIGHT = "light"

# What is brighter by far than any highlight over the paint around it; floats end at 3.4e38.
_MOST_EXPOSURE = 1e9


def requested_rendition(
    stack: Stack | PublishedStack,
    *,
    display: str | PathLike[str] | Display,
    exposure: float,
    white_point: str | tuple[float, float] | None,
    adaptation: str,
    highlights: str,
) -> Rendition:
    """Return how a stack's radiance is to be shown.

    Parameters
    ----------
    stack : Stack
    display : str, path or Display
        ``srgb``, ``display-p3``, the file of an ICC profile, or a calibration file of a display.
    exposure : float
        Factor on the radiance.
    white_point : str or (float, float), optional
        What is shown in the colour of the display's white: an illuminant, CIE ``x,y``, or ``light`` for the
        colour of the stack's light; by default, the white that the camera's colours are calibrated for.
    adaptation, highlights : str
        As for `Rendition`.

    Raises
    ------
    OptionError
        Listing every option that cannot be used.
    """
    problems: list[Problem] = []
    if not 0 < exposure <= _MOST_EXPOSURE:
        what = f"is not above 0, up to {_MOST_EXPOSURE:g}"
        problems.append(Problem(f"--exposure {exposure:g}", what, "Give a factor such as 2 or 0.5"))
    for option, value, known in (
        ("--adaptation", adaptation, ADAPTATIONS),
        ("--highlights", highlights, HIGHLIGHT_RULES),
    ):
        if value not in known:
            problems.append(Problem(f"{option} {value}", "is not known", f"Choose {' or '.join(known)}"))
    camera = camera_colour(stack.attributes.get("camera_colour"))
    try:
        found: Display | None = requested_display(display)
    except OptionError as error:
        found = None
        problems += error.problems
    try:
        white_xyz = _white_xyz(white_point, camera, stack)
    except OptionError as error:
        problems += error.problems
    raise_problems(OptionError, problems)
    return Rendition(
        found,
        camera=camera,
        channels=stack.shape[3],
        exposure=exposure,
        white_xyz=white_xyz,
        adaptation=cast(Adaptation, adaptation),
        highlights=cast(HighlightRule, highlights),
    )


def requested_display(display: str | PathLike[str] | Display) -> Display:
    """Return the display of a name or a file.

    Raises
    ------
    OptionError
        If there is none of that name, or the file cannot be used.
    """
    if not isinstance(display, str | PathLike):
        return display
    if str(display) in _NAMED:
        return _NAMED[str(display)]()
    path, where = Path(display), f"--display {display}"
    if path.suffix.lower() == ".json":
        try:
            return read_display(path)
        except CaptureError as error:
            raise OptionError(error.problems) from error
    try:
        data = path.read_bytes()
    except OSError as error:
        names = ", ".join(_NAMED)
        what = f"is neither a display's name nor a file that can be read: {error.strerror}"
        raise OptionError(
            Problem(where, what, f"Choose {names}, an ICC profile or a calibration file")
        ) from error
    return icc_display(data, where)


def _white_xyz(
    white_point: str | tuple[float, float] | None, camera: CameraColour, stack: Stack | PublishedStack
) -> NDArray[np.float64]:
    if white_point is None:
        return camera.white_xyz
    if white_point == _LIGHT:
        light = stack.light_rgb
        xyz = camera.white_xyz if len(light) == 1 else np.asarray(camera.xyz(light), np.float64)
        return np.asarray(xyz / xyz[1])
    if isinstance(white_point, str) and white_point in WHITE_POINTS:
        return xy_to_xyz(WHITE_POINTS[white_point])
    try:
        parts: Any = white_point.split(",") if isinstance(white_point, str) else white_point
        x, y = (float(part) for part in parts)
        if not (x > 0 and y > 0 and x + y < 1):
            raise ValueError
    except ValueError:
        what = "is neither an illuminant nor a chromaticity x,y of a colour"
        known = ", ".join(WHITE_POINTS)
        raise OptionError(
            Problem(f"--white-point {white_point}", what, f"Choose {known}, {_LIGHT}, or write 0.3127,0.329")
        ) from None
    return xy_to_xyz((x, y))
