"""Trials taught to a model on the board."""

from dataclasses import replace

import numpy as np
import pytest

from edge.model.model import Model
from edge.model.verify import first_series
from edge.recording import load, save

ALL_TAXELS = np.full((1, 16, 24), 8, np.uint16)


@pytest.fixture
def teach(edge, exported, tmp_path):
    """Teach the exported model; returns status, the lines and stderr."""

    def run(*recordings):
        given = ["--model", exported / "model.onnx", "--out", tmp_path / "taught"]
        return edge("teach", *given, *recordings)

    return run


def labelled(touch, **labels):
    return replace(touch, meta={**touch.meta, "labels": labels})


def test_a_taught_trial_is_known_again_and_the_new_files_agree(
    teach, edge, exported, make_touch, tmp_path
):
    save(tmp_path / "cup.npz", labelled(make_touch(seed=70), category="soft-fixed", object="cup"))
    status, lines, messages = teach(tmp_path / "cup.npz")
    assert status == 0
    assert {line["task"]: line["trials"] for line in lines} == {"category": 1, "object": 0}
    assert "its accuracy is not measured, and no error rate is certified" in messages
    before = Model(exported / "model.onnx")
    after = Model(tmp_path / "taught" / "model.onnx")
    assert (after.info.rows, after.info.taught) == (17, 1)
    assert after.info.trials[-1:] == ("cup",)
    _, series = first_series(load(tmp_path / "cup.npz"), after)
    vector = after.info.vector(series)
    decision = after.decide(vector)["category"]
    assert (decision.neighbours[0], decision.distances[0]) == (16, 0.0)
    # No label of its object is known, so the answers about objects are what they were.
    assert (
        after.decide(vector)["object"].distances == before.decide(vector)["object"].distances
    ).all()
    golden = tmp_path / "taught" / "golden.npz"
    assert edge("verify", "--model", after.path, "--golden", golden)[0] == 0


def test_a_file_whose_name_is_no_text_can_be_taught(teach, make_touch, tmp_path):
    save(tmp_path / "cup.npz", labelled(make_touch(seed=70), category="soft-fixed"))
    (tmp_path / "cup.npz").rename(tmp_path / "c\udcff.npz")
    assert teach(tmp_path / "c\udcff.npz")[0] == 0
    assert Model(tmp_path / "taught" / "model.onnx").info.trials[-1] == r"c\udcff"


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (
            lambda t: labelled(t),
            "odd.npz: has no label that the model knows (category: rigid-fixed",
        ),
        (lambda t: labelled(t, object="cup"), "odd.npz: has no label that the model knows"),
        (lambda t: replace(t, frames=0 * t.frames), "odd.npz: holds no contact"),
        (
            lambda t: replace(t, frames=t.frames.max(axis=(1, 2), keepdims=True) * ALL_TAXELS),
            "odd.npz: lies far outside the trials that the model was fitted on",
        ),
    ],
)
def test_what_cannot_be_taught_is_one_sentence_and_writes_nothing(
    change, sentence, teach, make_touch, tmp_path
):
    save(tmp_path / "odd.npz", change(make_touch(seed=1)))
    status, _, messages = teach(tmp_path / "odd.npz")
    assert (status, sentence in messages) == (2, True), messages
    assert not (tmp_path / "taught").exists()
