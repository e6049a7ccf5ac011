"""What a way of fitting is: its options, and what the streaming driver asks of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from numpy.typing import NDArray

from impasto import store as stores
from impasto.errors import Problem


@dataclass(frozen=True, kw_only=True)
class FitOptions:
    """How the pixels of a fit are treated; part of what identifies a fit.

    Parameters
    ----------
    index : float
        Index of refraction of the surface.
    fresnel : str
        ``facet`` or ``element``: whose angle of incidence the Fresnel reflectance takes.
    loss : str
        ``linear``, ``cauchy`` or ``huber``.
    loss_scale : float
        Residual, in standard deviations, from which on the robust losses grow slower than squares.
    max_steps : int
        Steps per pixel before its status becomes "step limit".
    shadow_level : float or None
        Relative radiance below which a sample is left out as shadowed.
    exclude : tuple of str
        Names of photographs to leave out.
    """

    index: float = 1.5
    fresnel: str = "facet"
    loss: str = "linear"
    loss_scale: float = 3.0
    max_steps: int = 60
    shadow_level: float | None = None
    exclude: tuple[str, ...] = ()

    def problems(self) -> list[Problem]:
        """Return everything that is wrong with the options, apart from names to exclude."""
        problems = []
        for option, value, choices in (
            ("--fresnel", self.fresnel, ("facet", "element")),
            ("--loss", self.loss, ("linear", "cauchy", "huber")),
        ):
            if value not in choices:
                problems.append(
                    Problem(option, f"there is no {value!r}", f"Choose from {', '.join(choices)}")
                )
        if not 1.0 < self.index < 5.0:
            problems.append(Problem("--index", f"is {self.index}, expected 1 to 5", "Varnish has about 1.5"))
        if not 0.0 < self.loss_scale < float("inf"):
            problems.append(Problem("--loss-scale", f"is {self.loss_scale}, expected above 0", "Try 3"))
        if self.max_steps < 1:
            problems.append(Problem("--max-steps", f"is {self.max_steps}, expected 1 or more", "Try 60"))
        return problems


class Procedure(Protocol):
    """A way to fit one model: what it computes for a tile, and what it says about itself.

    Everything that the result depends on must be in `attributes`, because that decides whether an interrupted
    fit is continued.
    """

    @property
    def maps(self) -> tuple[stores.Map, ...]:
        """The maps it makes, ``status`` last."""

    @property
    def attributes(self) -> Mapping[str, Any]:
        """Attributes of the fit, as JSON."""

    @property
    def lights(self) -> Sequence[int] | None:
        """Numbers of the photographs it reads; None for all."""

    def fit(self, radiance: NDArray[Any], rows: slice, columns: slice) -> stores.Maps:
        """Fit a tile.

        Parameters
        ----------
        radiance : ndarray of shape (L, rows, columns, C), uint16 or float32
            Values as stored.
        rows, columns : slice
            Where the tile lies.

        Returns
        -------
        dict of str to ndarray of shape (rows * columns[, k])
            One entry per map.
        """
