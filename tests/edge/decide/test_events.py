"""Events as values, and as lines of JSON."""

import json
import math

from edge.decide.events import Decided, Release, json_line


def test_an_event_is_what_a_line_of_json_says():
    decided = Decided(
        "t",
        "a",
        0.5,
        1.2,
        0.25,
        0.3,
        ("forced",),
        error=0.1,
        stopped_by="window",
        contact=2,
    )
    assert decided.to_dict() == {
        "event": "decision",
        "contact": 2,
        "task": "t",
        "label": "a",
        "confidence": 0.5,
        "flags": ["forced"],
        "position": None,
        "onset_s": 0.25,
        "window_s": 1.2,
        "latency_ms": 0.3,
        "error": 0.1,
        "stopped_by": "window",
    }
    release = {"event": "release", "contact": 2, "onset_s": 0.25, "released_s": 2.5}
    assert Release(0.25, 2.5, contact=2).to_dict() == release


def test_a_line_is_ascii_and_json_whatever_a_label_holds():
    label = "a\u001b[2J\u202e\u2028\ud800\u0085é"
    line = json_line({"label": label, "confidence": math.nan, "list": [math.inf, 1.0]})
    assert line.isascii()
    assert line.isprintable()
    assert json.loads(line) == {"label": label, "confidence": None, "list": [None, 1.0]}
