"""Height maps of a fit, written as pictures and as meshes, against the surface that was simulated."""

import numpy as np
import pytest
import tifffile

import impasto
from impasto.errors import OptionError
from impasto.maps.mesh import write_ply, write_stl

MODEL = "torrance-sparrow"
HILL = np.array([[0.0, 0.5, 0.0], [0.2, 2.0, 0.1]], np.float32)


def test_a_ply_file_holds_the_surface(tmp_path):
    write_ply(tmp_path / "a.ply", HILL, 0.5)
    head, body = (tmp_path / "a.ply").read_bytes().split(b"end_header\n")
    assert b"element vertex 6" in head
    assert b"element face 4" in head
    vertices = np.frombuffer(body, "<f4", 18).reshape(6, 3)
    np.testing.assert_allclose(vertices[0], [-0.5, 0.25, 0.0])
    np.testing.assert_allclose(vertices[4], [0.0, -0.25, 2.0])
    faces = np.frombuffer(body, [("count", "u1"), ("corners", "<u4", 3)], offset=72)
    assert len(faces) == 4
    first, second, third = vertices[faces["corners"]].transpose(1, 0, 2)
    assert (np.cross(second - first, third - first)[:, 2] > 0).all()
    assert set(faces["corners"].ravel()) == set(range(6))


def test_an_stl_file_holds_the_same_triangles(tmp_path):
    write_stl(tmp_path / "a.stl", HILL, 0.5)
    data = (tmp_path / "a.stl").read_bytes()
    assert np.frombuffer(data, "<u4", 1, 80)[0] == 4
    facets = np.frombuffer(
        data, [("normal", "<f4", 3), ("points", "<f4", (3, 3)), ("rest", "<u2")], offset=84
    )
    assert len(facets) == 4
    points = facets["points"]
    across = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    np.testing.assert_allclose(
        across / np.linalg.norm(across, axis=1, keepdims=True), facets["normal"], atol=1e-6
    )
    # Seen from the front, the triangles cover 1 by 0.5.
    assert across[:, 2].sum() / 2 == pytest.approx(0.5)


def test_heights_are_those_of_the_normals_in_mm(painting, tmp_path):
    whole = impasto.height(painting, model=MODEL, out=tmp_path / "a.tif")
    values = tifffile.imread(tmp_path / "a.tif")
    assert values.dtype == np.float32
    assert (values.min(), values.max()) == (pytest.approx(whole.low), pytest.approx(whole.high))
    assert values.mean() == pytest.approx(0.0, abs=1e-4)
    assert whole.unit == "mm"
    coded = impasto.height(painting, model=MODEL, out=tmp_path / "b.tif", bits=16)
    codes = tifffile.imread(tmp_path / "b.tif")
    assert codes.dtype == np.uint16
    np.testing.assert_allclose(
        coded.low + codes / 65535 * (coded.high - coded.low), values, atol=(coded.high - coded.low) / 65535
    )
    mesh = impasto.height(painting, model=MODEL, out=tmp_path / "c.stl", step=2)
    assert mesh.pitch == pytest.approx(2 * whole.pitch)
    assert (mesh.rows, mesh.columns) == (values.shape[0] // 2, values.shape[1] // 2)


def test_everything_wrong_is_told_at_once(painting, tmp_path):
    with pytest.raises(OptionError) as error:
        impasto.height(painting, model=MODEL, out=tmp_path / "a.obj", bits=8, step=0)
    assert len(error.value.problems) == 3
