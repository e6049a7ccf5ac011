"""The desk: what the person at the stand sees and is asked, at the terminal and on the page alike."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

STOP = "stop"


@dataclass(frozen=True)
class Question:
    """Something that a person has to decide or to do.

    Parameters
    ----------
    number : int
        Of this question in the run.
    text : str
    choices : dict of str to str
        What the person may answer, with the words on the button; the first is what a foot pedal means.
    problem : bool
        Whether something went wrong.
    about : str
        What it is about, which is the same when the same thing is asked again.
    """

    number: int
    text: str
    choices: Mapping[str, str]
    problem: bool = False
    about: str = ""


class StoppedError(Exception):
    """The person asked to stop; all that was taken is kept."""


@dataclass
class Desk:
    """What is going on, for everyone who looks at it.

    Any number of threads may look, wait for a change and answer; the first answer counts.

    Parameters
    ----------
    answers_itself : callable, optional
        Called with each question, for a run that nobody attends; returns the answer.
    """

    answers_itself: Callable[[Question], str] | None = None
    version: int = 0
    state: dict[str, Any] = field(default_factory=dict)
    pictures: dict[str, bytes] = field(default_factory=dict)
    question: Question | None = None
    _asked: int = 0
    _answer: str | None = None
    _stop: bool = False
    _changed: threading.Condition = field(default_factory=threading.Condition)

    def show(self, **state: Any) -> None:
        """Change parts of what is shown."""
        with self._changed:
            self.state.update(state)
            self._change()

    def show_pictures(self, pictures: Mapping[str, bytes]) -> None:
        """Replace the pictures that are shown, files by their names."""
        with self._changed:
            self.pictures = dict(pictures)
            self.state["pictures"] = self.state.get("pictures", 0) + 1
            self._change()

    def ask(self, text: str, choices: Mapping[str, str], *, problem: bool = False, about: str = "") -> str:
        """Ask, and return the answer when there is one.

        Raises
        ------
        StoppedError
            If the answer is `STOP`.
        """
        with self._changed:
            self._asked += 1
            question = Question(self._asked, text, {**choices, STOP: "stop here"}, problem, about)
            if self.answers_itself is not None:
                answer = self.answers_itself(question)
            else:
                self.question, self._answer = question, None
                self._change()
                # A short wait again and again, so that Ctrl-C is heard.
                while self._answer is None and not self._stop:
                    self._changed.wait(0.2)
                answer = STOP if self._stop else self._answer or STOP
                self.question = None
                self._change()
        if answer == STOP:
            raise StoppedError
        return answer

    def answer(self, number: int, choice: str) -> bool:
        """Answer a question; return whether it was still open and knows this choice."""
        with self._changed:
            question = self.question
            if question is None or question.number != number or choice not in question.choices:
                return False
            if self._answer is None:
                self._answer = choice
                self._change()
            return True

    def stop(self) -> None:
        """Stop before the next photograph, or at the question that is open."""
        with self._changed:
            self._stop = True
            self._change()

    def check_stop(self) -> None:
        """Raise if somebody asked to stop.

        Raises
        ------
        StoppedError
        """
        if self._stop:
            raise StoppedError

    def seen_after(self, version: int, timeout_s: float) -> dict[str, Any]:
        """Return what is shown, once it differs from a version, or after a while."""
        with self._changed:
            self._changed.wait_for(lambda: self.version != version, timeout_s)
            question = self.question
            asked = None if question is None else {**vars(question), "choices": dict(question.choices)}
            return {**self.state, "version": self.version, "question": asked}

    def _change(self) -> None:
        self.version += 1
        self._changed.notify_all()
