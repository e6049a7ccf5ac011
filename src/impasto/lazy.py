"""Packages whose functions have the names of their modules and are imported when they are asked for."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from importlib import import_module
from types import ModuleType
from typing import Any


def make_lazy(package: str, home: Mapping[str, str]) -> None:
    """Make names of a package import the module that they stand in, when they are first asked for.

    Where a name is both a module's and a function's in it, it always means the function. A name whose home is
    the module of that name without such a function means the module. The package may also be asked for
    ``__version__``.

    Parameters
    ----------
    package : str
        Its ``__name__``; it is being imported.
    home : mapping of str to str
        The module of each name, relative to the package.
    """

    def resolve(name: str) -> Any:
        module = import_module(f"{package}.{home[name]}")
        return getattr(module, name, module)

    class LazyPackage(ModuleType):
        def __getattr__(self, name: str) -> Any:
            if name == "__version__":
                from importlib.metadata import version

                return version(package)
            if name not in home:
                raise AttributeError(f"module {package!r} has no attribute {name!r}")
            value = resolve(name)
            setattr(self, name, value)
            return value

        def __setattr__(self, name: str, value: Any) -> None:
            # Python makes a module that it has imported an attribute of the package.
            if isinstance(value, ModuleType) and name in home:
                value = getattr(value, name, value)
            super().__setattr__(name, value)

    sys.modules[package].__class__ = LazyPackage
