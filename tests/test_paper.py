"""The paper's procedure on arms: what it recovers, what it says, and what it refuses."""

from dataclasses import replace

import numpy as np
import pytest
from benchmarks.paper_figures import measure, measured_scene
from tests.arm_scenes import arm, make_scene, photograph, store_images, turned, view
from typer.testing import CliRunner

import impasto
from impasto import store as stores
from impasto.capture.simulate.measured import read_measured
from impasto.cli.commands import app
from impasto.errors import OptionError
from impasto.fit import FitOptions
from impasto.fit.paper import Paper
from impasto.fit.paper.crossing import Crossing
from impasto.fit.paper.survey import survey
from impasto.fit.paper.threshold import choose_threshold
from impasto.geometry import Camera, direction_tilts, dome_direction
from impasto.models import MODELS
from store_files import attributes, contents

MODEL = "torrance-sparrow"
LITERAL, REFINED = FitOptions(), FitOptions(refined=True)


def fitted(scene, options=REFINED, model=MODEL, **more):
    """Fit a scene and return its maps and attributes."""
    more = {"procedure": "paper", **more}
    impasto.fit(scene.store, models=[model], options=options, overwrite=True, show_progress=False, **more)
    height, width = scene.theta.shape
    maps = stores.read_fit(scene.store, model, slice(0, height), slice(0, width))
    return maps, stores.fit_attributes(scene.store, model)


def theta_error_deg(maps, scene, azimuth_deg=0.0):
    theta, _ = direction_tilts(turned(maps["normal"], -azimuth_deg))
    return np.degrees(np.abs(theta - scene.theta))


@pytest.fixture(scope="module")
def bumpy(tmp_path_factory):
    return make_scene(tmp_path_factory.mktemp("bumpy") / "photos")


@pytest.fixture(scope="module")
def rotated(tmp_path_factory):
    return make_scene(tmp_path_factory.mktemp("rotated") / "photos", azimuth_deg=30.0)


def test_the_refined_form_recovers_the_truth(bumpy):
    maps, found = fitted(bumpy)
    assert found["pixels"].get("converged", 0) > 0.98 * bumpy.theta.size
    assert np.median(theta_error_deg(maps, bumpy)) < 0.02
    assert found["sample"]["specular"] == pytest.approx(20.0, rel=0.03)
    assert np.median(maps["c"]) == pytest.approx(0.1, rel=0.01)
    np.testing.assert_allclose(np.median(maps["diffuse"], axis=(0, 1)), (0.3, 0.2, 0.1), rtol=0.01)
    # φn and φv − φn look the same.
    half = np.radians(2.5)
    _, phi = direction_tilts(maps["normal"])
    off = np.abs(np.abs(phi - half) - np.abs(bumpy.phi - half))
    assert np.degrees(np.median(off)) < 0.1
    assert "view_tilt" not in maps
    assert not any(name.endswith("_sd") or name == "chi2_reduced" for name in maps)


def test_the_literal_form_puts_its_errors_into_the_view(bumpy):
    maps, found = fitted(bumpy, LITERAL)
    error = theta_error_deg(maps, bumpy)
    refined = theta_error_deg(fitted(bumpy)[0], bumpy)
    assert 0.05 < np.median(error) < 0.3
    assert np.median(refined) < np.median(error) / 2
    signed = direction_tilts(maps["normal"])[0] - bumpy.theta
    assert np.corrcoef(maps["view_tilt"].ravel() / 2, signed.ravel())[0, 1] > 0.9
    sigma = np.degrees(np.std(maps["view_tilt"][maps["status"] == 0].astype(float))) / 2
    assert found["theta_error_deg"] == pytest.approx(sigma, rel=1e-6)
    assert found["sample"]["specular"] == pytest.approx(20.0, rel=0.05)
    # What the empirical φn measures is |φn − φv/2|.
    _, phi = direction_tilts(maps["normal"])
    assert np.degrees(np.median(np.abs(phi - np.abs(bumpy.phi - np.radians(2.5))))) < 0.3
    # Ad cos φn is what the diffuse stage sees.
    seen = maps["diffuse"][..., 0] * np.cos(phi)
    np.testing.assert_allclose(np.median(seen / (0.3 * np.cos(bumpy.phi))), 1.0, rtol=0.02)


