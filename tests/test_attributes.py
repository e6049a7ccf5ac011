"""Attributes of a store that are missing or of another type: told when it is opened, and never a fault."""

import copy
import json
import re
import shutil
from itertools import product

import pytest

import impasto
from impasto import store as stores
from impasto.errors import StoreError
from impasto.fit import FitOptions
from impasto.fit.self_calibration import found_lights
from impasto.geometry import Lights
from impasto.light_distance import place_lights
from impasto.pixels import read_pixels, render_pixels
from impasto.render.display import requested_rendition
from impasto.store.kinds import COUNT, NUMBER, each, numbers, record
from store_files import attributes, change_attributes

MODEL = "torrance-sparrow"
TILE = slice(0, 4), slice(0, 5)
WRONG = ["text", 0.5, -3, True, None, [], {}, [None], float("nan"), 10**400]


@pytest.fixture(scope="module")
def rich(painting, tmp_path_factory):
    """Return a store whose fit has all that attributes may say."""
    store = tmp_path_factory.mktemp("attributes") / "p.zarr"
    shutil.copytree(painting, store)
    impasto.fit(store, models=[MODEL], options=FitOptions(residual=True), overwrite=True)
    count = len(stores.lights(store))
    near = {
        "used": "own",
        "common": 2.0,
        "own": [2.0] * count,
        "told": {"distance": 2.0, "table": [[[0.0, 0.1], [0.2, 0.0]]]},
    }

    def add(found):
        found["self_calibration"]["directions"] = {
            "used": True,
            "corrected": stores.lights(store).direction.tolist(),
        }
        found["self_calibration"]["distances"] = near
        found["residual"]["strength"] = {"table": [[[0.0, 0.1], [0.2, 0.0]]] * 3}

    change_attributes(store / "fits" / MODEL, add)
    change_attributes(store / "stack", lambda found: found["inputs"][0].update(shift_px=[0.5, -1.0]))
    impasto.evaluate(store, models=[MODEL], held_out=1, baselines=False)
    return store


def use_stack(store):
    stack = stores.open_stack(store)
    assert stack.camera.view_direction.shape == (3,)
    assert len(stack.noise) == 3
    assert len(stack.clip_level) == len(stack.light_rgb) == stack.shape[3]
    assert all((stack.lights.names, stack.light_rgb_source, stack.sha256))
    assert stack.clipped_samples >= 0
    stack.radiance(*TILE)


def use_fit(store):
    fit, stack = stores.open_fit(store, MODEL), stores.open_stack(store)
    FitOptions.of(fit.attributes).settled(fit.attributes)
    assert found_lights(fit.attributes, stack.lights, 60.0).intensity.shape == stack.lights.intensity.shape
    place_lights(fit.attributes, fit.shape, stack.lights, stack.camera)
    render_pixels(read_pixels(fit, *TILE), stack.lights, stack.camera)
    assert sum(fit.attributes["pixels"].values()) >= 0


def use_published(store):
    fit, stack = stores.open_published(store, MODEL)
    lights = Lights(("one",), [[0.6, 0.0, 0.8]])
    requested_rendition(
        stack, display="srgb", exposure=1.0, white_point=None, adaptation="cat16", highlights="clip"
    )
    render_pixels(read_pixels(fit, *TILE), lights, stack.camera)


def places(value, at=()):
    """Yield where each entry of nested attributes stands, of lists the first."""
    if at:
        yield at
    entries = value.items() if isinstance(value, dict) else list(enumerate(value))[:1]
    for key, entry in entries:
        if isinstance(entry, dict | list):
            yield from places(entry, (*at, key))
        else:
            yield (*at, key)


def changed(found, at, value):
    """Return attributes of which one has another value, or is gone."""
    result = copy.deepcopy(found)
    *path, last = at
    parent = result
    for key in path:
        parent = parent[key]
    if value is KeyError:
        del parent[last]
    else:
        parent[last] = value
    return result


