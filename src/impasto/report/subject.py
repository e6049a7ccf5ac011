"""What a report is about: one store, its photographs, its fits, and pixels spread over it."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.colour import encode_srgb, quantise
from impasto.evaluate.sampling import PaintingSample
from impasto.models import parse_model
from impasto.page import Picture
from impasto.store import Fit, Stack, open_fit, open_stack

PICTURE_PX = 640
"""Pictures of the painting are thinned out to at most this many pixels along their longer side."""


@dataclass(frozen=True)
class Subject:
    """The store that a report is about; what is asked for is read once.

    Parameters
    ----------
    store : Path
    models : tuple of str
        The fitted models; the maps of the first are shown.
    """

    store: Path
    models: tuple[str, ...]

    @cached_property
    def stack(self) -> Stack:
        """The photographs."""
        return open_stack(self.store)

    @cached_property
    def fits(self) -> dict[str, Fit]:
        """The fits by their models."""
        return {model: open_fit(self.store, model) for model in self.models}

    @cached_property
    def sample(self) -> PaintingSample:
        """Pixels spread over the painting."""
        return PaintingSample(self.stack, self.fits)

    @property
    def sampled(self) -> str:
        """How many pixels the figures are from, as part of a sentence."""
        _, height, width, _ = self.stack.shape
        count = len(self.sample)
        if count == height * width:
            return f"all {count:,} pixels"
        return f"{count:,} of the {height * width:,} pixels, evenly spread"

    @property
    def step(self) -> int:
        """Distance of the pixels in the pictures of the painting."""
        return -(-max(self.stack.shape[1:3]) // PICTURE_PX)

    @cached_property
    def exposure(self) -> float:
        """Factor on radiance in pictures: the 99th percentile of the diffuse magnitude is shown as white."""
        diffuse = self.sample.values(self.models[0], "diffuse")
        finite = diffuse[np.isfinite(diffuse)]
        high = float(np.percentile(finite, 99)) if finite.size else 1.0
        return 1 / high if high > 0 else 1.0

    def photograph(self, light: int) -> NDArray[np.float32]:
        """Return a photograph, every `step`-th pixel, shape (H, W, C), relative radiance."""
        _, height, width, _ = self.stack.shape
        radiance = self.stack.radiance(slice(0, height), slice(0, width), [light], step=self.step)
        return np.asarray(radiance[0])

    def shown(self, image_linear: NDArray[np.float32], caption: str, alt: str, light: int) -> Picture:
        """Return relative radiance as a picture in sRGB, as if the light had unit strength.

        Parameters
        ----------
        image_linear : ndarray of shape (H, W, C)
        caption, alt : str
        light : int
            Under which light it is.
        """
        import imagecodecs

        strength = float(self.stack.lights.intensity[light].mean())
        image = quantise(encode_srgb(np.nan_to_num(image_linear), self.exposure / strength), np.uint8)
        image = image[..., 0] if image.shape[-1] == 1 else image
        return Picture(bytes(imagecodecs.png_encode(image)), caption, alt=alt)


def title(model: str) -> str:
    """Return a model's name in words."""
    return parse_model(model).title


def drawn(draw: Callable[..., None], *arguments: Any, **options: Any) -> bytes:
    """Return the PNG file that a function draws, whose first argument is the path to write to."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.png"
        draw(path, *arguments, **options)
        return path.read_bytes()
