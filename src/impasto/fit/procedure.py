"""What a way of fitting is: its options, and what the streaming driver asks of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any, Protocol

from numpy.typing import NDArray

from impasto import store as stores
from impasto.errors import Problem, StoreError

_MAX_COMPONENTS = 64


@dataclass(frozen=True, kw_only=True)
class FitOptions:
    """How the pixels of a fit are treated; those that its procedure uses are part of what identifies a fit.

    Parameters
    ----------
    index : float
        Index of refraction of the surface.
    fresnel : str
        ``facet`` or ``element``: whose angle of incidence the Fresnel reflectance takes.
    loss : str
        ``linear``, ``cauchy`` or ``huber``; of the joint procedure.
    loss_scale : float
        Residual, in standard deviations, from which on the robust losses grow slower than squares.
    max_steps : int
        Steps per pixel before its status becomes "step limit".
    shadow_level : float or None
        Relative radiance below which a sample is left out as shadowed.
    shadows : bool
        Whether the joint procedure finds the samples of each pixel that lie in a cast shadow, and leaves them
        out.
    share_reflectance : bool
        Whether the joint procedure fits a second time, with priors on the highlight from the pixels around
        of the same diffuse colour; see docs/reflectance-sharing.md.
    exclude : tuple of str
        Names of photographs to leave out.
    refined : bool
        Whether the paper's procedure keeps the calibrated view and frees the normal instead.
    threshold_deg : float or None
        Angle from the highlight's peak, in degrees, from which on the paper's procedure takes lights to carry
        no specular term; None to have it chosen.
    highlight : str
        Whose peak that is: ``pixel``, each pixel's own brightest light, or ``sample``, that of the brightest
        pixel.
    highlight_colour : str
        Of the joint procedure: ``white``, that of the light; ``own``, one per pixel, as gilding has it; or
        ``auto``, which is white unless the procedure looks at a sample first, for the residual or the lights,
        and lights left out are met closer by ``own``.
    residual : bool
        Whether the joint procedure describes what the model leaves over, over the light's direction.
    residual_components : int
        Coefficients per pixel of that description.
    self_calibrate : bool or None
        Whether the joint procedure finds the strength of each light from the photographs; None for where it
        describes the residual.
    calibrate_directions : bool
        Whether it may then correct the lights' directions too, where that is borne out by lights left out.
    calibrate_distances : bool
        Whether it may then place lights near that are stated as distant, where that is borne out likewise.
    """

    index: float = 1.5
    fresnel: str = "facet"
    loss: str = "linear"
    loss_scale: float = 3.0
    max_steps: int = 60
    shadow_level: float | None = None
    shadows: bool = False
    share_reflectance: bool = False
    exclude: tuple[str, ...] = ()
    refined: bool = False
    threshold_deg: float | None = 35.0
    highlight: str = "pixel"
    highlight_colour: str = "auto"
    residual: bool = False
    residual_components: int = 18
    self_calibrate: bool | None = None
    calibrate_directions: bool = True
    calibrate_distances: bool = True

    @property
    def calibrates(self) -> bool:
        """Whether the strengths of the lights are found from the photographs."""
        return self.residual if self.self_calibrate is None else self.self_calibrate

    def problems(self) -> list[Problem]:
        """Return everything that is wrong with the options, apart from names to exclude."""
        problems = []
        for option, value, choices in (
            ("--fresnel", self.fresnel, ("facet", "element")),
            ("--loss", self.loss, ("linear", "cauchy", "huber")),
            ("--highlight", self.highlight, ("pixel", "sample")),
            ("--highlight-colour", self.highlight_colour, ("auto", "white", "own")),
        ):
            if value not in choices:
                problems.append(
                    Problem(option, f"there is no {value!r}", f"Choose from {', '.join(choices)}")
                )
        if not 1.0 < self.index < 5.0:
            problems.append(Problem("--index", f"is {self.index}, expected 1 to 5", "Varnish has about 1.5"))
        if not 0.0 < self.loss_scale < float("inf"):
            problems.append(Problem("--loss-scale", f"is {self.loss_scale}, expected above 0", "Try 3"))
        if self.shadow_level is not None and not math.isfinite(self.shadow_level):
            problems.append(
                Problem("--shadow-level", f"is {self.shadow_level}, expected a number", "Try 0.005")
            )
        if self.max_steps < 1:
            problems.append(Problem("--max-steps", f"is {self.max_steps}, expected 1 or more", "Try 60"))
        if not 1 <= self.residual_components <= _MAX_COMPONENTS:
            what = f"is {self.residual_components}, expected 1 to {_MAX_COMPONENTS}"
            problems.append(Problem("--residual-components", what, "Try 9, 18 or 27"))
        if self.threshold_deg is not None and not 0.0 < self.threshold_deg < 90.0:
            problems.append(
                Problem(
                    "--threshold",
                    f"is {self.threshold_deg} degrees, expected 0 to 90",
                    "Try 35 as in the paper, or auto",
                )
            )
        return problems

    def foreign(self, others: Mapping[str, str], procedure: str) -> list[Problem]:
        """Return a problem for each option that was set and that a procedure does not have.

        Parameters
        ----------
        others : mapping of str to str
            Names of the options it does not have, and the procedure that has them.
        procedure : str
            Its name.
        """
        usual = FitOptions()
        return [
            Problem(
                where=f"--{name.removesuffix('_deg').replace('_', '-')}",
                what=f"is no option of the {procedure} procedure, but of the {owner} one",
                do=f"Leave it out, or choose --procedure {owner}",
            )
            for name, owner in others.items()
            if getattr(self, name) != getattr(usual, name)
        ]

    def attributes(self, others: Mapping[str, str]) -> dict[str, Any]:
        """Return the options as attributes of a fit, without `others`, which its procedure does not have."""
        options = asdict(self)
        return {
            "index_of_refraction": options.pop("index"),
            "fresnel": options.pop("fresnel"),
            "options": {
                name: list(value) if isinstance(value, tuple) else value
                for name, value in options.items()
                if name not in others
            },
        }

    @classmethod
    def of(cls, attributes: Mapping[str, Any]) -> FitOptions:
        """Return the options that a fit with these attributes was made with.

        Raises
        ------
        StoreError
            If this version does not know some of them.
        """
        options = dict(attributes["options"])
        if unknown := sorted(options.keys() - {option.name for option in fields(cls)}):
            what = f"was made with options that this version does not know: {', '.join(unknown)}"
            do = "Use the version of impasto that made it, or a newer one"
            raise StoreError(Problem(f"the fit of {attributes['model']}", what, do))
        options["exclude"] = tuple(options["exclude"])
        return cls(index=attributes["index_of_refraction"], fresnel=attributes["fresnel"], **options)

    def settled(self, attributes: Mapping[str, Any]) -> FitOptions:
        """Return the options with what a fit with these attributes chose by itself."""
        found = attributes.get("highlight_colour", {})
        return replace(self, highlight_colour=found.get("used", self.highlight_colour))


@dataclass(frozen=True)
class Findings:
    """What a procedure found out that concerns the whole sample.

    Parameters
    ----------
    attributes : mapping
        For the attributes of the fit, as JSON.
    notes : tuple of str
        What cannot be known, what was assumed instead, and what was found, in words.
    """

    attributes: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


class Procedure(Protocol):
    """A way to fit one model: what it computes for a tile, and what it says about itself.

    Everything that the result depends on must follow from `attributes`, because that decides whether a fit is
    the one that was asked for.
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

    def prepare(self, show_progress: bool | None) -> Findings:
        """Find out what holds for the whole sample, before any tile is fitted; may read the whole stack.

        Parameters
        ----------
        show_progress : bool or None
            Whether to show a progress bar; by default, if standard error is a terminal.
        """

    def conclude(self, read: Callable[..., Iterator[stores.Maps]]) -> Findings:
        """Say what can be said once all pixels are fitted.

        Parameters
        ----------
        read : callable
            Called with names of maps; yields these maps piece by piece, always in the same order.
        """

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
