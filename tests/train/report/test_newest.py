"""What the newest trials changed is told where their times are known."""

import numpy as np
import pytest

from train.data.vectors import Vectors
from train.model.pipeline import Choice
from train.report import newest

FEW = [f"2026-11-{day:02d}" for day in range(1, 11)]


@pytest.fixture(autouse=True)
def a_few_are_newest(monkeypatch):
    monkeypatch.setattr(newest, "NEWEST", 3)


@pytest.mark.parametrize(
    ("times", "expected"),
    [
        (FEW, [False] * 7 + [True] * 3),
        (["", *FEW[:0:-1]], [False] + [True] * 3 + [False] * 6),
        (FEW[:5], None),  # more than half
        ([FEW[0]] * 10, None),  # all of one day
        ([*[""] * 8, *FEW[:2]], None),  # the third newest has no day
        ([*FEW[:8], "Monday", "Tuesday"], None),
    ],
)
def test_the_newest_are_told_by_their_times(times, expected):
    mask = newest.newest_of(times)
    assert (None if mask is None else mask.tolist()) == expected


def test_a_label_that_only_the_newest_have_is_wrong_without_them():
    rng = np.random.default_rng(0)
    labels = np.array([*"ab" * 40, *"c" * 20])
    centres = {"a": 0.0, "b": 10.0, "c": 20.0}
    X = rng.normal([[centres[label]] * 20 for label in labels])
    vectors = Vectors(X, {"object": labels}, ("max_force",), (20,))
    choice = Choice("none", components=1, k=1)
    right = newest.right_by(vectors, {"object": choice}, labels == "c")
    then, now = right["object"]
    assert now.all()
    assert then.tolist() == (labels != "c").tolist()