@pytest.mark.parametrize("options", [LITERAL, REFINED], ids=["literal", "refined"])
def test_a_turned_arm_gives_turned_normals(bumpy, rotated, options):
    straight, _ = fitted(bumpy, options)
    maps, found = fitted(rotated, options)
    assert found["sample"]["arm_azimuth_deg"] == pytest.approx(30.0, abs=1e-4)
    good = (straight["status"] == 0) & (maps["status"] == 0)
    difference = turned(maps["normal"], -30.0) - straight["normal"]
    assert np.abs(difference[good]).max(axis=-1).mean() < 1e-4
    # Renderings use the view that was fitted, in the frame of the arm.
    before, after = (
        impasto.evaluate(scene.store, held_out_lights=("arm05", "arm18")).models[0]
        for scene in (bumpy, rotated)
    )
    assert after.procedure == "paper"
    assert after.mean.psnr_db == pytest.approx(before.mean.psnr_db, abs=0.05)
    assert after.mean.psnr_db > (54 if options.refined else 36)


def test_phong_with_its_ambient_term_is_recovered(tmp_path):
    scene = make_scene(tmp_path / "p", model="phong", shape=40.0, specular=0.5, ambient=0.02)
    for options, tolerance in ((REFINED, 0.01), (LITERAL, 0.05)):
        maps, found = fitted(scene, options, "phong")
        assert found["sample"]["specular"] == pytest.approx(0.5, rel=tolerance)
        assert np.median(maps["shininess"]) == pytest.approx(40.0, rel=tolerance)
        np.testing.assert_allclose(np.median(maps["ambient"], axis=(0, 1)), 0.02, rtol=0.05)


@pytest.mark.parametrize(
    ("scene", "identified"),
    [
        ({"spread_deg": 0, "shape": 0.0172, "specular": 845.0}, False),
        ({"spread_deg": 0, "shape": 0.045, "specular": 123.0}, False),
        ({"spread_deg": 0, "shape": 0.045, "specular": 123.0, "view_phi_deg": -5}, False),
        ({"spread_deg": 0, "shape": 0.2, "specular": 6.0}, True),
        ({"spread_deg": 4, "shape": 0.0172, "specular": 845.0}, True),
        ({"spread_deg": 0, "shape": 0.0172, "specular": 845.0, "view_phi_deg": 0}, True),
    ],
    ids=["flat 0.0172", "flat 0.045", "flat 0.045 other side", "flat broad", "bumpy", "flat in plane"],
)
def test_as_and_c_are_refused_where_no_highlight_crosses_the_plane(tmp_path, scene, identified):
    scene = make_scene(tmp_path / "s", **scene)
    for options in (LITERAL, REFINED):
        maps, found = fitted(scene, options)
        assert np.median(theta_error_deg(maps, scene)) < 0.2
        said = " ".join(found["notes"])
        if identified:
            assert (maps["status"] < 3).all()
            assert found["sample"]["specular"] > 0
            assert "not identified" not in said
        else:
            assert (maps["status"] == 5).all()
            assert np.isnan(maps["c"]).all()
            assert np.isnan(maps["specular"]).all()
            np.testing.assert_allclose(np.median(maps["diffuse"], axis=(0, 1)), (0.3, 0.2, 0.1), rtol=0.02)
            assert found["sample"]["specular"] is None
            assert "As and the shape are not identified" in said


def test_what_looks_broad_from_beside_is_narrow():
    flat = Crossing(view_phi=np.radians(5), reach=0.0, c_apparent=np.hypot(0.045, np.radians(2.5)))
    assert flat.c == pytest.approx(0.045)
    assert not flat.identified
    assert Crossing(np.radians(-5), np.radians(2.5), 0.05).identified
    limit = np.radians(2.5) / 0.64
    assert Crossing(np.radians(5), 0.0, 1.01 * np.hypot(limit, np.radians(2.5))).identified
    assert not Crossing(np.radians(5), 0.0, 0.99 * np.hypot(limit, np.radians(2.5))).identified


def test_everything_that_the_procedure_cannot_do_is_told_at_once(tmp_path):
    azimuth = np.arange(9) * 2.4
    lights = dome_direction(0.2 + 0.08 * np.arange(9), azimuth)
    images = np.full((9, 8, 8, 3), 0.3)
    dome = store_images(tmp_path / "dome", images, lights, view())
    with pytest.raises(OptionError) as raised:
        impasto.fit(
            dome, models=["lambert", MODEL], procedure="paper", options=FitOptions(loss="huber", refined=True)
        )
    where = [problem.where for problem in raised.value.problems]
    assert where == ["--loss", "--model lambert", "lights"]
    assert all(problem.what and problem.do for problem in raised.value.problems)
    assert not (dome / "fits").exists()


