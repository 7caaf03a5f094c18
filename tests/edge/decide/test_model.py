"""A model file: what is refused, and what a decision says."""

import json
import re
from pathlib import Path

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper

from edge.decide.engines import ENGINES
from edge.decide.info import FORMAT, METADATA_KEY
from edge.decide.metadata import to_json
from edge.decide.metadata_reader import from_json
from edge.decide.model import Model
from edge.errors import InputError, OutOfRange
from tests.conftest import sealed


@pytest.fixture(scope="module")
def golden(exported):
    return np.load(exported / "golden.npz")


@pytest.fixture
def altered(exported, tmp_path):
    """Write the exported model with a change; returns the new path."""

    def write(change):
        proto = onnx.load(exported / "model.onnx")
        change(proto)
        path = tmp_path / "altered.onnx"
        path.write_bytes(sealed(proto))
        return path

    return write


def test_a_byte_that_changed_since_the_export_is_noticed(exported, tmp_path):
    data = bytearray((exported / "model.onnx").read_bytes())
    path = tmp_path / "damaged.onnx"
    for place in np.linspace(0, len(data) - 65, 20).astype(int):
        path.write_bytes(bytes([*data[:place], data[place] ^ 16, *data[place + 1 :]]))
        with pytest.raises(InputError, match="changed or damaged since its export"):
            Model(path)


def test_metadata_are_read_as_they_were_written(model):
    info = model.info
    assert to_json(from_json(to_json(info), "again")) == to_json(info)


def test_a_decision_is_the_graphs_answer(model, golden):
    labels = model.info.tasks["object"].labels
    for i, vector in enumerate(golden["vectors"][: len(golden["onset_s"])]):
        decision = model.decide(vector)["object"]
        assert decision.label == labels[golden["object_label"][i]]
        assert decision.votes == golden["object_scores"][i].max()
        assert decision.confidence is None  # not calibrated
        assert decision.neighbours.tolist() == golden["object_neighbours"][i].tolist()
        assert not decision.out_of_range


def test_a_value_far_outside_the_training_set_is_cut_off_and_flagged(model, golden):
    vector = golden["vectors"][0].copy()
    vector[39] = 1e290
    decision = model.decide(vector)["object"]
    assert decision.out_of_range
    vector[39] = 1e200
    assert (
        model.decide(vector)["object"].distances.tolist() == decision.distances.tolist()
    )
    vector[39] = 1.7e308  # which is infinite once it is scaled
    with pytest.raises(InputError, match="too large"):
        model.decide(vector)


@pytest.mark.parametrize("shape", [(119,), (121,), (1, 120), ()])
def test_a_vector_of_another_length_is_refused(model, shape):
    with pytest.raises(InputError, match="takes 120 features"):
        model.decide(np.zeros(shape))


def test_a_missing_model_and_a_folder_are_named(tmp_path):
    with pytest.raises(InputError, match="no such model; make one with `make export`"):
        Model(tmp_path / "none.onnx")
    with pytest.raises(InputError, match="cannot be read"):
        Model(tmp_path)


def no_metadata(proto):
    del proto.metadata_props[:]


def another_attribute(proto):
    proto.graph.node[0].attribute.append(helper.make_attribute("unheard_of", 1))


def another_input(proto):
    proto.graph.input.append(
        helper.make_tensor_value_info("more", TensorProto.DOUBLE, [1])
    )


def edited(edit):
    """The change of a model that edits its metadata."""

    def change(proto):
        entry = next(p for p in proto.metadata_props if p.key == METADATA_KEY)
        metadata = json.loads(entry.value)
        edit(metadata)
        entry.value = json.dumps(metadata) if metadata else "{"

    return change


def meta(**changes):
    return edited(lambda metadata: metadata.update(changes))


def category(**changes):
    return edited(lambda metadata: metadata["tasks"]["category"].update(changes))


