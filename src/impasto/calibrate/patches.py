"""Patches of a target: where they lie in a photograph, what is known of them, and what is read there."""

from __future__ import annotations

import csv
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.errors import CaptureError, Problem, raise_problems

Array = NDArray[np.float64]
Box = tuple[int, int, int, int]

_EDGES = ("column0_px", "row0_px", "column1_px", "row1_px")
# The outer part of a patch, which the lens blurs into its neighbours.
_MARGIN = 0.12
_LEAST_PX = 9


@dataclass(frozen=True)
class Patches:
    """The patches of a target in a photograph.

    Parameters
    ----------
    names : tuple of str
    boxes : tuple of (int, int, int, int)
        First column, first row, end column and end row of each.
    known : dict of str to ndarray of shape (P,)
        What is known of them, by the heading of the table.
    source : dict
        File and SHA-256 of the table.
    """

    names: tuple[str, ...]
    boxes: tuple[Box, ...]
    known: dict[str, Array]
    source: dict[str, Any]

    def without(self, names: Sequence[str]) -> Patches:
        """Return the patches but for some.

        Raises
        ------
        CaptureError
            If a name is none of a patch.
        """
        raise_problems(
            CaptureError,
            [
                Problem(f"--without {name}", "is no patch of the table", "Correct the name")
                for name in names
                if name not in self.names
            ],
        )
        kept = [row for row, name in enumerate(self.names) if name not in names]
        return Patches(
            tuple(self.names[row] for row in kept),
            tuple(self.boxes[row] for row in kept),
            {heading: values[kept] for heading, values in self.known.items()},
            self.source,
        )

    def inner(self, row: int) -> tuple[slice, slice]:
        """Return rows and columns of a patch without its margin."""
        left, top, right, bottom = self.boxes[row]
        across, down = int(_MARGIN * (right - left)), int(_MARGIN * (bottom - top))
        return slice(top + down, bottom - down), slice(left + across, right - across)

    def read(self, image: NDArray[Any]) -> tuple[Array, Array, NDArray[np.intp]]:
        """Return what a photograph (H, W, C) shows in each patch, as `read_parts` does."""
        return read_parts([image[self.inner(row)] for row in range(len(self.names))])

    def problems(self, height: int, width: int) -> list[Problem]:
        """Return what is wrong with the boxes for a photograph."""
        found = []
        for row, (name, box) in enumerate(zip(self.names, self.boxes, strict=True)):
            rows, columns = self.inner(row)
            inside = 0 <= box[0] < box[2] <= width and 0 <= box[1] < box[3] <= height
            if not inside:
                what = f"has a box that is not inside of the photograph of {width} x {height} pixels"
                found.append(Problem(f"patch {name}", what, "Correct its row in the table"))
            elif (rows.stop - rows.start) * (columns.stop - columns.start) < _LEAST_PX:
                what = f"has fewer than {_LEAST_PX} pixels"
                found.append(Problem(f"patch {name}", what, "Photograph the target larger"))
        return found


def read_parts(parts: Sequence[NDArray[Any]]) -> tuple[Array, Array, NDArray[np.intp]]:
    """Return what is seen in patches.

    Parameters
    ----------
    parts : sequence, length P, of ndarray of shape (rows, columns, C)
        What a photograph shows of each.

    Returns
    -------
    mean : ndarray of shape (P, C)
    variance : ndarray of shape (P, C)
        About the plane that fits the patch best, so that light that falls off across it does not count.
    pixels : ndarray of shape (P,)
    """
    means, variances, pixels = [], [], []
    for part in parts:
        patch = np.asarray(part, np.float64)
        y, x = np.mgrid[-1 : 1 : patch.shape[0] * 1j, -1 : 1 : patch.shape[1] * 1j]
        plane = np.column_stack([np.ones(x.size), x.ravel(), y.ravel()])
        samples = patch.reshape(x.size, -1)
        fit, *_ = np.linalg.lstsq(plane, samples, rcond=None)
        means.append(samples.mean(axis=0))
        variances.append(((samples - plane @ fit) ** 2).sum(axis=0) / max(1, x.size - 3))
        pixels.append(x.size)
    return np.array(means), np.array(variances), np.array(pixels)


def read_patches(path: Path, *needed: tuple[str, ...]) -> Patches:
    """Read the table of a target: one row per patch, with its box in pixels and what is known of it.

    Parameters
    ----------
    path : Path
        CSV with the columns ``patch``, ``column0_px``, ``row0_px``, ``column1_px``, ``row1_px`` and others of
        numbers.
    *needed : tuple of str
        Sets of further columns of which one must be there in full.

    Raises
    ------
    CaptureError
        With everything that is wrong.
    """
    try:
        data = path.read_bytes()
        text = data.decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise CaptureError(Problem(str(path), f"cannot be read: {error}", "Correct the file")) from error
    dialect = ";" if text.count(";") > text.count(",") else ","
    reader = csv.DictReader(text.splitlines(), delimiter=dialect)
    headings = [heading.strip() for heading in reader.fieldnames or ()]
    reader.fieldnames = headings
    problems = [
        Problem(path.name, f"has no column {heading}", "Add it; see docs/calibration.md")
        for heading in ("patch", *_EDGES)
        if heading not in headings
    ]
    if needed and not any(set(headings) >= set(group) for group in needed):
        wanted = " or ".join(", ".join(group) for group in needed)
        problems.append(
            Problem(path.name, f"does not say what is known: expected {wanted}", "Add the columns")
        )
    raise_problems(CaptureError, problems)
    names, numbers = [], []
    values = [heading for heading in headings if heading != "patch"]
    for line, row in enumerate(reader, start=2):
        try:
            numbers.append([float((row[heading] or "").replace(",", ".")) for heading in values])
            names.append((row["patch"] or "").strip())
        except ValueError:
            what = f"row {line} holds something that is not a number"
            problems.append(Problem(path.name, what, "Correct or remove the row"))
    if not names and not problems:
        problems.append(Problem(path.name, "holds no patches", "Write one row per patch"))
    problems += [
        Problem(path.name, f"names the patch {name} twice", "Give each patch its own name")
        for name in sorted({name for name in names if names.count(name) > 1})
    ]
    raise_problems(CaptureError, problems)
    table = dict(zip(values, np.array(numbers).T, strict=True))
    edges = np.rint(np.column_stack([table.pop(edge) for edge in _EDGES])).astype(int)
    boxes = tuple((int(box[0]), int(box[1]), int(box[2]), int(box[3])) for box in edges)
    source = {"file": path.name, "sha256": hashlib.sha256(data).hexdigest()}
    return Patches(tuple(names), boxes, table, source)
