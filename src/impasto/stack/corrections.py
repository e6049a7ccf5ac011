"""What calibration files do to photographs as they are stacked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.calibrate.files import Calibration, Subject, read_calibration
from impasto.calibrate.response import Response
from impasto.capture import Capture, Photograph
from impasto.errors import CaptureError, Problem, raise_problems

Named = str | PathLike[str] | None

KINDS = ("oecf", "dark", "flat", "white", "colour", "steadiness")
_EVERY = "*"
# What the summary says where a step is left out.
_LEFT_OUT = {
    "oecf": "the camera's response: photographs count as their files state",
    "flat": "uneven light and vignetting",
    "white": "the absolute scale: albedo, gloss and κ are relative",
    "colour": "the camera's colours: its channels are shown as sRGB's",
}
_RAW_IS_LINEAR = "linear"


@dataclass(frozen=True)
class Corrections:
    """The calibration files of a stack.

    Parameters
    ----------
    files : dict of str to Calibration
        By kind; those that were given.
    shift_scale : float
        From pixels of the photographs whose shifts were measured to those that are stacked.
    """

    files: dict[str, Calibration] = field(default_factory=dict)
    shift_scale: float = 1.0

    def content(self, kind: str) -> dict[str, Any] | None:
        """Return what a kind of calibration holds, None without one."""
        return self.files[kind].content if kind in self.files else None

    def table(self, photograph: Photograph) -> NDArray[np.float64] | None:
        """Return relative radiance of every code, ndarray of shape (codes, C), from the camera's response."""
        content = self.content("oecf")
        if content is None or content["linear"]:
            return None
        return Response.from_json(content["response"]).table(photograph.dtype)

    def dark(self) -> NDArray[np.float32] | None:
        """Return the dark frame on a grid, ndarray of shape (rows, columns, C)."""
        content = self.content("dark")
        return None if content is None else np.array(content["grid"], np.float32)

    def gain(self, name: str) -> NDArray[np.float32] | None:
        """Return what a photograph is multiplied with, on a grid, ndarray of shape (rows, columns, C)."""
        content = self.content("flat")
        if content is None:
            return None
        grids = content["grids"]
        return (1 / np.array(grids.get(name, grids.get(_EVERY)), np.float64)).astype(np.float32)

    @property
    def largest_gain(self) -> float:
        """The largest factor of all flat fields, 1 without."""
        content = self.content("flat")
        if content is None:
            return 1.0
        return max(1.0, *(float(1 / np.min(grid)) for grid in content["grids"].values()))

    @property
    def touch_pixels(self) -> bool:
        """Whether samples are changed, and not just described."""
        return bool({"dark", "flat"} & self.files.keys())

    def shift(self, name: str) -> tuple[float, float] | None:
        """Return the columns and rows by which a photograph is to be shifted back, None if it is not."""
        content = self.content("steadiness")
        if content is None or name not in content["corrected"]:
            return None
        columns, rows = content["shift_px"][name]
        return float(columns) * self.shift_scale, float(rows) * self.shift_scale

    def attributes(self) -> dict[str, Any]:
        """Return the attributes of the stack that follow from the calibration."""
        more: dict[str, Any] = {
            "calibration": {
                kind: {"file": one.path.name, "made_from": one.made_from} for kind, one in self.files.items()
            }
        }
        if (white := self.content("white")) is not None:
            names = ("radiance", "light_rgb", "reflectance", "normal", "box", "spread", "lights")
            more["white_reference"] = {name: white[name] for name in names}
        if (colour := self.content("colour")) is not None:
            more["camera_colour"] = {
                "matrix": colour["methods"][colour["chosen"]]["matrix"],
                "white_xyz": colour["white_xyz"],
                "source": f"{self.files['colour'].path.name} ({colour['chosen']})",
            }
        return more

    @property
    def white_level(self) -> float:
        """What a perfect white diffuser reads, mean over the channels, of full scale; 1 if unknown."""
        white = self.content("white")
        return 1.0 if white is None else float(np.mean(white["radiance"]))

    def light_colour(self) -> dict[str, Any] | None:
        """Return the light's colour from the white reference as attributes, None without one."""
        white = self.content("white")
        if white is None:
            return None
        return {"light_rgb": white["light_rgb"], "light_rgb_source": "white reference"}

    def movement(self, photographs: Sequence[Photograph]) -> str:
        """Return in a sentence what is done about photographs that moved, "" without a measurement."""
        content = self.content("steadiness")
        if content is None:
            return ""
        shifts = {photograph.name: self.shift(photograph.name) for photograph in photographs}
        back = {name: float(np.hypot(*shift)) for name, shift in shifts.items() if shift is not None}
        said = "no photograph has moved: none is shifted"
        if back:
            most = max(back, key=lambda name: back[name])
            said = f"{len(back)} of {len(shifts)} photographs are shifted back, by up to "
            said += f"{back[most]:.2f} px ({most})"
        unknown = [name for name in shifts if content["shift_px"][name] is None]
        turned = [name for name in shifts if name in content["turned_px"]]
        for names, why in ((unknown, "their shift is not known"), (turned, "they are turned or scaled")):
            if names:
                said += f"; left where they are, because {why}: {', '.join(names)}"
        return said

    def uncalibrated(self, photographs: Sequence[Photograph]) -> str:
        """Return in a sentence what is not calibrated, "" if everything is."""
        raw = all(photograph.transfer == _RAW_IS_LINEAR for photograph in photographs)
        missing = [
            text
            for kind, text in _LEFT_OUT.items()
            if kind not in self.files and not (kind == "oecf" and raw)
        ]
        return f"not calibrated: {'; '.join(missing)}" if missing else ""


