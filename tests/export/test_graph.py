"""The ONNX graph against the estimators it was made from, and against exact arithmetic."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import onnx
import pytest

from edge.model.info import ModelInfo, Task
from edge.model.model import EXACT_REACH, Model
from edge.touch.features import FEATURES
from edge.touch.layout import SkinLayout
from edge.touch.track import TrackSettings
from export import graph
from train.pipeline import Choice, ContactClassifier, vote
from train.projection import HALF_BITS
from train.scaling import SCALINGS


def features(n, seed=0):
    rng = np.random.default_rng(seed)
    X = rng.gamma(2.0, size=(n, 120))
    X[:, 40:80] *= 30
    X[:, 80:] *= 0.02
    return X


@pytest.fixture
def export(tmp_path):
    """Fit and export; returns the classifier and the loaded model."""

    def run(X, choices, labels=5, seed=0):
        rng = np.random.default_rng(seed)
        y = {t: np.array([f"o{i:02d}" for i in rng.integers(0, labels, len(X))]) for t in choices}
        fitted = ContactClassifier(choices).fit(X, y)
        tasks = {
            t: Task(tuple(fitted.classes_[t]), c.k, fitted.components_[t], c.scaling, 0.5)
            for t, c in choices.items()
        }
        info = ModelInfo(
            tasks=tasks,
            layout=SkinLayout(16, 24, True),
            tracking=TrackSettings(),
            window_s=1.2,
            samples=40,
            features=FEATURES,
            units={},
            motion_frame="skin",
            chain=None,
            rows=len(X),
            data_digest="",
        )
        path = tmp_path / "model.onnx"
        path.write_bytes(graph.to_onnx(fitted, info))
        return fitted, Model(path)

    return run


def differences(fitted, model, queries):
    """The graph's outputs that are not the estimators' answers.

    Distances may differ by 1e-14 of the largest; all else is equal.
    """
    answers, wrong = model.run(queries), []
    for task in fitted.choices:
        distances, rows = fitted.neighbours(task, queries)
        winners, shares = vote(fitted.labels_[task][rows], len(fitted.classes_[task]))
        expected = {"neighbours": rows, "label": winners, "scores": shares}
        wrong += [
            f"{task}_{part}"
            for part, values in expected.items()
            if not np.array_equal(answers[f"{task}_{part}"], values)
        ]
        gap = np.abs(answers[f"{task}_distances"] - distances).max()
        if not gap <= 1e-14 * distances.max():
            wrong.append(f"{task}_distances")
    return wrong


def test_the_board_knows_how_far_the_projection_is_exact():
    assert EXACT_REACH == 2.0**HALF_BITS


@pytest.mark.parametrize("scaling", SCALINGS)
def test_every_scaling_agrees_with_the_estimators(export, scaling):
    X = features(60)
    fitted, model = export(X, {"t": Choice(scaling, 7, 3)})
    assert differences(fitted, model, np.concatenate([X, features(40, seed=1)])) == []


@pytest.mark.parametrize("k", [1, 2, 3, 4, 7, 8, 40])
def test_every_number_of_voters_agrees_down_to_the_last_tie(export, k):
    X = features(40)
    fitted, model = export(X, {"t": Choice("IV", 3, k)})
    assert differences(fitted, model, features(100, seed=1)) == []


def test_several_tasks_share_what_they_share(export):
    X = features(50)
    choices = {
        "a": Choice("IV", 20, 2),
        "b": Choice("IV", 3, 4),
        "c": Choice("none", 7, 1),
        "d": Choice("IV", 20, 5),
    }
    fitted, model = export(X, choices)
    assert differences(fitted, model, np.concatenate([X, features(40, seed=1)])) == []
    proto = onnx.load(model.path)
    operators = [n.op_type for n in proto.graph.node]
    # Two projections of two products each; three distinct neighbour searches.
    assert operators.count("MatMul") == 4
    assert operators.count("CumSum") == 2
    assert operators.count("TopK") == 3
    assert [o.domain for o in proto.opset_import] == [""]


@pytest.mark.parametrize("n", [100, 1400])
def test_a_query_that_equals_a_training_row_lies_at_distance_zero(export, n):
    X = features(n)
    _, model = export(X, {"t": Choice("IV", 20, 3)})
    for queries in (X[:64], X[5:6]):
        answer = model.run(queries)
        assert not answer["t_distances"][:, 0].any()
    assert (model.run(X)["t_neighbours"][:, 0] == np.arange(n)).all()


@pytest.mark.parametrize("n", [100, 1400])
def test_one_at_a_time_or_all_at_once_gives_the_same_bits(export, n):
    X = features(n)
    _, model = export(X, {"t": Choice("II", 20, 4)})
    queries = features(50, seed=3)
    together = model.run(queries)
    for i in range(50):
        for name, value in model.run(queries[i : i + 1]).items():
            assert value.tobytes() == together[name][i : i + 1].tobytes()


def exact_order(fitted, queries, k):
    """Neighbours by exact squared distances of the projected coordinates, ties to lower rows."""
    rows = [[Fraction(v) for v in r] for r in next(iter(fitted.rows_.values())).tolist()]
    found = []
    for q in fitted.project(next(iter(fitted.rows_)), queries).tolist():
        point = [Fraction(v) for v in q]
        squares = [sum((a - b) ** 2 for a, b in zip(r, point, strict=True)) for r in rows]
        found.append(sorted(range(len(rows)), key=lambda i: (squares[i], i))[:k])
    return np.array(found)


def test_near_duplicates_are_told_apart_by_the_exact_distances(export):
    base = features(8)
    jitter = 1e-7 * np.random.default_rng(1).normal(size=(160, 120))
    X = np.repeat(base, 20, axis=0) * (1 + jitter)
    fitted, model = export(X, {"t": Choice("none", 5, 6)})
    queries = np.repeat(base, 3, axis=0) * (
        1 + 1e-7 * np.random.default_rng(2).normal(size=(24, 120))
    )
    assert (model.run(queries)["t_neighbours"] == exact_order(fitted, queries, 6)).all()


def test_a_shortlist_that_may_be_too_narrow_measures_every_row(export):
    """Two hundred near-duplicates are all within float32's rounding of each other: the
    shortlist cannot hold them, its check fails, and the answer is still exact."""
    base = features(8)
    jitter = 1e-9 * np.random.default_rng(1).normal(size=(1600, 120))
    X = np.repeat(base, 200, axis=0) * (1 + jitter)
    assert len(X) >= graph.SHORTLIST_ROWS
    fitted, model = export(X, {"t": Choice("none", 5, 6)})
    assert differences(fitted, model, X[::100] * (1 + 1e-10)) == []


def test_clusters_a_little_larger_than_the_shortlist(export):
    """Float32 cannot order 40 near-duplicates, and the 30 it picks may lack the nearest: its
    own rounding must be allowed for in the check."""
    rng = np.random.default_rng(1)
    X = np.repeat(features(35), 40, axis=0)
    X *= 1 + 1e-5 * rng.normal(size=X.shape)
    fitted, model = export(X, {"t": Choice("none", 5, 6)})
    queries = X[::20] * (1 + 1e-6 * rng.normal(size=(70, 120)))
    _, rows = fitted.neighbours("t", queries)
    alone = [model.run(queries[i : i + 1])["t_neighbours"][0] for i in range(70)]
    assert (np.array(alone) == rows).all()


def test_without_its_check_the_shortlist_would_be_wrong(export, monkeypatch):
    """The guard is needed: taken away, near-duplicates get wrong neighbours."""
    base = features(8)
    jitter = 1e-9 * np.random.default_rng(1).normal(size=(1600, 120))
    X = np.repeat(base, 200, axis=0) * (1 + jitter)
    node = graph.Builder.node

    def always_sure(self, operator, inputs, output="", **attributes):
        if operator == "Less":
            return node(self, "LessOrEqual", [inputs[0], inputs[0]], output)
        return node(self, operator, inputs, output, **attributes)

    monkeypatch.setattr(graph.Builder, "node", always_sure)
    fitted, model = export(X, {"t": Choice("none", 5, 6)})
    _, rows = fitted.neighbours("t", X[::100])
    assert (model.run(X[::100])["t_neighbours"] != rows).any()


def test_a_shortlist_beside_the_direct_search(export, monkeypatch):
    X = features(1400)
    queries = np.concatenate([X[:100], features(100, seed=1), 50.0 * features(5, seed=2)])
    choices = {"t": Choice("IV", 20, 5)}
    _, short = export(X, choices)
    answers = short.run(queries)
    monkeypatch.setattr(graph, "SHORTLIST_ROWS", 10**9)
    _, direct = export(X, choices)
    expected = direct.run(queries)
    for part in ("label", "neighbours", "scores"):
        assert (answers[f"t_{part}"] == expected[f"t_{part}"]).all()


@pytest.mark.parametrize("scale", [1e-30, 1e-24, 1e18, 1e20, 1e60])
def test_a_shortlist_holds_at_sizes_whose_squares_float32_cannot_hold(export, scale):
    X = features(1400) * scale
    fitted, model = export(X, {"t": Choice("none", 5, 6)})
    queries = features(100, seed=1) * scale
    _, rows = fitted.neighbours("t", queries)
    alone = [model.run(queries[i : i + 1])["t_neighbours"][0] for i in range(100)]
    assert (np.array(alone) == rows).all()
    assert not model.run(X[:1])["t_distances"][:, 0].any()


def test_nearly_as_many_voters_as_rows_need_no_shortlist(export):
    X = features(1400)
    fitted, model = export(X, {"t": Choice("none", 5, 1400)})
    assert differences(fitted, model, X[:2]) == []


@pytest.mark.parametrize(("n", "k"), [(40, 3), (1400, 3), (40, 40), (1400, 1400)])
def test_the_trial_after_the_neighbours_is_told_too(export, n, k):
    """Infinitely far where every trial is a neighbour."""
    X = features(n)
    queries = features(5, seed=1)
    fitted, model = export(X, {"t": Choice("IV", 6, k), "u": Choice("IV", 6, 2)})
    squares = np.sort(fitted.squares("t", queries), axis=1)
    beyond = np.sqrt(squares[:, k]) if k < n else np.full(5, np.inf)
    assert model.run(queries)["t_next"].ravel().tolist() == beyond.tolist()
    assert model.run(queries)["u_next"].ravel().tolist() == np.sqrt(squares[:, 2]).tolist()


def test_the_reach_is_the_length_of_the_largest_difference_in_units_of_its_grid(export):
    X = features(60)
    fitted, model = export(X, {"t": Choice("IV", 6, 3), "u": Choice("none", 6, 3)})
    queries = 1e3 * features(20, seed=1)
    lengths = [
        np.linalg.norm((queries - p.mean_) * p.gain_, axis=1) / p.grid_.unit
        for p in fitted.projections_.values()
    ]
    np.testing.assert_allclose(model.run(queries)["reach"], np.max(lengths, axis=0), rtol=1e-12)


@pytest.mark.parametrize("k", [1, 2, 5])
def test_a_decision_is_close_where_two_trials_are_equally_far(export, k):
    X = features(40)
    fitted, model = export(X, {"t": Choice("none", 20, k)})
    first, second = np.argsort(fitted.squares("t", X[:1])[0])[:2]
    middle, way = (X[first] + X[second]) / 2.0, X[second] - X[first]
    shares = (-1e-9, 0.0, 1e-9)
    found = [model.decide(middle + share * way)["t"].close for share in shares]
    assert found == [False, True, False]


def test_what_lies_beyond_the_first_trial_without_a_vote_is_not_asked(export):
    X = features(40)
    X[1:3] = X[0] + np.outer([0.5, -0.5], np.eye(120)[0])  # 1 and 2 are equally far from 0
    _, model = export(X, {"t": Choice("none", 20, 1), "u": Choice("none", 20, 3)})
    assert not model.decide(X[0])["t"].close
    assert model.decide(X[0])["u"].close


def test_equal_trials_are_close(export):
    X = features(40)
    X[7] = X[3]
    _, model = export(X, {"t": Choice("IV", 6, 1)})
    assert model.decide(X[3])["t"].neighbours.tolist() == [3]
    assert [model.decide(X[i])["t"].close for i in (2, 3, 7)] == [False, True, True]


def test_far_outside_the_training_range_less_is_told_apart(export):
    """Where sums round too, so that the order of distances is that of their rounding."""
    X = features(40)
    fitted, model = export(X, {"t": Choice("none", 6, 3)})
    length = np.linalg.norm(X[0] - X[1])
    across = np.linalg.svd(next(iter(fitted.projections_.values())).weights_.T)[2][-1]
    query = X[0] + 1e-3 * (X[1] - X[0])
    assert model.run((query + 1e3 * length * across)[None])["reach"][0] > EXACT_REACH
    near = [model.decide(query + far * length * across)["t"].close for far in (0, 1e3, 1e13)]
    assert near == [False, False, True]


@pytest.mark.parametrize("n", [60, 1400])
@pytest.mark.parametrize("k", [1, 2, 3])
def test_what_is_not_finite_is_never_classified_and_spoils_no_other_row(export, n, k):
    X = features(n)
    _, model = export(X, {"t": Choice("IV", 5, k)})
    queries = X[:8].copy()
    queries[1, 0], queries[2, 119], queries[3, 60] = np.nan, np.inf, -np.inf
    queries[4] = 1e200
    answer = model.run(queries)
    assert (answer["t_label"][[1, 2, 3, 4]] == -1).all()
    assert not answer["t_scores"][[1, 2, 3, 4]].any()
    assert (answer["t_label"][[0, 5, 6, 7]] == model.run(X[[0, 5, 6, 7]])["t_label"]).all()


def test_the_same_fit_gives_the_same_bytes(export):
    X = features(30)
    _, first = export(X, {"t": Choice("IV", 5, 2)})
    before = Path(first.path).read_bytes()
    _, again = export(X, {"t": Choice("IV", 5, 2)})
    assert Path(again.path).read_bytes() == before
