"""The joint fit of one pixel by scipy.optimize.least_squares, as a careful practitioner would write it.

Analytic Jacobian, everything that depends on the lights alone computed once, residual and Jacobian sharing
their intermediate values, starts from two candidate normals and a grid over c by linear least squares, and of
the solver's options those that ran fastest: scipy is left with what only it can do. Same samples, weights and
model as impasto's joint fit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from benchmarks.problem import INDEX, VIEW_DIRECTION, noise_sd
from numpy.typing import NDArray
from scipy.optimize import least_squares
from tests.reference_models import fresnel_dielectric

# Unknowns: the normal's slopes n_x/n_z and n_y/n_z, Ad per channel, As, c.
LOWER = np.array([-3.0, -3.0, 0.0, 0.0, 0.0, 0.0, 0.004])
UPPER = np.array([3.0, 3.0, np.inf, np.inf, np.inf, np.inf, 1.0])
C_GRID = np.array([0.03, 0.06, 0.12, 0.22, 0.38, 0.6, 0.9])
# Looser than scipy's 1e-8, in scipy's favour: the last digits are below the noise by orders of magnitude.
TOLERANCE = 1e-6


@dataclass(frozen=True)
class Solution:
    """What one pixel's fit found: unit normal, Ad (3,), As, c, chi-square over degrees of freedom."""

    normal: NDArray[np.float64]
    diffuse: NDArray[np.float64]
    specular: float
    c: float
    chi2_reduced: float
    evaluations: int


