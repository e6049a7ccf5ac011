"""Measure everything in one run, print a table and write it beside this file: python -m benchmarks.

--quick takes a tenth of the pixels, to see that the benchmarks run; its figures mean nothing, and it writes
quick.json and quick.md instead of results.json and results.md.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from benchmarks import accuracy, angles, procedures, raw, speed, viewer, whole
from benchmarks.photographs import write_capture
from benchmarks.problem import LIGHTS, light_directions, simulate
from benchmarks.report import Row, write

SCIPY_BAR = 800
WHOLE_BAR = 1.4
# Of a fit with a residual and self-calibration over one without.
RESIDUAL_BAR = 2.0
# Of a rendering with a residual of 18 components, read from the store: 4 Mpx.
FRAME_BAR_S = 0.5
FRAME_BAR_PX = 1 << 22
MEMORY_BAR_GB = 1.5
RAW_BAR = 1.3
RAW_MEMORY_BAR_GB = 2.0
ANGLES_BAR_S = 120
# Of a fit of 4 Mpx; larger ones are sampled, and are to take no longer.
REPORT_BAR_S = 10.0
# The residual's median is 0.997 for any correct fit; above this the fit does not reach the noise.
RESIDUAL_SLACK = 1.005
PAGE_BAR_S = 1.5
PAGE_BAR_REQUESTS = 60
PAGE_BAR_MB = 600


def accuracy_rows(pixels: int) -> list[Row]:
    """Compare the joint fit's errors with the figures to beat and with the Cramér-Rao bound."""
    problem = simulate(pixels)
    reached = accuracy.figures(problem, speed.fit_core(problem))
    least = accuracy.bound(min(pixels, 20_000))
    rows = []
    for what, bar in accuracy.BARS.items():
        slack = RESIDUAL_SLACK if what.startswith("residual") else 1
        rows.append(Row(what, reached[what], bar * slack, note=f"bound {least[what]:.3g}"))
    return rows


def speed_rows(pixels: int, scipy_pixels: int, threads: int) -> list[Row]:
    """Compare pixels per second of processor time with scipy's, and the solutions themselves."""
    core = speed.measure("core", pixels)
    shared = speed.measure("core", pixels, threads)
    rows = [
        Row("impasto joint fit, px per CPU-second", pixels / core["cpu_s"], note="one thread"),
        Row("impasto joint fit, px/s", pixels / shared["wall_s"], note=f"{threads} threads"),
    ]
    for method, title in (("trf", "scipy TRF"), ("lm", "scipy LM")):
        scipy = speed.measure(method, scipy_pixels)
        per_second = scipy_pixels / scipy["cpu_s"]
        same = speed.same_solution(core, scipy)
        rows += [
            Row(f"{title}, px per CPU-second", per_second),
            Row(
                f"impasto over {title}",
                pixels / core["cpu_s"] / per_second,
                SCIPY_BAR if method == "trf" else None,
                at_least=True,
            ),
            Row(
                f"same solution as {title}, share of pixels",
                same["agreeing"],
                0.995,
                at_least=True,
                note=f"elsewhere χ² is lower for impasto in {same['core_better']:.2%}, for scipy in "
                f"{same['scipy_better']:.2%}; differences {same['normal_difference_deg']:.1e}° and "
                f"{same['c_difference_relative']:.1e} of c (99th percentile)",
            ),
        ]
    return rows


def procedure_rows(folder: Path, side_px: int) -> list[Row]:
    """Compare the paper procedure with the joint one."""
    speeds = procedures.measure(folder, side_px)
    rows = []
    for what in ("fit", "store to store"):
        joint, paper = (speeds[procedure][what] for procedure in ("joint", "paper"))
        rows += [
            Row(f"joint procedure, {what}, px per CPU-second", joint, note=f"{LIGHTS} lights in a dome"),
            Row(
                f"paper procedure, {what}, px per CPU-second",
                paper,
                joint,
                at_least=True,
                note=f"{LIGHTS} lights on an arm; the bar is the joint procedure",
            ),
        ]
    return rows


def angles_rows(folder: Path, side_px: int, pixels: int) -> list[Row]:
    """Time the study of which photographs were needed."""
    measured = angles.measure(folder, side_px, pixels)
    title = f"angles, {angles.LIGHTS} lights, {pixels:,} pixels, s"
    what = f"{measured['strategies']:.0f} strategies, {measured['sizes']:.0f} sizes, 40 random sets of each"
    return [Row(title, measured["seconds"], ANGLES_BAR_S, note=what)]