def read_corrections(named: dict[str, Named], capture: Capture) -> Corrections:
    """Read calibration files and check that they are for the photographs of a capture.

    Parameters
    ----------
    named : dict of str to path or None
        By kind.
    capture : Capture

    Raises
    ------
    CaptureError
        Listing every file that cannot be read, or is for another camera, ISO, aperture or size.
    """
    problems: list[Problem] = []
    files = {}
    for kind, name in named.items():
        if name is None:
            continue
        try:
            files[kind] = read_calibration(Path(name), kind)
        except CaptureError as error:
            problems += error.problems
            continue
        problems += _differences(files[kind], capture)
    scale = 0.5 if "steadiness" in files and _for_whole(files["steadiness"], capture.photographs[0]) else 1.0
    corrections = Corrections(files, scale)
    if (flat := corrections.content("flat")) is not None:
        problems += _flat_problems(files["flat"], flat, capture)
    if (steadiness := corrections.content("steadiness")) is not None:
        problems += [
            Problem(
                files["steadiness"].path.name,
                f"holds no shift of {photograph.name}",
                "Measure the shifts of the whole series",
            )
            for photograph in capture.photographs
            if photograph.name not in steadiness["shift_px"]
        ]
    if (oecf := corrections.content("oecf")) is not None:
        dtype = capture.photographs[0].dtype.name
        if dtype != oecf["dtype"]:
            what = f"is for photographs of {oecf['dtype']}, and these have {dtype}"
            do = "Leave it out, or calibrate with such photographs"
            problems.append(Problem(files["oecf"].path.name, what, do))
    if (white := corrections.content("white")) is not None:
        problems += _exposure_problems(files["white"], white, capture)
    raise_problems(CaptureError, problems)
    return corrections


def _differences(calibration: Calibration, capture: Capture) -> list[Problem]:
    """Return a problem for each way in which the photographs are not those that a calibration is for."""
    problems = {}
    for photograph in capture.photographs:
        size = (photograph.width, photograph.height)
        if photograph.whole_size is not None and _for_whole(calibration, photograph):
            size = photograph.whole_size
        subject = Subject(
            photograph.camera, photograph.iso, photograph.f_number, size, photograph.channels,
            photograph.dtype.name,
        )  # fmt: skip
        for difference in calibration.subject.differences(subject):
            do = "Calibrate with the settings of these photographs, or leave it out"
            problems[difference] = Problem(calibration.path.name, f"is for {difference}", do)
    return list(problems.values())


def _for_whole(calibration: Calibration, photograph: Photograph) -> bool:
    """Return whether a photograph is read at half the size that a calibration is for.

    Surfaces over the frame hold for it all the same, and shifts count half as many pixels.
    """
    return photograph.half_size and calibration.subject.size == photograph.whole_size


def _flat_problems(file: Calibration, flat: dict[str, Any], capture: Capture) -> list[Problem]:
    grids = flat["grids"]
    problems = [
        Problem(
            file.path.name,
            f"holds no flat field for {photograph.name}",
            "Photograph the card under each light",
        )
        for photograph in capture.photographs
        if photograph.name not in grids and _EVERY not in grids
    ]
    if capture.lights.near and not flat["fall_off_taken_out"]:
        what = (
            "corrects the fall-off of the lights too, which a fit accounts for as their positions are known"
        )
        do = "Make it with --lights FILE, the light file with these positions"
        problems.append(Problem(file.path.name, what, do))
    return problems


def _exposure_problems(file: Calibration, white: dict[str, Any], capture: Capture) -> list[Problem]:
    times = {photograph.exposure_s for photograph in capture.photographs}
    made = white.get("exposure_s")
    if made is None or len(times) != 1 or None in times or made in times:
        return []
    what = f"was made from photographs exposed for {made:g} s, and these were for {times.pop():g} s"
    return [Problem(file.path.name, what, "Photograph the white reference with the painting's exposure")]
