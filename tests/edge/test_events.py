"""Events as values, and as lines of JSON."""

from __future__ import annotations

import json
import math
from dataclasses import FrozenInstanceError

import pytest

from edge.events import Decided, Onset, Release, json_line

DECIDED = Decided("mobility", "fixed", 0.75, 1.2, 0.25, 0.3, ("tie",))


@pytest.mark.parametrize("event", [Onset(0.25), DECIDED, Release(0.25, 1.5)])
def test_an_event_is_frozen_and_its_line_says_what_it_is(event):
    with pytest.raises(FrozenInstanceError):
        event.onset_s = 0.0
    assert event.to_dict()["event"] == {"Decided": "decision"}.get(
        type(event).__name__, type(event).__name__.lower()
    )
    assert event.to_dict()["onset_s"] == 0.25


def test_a_decisions_line_has_what_was_asked_for_alone():
    line = {
        "event": "decision",
        "window_s": 1.2,
        "onset_s": 0.25,
        "task": "mobility",
        "label": "fixed",
        "confidence": 0.75,
        "latency_ms": 0.3,
        "flags": ["tie"],
    }
    assert DECIDED.to_dict() == line


def test_a_line_is_ascii_and_json_whatever_a_label_holds():
    label = "a\u001b[2J\u202e\u2028\ud800\u0085é"
    line = json_line({"label": label, "confidence": math.nan, "list": [math.inf, 1.0]})
    assert line.isascii()
    assert line.isprintable()
    assert json.loads(line) == {"label": label, "confidence": None, "list": [None, 1.0]}
