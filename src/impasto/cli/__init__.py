"""The command line: one subcommand per module, listed here in the order of the pipeline."""

from __future__ import annotations

import ctypes
import gc
import os
import sys
from contextlib import suppress
from importlib import import_module

# In the order in which the help lists them.
COMMANDS = (
    "capture",
    "simulate",
    "calibrate",
    "stack",
    "fit",
    "render",
    "maps",
    "height",
    "evaluate",
    "compare",
    "gonio",
    "gloss",
    "angles",
    "experiment",
    "observers",
    "scale",
    "report",
    "view",
    "publish",
    "reproduce",
    "models",
    "demo",
)

# Parameters of glibc's mallopt.
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3


def main() -> None:
    """Run the command line."""
    _spare_the_system()
    try:
        # All subcommands take a while to load; the one that is called is enough.
        called = next(iter(sys.argv[1:]), "")
        import_module(f"{__name__}.{called if called in COMMANDS else 'commands'}")
        from impasto.cli.app import app

        app()
    except KeyboardInterrupt:
        sys.exit(130)  # before the command began, which would say more
    finally:
        # Python looks three times for rubbish before it ends, and everything ends with it. OpenImageIO alone
        # would take what it does not find for leaks, and list them.
        if "OpenImageIO" not in sys.modules:
            gc.freeze()


def _spare_the_system() -> None:
    """Choose how memory and threads are kept; together a tenth of what `stack` and `fit` take for 4 Mpx."""
    # Loading makes many objects that stay, among which there is no rubbish to look for.
    gc.set_threshold(100_000, 50, 50)
    # Threads of OpenBLAS that have nothing to do would turn in circles for 20 ms each time before they sleep,
    # and pages of 2 MB take longer to clear than they save.
    os.environ.setdefault("OPENBLAS_THREAD_TIMEOUT", "4")
    os.environ.setdefault("NUMPY_MADVISE_HUGEPAGE", "0")
    # Large buffers are used again instead of going back to the system, which clears each page anew.
    with suppress(OSError, AttributeError):  # where the C library is not glibc
        library = ctypes.CDLL(None)
        for parameter in (_TRIM_THRESHOLD, _MMAP_THRESHOLD):
            library.mallopt(parameter, 1 << 30)
