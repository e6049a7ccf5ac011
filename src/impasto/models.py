"""The reflectance models that have a name, as the core lists them.

A model is one file in core/src/models and one line in its list; names, parameters, help and documentation
here are read from that list.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from impasto import _core
from impasto.errors import OptionError, Problem
from impasto.geometry import Array


@dataclass(frozen=True)
class ShapeParameter:
    """A nonlinear parameter besides the normal: `name`, bounds and meaning in words.

    `prior` holds mean and standard deviation of the fit's weak prior, of the logarithm where `lower` is
    positive; None where the fit moves in another coordinate.
    """

    name: str
    lower: float
    upper: float
    meaning: str
    prior: tuple[float, float] | None


@dataclass(frozen=True)
class ModelSpec:
    """What a model consists of.

    Parameters
    ----------
    name : str
        The name it is called by, in options, stores and published paths.
    title : str
        The name in words.
    citations : tuple of str
        Keys of docs/references.md.
    shape : tuple of ShapeParameter
        Shape parameters in the order of the core's arrays.
    lobes : int
        Number of specular lobes.
    ambient : bool
        Whether the ambient term Ae is fitted, one per channel.
    reciprocal : bool
        Whether the specular term obeys Helmholtz reciprocity.
    """

    name: str
    title: str
    citations: tuple[str, ...]
    shape: tuple[ShapeParameter, ...]
    lobes: int
    ambient: bool
    reciprocal: bool

    @property
    def shape_names(self) -> tuple[str, ...]:
        """Names of the shape parameters."""
        return tuple(parameter.name for parameter in self.shape)


def _list_models() -> dict[str, ModelSpec]:
    models: dict[str, ModelSpec] = {}
    for entry in _core.models():
        spec = ModelSpec(
            name=entry["name"],
            title=entry["title"],
            citations=tuple(dict.fromkeys(entry["citations"])),
            shape=tuple(ShapeParameter(*parameter) for parameter in entry["shape"]),
            lobes=entry["lobes"],
            ambient=entry["ambient_by_default"],
            reciprocal=entry["reciprocal"],
        )
        suffix, words = ("-no-ambient", "without") if spec.ambient else ("-ambient", "with")
        models[spec.name] = spec
        other = spec.name + suffix
        models[other] = replace(
            spec, name=other, title=f"{spec.title}, {words} ambient term", ambient=not spec.ambient
        )
    return models


MODELS: dict[str, ModelSpec] = _list_models()


def parse_model(name: str) -> ModelSpec:
    """Return the model with a name; "phong-ambient" is "phong", which has the ambient term already (Eq. 1).

    Raises
    ------
    OptionError
        If no model has that name; lists the names there are.
    """
    if name in MODELS:
        return MODELS[name]
    plain = MODELS.get(name.removesuffix("-ambient"))
    if plain is not None and plain.ambient:
        return plain
    raise OptionError(
        Problem(
            where=f"model {name!r}",
            what="there is no reflectance model of that name",
            do=f"Choose one of {', '.join(MODELS)}",
        )
    )


def parse_models(names: Iterable[str]) -> list[ModelSpec]:
    """Return the models with some names, each once; errors as for `parse_model`."""
    return list(dict.fromkeys(map(parse_model, names)))


def with_ambient(model: ModelSpec, ambient: bool) -> ModelSpec:
    """Return the form of a model that has the ambient term, or that has not."""
    plain = model.name.removesuffix("-no-ambient").removesuffix("-ambient")
    forms = (MODELS[name] for name in (plain, f"{plain}-ambient", f"{plain}-no-ambient") if name in MODELS)
    return next(form for form in forms if form.ambient == ambient)


def basis(
    model: ModelSpec,
    normal: ArrayLike,
    light: ArrayLike,
    view: ArrayLike,
    shape: ArrayLike,
    *,
    index: float = 1.5,
    fresnel: str = "facet",
) -> tuple[Array, Array]:
    """Return the model's basis functions, of which relative radiance is the sum weighted by the magnitudes.

    Parameters
    ----------
    model : ModelSpec
    normal, light, view : ndarray of shape (P, 3)
        Unit vectors.
    shape : ndarray of shape (P, S)
        Shape parameters, in the model's order.
    index : float, optional
        Index of refraction of the surface.
    fresnel : {'facet', 'element'}, optional
        Whose angle of incidence Fresnel's equations take.

    Returns
    -------
    diffuse : ndarray of shape (P,)
    specular : ndarray of shape (P, lobes)
    """
    rows = [np.ascontiguousarray(each, dtype=np.float64) for each in (normal, light, view, shape)]
    values = _core.basis(model.name, *rows, index=index, fresnel=fresnel)
    return values[:, 0], values[:, 1 : 1 + model.lobes]
