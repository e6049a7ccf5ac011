"""One run of a capture: light, expose, fetch, check, record, until all is there."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from impasto.errors import CaptureError, ImpastoError, Problem, raise_problems
from impasto.output import output_error
from impasto.stand.checks import spheres
from impasto.stand.checks.coverage import Coverage
from impasto.stand.checks.exposure import as_planned
from impasto.stand.checks.finding import Finding
from impasto.stand.desk import Desk, StoppedError
from impasto.stand.drivers import Camera, DriverError, Light, Stand
from impasto.stand.folder import CaptureFolder, sha256
from impasto.stand.judge import Judge
from impasto.stand.look import Look, look_at
from impasto.stand.plan_file import SUBJECTS
from impasto.stand.plan_text import photograph_lines
from impasto.stand.showing import show_photograph, show_progress
from impasto.stand.steps import Shot, shots

AGAIN = "again"
_KEEP, _DONE = "keep", "done"


@dataclass
class Session:
    """One run of a capture: its devices, and what it has taken.

    Parameters
    ----------
    stand : Stand
        Without devices; they are opened when they are first needed.
    folder : CaptureFolder
    open_camera, open_light : callable
    say : callable
        Called with lines for the terminal.
    """

    stand: Stand
    folder: CaptureFolder
    open_camera: Callable[[Stand], Camera]
    open_light: Callable[[Stand], Light]
    say: Callable[[str], None]
    camera: Camera | None = None
    taken: int = 0
    again: int = 0
    trouble: list[Problem] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    _subject: str | None = None
    _lit: str | None = None
    coverage: Coverage | None = None
    _redo: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        plan = self.stand.plan
        self.judge = Judge(plan.lights, plan.camera, plan.file.limits)
        self.shots = shots(plan)

    @property
    def desk(self) -> Desk:
        """Where a person is asked."""
        return self.stand.desk

    def take_all(self) -> bool:
        """Take what is missing, check the series, and declare the capture complete; return whether it is.

        Raises
        ------
        CaptureError
            If files are not as they were taken, or, where nobody attends, a check fails three times.
        OutputError
            If something cannot be written.
        """
        try:
            while self._missing() or not self._look_at_all():
                while shot := self._missing():
                    self.desk.check_stop()
                    self._take(shot)
                    if shot.kind == "spheres":
                        self._look_at_spheres()
            self._finish()
        except StoppedError:
            self.folder.journal.write("stopped")
            # Where somebody stopped by hand, that is no error; where nobody attends, what failed is.
            if self.desk.answers_itself is not None:
                raise_problems(CaptureError, self.trouble)
            return False
        finally:
            self._show_progress(None)
        return True

    def close(self) -> None:
        """Let go of the devices, whatever state they are in."""
        if self.stand.light is not None:
            self.stand.light.close()
        if self.camera is not None:
            self.camera.close()

    def remember(self) -> None:
        """Look again at what earlier runs took, so that the next photographs are compared with it."""
        if self.folder.journal.broken_lines:
            self._note(f"{self.folder.journal.broken_lines} unfinished lines of the journal were skipped")
        by_name = {shot.name: shot for shot in self.shots}
        if self.folder.kept:
            self.say(f"{len(self.folder.kept)} of {len(self.shots)} photographs are there; going on")
        for name, entry in list(self.folder.kept.items()):
            try:
                look = self._look(self.folder.path / entry["file"])
            except CaptureError as error:
                self.folder.put_aside(name, str(error))
                self._note(f"{name} cannot be read any more and is taken again: {error}")
            else:
                self.judge.accept(by_name[name], look)
        self.folder.journal.write("run", photographs=len(self.folder.kept))

    def _missing(self) -> Shot | None:
        """Return the first photograph that is not there."""
        return next((shot for shot in self.shots if shot.name not in self.folder.kept), None)

    def _take(self, shot: Shot) -> None:
        """Take a photograph; it is missing still if camera or light fail, or it has to be taken again."""
        self._show_progress(shot)
        try:
            self._prepare(shot)
            arrived = self._open_camera().take(shot, self.folder.incoming)
        except DriverError as error:
            self._failed(shot, error)
            return
        except OSError as error:
            raise output_error(self.folder.incoming, error.strerror or str(error)) from error
        self.taken += 1
        self._accept(shot, arrived)

    def _prepare(self, shot: Shot) -> None:
        """Have the subject before the camera and the lamp where it belongs."""
        subject = shot.kind
        light = self._open_light()
        if shot.place != self._lit or subject != self._subject:
            # What a person puts there is put there in the dark, and lamps settle while nobody moves.
            if subject != self._subject and {subject, self._subject} - {"painting", "ambient"}:
                self.desk.ask(f"Now {SUBJECTS[subject]}", {_DONE: "it is there"})
            if shot.place is None:
                light.off()
            else:
                light.show(self.stand.plan.place(shot.place))
            time.sleep(self.stand.plan.file.light.settle_s)
        self._subject, self._lit = subject, shot.place

    def _accept(self, shot: Shot, arrived: Path) -> None:
        """Check a file; take it in if it is good or wanted as it is, and set it aside otherwise."""
        try:
            look = self._look(arrived)
        except CaptureError as error:
            findings = [
                Finding("damaged", (shot.name,), f"{problem.what} ({arrived.name})", problem.do)
                for problem in error.problems
            ]
            choices = {AGAIN: "take it again"}
        else:
            findings = self._copies(shot, arrived) if look.pixels_sha256 else []
            findings = findings or [*as_planned(look, shot), *self.judge.judge(shot, look)]
            show_photograph(self.desk, shot, look, findings)
            unusable = any(finding.check == "duplicate" for finding in findings)
            choices = {AGAIN: "take it again"} | ({} if unusable else {_KEEP: "keep it as it is"})
        self._tell_clock()
        if findings:
            self.folder.journal.write("finding", name=shot.name, findings=[str(each) for each in findings])
            if self._decide(findings, choices) == AGAIN:
                self.folder.refuse(arrived, shot.name, "; ".join(finding.what for finding in findings))
                self.again += 1
                if any(finding.check == "light" for finding in findings):
                    self._lit = None  # a lamp that did not fire is told again
                for finding in findings:
                    for name in set(finding.photographs) & set(self.folder.kept):
                        self._set_aside(name, finding.what)
                return
        self.folder.add(shot, arrived, kept_with=[f"{each.check}: {each.what}" for each in findings])
        self.judge.accept(shot, look)
        self._redo.discard(shot.name)
        self.say(f"{shot.name}: {shot.label}" + ", kept as it is" * bool(findings))
        if shot.painting and shot.last:
            self._show_coverage()

    def _copies(self, shot: Shot, arrived: Path) -> list[Finding]:
        """Return whether a file is one that was taken before, set aside or not."""
        digest = sha256(arrived)
        for entry in self.folder.journal.of("photograph", "set-aside"):
            if entry.get("sha256") == digest:
                name = entry.get("name") or entry.get("refused")
                what = f"is the same file as that of {name}: the camera or its program gave it twice"
                return [Finding("duplicate", (shot.name,), what, "Take it again")]
        return []

    def _look_at_all(self) -> bool:
        """Check the series as a whole; return whether all of it is kept, and set aside what is not."""
        self._settle([*self.judge.series(), *self.judge.room(), *self._spheres()])
        return self._missing() is None

    def _look_at_spheres(self) -> None:
        """Check the spheres once all of their photographs are there, before anything is moved."""
        if all(shot.name in self.folder.kept for shot in self.shots if shot.kind == "spheres"):
            self._settle(self._spheres())

    def _settle(self, findings: list[Finding]) -> None:
        """Have somebody decide about each finding, and set aside what is to be taken again."""
        for finding in findings:
            if set(finding.photographs) <= self._kept_with(finding):
                continue
            self.folder.journal.write("finding", findings=[str(finding)])
            if self._decide([finding], {AGAIN: "take again", _KEEP: "keep as it is"}) == _KEEP:
                self.folder.keep_with(finding.photographs, f"{finding.check}: {finding.what}")
                continue
            for name in finding.photographs:
                self._set_aside(name, finding.what)

    def _kept_with(self, finding: Finding) -> set[str]:
        return {
            name
            for name, entry in self.folder.kept.items()
            if any(said.startswith(f"{finding.check}:") for said in entry.get("kept_with", ()))
        }

    def _set_aside(self, name: str, reason: str) -> None:
        """Set a photograph aside; with that of a light, its other exposures."""
        first = next(shot for shot in self.shots if shot.name == name)
        for shot in self.shots:
            same = shot.painting and first.painting and shot.place == first.place
            if shot.name in self.folder.kept and (same or shot.name == name):
                self.folder.put_aside(shot.name, reason)
                self.judge.forget(shot.name)
                self._redo.add(shot.name)
                self.again += 1
        self._lit = None  # the lamp is shown anew

    def _spheres(self) -> list[Finding]:
        plan, findings = self.stand.plan, []
        there = [shot for shot in self.shots if shot.kind == "spheres" and shot.name in self.folder.kept]
        planned = {
            shot.name: plan.lights.direction[plan.lights.names.index(shot.place)]
            for shot in there
            if shot.place is not None
        }
        for series in spheres.sphere_names([shot.name for shot in there]).values():
            paths = {name: self.folder.path / self.folder.kept[name]["file"] for name in series}
            findings += spheres.check_spheres(paths, planned, plan.camera)
        return findings

    def _finish(self) -> None:
        """Verify every file against the journal, then say that all is there."""
        if changed := self.folder.changed():
            for name in changed:
                self.folder.forget(name, "its file is missing or was changed")
            do = "Run the same command again: they are taken again"
            problem = Problem(", ".join(changed), "are missing or not as they were taken", do)
            raise CaptureError(problem)
        self._show_coverage()
        self.folder.finish(photograph_lines(self.stand.plan.file.photographs))
        self.folder.journal.write("complete")

    def _show_progress(self, now: Shot | None) -> None:
        show_progress(self.desk, self.shots, self.folder.kept, now, self._redo)

    def _show_coverage(self) -> None:
        found = self.judge.coverage()
        if found is not None:
            self.coverage = found
            self.desk.show(coverage={**vars(found), "enough": found.enough})

    def _open_light(self) -> Light:
        if self.stand.light is None:
            self.stand.light = self.open_light(self.stand)
        return self.stand.light

    def _open_camera(self) -> Camera:
        if self.camera is None:
            self.camera = self.open_camera(self.stand)
        return self.camera

    def _failed(self, shot: Shot, error: ImpastoError) -> None:
        """Ask what to do about a device that fails; go on with it opened anew."""
        self.folder.journal.write("failure", name=shot.name, problems=[str(each) for each in error.problems])
        self.trouble = list(error.problems)
        self.say(str(error))
        self.desk.ask(str(error), {AGAIN: "try again"}, problem=True, about=f"device for {shot.name}")
        self.close()
        self.stand.light = self.camera = self._lit = None

    def _decide(self, findings: list[Finding], choices: dict[str, str]) -> str:
        self.trouble = [finding.problem for finding in findings]
        text = "\n".join(f"{finding}. {finding.do}." for finding in findings)
        self.say(text)
        about = ", ".join(sorted({name for finding in findings for name in finding.photographs}))
        return self.desk.ask(text, choices, problem=True, about=about)

    def _look(self, path: Path) -> Look:
        photographs = self.stand.plan.file.photographs
        return look_at(path, photographs.transfer, photographs.clip_level)

    def _tell_clock(self) -> None:
        if step := self.folder.journal.clock_step_s():
            self.folder.journal.write("clock", step_s=step)
            self._note(
                f"the clock of this machine was set by {step:+.0f} s during the capture; the journal's order "
                "is that of its numbers"
            )

    def _note(self, text: str) -> None:
        self.notes.append(text)
        self.say(text)
