"""The paper re-enacted: its eight samples made of measured materials, its capture, its fits, its tables."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from impasto.capture.simulate.measured import read_measured
from impasto.capture.simulate.presets import SAMPLES
from impasto.console import versions
from impasto.errors import OptionError, OutputError, Problem, raise_problems
from impasto.output import prepare_folder
from impasto.page import Page, Picture
from impasto.reproduce.camera import SHORTER_EXPOSURES, CalibratedCamera, calibrate_camera
from impasto.reproduce.printed import PRINTED
from impasto.reproduce.sample import PROCEDURES, VirtualSample, enact
from impasto.reproduce.tables import findings, tables

_CANNOT = (
    "The samples are not the paper's. Known of those are the gloss levels and Tables I and II; paints, "
    "supports and cameras here are ours, so values can agree in kind and in order, and not in number.",
    "The measured materials have no glossy paint above 62 gloss units at 60°, so (a) and (g) have a smooth "
    "interface over a measured base, of the alpha that gives the printed readings of (a) at 20 and 60°. The "
    "83.5 printed for (a) at 85° is out of reach of that alpha.",
    "As for the whole sample rests on one pixel, and with lights in one plane it rests on an assumption "
    "about that pixel's normal. Where no highlight crosses the plane, As and the width are not "
    "identified, and are left out rather than invented.",
    "The figures of the paper are known here by their captions alone; the curves below are the same kind of "
    "curve for our samples.",
    "Networks that stand for measured materials are not used within 10° of grazing, which the 85° gloss asks "
    "for: those readings of the true materials are what the value at 10° gives.",
)


@dataclass(frozen=True)
class ReproduceSummary:
    """What `reproduce` found.

    Parameters
    ----------
    out, page : Path
    camera : CalibratedCamera
    samples : dict of str to VirtualSample
    findings : tuple of str
        What agrees with the paper and what does not.
    seconds : float
    """

    out: Path
    page: Path
    camera: CalibratedCamera
    samples: dict[str, VirtualSample]
    findings: tuple[str, ...]
    seconds: float


def reproduce(
    out: str | PathLike[str],
    *,
    measured: str | PathLike[str],
    samples: Sequence[str] = (),
    size: tuple[int, int] = (64, 64),
    seed: int = 0,
    say: Callable[[str], None] = lambda line: None,
    show_progress: bool | None = None,
) -> ReproduceSummary:
    """Re-enact the paper's experiment on virtual samples, and set its printed values beside what comes out.

    Each sample is a measured material, so the truth is none of the models that are fitted, photographed under
    37 lights on an arm by a camera whose response is measured from a grey scale, with merged exposures. Both
    models are fitted by the paper's procedure, by its refined form, and by the joint one.

    Parameters
    ----------
    out : path
        Folder to make: ``index.html``, and per sample the photographs, the stores and the curves.
    measured : path
        File of measured materials (.npz).
    samples : sequence of str, optional
        Of ``a`` to ``h``, all by default.
    size : (int, int), optional
        Width and height of the photographs, pixels.
    seed : int, optional
        Another set of samples of the kind.
    say : callable, optional
        Called with a line per sample.
    show_progress : bool, optional
        Whether to show progress bars; by default, if standard error is a terminal.

    Returns
    -------
    ReproduceSummary

    Raises
    ------
    OptionError
        If there is no such sample, or the file of measured materials cannot be used.
    OutputError
        If `out` is not empty or cannot be written.

    References
    ----------
    [Chen2007]_; the materials are those of [Sztrajman2021]_.
    """
    started = time.perf_counter()
    folder = Path(out)
    samples = tuple(dict.fromkeys(samples)) or tuple(PRINTED)
    raise_problems(
        OptionError,
        [
            Problem(f"--sample {name}", "is none of the paper's", f"Choose from {', '.join(PRINTED)}")
            for name in samples
            if name not in PRINTED
        ],
    )
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise OutputError(Problem(str(folder), "is not empty, expected a new folder", "Give another name"))
    materials = read_measured(Path(measured))
    for name in samples:
        materials.radiance_factor(SAMPLES[name].measured)  # raises for a material that is not there
    prepare_folder(folder)
    camera = calibrate_camera(folder / "camera", seed=seed, show_progress=show_progress)
    enacted = {}
    for name in samples:
        enacted[name] = enact(
            folder / name, name, materials, camera, size=size, seed=seed, show_progress=show_progress
        )
        say(f"sample {name}: {enacted[name].material}, {enacted[name].support}")
    summary = ReproduceSummary(
        out=folder,
        page=folder / "index.html",
        camera=camera,
        samples=enacted,
        findings=tuple(findings(enacted)),
        seconds=time.perf_counter() - started,
    )
    _write_page(summary, size)
    return summary


def _write_page(summary: ReproduceSummary, size: tuple[int, int]) -> None:
    page = Page(
        "The paper re-enacted",
        f"{len(summary.samples)} virtual samples of {size[0]} x {size[1]} pixels, made of measured "
        "materials, under the paper's arm: its models, its procedure, its tables, and what a joint fit says.",
        contents=True,
    )
    response = summary.camera.response
    part = page.section("Camera")
    part.text(
        f"Its response was measured from a grey scale over {response.decades:.2f} decades of radiance, to "
        f"{response.residual:.2%}, and is undone in every photograph; {1 + SHORTER_EXPOSURES} exposures "
        "each, two stops apart, are merged; a white card gives the scale."
    )
    part.pictures(
        [
            Picture(
                response.plot.read_bytes(),
                "The measured response",
                alt="Radiance against code, a curve per channel, with the patches of the grey scale on them.",
            )
        ],
        columns=1,
    )
    part = page.section("What agrees")
    part.items(summary.findings)
    part = page.section("What cannot agree")
    part.items(_CANNOT)
    part = page.section("Tables")
    for caption, header, rows in tables(summary.samples):
        part.table(header, rows, caption=caption)
    part = page.section("Curves")
    for name, sample in summary.samples.items():
        for procedure, fitted in sample.fitted.items():
            if fitted.plot is not None and procedure != "refined":
                caption = f"Sample {name}, {sample.material}; {procedure} procedure"
                alt = f"Gonio curve. {caption}. Errors by band stand in the tables."
                part.pictures([Picture(fitted.plot.read_bytes(), caption, alt=alt)], columns=1)
    part = page.section("What the program says about these fits")
    for name, sample in summary.samples.items():
        notes = [f"{p}: {note}" for p in PROCEDURES for note in sample.fitted[p].notes]
        part.notes(f"Sample {name}", notes)
    page.section("Versions").text(versions())
    page.write(summary.page)