def test_near_lights_and_too_few_beyond_the_threshold_are_refused(tmp_path):
    lights = arm(arm_deg=np.arange(-30, 31, 10.0))
    images = np.full((7, 8, 8, 3), 0.3)
    near = store_images(tmp_path / "near", images, lights, view(), near=True)
    with pytest.raises(OptionError, match="stands at a finite distance") as raised:
        impasto.fit(near, models=[MODEL], procedure="paper")
    assert {problem.where for problem in raised.value.problems} == {
        "light arm00 and 6 more",
        "--threshold 35",
    }
    far = store_images(tmp_path / "far", images, lights, view())
    with pytest.raises(OptionError, match=r"leaves 0 of 7 lights .* 3 are needed"):
        impasto.fit(far, models=[MODEL], procedure="paper")
    impasto.fit(far, models=[MODEL], procedure="paper", options=FitOptions(threshold_deg=15.0))


def test_options_of_the_other_procedure_are_refused_and_do_not_identify_a_fit(bumpy):
    with pytest.raises(OptionError, match="no option of the joint procedure"):
        impasto.fit(bumpy.store, procedure="joint", options=FitOptions(threshold_deg=20.0, refined=True))
    _, joint = fitted(bumpy, LITERAL, procedure="joint")
    own = {"loss", "loss_scale", "shadows", "share_reflectance", "highlight_colour"}
    own |= {"residual", "residual_components"}
    own |= {"self_calibrate", "calibrate_directions", "calibrate_distances"}
    assert set(joint["options"]) == {"max_steps", "shadow_level", "exclude", *own}
    _, paper = fitted(bumpy, LITERAL)
    own = {"refined", "threshold_deg", "highlight"}
    assert set(paper["options"]) == {"max_steps", "shadow_level", "exclude", *own}
    assert FitOptions.of(paper) == LITERAL


def test_arms_are_fitted_by_the_refined_form_if_nothing_else_is_asked_for(bumpy):
    said = []
    summary = impasto.fit(bumpy.store, models=["lambert", MODEL], overwrite=True, say=said.append)
    assert [model.procedure for model in summary.models] == ["joint", "paper, refined"]
    assert any("no procedure was asked for: torrance-sparrow" in note for note in summary.notes)
    assert set(summary.notes) <= set(said)
    # What is not identified is said of the joint fit too.
    assert any("does not tell how far a normal tilts" in note for note in summary.models[0].notes)
    again = impasto.fit(bumpy.store, models=[MODEL], options=REFINED)
    assert again.models[0].already
    assert again.models[0].notes == summary.models[1].notes


def test_the_command_line_says_what_is_assumed(bumpy):
    command = ["fit", str(bumpy.store), "--model", MODEL, "--procedure", "paper", "--overwrite"]
    result = CliRunner().invoke(app, [*command, "--threshold", "auto"])
    assert result.exit_code == 0, result.output
    for words in (
        "the product Ad cos φn only",
        "φn and φv − φn look the same",
        "assumed, as in the paper: the view in the plane",
        "one As for the whole sample",
        "Chosen because in nine of ten pixels",
        "the error of θn, as θv tells it",
        f"{MODEL}, procedure paper:",
    ):
        assert words in result.output
    assert CliRunner().invoke(app, [*command, "--threshold", "wide"]).exit_code == 1


def test_broad_highlights_get_a_wide_threshold_and_narrow_ones_a_small_one(tmp_path):
    chosen = []
    for c in (0.02, 0.1, 0.4):
        scene = make_scene(tmp_path / f"c{c}", shape=c, specular=1 / (4 * c * c))
        _, found = fitted(scene, FitOptions(threshold_deg=None))
        chosen.append(found["sample"]["threshold_deg"])
    assert 15 <= chosen[0] < 35 < chosen[1] < chosen[2] == 60
    assert found["options"]["threshold_deg"] is None


def test_the_threshold_leaves_enough_lights():
    maps = {
        "normal": np.tile(np.float32([0, 0, 1]), (4, 1)),
        "diffuse": np.full((4, 3), 0.2, np.float32),
        "specular": np.ones(4, np.float32),
        "c": np.full(4, 0.5, np.float32),
        "status": np.zeros(4, np.uint8),
    }
    lights = arm(arm_deg=np.arange(-60, 61, 12.0))
    camera = Camera(view(phi_deg=0))
    threshold_deg, seen_deg = choose_threshold(MODELS[MODEL], maps, lights, camera, LITERAL, 4)
    assert seen_deg > 50
    assert 36 < threshold_deg <= 48


def test_the_threshold_may_count_from_the_peak_of_the_whole_sample(bumpy):
    own, found_own = fitted(bumpy, LITERAL)
    shared_peak, found = fitted(bumpy, replace(LITERAL, highlight="sample"))
    # As differs in its last digits only: its pixel's own peak is the sample's.
    assert found["sample"]["specular"] == pytest.approx(found_own["sample"]["specular"], rel=1e-6)
    assert found["settings_sha256"] != found_own["settings_sha256"]
    assert any("the brightest pixel's" in note for note in found["notes"])
    # Pixels whose highlight lies elsewhere keep a part of it among their diffuse lights.
    error = {name: theta_error_deg(maps, bumpy) for name, maps in (("own", own), ("shared", shared_peak))}
    assert np.median(error["shared"]) > np.median(error["own"])


