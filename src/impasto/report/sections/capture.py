"""What was photographed: the pictures, the camera, the lights."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from impasto.arm import find_arm
from impasto.geometry import zenith_azimuth
from impasto.output import written_whole
from impasto.page import Picture, Section
from impasto.report.subject import Subject, drawn
from impasto.summaries.words import percent


def section(subject: Subject) -> Section:
    """Return how many photographs there are, how they were taken, and where the lights stood."""
    stack = subject.stack
    page = Section("What was captured")
    page.table((), list(_facts(subject)), caption="The photographs", words=True)
    zenith, azimuth = zenith_azimuth(stack.lights.direction)
    order = np.argsort(zenith, kind="stable")
    pictures = []
    for light, words in ((order[len(order) // 4], "higher"), (order[-1 - len(order) // 8], "lower")):
        at = f"{np.degrees(zenith[light]):.0f}° from the normal"
        pictures.append(
            subject.shown(
                subject.photograph(light),
                f"Photograph {stack.lights.names[light]}: light {at}",
                f"The painting as photographed under one of the {words} lights, {at}.",
                int(light),
            )
        )
    pictures.append(
        Picture(
            drawn(_draw_lights, np.degrees(zenith), np.degrees(azimuth)),
            "Where the lights stood, seen from the front of the painting",
            alt=f"Polar diagram of {len(zenith)} lights, from {np.degrees(zenith.min()):.0f} to "
            f"{np.degrees(zenith.max()):.0f} degrees from the normal.",
        )
    )
    page.pictures(pictures)
    page.text(
        f"Photographs are shown {subject.exposure:.3g} times as bright as their relative radiance under a "
        "light of unit strength, in sRGB."
    )
    return page


def _facts(subject: Subject) -> Iterator[tuple[str, str]]:
    stack = subject.stack
    lights, height, width, channels = stack.shape
    inputs = stack.attributes["inputs"]
    yield "photographs", f"{lights}, of {width} x {height} pixels and {channels} channels"
    yield "stored as", " and ".join(sorted({entry["dtype"] for entry in inputs}))
    for key, words in (("camera", "camera"), ("lens", "lens"), ("iso", "ISO"), ("f_number", "f-number")):
        if values := _values(inputs, key):
            yield words, values
    if times := [entry["exposure_s"] for entry in inputs if entry.get("exposure_s")]:
        low, high = min(times), max(times)
        yield "exposure time", f"{low:g} s" if low == high else f"{low:g} to {high:g} s"
    if taken := sorted(entry["taken"] for entry in inputs if entry.get("taken")):
        yield "taken", taken[0] if taken[0] == taken[-1] else f"{taken[0]} to {taken[-1]}"
    samples = lights * height * width * channels
    yield "clipped samples", percent(stack.clipped_samples / samples)
    if back := [float(np.hypot(*entry["shift_px"])) for entry in inputs if entry.get("shift_px")]:
        yield "shifted back", f"{len(back)} of the photographs, by up to {max(back):.2f} px"
    camera = stack.camera
    tilt = np.degrees(np.arccos(np.clip(camera.view_direction[2], -1.0, 1.0)))
    where = f"{tilt:.1f}° from the normal"
    yield "camera stands", where + (f", at {camera.distance_mm:g} mm" if camera.distance_mm else ", far away")
    if camera.mm_per_px:
        yield "size of a pixel", f"{camera.mm_per_px:.4g} mm on the painting"
    yield "lights", _lights(subject)
    source = stack.attributes.get("light_file")
    if source:
        yield "light directions from", str(source["file"])


def _lights(subject: Subject) -> str:
    lights = subject.stack.lights
    zenith = np.degrees(zenith_azimuth(lights.direction)[0])
    arm = find_arm(lights.direction)
    where = f"in one plane, at azimuth {np.degrees(arm.azimuth):.0f}°" if arm.planar else "all around"
    near = ", at positions nearby" if lights.near else ", taken to be far away"
    return f"{where}, {zenith.min():.0f} to {zenith.max():.0f}° from the normal{near}"


def _values(inputs: Sequence[dict[str, Any]], key: str) -> str:
    found = sorted({str(entry[key]) for entry in inputs if entry.get(key)})
    return ", ".join(found)


def _draw_lights(path: Path, zenith_deg: np.ndarray, azimuth_deg: np.ndarray) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.2, 4.6), dpi=110, facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot(projection="polar")
    axes.plot(np.radians(azimuth_deg), zenith_deg, "o", color="#0072b2", markersize=5)
    axes.set_rlim(0, 90)  # type: ignore[attr-defined]
    axes.set_rticks([30, 60, 90])  # type: ignore[attr-defined]
    axes.set_yticklabels(
        ["30°", "60°", "90°"], bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8, "alpha": 0.85}
    )
    axes.set_thetagrids([0, 90, 180, 270], ["right", "up", "left", "down"])  # type: ignore[attr-defined]
    axes.set_title("zenith angle of the lights, degrees", fontsize=10)
    with written_whole(path) as temporary:
        figure.savefig(temporary, format="png")
