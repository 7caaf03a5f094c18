"""The trade-off: boards, nested accuracy, points, and early decisions."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from edge.decide.info import Stopping, StoppingRule
from edge.decide.model import Model
from edge.decide.statistics import wilson
from edge.errors import InputError
from edge.record.recording import load
from edge.record.saving import save
from export.__main__ import main
from tests import browser
from tests.conftest import export, rows_of, save_touches
from tests.train.tradeoff.examples import chosen, measured, rule
from train.data.dataset import read
from train.data.parts import part
from train.model.rules import NEVER, TimeSeries
from train.tradeoff import answer, board, choices, costs, early
from train.tradeoff import run as running
from train.tradeoff.choices import chosen as make_choice
from train.tradeoff.choices import followed
from train.tradeoff.front import ParetoFront


def test_the_front_has_the_windows_that_no_other_beats_in_both():
    shares = {0.2: 50, 0.4: 70, 0.6: 70, 0.8: 90, 1.0: 80}
    points = {w: {"t": chosen(share)} for w, share in shares.items()}
    best = ParetoFront.of(points, "t").points
    accuracies = [(point.window_s, point.accuracy) for point in best]
    assert accuracies == [(0.2, 0.5), (0.4, 0.7), (0.8, 0.9)]
    # As wide as that of two fifths of the trials.
    assert (best[0].low, best[0].high) == wilson(20, 40)


@pytest.fixture(scope="module")
def fronted(recordings, tmp_path_factory):
    """front.json with one point: 0.4 s."""
    path = tmp_path_factory.mktemp("front") / "front.json"
    dataset = followed(read([recordings]))
    points = {0.4: make_choice(dataset, 0.4)}
    front = ParetoFront.of(points, "category", quick=True)
    path.write_text(json.dumps(front.to_dict(dataset.digest)))
    return path, points[0.4]["category"]


def test_export_writes_the_very_model_of_a_point(recordings, fronted, tmp_path, capsys):
    path, choice = fronted
    export(tmp_path, "--data", recordings, "--front", "fast", "--fronts", path)
    message = capsys.readouterr().err
    assert f"category {choice.by_trial.accuracy:.1%} (62 to 100)" in message
    info = Model(tmp_path / "model.onnx").info
    task = info.tasks["category"]
    assert info.window_s == 0.4
    for name in ("features", "scaling", "k", "projection"):
        assert getattr(task, name) == getattr(choice.choice, name)
    assert task.accuracy == choice.accuracy.accuracy


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        (["--k", "3"], "--front makes the model that was measured; drop --k"),
        (["--data", "hard_0.npz", "hard_1.npz"], "was measured on other recordings"),
    ],
)
def test_a_point_that_cannot_be_exported_is_one_sentence(
    recordings,
    fronted,
    tmp_path,
    capsys,
    more,
    sentence,
):
    words = ["--data", str(recordings), "--out", str(tmp_path), "--front", "fast"]
    if more[0] == "--data":
        more = ["--data", *(str(recordings / name) for name in more[1:])]
    assert main([*words, "--fronts", str(fronted[0]), *more]) == 2
    assert sentence in capsys.readouterr().err.splitlines()[-1]
    assert not list(tmp_path.iterdir())


class TestCosts:
    def test_a_contact_that_is_no_longer_noticed_is_wrong(self):
        before = {(Path(name), 0): True for name in "abcd"}
        after = {(Path(name), 0): True for name in "ab"}
        assert costs.difference(before, after, fewer=False)[0] == -50.0
        assert costs.difference(before, after, fewer=True)[0] == 0.0

    @pytest.mark.slow
    def test_every_change_is_measured_on_its_own_recordings(
        self, recordings, monkeypatch
    ):
        monkeypatch.setattr(costs, "FEWEST", 8)
        raw = read([recordings])
        cases = {case.name: case for case in costs.changes(raw, followed(raw), 100.0)}
        assert list(cases) == [
            "50 frames a second",
            "25 frames a second",
            "96 taxels",
            "24 taxels",
            "6 taxels",
            "1 taxel",
            "the paper's features",
            "8 of 16 trials",
        ]
        assert cases["8 of 16 trials"].price == "8 recordings fewer"
        assert cases["24 taxels"].source.recordings[0].frames.shape[1:] == (4, 6)
        assert cases["24 taxels"].price == "24 of 384 taxels to read"


def test_the_wire_is_that_of_the_recordings_or_unknown(make_touch):
    touch = make_touch()
    assert running._wire_time_s([touch], 100.0) is None
    wired = replace(touch, meta={**touch.meta, "wire_s": 0.0182})
    assert running._wire_time_s([wired], 100.0) == pytest.approx(0.0232)


def test_each_decision_has_its_accuracy_on_unseen_objects_and_the_time_of_the_touch():
    """The board and the wire take time too, which no row counts."""
    facts = measured(
        {0.4: {"t": chosen(60, 45)}, 1.2: {"t": chosen(95)}},
        {"t": [rule(unseen=57), rule(0.2)]},
        board=SimpleNamespace(arithmetic_s=0.1, name="a board"),
        wire_s=0.1,
    )
    *rows, _ = answer.answers(facts, "t")
    shown = [(row["time s"], row["unseen objects %"]) for row in rows]
    assert shown == [(0.4, 45.0), (1.2, ""), (0.5, 57.0), (0.5, "")]
    notes = " ".join(answer.reasons(facts).text)
    assert "On top come 100.0 ms on the wire and 100.00 ms of arithmetic" in notes


class TestEarly:
    def test_early_decisions_follow_the_rules_that_the_model_of_all_contacts_certifies(
        self,
    ):
        """Two points: the first wrong about one of four contacts, and the second unlike
        all others for another."""
        wrong = np.array([[True, False, False, False], [False] * 4])
        unknown = np.array([[False] * 4, [True, False, False, False]])
        time_series = TimeSeries(
            [np.full((2, 4), 0.5)], [wrong], unknown, withheld=unknown
        )
        unseen = replace(time_series, withheld=None)
        rules = StoppingRule(0.12, 1.2, NEVER, 1), StoppingRule(0.2, 0.6, 0.5, 1)
        stopping = Stopping((), (), (), 0.0, 0.0, 0.0, rules, 4, 0, 0.1)
        late, soon = early.at_errors(stopping, time_series, unseen)
        # The rates 0.05 and 0.1 are refused; one rule serves 0.2 to 0.3.
        assert (late.error, soon.error) == (0.15, 0.2)
        assert (late.mean_s, soon.mean_s) == (1.2, 0.6)
        assert (late.unseen.sum(), soon.unseen.sum()) == (4, 3)
        # At the full window one more is right and one names nothing.
        assert soon.result.right == late.result.right == 3

    @pytest.mark.slow
    def test_clear_contacts_are_decided_at_the_first_decision_point(self, tmp_path):
        dataset = followed(read([save_touches(tmp_path, 20)]))
        # Forty trials certify no rate as low as the smallest one.
        (decisions,) = early.certified(dataset, (0.6, 1.2))["category"]
        assert decisions.error > early.ERRORS[0]
        assert decisions.right.all()
        # One of forty may be unusual, and waits.
        assert decisions.mean_s <= 0.6 + 0.6 / 40 + 1e-9


class TestBoard:
    def test_a_file_that_is_none_is_one_sentence(self, tmp_path):
        with pytest.raises(InputError, match="cannot be read"):
            board.read(tmp_path / "none.json")
        path = board_file(tmp_path / "board.json", "0" * 64)
        content_of_file = path.read_text()
        assert board.read(path).memory_mb == 61.5
        wrong = ["[" * 100_000, content_of_file[:50]]
        wrong += [
            content_of_file.replace(name, "x") for name in ("decision", "cold_start_ms")
        ]
        for text in (*wrong, content_of_file.replace("100.0", "NaN")):
            path.write_text(text)
            with pytest.raises(InputError, match="not a board file: .*; make one with"):
                board.read(path)


def board_file(path, digest):
    stage = {"median_us": 100.0, "p99_us": 200.0}
    content = {
        "machine": {"kind": "a board", "name": "here"},
        "model": {"sha256": "ab" * 32, "data_digest": digest},
        "stages": dict.fromkeys(("track", "features", "decision"), stage),
        "memory_mb": 61.5,
        "cold_start_ms": 812.0,
    }
    path.write_text(json.dumps(content))
    return path


def test_a_board_file_of_another_model_is_one_sentence(recordings, tmp_path, refusal):
    path = board_file(tmp_path / "board.json", "0" * 64)
    words = "--data", recordings, "--board", path, "--out", tmp_path / "out"
    assert "was made with a model of other recordings" in refusal("tradeoff", *words)
    assert not any((tmp_path / "out").iterdir())


@pytest.fixture(scope="module")
def small_report(tmp_path_factory):
    """The report on 28 touches, its text, and the digest of its recordings, with few
    windows and changes."""
    folder = tmp_path_factory.mktemp("tradeoff")
    data = str(save_touches(folder / "data", 14, rate=25.0))
    single = part(load(folder / "data" / "hard_00.npz"), slice(1))
    save(folder / "data" / "single_frame.npz", single)
    digest = read([data]).digest
    path = board_file(folder / "board.json", digest)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(running, "FEWEST", 28)
        patch.setattr(early, "FOLDS", 4)
        patch.setattr(running, "WINDOWS_S", (0.4, 1.2))
        patch.setattr(choices, "CHOSEN_S", (0.4, 1.2))
        patch.setattr(costs, "WAITS_S", (0.4,))
        patch.setattr(costs, "EVERY", ())
        patch.setattr(costs, "coarser", lambda *_: [])
        report = running.tradeoff([data], folder / "out", str(path), quick=True)
    return SimpleNamespace(report=report, text=report.read_text(), digest=digest)


@pytest.mark.slow
def test_the_report_tells_of_the_board_and_needs_no_other_page(small_report):
    ready = "62 MB of memory, and the model is ready 812 ms after the start of Python"
    assert ready in small_report.text
    assert (
        small_report.report.with_name("tradeoff.png")
        .read_bytes()
        .startswith(b"\x89PNG")
    )
    assert "http" not in small_report.text
    assert not browser.available() or browser.faults(small_report.report) == []


@pytest.mark.slow
def test_each_change_and_the_front_of_quick_choices_lie_beside_the_report(small_report):
    rows = rows_of(small_report.report.with_name("costs.csv"))
    changes = {row["change"]: row for row in rows}
    assert changes["waiting 0.4 s"]["category, points"].startswith("+0 (-")
    assert changes["the paper's features"]["saves"] == "only 3 features"
    front = ParetoFront.read(
        small_report.report.with_name("front.json"), small_report.digest
    )
    assert front.task == "category"
    assert front.quick
    assert front.points[-1].accuracy > 0.9
