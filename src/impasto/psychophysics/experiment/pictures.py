"""The pictures of an experiment: made sample by sample, and kept from run to run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impasto.errors import ImpastoError
from impasto.progress import progress
from impasto.psychophysics import stimuli
from impasto.psychophysics.experiment.angles import Angle
from impasto.psychophysics.experiment.candidates import Candidate
from impasto.psychophysics.experiment.manifest import (
    DIMMED,
    PHOTOGRAPH,
    STIMULI,
    SampleInfo,
    Stimulus,
    file_sha256,
    read_experiment,
)
from impasto.render.display import requested_rendition
from impasto.store import Stack, digest, provenance

_DIMMED_TO = 0.5


class Sample:
    """A painting as the experiment shows it.

    Parameters
    ----------
    name : str
    stack : Stack
    view : View
    chain : mapping
        The options of the display chain, as `requested_rendition` takes them, without the exposure.

    Attributes
    ----------
    exposure : float
        Factor on radiance under a light of intensity 1; 1 until it is set.
    """

    def __init__(self, name: str, stack: Stack, view: stimuli.View, chain: Mapping[str, Any]) -> None:
        self.name = name
        self.stack = stack
        self.view = view
        self.exposure = 1.0
        self._chain = chain
        self.rendition = requested_rendition(stack, exposure=1.0, **chain)

    def expose(self, angles: Sequence[Angle]) -> None:
        """Choose the exposure by the photographs of some angles."""
        lights = [angle.lights[self.name] for angle in angles]
        pictures = zip(lights, stimuli.photographs(self.stack, self.view, lights), strict=True)
        self.exposure = stimuli.choose_exposure(
            [stimuli.per_unit_of_light(self.stack, light, radiance) for light, radiance in pictures]
        )

    def made_from(self, light: int, source: str) -> str:
        """Return a digest of everything that a picture under a light depends on, but for the fit itself."""
        rendition = self.rendition
        return digest(
            [
                provenance(),
                self.stack.sha256,
                self.stack.lights.names[light],
                list(self.view.crop_px),
                self.view.factor,
                self.exposure,
                rendition.display.name,
                rendition.profile.hex(),
                rendition.white_xy,
                {key: str(value) for key, value in self._chain.items()},
                source,
            ]
        )

    def write(self, path: Path, light: int, radiance: NDArray[np.float32], dimmed: float = 1.0) -> None:
        """Write the picture of what is seen under a light."""
        exposed = stimuli.per_unit_of_light(self.stack, light, radiance) * np.float32(self.exposure * dimmed)
        stimuli.write_stimulus(path, exposed, self.rendition)

    def info(self, store: str) -> SampleInfo:
        """Return what the manifest says about it."""
        height, width = self.view.size
        return SampleInfo(
            name=self.name,
            store=store,
            stack_sha256=self.stack.sha256,
            crop_px=self.view.crop_px,
            reduced=self.view.factor,
            size_px=(width, height),
            exposure=self.exposure,
            camera_colour=self.rendition.camera.source,
        )


class Pictures:
    """Makes the pictures that are not there yet.

    A picture's file is named after everything that it depends on, so one that is there is the right one,
    unless the last manifest knows its contents to have been others.

    Parameters
    ----------
    folder : Path
        Of the experiment.
    show_progress : bool or None

    Attributes
    ----------
    stimuli : list of Stimulus
        What was asked for so far.
    rendered : int
        How many of them were made.
    """

    def __init__(self, folder: Path, show_progress: bool | None) -> None:
        self.stimuli: list[Stimulus] = []
        self.rendered = 0
        self._folder = folder
        self._show_progress = show_progress
        try:
            known = read_experiment(folder, check_stimuli=False).stimuli
        except ImpastoError:
            known = []
        self._known = {entry.file: entry.sha256 for entry in known}

    def make(self, sample: Sample, angles: Sequence[Angle], candidates: Sequence[Candidate]) -> None:
        """Make the photograph, the dimmed photograph and all candidates of a sample at each angle."""
        lights = [angle.lights[sample.name] for angle in angles]
        total = len(lights) * (1 + len(candidates))
        with progress(f"Sample {sample.name}", total, show=self._show_progress) as advance:
            for condition, dimmed in ((PHOTOGRAPH, 1.0), (DIMMED, _DIMMED_TO)):
                files = {light: self._file(sample, light, condition) for light in lights}
                missing = self._missing(files)
                for light, radiance in zip(
                    missing, stimuli.photographs(sample.stack, sample.view, missing), strict=True
                ):
                    sample.write(self._folder / files[light], light, radiance, dimmed)
                self._take(sample, angles, condition, files)
            advance(len(lights))
            for candidate in candidates:
                source = f"{candidate.model} {candidate.made_from(sample.name)}"
                files = {light: self._file(sample, light, source) for light in lights}
                if missing := self._missing(files):
                    with candidate.opened(sample.name) as fit:
                        rendered = stimuli.renderings(fit, sample.stack, sample.view, missing)
                        for light, radiance in zip(missing, rendered, strict=True):
                            sample.write(self._folder / files[light], light, radiance)
                self._take(sample, angles, candidate.name, files)
                advance(len(lights))

    def sweep(self) -> None:
        """Remove pictures that the experiment no longer has."""
        wanted = {self._folder / entry.file for entry in self.stimuli}
        for path in (self._folder / STIMULI).glob("*.png"):
            if path not in wanted:
                path.unlink()

    def _file(self, sample: Sample, light: int, source: str) -> str:
        return f"{STIMULI}/{sample.made_from(light, source)}.png"

    def _missing(self, files: Mapping[int, str]) -> list[int]:
        missing = []
        for light, file in files.items():
            found = file_sha256(self._folder / file)
            if found is None or found != self._known.get(file, found):
                missing.append(light)
        self.rendered += len(missing)
        return missing

    def _take(
        self, sample: Sample, angles: Sequence[Angle], condition: str, files: Mapping[int, str]
    ) -> None:
        for angle in angles:
            file = files[angle.lights[sample.name]]
            self.stimuli.append(
                Stimulus(
                    sample=sample.name,
                    angle=angle.label,
                    condition=condition,
                    file=file,
                    sha256=file_sha256(self._folder / file) or "",
                )
            )
