"""How close the joint fit comes to the truth of the fixed problem, and how close any fit could come."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from benchmarks.problem import INDEX, MODEL, VIEW_DIRECTION, Problem, noise_sd, simulate
from numpy.typing import NDArray
from tests.reference_models import radiance, unit

# The figures to beat: median and 95th percentile where there are two.
BARS: dict[str, float] = {
    "normal, median (deg)": 0.018,
    "normal, 95th percentile (deg)": 0.051,
    "c where seen, median (relative)": 0.0032,
    "c where seen, 95th percentile (relative)": 0.031,
    "Ad, median (relative)": 0.0011,
    "Ad, 95th percentile (relative)": 0.0091,
    "residual RMS / noise, median": 0.997,
    "failures, worst tenth of the range of c": 0.002,
}


def highlight_seen(problem: Problem) -> NDArray[np.bool_]:
    """Return where the brightest sample's specular part exceeds half the diffuse level, shape (N,)."""
    return _specular_part(problem).max(axis=0) > 0.5 * problem.diffuse.mean(axis=1)


def figures(problem: Problem, fitted: dict[str, NDArray[Any]]) -> dict[str, float]:
    """Return the quantities of `BARS` for a fit.

    Parameters
    ----------
    problem : Problem
    fitted : dict
        `normal` (N, 3), `diffuse` (N, 3), `shape` (N, 1) and `chi2_reduced` (N,), as the core returns them.
    """
    seen = highlight_seen(problem)
    chi2 = np.asarray(fitted["chi2_reduced"], float)
    failed = ~(chi2 <= 2)
    tenth = np.argsort(np.argsort(problem.c)) * 10 // len(problem.c)
    return _table(
        _angle_deg(fitted["normal"], problem.normal),
        np.abs(fitted["shape"][:, 0] / problem.c - 1)[seen],
        np.abs(fitted["diffuse"] / problem.diffuse - 1),
        # χ² over the degrees of freedom, not over the samples: 1 for a perfect fit, 0.997 at the median.
        float(np.sqrt(np.nanmedian(chi2))),
        max(float(failed[tenth == i].mean()) for i in range(10)),
    )


def bound(pixels: int) -> dict[str, float]:
    """Return what an unbiased fit of the fixed problem can at best reach (Cramér-Rao), in terms of `BARS`.

    Errors are drawn from the normal distribution whose covariance is the inverse Fisher information at the
    truth. The residual's expected median is that of chi-square, and no failures are expected.
    """
    problem = simulate(pixels)
    covariance = np.linalg.inv(_information(problem))
    draw = np.random.default_rng(0).standard_normal((pixels, 7, 1))
    error = (np.linalg.cholesky(covariance) @ draw)[..., 0]
    freedom = problem.radiance[:, 0].size - 7
    return _table(
        np.degrees(np.linalg.norm(error[:, :2], axis=1)),
        np.abs(error[highlight_seen(problem), 2]),
        np.abs(error[:, 3:6] / problem.diffuse),
        float(np.sqrt((1 - 2 / (9 * freedom)) ** 3)),
        0.0,
    )


def _table(angle_deg, c_error, diffuse_error, residual, failures) -> dict[str, float]:
    percentiles = [np.nanpercentile(error, [50, 95]) for error in (angle_deg, c_error, diffuse_error)]
    values = [*np.concatenate(percentiles).tolist(), residual, failures]
    return dict(zip(BARS, values, strict=True))


def _angle_deg(a, b):
    """Return the angle between unit vectors of shape (N, 3), accurate where it is small."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    return np.degrees(2 * np.arcsin(np.clip(np.linalg.norm(a - b, axis=1) / 2, 0, 1)))


def _predict(problem: Problem) -> NDArray[np.float64]:
    return radiance(
        MODEL,
        problem.normal,
        problem.diffuse,
        problem.specular,
        problem.c,
        light_direction=problem.light_direction,
        view_direction=VIEW_DIRECTION,
        index=INDEX,
    )


def _specular_part(problem: Problem) -> NDArray[np.float64]:
    return _predict(replace(problem, diffuse=np.zeros_like(problem.diffuse)))[..., 0]


def _information(problem: Problem) -> NDArray[np.float64]:
    """Return the Fisher information (N, 7, 7) of two tilts of the normal, ln c, Ad per channel and ln As."""
    across = unit(np.cross([0.0, 1.0, 0.0], problem.normal))
    along = np.cross(problem.normal, across)
    step = 1e-6

    def turned(axis: NDArray, angle: float) -> NDArray:
        return _predict(replace(problem, normal=unit(problem.normal + angle * axis)))

    def widened(factor: float) -> NDArray:
        return _predict(replace(problem, c=problem.c * np.exp(factor)))

    derivatives = [
        (turned(across, step) - turned(across, -step)) / (2 * step),
        (turned(along, step) - turned(along, -step)) / (2 * step),
        (widened(step) - widened(-step)) / (2 * step),
    ]
    nothing = np.zeros_like(problem.specular)
    for channel in range(3):
        one = np.zeros_like(problem.diffuse)
        one[:, channel] = 1
        derivatives.append(_predict(replace(problem, diffuse=one, specular=nothing)))
    derivatives.append(_predict(replace(problem, diffuse=np.zeros_like(problem.diffuse))))
    weighted = np.stack(derivatives, axis=-1) / noise_sd(problem.radiance_true)[..., None]
    jacobian = weighted.transpose(1, 0, 2, 3).reshape(len(problem.c), -1, 7)
    return jacobian.transpose(0, 2, 1) @ jacobian
