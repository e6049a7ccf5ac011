"""The errors that bands add up to are those of the whole images."""

from itertools import pairwise

import numpy as np
import pytest
from skimage.metrics import peak_signal_noise_ratio, structural_similarity

from impasto.evaluate.errors import ErrorAccumulator


def gathered(photograph, rendering, clipped=None, bands=(0, 5, 6, 30, 64)):
    """Return the errors of two images with values in 0 to 1, shown as they are, fed in uneven bands."""
    clipped = np.zeros(photograph.shape, bool) if clipped is None else clipped
    accumulator = ErrorAccumulator(*photograph.shape)
    for start, stop in pairwise(bands):
        rows = slice(start, stop)
        accumulator.add(photograph[rows], rendering[rows], photograph[rows], rendering[rows], clipped[rows])
    return accumulator.result()


@pytest.fixture
def images():
    generator = np.random.default_rng(7)
    photograph = generator.random((64, 50, 3), dtype=np.float32)
    rendering = np.clip(photograph + 0.1 * generator.standard_normal(photograph.shape), 0, 1)
    return photograph, rendering.astype(np.float32)


def test_bands_give_what_the_whole_images_give(images):
    errors = gathered(*images)
    assert errors.psnr_db == pytest.approx(peak_signal_noise_ratio(*images, data_range=1.0), abs=1e-4)
    expected = structural_similarity(*images, channel_axis=-1, data_range=1.0)
    assert errors.ssim == pytest.approx(expected, abs=1e-5)
    rms = np.sqrt(np.mean((images[1] - images[0]) ** 2)) / images[0].mean()
    assert errors.rms_relative == pytest.approx(rms, rel=1e-5)
    assert (errors.compared, errors.predicted) == (1.0, 1.0)


def test_equal_images_differ_by_nothing(images):
    errors = gathered(images[0], images[0])
    assert errors.psnr_db == np.inf
    assert errors.ssim == pytest.approx(1.0)
    assert errors.rms_relative == 0


def test_pixels_without_prediction_count_as_black_on_the_display_only(images):
    photograph, rendering = images
    holes = rendering.copy()
    holes[10:20, 10:20] = np.nan
    errors = gathered(photograph, holes)
    black = gathered(photograph, np.nan_to_num(holes))
    assert errors.psnr_db == pytest.approx(black.psnr_db)
    assert errors.ssim == pytest.approx(black.ssim)
    assert errors.rms_relative < black.rms_relative
    assert errors.predicted == pytest.approx(1 - 100 / (64 * 50))


def test_clipped_samples_do_not_enter_the_radiance_comparison(images):
    photograph, rendering = images
    clipped = photograph > 0.9
    spoilt = np.where(clipped, 0, rendering)
    kept = gathered(photograph, rendering, clipped)
    assert gathered(photograph, spoilt, clipped).rms_relative == pytest.approx(kept.rms_relative)
    assert kept.compared == pytest.approx(1 - clipped.mean())


def test_a_result_before_the_last_row_is_refused(images):
    with pytest.raises(ValueError, match="30 of 64 rows"):
        gathered(*images, bands=(0, 30))
