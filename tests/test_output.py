"""Files outside the store are there whole or not at all."""

from collections import namedtuple

import pytest

from impasto import output
from impasto.errors import OutputError


def test_an_interruption_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "a.txt"
    output.write_text(path, "old")

    def interrupted():
        with output.written_whole(path) as temporary:
            temporary.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_full_disk_is_named(tmp_path, monkeypatch):
    usage = namedtuple("usage", "free")
    monkeypatch.setattr(output.shutil, "disk_usage", lambda folder: usage(0))
    with pytest.raises(OutputError, match="no room left on the disk"):
        output.write_text(tmp_path / "absent" / "a.txt", "text")


def test_only_unfinished_files_are_removed(tmp_path):
    kept = tmp_path / "film.partial"
    kept.touch()
    output.prepare_folder(tmp_path / "photos")
    output.partial_path(tmp_path / "photos" / "a.png").touch()
    output.remove_partial(tmp_path)
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["film.partial", "photos"]
