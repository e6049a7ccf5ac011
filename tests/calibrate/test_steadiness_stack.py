"""Photographs that moved are shifted back when they are stacked."""

import numpy as np
import pytest
import tifffile
from scipy.ndimage import shift as spline_shift
from typer.testing import CliRunner

import impasto
from impasto.capture.simulate import simulate
from impasto.cli.commands import app
from impasto.errors import CaptureError
from impasto.stack.shift import Shift
from impasto.store import open_stack

SIZE = (200, 160)
MOVED = {"light-001": (-2.3, 0.45), "light-003": (1.4, -0.8)}
ALL = slice(0, SIZE[1]), slice(0, SIZE[0])


@pytest.fixture(scope="module")
def series(tmp_path_factory):
    folder = tmp_path_factory.mktemp("still") / "photos"
    simulate(folder, lights=14, size=SIZE, calibration=False, seed=4, noise=False, format="exr", exposure=0.8)
    return folder


@pytest.fixture(scope="module")
def moved(series, tmp_path_factory):
    """Return the photographs as a sensor of 16 bits sees them, two of them shifted."""
    folder = tmp_path_factory.mktemp("moved") / "photos"
    folder.mkdir()
    for path in sorted(series.glob("*.exr")):
        image = read(path)
        if path.stem in MOVED:
            columns, rows = MOVED[path.stem]
            image = spline_shift(image, (rows, columns, 0), order=5, mode="nearest")
        write(folder / f"{path.stem}.tif", image)
    text = (series / "capture.toml").read_text().replace(".exr", ".tif")
    (folder / "capture.toml").write_text(text)
    return folder


def read(path):
    import OpenImageIO as oiio

    return oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT)


def write(path, image):
    codes = np.clip(np.rint(image * 65535), 0, 65535).astype(np.uint16)
    tifffile.imwrite(path, codes, photometric="rgb")


@pytest.fixture(scope="module")
def measured(moved):
    out = moved.with_name("steadiness.json")
    return impasto.calibrate.steadiness(moved, out)


def test_shifts_under_changing_light_are_found_within_a_tenth_of_a_pixel(measured):
    truth = np.array([MOVED.get(name, (0, 0)) for name in measured.names])
    assert np.hypot(*(measured.shift_px - truth).T).max() < 0.1
    assert measured.corrected == tuple(MOVED)
    assert measured.unknown == ()
    assert measured.turned == {}


def test_photographs_lie_on_each_other_again_and_unmoved_ones_are_left_alone(
    series, moved, measured, tmp_path
):
    plain, back = tmp_path / "plain.zarr", tmp_path / "back.zarr"
    impasto.stack(moved, plain)
    summary = impasto.stack(moved, back, steadiness=measured.file)
    assert any("2 of 14 photographs are shifted back, by up to 2.3" in note for note in summary.notes)
    before, after = open_stack(plain), open_stack(back)
    a, b = before.radiance(*ALL), after.radiance(*ALL)
    shifts = {entry["name"]: entry.get("shift_px") for entry in after.attributes["inputs"]}
    for light, name in enumerate(before.lights.names):
        if name not in MOVED:
            np.testing.assert_array_equal(a[light], b[light])
            assert shifts[name] is None
            continue
        assert shifts[name] == pytest.approx(MOVED[name], abs=0.1)
        truth = read(series / f"{name}.exr")
        good = (b[light] < after.clip_level) & (a[light] < before.clip_level)
        wrong, right = (np.abs(image[light] - truth)[good].mean() for image in (a, b))
        assert right < wrong / 5


def test_the_fit_is_better_for_it(moved, measured, tmp_path):
    chi2 = {}
    for name, file in (("plain", None), ("back", measured.file)):
        store = tmp_path / f"{name}.zarr"
        impasto.stack(moved, store, steadiness=file)
        impasto.fit(store, models=["torrance-sparrow"])
        chi2[name] = float(np.nanmedian(impasto.open(store)["fits/torrance-sparrow/chi2_reduced"].values))
    assert chi2["back"] < chi2["plain"] / 2


