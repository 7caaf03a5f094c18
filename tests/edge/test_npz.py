"""The lean writer against numpy's reader and an unzip."""

import io
import zipfile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from edge import npz

KINDS = st.sampled_from(["<f8", "<u2", "<i8", "|b1", "<U7", ">u2", "<f4"])


@given(st.lists(hnp.arrays(KINDS, hnp.array_shapes(min_dims=0, min_side=0)), max_size=4))
def test_numpy_reads_back_every_array(arrays):
    named = {f"key{i}": array for i, array in enumerate(arrays)}
    file = io.BytesIO()
    npz.write(file, named)
    file.seek(0)
    with np.load(file, allow_pickle=False) as back:
        assert list(back) == list(named)
        for key, array in named.items():
            assert back[key].dtype == array.dtype
            assert back[key].shape == array.shape
            assert back[key].tobytes() == array.tobytes()


def test_an_unzip_finds_its_checksums_right_and_members_stored():
    file = io.BytesIO()
    npz.write(file, {"t": np.arange(3.0), "frames": np.ones((3, 4, 5), np.uint16)[:, ::2]})
    with zipfile.ZipFile(file) as archive:
        assert archive.testzip() is None
        assert [m.compress_type for m in archive.infolist()] == [zipfile.ZIP_STORED] * 2
        assert archive.infolist()[0].date_time == (1980, 1, 1, 0, 0, 0)


def test_a_header_is_numpys_own_but_for_its_trailing_comma():
    ours = npz.npy_header(np.zeros((3, 4), np.uint16))
    assert len(ours) % 64 == 0
    assert np.lib.format.read_magic(stream := io.BytesIO(ours)) == (1, 0)
    assert np.lib.format.read_array_header_1_0(stream) == ((3, 4), False, np.dtype("<u2"))


def test_a_file_beyond_zip_without_zip64_is_refused(monkeypatch):
    monkeypatch.setattr(npz, "LARGEST", 3000)
    with pytest.raises(ValueError, match="4 GB"):
        npz.write(io.BytesIO(), {"t": np.zeros(1000)})
