"""From photographs to a stack: values, what is counted, interruptions, and what is refused."""

import hashlib
import json
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import tifffile

from impasto import store as stores
from impasto.capture import Photograph, read_capture
from impasto.colour import decode_srgb
from impasto.errors import CaptureError, StoreError
from impasto.stack import stack
from impasto.stack.decoders import affordable_decoders
from impasto.stack.linearise import Linearisation
from store_files import (
    attributes,
    chunks_in,
    contents,
    largest_file,
    noise_images,
    photograph,
    write_capture,
)


def values(path):
    opened = stores.open_stack(path)
    _, height, width, _ = opened.shape
    return opened, opened.read(slice(0, height), slice(0, width))


def test_sixteen_bit_linear_values_are_kept(tmp_path):
    images = noise_images(3, 600, 530)
    images[1][:10, :7] = 65000
    summary = stack(write_capture(tmp_path / "photos", images), tmp_path / "s.zarr")
    opened, stored = values(tmp_path / "s.zarr")
    np.testing.assert_array_equal(stored, images)
    assert opened.scale == 1 / 65535
    assert summary.clipped_samples == {"light00": 0, "light01": 10 * 7 * 3, "light02": 0}
    assert (summary.decoded, summary.kept, summary.already) == (3, 0, False)
    assert opened.noise == (1e-4, 0.0, 5e-3)
    assert opened.lights.names == ("light00", "light01", "light02")
    # 99 % of full scale is the first clipped value, and the level lies just below it.
    first = np.ceil(0.99 * 65535)
    assert ((first - 1) / 65535 < opened.clip_level).all()
    assert (opened.clip_level < first / 65535).all()


def test_eight_bit_values_are_decoded_by_their_transfer_function(tmp_path):
    images = noise_images(2, 40, 30, dtype=np.uint8)
    images[0][3, 4] = (253, 254, 255)
    summary = stack(write_capture(tmp_path / "photos", images), tmp_path / "s.zarr")
    opened, stored = values(tmp_path / "s.zarr")
    expected = decode_srgb(np.array(images) / 255)
    np.testing.assert_allclose(stored * opened.scale, expected, atol=0.5 / 65535)
    clipped = stored * opened.scale >= opened.clip_level
    assert clipped.sum() == summary.clipped_samples["light00"] == 2
    assert summary.transfer == "srgb"
    assert opened.noise == (1e-3, 1e-5, 5e-3)
    assert opened.attributes["quantisation_step"] == pytest.approx(decode_srgb(1.0) - decode_srgb(254 / 255))


def test_floats_are_kept_and_what_is_not_finite_is_missing(tmp_path):
    images = [np.linspace(0, 30, 40 * 30, dtype=np.float32).reshape(40, 30) for _ in range(2)]
    images[1][2, 3], images[1][2, 4] = np.inf, np.nan
    summary = stack(write_capture(tmp_path / "photos", images), tmp_path / "s.zarr")
    opened, stored = values(tmp_path / "s.zarr")
    assert opened.dtype == np.float32
    assert np.isnan(stored[1, 2, 3:5]).all()
    images[1][2, 3] = np.nan
    np.testing.assert_array_equal(stored[..., 0], images)
    assert np.isinf(opened.clip_level).all()
    assert summary.clipped_samples["light01"] == 1


def test_each_channel_has_its_own_table(tmp_path, monkeypatch):
    table = np.linspace(0, 1, 256)[:, None] ** np.array([1, 2, 3])
    monkeypatch.setattr(sys.modules["impasto.stack.linearise"], "linearisation_table", lambda *_: table)
    photograph = photographs(tmp_path, np.uint8)[0]
    linearise = Linearisation(photograph, 250.0)
    band = np.random.default_rng(0).integers(0, 256, (130, 9, 3)).astype(np.uint8)
    expected = np.stack([table[band[..., channel], channel] for channel in range(3)], axis=-1)
    np.testing.assert_array_equal(linearise.stored(band)[0], np.rint(expected * 65535))
    assert linearise.clip_level == pytest.approx((250 / 255) ** np.array([1, 2, 3]), abs=1 / 65535)


def photographs(tmp_path, dtype=np.uint16, height=40, width=30):
    return read_capture(
        write_capture(tmp_path / "photos", noise_images(2, height, width, dtype=dtype))
    ).photographs


