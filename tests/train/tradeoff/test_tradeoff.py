"""What accuracy costs in time: wires, boards, nested accuracy, points, and early stopping."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from edge.errors import InputError
from edge.skin import file as skinfile
from edge.touch.layout import SkinLayout
from tests import browser
from train.__main__ import main as train
from train.evaluate import Result, SearchGrid
from train.pipeline import Choice
from train.tradeoff import answer, board, early
from train.tradeoff.breakaway import breakaway_times
from train.tradeoff.early import Chooser, NestedChoice
from train.tradeoff.front import ParetoFront
from train.tradeoff.measured import MeasuredPoint
from train.tradeoff.run import tradeoff
from train.tradeoff.settings import pareto_front
from train.tradeoff.wires import count, spread, wires

SCENE = Path(__file__).parents[3] / "train" / "scenes" / "cody18.toml"


class TestWires:
    def test_cody_s_chips_over_three_buses_cost_what_the_shipped_file_costs(self):
        file = skinfile.load(skinfile.shipped("cody"))
        ours = count("ours", spread(file.layout, 3))
        shipped = count("shipped", file)
        assert ours.frame_s == pytest.approx(shipped.frame_s, rel=0.1)

    def test_more_buses_share_the_same_bits(self, forearm):
        one, two, three = (count("w", spread(forearm, n)) for n in (1, 2, 3))
        assert one.bits == pytest.approx(three.bits, rel=0.03)
        assert one.frame_s == pytest.approx(2 * two.frame_s, rel=0.02)
        assert one.every(100.0) == 3
        assert three.every(100.0) == 1

    def test_a_single_taxel_is_one_chip_on_one_bus(self):
        names = [wire.name for wire in wires(SkinLayout(rows=1, cols=1, wraps=False))]
        assert names == ["AD7147, 1 bus at 400 kHz", "microcontroller, 1 bus at 1 MHz"]

    def test_a_skin_is_wired_with_every_chip_that_serves_it(self, forearm):
        assert [wire.name.split(",")[0] for wire in wires(forearm)] == [
            *["AD7147"] * 3,
            "microcontroller",
        ]
        quarter = SkinLayout(rows=8, cols=12, wraps=True)
        assert "MPR121" in {wire.name.split(",")[0] for wire in wires(quarter)}


def test_what_is_chosen_without_a_fold_is_chosen_by_the_others_alone():
    """One feature tells all trials but those of a fold, the other nearly all."""
    rng = np.random.default_rng(0)
    labels = rng.choice(["a", "b"], 60)
    names = ("max_force", "contact_area")
    grids = tuple(SearchGrid(features=(f,), components=(1,), neighbours=(5,)) for f in names)
    rows = np.arange(5, 60)
    X = np.repeat(9.0 * (labels == "a")[:, None], 4, axis=1) + rng.normal(size=(60, 4))

    def chosen():
        return Chooser(X, {"t": labels}, grids, names)(rows)

    folds = chosen().folds
    X[rows[folds == 3], :2] = 9.0 - X[rows[folds == 3], :2]
    X[rows[::25], 2:] = 9.0 - X[rows[::25], 2:]
    found = chosen()
    assert found.choices["t"].features == names[1:]
    assert [one["t"].features == names[:1] for one in found.without] == [
        fold == 3 for fold in range(10)
    ]


def point(seconds, right, **changes):
    given = {
        "task": "t",
        "taxels": 384,
        "wire": "w",
        "features": ("max_force",),
        "scaling": "IV",
        "components": 1,
        "k": 1,
        "window_s": seconds,
        "wire_s": 0.0,
        "arithmetic_s": 0.0,
        "result": Result(right, 100),
        "own_skin": True,
    }
    return MeasuredPoint(**{**given, **changes})


def test_the_front_is_what_no_other_beats_in_both():
    a, b, c, d = point(0.2, 50), point(0.4, 70), point(0.6, 70), point(0.8, 90)
    assert pareto_front([d, c, b, a]) == [a, b, d]
    assert pareto_front([point(0.2, 50), point(0.2, 60)]) == [point(0.2, 60)]


def test_a_point_s_time_is_the_sum_of_its_three_parts():
    assert point(0.2, 1, wire_s=0.01, arithmetic_s=0.001).seconds == pytest.approx(0.211)


def comparison(right, seconds=(0.2, 0.6, 1.0)):
    """Fixed windows with these outcomes; every confidence is a half."""
    right = np.array(right, dtype=bool)
    labels = np.where(right, "a", "b")
    return early.StoppingComparison(
        seconds, right, np.full(right.shape, 0.5), labels, [], early.hindsight(right, seconds)
    )


def share_right(*shares):
    """(windows, 100) of which so many are right."""
    return np.arange(100) < 100 * np.array(shares)[:, None]


class TestEarly:
    def test_the_fixed_window_that_is_as_accurate_is_interpolated(self):
        found = comparison(share_right(0.5, 0.7, 0.9))
        assert early.fixed_time(found, 0.1 + 1e-9) == pytest.approx(1.0)
        assert early.fixed_time(found, 0.2) == pytest.approx(0.8)
        assert early.fixed_time(found, 0.9) == pytest.approx(0.2)
        assert early.fixed_time(found, 0.05) is None

    def test_a_longer_window_that_is_worse_is_no_excuse(self):
        found = comparison(share_right(0.5, 0.9, 0.7))
        assert early.fixed_time(found, 0.1 + 1e-9) == pytest.approx(0.6)

    def test_hindsight_stops_each_trial_once_its_answer_stays_as_it_ends(self):
        found = comparison([[1, 0, 1, 0], [1, 1, 0, 1], [1, 1, 1, 0]])
        # From the first decision point on, the second, the last, and the last.
        assert found.hindsight_s == pytest.approx(np.mean([0.2, 0.6, 1.0, 1.0]))

    def test_confidence_that_says_what_comes_true_has_no_calibration_error(self):
        found = comparison(share_right(0.5, 0.5, 0.5))
        assert found.calibration_error == pytest.approx(0.0)
        assert comparison(share_right(0.9, 0.9, 0.9)).calibration_error == pytest.approx(0.4)

    def test_a_rule_that_serves_two_error_rates_is_listed_once(self):
        found = comparison(share_right(0.5, 0.7, 0.9))
        rule = early.Certified(0.1, early.FOLDS, 0.1, 0.0, 1.0, 0.6)
        bolder = early.Certified(0.3, early.FOLDS, 0.3, 0.0, 1.0, 0.4)
        found.certified.extend([rule, replace(rule, asked=0.2), bolder])
        commands = [row["command"].strip("`") for row in answer.answers(found, 0.01)]
        assert [c for c in commands if "--error" in c] == [
            "edge-classify run --error 0.1",
            "edge-classify run --error 0.3",
        ]

    def test_what_is_plain_from_the_second_decision_point_on_is_decided_then(self):
        """Before it the labels look alike; once they differ no one waits for the full window."""
        rng = np.random.default_rng(6)
        labels = np.repeat(["a", "b"], 60)
        X = rng.normal(size=(3, 120, 12))
        X[1:, :, 0] += 30.0 * (labels == "a")

        def choose(rows):
            choices = {"task": Choice("none", 3, 3)}
            return NestedChoice(choices, np.arange(len(rows)) % 5, [choices] * 5)

        found = early.compare_stopping(
            X, {"task": labels}, (0.2, 0.6, 1.0), ("max_force",), choose
        )["task"]
        assert found.fixed[0] > 0.3
        assert found.fixed[1:].tolist() == [0.0, 0.0]
        assert 0.2 < found.hindsight_s <= 0.6
        one = next(e for e in found.certified if e.asked == 0.1)
        assert one.folds == early.FOLDS
        assert one.wrong <= 0.1
        assert one.mean_s <= 0.61

    def test_things_left_out_far_away_are_unknown_and_those_alike_are_not(self):
        rng = np.random.default_rng(0)
        labels = np.repeat(["a", "b", "c", "d", "e", "f"], 20)
        X = rng.normal(size=(120, 12))
        choice = Choice("none", 3, 1)
        alike = early.novelty(X, labels, choice, ("max_force",), rates=(0.1,))[0]
        assert alike.unknown / alike.strange < 0.3
        X[:, 0] += 100.0 * np.repeat(np.arange(6), 20)
        apart = early.novelty(X, labels, choice, ("max_force",), rates=(0.1,))[0]
        assert apart.unknown == apart.strange

    def test_the_floor_is_when_the_arm_s_spring_breaks_friction(self):
        from train.simulate.scene import load

        floors = breakaway_times(load(SCENE))
        # mu_s m g / (k v): equal arms, so the ratio of two objects is that of mu_s m.
        assert floors["plastic bin"] / floors["cardboard box"] == pytest.approx(0.28 / 0.6)
        # The chair tips: 0.4 / (2 * 0.7) instead of 0.6.
        assert floors["chair"] / floors["cardboard box"] == pytest.approx((4 * 0.4 / 1.4) / 0.6)
        assert 0.3 < floors["cardboard box"] < 0.5


class TestBoard:
    def test_a_file_that_is_none_is_one_sentence(self, tmp_path):
        with pytest.raises(InputError, match="cannot be read"):
            board.read(tmp_path / "none.json")
        path = board_file(tmp_path / "board.json", "0" * 64)
        whole = path.read_text()
        assert board.read(path).memory_mb == 61.5
        for wrong in (
            "",
            "{}",
            "[]",
            "[" * 100_000,
            whole[: len(whole) // 2],
            whole.replace("decision", "something"),
            whole.replace("cold_start_ms", "start"),
            whole.replace('"median_us": 100.0', '"median_us": NaN'),
            whole.replace('"median_us": 100.0', '"median_us": "soon"'),
            whole.replace('["a", "b", "c"]', "[]"),
        ):
            path.write_text(wrong)
            with pytest.raises(InputError, match="not a board file: .*; make one with"):
                board.read(path)

    def test_arithmetic_follows_the_number_of_features(self):
        stages = {"track": (1e6, 2e6), "features": (3e6, 4e6), "decision": (10e6, 11e6)}
        one = board.Board("b", "d", stages, 60.0, 500.0, 3, "m")
        assert one.arithmetic_s(3) == pytest.approx(14.0)
        assert one.arithmetic_s(1) == pytest.approx(12.0)


def board_file(path, digest):
    stage = {"median_us": 100.0, "p99_us": 200.0, "n": 40}
    board_ = {
        "machine": {"kind": "a board", "name": "here"},
        "model": {"sha256": "ab" * 32, "data_digest": digest, "features": ["a", "b", "c"]},
        "stages": dict.fromkeys(("track", "features", "decision"), stage),
        "memory_mb": 61.5,
        "cold_start_ms": 812.0,
    }
    path.write_text(json.dumps(board_))
    return path


def test_a_board_file_of_another_model_is_one_sentence(recordings, tmp_path, capsys):
    path = board_file(tmp_path / "board.json", "0" * 64)
    given = ["--data", str(recordings), "--board", str(path), "--out", str(tmp_path / "out")]
    assert train(["tradeoff", *given]) == 2
    last = capsys.readouterr().err.splitlines()[-1]
    assert "was made with a model of other recordings" in last
    assert not (tmp_path / "out").exists()


def test_report_pictures_tables_and_settings_are_written(make_touch, tmp_path, monkeypatch):
    from edge.recording import save
    from train.dataset import load_trials
    from train.tradeoff import run as running
    from train.tradeoff import settings

    for kind in ("hard", "soft"):
        for seed in range(14):
            touch = make_touch(kind=kind, seed=seed, rate=50.0)
            save(tmp_path / "data" / f"{kind}_{seed:02d}.npz", touch)
    monkeypatch.setattr(running, "FEWEST", 28)
    monkeypatch.setattr(running, "GRIDS", running.GRIDS[:1])
    monkeypatch.setattr(settings, "WINDOWS", (1.2,))
    monkeypatch.setattr(running, "DECISION_POINTS_S", (0.4, 1.2))
    digest = load_trials([tmp_path / "data"], horizon_s=1.2).digest
    path = board_file(tmp_path / "board.json", digest)
    out = tmp_path / "out"
    report = tradeoff([str(tmp_path / "data")], out, str(path), scene_path=str(SCENE))
    text = report.read_text()
    assert "http" not in text.replace("http-equiv", "")
    assert "a board (here)" in text
    assert "62 MB of memory, 812 ms from starting Python" in text
    again = tradeoff([str(tmp_path / "data")], tmp_path / "2", str(path), scene_path=str(SCENE))
    assert again.read_bytes() == report.read_bytes()
    assert not browser.available() or browser.faults(report) == []
    for name in ("tradeoff.png", "settings.png", "breakaway.png", "reliability.png"):
        assert (out / name).read_bytes().startswith(b"\x89PNG")
    rows = list(csv.DictReader((out / "points.csv").read_text().splitlines()))
    for cells in rows:
        parts = [float(cells[f"{part} ms"]) for part in ("window", "wire", "arithmetic")]
        assert float(cells["time ms"]) == pytest.approx(sum(parts), abs=0.1)
        assert float(cells["low %"]) <= float(cells["accuracy %"]) <= float(cells["high %"])
    assert sum(cells["paper's point"] == "yes" for cells in rows) == 2  # once a task
    front = ParetoFront.read(out / "front.json")
    assert front.task == "category"
    assert front.points[-1].accuracy > 0.9
