"""Colours between photosites are those that LibRaw interpolates."""

import numpy as np
import pytest
import rawpy

from impasto.capture.mosaic import interpolate
from impasto.capture.photographs import read_photograph
from impasto.capture.raw import development
from impasto.capture.simulate.dng import write_dng


@pytest.mark.parametrize("rows", [7, 64])
def test_inside_the_edges_a_photograph_is_what_libraw_makes_of_it(tmp_path, rows):
    noise = np.random.default_rng(3).integers(500, 60000, (40, 60, 3)).astype(np.uint16)
    write_dng(tmp_path / "noise.dng", noise)
    photograph, _ = read_photograph(tmp_path / "noise.dng")
    read = np.concatenate([band for _, band in photograph.bands(rows)]).astype(int)
    with rawpy.imread(str(tmp_path / "noise.dng")) as raw:
        expected = raw.postprocess(**development()).astype(int)
    np.testing.assert_allclose(read[1:-1, 1:-1], expected[1:-1, 1:-1], atol=1)


@pytest.mark.parametrize("order", [(0, 1, 3, 2), (2, 1, 3, 0), (1, 0, 2, 3), (1, 2, 0, 3), (3, 0, 2, 1)])
def test_a_plane_stays_a_plane_wherever_the_colours_stand(order):
    pattern = np.array(order, np.uint8).reshape(2, 2)
    y, x = np.mgrid[:24, :32]
    planes = np.stack([60 * y + 40 * x, 9000 - 20 * y + 80 * x, 40 * y + 20000 - 8 * x], axis=-1)
    cells = np.empty((12, 16, 4), np.uint16)
    for (row, column), channel in np.ndenumerate(pattern):
        cells[..., channel] = planes[row::2, column::2, 1 if channel == 3 else channel]
    found = interpolate(cells, pattern, slice(0, 24)).astype(int)
    np.testing.assert_allclose(found[1:-1, 1:-1], planes[1:-1, 1:-1], atol=1)
    np.testing.assert_array_equal(interpolate(cells, pattern, slice(5, 9)), found[5:9])
