"""Camera colour from spectra seen by a real camera's sensitivities, and from simulated photographs."""

import json

import numpy as np
import pytest
from tests.calibrate.shots import take_shots

import impasto
from impasto.calibrate.colour_fit import ciede2000, fit_colour, lab
from impasto.calibrate.targets import spectra_to_xyz
from impasto.errors import CaptureError, OptionError

colour = pytest.importorskip("colour")
TARGET = "ColorChecker24 - After November 2014"


@pytest.fixture(scope="module")
def spectra():
    """Return what a Nikon D5100 sees of the ColorChecker under D50, white of mean 1, and XYZ."""
    shape = colour.SpectralShape(400, 700, 10)
    patches = colour.SDS_COLOURCHECKERS["ISO 17321-1"]
    reflectance = np.array([sd.copy().align(shape).values for sd in patches.values()])
    camera = colour.MSDS_CAMERA_SENSITIVITIES["Nikon 5100 (NPL)"].copy().align(shape).values
    light = colour.SDS_ILLUMINANTS["D50"].copy().align(shape).values
    white = light @ camera
    rgb = (reflectance * light) @ camera / white.mean()
    xyz, white_xyz = spectra_to_xyz(shape.wavelengths, reflectance)
    return rgb, xyz, white_xyz


def test_a_real_camera_under_daylight(spectra):
    """Mean CIEDE2000 under 2 by a matrix of 3 x 3, and lower by a root-polynomial."""
    rgb, xyz, white = spectra
    matrix = fit_colour(rgb, xyz, white, "matrix")
    polynomial = fit_colour(rgb, xyz, white, "root-polynomial")
    assert matrix.difference.mean() < 2
    assert polynomial.difference.mean() < matrix.difference.mean()
    assert matrix.left_out.mean() > matrix.difference.mean()


def test_the_start_of_the_fit_is_colour_science_s(spectra):
    """The least squares in XYZ that the fit begins from."""
    rgb, xyz, _ = spectra
    for method, terms in (("Cheung 2004", 3), ("Finlayson 2015", 6)):
        from impasto.colour.camera import colour_terms

        ours, *_ = np.linalg.lstsq(colour_terms(rgb, terms), xyz, rcond=None)
        options = {"terms": 3} if terms == 3 else {"degree": 2, "root_polynomial_expansion": True}
        theirs = colour.matrix_colour_correction(rgb, xyz, method=method, **options)
        np.testing.assert_allclose(ours.T, theirs, rtol=1e-6, atol=1e-9)


def test_differences_are_those_of_the_published_pairs():
    """Sharma, Wu and Dalal's first, seventh and thirteenth pairs."""
    pairs = np.array([
        [50, 2.6772, -79.7751, 50, 0, -82.7485, 2.0425],
        [50, 0, 0, 50, -1, 2, 2.3669],
        [50, 2.5, 0, 50, 0, -2.5, 4.3065],
    ])  # fmt: skip
    white = colour.xy_to_XYZ(colour.CCS_ILLUMINANTS["CIE 1931 2 Degree Standard Observer"]["D50"])
    xy = colour.XYZ_to_xy(white)
    one, other = (colour.Lab_to_XYZ(pairs[:, part], xy) for part in (slice(0, 3), slice(3, 6)))
    np.testing.assert_allclose(lab(one, white), pairs[:, :3], atol=1e-6)
    np.testing.assert_allclose(ciede2000(one, other, white), pairs[:, 6], atol=1e-4)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("colour")
    take_shots(folder, distance_mm=600, vignetting=0.2)
    return folder


def test_a_photograph_under_uneven_light_gives_the_true_matrix(folder, tmp_path):
    """The simulated camera's own colours are linear sRGB, in which the table states XYZ under D65."""
    found = impasto.calibrate.colour(
        folder / "colour_chart.tif",
        folder / "colour_chart.csv",
        tmp_path / "colour.json",
        card=folder / "white_card.tif",
        dark=folder / "dark.tif",
    )
    truth = colour.RGB_COLOURSPACES["sRGB"].matrix_RGB_to_XYZ
    np.testing.assert_allclose(found.fits["matrix"].matrix, truth, atol=0.01)
    assert found.fits["matrix"].difference.mean() < 0.5
    content = json.loads(found.file.read_text())
    assert [entry.get("file") for entry in content["made_from"][:2]] == ["colour_chart.tif", "white_card.tif"]


def test_targets_are_known_by_name(folder, tmp_path):
    """The patches bear colour-science's names; the white patch stands in for a card."""
    found = impasto.calibrate.colour(
        folder / "colour_chart.tif", folder / "colour_chart.csv", tmp_path / "colour.json",
        target=TARGET, white="white 9.5 (.05 D)", method="matrix",
    )  # fmt: skip
    assert found.chosen == "matrix"
    assert found.white_xyz[1] == pytest.approx(1)


def test_what_is_wrong_is_named(folder, tmp_path):
    photo, table, out = folder / "colour_chart.tif", folder / "colour_chart.csv", tmp_path / "c.json"
    with pytest.raises(OptionError, match="--target moon: is not known"):
        impasto.calibrate.colour(photo, table, out, target="moon", white="cyan")
    with pytest.raises(OptionError, match="nothing says what white is"):
        impasto.calibrate.colour(photo, table, out)
    with pytest.raises(CaptureError, match=r"patch grey 1: is none of ColorChecker"):
        impasto.calibrate.colour(photo, folder / "grey_scale.csv", out, target=TARGET, white="grey 1")
    with pytest.raises(CaptureError, match="does not say the patches' colours"):
        impasto.calibrate.colour(photo, folder / "grey_scale.csv", out, white="grey 1")
