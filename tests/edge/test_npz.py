"""An `.npz` in pieces: numpy and zipfile read from it what went in."""

import io
import zipfile

import numpy as np
import pytest

from edge import npz

ARRAYS = {
    "meta": np.array('{"ä": "\N{OLD PERSIAN SIGN A}"}'),
    "t": np.linspace(0.0, 1.0, 5),
    "frames": np.arange(2 * 3 * 4, dtype=np.uint16).reshape(2, 3, 4),
    "valid": np.array([[True, False], [False, True]]),
    "scalar": np.array(2.5),
    "none": np.zeros((0, 7)),
    "by columns": np.asfortranarray(np.arange(6.0).reshape(2, 3)),
    "every other": np.arange(10)[::2],
    "big-endian": np.arange(3, dtype=">i4"),
}


def packed(arrays: dict[str, np.ndarray]) -> io.BytesIO:
    return io.BytesIO(b"".join(npz.pieces(arrays)))


def test_numpy_reads_the_same_arrays_in_their_order():
    with np.load(packed(ARRAYS)) as back:
        assert back.files == list(ARRAYS)
        for key, array in ARRAYS.items():
            assert (back[key].dtype, back[key].shape) == (array.dtype, array.shape)
            np.testing.assert_array_equal(back[key], array)


def test_the_archive_is_sound_and_the_same_at_any_time():
    with zipfile.ZipFile(packed(ARRAYS)) as archive:
        assert archive.testzip() is None
        for member in archive.infolist():
            assert member.compress_type == zipfile.ZIP_STORED
            assert member.date_time == (1980, 1, 1, 0, 0, 0)


@pytest.mark.parametrize("at", [0, 45, 300, -30, -6])
def test_a_byte_that_changes_is_noticed(at):
    damaged = bytearray(packed({"t": np.arange(30.0)}).getvalue())
    damaged[at] ^= 0xFF
    with pytest.raises((zipfile.BadZipFile, ValueError, NotImplementedError, KeyError)):
        np.load(io.BytesIO(damaged))["t"]


def test_large_arrays_are_handed_on_uncopied():
    frames = np.zeros((100, 16, 24), np.uint16)
    shared = [
        np.shares_memory(np.frombuffer(piece, np.uint8), frames)
        for piece in npz.pieces({"frames": frames})
    ]
    assert sum(shared) == 1


def test_no_arrays_are_an_empty_archive():
    assert zipfile.ZipFile(packed({})).namelist() == []