def test_noise_and_clip_level_of_the_capture_win(tmp_path):
    folder = write_capture(tmp_path / "photos", noise_images(2, 20, 20))
    (folder / "lights.lp").unlink()
    (folder / "lights.toml").write_text(
        "[photographs]\nclip_level = 40000\nnoise = { read = 0.01 }\n"
        '[[light]]\nfile = "light00.tif"\ndirection = [0, 0, 1]\n'
        '[[light]]\nfile = "light01.tif"\ndirection = [1, 0, 1]\n'
    )
    summary = stack(folder, tmp_path / "s.zarr")
    opened, stored = values(tmp_path / "s.zarr")
    assert opened.noise == (0.01, 0.0, 5e-3)
    assert sum(summary.clipped_samples.values()) == np.count_nonzero(stored >= 40000) > 0


def test_the_same_photographs_are_not_stacked_twice(tmp_path):
    folder = write_capture(tmp_path / "photos", noise_images(3, 40, 30))
    stack(folder, tmp_path / "s.zarr")
    before = contents(tmp_path / "s.zarr")
    again = stack(folder, tmp_path / "s.zarr")
    assert (again.already, again.decoded, again.kept) == (True, 0, 3)
    assert contents(tmp_path / "s.zarr") == before
    anew = stack(folder, tmp_path / "s.zarr", overwrite=True)
    assert (anew.already, anew.decoded) == (False, 3)
    assert contents(tmp_path / "s.zarr") == before


def test_another_stack_is_replaced_only_on_request(tmp_path):
    folder = write_capture(tmp_path / "photos", noise_images(3, 40, 30))
    path = tmp_path / "s.zarr"
    stack(folder, path)
    fit = stores.MapsWriter(
        path, "fits/phong", stores.fit_maps((), lobes=0, ambient=False, channels=3), 40, 30, {}
    )
    fit.finish({})
    before = contents(path)
    with pytest.raises(StoreError, match=r"1 of its photographs are not given now.*phong.*--overwrite"):
        stack(folder, path, exclude=["light02"])
    (folder / "lights.lp").write_text((folder / "lights.lp").read_text().replace(" 0.9", " 0.8"))
    with pytest.raises(StoreError, match="lights, camera or settings"):
        stack(folder, path)
    write_capture(folder, [*noise_images(2, 40, 30), *noise_images(1, 40, 30, seed=8)])
    with pytest.raises(StoreError, match=r"1 of its photographs have changed \(light02\)"):
        stack(folder, path)
    assert contents(path) == before
    assert stack(folder, path, overwrite=True).decoded == 3
    assert stores.fitted_models(path) == []


def test_an_interrupted_stack_is_continued_to_the_same_bytes(tmp_path, monkeypatch):
    folder = write_capture(tmp_path / "photos", noise_images(6, 1100, 90))
    stack(folder, tmp_path / "whole.zarr")
    path = tmp_path / "s.zarr"
    bands, decoded = Photograph.bands, []
    heard, shutdown = threading.Event(), ThreadPoolExecutor.shutdown

    def stop_in_the_fourth(self, rows):
        if self.name > "light03":  # a thread may begin with the next before the interruption is heard
            assert heard.wait(60)
        for row, band in bands(self, rows):
            if self.name == "light03" and row:
                raise KeyboardInterrupt
            yield row, band

    def hear(self, *arguments, **options):
        heard.set()
        shutdown(self, *arguments, **options)

    monkeypatch.setattr(Photograph, "bands", stop_in_the_fourth)
    monkeypatch.setattr(ThreadPoolExecutor, "shutdown", hear)
    monkeypatch.setattr(sys.modules["impasto.stack.job"], "affordable_decoders", lambda *_, **__: 1)
    with pytest.raises(KeyboardInterrupt):
        stack(folder, path)
    with pytest.raises(StoreError, match="3 of 6 photographs"):
        stores.open_stack(path)

    def note(self, rows):
        decoded.append(self.name)
        return bands(self, rows)

    monkeypatch.setattr(Photograph, "bands", note)
    summary = stack(folder, path)
    assert decoded == ["light03", "light04", "light05"]
    assert (summary.decoded, summary.kept) == (3, 3)
    assert contents(path) == contents(tmp_path / "whole.zarr")


