"""What a fit that leaves cast shadows out says of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from impasto import store as stores
from impasto.fit.procedure import Findings

# Relief does not put more of a painting into the shadow of one light than this.
_MUCH = 0.5


def shadow_warnings(shadowed: NDArray[np.float32], names: Sequence[str]) -> tuple[str, ...]:
    """Return a note that names the lights whose shadow covers most of the painting, if there are any.

    Parameters
    ----------
    shadowed : ndarray of shape (N, L)
        Of a sample of pixels, as `fit_tile` returns it.
    names : sequence of str, length L
        Of the photographs.
    """
    share = np.nan_to_num(shadowed).mean(axis=0)
    dark = [f"{name} ({100 * part:.0f} %)" for name, part in zip(names, share, strict=True) if part > _MUCH]
    if not dark:
        return ()
    return (
        f"shadows: most of the painting is less than half as bright as expected in {', '.join(dark)}. Was "
        "the light weaker than stated, or something in its way? --self-calibrate finds the strengths of the "
        "lights, --exclude leaves a photograph out",
    )


def count_shadows(read: Callable[..., Iterator[stores.Maps]]) -> Findings:
    """Say how many samples of a whole fit lie in cast shadows.

    Parameters
    ----------
    read : callable
        As of `Procedure.conclude`.
    """
    shares, touched, pixels = 0.0, 0, 0
    for maps in read(stores.SHADOWED):
        share = maps[stores.SHADOWED]
        known = share[np.isfinite(share)]
        shares += float(known.sum(dtype=np.float64))
        touched += int(np.count_nonzero(known))
        pixels += known.size
    found = {"samples": shares / max(pixels, 1), "pixels": touched / max(pixels, 1)}
    note = (
        f"shadows: {100 * found['samples']:.2g} % of the samples lie in a cast shadow and were left out, at "
        f"least one of {100 * found['pixels']:.2g} % of the pixels"
    )
    return Findings({"shadowed": {key: round(value, 6) for key, value in found.items()}}, (note,))
