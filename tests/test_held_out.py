"""Which photographs are held out, and what is said about a list that cannot be used."""

import numpy as np
import pytest

from impasto.errors import OptionError
from impasto.evaluate.held_out import named_lights, spread_lights
from impasto.geometry import Lights, dome_direction

NAMES = tuple(f"image{number:02d}" for number in range(1, 13))
ZENITH = np.radians(np.array([80, 10, 60, 20, 70, 30, 50, 40, 5, 15, 25, 35]))
LIGHTS = Lights(names=NAMES, direction=dome_direction(ZENITH, np.arange(12.0)))


@pytest.mark.parametrize("count", [1, 3, 5, 10])
def test_chosen_lights_are_spread_in_elevation(count):
    chosen = spread_lights(LIGHTS, count)
    assert len(set(chosen)) == count
    rank = np.argsort(np.argsort(ZENITH))[chosen]
    assert np.diff(np.sort(rank)).max(initial=0) <= -(-12 // count) + 1
    if count <= 4:
        assert 0 not in rank
        assert 11 not in rank


@pytest.mark.parametrize("count", [0, -1, 12, 40])
def test_a_number_that_leaves_nothing_is_refused(count):
    with pytest.raises(OptionError, match="from 1 to 11 can be held out"):
        spread_lights(LIGHTS, count)


def test_names_are_read_with_and_without_endings_paths_and_comments(tmp_path):
    path = tmp_path / "held-out.txt"
    path.write_text("# five\nimage03\n\nphotos/image05.jpg\nimage01.tif  # the lowest\nimage03.jpg\n")
    assert named_lights(path, NAMES) == [0, 2, 4]


def test_a_light_file_may_say_which(tmp_path):
    path = tmp_path / "test.lp"
    path.write_text("2\r\nimage12.jpg 0.1 0.2 0.97\r\nC:\\photos\\image02.jpg\t0.0\t0.6\t0.8\r\n")
    assert named_lights(path, NAMES) == [1, 11]


def test_every_unknown_name_is_listed(tmp_path):
    path = tmp_path / "held-out.txt"
    path.write_text("image99\nimage01\nphoto 7.jpg\n")
    with pytest.raises(OptionError) as caught:
        named_lights(path, NAMES)
    assert [problem.where.rsplit(" ", 1)[-1] for problem in caught.value.problems] == ["1", "3"]


def test_a_list_of_everything_or_nothing_is_refused(tmp_path):
    path = tmp_path / "held-out.txt"
    path.write_text("\n".join(NAMES))
    with pytest.raises(OptionError, match="none is left to fit"):
        named_lights(path, NAMES)
    path.write_text("# nothing here\n")
    with pytest.raises(OptionError, match="names no photograph"):
        named_lights(path, NAMES)
    with pytest.raises(OptionError, match="cannot be read"):
        named_lights(tmp_path / "absent.txt", NAMES)
