"""Ready-made settings: named, by a time, by an accuracy."""

import json

import pytest

from edge.errors import InputError
from train.tradeoff.front import ParetoFront

DIGEST = "0" * 64
POINTS = [(100, 0.60), (200, 0.80), (901, 0.90)]


def text(points=POINTS, **more):
    content = {"task": "object", "data_digest": DIGEST, "quick": False, **more}
    content["points"] = [
        {"window_s": ms / 1000, "accuracy": a, "low": 0, "high": 1} for ms, a in points
    ]
    return json.dumps(content)


@pytest.fixture
def front(tmp_path):
    def make(content):
        path = tmp_path / "front.json"
        path.write_text(content)
        return path

    return make


@pytest.mark.parametrize(
    ("wish", "milliseconds"),
    [
        ("fast", 100),
        ("accurate", 901),
        ("balanced", 200),  # of windows within 0.9 s
        ("200", 200),
        ("0.61", 200),
    ],
)
def test_a_point_is_chosen_by_name_by_time_or_by_accuracy(front, wish, milliseconds):
    point = ParetoFront.read(front(text(POINTS[::-1])), DIGEST).pick(wish)
    assert point.window_s == milliseconds / 1000


@pytest.mark.parametrize(
    ("content", "wish", "message"),
    [
        (text(), "99", "--front.* the fastest point takes 100 ms"),
        (text(), "0.95", "--front.* the most accurate point reaches 0.900"),
        (text(), "quick", "--front.* must be fast, balanced, accurate"),
        (text(), "nan", "--front.* not 'nan'"),
        (text(), "0", "--front.* not '0'"),
        ("{", "fast", r"front\.json: not a front.json"),
        (text(points=[]), "fast", r"front\.json: .*points must be a list of tables"),
        (
            text().replace('"window_s": 0.1', '"window_s": -1'),
            "fast",
            r"front\.json: .*window_s must be a",
        ),
        (
            text(points=[(100, 60)]),
            "fast",
            r"front\.json: .*accuracy must be a number from 0 to 1, not 60",
        ),
        (
            text(data_digest="1" * 64),
            "fast",
            r"front\.json: .*was measured on other recordings",
        ),
    ],
)
def test_what_no_front_gives_is_one_sentence(front, content, wish, message):
    with pytest.raises(InputError, match=message):
        ParetoFront.read(front(content), DIGEST).pick(wish)
