"""The terminal as a desk: questions are printed, and answered with a key and Enter."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager

from impasto.errors import OptionError, Problem
from impasto.stand.desk import STOP, Desk


@contextmanager
def at_terminal(
    desk: Desk, say: Callable[[str], None], *, page: tuple[str, int] | None = None
) -> Iterator[None]:
    """Ask at the terminal, and on a page too if one is wanted, while the block runs.

    Parameters
    ----------
    desk : Desk
    say : callable
        Prints a line.
    page : (str, int), optional
        Address and port to serve the page at.

    Raises
    ------
    OptionError
        If there is neither a terminal nor a page, or the address cannot be used.
    """
    if page is None and not sys.stdin.isatty():
        what = "there is no terminal at which somebody could answer"
        do = "Add --page to answer in a browser, or --unattended to ask nobody"
        raise OptionError(Problem("impasto capture run", what, do))
    with ExitStack() as stack:
        if page is not None:
            from impasto.stand.page.server import serve_page

            say(f"for the tablet: {stack.enter_context(serve_page(desk, *page))}")
        ended = threading.Event()
        stack.callback(ended.set)
        if sys.stdin.isatty():
            threading.Thread(target=_print_questions, args=(desk, say, ended), daemon=True).start()
            threading.Thread(target=_read_answers, args=(desk, say), daemon=True).start()
        yield


def keys(choices: Mapping[str, str]) -> dict[str, str]:
    """Return the key of each choice: Enter for the first, and else the first letter that is not taken."""
    found = {"": next(iter(choices))}
    for choice in choices:
        found[next(letter for letter in (*choice, *"123456789") if letter not in found)] = choice
    return found


def _print_questions(desk: Desk, say: Callable[[str], None], ended: threading.Event) -> None:
    asked, version, waited = 0, -1, None
    while not ended.is_set():
        seen = desk.seen_after(version, 0.5)
        version, question = seen["version"], seen["question"]
        if (waiting := seen.get("waiting")) != waited:
            waited = waiting
            if waiting:
                say(waiting)
        if question and question["number"] != asked:
            asked = question["number"]
            names = {choice: key for key, choice in keys(question["choices"]).items() if key}
            first = next(iter(question["choices"]))
            offers = [
                f"{'Enter' if choice == first else names[choice]} = {words}"
                for choice, words in question["choices"].items()
            ]
            say(f"\n{question['text']}\n  {',  '.join(offers)}")


def _read_answers(desk: Desk, say: Callable[[str], None]) -> None:
    for line in sys.stdin:
        question = desk.question
        if question is None:
            if line.strip().casefold() in ("s", STOP):
                desk.stop()
                say("stopping after this photograph")
            continue
        choice = keys(question.choices).get(line.strip().casefold()[:1])
        if choice is None or not desk.answer(question.number, choice):
            say("That is none of the answers")
