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

    command = (
        "teach",
        "--model",
        exported / "model.onnx",
        "--out",
        tmp_path / "taught",
    )
    return lambda *words: edge(*command, *words)


@pytest.fixture
def taught(tmp_path):
    """The path of the model that `teach` writes."""
    return tmp_path / "taught" / "model.onnx"


def of_tasks(lines, key="trials"):
    return {line["task"]: line[key] for line in lines}


def labelled(touch, **labels):
    return replace(touch, meta={**touch.meta, "labels": labels})


@pytest.fixture
def cup(make_touch, tmp_path):
    """The path of a touch whose object the model does not know."""
    touch = labelled(make_touch(seed=70), category="soft-fixed", object="cup")
    save(tmp_path / "cup.npz", touch)
    return tmp_path / "cup.npz"


def test_a_trial_is_taught_for_the_tasks_whose_label_is_known(teach, cup, taught):
    status, lines, messages = teach(cup)
    assert status == 0
    assert of_tasks(lines) == {"category": 1, "object": 0}
    left_out = "object: left out 1 trial of the new label 'cup'; --new-labels adds it\n"
    assert left_out in messages
    assert "its accuracy is not measured, and no error rate is certified" in messages
    after = Model(taught).info
    assert after.rows == 17
    assert after.taught == 1
    assert after.trials[-1:] == ("cup",)


def decisions_about(path, model):
    """A model's decisions about a recording."""
    _, series = first_series(load(path), model)
    return model.decide(model.info.vector(series))


def test_a_taught_trial_is_known_again(teach, model, cup, taught):
    teach(cup)
    decisions = decisions_about(cup, Model(taught))
    assert decisions["category"].neighbours[0] == 16
    assert decisions["category"].distances[0] == 0.0
    # No label of its object is known, so the answers about objects are what they were.
    former = decisions_about(cup, model)["object"].distances
    assert (decisions["object"].distances == former).all()


def test_another_model_in_its_place_is_kept_and_named(teach, cup, touches, taught):
    golden = taught.with_name("golden.npz")
    _, _, messages = teach(cup)
    assert "is kept" not in messages
    former_model = taught.read_bytes()
    former_golden = golden.read_bytes()
    _, _, messages = teach("--new-labels", touches[0])
    assert f"{taught}: the model that was there is kept" in messages
    assert taught.read_bytes() != former_model
    assert taught.with_name("model.onnx.former").read_bytes() == former_model
    assert golden.with_name("golden.npz.former").read_bytes() == former_golden


def test_a_file_whose_name_is_no_text_can_be_taught(teach, cup, taught):
    path = cup.rename(cup.with_name("c\udcff.npz"))
    assert teach(path)[0] == 0
    assert Model(taught).info.trials[-1] == r"c\udcff"


@pytest.fixture
def touches(make_touch, tmp_path):
    """Recordings of three touches of a cup and of one of a mug, both soft and
    movable."""
    paths = [tmp_path / f"{name}.npz" for name in ("cup 0", "cup 1", "cup 2", "mug")]
    for seed, path in enumerate(paths):
        labels = {"category": "soft-movable", "object": path.stem.split()[0]}
        touch = make_touch(seed=70 + seed)
        save(path, labelled(replace(touch, frames=touch.frames // 3 * 4), **labels))
    return paths


@pytest.fixture
def with_cup(teach, touches, taught):
    """The path of a model that was taught the cup."""
    assert teach("--new-labels", *touches[:3])[0] == 0
    return taught


@pytest.fixture
def with_mug(edge, with_cup, touches, tmp_path):
    """The path of the same that was then taught the mug."""
    path = tmp_path / "with mug" / "model.onnx"
    options = ["--out", path.parent, "--new-labels", touches[3]]
    assert edge("teach", "--model", with_cup, *options)[0] == 0
    return path


def test_new_labels_are_counted_and_named(teach, touches):
    status, lines, messages = teach("--new-labels", *touches[:3])
    assert status == 0
    assert of_tasks(lines) == {"category": 3, "object": 3}
    new = {"category": {"soft-movable": 3}, "object": {"cup": 3}}
    assert of_tasks(lines, "new_labels") == new
    assert "object: 3 trials of the new label 'cup'\n" in messages
    assert "'soft-movable'; did you mean 'soft-fixed'?" not in messages


def test_a_new_object_is_known_again(with_cup, touches):
    model = Model(with_cup)
    for path in touches[:3]:
        decision = decisions_about(path, model)["object"]
        assert decision.label == "cup"
        assert len(decision.scores) == 5


def test_every_command_takes_a_model_with_new_labels(with_mug, edge, touches):
    golden = with_mug.with_name("golden.npz")
    assert edge("verify", "--model", with_mug, "--golden", golden)[0] == 0
    assert edge("explain", with_mug, touches[0])[0] == 0
    _, lines, _ = edge("run", "--model", with_mug, "--fake", touches[0])
    assert decided(lines, "task") == ["category", "object"]
    assert decided(lines, "label")[1] == "cup"


def test_a_label_spelled_like_a_known_one_is_asked_about(teach, make_touch, tmp_path):
    path = tmp_path / "x.npz"
    save(path, labelled(make_touch(), category="sofft-fixed", object="hard 1"))
    label = "1 trial of the new label 'sofft-fixed'"
    question = "; did you mean 'soft-fixed'?\n"
    left_out = f"category: left out {label}; --new-labels adds it{question}"
    assert left_out in teach(path)[2]
    assert f"category: {label}{question}" in teach(path, "--new-labels")[2]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (labelled, "cup.npz: has no label that the model knows (category: rigid-fixed"),
        (
            lambda t: labelled(t, object="sotf 1"),
            "label it, or teach it with --new-labels; did you mean 'soft 1'?",
        ),
        (lambda t: replace(t, frames=0 * t.frames), "cup.npz: holds no contact"),
        (everywhere, "cup.npz: lies far outside the trials that the model was fitted"),
    ],
)
def test_what_cannot_be_taught_is_one_sentence_and_writes_nothing(
    change,
    sentence,
    teach,
    cup,
    taught,
):
    save(cup, change(load(cup)))
    status, _, messages = teach(cup)
    assert status == 2
    assert sentence in messages
    assert not taught.parent.exists()
