"""Re-enact the paper and put the tables and pictures into docs/paper-reenacted.md.

.venv/bin/python examples/reenact_paper.py measured_brdf.npz
"""

import re
import sys
import tempfile
from pathlib import Path

from PIL import Image

import impasto
from impasto.reproduce.tables import tables

PAGE = Path(__file__).resolve().parents[1] / "docs" / "paper-reenacted.md"
# One glossy, one matte and one of medium gloss, as the paper's Figs. 6 to 8 have three kinds.
SHOWN = ("a", "b", "h")


def lines(summary):
    """Yield the findings and the tables as Markdown."""
    yield from (f"- {finding}" for finding in summary.findings)
    for caption, header, rows in tables(summary.samples):
        yield from ("", f"**{caption}**", "", "| " + " | ".join(header) + " |", "|---" * len(header) + "|")
        yield from ("| " + " | ".join(row) + " |" for row in rows)


def main(measured: Path) -> None:
    """Run everything and write the page's tables and its picture."""
    with tempfile.TemporaryDirectory() as folder:
        summary = impasto.reproduce(Path(folder) / "out", measured=measured, say=print)
        plots = [Image.open(summary.samples[name].fitted["paper"].plot).convert("RGB") for name in SHOWN]
        joined = Image.new("RGB", (plots[0].width, sum(plot.height for plot in plots)), "white")
        for index, plot in enumerate(plots):
            joined.paste(plot, (0, sum(each.height for each in plots[:index])))
        joined.save(PAGE.parent / "images" / "reenacted.png", optimize=True)
        written = "\n".join(lines(summary))
    text = PAGE.read_text(encoding="utf-8")
    text = re.sub(
        r"(<!-- tables -->\n).*?(<!-- end of tables -->)",
        lambda found: f"{found[1]}\n{written}\n\n{found[2]}",
        text,
        flags=re.DOTALL,
    )
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
