"""Chunks that impasto encodes are what numcodecs would decode, and the reverse; damage is found."""

import gzip

import numpy as np
import pytest
from numcodecs.vlen import VLenUTF8
from numcodecs.zstd import Zstd

from impasto.store.codecs import decompress, strings_decode, strings_encode, zstd_decode, zstd_encode

NAMES = ["a photograph", "", "Gemälde №7", "x" * 1000]


@pytest.fixture
def values():
    """Return values that compress to about half."""
    return np.random.default_rng(1).integers(0, 300, (50, 70, 3)).astype(np.uint16)


@pytest.mark.parametrize("level", [-200, -1, 3])
def test_numcodecs_and_impasto_read_each_other(values, level):
    frame = zstd_encode(values, level)
    assert bytes(Zstd().decode(bytes(frame))) == values.tobytes()
    theirs = Zstd(level=level, checksum=True).encode(values)
    read = np.empty_like(values)
    zstd_decode(theirs, read)
    np.testing.assert_array_equal(read, values)
    assert bytes(decompress(theirs, "zstd", values.nbytes)) == values.tobytes()


def test_strings_are_those_of_numcodecs():
    assert strings_encode(NAMES) == bytes(VLenUTF8().encode(np.array(NAMES, object)))
    assert strings_decode(strings_encode(NAMES)) == NAMES
    assert strings_decode(strings_encode([])) == []


@pytest.mark.parametrize("cut", [2, 4, 10, -1])
def test_strings_cut_off_are_refused(cut):
    with pytest.raises(ValueError, match="cut off"):
        strings_decode(strings_encode(NAMES)[:cut])


def test_damage_is_found(values):
    frame = bytes(zstd_encode(values, -1))
    for position in (9, len(frame) // 2, len(frame) - 1):
        damaged = bytearray(frame)
        damaged[position] ^= 4
        with pytest.raises((OSError, ValueError)):
            zstd_decode(bytes(damaged), np.empty_like(values))
    for length in (0, 3, 20, len(frame) - 1):
        with pytest.raises((OSError, ValueError)):
            decompress(frame[:length], "zstd", values.nbytes)
    with pytest.raises(ValueError, match="expected"):
        zstd_decode(frame, np.empty(values.size + 1, np.uint16))
    squeezed = gzip.compress(values.tobytes())
    assert decompress(squeezed, "gzip", values.nbytes) == values.tobytes()
    for damaged in (squeezed[:-9], squeezed[:40] + b"\0\0\0" + squeezed[43:], squeezed[:5]):
        with pytest.raises((OSError, ValueError)):
            decompress(damaged, "gzip", values.nbytes)


def test_a_length_that_cannot_be_is_not_believed(values):
    frame = bytearray(zstd_encode(np.zeros(100_000, np.uint8), -1))
    # The length stands in the frame's header, here in four bytes after the descriptor.
    frame[5:9] = (2**31).to_bytes(4, "little")
    with pytest.raises(ValueError, match="2147483648 bytes, expected 100000 at most"):
        decompress(bytes(frame), "zstd", 100_000)


@pytest.mark.parametrize(("compressor", "compress"), [("zstd", Zstd().encode), ("gzip", gzip.compress)])
def test_more_than_expected_is_refused(compressor, compress):
    frame = bytes(compress(bytes(1000)))
    assert bytes(decompress(frame, compressor, 1000)) == bytes(1000)
    with pytest.raises(ValueError, match="bytes"):
        decompress(frame, compressor, 999)
