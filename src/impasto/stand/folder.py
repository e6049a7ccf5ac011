"""The folder of a capture: photographs come in whole, under their own names, and nothing is overwritten."""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from impasto.capture.manifest import manifest
from impasto.capture.photographs import READERS, natural_key
from impasto.errors import CaptureError, OutputError, Problem, raise_problems
from impasto.geometry import Lights
from impasto.output import output_error, prepare_folder, write_text
from impasto.stand.journal import Journal
from impasto.stand.plan_file import Plan, parse_plan
from impasto.stand.steps import BRACKETS, Shot, shots, shutter

MANIFEST = "capture.toml"
RECORD = "record"


class CaptureFolder:
    """The folder that `impasto capture run` fills.

    Photographs lie where `impasto stack` looks for them; ``record/`` holds the plan, the journal, and what
    was taken and set aside. A photograph is journalled with its digest before it gets its name, so that a run
    that is cut off at any point finds it again. The manifest, without which `stack` reads nothing, is written
    last.

    Parameters
    ----------
    path : Path
    plan : Plan

    Raises
    ------
    OutputError
        If it cannot be written.
    CaptureError
        If it holds something else, or the capture of another plan.
    """

    def __init__(self, path: Path, plan: Plan) -> None:
        self.path, self.plan = path, plan
        self.record = path / RECORD
        self.check(path)
        self.incoming = prepare_folder(self.record / "incoming")
        self.set_aside = prepare_folder(self.record / "set-aside")
        self.journal = Journal(self.record / "journal.jsonl")
        self.kept: dict[str, dict[str, Any]] = {}
        for entry in self.journal.entries:
            self._follow(entry)
        self._keep_plan()
        self._finish_what_was_cut_off()

    @staticmethod
    def check(path: Path) -> None:
        """Raise a CaptureError if a folder holds something else than a capture that was begun."""
        if path.exists() and not (path.is_dir() and ((path / RECORD).is_dir() or not any(path.iterdir()))):
            do = "Name a new folder, or one that impasto capture run has begun"
            raise CaptureError(Problem(str(path), "holds something else than a capture", do))

    def add(self, shot: Shot, arrived: Path, **about: Any) -> Path:
        """Take a photograph in under its name, and return where it lies.

        Parameters
        ----------
        shot : Shot
        arrived : Path
            The file, in `incoming`.
        **about
            What the journal is to say of it.

        Raises
        ------
        OutputError
            If it cannot be written; the file then stays where it was.
        """
        target = self.path / f"{shot.name}{arrived.suffix.lower()}"
        if target.exists():
            raise OutputError(
                Problem(str(target), "is there already, and nothing is overwritten", "Move it elsewhere")
            )
        sync(arrived)
        entry = self.journal.write(
            "photograph",
            name=shot.name,
            file=target.relative_to(self.path).as_posix(),
            incoming=arrived.name,
            sha256=sha256(arrived),
            bytes=arrived.stat().st_size,
            exposure_s=shot.exposure_s,
            **about,
        )
        self._move(arrived, target)
        self._follow(entry)
        return target

    def put_aside(self, name: str, reason: str) -> None:
        """Move a photograph out of the capture, because it is to be taken again; it is kept.

        Raises
        ------
        OutputError
            If it cannot be moved.
        """
        source = self.path / self.kept[name]["file"]
        self._aside(source, name=name, reason=reason)

    def keep_with(self, names: Iterable[str], finding: str) -> None:
        """Note that photographs are kept although something is wrong with them."""
        self._follow(self.journal.write("kept", names=list(names), finding=finding))

    def refuse(self, arrived: Path, name: str, reason: str) -> None:
        """Keep a file that is no photograph of the capture; errors as for `put_aside`."""
        self._aside(arrived, refused=name, reason=reason)

    def changed(self) -> list[str]:
        """Return the photographs whose files are missing or are not what was taken."""
        return [
            name
            for name, entry in self.kept.items()
            if not (self.path / entry["file"]).is_file()
            or sha256(self.path / entry["file"]) != entry["sha256"]
        ]

    def forget(self, name: str, reason: str) -> None:
        """Note that a photograph is not there any more."""
        self._follow(self.journal.write("lost", name=name, reason=reason))

    def finish(self, photographs: Iterable[str]) -> Path:
        """Write the manifests of a finished capture, that of the folder itself last, and return it.

        Parameters
        ----------
        photographs : iterable of str
            Lines of ``[photographs]``.

        Raises
        ------
        OutputError
            If they cannot be written.
        """
        painting = [shot for shot in shots(self.plan) if shot.painting]
        brackets = sorted({shot.bracket for shot in painting}, reverse=True)
        path = self.path / MANIFEST
        for bracket in brackets:
            lines = list(photographs)
            if bracket == 0 and len(brackets) > 1:
                folders = ", ".join(f'"{BRACKETS}/{number}"' for number in sorted(brackets)[1:])
                lines.append(f"brackets = [{folders}]")
            path = (self.path / BRACKETS / str(bracket) if bracket else self.path) / MANIFEST
            write_text(path, self._manifest([shot for shot in painting if shot.bracket == bracket], lines))
        return path

    def _manifest(self, shots: list[Shot], lines: list[str]) -> str:
        files = [Path(self.kept[shot.name]["file"]).name for shot in shots]
        names = list(self.plan.lights.names)
        chosen: Lights = self.plan.lights.select(np.array([names.index(str(shot.place)) for shot in shots]))
        return manifest(
            files, chosen, self.plan.camera, lines, exposure_s=[shot.exposure_s for shot in shots]
        )

    def _keep_plan(self) -> None:
        """Keep the plan beside the photographs, and later ones too, if they are of the same photographs."""
        kept = sorted(self.record.glob("plan-*.toml"), key=lambda path: natural_key(path.stem))
        text = kept[-1].read_text(encoding="utf-8") if kept else ""
        if text == self.plan.text:
            return
        if kept and _named(parse_plan(text, kept[-1])) != _named(self.plan):
            do = f"Go on with {kept[-1]}, or capture into another folder"
            raise CaptureError(Problem(str(self.path), "was begun by a plan of other photographs", do))
        planned = {shot.name: shot.exposure_s for shot in shots(self.plan)}
        do = "Restore the time in the plan; only photographs that are not taken yet may get another"
        problems = [
            Problem(name, f"was exposed for {shutter(time)}, the plan now says {shutter(planned[name])}", do)
            for name, entry in self.kept.items()
            if (time := entry["exposure_s"]) != planned[name]
        ]
        raise_problems(CaptureError, problems)
        write_text(self.record / f"plan-{len(kept) + 1}.toml", self.plan.text)

    def _finish_what_was_cut_off(self) -> None:
        for name, entry in list(self.kept.items()):
            target, arrived = self.path / entry["file"], self.incoming / entry["incoming"]
            if not target.exists() and arrived.is_file() and sha256(arrived) == entry["sha256"]:
                self._move(arrived, target)
            elif target.exists():
                with suppress(OSError):
                    if arrived.is_file() and os.path.samefile(arrived, target):
                        arrived.unlink()
            else:
                self.forget(name, "its file is missing")
        for path in sorted(self.incoming.iterdir()):
            if path.is_file():
                self.refuse(path, path.name, "a run was cut off before it was taken in")
        known = {entry["file"] for entry in self.kept.values()}
        for shot in shots(self.plan):
            place = self.path / shot.name
            for path in sorted(place.parent.glob(f"{place.name}.*")):
                there = path.relative_to(self.path).as_posix()
                if path.suffix.lower() in READERS and path.stem == place.name and there not in known:
                    self.refuse(path, shot.name, "the journal does not know it, or it was set aside")

    def _aside(self, source: Path, **about: Any) -> None:
        """Move a file aside under a number of its own: link it, note it, then remove it where it was."""
        number = max((int(path.name.split("-")[0]) for path in self.set_aside.iterdir()), default=0) + 1
        target = self.set_aside / f"{number:04d}-{source.name}"
        try:
            _link(source, target)
        except OSError as error:
            raise output_error(target, error.strerror or str(error)) from error
        entry = self.journal.write("set-aside", file=target.name, sha256=sha256(target), **about)
        source.unlink(missing_ok=True)
        self._follow(entry)

    def _move(self, source: Path, target: Path) -> None:
        prepare_folder(target.parent)
        try:
            _link(source, target)
            source.unlink(missing_ok=True)
            sync(target.parent)
        except OSError as error:
            raise output_error(target, error.strerror or str(error)) from error

    def _follow(self, entry: dict[str, Any]) -> None:
        if entry["event"] == "photograph":
            self.kept[entry["name"]] = entry
        elif entry["event"] in ("set-aside", "lost"):
            self.kept.pop(entry.get("name", ""), None)
        elif entry["event"] == "kept":
            for name in entry["names"]:
                if name in self.kept:
                    known = self.kept[name]
                    self.kept[name] = known | {"kept_with": [*known.get("kept_with", ()), entry["finding"]]}


def _named(plan: Plan) -> list[tuple[str, str, str | None]]:
    """Return what makes photographs the same: name, subject and place, but not the exposure."""
    return [(shot.name, shot.kind, shot.place) for shot in shots(plan)]


def sha256(path: Path) -> str:
    """Return the SHA-256 of a file in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def sync(path: Path) -> None:
    """Wait until a file or a folder is on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError:  # some file systems cannot do it for folders
        if path.is_file():
            raise
    finally:
        os.close(descriptor)


def free_bytes(path: Path) -> int:
    """Return how much room is left where a folder is or will be."""
    there = next(parent for parent in [path.absolute(), *path.absolute().parents] if parent.exists())
    return shutil.disk_usage(there).free


def _link(source: Path, target: Path) -> None:
    """Give a file a second name that is not taken; unlike renaming, this never overwrites.

    Raises
    ------
    OSError
        If the name is taken, or cannot be given.
    """
    try:
        os.link(source, target)
    except FileExistsError:
        raise
    except OSError:  # a file system without links, such as a memory card's
        if target.exists():
            raise FileExistsError(str(target)) from None
        os.rename(source, target)