def test_the_border_is_missing_and_clipped_samples_stay_clipped(moved, measured, tmp_path):
    impasto.stack(moved, tmp_path / "p.zarr", steadiness=measured.file)
    stack = open_stack(tmp_path / "p.zarr")
    light = stack.lights.names.index("light-001")
    usable = stack.radiance(*ALL)[light] < stack.clip_level
    # Content that lay 2.3 px left of its place, and two more of the kernel: five columns are not covered.
    assert not usable[:, :5].any()
    assert usable[:, 6:-6].mean() > 0.9
    codes = tifffile.imread(moved / "light-001.tif").astype(int)
    clipped = np.argwhere(codes >= 64879)
    assert len(clipped) > 10
    for row, column, channel in clipped[:: len(clipped) // 10]:
        at = row - round(0.45), column + round(2.3)
        if 0 <= at[0] < SIZE[1] and 0 <= at[1] < SIZE[0]:
            assert not usable[at[0], at[1], channel]


def test_a_stack_is_taken_up_and_comes_out_the_same(moved, measured, tmp_path):
    one, two = tmp_path / "one.zarr", tmp_path / "two.zarr"
    impasto.stack(moved, one, steadiness=measured.file)
    assert impasto.stack(moved, one, steadiness=measured.file).already
    impasto.stack(moved, two, steadiness=measured.file, memory_bytes=1e8)
    for path in sorted((one / "stack").rglob("*")):
        if path.is_file():
            assert path.read_bytes() == (two / "stack" / path.relative_to(one / "stack")).read_bytes()


def test_photographs_of_another_series_are_refused(moved, measured, tmp_path):
    fewer = tmp_path / "s.json"
    impasto.calibrate.steadiness(moved, fewer, exclude=["light-005"])
    with pytest.raises(CaptureError, match=r"s.json: holds no shift of light-005"):
        impasto.stack(moved, tmp_path / "p.zarr", steadiness=fewer)


def test_a_photograph_of_something_else_is_named_and_left_alone(moved, tmp_path):
    photos = tmp_path / "photos"
    photos.mkdir()
    for path in moved.iterdir():
        (photos / path.name).write_bytes(path.read_bytes())
    rng = np.random.default_rng(3)
    write(photos / "light-006.tif", rng.uniform(0, 0.5, (SIZE[1], SIZE[0], 3)))
    said = CliRunner().invoke(app, ["calibrate", "steadiness", str(photos), str(tmp_path / "s.json")]).output
    assert "shift not known" in said
    assert "light-006" in said
    summary = impasto.stack(photos, tmp_path / "p.zarr", steadiness=tmp_path / "s.json")
    assert any("because their shift is not known: light-006" in note for note in summary.notes)
    entries = {entry["name"]: entry for entry in open_stack(tmp_path / "p.zarr").attributes["inputs"]}
    assert "shift_px" not in entries["light-006"]
    assert "shift_px" in entries["light-001"]


def test_a_turned_photograph_is_named_and_not_shifted(series, tmp_path):
    from scipy.ndimage import affine_transform

    photos = tmp_path / "photos"
    photos.mkdir()
    angle = np.radians(0.6)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    middle = (np.array(SIZE[::-1]) - 1) / 2
    for path in sorted(series.glob("*.exr")):
        image = read(path)
        if path.stem == "light-004":
            channels = [
                affine_transform(image[..., c], turn, middle - turn @ middle, order=3, mode="nearest")
                for c in range(3)
            ]
            image = np.stack(channels, axis=-1)
        write(photos / f"{path.stem}.tif", image)
    found = impasto.calibrate.steadiness(photos, tmp_path / "s.json")
    assert list(found.turned) == ["light-004"]
    assert found.turned["light-004"] == pytest.approx(angle * np.hypot(*SIZE) / 2, rel=0.3)
    assert found.corrected == ()


@pytest.mark.parametrize("shift_px", [(0.5, -0.25), (-3.0, 2.0), (7.3, -70.4), (0.0, 130.6)])
@pytest.mark.parametrize("dtype", [np.uint16, np.float32])
def test_bands_make_no_difference(shift_px, dtype):
    rng = np.random.default_rng(1)
    image = rng.uniform(1000, 60000, (300, 40, 3)).astype(dtype)
    clip = np.full(3, 55000.0)

    def shifted(rows):
        bands = [(row, image[row : row + rows]) for row in range(0, 300, rows)]
        found = list(Shift(shift_px, 300, clip).bands(iter(bands)))
        assert [row for row, _, _ in found] == [row for row, _ in bands]
        return np.concatenate([band for _, band, _ in found]), sum(clipped for _, _, clipped in found)

    whole, count = shifted(300)
    for rows in (64, 100):
        parts, number = shifted(rows)
        np.testing.assert_array_equal(parts, whole)
        assert number == count
    assert count > 0


def test_a_shift_by_whole_pixels_changes_no_value():
    image = np.arange(60 * 50, dtype=np.uint16).reshape(60, 50, 1)
    ((_, back, clipped),) = Shift((3, -2), 60, np.array([np.inf])).bands([(0, image)])
    np.testing.assert_array_equal(back[2:, :-3], image[:-2, 3:])
    assert (back[:2] == 65535).all()
    assert (back[:, -3:] == 65535).all()
    assert clipped == 0


def test_what_has_a_clipped_sample_in_it_is_clipped_and_what_is_missing_stays_missing():
    image = np.full((40, 40, 1), 0.5, np.float32)
    image[20, 20] = 2.0
    image[10, 10] = np.nan
    ((_, back, clipped),) = Shift((0.5, 0.5), 40, np.array([1.0])).bands([(0, image)])
    lost = back[..., 0] >= 1
    assert clipped == lost.sum() == 36  # six taps across and down
    np.testing.assert_allclose(back[~lost[..., None] & np.isfinite(back)], 0.5, rtol=1e-6)
    assert np.isnan(back[7:13, 7:13]).all()
    assert np.isnan(back[:2]).all()
    assert np.isnan(back[-3:]).all()