def test_a_photograph_that_changed_meanwhile_is_decoded_again(tmp_path, monkeypatch):
    folder = write_capture(tmp_path / "photos", noise_images(3, 40, 30))
    monkeypatch.setattr(
        stores.StackWriter, "finish", lambda self, more: (_ for _ in ()).throw(KeyboardInterrupt)
    )
    with pytest.raises(KeyboardInterrupt):
        stack(folder, tmp_path / "s.zarr")
    monkeypatch.undo()
    images = [*noise_images(2, 40, 30), *noise_images(1, 40, 30, seed=8)]
    summary = stack(write_capture(folder, images), tmp_path / "s.zarr")
    assert (summary.decoded, summary.kept) == (1, 2)
    np.testing.assert_array_equal(values(tmp_path / "s.zarr")[1], images)


def test_all_damaged_photographs_are_listed_and_the_others_kept(tmp_path):
    folder = write_capture(tmp_path / "photos", noise_images(5, 300, 90))
    for name in ("light01.tif", "light03.tif"):
        damage_pixels(folder / name)
    with pytest.raises(CaptureError) as caught:
        stack(folder, tmp_path / "s.zarr")
    assert [problem.where for problem in caught.value.problems] == ["light01.tif", "light03.tif"]
    with pytest.raises(StoreError, match="3 of 5 photographs"):
        stores.open_stack(tmp_path / "s.zarr")
    write_capture(folder, noise_images(5, 300, 90))
    assert stack(folder, tmp_path / "s.zarr").kept in (0, 3)


def damage_pixels(path):
    """Write a photograph whose header is whole and whose compressed pixels are not."""
    image = tifffile.imread(path)
    tifffile.imwrite(path, image, compression="zlib", photometric="rgb", rowsperstrip=64)
    data = bytearray(path.read_bytes())
    with tifffile.TiffFile(path) as tiff:
        offset, count = tiff.pages[0].dataoffsets[2], tiff.pages[0].databytecounts[2]
    data[offset : offset + count] = bytes(count)
    path.write_bytes(bytes(data))


def test_problems_of_the_photographs_and_of_the_store_are_listed_together(tmp_path):
    folder = write_capture(tmp_path / "photos", noise_images(3, 20, 20))
    (folder / "light01.tif").unlink()
    (tmp_path / "holiday").mkdir()
    (tmp_path / "holiday" / "beach.jpg").touch()
    with pytest.raises(CaptureError) as caught:
        stack(folder, tmp_path / "holiday")
    text = str(caught.value)
    assert "light01.tif" in text
    assert "not an impasto store" in text
    assert [path.name for path in (tmp_path / "holiday").iterdir()] == ["beach.jpg"]
    assert not (tmp_path / "holiday.log.jsonl").exists()


def test_a_full_disk_is_an_error_that_can_be_continued(tmp_path):
    folder = write_capture(tmp_path / "photos", noise_images(3, 300, 290))
    stack(folder, tmp_path / "whole.zarr")
    with largest_file(100_000), pytest.raises(StoreError, match="no room left"):
        stack(folder, tmp_path / "s.zarr")
    with pytest.raises(StoreError, match="not finished"):
        stores.open_stack(tmp_path / "s.zarr")
    stack(folder, tmp_path / "s.zarr")
    assert contents(tmp_path / "s.zarr") == contents(tmp_path / "whole.zarr")


@pytest.mark.parametrize(("dtype", "value"), [(np.uint8, 255), (np.uint16, 65535), (np.float32, np.nan)])
def test_overexposed_and_missing_photographs_have_all_of_their_chunks(tmp_path, dtype, value):
    images = [np.full((30, 530, 3), value, dtype) for _ in range(2)]
    images[0][10, 10] = images[1][5, 520] = 0.25 if dtype == np.float32 else 80
    stack(write_capture(tmp_path / "photos", images), tmp_path / "s.zarr")
    for light in (0, 1):
        (first, size), (second, _) = chunks_in(photograph(tmp_path / "s.zarr", light), 2)
        assert (first, second) == (0, size)
    read = stores.read_stack(tmp_path / "s.zarr", slice(0, 30), slice(0, 530))
    usual = read[1, 10, 10]
    np.testing.assert_array_equal(usual, np.nan if dtype == np.float32 else 1)
    assert (read[0, 10, 10] < 0.5).all()


