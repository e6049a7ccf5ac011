"""A camera's response: from the codes of a photograph to relative radiance."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_NODES = 512
# Share of the sum of squared residuals that noise would leave; the spline follows the data more closely than
# that, because a response may bend sharply, as sRGB's does near black.
_SMOOTHING = 0.15
# Nobody knows the reflectances of a target better than this.
_LEAST_SD = 3e-4
# Patches whose codes above black differ by less than this share, as those of several exposures may, count as
# one: a spline through both would follow their noise.
_SAME = 0.02


@dataclass(frozen=True)
class Response:
    """The opto-electronic conversion function of each channel, inverted.

    Parameters
    ----------
    black : ndarray of shape (C,)
        Code of no light.
    code : ndarray of shape (C, N)
        Codes above black, ascending.
    radiance : ndarray of shape (C, N)
        Relative radiance of these, ascending, 1 for the largest code.
    measured : ndarray of shape (C, 2)
        Lowest and highest code that a patch was seen at; beyond them the function goes on as a power.

    References
    ----------
    [ISO14524]_
    """

    black: Array
    code: Array
    radiance: Array
    measured: Array

    def __call__(self, codes: Array) -> Array:
        """Return relative radiance of codes, both of shape (..., C)."""
        out = np.empty(codes.shape)
        for channel, (black, nodes, values) in enumerate(
            zip(self.black, self.code, self.radiance, strict=True)
        ):
            above = np.maximum(codes[..., channel] - black, nodes[0] * 1e-3)
            logarithm = np.log(nodes)
            at = np.log(above)
            result = np.interp(at, logarithm, np.log(values))
            slope = np.log(values[1] / values[0]) / (logarithm[1] - logarithm[0])
            result = np.where(at < logarithm[0], np.log(values[0]) + slope * (at - logarithm[0]), result)
            out[..., channel] = np.where(codes[..., channel] > black, np.exp(result), 0.0)
        return out

    def codes(self, radiance: Array) -> Array:
        """Return the codes of relative radiance, both of shape (..., C), within the range of the nodes."""
        out = np.empty(radiance.shape)
        for channel, (black, nodes, values) in enumerate(
            zip(self.black, self.code, self.radiance, strict=True)
        ):
            level = np.log(np.maximum(radiance[..., channel], values[0]))
            out[..., channel] = black + np.exp(np.interp(level, np.log(values), np.log(nodes)))
        return out

    def table(self, dtype: np.dtype[Any]) -> Array:
        """Return relative radiance of every code of a type, ndarray of shape (codes, C)."""
        codes = np.arange(np.iinfo(dtype).max + 1, dtype=np.float64)
        return self(np.repeat(codes[:, None], len(self.black), axis=1))

    def as_json(self) -> dict[str, Any]:
        """Return it as data for JSON."""
        return {name: np.asarray(value).tolist() for name, value in vars(self).items()}

    @staticmethod
    def from_json(content: dict[str, Any]) -> Response:
        """Return the response that a calibration file holds."""
        names = ("black", "code", "radiance", "measured")
        return Response(*(np.array(content[name], np.float64) for name in names))


def fit_response(code: Array, sd: Array, radiance: Array, black: Array, largest: float) -> Response:
    """Fit a response to patches of known radiance.

    Parameters
    ----------
    code : ndarray of shape (P, C)
        Mean code of each patch.
    sd : ndarray of shape (P, C)
        Standard deviation of that mean.
    radiance : ndarray of shape (P,) or (P, C)
        Relative radiance, up to a factor.
    black : ndarray of shape (C,)
    largest : float
        The largest code, which becomes radiance 1 in each channel.

    Notes
    -----
    A cubic smoothing spline of the logarithm of the radiance against that of the code above black, in which a
    linear response and a power are straight lines.
    """
    from scipy.interpolate import UnivariateSpline  # long to import, and not used to apply a response

    channels = code.shape[1]
    radiance = np.broadcast_to(np.reshape(radiance, (len(code), -1)), code.shape)
    nodes, values, measured = [], [], []
    for channel in range(channels):
        order = np.argsort(code[:, channel])
        above = code[order, channel] - black[channel]
        x, y, relative = _merged(np.log(above), np.log(radiance[order, channel]), sd[order, channel] / above)
        slope = np.maximum(np.gradient(y, x), 0.1) if len(x) > 2 else np.ones(len(x))
        weight = 1 / np.hypot(relative * slope, _LEAST_SD)
        with warnings.catch_warnings():
            # Few patches with much noise cannot be followed that closely, and then are by less.
            warnings.simplefilter("ignore", UserWarning)
            spline = UnivariateSpline(x, y, w=weight, k=min(3, len(x) - 1), s=_SMOOTHING * len(x))
        top = np.log(largest - black[channel])
        low = min(x[0], top - np.log(1e5))
        at = np.linspace(low, top, _NODES)
        inside = np.clip(at, x[0], x[-1])
        level = spline(inside)
        first, last = (float(spline.derivative()(end)) for end in (x[0], x[-1]))
        level = (
            level + np.where(at < x[0], first * (at - x[0]), 0) + np.where(at > x[-1], last * (at - x[-1]), 0)
        )
        nodes.append(np.exp(at))
        values.append(np.exp(level - level[-1]))
        measured.append(np.exp(x[[0, -1]]) + black[channel])
    return Response(black, np.array(nodes), np.array(values), np.array(measured))


def _merged(x: Array, y: Array, sd: Array) -> tuple[Array, Array, Array]:
    """Return the means of runs of ascending x that lie closely together, with the standard deviation of x."""
    run = np.concatenate([[0], np.cumsum(np.diff(x) > _SAME)])
    count = np.bincount(run)
    return np.bincount(run, x) / count, np.bincount(run, y) / count, np.sqrt(np.bincount(run, sd**2)) / count
