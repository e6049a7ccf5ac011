"""Tables and light files of a study."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from impasto.angles.placement import arm_angles_deg
from impasto.geometry import Lights, zenith_azimuth
from impasto.output import write_text

if TYPE_CHECKING:
    from impasto.angles import ModelStudy


def write_table(folder: Path, study: ModelStudy) -> Path:
    """Write ``<model>.csv``: one row per set of photographs, with its errors.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    header = "strategy,size,rms,expected,psnr_db,ciede2000,low,high,photographs"
    writer.writerow(header.split(","))
    whole = study.regions[0]
    points = {(point.strategy, point.size): point for point in (*study.points, *whole.recommended.values())}
    for (strategy, size), point in sorted(points.items()):
        e = point.errors
        numbers = [f"{value:.6g}" for value in (e.rms, point.expected, e.psnr_db, e.ciede2000)]
        writer.writerow([strategy, size, *numbers, "", "", " ".join(point.photographs)])
    for each in study.random:
        low, median, high = (f"{value:.6g}" for value in (each.low, each.median, each.high))
        writer.writerow(["random", each.size, median, "", "", "", low, high, ""])
    path = folder / f"{study.model}.csv"
    write_text(path, text.getvalue())
    return path


def write_lists(folder: Path, study: ModelStudy, lights: Lights) -> list[Path]:
    """Write the recommended lights as ``<model>-recommended.lp`` and ``.csv``; see `write_lights`."""
    names = study.regions[0].best.photographs
    chosen = lights.select(np.array([lights.names.index(name) for name in names]))
    return write_lights(folder / f"{study.model}-recommended", chosen)


def write_lights(stem: Path, lights: Lights) -> list[Path]:
    """Write lights as ``.lp`` and as ``.csv``, as `stack` reads them.

    Parameters
    ----------
    stem : Path
        Of both files, without ending.
    lights : Lights

    Raises
    ------
    OutputError
        If they cannot be written.
    """
    # Named in full: what follows a dot in the stem is no ending to be replaced.
    lp, table = (stem.with_name(stem.name + ending) for ending in (".lp", ".csv"))
    rows = [
        f"{name} {x:.6f} {y:.6f} {z:.6f}"
        for name, (x, y, z) in zip(lights.names, lights.direction.tolist(), strict=True)
    ]
    write_text(lp, "\n".join([str(len(rows)), *rows]) + "\n")
    arm = arm_angles_deg(lights.direction)
    along_x = np.abs(lights.direction[:, 1]).max() < 1e-6
    if arm is not None and along_x:
        lines = ["file,arm_angle_deg"]
        lines += [f"{name},{angle:.3f}" for name, angle in zip(lights.names, arm.tolist(), strict=True)]
    else:
        zenith, azimuth = np.degrees(zenith_azimuth(lights.direction))
        lines = ["file,zenith_deg,azimuth_deg"]
        lines += [
            f"{name},{high:.3f},{around:.3f}"
            for name, high, around in zip(lights.names, zenith.tolist(), azimuth.tolist(), strict=True)
        ]
    write_text(table, "\n".join(lines) + "\n")
    return [lp, table]
