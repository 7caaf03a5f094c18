"""Trials taught to a model on the board."""

from dataclasses import replace

import numpy as np
import pytest

from edge.model.model import Model
from edge.model.verify import first_series
from edge.recording import load
from edge.saving import save
from tests.conftest import decided


def everywhere(touch):
    """A touch that all taxels feel, eight times as strong."""
    peaks = touch.frames.max(axis=(1, 2), keepdims=True)
    return replace(touch, frames=np.broadcast_to(8 * peaks, touch.frames.shape))


@pytest.fixture
def teach(edge, exported, tmp_path):
    """Teach the exported model; returns status, the lines and stderr."""

    def run(*recordings):
        given = ["--model", exported / "model.onnx", "--out", tmp_path / "taught"]
        return edge("teach", *given, *recordings)

    return run


def of_tasks(lines, key="trials"):
    return {line["task"]: line[key] for line in lines}


def labelled(touch, **labels):
    return replace(touch, meta={**touch.meta, "labels": labels})


def test_a_taught_trial_is_known_again_and_the_new_files_agree(
    teach, edge, exported, make_touch, tmp_path
):
    touch = labelled(make_touch(seed=70), category="soft-fixed", object="cup")
    save(tmp_path / "cup.npz", touch)
    status, lines, messages = teach(tmp_path / "cup.npz")
    assert status == 0
    assert of_tasks(lines) == {"category": 1, "object": 0}
    left_out = "object: left out 1 trial of the new label 'cup'; --new-labels adds it\n"
    assert left_out in messages
    assert "its accuracy is not measured, and no error rate is certified" in messages
    before = Model(exported / "model.onnx")
    after = Model(tmp_path / "taught" / "model.onnx")
    assert after.info.rows == 17
    assert after.info.taught == 1
    assert after.info.trials[-1:] == ("cup",)
    _, series = first_series(load(tmp_path / "cup.npz"), after)
    vector = after.info.vector(series)
    decisions = after.decide(vector)
    assert decisions["category"].neighbours[0] == 16
    assert decisions["category"].distances[0] == 0.0
    # No label of its object is known, so the answers about objects are what they were.
    former = before.decide(vector)["object"].distances
    assert (decisions["object"].distances == former).all()
    golden = tmp_path / "taught" / "golden.npz"
    assert edge("verify", "--model", after.path, "--golden", golden)[0] == 0


def test_a_file_whose_name_is_no_text_can_be_taught(teach, make_touch, tmp_path):
    save(tmp_path / "cup.npz", labelled(make_touch(seed=70), category="soft-fixed"))
    (tmp_path / "cup.npz").rename(tmp_path / "c\udcff.npz")
    assert teach(tmp_path / "c\udcff.npz")[0] == 0
    assert Model(tmp_path / "taught" / "model.onnx").info.trials[-1] == r"c\udcff"


def test_a_new_object_is_taught_and_known_again_in_the_same_and_a_further_model(
    teach, edge, exported, make_touch, tmp_path
):
    names = ("cup 0", "cup 1", "cup 2", "mug")
    recordings = [tmp_path / f"{name}.npz" for name in names]
    for seed, path in enumerate(recordings):
        labels = {"category": "soft-movable", "object": path.stem.split()[0]}
        touch = make_touch(seed=70 + seed)
        save(path, labelled(replace(touch, frames=touch.frames // 3 * 4), **labels))
    status, lines, messages = teach("--new-labels", *recordings[:3])
    assert status == 0
    assert of_tasks(lines) == {"category": 3, "object": 3}
    new = {"category": {"soft-movable": 3}, "object": {"cup": 3}}
    assert of_tasks(lines, "new_labels") == new
    assert "object: 3 trials of the new label 'cup'\n" in messages
    assert "'soft-movable'; did you mean 'soft-fixed'?" not in messages
    model = tmp_path / "taught" / "model.onnx"
    before = Model(exported / "model.onnx")
    after = Model(model)
    for task, labels in new.items():
        known = before.info.tasks[task].labels
        assert after.info.tasks[task].labels == (*known, *labels)
    for path in recordings[:3]:
        _, series = first_series(load(path), after)
        decision = after.decide(after.info.vector(series))["object"]
        assert decision.label == "cup"
        assert len(decision.scores) == 5
    again = tmp_path / "again" / "model.onnx"
    given = ["--out", again.parent, "--new-labels", recordings[3]]
    assert edge("teach", "--model", model, *given)[0] == 0
    assert Model(again).info.tasks["object"].labels[-2:] == ("cup", "mug")
    for path in (model, again):
        golden = path.with_name("golden.npz")
        assert edge("verify", "--model", path, "--golden", golden)[0] == 0
        assert edge("explain", path, recordings[0])[0] == 0
        _, lines, _ = edge("run", "--model", path, "--fake", recordings[0])
        assert decided(lines, "task") == ["category", "object"]
        assert decided(lines, "label")[1] == "cup"


def test_a_label_spelled_like_a_known_one_is_asked_about(teach, make_touch, tmp_path):
    touch = labelled(make_touch(seed=71), category="sofft-fixed", object="hard 1")
    save(tmp_path / "x.npz", touch)
    sentence = "category: {}1 trial of the new label 'sofft-fixed'{}; did you mean 'soft-fixed'?\n"
    left_out = sentence.format("left out ", "; --new-labels adds it")
    assert left_out in teach(tmp_path / "x.npz")[2]
    assert sentence.format("", "") in teach(tmp_path / "x.npz", "--new-labels")[2]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (labelled, "odd.npz: has no label that the model knows (category: rigid-fixed"),
        (
            lambda t: labelled(t, object="sotf 1"),
            "label it, or teach it with --new-labels; did you mean 'soft 1'?",
        ),
        (lambda t: replace(t, frames=0 * t.frames), "holds no contact; leave it out"),
        (everywhere, "lies far outside the trials that the model was fitted on"),
    ],
)
def test_what_cannot_be_taught_is_one_sentence_and_writes_nothing(
    change, sentence, teach, make_touch, tmp_path
):
    save(tmp_path / "odd.npz", change(make_touch(seed=1)))
    status, _, messages = teach(tmp_path / "odd.npz")
    assert status == 2
    assert sentence in messages
    assert not (tmp_path / "taught").exists()