def test_clipped_pixels_are_not_asked_for_the_peak(tmp_path):
    def reflect(normal, lights, camera):
        images = np.repeat(np.maximum(lights @ normal.T, 0)[..., None], 3, axis=-1) * 0.3
        mirror = np.abs(lights[:, 0]).argmin()
        images[mirror, 7] = 2.0
        images[mirror, 5] = 50.0
        return images

    scene = photograph(tmp_path / "s", reflect, noise=0.0, clip_level=40.0)
    _, found = fitted(scene)
    assert (found["sample"]["row"], found["sample"]["column"], found["sample"]["light"]) == (0, 7, "arm18")
    assert found["sample"]["clipped_pixels"] == 1
    assert any("1 pixels (0.07%) have a clipped sample" in note for note in found["notes"])
    all_clipped = photograph(tmp_path / "c", reflect, noise=0.0, clip_level=0.1)
    with pytest.raises(OptionError, match="every one of the 1536 pixels has a clipped sample"):
        fitted(all_clipped)


@pytest.mark.parametrize("seed", range(3))
def test_the_peak_is_that_of_a_search_through_all_samples(tmp_path, seed):
    rng = np.random.default_rng(seed)
    lights = arm(arm_deg=np.array([-50.0, -20.0, 0.0, 20.0, 50.0]))
    # Two tiles; each channel is brightest under a light of its own, so that the bounds tell little.
    images = rng.uniform(0, 1, (5, 8, 600, 3)).astype(np.float32)
    images[rng.uniform(size=images.shape) < 0.01] = np.nan
    images[:, 2, 3] = np.nan
    store = store_images(tmp_path / "s", images, lights, view(), clip_level=0.995)
    found = survey(stores.open_stack(store), range(5), show_progress=False)
    clipped = np.nanmax(images, axis=(0, 3), initial=0) >= np.float32(0.995)
    brightness = np.where(clipped, -np.inf, images.mean(axis=-1))
    light, row, column = np.unravel_index(np.nanargmax(brightness), brightness.shape)
    assert (found.row, found.column, found.light) == (row, column, light)
    np.testing.assert_array_equal(found.peak[:, 0], images[:, row, column])
    assert found.clipped_pixels == np.count_nonzero(clipped)


def test_an_interrupted_fit_goes_on_to_the_same_bytes(bumpy, monkeypatch):
    fitted(bumpy, LITERAL)
    expected = contents(bumpy.store)
    conclude = Paper.conclude
    monkeypatch.setattr(Paper, "conclude", lambda self, read: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        fitted(bumpy, LITERAL)
    assert not attributes(bumpy.store / "fits" / MODEL)["complete"]
    monkeypatch.setattr(Paper, "conclude", conclude)
    (done,) = impasto.fit(bumpy.store, models=[MODEL], procedure="paper").models
    assert done.continued
    assert contents(bumpy.store) == expected


@pytest.mark.parametrize(
    ("material", "literal_deg"),
    [
        ("rgl/satin_white", (1.0, 3.0)),
        ("rgl/vch_dragon_eye_red", (1.0, 3.5)),
        ("merl/black-phenolic", (1.0, 3.0)),
        ("merl/specular-maroon-phenolic", (0.1, 0.5)),
    ],
)
def test_on_measured_materials_the_refined_form_halves_the_error_of_the_normal(
    shared, tmp_path, material, literal_deg
):
    measured = read_measured(shared / "reference" / "measured_brdf.npz")
    scene = measured_scene(tmp_path, measured, material)
    literal, refined = (measure(scene, refined=form) for form in (False, True))
    low, high = literal_deg
    assert low < literal.theta_error_deg[0] < high
    assert refined.theta_error_deg[0] < literal.theta_error_deg[0] / 2
    assert refined.theta_error_deg[1] < literal.theta_error_deg[1] / 1.5
    assert refined.rms < 1.05 * literal.rms


def test_the_literal_form_makes_broad_highlights_narrow_by_a_quarter(tmp_path):
    scene = make_scene(tmp_path / "s", shape=0.3, specular=2.8)
    literal, refined = (measure(scene, refined=form) for form in (False, True))
    assert 0.66 < literal.shape / 0.3 < 0.78
    assert refined.shape / 0.3 == pytest.approx(1.0, abs=0.01)