def whole_rows(folder: Path, sizes: list[tuple[int, int]]) -> list[Row]:
    """Time `impasto stack` and `impasto fit`, and their memory, at each size."""
    rows = []
    for height, width in sizes:
        capture = write_capture(folder / f"{width}x{height}", light_directions(), height, width)
        measured = whole.measure(capture, folder / f"{width}x{height}.zarr")
        title = f"{LIGHTS} × {measured['megapixels']:.1f} Mpx"
        rows += [
            Row(f"{title}: stack, s", measured["stack"]["wall_s"]),
            Row(f"{title}: fit, s", measured["fit"]["wall_s"]),
            Row(f"{title}: decoding alone, s", measured["decode_alone_s"]),
            Row(f"{title}: fit from memory alone, s", measured["fit_alone_s"]),
            Row(f"{title}: whole over both alone", measured["ratio"], WHOLE_BAR),
            Row(f"{title}: fit with residual and self-calibration, s", measured["residual"]["wall_s"]),
            Row(f"{title}: that over the fit without", measured["residual_ratio"], RESIDUAL_BAR),
            Row(
                f"{title}: frame with residual, s",
                measured["frame_s"],
                FRAME_BAR_S * max(1.0, capture.pixels / FRAME_BAR_PX),
                note="from the store to radiance under one light",
            ),
            Row(f"{title}: peak memory, GB", measured["peak_gb"], MEMORY_BAR_GB),
            Row(f"{title}: report, s", measured["report"]["wall_s"], REPORT_BAR_S),
        ]
        for file in capture.files:
            file.unlink()
    return rows


def raw_rows(folder: Path, height: int, width: int) -> list[Row]:
    """Compare `impasto stack` of raw files, with every correction, with LibRaw's decoding alone."""
    measured = raw.measure(folder, height, width)
    title = f"{raw.PHOTOGRAPHS} raw files × {measured['megapixels']:.1f} Mpx"
    by_cpu = f"{measured['cpu_ratio']:.3g} by processor time"
    return [
        Row(f"{title}: stack, s", measured["stack_s"], note="dark frame, flat field and white reference"),
        Row(f"{title}: LibRaw's decoding alone, s", measured["decode_s"]),
        Row(f"{title}: stack over decoding", measured["ratio"], RAW_BAR, note=by_cpu),
        Row(f"{title}: peak memory, GB", measured["peak_gb"], RAW_MEMORY_BAR_GB),
    ]


def viewer_rows(folder: Path, panning_s: float) -> list[Row]:
    """Open the page of a large painting, and pan it."""
    measured = viewer.measure(folder, panning_s)
    height, width = viewer.SIZE
    title = f"page of {width:,} × {height:,} px"
    whole = f"all of the view after {measured['whole_s']:.2f} s"
    empty = f"an empty browser takes {measured['empty_browser_mb']:.0f} MB more"
    return [
        Row(f"{title}: first picture, s", measured["first_s"], PAGE_BAR_S, note=whole),
        Row(f"{title}: requests for it", measured["requests"], PAGE_BAR_REQUESTS),
        Row(f"{title}: memory while panning, MB", measured["memory_mb"], PAGE_BAR_MB, note=empty),
    ]


def main() -> int:
    """Run the sections asked for and return how many figures miss their bar."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a tenth of the pixels")
    parser.add_argument(
        "--only",
        choices=["accuracy", "speed", "procedures", "angles", "whole", "raw", "viewer"],
        help="one section; prints, writes nothing",
    )
    parser.add_argument("--folder", type=Path, help="where to put the photographs and stores (about 14 GB)")
    arguments = parser.parse_args()
    share = 10 if arguments.quick else 1
    with tempfile.TemporaryDirectory(dir=arguments.folder) as name:
        folder = Path(name)
        sizes = [(512, 768), (768, 1024)] if arguments.quick else [(2048, 2048), (4096, 4096)]
        sections = {
            "accuracy": ("Accuracy", lambda: accuracy_rows(200_000 // share)),
            "speed": ("Speed", lambda: speed_rows(200_000 // share, 3000 // share, 2)),
            "procedures": ("Procedures", lambda: procedure_rows(folder, 2048 if share == 1 else 320)),
            "angles": ("Which photographs", lambda: angles_rows(folder, 256, 20_000 // share)),
            "whole": ("From photographs to maps", lambda: whole_rows(folder, sizes)),
            "raw": (
                "Raw files",
                lambda: raw_rows(folder / "raw", *((400, 600) if share > 1 else (4000, 6000))),
            ),
            "viewer": ("The page", lambda: viewer_rows(folder / "page", 120 / share)),
        }
        chosen = [arguments.only] if arguments.only else list(sections)
        rows = {}
        for section in chosen:
            title, measure = sections[section]
            print(f"{title} …", flush=True)
            rows[title] = measure()
        destination = folder if arguments.only else Path(__file__).parent
        print(write(rows, destination, "quick" if arguments.quick else "results"))
    return sum(row.met is False for section in rows.values() for row in section)


if __name__ == "__main__":
    raise SystemExit(1 if main() else 0)