REFUSED = {
    no_metadata: "no edge-classify metadata",
    another_input: "has an input more",
    edited(dict.clear): "its metadata: not JSON",
    meta(samples=30): "cannot be run",
    meta(arm=None): "motion frame contradicts its arm",
    meta(tasks={}): "no task",
    meta(features=["noise"], units={"noise": "1"}): "no feature 'noise'",
    edited(
        lambda m: m["features"].reverse()
    ): "task 'category' takes other features, or in another order",
    meta(trials=["a"]): "names 1 of 16 trials",
    edited(
        lambda m: m["tasks"]["category"]["labels"].append("liquid")
    ): "category_scores is float64 (1, 2)",
    edited(
        lambda m: m["tasks"].update(mobility=m["tasks"]["category"])
    ): "cannot be run",
    # Three objects would have one pair of labels.
    edited(
        lambda m: m["tasks"]["object"].update(
            factors={"category": [0, 0, 1, 1], "mobility": [0, 0, 0, 1]}
        )
    ): "task 'object' is not the joint task of its factors",
    category(
        components=10**9
    ): "task 'category' has 1000000000 components of 120 features",
    edited(
        lambda m: m.update(usual={name: [2.0, 1.0] for name in m["features"]})
    ): "usual.max_force must be two numbers that rise, not",
    meta(name="arm\n"): "its name, tasks, answers and trials must be printable",
    category(
        labels=["soft", "soft "]
    ): "category.labels must be a list of different, printable texts",
}


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("change", REFUSED, ids=REFUSED.values())
def test_a_model_that_is_not_ours_is_refused_in_one_sentence(change, engine, altered):
    path = altered(change)
    with pytest.raises(InputError, match=re.escape(REFUSED[change])) as caught:
        Model(path, engine)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_onnx_runtime_cannot_load_is_refused(altered):
    with pytest.raises(InputError, match="ONNX Runtime refuses it"):
        Model(altered(another_attribute), "onnxruntime")


RELEASED = Path(__file__).parents[2] / "golden" / "released"


@pytest.mark.parametrize(
    "path",
    sorted(RELEASED.glob("*.onnx")),
    ids=lambda path: path.stem,
)
def test_a_model_of_each_released_format_is_read_or_refused_with_the_remedy(path):
    """`format-N.onnx` stays here when format N is no longer written."""
    number = int(path.stem.removeprefix("format-"))
    if number == FORMAT:
        assert Model(path).info.tasks
        return
    with pytest.raises(InputError) as error:
        Model(path)
    assert str(error.value) == (
        f"{path}: its metadata is of format {number}, but this edge-classify reads "
        f"{FORMAT}; "
        "export it again"
    )


def test_a_graph_that_answers_a_row_with_a_scalar_is_refused(altered):
    def scalar(proto):
        node = next(n for n in proto.graph.node if "out_of_range" in n.output)
        node.CopyFrom(
            helper.make_node("ReduceSum", [node.input[0]], ["out_of_range"], keepdims=0)
        )
        output = next(x for x in proto.graph.output if x.name == "out_of_range")
        del output.type.tensor_type.shape.dim[:]

    with pytest.raises(InputError, match="out_of_range is float64 .*; copy or export"):
        Model(altered(scalar), "onnxruntime")


@pytest.mark.parametrize(
    ("shares", "tie"),
    [
        ([0.5, 0.25, 0.25, 0.0], False),
        ([0.25, 0.375, 0.375, 0.0], True),
    ],
)
def test_a_tie_is_of_two_labels_or_more_with_the_most_votes(
    model,
    monkeypatch,
    shares,
    tie,
):
    vector = np.zeros(model.info.width)
    outputs = model.run(vector[None])
    label = np.array([int(np.argmax(shares))])
    outputs |= {"object_scores": np.array([shares]), "object_label": label}
    monkeypatch.setattr(model, "run", lambda *arguments: outputs)
    decision = model.decide(vector)["object"]
    assert decision.tie == tie
    assert decision.votes == max(shares)


def test_a_vector_that_one_task_refuses_is_decided_for_none(model, golden, monkeypatch):
    outputs = model.run(golden["vectors"][:1])
    for task in model.info.tasks:
        refused = {**outputs, f"{task}_label": np.array([-1])}
        monkeypatch.setattr(model, "run", lambda *_, answer=refused: answer)
        with pytest.raises(OutOfRange, match="too large to be scaled"):
            model.decide(golden["vectors"][0])