def fault(use, store):
    """Return what a use of a store raises."""
    try:
        use(store)
    except Exception as error:
        return error
    return None


@pytest.fixture(scope="module")
def published(rich, tmp_path_factory):
    """Return the published store of it."""
    site = tmp_path_factory.mktemp("published") / "site"
    impasto.publish(rich, site, models=[MODEL], photographs=1)
    return site / "painting.zarr"


@pytest.mark.parametrize(
    ("of", "group", "use", "fewest"),
    [
        ("rich", "stack", use_stack, 30),
        ("rich", f"fits/{MODEL}", use_fit, 30),
        ("published", "", use_published, 20),
    ],
    ids=["stack", "fit", "published"],
)
def test_whatever_is_wrong_is_told_with_its_name_or_does_no_harm(
    of, group, use, fewest, monkeypatch, request
):
    store = request.getfixturevalue(of)
    found = attributes(store / group)
    told = set()
    read_group = stores.hierarchy.read_group

    def changed_group(path):
        return now if path == store / group else read_group(path)

    for module in (stores.stacks, stores.fits, stores.published):
        monkeypatch.setattr(module, "read_group", changed_group)
    now = found
    use(store)
    for at, value in product(places(found), (KeyError, *WRONG)):
        now = changed(found, at, value)
        if (error := fault(use, store)) is None:
            continue
        assert isinstance(error, StoreError), f"{at} as {value!r}: {error!r}"
        names = [key for key in at if isinstance(key, str)]
        assert re.search(rf"{names[0]}\b|not finished|with schema|has no model", str(error))
        assert all(re.search("impasto|ublish the painting", problem.do) for problem in error.problems)
        assert all(problem.where.startswith(str(store)) for problem in error.problems)
        told.add(".".join(names))
    assert len(told) >= fewest, sorted(told)


def test_what_is_wrong_is_told_with_what_was_expected(painting, tmp_path):
    store = tmp_path / "p.zarr"
    shutil.copytree(painting, store)

    def damage(found):
        del found["noise"]["read"]
        found["scale"] = "1.0"
        found["light_rgb"] = [1.0, 1.0]
        found["inputs"][2]["name"] = 5
        found["clip_level"] = [None]

    change_attributes(store / "stack", damage)
    with pytest.raises(StoreError) as error:
        stores.open_stack(store)
    where = f"{store}: stack/zarr.json"
    assert all(problem.where == where and "--overwrite" in problem.do for problem in error.value.problems)
    assert sorted(problem.what for problem in error.value.problems) == [
        "lacks the attribute noise.read",
        "the attribute clip_level is [null] of 1 entries, expected a list of 3",
        "the attribute inputs[2].name is 5, expected text",
        "the attribute light_rgb is [1.0, 1.0] of 2 entries, expected a list of 3 numbers",
        'the attribute scale is "1.0", expected a number',
    ]


def test_parameters_other_than_those_published_are_told(published, tmp_path):
    store = tmp_path / "p.zarr"
    shutil.copytree(published, store)
    change_attributes(store, lambda found: found["models"][0]["parameters"][-1].update(name="other"))
    expected = r"\), expected the 7 that are stored, with c\. Publish"
    with pytest.raises(StoreError, match=r"has 7 parameters \(normal, .*, specular, other" + expected):
        use_published(store)
    change_attributes(store, lambda found: found["models"][0]["parameters"].pop())
    with pytest.raises(StoreError, match=r"has 6 parameters \(normal, .*, specular" + expected):
        use_published(store)


def test_an_evaluation_that_is_damaged_is_told(rich, tmp_path):
    store = tmp_path / "p.zarr"
    shutil.copytree(rich, store)
    change_attributes(
        store / "evaluations" / MODEL, lambda found: found["lights"][0].update(zenith_deg="low")
    )
    with pytest.raises(StoreError, match=r'lights\[0\].zenith_deg is "low".* Run impasto evaluate again'):
        impasto.report(store, tmp_path / "report.html")


