"""Reading a map of touch: `tests.edge.output.test_touch_map` reads what runs have
written."""

import pytest

from edge.errors import InputError
from train.touch_map import TouchMap

HEAD = '{"event": "map", "frame": "a", "unit": "metre", "tasks": ["mobility"]}\n'
PLACED = (
    '{"event": "decision", "contact": 1, "onset_s": 0.5, "place": [0.1, 0.2, 0.3], '
)


def test_a_contact_comes_once_all_of_its_tasks_are_decided(tmp_path):
    path = tmp_path / "map.jsonl"
    path.write_text(
        HEAD + PLACED + '"task": "mobility", "label": null, "confidence": 0.5}\n'
    )
    (touch,) = TouchMap(path)
    assert touch.position == (0.1, 0.2, 0.3)
    assert touch.onset_s == 0.5
    assert touch.labels == {"mobility": None}
    assert touch.confidence == {"mobility": 0.5}


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "not a map"),
        ("[1]\n", "not a map"),
        ("hello\n", "not a map"),
        ('{"event": "decision"}\n', "line 1: not of a map"),
        ('{"event": "map", "frame": "a", "unit": "metre"}\n', "line 1: not of a map"),
        (
            HEAD + PLACED + '"task": "mobility", "label": "fixed"}\n',
            "line 2: not of a map",
        ),
        (
            HEAD + PLACED + '"task": "a", "label": "b", "confidence": 2}\n',
            "line 2: not of a map: a confidence of 2; ",
        ),
        (
            '{"event": "map", "frame": "a", "unit": "metre", "tasks": []}\n'
            '{"event": "map", "frame": "b", "unit": "metre", "tasks": []}\n',
            "line 2 begins a run in the frame b",
        ),
    ],
)
def test_what_is_not_a_map_is_named(tmp_path, text, sentence):
    path = tmp_path / "some.jsonl"
    path.write_text(text)
    with pytest.raises(InputError, match=sentence):
        list(TouchMap(path))
