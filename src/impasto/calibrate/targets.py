"""What is known of the patches of a colour target."""

from __future__ import annotations

import re

import numpy as np

from impasto.calibrate.patches import Array, Patches
from impasto.colour.adaptation import WHITE_POINTS, xy_to_xyz
from impasto.errors import CaptureError, OptionError, Problem, raise_problems

_XYZ = re.compile(r"([XYZ])(?:_(\w+))?")
_REFLECTANCE = re.compile(r"R_?(\d{3})(?:nm)?")
_LAB = ("L", "a", "b")


def known_xyz(patches: Patches, target: str | None) -> tuple[Array, Array]:
    """Return XYZ of each patch and of a perfect white diffuser, both with Y = 1 for the latter.

    Parameters
    ----------
    patches : Patches
    target : str, optional
        Name of a target that colour-science has data of; otherwise the patches' own data are taken: XYZ,
        CIELAB under D50, or reflectances, which are seen under D50 by the 2° observer.

    Raises
    ------
    CaptureError
        If the table says too little, or its patches are not those of the target.
    OptionError
        If there is no such target.

    References
    ----------
    [CIE15]_
    """
    import colour

    if target is not None:
        known = colour.CCS_COLOURCHECKERS.get(target)
        if known is None:
            names = "; ".join(sorted(colour.CCS_COLOURCHECKERS))
            raise OptionError(Problem(f"--target {target}", "is not known", f"Choose one of: {names}"))
        data = {name.casefold(): value for name, value in known.data.items()}
        raise_problems(
            CaptureError,
            [
                Problem(f"patch {name}", f"is none of {target}", f"Its patches are {', '.join(known.data)}")
                for name in patches.names
                if name.casefold() not in data
            ],
        )
        xyy = np.array([data[name.casefold()] for name in patches.names])
        return np.asarray(colour.xyY_to_XYZ(xyy)), np.asarray(colour.xy_to_XYZ(known.illuminant))
    columns = {
        match[1]: (heading, match[2]) for heading in patches.known if (match := _XYZ.fullmatch(heading))
    }
    if set(columns) == set("XYZ"):
        illuminant = columns["Y"][1] or "D50"
        if illuminant not in WHITE_POINTS:
            what = f"gives XYZ under {illuminant}, which is not known"
            raise CaptureError(Problem(patches.source["file"], what, f"Use {', '.join(WHITE_POINTS)}"))
        xyz = np.column_stack([patches.known[columns[axis][0]] for axis in "XYZ"])
        return _of_one(xyz), xy_to_xyz(WHITE_POINTS[illuminant])
    white = xy_to_xyz(WHITE_POINTS["D50"])
    if set(_LAB) <= set(patches.known):
        values = np.column_stack([patches.known[axis] for axis in _LAB])
        return np.asarray(colour.Lab_to_XYZ(values, WHITE_POINTS["D50"])), white
    spectra = {
        int(match[1]): heading for heading in patches.known if (match := _REFLECTANCE.fullmatch(heading))
    }
    if len(spectra) > 5:
        order = sorted(spectra)
        return spectra_to_xyz(np.array(order), np.column_stack([patches.known[spectra[w]] for w in order]))
    raise CaptureError(
        Problem(
            patches.source["file"],
            "does not say the patches' colours: expected X, Y, Z, or L, a, b, or R400, R410, …",
            "Add the columns, or name a target with --target",
        )
    )


def spectra_to_xyz(wavelength_nm: Array, reflectance: Array) -> tuple[Array, Array]:
    """Return XYZ of reflectances (P, W) under D50 for the 2° observer, and of a perfect white diffuser."""
    import colour

    shape = colour.SpectralShape(380, 780, 5)
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape)
    light = colour.SDS_ILLUMINANTS["D50"].copy().align(shape)
    weights = observer.values * light.values[:, None]
    weights = weights / weights[:, 1].sum()
    samples = np.array([np.interp(shape.wavelengths, wavelength_nm, values) for values in reflectance])
    return samples @ weights, weights.sum(axis=0)


def _of_one(xyz: Array) -> Array:
    # Y of paper white is near 1, or near 100 where per cent are meant.
    return xyz / 100 if xyz[:, 1].max() > 2 else xyz
