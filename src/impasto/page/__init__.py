"""A page of text, tables and pictures in one HTML file that needs nothing else.

The file opens without a network: pictures lie in it as data URIs, there is no script, and the page forbids
itself to load anything. It follows the reader's choice of a light or a dark display, reads on paper, and is
laid out for keyboards and screen readers: sections with headings, a list of them to jump by, a text beside
every picture, headers for the rows and columns of tables, and every wide table reachable to be scrolled.
"""

from __future__ import annotations

import base64
import re
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
        What it shows, in words under it.
    kind : str
        The image's media type.
    alt : str
        What to read out where the picture cannot be seen; the caption, if it is left empty.
    """

    data: bytes
    caption: str
    kind: str = "image/png"
    alt: str = ""


class Section:
    """A part of the page under a heading of its own, written from top to bottom.

    Parameters
    ----------
    title : str
        The heading.
    """

    def __init__(self, title: str) -> None:
        self.title = title
        self._parts: list[str] = []

    @property
    def anchor(self) -> str:
        """What links to the section end with."""
        return re.sub(r"[^a-z0-9]+", "-", self.title.lower()).strip("-")

    def heading(self, text: str) -> None:
        """Begin a subsection."""
        self._parts.append(f"<h3>{escape(text)}</h3>")

    def text(self, text: str) -> None:
        """Add a paragraph."""
        self._parts.append(f"<p>{escape(text)}</p>")

    def items(self, items: Iterable[str]) -> None:
        """Add a list."""
        self._parts.append(f"<ul>{''.join(f'<li>{escape(item)}</li>' for item in items)}</ul>")

    def commands(self, lines: Iterable[str]) -> None:
        """Add commands as one would type them."""
        self._parts.append(f'<pre tabindex="0">{escape(chr(10).join(lines))}</pre>')

    def notes(self, title: str, notes: Sequence[str]) -> None:
        """Add a box of notes and warnings; nothing where there are none."""
        if notes:
            items = "".join(f"<li>{escape(note)}</li>" for note in notes)
            self._parts.append(f'<div class="notes"><strong>{escape(title)}</strong><ul>{items}</ul></div>')

    def pictures(self, pictures: Sequence[Picture], *, columns: int = 3) -> None:
        """Add pictures side by side.

        Parameters
        ----------
        pictures : sequence of Picture
        columns : {3, 2, 1}, optional
            How many stand in a row of a wide page: three plain pictures, two with a legend, one plot. On
            paper, pictures with writing have a row of their own.
        """
        figures = "".join(
            f'<figure><img src="data:{picture.kind};base64,{base64.b64encode(picture.data).decode()}" '
            f'alt="{escape(picture.alt or picture.caption)}">'
            f"<figcaption>{escape(picture.caption)}</figcaption></figure>"
            for picture in pictures
        )
        self._parts.append(f'<div class="row of{columns}">{figures}</div>')

    def table(
        self,
        header: Sequence[str],
        rows: Sequence[Sequence[str]],
        *,
        caption: str,
        total: bool = False,
        words: bool = False,
    ) -> None:
        """Add a table, of which the first column names the rows.

        Parameters
        ----------
        header : sequence of str
            The columns' names; empty where the first column says what the second is.
        rows : sequence of sequence of str
            The cells, as they shall be read.
        caption : str
            What the table shows.
        total : bool, optional
            Whether the last row sums up the others.
        words : bool, optional
            Whether the cells are words rather than figures, which stand flush right.
        """
        head = "".join(f'<th scope="col">{escape(cell)}</th>' for cell in header)
        head = f"<thead><tr>{head}</tr></thead>" if head else ""
        body = "".join(
            f"<tr{' class=total' if total and index == len(rows) - 1 else ''}>"
            f'<th scope="row">{escape(row[0])}</th>'
            + "".join(f"<td>{escape(cell)}</td>" for cell in row[1:])
            + "</tr>"
            for index, row in enumerate(rows)
        )
        # A table wider than the screen is scrolled by its own frame, which the keyboard must reach.
        self._parts.append(
            f'<div class="scroll" tabindex="0" role="region" aria-label="{escape(caption)}">'
            f"<table{' class=words' if words else ''}><caption>{escape(caption)}</caption>"
            f"{head}<tbody>{body}</tbody></table></div>"
        )

    def html(self) -> str:
        """Return the section as HTML."""
        name = self.anchor
        heading = f'<h2 id="{name}">{escape(self.title)}</h2>'
        return "\n".join([f'<section aria-labelledby="{name}">', heading, *self._parts, "</section>"])


class Page:
    """A page that is written from top to bottom.

    Parameters
    ----------
    title : str
        The page's heading.
    lead : str
        One or two sentences under it.
    contents : bool, optional
        Whether to list the sections at the top.
    """

    def __init__(self, title: str, lead: str, *, contents: bool = False) -> None:
        self.title = title
        self._lead = lead
        self._contents = contents
        self._sections: list[Section] = []

    def section(self, title: str) -> Section:
        """Begin a section and return it to be written."""
        return self.add(Section(title))

    def add(self, section: Section) -> Section:
        """Append a section, and return it."""
        self._sections.append(section)
        return section

    def html(self) -> str:
        """Return the whole page."""
        style = files("impasto.page").joinpath("page.css").read_text(encoding="utf-8")
        body = "\n".join(section.html() for section in self._sections)
        contents = ""
        if self._contents:
            links = "".join(
                f'<li><a href="#{section.anchor}">{escape(section.title)}</a></li>'
                for section in self._sections
            )
            contents = f'<nav aria-label="Contents"><ol>{links}</ol></nav>\n'
        return (
            '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
            '<meta http-equiv="Content-Security-Policy" '
            "content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'\">\n"
            '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
            f"<title>{escape(self.title)}</title>\n<style>\n{style}</style>\n</head>\n"
            f"<body>\n<main>\n<h1>{escape(self.title)}</h1>\n"
            f'<p class="lead">{escape(self._lead)}</p>\n{contents}{body}\n</main>\n</body>\n</html>\n'
        )

    def write(self, path: Path) -> None:
        """Write the page to `path`.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        write_text(path, self.html())
