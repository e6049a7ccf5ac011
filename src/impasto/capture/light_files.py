"""Find the light file of a capture and read it, whatever its format."""

from __future__ import annotations

from pathlib import Path

from impasto.capture.lights import LightFile
from impasto.capture.lights_csv import read_csv
from impasto.capture.lights_lp import read_lp
from impasto.capture.lights_matrix import read_matrix
from impasto.errors import CaptureError, Problem, raise_problems
from impasto.geometry import Camera

_READERS = {".lp": read_lp, ".csv": read_csv, ".tsv": read_csv, ".txt": read_matrix}
_ENDINGS = ".toml, .lp, .csv"
# A bare matrix has an ending that anything may have, so only this name is found without being asked for.
_MATRIX_NAME = "light_directions.txt"


def find_light_file(folder: Path) -> Path:
    """Return the one light file in a folder.

    A TOML manifest that refers to the other light file in the folder counts as the one.

    Raises
    ------
    CaptureError
        If there is none, or more than one.
    """
    found = sorted(
        path
        for path in folder.iterdir()
        if path.is_file()
        and not path.name.startswith(".")
        and (path.suffix.lower() in (".toml", ".lp", ".csv") or path.name.casefold() == _MATRIX_NAME)
    )
    manifests = [path for path in found if path.suffix.lower() == ".toml"]
    if len(found) > 1 and len(manifests) == 1:
        referred = _read_manifest(manifests[0])[1]
        found = [path for path in found if path.name != referred]
    if not found:
        raise CaptureError(
            Problem(
                str(folder),
                f"holds no light file, expected one of {_ENDINGS} or {_MATRIX_NAME}",
                "Put one beside the photographs, or name it with --lights FILE",
            )
        )
    if len(found) > 1:
        names = ", ".join(path.name for path in found)
        raise CaptureError(
            Problem(str(folder), f"holds {len(found)} light files: {names}", "Choose one with --lights FILE")
        )
    return found[0]


def read_light_file(path: Path) -> LightFile:
    """Read a light file; what is wrong inside it is collected in `LightFile.problems`.

    Raises
    ------
    CaptureError
        If the file cannot be read at all, or is of no known format.
    """
    suffix = path.suffix.lower()
    if suffix == ".toml":
        manifest, lights = _read_manifest(path)
        if lights is None or manifest.problems:
            return manifest
        return _follow(manifest, path.parent / lights)
    if suffix not in _READERS:
        raise CaptureError(
            Problem(
                path.name, f"has the ending {suffix or 'none'}, expected {_ENDINGS}", "Rename or convert it"
            )
        )
    return _READERS[suffix](path, _read_text(path))


def read_camera(path: Path) -> Camera:
    """Return where the camera stands, from the table ``[camera]`` of a TOML file.

    Raises
    ------
    CaptureError
        If it cannot be read, or the camera in it cannot be used.
    """
    from impasto.capture.lights_toml import toml_camera

    file = toml_camera(path, _read_text(path))
    raise_problems(CaptureError, file.problems)
    return file.camera


def _read_manifest(path: Path) -> tuple[LightFile, str | None]:
    from impasto.capture.lights_toml import read_toml  # pydantic is slow to import, and seldom needed

    return read_toml(path, _read_text(path))


def _follow(manifest: LightFile, target: Path) -> LightFile:
    """Return the manifest with the lights of the file that it refers to."""
    if target.suffix.lower() == ".toml":
        do = "Name a .lp or .csv file, or list the lights as [[light]]"
        manifest.problems.append(Problem(manifest.path.name, "refers to another manifest", do))
        return manifest
    lights = read_light_file(target)
    manifest.rows = lights.rows
    manifest.notes += lights.notes
    manifest.problems += lights.problems
    return manifest


def _read_text(path: Path) -> str:
    """Return the text of a file in UTF-8, UTF-16 with its mark, or the code page of old Windows tools."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise CaptureError(
            Problem(str(path), f"cannot be read: {error.strerror}", "Check the name and the permissions")
        ) from error
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16", errors="replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")
