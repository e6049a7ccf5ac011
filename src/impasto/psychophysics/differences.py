"""How far the pictures of an experiment are from their reference, as they are shown."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from impasto.errors import OptionError, Problem
from impasto.psychophysics.experiment.manifest import DIMMED, PHOTOGRAPH, read_experiment

KINDS = ("RMS", "CIEDE2000", "FLIP")


def measure_differences(
    experiment: str | PathLike[str],
) -> dict[str, dict[tuple[str, str, str], float]]:
    """Measure how far each picture of an experiment is from the photograph.

    Parameters
    ----------
    experiment : path
        Folder that `impasto experiment create` made.

    Returns
    -------
    dict of str to dict of (str, str, str) to float
        For each kind in `KINDS`, the difference by sample, angle and condition.

    Raises
    ------
    ExperimentError
        If the experiment cannot be read or a picture has changed.
    """
    folder = Path(experiment)
    files = {
        (stimulus.sample, stimulus.angle, stimulus.condition): folder / stimulus.file
        for stimulus in read_experiment(folder).stimuli
        if stimulus.condition != DIMMED
    }
    found: dict[str, dict[tuple[str, str, str], float]] = {kind: {} for kind in KINDS}
    for key, file in files.items():
        reference = read_picture(files[key[0], key[1], PHOTOGRAPH])
        picture = read_picture(file)
        for kind in KINDS:
            found[kind][key] = image_difference(reference, picture, kind)
    return found


def read_picture(file: Path) -> NDArray[np.uint8]:
    """Return a picture of an experiment: ndarray of shape (H, W, 3), uint8, as the display is sent it."""
    from PIL import Image

    with Image.open(file) as image:
        return np.asarray(image.convert("RGB"), dtype=np.uint8)


def image_difference(
    reference: NDArray[np.uint8], picture: NDArray[np.uint8], kind: str = "CIEDE2000"
) -> float:
    """Return the mean difference of two pictures as they are shown.

    Parameters
    ----------
    reference, picture : ndarray of shape (H, W, 3), uint8, sRGB
    kind : {"RMS", "CIEDE2000", "FLIP"}, optional
        Root mean square of the encoded values from 0 to 1; CIE ΔE 2000 [Luo2001]_, mean over the pixels; FLIP
        [Andersson2020]_, mean over the pixels, at 67 pixels per degree.

    Returns
    -------
    float

    Raises
    ------
    OptionError
        If there is no such kind, or the pictures differ in size.
    """
    if reference.shape != picture.shape:
        what = f"have the sizes {reference.shape} and {picture.shape}"
        raise OptionError(Problem("pictures", what, "Give pictures of one size"))
    first, second = (image.astype(np.float32) / 255 for image in (reference, picture))
    if kind == "RMS":
        return float(np.sqrt(np.mean(np.square(first - second, dtype=np.float64))))
    if kind == "CIEDE2000":
        from skimage.color import deltaE_ciede2000, rgb2lab

        return float(np.mean(deltaE_ciede2000(rgb2lab(first), rgb2lab(second))))
    if kind == "FLIP":
        from flip_evaluator import evaluate

        _, mean, _ = evaluate(first, second, "LDR")
        return float(mean)
    raise OptionError(Problem(f"difference {kind}", "does not exist", f"Choose among {', '.join(KINDS)}"))
