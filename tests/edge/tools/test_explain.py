"""`edge-classify explain`: the nearest trials by name, the features' pulls, the least
changes."""

from types import SimpleNamespace

import pytest

from edge.tools.explain import text


def test_a_program_gets_the_trials_by_name_and_the_parts(edge, exported, recordings):
    words = (exported / "model.onnx", recordings / "hard_0.npz")
    status, (category, about_object), _ = edge("explain", *words)
    assert status == 0
    assert about_object["task"] == "object"
    assert category["task"] == "category"
    assert category["label"] == "rigid-fixed"
    # The touch itself was trained with.
    assert category["nearest"][0]["trial"] == "hard_0"
    assert category["nearest"][0]["distance"] == pytest.approx(0.0, abs=1e-5)
    assert category["rival"]["trial"].startswith("soft_")
    assert category["rival"]["label"] == "soft-fixed"
    assert category["changes"][0]["label"] == "soft-fixed"


def test_a_person_gets_lines_that_fit(edge, exported, recordings, monkeypatch):
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    words = (exported / "model.onnx", recordings / "soft_1.npz")
    status, out, _ = edge("explain", *words, text=True)
    assert status == 0
    assert "category: soft-fixed, by " in out
    assert "  soft_1: soft-fixed\n" in out
    assert ": rigid-fixed\n  Features for (+) and against (-) soft-fixed, comp" in out
    assert "  It would be rigid-fixed if " in out
    assert max(map(len, out.splitlines()[1:])) <= 80


@pytest.mark.parametrize(
    ("mean", "unit", "sentence"),
    [
        (-2.0, "taxel", "It would be soft if area were lower by 2 taxels."),
        (2.0, "radian/s", "It would be soft if area were higher by 2 radian/s."),
        (0.5, "1", "It would be soft if area varied in another way, by 2 on average."),
    ],
)
def test_a_change_is_a_sentence(mean, unit, sentence):
    change = {"feature": "area", "label": "soft", "size": 2.0, "mean": mean}
    line = {"task": "t", "label": "hard", "votes": 1.0, "nearest": [], "rival": None}
    info = SimpleNamespace(units={"area": unit})
    assert text({**line, "changes": [change]}, info).endswith(f"  {sentence}")


def test_a_recording_without_contact_is_one_sentence(exported, quiet, refused):
    err = refused("explain", exported / "model.onnx", quiet)
    assert "quiet.npz: holds no contact; leave it out" in err
