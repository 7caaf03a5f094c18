"""Constants of a model's neighbours, and labels that follow."""

import numpy as np

from edge.model import onnx_file
from edge.model.model import Model
from edge.model.teaching import joined, label_tables, nearest_of_label


def test_a_twentieth_of_a_labels_trials_stand_for_it_but_three_if_there_are():
    assert nearest_of_label(np.array([0, 2, 3, 59, 61, 100])).tolist() == [0, 2, 3, 3, 4, 5]


def test_the_tables_of_labels_name_the_trials_of_each():
    tables = label_tables(np.array([1, -1, 0, 1]), 2)
    assert tables["members"].tolist() == [[2, 4], [0, 3]]
    assert (tables["counts"].tolist(), tables["most"].tolist()) == ([1.0, 2.0], [2])
    assert tables["taken"].tolist() == [[True, False], [True, True]]


def test_labels_follow_from_a_category_and_the_reverse():
    whole = {"category": "soft-fixed", "softness": "soft", "mobility": "fixed"}
    assert joined({"category": "soft-fixed"}) == whole
    assert joined({"softness": "soft", "mobility": "fixed"}) == whole
    assert joined({"category": "none", "object": "cup"}) == {"category": "none", "object": "cup"}


def test_a_file_that_is_rewritten_without_a_change_keeps_its_bytes(exported, tmp_path):
    data = (exported / "model.onnx").read_bytes()
    contents = onnx_file.read(data, "model")
    assert onnx_file.rewritten(data, {}, {}) == data
    same = {name: contents.constant(name) for name in ("columns of category", "columns of object")}
    again = onnx_file.rewritten(data, same, {})
    (tmp_path / "model.onnx").write_bytes(again)
    assert len(again) == len(data)
    model = Model(tmp_path / "model.onnx")
    vectors = np.random.default_rng(0).normal(size=(5, model.info.width))
    before = Model(exported / "model.onnx").run(vectors)
    assert all((values == before[key]).all() for key, values in model.run(vectors).items())
