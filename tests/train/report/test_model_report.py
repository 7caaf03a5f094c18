"""The report of an export: the answers to left-out trials, and the reasons for wrong
ones."""

from dataclasses import replace

import pytest

import export
import train
from edge.decide.model import Model
from edge.features.vector import FEATURES
from edge.record.recording import load
from edge.record.saving import save
from export.api import measure
from tests.conftest import rows_of
from train.report import model_report as report
from train.report import newest


@pytest.fixture(scope="module")
def model_and_page(recordings, tmp_path_factory):
    """A report of 16 trials, of which hard_3 is labelled wrong and hard_7 touches
    nothing."""
    folder = tmp_path_factory.mktemp("labelled")
    out = tmp_path_factory.mktemp("report")
    for path in sorted(recordings.glob("*.npz")):
        trial = load(path)
        if path.stem == "hard_3":
            trial = replace(
                trial, meta={**trial.meta, "labels": {"category": "soft-fixed"}}
            )
        trial.meta["labels"] = {"category": trial.labels["category"]}
        trial.meta["robot"] = "left" if path.stem == "hard_1" else "right"
        trial.meta["kept"] = "2026-11-28T23:59:00+00:00"
        if path.stem == "hard_7":
            trial = replace(trial, frames=0 * trial.frames)
        save(folder / path.name, trial)
    fitted = train.fit(
        str(folder),
        features=["paper"],
        projection="pca",
        quick=True,
        jobs=1,
    )
    export.save(out / "model.onnx", fitted)
    page = report.write(out, fitted, Model(out / "model.onnx"), measure(fitted))
    return fitted, page


def table(page, name):
    return rows_of(page.parent / f"{name}.csv")


def test_it_tells_what_the_newest_changed(model_and_page, monkeypatch):
    fitted, page = model_and_page
    assert not (page.parent / "newest.csv").exists()  # all are of one time
    monkeypatch.setattr(newest, "NEWEST", 5)
    monkeypatch.setattr(
        newest, "time_of", lambda trial: f"2026-11-28 {trial.path.stem}"
    )
    (told,) = newest.newest_tables(fitted)
    assert told.title.startswith("The newest 5 trials, since 2026-11-28 soft_3;")
    (row,) = told.rows
    assert row["task"] == "category"
    assert row["trials"] == 15
    assert 50.0 < row["accuracy % without the newest"] <= row["accuracy % with them"]


def test_trials_are_counted_by_label_robot_and_day(model_and_page):
    rows = table(model_and_page[1], "recordings")
    assert [tuple(row.values()) for row in rows] == [
        ("category", "rigid-fixed", "6"),
        ("category", "soft-fixed", "9"),
        ("day", "2026-11-28", "15"),
        ("robot", "left", "1"),
        ("robot", "right", "14"),
    ]


def test_the_answers_are_those_that_the_nested_accuracy_counts(model_and_page):
    fitted, page = model_and_page
    result = fitted.chosen["category"].accuracy
    answers = report.answers_of(fitted)["category"]
    assert ((answers.answers == answers.truth) == result.hits).all()
    rows = table(page, "recall_category")
    # The touch that was missed is rigid, and counts as answered wrongly.
    assert [(row["category"], row["trials"]) for row in rows] == [
        ("rigid-fixed", "7"),
        ("soft-fixed", "9"),
    ]
    right = sum(float(row["recall %"]) * int(row["trials"]) / 100.0 for row in rows)
    assert right == pytest.approx(result.right, abs=0.01)
    assert f"{result.accuracy:.1%} of 16 trials are right" in page.read_text()
    assert "The trials include 1 recording without a contact." in page.read_text()


def test_a_wrong_answer_is_named_with_its_nearest_trial(model_and_page):
    fitted, page = model_and_page
    rows = {row["trial"]: row for row in table(page, "wrong")}
    assert len(rows) == (~fitted.chosen["category"].accuracy.hits).sum()
    row = rows["hard_3"]
    assert row["label"] == "soft-fixed"
    assert row["answer"] == "rigid-fixed"
    assert row["nearest trial"].startswith("hard_")
    assert row["nearest trial"] != "hard_3"
    assert float(row["distance"]) > 0.0


def test_features_and_prices_have_their_tables(model_and_page):
    _, page = model_and_page
    values = {row["feature"]: row["values"] for row in table(page, "features")}
    assert values == dict.fromkeys(FEATURES, "40")
    assert [row["features"] for row in table(page, "candidates")] == ["paper"]
    assert float(table(page, "candidates_timings")[0]["us per decision"]) > 0.0
