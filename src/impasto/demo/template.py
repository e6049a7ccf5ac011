"""A page of text, tables and pictures in one HTML file that needs nothing else.

The file opens without a network: pictures lie in it as data URIs, there is no script, and the page forbids
itself to load anything. It follows the reader's choice of a light or a dark display.
"""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from pathlib import Path

from impasto.output import write_text


@dataclass(frozen=True)
class Picture:
    """A picture on the page.

    Parameters
    ----------
    data : bytes
        The whole image file.
    caption : str
        What it shows; also read out where the picture cannot be seen.
    kind : str
        The image's media type.
    """

    data: bytes
    caption: str
    kind: str = "image/png"


class SummaryPage:
    """A page that is written from top to bottom.

    Parameters
    ----------
    title : str
        The page's heading.
    lead : str
        One or two sentences under it.
    """

    def __init__(self, title: str, lead: str) -> None:
        self._title = title
        self._parts = [f'<h1>{escape(title)}</h1>\n<p class="lead">{escape(lead)}</p>']

    def heading(self, text: str) -> None:
        """Begin a section."""
        self._parts.append(f"<h2>{escape(text)}</h2>")

    def text(self, text: str) -> None:
        """Add a paragraph."""
        self._parts.append(f"<p>{escape(text)}</p>")

    def commands(self, lines: Iterable[str]) -> None:
        """Add commands as one would type them."""
        self._parts.append(f"<pre>{escape(chr(10).join(lines))}</pre>")

    def notes(self, title: str, notes: Sequence[str]) -> None:
        """Add a box of notes and warnings; nothing where there are none."""
        if notes:
            items = "".join(f"<li>{escape(note)}</li>" for note in notes)
            self._parts.append(f'<div class="notes"><strong>{escape(title)}</strong><ul>{items}</ul></div>')

    def pictures(self, pictures: Sequence[Picture], *, wide: bool = False) -> None:
        """Add pictures side by side, `wide` for those with writing in them."""
        figures = "".join(
            f'<figure><img src="data:{picture.kind};base64,{base64.b64encode(picture.data).decode()}" '
            f'alt="{escape(picture.caption)}"><figcaption>{escape(picture.caption)}</figcaption></figure>'
            for picture in pictures
        )
        self._parts.append(f'<div class="row{" wide" if wide else ""}">{figures}</div>')

    def table(
        self,
        header: Sequence[str],
        rows: Sequence[Sequence[str]],
        *,
        caption: str = "",
        total: bool = False,
        words: bool = False,
    ) -> None:
        """Add a table.

        Parameters
        ----------
        header : sequence of str
            The columns' names.
        rows : sequence of sequence of str
            The cells, as they shall be read.
        caption : str, optional
            What the table shows.
        total : bool, optional
            Whether the last row sums up the others.
        words : bool, optional
            Whether the cells are words rather than figures, which stand flush right.
        """
        head = "".join(f"<th>{escape(cell)}</th>" for cell in header)
        body = "".join(
            f"<tr{' class=total' if total and index == len(rows) - 1 else ''}>"
            + "".join(f"<td>{escape(cell)}</td>" for cell in row)
            + "</tr>"
            for index, row in enumerate(rows)
        )
        caption = f"<caption>{escape(caption)}</caption>" if caption else ""
        self._parts.append(
            f'<div class="scroll"><table{" class=words" if words else ""}>{caption}'
            f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>"
        )

    def html(self) -> str:
        """Return the whole page.

        Returns
        -------
        str
        """
        body = "\n".join(self._parts)
        style = files("impasto.demo").joinpath("template.css").read_text(encoding="utf-8")
        return (
            '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
            '<meta http-equiv="Content-Security-Policy" '
            "content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'\">\n"
            '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
            f"<title>{escape(self._title)}</title>\n<style>\n{style}</style>\n</head>\n"
            f"<body>\n<main>\n{body}\n</main>\n</body>\n</html>\n"
        )

    def write(self, path: Path) -> None:
        """Write the page to `path`.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        write_text(path, self.html())
