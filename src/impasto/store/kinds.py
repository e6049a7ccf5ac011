"""Kinds of JSON values, and in words where a value is of another kind."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

Kind = Callable[[Any, str], Iterator[str]]
"""Yields what is wrong with a value of that name, and nothing where it is of the kind."""

_SHOWN = 40


def kind(words: str, accepts: Callable[[Any], bool]) -> Kind:
    """Return a kind of single values, by what it is called and what it accepts."""

    def check(value: Any, name: str) -> Iterator[str]:
        """Yield where a value is of another kind."""
        if not accepts(value):
            yield _wrong(name, value, words)

    return check


def _is_number(value: Any) -> bool:
    # Python reads NaN, infinities and integers beyond every float from JSON.
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and abs(value) <= sys.float_info.max


TEXT = kind("text", lambda value: isinstance(value, str))
FLAG = kind("true or false", lambda value: isinstance(value, bool))
COUNT = kind("a whole number from 0", lambda value: type(value) is int and 0 <= value < 2**63)
NUMBER = kind("a number", _is_number)
NOT_NEGATIVE = kind("a number from 0", lambda value: _is_number(value) and value >= 0)
POSITIVE = kind("a number above 0", lambda value: _is_number(value) and value > 0)


def one_of(*words: str) -> Kind:
    """Return the kind of some words."""
    return kind(" or ".join(words), lambda value: value in words)


def or_null(of: Kind) -> Kind:
    """Return a kind to which null belongs too."""
    return lambda value, name: iter(()) if value is None else of(value, name)


def numbers(*shape: int | None) -> Kind:
    """Return the kind of nested lists of numbers, with None for lengths that may be any."""
    lengths = " x ".join("…" if length is None else str(length) for length in shape)

    def accepts(value: Any) -> bool:
        try:
            array = np.array(value)
        except ValueError:  # lists of different lengths
            return False
        return (
            array.ndim == len(shape)
            and all(length in (None, found) for length, found in zip(shape, array.shape, strict=True))
            and array.dtype.kind in "fiu"
            and bool(np.isfinite(array).all())
        )

    return kind(f"a list of {lengths} numbers", accepts)


def each(of: Kind, count: int | None = None) -> Kind:
    """Return the kind of lists of one kind, of `count` entries or any number."""

    def check(value: Any, name: str) -> Iterator[str]:
        """Yield where a value is of another kind."""
        if not isinstance(value, list) or count not in (None, len(value)):
            yield _wrong(name, value, "a list" if count is None else f"a list of {count}")
            return
        for number, entry in enumerate(value):
            yield from of(entry, f"{name}[{number}]")

    return check


def record(needed: Mapping[str, Kind], optional: Mapping[str, Kind] | None = None) -> Kind:
    """Return the kind of objects with such entries; what else they have is not looked at."""

    def check(value: Any, name: str) -> Iterator[str]:
        """Yield where a value is of another kind."""
        if not isinstance(value, dict):
            yield _wrong(name, value, "an object")
            return
        prefix = f"{name}." if name else ""
        if missing := [prefix + key for key in needed if key not in value]:
            yield f"lacks the attribute{'s' * (len(missing) > 1)} {', '.join(missing)}"
        for key, of in {**needed, **(optional or {})}.items():
            if key in value:
                yield from of(value[key], prefix + key)

    return check


def _wrong(name: str, value: Any, words: str) -> str:
    text = json.dumps(value, ensure_ascii=False)
    shown = text if len(text) <= _SHOWN else text[: _SHOWN - 1] + "…"
    entries = f" of {len(value)} entries" if isinstance(value, list) else ""
    return f"the attribute {name} is {shown}{entries}, expected {words}"