def test_a_damaged_stack_or_fit_is_replaced_only_on_request(capture, painting, tmp_path):
    store = tmp_path / "p.zarr"
    shutil.copytree(painting, store)
    change_attributes(store / "fits" / MODEL, lambda found: found.update(pixels=[]))
    with pytest.raises(StoreError, match=r"attribute pixels is \[\].*--overwrite"):
        impasto.fit(store, models=[MODEL])
    impasto.fit(store, models=[MODEL], overwrite=True)
    change_attributes(store / "stack", lambda found: found.update(inputs=None))
    with pytest.raises(StoreError, match=r"attribute inputs is null.*--overwrite"):
        impasto.stack(capture, store)
    impasto.stack(capture, store, overwrite=True)
    use_stack(store)


def test_an_unfinished_stack_that_is_damaged_is_begun_anew(capture, painting, tmp_path):
    store = tmp_path / "p.zarr"
    impasto.stack(capture, store)
    change_attributes(store / "stack", lambda found: found.update(inputs=[3], complete=False))
    impasto.stack(capture, store)
    assert attributes(store / "stack") == attributes(painting / "stack")


def test_options_of_a_newer_version_are_told(painting):
    found = stores.fit_attributes(painting, MODEL)
    found["options"]["sparkle"] = True
    with pytest.raises(StoreError, match=r"does not know: sparkle\. Use the version"):
        FitOptions.of(found)


def test_attributes_that_are_no_object_are_told(painting, tmp_path):
    store = tmp_path / "p.zarr"
    shutil.copytree(painting, store)
    document = store / "stack" / "zarr.json"
    document.write_text('{"zarr_format": 3, "node_type": "group", "attributes": [1]}')
    with pytest.raises(StoreError, match=r"attributes are \[1\], expected an object"):
        stores.open_stack(store)


@pytest.mark.parametrize(
    ("name", "metadata", "what"),
    [
        ("light_direction", {"shape": [16, 2]}, r"expected float64 of shape \(16, 3\)"),
        ("light_direction", {"data_type": "int64"}, r"is int64 .* expected float64 of shape \(16, 3\)"),
        ("light_intensity", {"data_type": "string"}, r"expected float64 of shape \(16, 3\)"),
        ("light_name", {"shape": [15]}, r"expected strings of shape \(16,\)"),
        ("radiance", {"data_type": "int8"}, "expected uint16 or float32"),
    ],
)
def test_arrays_of_another_shape_or_type_are_told(painting, tmp_path, name, metadata, what):
    store = tmp_path / "p.zarr"
    shutil.copytree(painting, store)
    document = store / "stack" / name / "zarr.json"
    document.write_text(json.dumps(json.loads(document.read_text()) | metadata))
    with pytest.raises(StoreError, match=f"stack/{name}: .*(damaged|{what})"):
        stores.open_stack(store).lights  # noqa: B018


@pytest.mark.parametrize(
    ("name", "metadata", "what"),
    [
        ("status", {"shape": [4, 5]}, r"is uint8 of shape \(4, 5\), expected uint8 of shape"),
        ("c", {"shape": [10**9, 10**9]}, "takes .* files, expected 16,777,216 at most"),
        ("c", {"data_type": "int32"}, "is int32 of shape .* expected float32"),
        ("residual", {"data_type": "int16"}, "is int16 of shape .* expected uint16"),
        ("status", None, "lacks the map status"),
        ("residual", None, "lacks the map residual"),
        ("c", None, "lacks the map c"),
    ],
)
def test_maps_that_are_missing_or_of_another_kind_are_told(rich, tmp_path, name, metadata, what):
    store = tmp_path / "p.zarr"
    shutil.copytree(rich, store)
    folder = store / "fits" / MODEL / name
    document = folder / "zarr.json"
    if metadata is None:
        shutil.rmtree(folder)
    else:
        document.write_text(json.dumps(json.loads(document.read_text()) | metadata))
    with pytest.raises(StoreError, match=f"fits/{MODEL}.*{what}.*--overwrite"):
        impasto.render(store, model=MODEL, light=[(30, 40)], out=tmp_path / "out", raw=True)


