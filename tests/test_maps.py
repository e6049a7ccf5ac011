"""Maps: exact numbers in EXR, codes that can be turned back in TIFF, and a picture of each."""

import json

import numpy as np
import OpenImageIO as oiio
import pytest
import tifffile

import impasto
from impasto.colour import decode_srgb
from impasto.store import open_fit

FILES = {"residual_rms": "residual"}


@pytest.fixture(scope="module", params=["torrance-sparrow", "phong"])
def written(request, painting, tmp_path_factory):
    out = tmp_path_factory.mktemp("maps")
    summary = impasto.maps(painting, model=request.param, out=out)
    fit = open_fit(painting, request.param)
    height, width = fit.shape
    return out, summary, fit.read(slice(0, height), slice(0, width))


def test_the_names_are_those_that_others_rely_on(written):
    out, summary, maps = written
    shape = {"torrance-sparrow": "c", "phong": "shininess"}[summary.model]
    names = ["normal", "diffuse", "specular", shape, "residual"]
    names += [f"{name}_sd" for name in ("normal", "diffuse", "specular", shape)]
    for name in names:
        assert (out / f"{name}.exr").is_file()
    assert (out / "status.tif").is_file()
    assert {entry.name for entry in summary.maps} == set(maps)
    assert not list(out.glob("*.partial")) + list(out.glob(".*"))


def test_exr_files_hold_the_store_s_numbers(written):
    out, _, maps = written
    for name, values in maps.items():
        if name != "status":
            image = oiio.ImageInput.open(str(out / f"{FILES.get(name, name)}.exr"))
            np.testing.assert_array_equal(image.read_image("float").reshape(values.shape), values)


def test_status_codes_are_kept_and_counted(written):
    out, summary, maps = written
    np.testing.assert_array_equal(tifffile.imread(out / "status.tif"), maps["status"])
    assert sum(summary.status.values()) == maps["status"].size
    assert summary.status.get("converged", 0) == (maps["status"] == 0).sum()


def test_codes_of_the_tiff_files_turn_back_into_numbers(written):
    """As maps.json says how; to half a step of 16 bits."""
    _, summary, maps = written
    for entry in summary.maps:
        if entry.name == "status":
            continue
        values = maps[entry.name]
        codes = tifffile.imread(entry.tiff).astype(float).reshape(values.shape)
        assert tifffile.TiffFile(entry.tiff).pages[0].dtype == np.uint16
        present = np.isfinite(values)
        if entry.name == "normal":
            back, step = 2 * codes / 65535 - 1, 2 / 65535
        elif entry.encoding.startswith("sRGB"):
            # The steps of sRGB are widest at white: 2.4 / 1.055 of the even ones.
            back, step = entry.high * decode_srgb(codes / 65535), entry.high * 2.3 / 65535
        else:
            assert ((codes == 0) == ~present).all()
            back = entry.low + (entry.high - entry.low) * (codes - 1) / 65534
            step = (entry.high - entry.low) / 65534
        expected = np.clip(values, entry.low, entry.high)
        np.testing.assert_allclose(back[present], expected[present], atol=0.51 * step + 1e-7)


def test_each_map_has_a_picture_with_room_for_a_legend(written):
    _, summary, maps = written
    height, width = maps["status"].shape
    for entry in summary.maps:
        spec = oiio.ImageInput.open(str(entry.preview)).spec()
        assert spec.width / spec.height > width / height


def test_the_manifest_says_what_the_files_mean(written):
    out, summary, maps = written
    manifest = json.loads((out / "maps.json").read_text())
    assert manifest["model"] == summary.model
    assert set(manifest["maps"]) == set(maps)
    for entry in manifest["maps"].values():
        assert all((out / entry[kind]).is_file() for kind in ("exact", "tiff", "preview"))
