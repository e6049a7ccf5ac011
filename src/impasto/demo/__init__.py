"""The whole pipeline on a small simulated painting, with a page that shows what came out."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import islice
from os import PathLike
from pathlib import Path

import numpy as np

from impasto.capture.simulate import simulate
from impasto.demo import calibration, observers
from impasto.demo.page import DemoSummary, write_page
from impasto.errors import OutputError, Problem
from impasto.evaluate import evaluate
from impasto.evaluate.held_out import spread_lights
from impasto.fit import FitOptions, fit
from impasto.maps import maps
from impasto.render import render
from impasto.stack import stack
from impasto.store import open_stack
from impasto.summaries.calibrate import glare_lines, lights_lines, oecf_lines, steadiness_lines
from impasto.summaries.evaluate import evaluate_tables
from impasto.summaries.experiment import simulate_lines
from impasto.summaries.fit import fit_lines
from impasto.summaries.scale import scale_lines
from impasto.summaries.stack import stack_lines

MODELS = ("torrance-sparrow", "phong")
_SIZE = (480, 360)
_LIGHTS = 45
_HELD_OUT = 5
_VIGNETTING = 0.2
_BRACKETS = 1
_SWEEP_DEG = tuple(range(-66, 67, 6))
# What an earlier demo left, and nothing else, may be replaced.
_PARTS = (
    *("photos", "painting.zarr", "painting.zarr.log.jsonl", "renderings", "maps", "index.html"),
    *(calibration.PART, *observers.PARTS),
)
_MARK = "demo.txt"


def demo(
    out: str | PathLike[str] = "demo",
    *,
    size: tuple[int, int] = _SIZE,
    say: Callable[[str], None] = lambda line: None,
    show_progress: bool | None = None,
) -> DemoSummary:
    """Simulate a painting, calibrate, stack, fit two models, render, evaluate, and write a page about it.

    Parameters
    ----------
    out : path, optional
        Folder to make. What an earlier demo left there is replaced.
    size : (int, int), optional
        Width and height of the simulated photographs, pixels.
    say : callable, optional
        Called with lines that tell what is going on.
    show_progress : bool, optional
        Whether to show progress bars; by default, if standard error is a terminal.

    Returns
    -------
    DemoSummary

    Raises
    ------
    OutputError
        If `out` holds something that is not a demo's.
    """
    started = time.perf_counter()
    folder = _clear(Path(out))
    photos, store = folder / "photos", folder / "painting.zarr"
    clock = _Clock(say)
    seen = f"--size {size[0]},{size[1]} --vignetting {_VIGNETTING} --brackets {_BRACKETS}"
    with clock.step("simulate", f"simulate {photos} --dome --lights {_LIGHTS} {seen}"):
        simulated = simulate(
            photos,
            dome=True,
            lights=_LIGHTS,
            size=size,
            vignetting=_VIGNETTING,
            brackets=_BRACKETS,
            show_progress=show_progress,
        )
        say(f"{simulated.photographs} photographs of a still life that does not exist")
    with clock.step("calibrate", *calibration.commands(photos, folder, size)):
        calibrated = calibration.calibrate_studio(photos, folder, size)
        for line in (
            *lights_lines(calibrated.lights),
            *oecf_lines(calibrated.response),
            *glare_lines(calibrated.glare),
            *steadiness_lines(calibrated.steadiness),
        ):
            say(line)
    named = {"lights": calibrated.lights_file, **calibrated.files}
    exposures = sorted((photos / "brackets").iterdir())
    options = " ".join(
        [f"--{name} {file}" for name, file in named.items()] + [f"--brackets {one}" for one in exposures]
    )
    with clock.step("stack", f"stack {photos} {store} {options}"):
        stacked = stack(
            photos,
            store,
            lights=calibrated.lights_file,
            dark=calibrated.dark.file,
            flat=calibrated.flat.file,
            white=calibrated.white.file,
            colour=calibrated.colour.file,
            steadiness=calibrated.steadiness.file,
            brackets=exposures,
            show_progress=show_progress,
        )
        for line in stack_lines(stacked):
            say(line)
    lights = open_stack(store).lights
    held = lights.select(np.asarray(spread_lights(lights, _HELD_OUT)))
    listed = folder / "held-out.txt"
    listed.write_text("\n".join(held.names) + "\n", encoding="utf-8")
    with clock.step("fit", f"fit {store} " + " ".join(f"--exclude {name}" for name in held.names)):
        fitted = fit(
            store, models=MODELS, options=FitOptions(exclude=held.names), show_progress=show_progress
        )
        for line in fit_lines(fitted):
            say(line)
    with clock.step("evaluate", f"evaluate {store} --held-out-lights {listed}"):
        evaluated = evaluate(
            store, models=MODELS, held_out_lights=held.names, baselines=False, show_progress=show_progress
        )
        for heading, header, rows in islice(evaluate_tables(evaluated), len(MODELS)):
            say(f"{heading}: " + ", ".join(f"{header[k]} {rows[-1][k]}" for k in (2, 3, 4)))
    sweep = f"{_SWEEP_DEG[0]}:{_SWEEP_DEG[-1]}:{_SWEEP_DEG[1] - _SWEEP_DEG[0]}"
    renderings = folder / "renderings"
    with clock.step("render", f"render {store} --model {MODELS[0]} --arm {sweep} --out {renderings}/sweep"):
        rendered = [
            render(
                store,
                model=model,
                lights=held,
                out=renderings / model,
                show_progress=show_progress,
            )
            for model in MODELS
        ]
        rendered.append(
            render(
                store, model=MODELS[0], arm=_SWEEP_DEG, out=renderings / "sweep", show_progress=show_progress
            )
        )
    with clock.step("maps", f"maps {store} --model {MODELS[0]} --out {folder}/maps/{MODELS[0]}"):
        mapped = [
            maps(store, model=model, out=folder / "maps" / model, show_progress=show_progress)
            for model in MODELS
        ]
    with clock.step("experiment", *observers.commands(store, folder, MODELS, held.names)):
        compared = observers.compare(store, folder, MODELS, held.names, show_progress=show_progress)
        for line in (*simulate_lines(compared.simulated), *scale_lines(compared.scaled)):
            say(line)
    summary = DemoSummary(
        page=folder / "index.html",
        store=store,
        calibrated=calibrated,
        stacked=stacked,
        fitted=fitted,
        evaluated=evaluated,
        rendered=tuple(rendered),
        mapped=tuple(mapped),
        compared=compared,
        steps=clock.seconds,
        seconds=time.perf_counter() - started,
    )
    write_page(summary, photos / "truth")
    return replace(summary, seconds=time.perf_counter() - started)


class _Clock:
    """Announce steps as the commands that do the same, and take their time."""

    def __init__(self, say: Callable[[str], None]) -> None:
        self._say = say
        self.seconds: dict[str, float] = {}

    @contextmanager
    def step(self, name: str, *commands: str) -> Iterator[None]:
        self._say("")
        for command in commands:
            self._say(f"$ impasto {command}")
        started = time.perf_counter()
        yield
        self.seconds[name] = time.perf_counter() - started


def _clear(folder: Path) -> Path:
    """Make the folder, or empty it of an earlier demo."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())) and not (folder / _MARK).is_file():
        raise OutputError(
            Problem(
                where=str(folder),
                what="is not empty and was not made by impasto demo",
                do="Give the name of a new folder",
            )
        )
    folder.mkdir(parents=True, exist_ok=True)
    (folder / _MARK).write_text("Made by impasto demo, which may replace what is here.\n", encoding="utf-8")
    for part in _PARTS:
        if (folder / part).is_dir():
            shutil.rmtree(folder / part)
        else:
            (folder / part).unlink(missing_ok=True)
    return folder