@pytest.mark.parametrize("group", ["parameters", "residual"])
def test_published_arrays_of_another_size_are_told(published, tmp_path, group):
    store = tmp_path / "p.zarr"
    shutil.copytree(published, store)
    document = store / "models" / MODEL / "0" / group / "zarr.json"
    metadata = json.loads(document.read_text())
    metadata["shape"][1] -= 1
    document.write_text(json.dumps(metadata))
    with pytest.raises(StoreError, match=rf"0/{group}: is uint.* expected uint.* Publish"):
        stores.open_published(store, MODEL)


@pytest.mark.parametrize("axis", range(4))
def test_kept_renderings_of_another_size_are_told(rich, tmp_path, axis):
    store = tmp_path / "p.zarr"
    shutil.copytree(rich, store)
    document = store / "evaluations" / MODEL / "radiance" / "zarr.json"
    metadata = json.loads(document.read_text())
    metadata["shape"][axis] += 1
    document.write_text(json.dumps(metadata))
    with pytest.raises(StoreError, match=r"radiance: is float32 .* expected float32 .* evaluate again"):
        stores.read_evaluation(store, MODEL).renderings()


@pytest.mark.parametrize(
    "strength",
    [
        {"table": [[[0.0, 0.1]]] * 2},
        {"table": [[[], []]] * 3},
        {"weights": [[0.1] * 15] * 3, "length": 0.3},
        {"weights": [[0.1] * 16] * 2, "length": 0.3},
    ],
)
def test_strengths_of_other_channels_or_lights_are_told(rich, tmp_path, strength):
    store = tmp_path / "p.zarr"
    shutil.copytree(rich, store)
    group = store / "fits" / MODEL
    change_attributes(group, lambda found: found["residual"].update(strength=strength))
    with pytest.raises(StoreError, match=r"the attribute residual\.strength\.(table|weights) is"):
        stores.open_fit(store, MODEL)


def test_a_distance_told_by_weights_of_other_lights_is_told(rich, tmp_path):
    store = tmp_path / "p.zarr"
    shutil.copytree(rich, store)
    told = {"distance": 2.0, "weights": [[0.1] * 16], "length": 0.3, "direction": [[0, 0, 1]] * 15}
    change_attributes(
        store / "fits" / MODEL, lambda found: found["self_calibration"]["distances"].update(told=told)
    )
    with pytest.raises(StoreError, match=r"distances\.told\.weights is .* expected a list of 1 x 15"):
        stores.open_fit(store, MODEL)


def test_highlights_of_another_colour_do_not_turn_white_where_their_map_is_lost(rich, tmp_path):
    store = tmp_path / "p.zarr"
    shutil.copytree(rich, store)
    change_attributes(store / "fits" / MODEL, lambda found: found.update(highlight_colour={"used": "own"}))
    shutil.rmtree(store / "fits" / MODEL / "specular_rgb", ignore_errors=True)
    with pytest.raises(StoreError, match="lacks the map specular_rgb"):
        stores.open_fit(store, MODEL)


def test_kinds_accept_what_they_name():
    point = record({"at": numbers(2), "tags": each(COUNT)}, {"size": NUMBER})
    assert list(point({"at": [1, 2.5], "tags": [], "more": None}, "")) == []
    assert list(point({"at": [[1], [2]], "tags": [True], "size": float("inf")}, "p")) == [
        "the attribute p.at is [[1], [2]] of 2 entries, expected a list of 2 numbers",
        "the attribute p.tags[0] is true, expected a whole number from 0",
        "the attribute p.size is Infinity, expected a number",
    ]
    assert list(numbers(None, 3)([], "q")) == [
        "the attribute q is [] of 0 entries, expected a list of … x 3 numbers"
    ]
    (long,) = numbers(3)([1, 2, "a" * 100], "list")
    assert len(long) < 110
