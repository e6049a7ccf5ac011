"""Models of a display fitted to simulated measurements of one that is neither."""

import itertools

import numpy as np
import pytest

import impasto
from impasto.calibrate.colour_fit import ciede2000
from impasto.calibrate.display import read_display
from impasto.colour.displays import AdditiveDisplay, GainOffsetGamma, LookUpTables
from impasto.errors import CaptureError

MATRIX = np.array([[41.2, 35.8, 18.0], [21.3, 71.5, 7.2], [1.9, 11.9, 95.0]])
BLACK = np.array([0.31, 0.33, 0.42])


def curves(kind):
    if kind == "gain-offset-gamma":
        return GainOffsetGamma(
            np.array([1.04, 1.02, 1.05]), np.array([-0.04, -0.02, -0.05]), np.array([2.2, 2.1, 2.3])
        )
    # The S-shaped curves of a liquid crystal, one per primary.
    drive = np.linspace(0, 1, 64)
    steep = np.array([[5.0], [5.5], [4.5]])
    shaped = 1 / (1 + np.exp(-steep * (drive - 0.62)))
    shaped = (shaped - shaped[:, :1]) / (shaped[:, -1:] - shaped[:, :1])
    return LookUpTables(drive, shaped)


def measure(path, kind, noise=0.001, seed=0):
    """Write measurements of a display: ramps, greys and a cube of mixtures, with noise."""
    shown = AdditiveDisplay("true", MATRIX, BLACK, curves(kind))
    ramp = np.round(np.linspace(0, 255, 18))
    drives = [np.eye(3)[primary] * level for primary in range(3) for level in ramp[1:]]
    drives += [np.full(3, level) for level in ramp]
    drives += [np.array(mix) for mix in itertools.product((64, 128, 255), repeat=3)]
    drives = np.array(drives)
    rng = np.random.default_rng(seed)
    xyz = shown.decode(drives / 255) * (1 + noise * rng.standard_normal((len(drives), 3)))
    rows = [
        ",".join(f"{value:g}" for value in (*drive, *np.round(seen, 5)))
        for drive, seen in zip(drives, xyz, strict=True)
    ]
    path.write_text("\n".join(["R,G,B,X,Y,Z", *rows]))
    return shown


@pytest.mark.parametrize(
    ("model", "kind"),
    [("gain-offset-gamma", "gain-offset-gamma"), ("tables", "tables"), ("tables", "gain-offset-gamma")],
)
def test_a_display_is_inverted_to_half_a_ciede2000(tmp_path, model, kind):
    """What the fitted model sends for colours that the true display can show is shown as asked."""
    true = measure(tmp_path / "measured.csv", kind)
    found = impasto.calibrate.display(tmp_path / "measured.csv", tmp_path / "display.json", model=model)
    assert found.difference.mean() < 0.5
    display = read_display(tmp_path / "display.json")
    rng = np.random.default_rng(3)
    drive = rng.uniform(0.03, 0.97, (500, 3))
    white = true.decode(np.ones(3))
    asked = true.decode(drive) / white[1]
    linear = np.linalg.solve(display.matrix, (asked - display.black).T).T
    shown = true.decode(display.encode(linear)) / white[1]
    difference = ciede2000(shown, asked, white / white[1])
    assert difference.max() < 0.5


def test_the_light_at_black_is_found(tmp_path):
    measure(tmp_path / "m.csv", "gain-offset-gamma")
    found = impasto.calibrate.display(tmp_path / "m.csv", tmp_path / "d.json", model="gain-offset-gamma")
    white = MATRIX.sum(axis=1) + BLACK
    np.testing.assert_allclose(found.display.black, BLACK / white[1], rtol=0.2)


def test_a_rendering_is_made_for_a_calibrated_display(painting, tmp_path):
    measure(tmp_path / "m.csv", "tables")
    impasto.calibrate.display(tmp_path / "m.csv", tmp_path / "display.json")
    impasto.render(
        painting,
        model="phong",
        light=[(30.0, 45.0)],
        out=tmp_path / "out",
        display=tmp_path / "display.json",
    )
    assert (tmp_path / "out" / "1.png").is_file()


def test_incomplete_measurements_are_refused(tmp_path):
    measure(tmp_path / "m.csv", "tables")
    rows = (tmp_path / "m.csv").read_text().splitlines()
    (tmp_path / "few.csv").write_text("\n".join(rows[:8]))
    with pytest.raises(CaptureError, match="holds 7 colours, expected at least 12"):
        impasto.calibrate.display(tmp_path / "few.csv", tmp_path / "d.json")
    kept = [row for row in rows if not row.startswith("0,0,") and not row.startswith("255,255,255,")]
    (tmp_path / "no.csv").write_text("\n".join(kept))
    with pytest.raises(CaptureError) as error:
        impasto.calibrate.display(tmp_path / "no.csv", tmp_path / "d.json")
    assert len(error.value.problems) == 2
    (tmp_path / "words.csv").write_text("R,G,B,X,Y\n1,2,3,4,5\n")
    with pytest.raises(CaptureError, match="Write columns R,G,B,X,Y,Z"):
        impasto.calibrate.display(tmp_path / "words.csv", tmp_path / "d.json")
