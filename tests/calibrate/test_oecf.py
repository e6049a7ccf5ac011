"""A camera's response found from a simulated grey scale, under uneven light and with noise."""

import json

import numpy as np
import pytest
import tifffile
from tests.calibrate.shots import take_shots

import impasto
from impasto.capture.simulate.camera import encode
from impasto.errors import CaptureError


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("oecf")
    for response in ("tone", "srgb", "linear"):
        take_shots(folder / response, size=(675, 900), distance_mm=600, response=response, vignetting=0.2)
    return folder


def calibrate(folder, out, **options):
    return impasto.calibrate.oecf(
        folder / "grey_scale.tif",
        folder / "grey_scale.csv",
        out,
        **({"card": folder / "grey_scale_card.tif", "dark": folder / "dark.tif"} | options),
    )


def errors(found, response):
    """Return the relative errors of radiance over the 2.5 brightest decades measured, up to a factor."""
    signal = np.geomspace(1e-4, 1, 4000)
    codes = encode(np.repeat(signal[:, None], 3, axis=1).astype(np.float32), response) * 65535.0
    measured = found.response.measured
    inside = ((codes >= measured[:, 0]) & (codes <= measured[:, 1])).all(axis=1)
    inside &= signal > signal[inside].max() / 10**2.5
    assert signal[inside].max() / signal[inside].min() > 10**2.49
    ratio = np.log(found.response(codes[inside]) / signal[inside, None])
    return np.abs(ratio - ratio.mean(axis=0))


@pytest.mark.parametrize("response", ["tone", "srgb", "linear"])
def test_radiance_is_recovered_to_three_per_mille_over_two_and_a_half_decades(folder, tmp_path, response):
    found = calibrate(folder / response, tmp_path / "oecf.json")
    assert errors(found, response).max() < 0.003
    assert found.linear == (response == "linear")
    assert any("need no such function" in note for note in found.notes) == found.linear


def test_the_noise_is_found(folder, tmp_path):
    """The simulated sensor has read noise 1e-4 and photon noise 1e-5 of full scale."""
    noise = calibrate(folder / "linear", tmp_path / "oecf.json").noise
    assert noise["read"] == pytest.approx(1e-4, rel=0.1)
    assert noise["photon"] == pytest.approx(1e-5, rel=0.1)


def test_the_file_says_what_it_was_made_from(folder, tmp_path):
    found = calibrate(folder / "tone", tmp_path / "oecf.json")
    content = json.loads(found.file.read_text())
    assert content["kind"] == "oecf"
    assert [entry["file"] for entry in content["made_from"]] == [
        "grey_scale.tif", "grey_scale_card.tif", "dark.tif", "grey_scale.csv"
    ]  # fmt: skip
    assert found.plot.stat().st_size > 10000


def test_clipped_patches_are_named(folder, tmp_path):
    image = tifffile.imread(folder / "tone" / "grey_scale.tif").astype(float)
    tifffile.imwrite(
        tmp_path / "bright.tif", np.minimum(image * 1.8, 65535).astype(np.uint16), photometric="rgb"
    )
    with pytest.raises(CaptureError, match=r"patch grey 1: is clipped in .* of its samples") as error:
        impasto.calibrate.oecf(
            tmp_path / "bright.tif", folder / "tone" / "grey_scale.csv", tmp_path / "o.json"
        )
    assert all("--without" in problem.do for problem in error.value.problems)
    assert not (tmp_path / "o.json").exists()


def test_patches_whose_codes_do_not_rise_are_named(folder, tmp_path):
    table = (folder / "tone" / "grey_scale.csv").read_text().splitlines()
    swapped = [row.rsplit(",", 1) for row in table]
    swapped[5][1], swapped[8][1] = swapped[8][1], swapped[5][1]
    (tmp_path / "swapped.csv").write_text("\n".join(",".join(row) for row in swapped))
    with pytest.raises(
        CaptureError, match=r"patch grey 6: reads .*, not above the .* of the darker patch grey 7"
    ):
        impasto.calibrate.oecf(
            folder / "tone" / "grey_scale.tif", tmp_path / "swapped.csv", tmp_path / "o.json"
        )


def test_exposures_extend_the_range(folder, tmp_path):
    """Patches clipped in the longer exposure count in the shorter one."""
    code = tifffile.imread(folder / "linear" / "grey_scale.tif").astype(float)
    tifffile.imwrite(tmp_path / "long.tif", np.minimum(code * 4, 65535).astype(np.uint16), photometric="rgb")
    found = impasto.calibrate.oecf(
        [folder / "linear" / "grey_scale.tif", tmp_path / "long.tif"],
        folder / "linear" / "grey_scale.csv",
        tmp_path / "o.json",
        card=folder / "linear" / "grey_scale_card.tif",
        exposures_s=[0.1, 0.4],
    )
    assert found.linear
    assert any("taken from the others" in note for note in found.notes)


def test_patches_that_read_the_same_count_as_one(folder, tmp_path):
    """As in several exposures; here it is the same photograph twice."""
    photo, table = (folder / "tone" / name for name in ("grey_scale.tif", "grey_scale.csv"))
    card, dark = (folder / "tone" / name for name in ("grey_scale_card.tif", "dark.tif"))
    twice = impasto.calibrate.oecf(
        [photo, photo], table, tmp_path / "o.json", card=card, dark=dark, exposures_s=[1, 1]
    )
    assert errors(twice, "tone").max() < 0.003


def test_patches_that_are_nearly_alike_may_trade_places(folder, tmp_path):
    """Two exposures a stop apart show the same radiance twice, as well as the densities are known."""
    photo, table = (folder / "linear" / name for name in ("grey_scale.tif", "grey_scale.csv"))
    codes = tifffile.imread(photo)
    tifffile.imwrite(tmp_path / "less.tif", np.uint16(codes * 0.99), photometric="rgb")
    photos = [photo, tmp_path / "less.tif"]
    found = impasto.calibrate.oecf(photos, table, tmp_path / "o.json", exposures_s=[1, 1.001])
    assert found.residual < 0.02


def test_all_that_is_wrong_is_listed(folder, tmp_path):
    table = (folder / "tone" / "grey_scale.csv").read_text().splitlines()
    cells = table[3].split(",")
    cells[4] = "99999"
    (tmp_path / "wrong.csv").write_text("\n".join([*table[:3], ",".join(cells), *table[4:]]))
    photo = tmp_path / "untagged.tif"
    tifffile.imwrite(photo, tifffile.imread(folder / "tone" / "grey_scale.tif"), photometric="rgb")
    with pytest.raises(CaptureError) as error:
        impasto.calibrate.oecf([photo, photo], tmp_path / "wrong.csv", tmp_path / "o.json")
    assert "patch grey 3: has a box that is not inside" in str(error.value)
    assert "does not say its exposure time" in str(error.value)
    (tmp_path / "no.csv").write_text("patch,density\n")
    with pytest.raises(CaptureError, match="has no column row0_px"):
        impasto.calibrate.oecf(photo, tmp_path / "no.csv", tmp_path / "o.json")