def test_room_is_checked_before_anything_is_decoded(tmp_path, monkeypatch):
    folder = write_capture(tmp_path / "photos", noise_images(2, 40, 30))
    monkeypatch.setattr("shutil.disk_usage", lambda path: type("Usage", (), {"free": 1000}))
    monkeypatch.setattr(Photograph, "bands", lambda *_: pytest.fail("decoded"))
    with pytest.raises(StoreError, match="MB free"):
        stack(folder, tmp_path / "s.zarr")


def test_fewer_photographs_are_decoded_at_a_time_where_memory_is_short(tmp_path, monkeypatch):
    monkeypatch.setattr("os.sched_getaffinity", lambda _: set(range(32)))
    pictures = photographs(tmp_path) * 40
    linearise = Linearisation(pictures[0], np.inf)
    large = [type(p)(**{**vars(p), "width": 5000, "height": 3300, "unit_rows": 3300}) for p in pictures]
    assert affordable_decoders(pictures, linearise, 1.2e9) == 32
    assert affordable_decoders(large, linearise, 1.2e9) in range(3, 9)
    assert affordable_decoders(large, linearise, 0.2e9) == 1


def test_a_stack_of_an_earlier_version_is_known_by_its_digests(tmp_path):
    folder = write_capture(tmp_path / "photos", noise_images(3, 30, 29))
    stack(folder, tmp_path / "s.zarr")
    document = tmp_path / "s.zarr" / "stack" / "zarr.json"
    metadata = json.loads(document.read_text())
    for entry in metadata["attributes"]["inputs"]:
        del entry["blake3"]
        entry["sha256"] = hashlib.sha256((folder / entry["file"]).read_bytes()).hexdigest()
    document.write_text(json.dumps(metadata))
    assert stack(folder, tmp_path / "s.zarr").already
    assert len(stores.open_stack(tmp_path / "s.zarr").sha256) == 64
    tifffile.imwrite(folder / "light01.tif", noise_images(1, 30, 29)[0][::-1], photometric="rgb")
    with pytest.raises(StoreError, match="1 of its photographs have changed"):
        stack(folder, tmp_path / "s.zarr")


def test_an_unfinished_stack_of_another_layout_is_begun_anew(tmp_path):
    folder = write_capture(tmp_path / "photos", noise_images(3, 300, 290))
    stack(folder, tmp_path / "whole.zarr")
    with largest_file(100_000), pytest.raises(StoreError, match="no room left"):
        stack(folder, tmp_path / "s.zarr")
    document = tmp_path / "s.zarr" / "stack" / "radiance" / "zarr.json"
    metadata = json.loads(document.read_text())
    metadata["codecs"] = metadata["codecs"][0]["configuration"]["codecs"]
    document.write_text(json.dumps(metadata))
    stack(folder, tmp_path / "s.zarr")
    assert contents(tmp_path / "s.zarr") == contents(tmp_path / "whole.zarr")


_CHILD = """
import sys, tifffile
from impasto.stack import stack
print("ready", flush=True)
stack(sys.argv[1], sys.argv[2])
"""


def test_a_kill_at_any_moment_can_be_continued_to_the_same_bytes(tmp_path):
    folder = write_capture(tmp_path / "photos", noise_images(12, 1100, 600))
    started = time.perf_counter()
    stack(folder, tmp_path / "whole.zarr")
    seconds = time.perf_counter() - started
    whole = contents(tmp_path / "whole.zarr")
    rng = np.random.default_rng(5)
    killed, path = 0, tmp_path / "s.zarr"
    for moment in rng.uniform(0, seconds, 8):
        with subprocess.Popen(
            [sys.executable, "-c", _CHILD, str(folder), str(path)], stdout=subprocess.PIPE, text=True
        ) as child:
            assert child.stdout.readline() == "ready\n"
            time.sleep(moment)
            child.kill()
        killed += child.returncode == -signal.SIGKILL
    assert killed
    stack(folder, path)
    assert contents(path) == whole
    events = [json.loads(line)["event"] for line in (tmp_path / "s.zarr.log.jsonl").read_text().splitlines()]
    assert events[-1] == "end"
    assert attributes(path / "stack")["complete"] is True
