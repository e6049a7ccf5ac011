"""Pixels as they were photographed, drawn at random from a stack."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impasto.arm import find_arm
from impasto.evaluate.regions import Regions
from impasto.geometry import Camera, Lights, turn_about_z
from impasto.progress import progress
from impasto.store import STACK_CHUNK, Stack

# A large painting is sampled in this many blocks, so that not all of it has to be read.
_BLOCKS = 24


@dataclass(frozen=True)
class Photographed:
    """Pixels under all lights of a stack.

    Parameters
    ----------
    stack : Stack
    camera : Camera
        As `camera_for` has it.
    row, column : ndarray of shape (P,), int
    radiance : ndarray of shape (L, P, C), float32
        Relative radiance.
    """

    stack: Stack
    camera: Camera
    row: NDArray[np.intp]
    column: NDArray[np.intp]
    radiance: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.row)

    def select(self, index: ArrayLike) -> Photographed:
        """Return the pixels at `index` (integers or a boolean mask)."""
        chosen = np.asarray(index)
        return replace(
            self, row=self.row[chosen], column=self.column[chosen], radiance=self.radiance[:, chosen]
        )


def camera_for(lights: Lights, camera: Camera) -> Camera:
    """Return the camera that fits and renderings of a study take; for lights in one plane, moved into it.

    Such lights do not tell how far a normal tilts out of their plane, nor Ad and As apart from that tilt.
    Seen from o away, a Trowbridge-Reitz lobe of width c is one of width √(c² + o²). So with the view in the
    plane every normal has a place in it from which it reflects all lights of the plane alike, and a fit has
    no unknown left that they cannot tell.
    """
    arm = find_arm(lights.direction)
    if not arm.planar or lights.near or camera.distance_mm is not None:
        return camera
    view = arm.into(camera.view_direction) * [1.0, 0.0, 1.0]
    return replace(camera, view_direction=turn_about_z(view / np.linalg.norm(view), arm.azimuth))


def sample_stack(
    stack: Stack, count: int, regions: Regions | None = None, *, seed: int = 0, show: bool | None = None
) -> list[Photographed]:
    """Draw pixels of the painting and of each of its regions.

    Parameters
    ----------
    stack : Stack
    count : int
        At most this many of each; of large paintings they come from blocks of neighbouring pixels.
    regions : Regions, optional
    seed : int, optional
    show : bool, optional
        Whether to show a progress bar.

    Returns
    -------
    list of Photographed
        The painting's, then each region's.

    Raises
    ------
    StoreError
        If photographs are damaged or lost.
    """
    _, height, width, _ = stack.shape
    camera = camera_for(stack.lights, stack.camera)
    rng = np.random.default_rng(seed)
    corners = [(top, left) for top in range(0, height, STACK_CHUNK) for left in range(0, width, STACK_CHUNK)]
    if regions is None and len(corners) > _BLOCKS:
        corners = [corners[each] for each in sorted(rng.choice(len(corners), _BLOCKS, replace=False))]
    names = 1 + (len(regions.names) if regions else 0)
    available = np.zeros((len(corners), names), int)
    for block, (top, left) in enumerate(corners):
        label = _labels(regions, top, left, height, width)
        available[block] = [label.size, *np.bincount(label, minlength=names)[1:names]]
    parts: list[list[Photographed]] = [[] for _ in range(names)]
    with progress("Reading pixels", len(corners), show=show) as advance:
        for top, left in corners:
            rows = slice(top, min(top + STACK_CHUNK, height))
            columns = slice(left, min(left + STACK_CHUNK, width))
            label = _labels(regions, top, left, height, width)
            tile = stack.radiance(rows, columns)
            tile = tile.reshape(len(tile), label.size, -1)
            for number in range(names):
                members = np.arange(label.size) if number == 0 else np.flatnonzero(label == number)
                total = available[:, number].sum()
                share = min(len(members), round(count * len(members) / max(total, 1)))
                chosen = np.sort(rng.choice(members, min(share, len(members)), replace=False))
                row, column = np.divmod(chosen, columns.stop - columns.start)
                parts[number].append(Photographed(stack, camera, row + top, column + left, tile[:, chosen]))
            advance(1)
    return [_join(of_name) for of_name in parts]


def _labels(regions: Regions | None, top: int, left: int, height: int, width: int) -> NDArray[np.uint16]:
    bottom, right = min(top + STACK_CHUNK, height), min(left + STACK_CHUNK, width)
    if regions is None:
        return np.zeros((bottom - top) * (right - left), np.uint16)
    return regions.label[top:bottom, left:right].ravel()


def _join(parts: list[Photographed]) -> Photographed:
    return Photographed(
        parts[0].stack,
        parts[0].camera,
        np.concatenate([part.row for part in parts]),
        np.concatenate([part.column for part in parts]),
        np.concatenate([part.radiance for part in parts], axis=1),
    )
