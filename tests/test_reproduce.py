"""The paper re-enacted: printed values, truths that are not the models fitted, and what is said of them."""

import numpy as np
import pytest

import impasto
from impasto.capture.simulate.measured import read_measured
from impasto.errors import OptionError, OutputError
from impasto.evaluate.glossmeter import GLOSSMETERS
from impasto.reproduce.printed import PRINTED
from impasto.reproduce.sample import true_radiance
from impasto.reproduce.tables import findings, tables
from impasto.store import open_fit


@pytest.fixture(scope="module")
def made(shared, tmp_path_factory):
    """A matte sample and one on flat glass."""
    return impasto.reproduce(
        tmp_path_factory.mktemp("reproduce") / "out",
        measured=shared / "reference" / "measured_brdf.npz",
        samples=["b", "c"],
        size=(20, 20),
    )


def test_printed_and_found_values_stand_side_by_side(made):
    found = list(tables(made.samples))
    page = made.page.read_text(encoding="utf-8")
    for caption, header, rows in found:
        assert caption in page.replace("&#x27;", "'")
        assert all(len(row) == len(header) for row in rows)
    ratios = {row[0]: row for row in found[0][2]}
    told = made.samples["b"].fitted["paper"].models["torrance-sparrow"].ratio.mean
    assert ratios["b"][3:5] == ("3.8", ratios["b"][4])
    assert ratios["b"][4].startswith(f"{told:.4g} (")
    gloss = {row[0]: row for row in found[2][2]}
    assert gloss["b, 60°"][1] == "1.7"


def test_what_is_not_identified_is_not_invented(made):
    """Where the notes say that As is left out, the tables say so too, and give it elsewhere."""
    told = {row[0]: row for row in next(tables(made.samples))[2]}
    for name, sample in made.samples.items():
        for column, procedure in ((4, "paper"), (5, "refined")):
            fitted = sample.fitted[procedure]
            left_out = any(note.startswith("torrance-sparrow: As and the shape") for note in fitted.notes)
            assert (not fitted.models) == left_out
            assert (told[name][column] == "not identified") == left_out
            assert (not fitted.gloss) == left_out


def test_the_photographs_go_through_a_response_measured_from_a_grey_scale(made):
    """The simulated camera bends every channel in its own way; the curve is found to a third of a percent."""
    assert made.camera.response.residual < 0.003
    assert not made.camera.response.linear
    attributes = impasto.open(made.out / "b" / "paper.zarr")["stack"].attrs
    assert set(attributes["calibration"]) == {"oecf", "white"}


def test_each_procedure_has_a_store_of_its_own(made):
    for procedure, how in (("paper", "paper"), ("refined", "paper"), ("joint", "joint")):
        fit = open_fit(made.out / "b" / f"{procedure}.zarr", "phong")
        assert fit.attributes["procedure"] == how
        assert bool(fit.attributes["options"].get("refined")) == (procedure == "refined")


def test_the_interface_reads_the_gloss_that_was_printed(shared):
    """Its alpha was chosen for (a)'s readings at 20 and 60°; the base adds what a diffuser does."""
    truth = true_radiance("a", read_measured(shared / "reference" / "measured_brdf.npz"))
    for meter in GLOSSMETERS[:2]:
        assert meter.measure(truth) == pytest.approx(PRINTED["a"].gloss[meter.angle_deg], rel=0.05)


def test_curves_between_the_lights_go_through_them(made):
    curve = made.samples["b"].fitted["paper"].curve
    for model in curve.models.values():
        for at_lights, along in (
            (model.diffuse, model.swept.diffuse),
            (model.specular, model.swept.specular),
        ):
            between = np.interp(curve.angle_deg, model.swept.angle_deg, along[:, 1])
            seen = np.isfinite(at_lights[:, 1])
            np.testing.assert_allclose(between[seen], at_lights[seen, 1], rtol=1e-3, atol=1e-4)


def test_findings_follow_from_the_numbers(made):
    said = " ".join(findings(made.samples))
    better = [
        name
        for name, sample in made.samples.items()
        if sample.fitted["joint"].models["torrance-sparrow"].rms < sample.fitted["joint"].models["phong"].rms
    ]
    assert f"joint procedure: Torrance-Sparrow has the smaller error in {len(better)} of 2" in said


def test_what_cannot_be_reproduced_is_refused_before_the_work(tmp_path):
    with pytest.raises(OptionError, match="none of the paper's") as error:
        impasto.reproduce(tmp_path / "out", measured=tmp_path / "none.npz", samples=["x", "y"])
    assert len(error.value.problems) == 2
    with pytest.raises(OptionError, match="measured"):
        impasto.reproduce(tmp_path / "out", measured=tmp_path / "none.npz")
    np.savez(tmp_path / "m.npz", names=np.array(["a"]), weights=np.zeros((1, 675), np.float32))
    with pytest.raises(OutputError, match="not empty"):
        impasto.reproduce(tmp_path, measured=tmp_path / "m.npz")
    with pytest.raises(OptionError, match="not in"):
        impasto.reproduce(tmp_path / "out", measured=tmp_path / "m.npz", samples=["a"])
