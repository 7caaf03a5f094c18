"""Constants of a model's neighbours, and labels that follow."""

from dataclasses import replace
from math import isqrt

import numpy as np
import pytest

from edge.errors import InputError
from edge.model.graph import Graph, coordinates_of
from edge.model.model import Model
from edge.tools.rewriting import rewritten
from edge.tools.teaching import (
    joined,
    label_tables,
    nearest_of_label,
    spelled_like,
    unknown_labels,
    with_labels,
    within_reach,
)


def test_a_twentieth_of_a_labels_trials_stand_for_it_but_three_if_there_are():
    sizes = np.array([0, 2, 3, 59, 61, 100])
    assert nearest_of_label(sizes).tolist() == [0, 2, 3, 3, 4, 5]


def test_the_tables_of_labels_name_the_trials_of_each():
    tables = label_tables(np.array([1, -1, 0, 1]), 2)
    assert tables["members"].tolist() == [[2, 4], [0, 3]]
    assert tables["counts"].tolist() == [1.0, 2.0]
    assert tables["most"].tolist() == [2]
    assert tables["taken"].tolist() == [[True, False], [True, True]]


def test_labels_follow_from_a_category_and_the_reverse():
    whole = {"category": "soft-fixed", "softness": "soft", "mobility": "fixed"}
    assert joined({"category": "soft-fixed"}) == whole
    assert joined({"softness": "soft", "mobility": "fixed"}) == whole
    unrelated = {"category": "none", "object": "cup"}
    assert joined(unrelated) == unrelated


def test_labels_that_are_not_known_are_counted_and_become_the_last_ones(model):
    tasks = {task: replace(e, k=5) for task, e in model.info.tasks.items()}
    info = replace(model.info, tasks=tasks)
    labels = [{"object": "mug"}, {"object": "cup"}, {"object": "mug", "lid": "x"}, {}]
    unknown = unknown_labels(info, [*labels, {"category": "soft-fixed"}])
    assert unknown == {"category": {}, "object": {"cup": 1, "mug": 2}}
    after = with_labels(info, unknown).tasks
    assert after["object"].labels == (*info.tasks["object"].labels, "cup", "mug")
    assert after["category"].k == 5
    assert after["object"].k == 1


def test_no_label_is_added_to_tasks_that_are_decided_together(model):
    info = model.info
    category = info.tasks["category"]
    factors = {"softness": (0, 1), "mobility": (0, 0)}
    pair = {
        "category": replace(category, factors=factors),
        "softness": replace(category, labels=("rigid", "soft")),
        "mobility": replace(category, labels=("fixed",)),
    }
    info = replace(info, tasks=pair)
    for task in pair:
        sentence = f"^{task} 'odd' is new, but each category is a pair"
        with pytest.raises(InputError, match=sentence):
            with_labels(info, {task: {"odd": 3}})
    assert with_labels(info, {"softness": {}}).tasks == pair


def test_a_misspelled_label_is_asked_about_and_another_one_is_not():
    assert spelled_like("tol box", ("cup", "tool box")) == "; did you mean 'tool box'?"
    assert spelled_like("blue cup", ("red cup", "tool box")) == ""


def test_a_file_that_is_rewritten_without_a_change_keeps_its_bytes(model, tmp_path):
    data = model.contents.data
    assert rewritten(data, {}, {}) == data
    constants = Graph(model.contents).constants
    names = ("columns of category", "columns of object")
    same = {name: constants[name] for name in names}
    path = tmp_path / "model.onnx"
    path.write_bytes(rewritten(data, same, {}))
    assert path.stat().st_size == len(data)
    vectors = np.random.default_rng(0).normal(size=(5, model.info.width))
    before = model.run(vectors)
    after = Model(path).run(vectors)
    assert all((values == before[key]).all() for key, values in after.items())


def test_a_row_is_taught_only_as_far_out_as_its_distances_are_exact(model):
    """The bound in whole numbers: a query at the corner of what it is clipped at, and a
    row as long as is accepted on the other side."""
    graph = Graph(model.contents)
    for task in model.info.tasks:
        clipped_at = graph.makers[coordinates_of(graph, task)].inputs[2]
        first = {"decision_point": np.array([0])}
        limit = int(graph.run([clipped_at], first)[0].item())
        components = graph.constants[f"columns of {task}"].shape[-2]
        row = np.zeros((len(model.decision_points_s), 1, components))
        row[:, 0, 0] = limit // 2
        assert within_reach(graph, task, row).tolist() == [True]
        assert (isqrt(components * limit**2) + 1 + limit // 2) ** 2 < 2**53
        row[:, 0, 0] += 1
        assert within_reach(graph, task, row).tolist() == [False]