class PixelFit:
    """Fits pixels one by one under the same distant lights.

    Parameters
    ----------
    light_direction : ndarray of shape (L, 3)
    method : {"trf", "lm"}
        scipy's bounded trust-region solver, or MINPACK's unbounded Levenberg-Marquardt in the logarithms of
        As and c.
    """

    def __init__(self, light_direction: NDArray[np.float64], method: str = "trf") -> None:
        self.light = light_direction
        self.view = np.array(VIEW_DIRECTION)
        half = light_direction + self.view
        self.half = half / np.linalg.norm(half, axis=1, keepdims=True)
        self.v_h = self.half @ self.view
        self.fresnel = fresnel_dielectric(self.v_h, INDEX)
        # One product gives n·l, n·h and n·v of every light.
        self.directions = np.concatenate([self.light, self.half, self.view[None]])
        self.method = method
        self.logarithmic = method == "lm"

    def fit(self, radiance: NDArray) -> Solution:
        """Fit one pixel's samples of shape (L, 3)."""
        self.measured = radiance.astype(float)
        self.inverse_sd = 1 / noise_sd(np.maximum(self.measured, 0))
        x = self._start()
        if self.logarithmic:
            x[5:] = np.log(x[5:])
            bounds, scale = (-np.inf, np.inf), "jac"
        else:
            bounds, scale = (LOWER, UPPER), np.maximum(np.abs(x), 0.1)
        self._at = None
        result = least_squares(
            self._residual,
            x,
            self._jacobian,
            bounds,
            method=self.method,
            x_scale=scale,
            ftol=TOLERANCE,
            xtol=TOLERANCE,
            gtol=TOLERANCE,
            max_nfev=100,
        )
        p, q, *diffuse, specular, c = result.x
        if self.logarithmic:
            specular, c = np.exp(specular), np.exp(c)
        normal = np.array([p, q, 1.0]) / np.sqrt(1 + p * p + q * q)
        freedom = self.measured.size - len(x)
        return Solution(normal, np.array(diffuse), specular, c, 2 * result.cost / freedom, result.nfev)

    def _lobe(self, normals, c):
        """Return D F G/(n·v) of shape (K, L) for normals (K, 3) and c (K,)."""
        cosines = normals @ self.directions.T
        lights = len(self.light)
        n_l, n_h, n_v = cosines[:, :lights], cosines[:, lights:-1], cosines[:, -1:]
        squared = c[:, None] ** 2
        d = (squared / (n_h**2 * (squared - 1) + 1)) ** 2
        g = np.minimum(1, 2 * n_h * np.minimum(n_l, n_v) / self.v_h)
        return np.maximum(n_l, 0), np.where(n_l > 0, d * self.fresnel * g / n_v, 0)

    def _start(self):
        grey = self.measured.mean(axis=1)
        weight = 1 / noise_sd(np.maximum(grey, 0)) ** 2
        normals = np.repeat([self._diffuse_normal(grey), self._highlight_normal(grey)], len(C_GRID), axis=0)
        c = np.tile(C_GRID, 2)
        n_l, lobe = self._lobe(normals, c)
        dd, ds, ss = (n_l**2) @ weight, (n_l * lobe) @ weight, (lobe**2) @ weight
        dy, sy = (n_l * grey) @ weight, (lobe * grey) @ weight
        determinant = np.maximum(dd * ss - ds**2, 1e-12 * dd * ss)
        diffuse = np.maximum((dy * ss - sy * ds) / determinant, 1e-3)
        specular = np.maximum((sy * dd - dy * ds) / determinant, 1e-4)
        residual = diffuse[:, None] * n_l + specular[:, None] * lobe - grey
        best = np.argmin((residual**2) @ weight)
        p, q = normals[best, :2] / normals[best, 2]
        base = n_l[best] * weight
        highlight = specular[best] * lobe[best]
        per_channel = np.maximum(
            base @ (self.measured - highlight[:, None]) / (base @ n_l[best]), 0.1 * diffuse[best]
        )
        return np.array([p, q, *per_channel, specular[best], c[best]])

    def _diffuse_normal(self, grey):
        """Lambert's normal, away from the highlight of an upright element, in Cauchy's norm."""
        weight = np.linalg.norm(np.cross(self.half, [0.0, 0.0, 1.0]), axis=1) ** 4
        scaled = np.linalg.solve((self.light.T * weight) @ self.light, self.light.T @ (weight * grey))
        for _ in range(2):
            normal = scaled / np.linalg.norm(scaled)
            weight = np.linalg.norm(np.cross(self.half, normal), axis=1) ** 4
            residual = grey - np.maximum(self.light @ scaled, 0)
            weight = weight / (1 + residual**2 / (0.01 * scaled @ scaled))
            scaled = np.linalg.solve((self.light.T * weight) @ self.light, self.light.T @ (weight * grey))
        return _upright(scaled)

    def _highlight_normal(self, grey):
        return _upright((grey / grey.max()) ** 4 @ self.half)

    def _evaluate(self, x):
        if self._at is not None and np.array_equal(x, self._at):
            return
        self._at = x.copy()
        p, q = x[:2]
        specular, c = np.exp(x[5:]) if self.logarithmic else x[5:]
        length = np.sqrt(1 + p * p + q * q)
        normal = np.array([p, q, 1.0]) / length
        tangent = np.array(
            [[1 - normal[0] ** 2, -normal[0] * normal[1], -normal[0] * normal[2]],
             [-normal[0] * normal[1], 1 - normal[1] ** 2, -normal[1] * normal[2]]]
        ) / length  # fmt: skip
        lights = len(self.light)
        cosines = self.directions @ normal
        self.slopes = self.directions @ tangent.T
        n_l, n_h, n_v = cosines[:lights], cosines[lights:-1], cosines[-1]
        self.lit = n_l > 0
        n_l = np.where(self.lit, n_l, 1.0)
        denominator = n_h**2 * (c * c - 1) + 1
        d = (c * c / denominator) ** 2
        shadowing, masking = 2 * n_h * n_l / self.v_h, 2 * n_h * n_v / self.v_h
        g = np.minimum(1, np.minimum(shadowing, masking))
        self.lobe = np.where(self.lit, d * self.fresnel * g / n_v, 0)
        self.n_l = np.where(self.lit, n_l, 0)
        self.cosines = n_l, n_h, n_v
        self.denominator = denominator
        self.shadowed, self.masked = (
            (shadowing < 1) & (shadowing <= masking),
            (masking < 1) & (masking < shadowing),
        )
        self.specular, self.c = specular, c
        self.predicted = self.n_l[:, None] * x[2:5] + specular * self.lobe[:, None]

    def _residual(self, x):
        self._evaluate(x)
        return ((self.predicted - self.measured) * self.inverse_sd).ravel()

    def _jacobian(self, x):
        self._evaluate(x)
        n_l, n_h, n_v = self.cosines
        lights = len(n_l)
        of_l, of_h, of_v = self.slopes[:lights], self.slopes[lights:-1], self.slopes[-1]
        # d ln(lobe)/d(cosine), each factor in turn.
        in_h = -4 * n_h * (self.c**2 - 1) / self.denominator + (self.shadowed | self.masked) / n_h
        in_l = self.shadowed / n_l
        in_v = (self.masked - 1.0) / n_v
        logarithmic = in_h[:, None] * of_h + in_l[:, None] * of_l + in_v[:, None] * of_v
        jacobian = np.zeros((lights, 3, 7))
        highlight = self.specular * self.lobe
        lit = of_l * self.lit[:, None]
        jacobian[:, :, :2] = (highlight[:, None] * logarithmic)[:, None] + lit[:, None] * x[2:5, None]
        jacobian[:, range(3), range(2, 5)] = self.n_l[:, None]
        in_c = highlight * (4 / self.c - 4 * self.c * n_h**2 / self.denominator)
        if self.logarithmic:
            jacobian[:, :, 5] = highlight[:, None]
            jacobian[:, :, 6] = (in_c * self.c)[:, None]
        else:
            jacobian[:, :, 5] = self.lobe[:, None]
            jacobian[:, :, 6] = in_c[:, None]
        return (jacobian * self.inverse_sd[:, :, None]).reshape(-1, 7)


def _upright(vector):
    """Return the unit vector, lifted to at least 10° above the painting's plane."""
    unit = vector / np.linalg.norm(vector)
    unit[2] = max(unit[2], np.sin(np.radians(10)))
    return unit / np.linalg.norm(unit)
