"""A second store over the same stack, for fits that must not touch the first."""

from __future__ import annotations

import glob
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from impasto.errors import StoreError, raise_problems
from impasto.store.files import writing
from impasto.store.hierarchy import source_problems
from impasto.store.layout import STACK


@contextmanager
def borrowed_stack(store: Path) -> Iterator[Path]:
    """Make a store beside `store` that shares its stack and has no fits; it is gone after the block.

    Nothing of the stack is copied: the second store refers to it. What killed runs left of theirs is removed.

    Parameters
    ----------
    store : Path
        A store with a stack.

    Yields
    ------
    Path
        The second store.

    Raises
    ------
    StoreError
        If there is no store, it is from a newer version, or nothing can be written beside it.
    """
    raise_problems(StoreError, source_problems(store))
    store = store.resolve()
    _sweep(store)
    with writing(store, "a temporary store beside it"):
        folder = Path(tempfile.mkdtemp(prefix=f".{store.name}.", suffix=".partial", dir=store.parent))
    with _held(folder):
        try:
            second = folder / store.name
            with writing(store, "a temporary store beside it"):
                second.mkdir()
                shutil.copyfile(store / "zarr.json", second / "zarr.json")
                try:
                    os.symlink(store / STACK, second / STACK, target_is_directory=True)
                except OSError:  # file systems without symbolic links
                    shutil.copytree(store / STACK, second / STACK, copy_function=os.link)
            yield second
        finally:
            shutil.rmtree(folder, ignore_errors=True)


def _sweep(store: Path) -> None:
    """Remove temporary stores beside `store` that no process holds any more."""
    for folder in store.parent.glob(f".{glob.escape(store.name)}.????????.partial"):
        with _held(folder) as free:
            if free:
                shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def _held(folder: Path) -> Iterator[bool]:
    """Hold a folder until the block, or the process, ends; yield whether nobody else does, for certain."""
    try:
        import fcntl
    except ImportError:  # Windows
        yield False
        return
    free = False
    descriptor = None
    try:
        with suppress(OSError):  # held by another process, just removed, or no locks on this file system
            descriptor = os.open(folder, os.O_RDONLY)
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            free = True
        yield free
    finally:
        if descriptor is not None:
            os.close(descriptor)
