"""Frames of any numbers are counts, or a sentence says how to make them so."""

import numpy as np
import pytest

from edge.errors import InputError
from edge.record.counts import as_counts
from edge.record.recording import Recording, load
from edge.record.saving import save


@pytest.mark.parametrize(
    ("value", "sentence"),
    [
        (
            1.5,
            r"frames are float64 up to 1.5, with fractions.*scale=10000\), with the ",
        ),
        (
            70000,
            r"frames are int64 up to 70000;.*scale=0.1\), with the same scale for all",
        ),
        (
            -3,
            "go down to -3, but counts are above baseline: subtract the frame before ",
        ),
        (np.nan, "mark the taxels in `valid`"),
    ],
)
def test_what_is_no_count_is_refused_with_the_remedy(value, sentence):
    with pytest.raises(InputError, match=sentence):
        as_counts(np.full((2, 3, 4), value), None)


def test_half_precision_holds_counts_without_a_warning(recwarn):
    frames = np.full((2, 3, 4), 2048.0, np.float16)
    assert (as_counts(frames, None) == 2048).all()
    assert len(recwarn) == 0


def test_other_units_are_scaled_by_the_factor_that_is_given_and_kept(tmp_path):
    newtons = np.array([0.0, 0.25, 1.0, 6.5]).reshape(4, 1, 1)
    recording = Recording(np.arange(4.0), newtons)
    save(tmp_path / "a.npz", recording, scale=1000.0)
    back = load(tmp_path / "a.npz")
    assert back.frames.ravel().tolist() == [0, 250, 1000, 6500]
    assert back.meta["scale"] == 1000.0
    for scale in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(InputError, match="scale must be a number above 0"):
            save(tmp_path / "b.npz", recording, scale=scale)
