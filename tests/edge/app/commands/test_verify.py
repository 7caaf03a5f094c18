"""`edge-classify verify`, as a user runs it."""

import numpy as np
import pytest


@pytest.fixture
def verify(exported, edge):
    command = ("verify", "--model", exported / "model.onnx", "--golden")
    return lambda golden: edge(*command, golden)


@pytest.fixture
def arrays(exported):
    """Those of the golden file."""
    return dict(np.load(exported / "golden.npz"))


@pytest.fixture
def verify_changed(verify, arrays, tmp_path):
    """Verify against the arrays as they are by then."""

    def run():
        np.savez(tmp_path / "golden.npz", **arrays)
        return verify(tmp_path / "golden.npz")

    return run


@pytest.mark.parametrize(
    ("key", "row", "change"),
    [
        ("object_label", 5, 1),
        ("object_distances", 30, 1e-9),
        ("series_counts", 11, 1),
        ("onset_s", 1, 1e-6),
    ],
)
def test_a_difference_names_its_row(verify_changed, arrays, key, row, change):
    name = {"series_counts": "series counts", "onset_s": "onset"}.get(key, key)
    arrays[key][row] += np.array(change).astype(arrays[key].dtype)
    status, checks, err = verify_changed()
    (failed,) = (check for check in checks if not check["passed"])
    assert status == 1
    assert failed["name"] == name
    assert failed["row"] == row
    assert f"results that differ from the golden file: {name}" in err


@pytest.mark.parametrize("key", ["vectors", "meta", "series_counts"])
def test_a_golden_file_that_lacks_a_key_is_one_sentence(verify_changed, arrays, key):
    del arrays[key]
    status, _, err = verify_changed()
    assert status == 2
    assert err.count("\n") == 1
    assert "golden.npz" in err


def test_vectors_of_another_model_are_refused(verify_changed, arrays):
    arrays["vectors"] = arrays["vectors"][:, :50]
    assert "50), but" in verify_changed()[2]


def test_frames_with_other_joints_are_refused_by_the_name_of_the_file(
    verify_changed, arrays
):
    arrays["joints"] = arrays["joints"][:, :3]
    assert "golden.npz: trial 0: has 3 joint angles" in verify_changed()[2]
