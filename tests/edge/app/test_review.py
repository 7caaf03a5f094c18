"""What asks for a look at a touch, and its time series in a few numbers."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from edge.app import review
from edge.errors import InputError
from edge.record.labels import Standing
from tests.edge.app.kept import kept_meta

HALVES = {"softness": "soft", "mobility": "fixed"}


@pytest.mark.parametrize(
    ("meta", "kinds"),
    [
        (kept_meta({"a": "x"}, a=("x", 0.8)), []),
        (kept_meta({"a": "x"}, a=("x", 0.79)), ["unsure"]),
        (kept_meta({"a": "x"}, a=("x", None)), ["unsure"]),
        (kept_meta({"a": "x"}, a=("x", 0.9, "forced")), ["unsure"]),
        (kept_meta({"a": "x"}, a=("x", 0.9, "unknown")), ["unsure"]),
        (kept_meta({"a": "y"}, a=("x", 0.9)), ["wrong"]),
        (kept_meta({"b": "z"}, a=("x", 0.9)), ["unlabelled"]),
        # A category follows from softness and mobility.
        (kept_meta(HALVES, category=("soft-fixed", 0.9)), []),
        (kept_meta(HALVES, category=("rigid-fixed", 0.9)), ["wrong"]),
        ({"labels": {}}, ["unlabelled"]),
        ({"labels": {"a": "x"}}, []),
        ({"labels": {"a": "x"}, "decided": 5}, []),
    ],
)
def test_a_touch_is_unsure_wrong_or_unlabelled(meta, kinds):
    assert review.kinds(meta, meta["labels"]) == kinds


JOINT = {"category": ("rigid-fixed", 0.9), "mobility": ("fixed", 0.9)}


@pytest.mark.parametrize(
    ("answers", "labels", "accepted"),
    [
        ({"a": ("x", 0.9), "b": ("unknown", 0.9), "c": (None, None)}, {}, {"a": "x"}),
        ({"a": ("x", 0.9), "b": ("z", 0.9)}, {"a": "y"}, {"b": "z"}),
        (JOINT, HALVES, {}),
        (JOINT, {"softness": "soft"}, {"mobility": "fixed"}),
    ],
)
def test_what_is_accepted_is_known_and_contradicts_no_label(answers, labels, accepted):
    assert review.accepted(kept_meta({}, **answers), labels) == accepted


def touched(meta, labels):
    return review.Touch(Path("a.npz"), meta, Standing(labels), "a.npz")


def test_a_recording_is_selected_by_its_kinds_tasks_and_labels():
    touch = touched(kept_meta({}, a=("x", 0.5)), {"b": "z"})
    assert touch.words == {"unsure", "unlabelled", "a", "b", "b=z"}
    assert review.selected([touch], ["unsure", "a", "b=z"]) == [touch]
    assert review.selected([touch], ["left_out", "b=anything"]) == []
    with pytest.raises(InputError, match="unlabelled, left_out, a, b, or TASK=LABEL"):
        review.selected([touch], ["unsur"])


def test_a_course_is_in_percent_of_its_highest_and_misses_no_peak(make_touch):
    touch = make_touch()
    frames = np.zeros_like(touch.frames)
    frames[7, 2, 3] = 400
    frames[-1, 0, 0] = 100
    time_series = review.curve(replace(touch, frames=frames))
    assert len(time_series) == 32
    assert max(time_series) == 100
    assert time_series[-1] == 25
    assert review.curve(replace(touch, frames=0 * frames)) == [0] * 32


@pytest.mark.parametrize(
    "answer",
    [
        {"label": "box", "confidence": "high"},
        {"label": "box", "flags": 5},
        {"label": "box", "flags": [1]},
        {"label": ["box"]},
        {"confidence": 0.9},
        "box",
    ],
)
def test_what_is_no_decision_is_left_out(answer):
    meta = {"decided": {"object": answer}}
    assert review.decisions(meta) == {}
    assert review.kinds(meta, {}) == ["unlabelled"]
