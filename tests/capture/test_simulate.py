"""Simulated captures as a whole: read back, repeated, interrupted, refused."""

import csv
import json

import imagecodecs
import numpy as np
import OpenImageIO as oiio
import pytest
import tifffile

from impasto.capture import read_capture
from impasto.capture.simulate import simulate
from impasto.capture.simulate.camera import Sensor
from impasto.capture.simulate.capture import set_up
from impasto.capture.simulate.files import write_image
from impasto.capture.simulate.settings import Settings
from impasto.colour import linearisation_table
from impasto.errors import OptionError
from impasto.geometry import Lights
from reference_models import radiance as reference_radiance

SMALL = {"preset": "swatches", "size": (40, 30), "lights": 3, "calibration": False}


def contents(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def truth(folder, name):
    image = oiio.ImageBuf(str(folder / "truth" / f"{name}.exr"))
    return image.get_pixels(oiio.FLOAT).squeeze()


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A capture with calibration shots, of the default painting under a dome."""
    folder = tmp_path_factory.mktemp("simulated") / "capture"
    summary = simulate(folder, size=(48, 40), lights=5, seed=4, gain_spread=0.1)
    return folder, summary


def test_the_capture_reads_back_without_a_remark_on_its_lights(finished):
    folder, summary = finished
    capture = read_capture(folder)
    assert summary.photographs == len(capture.photographs) == 5
    assert summary.files == len(contents(folder))
    assert capture.light_file.name == "capture.toml"
    assert {(p.height, p.width, p.channels, p.dtype.name) for p in capture.photographs} == {
        (40, 48, 3, "uint16")
    }
    assert [note for note in capture.notes if "decoded" not in note] == []
    assert capture.noise["photon"] == Sensor.photon
    assert capture.camera.mm_per_px == pytest.approx(100 / 40)


def test_the_lp_file_names_the_same_lights(finished):
    folder, _ = finished
    manifest = read_capture(folder)
    listed = read_capture(folder, lights=folder / "truth" / "lights.lp")
    np.testing.assert_allclose(listed.lights.direction, manifest.lights.direction, atol=1e-8)


def test_photographs_are_the_truths_radiance_to_within_the_noise(finished):
    """The maps in truth/, through the reference's equations, give what the photographs show."""
    folder, _ = finished
    capture = read_capture(folder)
    description = json.loads((folder / "truth" / "truth.json").read_text())
    tints = np.array([entry["specular_tint"] for entry in description["materials"]])
    tint = tints[truth(folder, "material").astype(int)].reshape(-1, 3)
    maps = {name: truth(folder, name) for name in ("normal", "diffuse", "specular", "c")}
    geometry = {"light_direction": capture.lights.direction, "view_direction": capture.camera.view_direction}
    diffuse, specular = (
        reference_radiance(
            "torrance-sparrow",
            maps["normal"].reshape(-1, 3),
            maps["diffuse"].reshape(-1, 3) * (part == 0),
            maps["specular"].ravel() * (part == 1),
            maps["c"].ravel(),
            **geometry,
        )
        for part in (0, 1)
    )
    unshadowed = (diffuse + specular * tint) * capture.lights.intensity[:, None]
    seen = np.array([tifffile.imread(p.path) for p in capture.photographs]).reshape(unshadowed.shape) / 65535
    sigma = np.sqrt(Sensor.read**2 + Sensor.photon * unshadowed)
    usable = unshadowed < 0.95
    off = ((seen - unshadowed) / sigma)[usable]
    assert off.max() < 5  # nothing is brighter than without shadows
    lit = off[off > -5]
    assert len(lit) > 0.8 * len(off)
    assert abs(np.median(lit)) < 0.05
    assert 1.4826 * np.median(np.abs(lit)) == pytest.approx(1, abs=0.08)


def test_the_truth_describes_what_was_asked_for(finished):
    folder, _ = finished
    description = json.loads((folder / "truth" / "truth.json").read_text())
    assert description["settings"]["seed"] == 4
    assert description["program"].startswith("impasto ")
    assert [light["file"] for light in description["lights"]] == [f"light-00{n}.tif" for n in range(5)]
    assert sum(entry["share"] for entry in description["materials"]) == pytest.approx(1)
    normal = truth(folder, "normal")
    np.testing.assert_allclose(np.linalg.norm(normal, axis=-1), 1, atol=1e-5)
    assert truth(folder, "height").shape == (40, 48)


def test_the_grey_scale_shows_its_listed_reflectances(finished):
    folder, _ = finished
    capture = read_capture(folder)
    frontal = int(np.argmax(capture.lights.direction[:, 2]))
    white = capture.lights.intensity[frontal, 0] * capture.lights.direction[frontal, 2]
    image = tifffile.imread(folder / "calibration" / "grey_scale.tif") / 65535
    card = tifffile.imread(folder / "calibration" / "white_card.tif") / 65535
    dark = tifffile.imread(folder / "calibration" / "dark.tif") / 65535
    assert card.mean() == pytest.approx(white, rel=1e-3)
    assert dark.mean() < 1e-4
    with open(folder / "calibration" / "grey_scale.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 20
    # The scale is exposed so that its white just does not clip, and the card beside it a stop less.
    even = tifffile.imread(folder / "calibration" / "grey_scale_card.tif").mean() / 65535
    assert 2 * even == pytest.approx(0.8 * capture.lights.direction[frontal, 2], rel=1e-3)
    for row in rows:
        top, left, bottom, right = (
            int(row[edge]) for edge in ("row0_px", "column0_px", "row1_px", "column1_px")
        )
        patch = image[top:bottom, left:right].mean() / (2 * even)
        assert patch == pytest.approx(10 ** -float(row["density"]), rel=0.02, abs=1e-4)


def test_the_colour_chart_shows_its_listed_tristimulus_values(finished):
    folder, _ = finished
    capture = read_capture(folder)
    frontal = int(np.argmax(capture.lights.direction[:, 2]))
    white = capture.lights.intensity[frontal, 0] * capture.lights.direction[frontal, 2]
    image = tifffile.imread(folder / "calibration" / "colour_chart.tif") / 65535 / white
    with open(folder / "calibration" / "colour_chart.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 24
    # IEC 61966-2-1.
    to_y = np.array([0.2126, 0.7152, 0.0722])
    for row in rows:
        top, left, bottom, right = (
            int(row[edge]) for edge in ("row0_px", "column0_px", "row1_px", "column1_px")
        )
        patch = image[top:bottom, left:right].mean(axis=(0, 1))
        assert patch @ to_y == pytest.approx(float(row["Y_D65"]), rel=0.01, abs=2e-4)


def test_the_spheres_show_where_the_lights_are(finished):
    """As any calibration from spheres does it: the highlight's normal mirrors the view onto the light."""
    folder, _ = finished
    capture = read_capture(folder)
    with open(folder / "calibration" / "spheres" / "spheres.csv", newline="") as file:
        spheres = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
    assert len(spheres) == 2
    for name, direction in zip(capture.lights.names, capture.lights.direction, strict=True):
        image = tifffile.imread(folder / "calibration" / "spheres" / f"{name}.tif")[..., 1].astype(float)
        for sphere in spheres:
            half = slice(0, 180) if sphere["column_px"] < 180 else slice(180, 360)
            lamp = np.where(image[:, half] > 30000, image[:, half], 0)
            row, column = (np.sum(axis * lamp) / lamp.sum() for axis in np.mgrid[0:200, half])
            x = (column - sphere["column_px"]) / sphere["radius_px"]
            y = -(row - sphere["row_px"]) / sphere["radius_px"]
            normal = np.array([x, y, np.sqrt(1 - x**2 - y**2)])
            found = 2 * normal[2] * normal - [0, 0, 1]
            assert np.degrees(np.arccos(np.clip(found @ direction, -1, 1))) < 1.0


def test_the_same_seed_gives_the_same_bytes(tmp_path):
    for name, seed in (("one", 1), ("two", 1), ("other", 2)):
        simulate(tmp_path / name, **SMALL, seed=seed)
    one, two, other = (contents(tmp_path / name) for name in ("one", "two", "other"))
    assert one == two
    photographs = [path for path in one if path.suffix == ".tif"]
    assert len(photographs) == 3
    assert all(one[path] != other[path] for path in photographs)


def test_an_interrupted_run_is_taken_up_to_the_same_end(tmp_path, monkeypatch):
    options = SMALL | {"calibration": True, "brackets": 1, "size": (20, 16)}
    simulate(tmp_path / "whole", **options)

    def stop(path, image, compression, **noted):
        if path.name == "light-002.tif":
            raise KeyboardInterrupt
        write_image(path, image, compression, **noted)

    with monkeypatch.context() as patch:
        patch.setattr("impasto.capture.simulate.capture.write_image", stop)
        with pytest.raises(KeyboardInterrupt):
            simulate(tmp_path / "again", **options)
    assert not (tmp_path / "again" / "capture.toml").exists()
    # What a kill leaves behind: a file under a passing name.
    (tmp_path / "again" / ".light-002.tif.partial").write_bytes(b"half")
    kept = (tmp_path / "again" / "light-001.tif").stat().st_mtime_ns
    simulate(tmp_path / "again", **options)
    assert (tmp_path / "again" / "light-001.tif").stat().st_mtime_ns == kept
    assert contents(tmp_path / "again") == contents(tmp_path / "whole")


def test_other_options_do_not_take_up_an_interrupted_run(tmp_path):
    folder = tmp_path / "capture"
    simulate(folder, **SMALL)
    (folder / "capture.toml").unlink()
    with pytest.raises(OptionError, match="holds an interrupted simulation with other options"):
        simulate(folder, **SMALL, seed=9)


@pytest.mark.parametrize(
    ("name", "message"), [("capture.toml", "holds a finished simulation"), ("notes.txt", "is not empty")]
)
def test_a_folder_with_anything_else_in_it_is_left_alone(tmp_path, name, message):
    folder = tmp_path / "capture"
    if name == "capture.toml":
        simulate(folder, **SMALL)
    else:
        folder.mkdir()
        (folder / name).write_text("mine")
    before = contents(folder)
    with pytest.raises(OptionError, match=message):
        simulate(folder, **SMALL)
    assert contents(folder) == before


def test_everything_wrong_is_said_at_once_and_nothing_is_written(tmp_path):
    folder = tmp_path / "capture"
    with pytest.raises(OptionError) as caught:
        simulate(
            folder,
            sample="z",
            preset="portrait",
            arm=True,
            dome=True,
            lights=0,
            size=(4, 100000),
            seed=-1,
            brackets=1.5,
            model="cook",
            measured=tmp_path / "none.npz",
            exposure=float("nan"),
            light_distance_mm=-3.0,
            noise=(0.1,),
            response="gamma:zero",
            format="webp",
            compression="rar",
        )
    where = [problem.where for problem in caught.value.problems]
    assert where == [
        "sample",
        "preset",
        "sample and preset",
        "model",
        "size",
        "measured",
        "arm and dome",
        "lights",
        "seed",
        "brackets",
        "light_distance_mm",
        "exposure",
        "noise",
        "format",
        "compression",
        "response",
    ]
    assert all(problem.what and problem.do for problem in caught.value.problems)
    assert not folder.exists()


def test_lights_below_the_surface_and_twice_the_same_are_named(tmp_path):
    lights = Lights(("a", "a", "b/c"), np.array([[0, 0, 1.0], [1, 0, -0.2], [0.1, 0, 0.9]]))
    with pytest.raises(OptionError) as caught:
        simulate(tmp_path / "capture", lights=lights, size=(20, 20))
    assert [problem.where for problem in caught.value.problems] == ["light a", "light 'b/c'", "light 1"]


@pytest.mark.parametrize(
    ("options", "suffix", "dtype", "transfer"),
    [
        ({"format": "png"}, ".png", "uint16", "linear"),
        ({"format": "png", "bits": 8}, ".png", "uint8", "srgb"),
        ({"format": "jpeg"}, ".jpg", "uint8", "srgb"),
        ({"format": "exr"}, ".exr", "float32", "linear"),
        ({"compression": "none", "response": "gamma:1.8"}, ".tif", "uint16", "gamma:1.8"),
    ],
)
def test_formats_and_responses_read_back(tmp_path, options, suffix, dtype, transfer):
    """One scene, written in every way, is the same light."""
    settings = SMALL | {"lights": 1, "noise": False}
    simulate(tmp_path / "plain", **settings)
    simulate(tmp_path / "other", **settings, **options)
    (photograph,) = read_capture(tmp_path / "other").photographs
    assert (photograph.path.suffix, photograph.dtype.name, photograph.transfer) == (suffix, dtype, transfer)
    stored = np.concatenate([band for _, band in photograph.bands(30)])
    linear = stored if dtype == "float32" else linearisation_table(transfer, photograph.dtype)[stored]
    plain = tifffile.imread(tmp_path / "plain" / "light-000.tif") / 65535
    unclipped = plain < 0.99
    # JPEG blurs colour between the swatches; eight bits of sRGB step by half a per cent.
    tolerance = {".jpg": 0.02, ".png": 3e-3 if dtype == "uint8" else 2e-5}.get(suffix, 2e-5)
    assert np.median(np.abs(linear - plain)[unclipped]) < tolerance
    assert (linear[~unclipped] > 0.97).all()


def test_brackets_are_captures_by_themselves(tmp_path):
    folder = tmp_path / "capture"
    summary = simulate(folder, **(SMALL | {"size": (64, 48)}), brackets=2, exposure=0.8)
    assert summary.clipped_share > 0
    base = read_capture(folder)
    for ev in (-2, -4):
        darker = read_capture(folder / "brackets" / f"ev{ev}")
        np.testing.assert_allclose(darker.lights.intensity, base.lights.intensity * 2.0**ev)
        shorter, full = (tifffile.imread(c.photographs[0].path) / 65535 for c in (darker, base))
        well = (full > 0.1) & (full < 0.9)
        assert np.median(shorter[well] / full[well]) == pytest.approx(2.0**ev, rel=1e-3)
        assert np.mean(shorter >= 1) < np.mean(full >= 1)


def test_near_lights_and_a_perspective_camera_are_in_the_manifest(tmp_path):
    simulate(tmp_path / "c", **SMALL, light_distance_mm=300.0, camera_distance_mm=800.0, angular_size_deg=1.5)
    capture = read_capture(tmp_path / "c")
    assert capture.lights.near
    np.testing.assert_allclose(np.linalg.norm(capture.lights.position_mm, axis=1), 300)
    np.testing.assert_allclose(capture.lights.angular_size_deg, 1.5)
    assert capture.camera.distance_mm == 800
    assert capture.camera.mm_per_px == pytest.approx(100 / 30)


def test_the_arm_sees_the_sample_from_five_degrees_out_of_its_plane():
    scene, lights = set_up(Settings(sample="c", size=(16, 16)))
    np.testing.assert_allclose(scene.camera.view_direction, [0, np.sin(np.radians(5)), np.cos(np.radians(5))])
    assert len(lights) == 37
    assert np.abs(lights.direction[:, 1]).max() == 0


def test_sensor_noise_has_the_variance_stated():
    sensor = Sensor(exposure=0.5, read=2e-3, photon=1e-4, dtype="float32")
    for level in (0.1, 1.0):
        image = sensor.expose(np.full((300, 300, 1), level), np.random.default_rng(0))
        assert image.mean() == pytest.approx(0.5 * level, rel=1e-3)
        assert image.var() == pytest.approx(2e-3**2 + 1e-4 * 0.5 * level, rel=0.03)


def test_vignetting_darkens_the_corners():
    sensor = Sensor(exposure=1.0, noisy=False, dtype="float32", vignetting=0.3)
    image = sensor.expose(np.ones((21, 31, 3)), np.random.default_rng(0))
    np.testing.assert_allclose([image[10, 15, 0], image[0, 0, 0]], [1.0, 0.7], rtol=1e-6)


def test_the_tone_response_rises_differently_in_each_channel():
    sensor = Sensor(exposure=1.0, noisy=False, response="tone")
    ramp = np.repeat(np.linspace(0, 1, 50)[None, :, None], 3, axis=2)
    image = sensor.expose(ramp, np.random.default_rng(0))[0].astype(int)
    assert (np.diff(image, axis=0) > 0).all()
    assert (image[0] == 0).all()
    assert (image[-1] == 65535).all()
    assert len(set(image[25])) == 3


def test_measured_materials_replace_the_paints_reflectance(tmp_path, shared):
    measured = shared / "reference" / "measured_brdf.npz"
    simulate(tmp_path / "c", sample="d", size=(24, 20), lights=2, calibration=False, measured=measured)
    description = json.loads((tmp_path / "c" / "truth" / "truth.json").read_text())
    assert [entry["measured"] for entry in description["materials"]] == ["merl/green-latex"]
    assert (truth(tmp_path / "c", "specular") == 0).all()
    # The radiance factor at 45°/0° is what a diffuser of that albedo would show there.
    scene, lights = set_up(
        Settings(sample="d", size=(24, 20), measured=measured, relief_scale=0.0, view_tilt_deg=0.0,
                 lights=np.array([[1.0, 0.0, 1.0]]))
    )  # fmt: skip
    seen = scene.radiance(lights, 0) / np.sqrt(0.5)
    np.testing.assert_allclose(seen, scene.surface.diffuse, rtol=1e-4)


def test_the_preview_is_a_picture(finished):
    folder, _ = finished
    picture = imagecodecs.png_decode((folder / "truth" / "preview.png").read_bytes())
    assert picture.shape == (40, 48, 3)
    assert picture.std() > 20
