"""Ready-made settings: named, by a time, by an accuracy."""

import json

import pytest

from edge.errors import InputError
from train.tradeoff.front import NAMES, SHIPPED, ParetoFront

POINTS = [(100, 0.60), (200, 0.80), (900, 0.90)]


def text(points=POINTS, **more):
    return json.dumps({
        "task": "object",
        "points": [
            {"window_s": ms / 1000, "features": ["max_force"], "scaling": "III",
             "milliseconds": ms, "accuracy": accuracy}
            for ms, accuracy in points
        ],
    } | more)  # fmt: skip


@pytest.fixture
def front(tmp_path):
    def make(content):
        path = tmp_path / "front.json"
        path.write_text(content)
        return path

    return make


def test_the_points_come_fastest_first(front):
    read = ParetoFront.read(front(text(POINTS[::-1])))
    assert read.task == "object"
    assert [(p.milliseconds, p.accuracy) for p in read.points] == POINTS


@pytest.mark.parametrize(
    ("wanted", "milliseconds"),
    [
        ("fast", 100),
        ("accurate", 900),
        ("balanced", 200),  # 2/3 of the accuracy for 1/8 of the time
        ("200", 200),
        ("899.5", 200),
        ("900", 900),
        ("0.6", 100),
        ("0.61", 200),
        ("0.9", 900),
    ],
)
def test_a_point_is_chosen_by_name_by_time_or_by_accuracy(front, wanted, milliseconds):
    assert ParetoFront.read(front(text())).pick(wanted).milliseconds == milliseconds


@pytest.mark.parametrize(
    ("wanted", "said"),
    [
        ("99", "the fastest point takes 100 ms"),
        ("0.95", "the most accurate point reaches 0.900"),
        ("quick", "must be fast, balanced, accurate"),
        ("nan", "not 'nan'"),
        ("inf", "not 'inf'"),
        ("-1", "not '-1'"),
        ("0", "not '0'"),
    ],
)
def test_a_wish_that_no_point_fulfils_is_one_sentence(front, wanted, said):
    with pytest.raises(InputError, match="--front") as caught:
        ParetoFront.read(front(text())).pick(wanted)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("[]", "not a front.json"),
        ("{", "not a front.json"),
        ("[" * 100_000, "not a front.json"),
        (text(points=[]), "no point to choose from"),
        (text().replace("III", "VII"), "no point to choose from"),
        (text().replace("0.6,", '"much",').replace("0.6}", '"much"}'), "not a front.json"),
    ],
)
def test_a_damaged_file_is_one_sentence(front, content, said):
    with pytest.raises(InputError, match=r"front\.json: ") as caught:
        ParetoFront.read(front(content))
    assert said in str(caught.value)


def test_the_shipped_front_offers_every_name():
    chosen = [ParetoFront.read(SHIPPED).pick(name) for name in NAMES]
    assert [p.milliseconds for p in chosen] == sorted(p.milliseconds for p in chosen)
    assert [p.accuracy for p in chosen] == sorted(p.accuracy for p in chosen)
