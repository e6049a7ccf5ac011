"""The relighting methods in use, fitted to the same photographs, so that a model has something to beat."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from impasto.colour import decode_srgb, encode_srgb
from impasto.evaluate.errors import ErrorAccumulator, ImageErrors, mean_errors
from impasto.geometry import Array, Lights
from impasto.progress import progress
from impasto.store import Stack

Values = NDArray[np.float32]

_BAND_BYTES = 128e6
_TRIAL_PIXELS = 40_000


@dataclass(frozen=True)
class BaselineErrors:
    """The errors of a relighting method that knows no reflectance model.

    Parameters
    ----------
    method : str
        Its name.
    coefficients : int
        Numbers per pixel and channel; for those that keep the photographs themselves, how many these are.
    scale : str
        ``linear`` or ``srgb``: in which values of the photographs it was fitted, the better of both.
    lights : tuple of ImageErrors
        One entry per held-out photograph.
    mean : ImageErrors
        The mean over them.
    """

    method: str
    coefficients: int
    scale: str
    lights: tuple[ImageErrors, ...]
    mean: ImageErrors


@dataclass(frozen=True)
class _Method:
    """A method that predicts each held-out photograph as a weighted sum of the others."""

    name: str
    coefficients: int
    weights: Array
    scales: tuple[str, ...] = ("linear", "srgb")
    chroma: bool = False

    def predict(self, photographs: Values) -> Values:
        """Return (H, N, C) for photographs (L, N, C), in the same scale."""
        weights = self.weights.astype(np.float32)
        if not self.chroma:
            return np.tensordot(weights, photographs, 1)
        level = photographs.mean(axis=-1, keepdims=True)
        colour = photographs.sum(axis=0) / np.maximum(level.sum(axis=0), np.float32(1e-9))
        result: Values = np.tensordot(weights, level, 1) * colour
        return result


def polynomial(direction: Array) -> Array:
    """Return the terms of a polynomial texture map, (L, 6) [Malzbender2001]_, eq. 1."""
    x, y, _ = direction.T
    return np.stack([x * x, y * y, x * y, x, y, np.ones_like(x)], axis=1)


def harmonics(direction: Array, order: int, *, hemisphere: bool) -> Array:
    """Return real spherical harmonics up to an order, (L, (order + 1)²), without their constant factors.

    Parameters
    ----------
    direction : ndarray of shape (L, 3)
    order : int
    hemisphere : bool
        Whether they are those of the hemisphere, with 2 cos θ − 1 for cos θ [Gautron2004]_, eq. 6.
    """
    from scipy.special import lpmv

    cosine = np.clip(2.0 * direction[:, 2] - 1.0 if hemisphere else direction[:, 2], -1.0, 1.0)
    azimuth = np.arctan2(direction[:, 1], direction[:, 0])
    terms = []
    for degree in range(order + 1):
        for m in range(-degree, degree + 1):
            legendre = lpmv(abs(m), degree, cosine)
            terms.append(legendre * (np.cos(m * azimuth) if m >= 0 else np.sin(-m * azimuth)))
    return np.stack(terms, axis=1)


def _least_squares(basis: Callable[[Array], Array], seen: Array, wanted: Array) -> Array:
    # Directions far from a hemisphere's whole leave some functions all but alike: these are not told apart.
    result: Array = basis(wanted) @ np.linalg.pinv(basis(seen), rcond=1e-4)
    return result


def _splines(seen: Array, wanted: Array) -> Array:
    """Return the weights of thin plate splines; of lights on a line or in one place, those of least norm."""
    from scipy.special import xlogy

    def terms(direction: Array) -> Array:
        squares = np.square(direction[:, None, :2] - seen[:, :2]).sum(axis=-1)
        return np.hstack([xlogy(squares, squares), np.ones((len(direction), 1)), direction[:, :2]])

    count = len(seen)
    system = np.zeros((count + 3, count + 3))
    system[:count] = terms(seen)
    system[count:, :count] = system[:count, count:].T
    found: Array = terms(wanted) @ np.linalg.pinv(system, rcond=1e-10, hermitian=True)[:, :count]
    return found


def methods(seen: Array, wanted: Array) -> list[_Method]:
    """Return the methods that so many lights allow, for directions seen (L, 3) and wanted (H, 3)."""
    count = len(seen)
    ptm = _least_squares(polynomial, seen, wanted)
    found = [
        _Method("PTM", 6, ptm),
        _Method("LRGB PTM", 6, ptm, chroma=True),
    ]
    for hemisphere, name in ((True, "HSH"), (False, "SH")):
        for order in (2, 3):
            weights = _least_squares(
                lambda direction, order=order, hemisphere=hemisphere: harmonics(  # type: ignore[misc]
                    direction, order, hemisphere=hemisphere
                ),
                seen,
                wanted,
            )
            found.append(_Method(f"{name} order {order}", (order + 1) ** 2, weights))
    nearest = np.eye(count)[np.argmax(wanted @ seen.T, axis=1)]
    found += [
        _Method("RBF (thin plate)", count, _splines(seen, wanted)),
        _Method("nearest photograph", count, nearest),
        _Method("Lambert", 3, _least_squares(lambda direction: direction, seen, wanted), ("linear",)),
    ]
    return [method for method in found if method.coefficients <= count]


def baseline_errors(
    stack: Stack, seen: Sequence[int], held: Sequence[int], show_progress: bool | None = None
) -> tuple[BaselineErrors, ...]:
    """Predict the held-out photographs by the relighting methods in use, and compare.

    Parameters
    ----------
    stack : Stack
    seen, held : sequence of int
        Numbers of the photographs that are fitted and held out.
    show_progress : bool, optional

    Notes
    -----
    Each method is tried on linear radiance and on sRGB values, and the better is reported: this is the one
    thing that the held-out photographs decide, and it is in the baselines' favour.
    """
    lights = stack.lights
    tried = methods(lights.direction[list(seen)], lights.direction[list(held)])
    scales = _better_scales(stack, lights, tried, seen, held)
    _, height, width, channels = stack.shape
    gathered = [[ErrorAccumulator(height, width, channels) for _ in held] for _ in tried]
    rows = int(np.clip(_BAND_BYTES / (4 * width * channels * (len(seen) + len(held))), 16, 512))
    with progress("Comparing baselines", height, show=show_progress) as advance:
        for top in range(0, height, rows):
            band = slice(top, min(top + rows, height))
            photographs = stack.radiance(band, slice(0, width), held)
            given = {
                scale: _given(stack, lights, band, slice(0, width), seen, scale) for scale in set(scales)
            }
            for method, scale, accumulators in zip(tried, scales, gathered, strict=True):
                predicted = _radiance(method.predict(given[scale]), lights, held, scale)
                for photograph, rendering, sums in zip(photographs, predicted, accumulators, strict=True):
                    rendering = rendering.reshape(photograph.shape)
                    sums.add(
                        photograph,
                        rendering,
                        encode_srgb(photograph),
                        encode_srgb(rendering),
                        photograph >= stack.clip_level,
                    )
            advance(band.stop - band.start)
    found = []
    for method, scale, accumulators in zip(tried, scales, gathered, strict=True):
        errors = tuple(sums.result() for sums in accumulators)
        found.append(BaselineErrors(method.name, method.coefficients, scale, errors, mean_errors(errors)))
    return tuple(found)


def _given(
    stack: Stack, lights: Lights, rows: slice, columns: slice, seen: Sequence[int], scale: str
) -> Values:
    """Return photographs (L, N, C) per unit of intensity; what is missing counts as black."""
    radiance = np.nan_to_num(stack.radiance(rows, columns, seen))
    radiance /= lights.intensity[list(seen)].astype(np.float32)[:, None, None, :]
    values = radiance if scale == "linear" else encode_srgb(radiance)
    return values.reshape(len(seen), -1, stack.shape[3])


def _radiance(values: Values, lights: Lights, held: Sequence[int], scale: str) -> Values:
    linear = values if scale == "linear" else decode_srgb(np.maximum(values, np.float32(0.0)))
    intensity = lights.intensity[list(held)].astype(np.float32)[:, None, :]
    return np.maximum(linear, np.float32(0.0)) * intensity


def _better_scales(
    stack: Stack, lights: Lights, tried: Sequence[_Method], seen: Sequence[int], held: Sequence[int]
) -> list[str]:
    """Return for each method the scale in which it predicts a block in the middle of the picture better."""
    _, height, width, _ = stack.shape
    side = int(np.sqrt(_TRIAL_PIXELS))
    rows, columns = (
        slice(max(0, (size - side) // 2), min(size, (size + side) // 2)) for size in (height, width)
    )
    truth = np.clip(np.nan_to_num(encode_srgb(stack.radiance(rows, columns, held))), 0, 1)
    truth = truth.reshape(len(held), -1, stack.shape[3])
    given = {scale: _given(stack, lights, rows, columns, seen, scale) for scale in ("linear", "srgb")}

    def psnr(method: _Method, scale: str) -> float:
        shown = encode_srgb(_radiance(method.predict(given[scale]), lights, held, scale))
        squares = np.square(np.clip(shown, 0, 1) - truth).mean(axis=(1, 2))
        return float(-np.log10(squares + 1e-12).mean())

    return [max(method.scales, key=lambda scale: psnr(method, scale)) for method in tried]
