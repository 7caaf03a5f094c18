"""The paper's numbers, the tables and the page; and the command, end to end on few
trials."""

import re
from collections import Counter
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from edge import demo
from edge.errors import InputError
from edge.record.saving import save
from tests import browser
from tests.conftest import save_touches
from train.__main__ import main
from train.choose.evaluate import Result
from train.data.dataset import load_trials
from train.simulate import scene as scenes
from train.study import methods
from train.study.paper import (
    comparison,
    difference,
    entries,
    mean_of,
    right_despite_the_object,
)
from train.study.run import require_scene

SCENES = Path(scenes.__file__).parents[1] / "scenes"

PAPERS = {entry.key: entry.percent for entry in entries()}
HEADLINES = [entry for entry in entries() if entry.headline]


def test_the_papers_numbers_are_46():
    assert Counter(e.table for e in entries()) == {"I": 10, "II": 18, "III": 18}
    assert len(PAPERS) == 46


@pytest.mark.parametrize("entry", entries(), ids=lambda entry: "-".join(entry.key))
def test_a_number_of_the_paper_is_a_share_of_140_trials(entry):
    assert entry.percent * 1.4 == pytest.approx(round(entry.percent * 1.4), abs=0.008)


def test_the_numbers_without_scaling_are_the_headlines_of_section_iv_a():
    headline = {e.task: e.percent for e in HEADLINES if e.table == "II"}
    assert headline == {"category": 80.0, "mobility": 91.43, "object": 72.14}


def test_predictions_are_counted_without_the_numbers_that_a_scene_was_fitted_to():
    ours = dict.fromkeys(PAPERS, 100.0)
    ours |= {entry.key: entry.percent for entry in HEADLINES}
    section = comparison([ours], 140)
    assert "agrees with 8 of them" in section.text[0]
    assert "Of the other 38, 0 agree." in section.text[1]
    assert [row["headline"] for row in section.tables[0].rows].count("yes") == 8


def test_a_perfect_replication_differs_by_the_chance_of_both_samples():
    """Of pairs of samples of one accuracy one in twenty lies outside."""
    rng = np.random.default_rng(0)
    paper, ours = rng.binomial(140, 0.8, (2, 2000)) / 1.4
    pairs = np.transpose([paper, ours])
    low, high = np.transpose([difference(*pair, 140) for pair in pairs])
    out = np.mean((low > 0.0) | (high < 0.0))
    assert 0.03 < out < 0.07


def test_several_data_sets_count_as_their_mean():
    key = ("I", "1", "t")
    assert mean_of([{key: 80.0}, {key: 90.0}]) == {key: 85.0}


def test_the_category_is_judged_on_the_trials_with_a_wrong_object():
    numbers = {
        ("I", "1", "category"): 70.0,
        ("I", "1", "object"): 60.0,
        ("I", "6", "category"): 80.0,
        ("I", "6", "object"): 60.0,
        ("II", "I", "mobility"): 99.0,
    }
    assert right_despite_the_object(numbers) == pytest.approx((25.0 + 50.0) / 2)


@pytest.fixture(scope="module")
def studied(tmp_path_factory):
    folder = tmp_path_factory.mktemp("touches")
    save_touches(folder, 10, seconds=1.3, rate=25.0)
    out = tmp_path_factory.mktemp("study")
    words = ["--data", ".", "--out", str(out), "--jobs", "1"]
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr(methods, "TREES", 10)
        assert main(["study", *words]) == 0
    return out


@pytest.mark.slow
def test_every_number_of_the_report_is_in_a_csv_and_the_findings_come_first(studied):
    text = (studied / "report.html").read_text()
    links = re.findall(r'(?:src|srcset|href)="(?!data:image/png)([^"]*)"', text)
    tables = {path.name for path in studied.glob("*.csv")}
    assert {*links} == tables
    assert tables > {
        "methods.csv",
        "window.csv",
        "scaling.csv",
        "resolution.csv",
        "features.csv",
    }
    assert 2 * len(list(studied.glob("*.png"))) == text.count("data:image/png")
    assert re.findall(r"<h2>([^<]+)", text)[0] == "Findings"


@pytest.mark.slow
def test_equal_scalings_are_equal(studied):
    """Methods I and II, and none and III, differ by what centring takes away."""
    rows = pd.read_csv(studied / "scaling.csv", keep_default_na=False)
    scaled = rows.pivot(index="task", columns="scaling", values="accuracy %")
    assert list(scaled.index) == ["category", "object"]
    assert (scaled["I"] == scaled["II"]).all()
    assert (scaled["none"] == scaled["III"]).all()


@pytest.mark.slow
def test_every_method_has_a_row_and_one_recognises_easy_touches(studied):
    compared = pd.read_csv(studied / "methods.csv")
    assert compared["method"].nunique() == len(methods.OURS) + 4
    best = compared.groupby("task")["accuracy %"].max()
    assert list(best.index) == ["category", "object"]
    assert best["category"] == 100.0


def sentence(papers, best):
    """The sentence on softness, with so many of 50 trials right by the paper's method
    and by another, b."""

    def answers(*rights):
        results = [{"softness": Result(right, 50)} for right in rights]
        return dict(zip((methods.PAPER, "b"), results, strict=True))

    return methods.sentence("softness", answers(papers, best), answers(41, 42))


def test_accuracy_on_unseen_objects_stands_beside_that_on_trials():
    text = sentence(49, 50)
    assert "98 % of the contacts right (90 to 100; 82 % with unseen objects)" in text
    assert "The best is b: 100 % of the contacts right (93 to 100; 84 %" in text


def test_the_findings_name_no_best_method_below_the_papers():
    assert "unseen objects). No method here does better." in sentence(49, 47)


@pytest.mark.slow
def test_in_a_browser_nothing_overflows_or_is_missing(studied):
    assert browser.faults(studied / "report.html") == []


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--data", "nowhere"], "nowhere"),
        (["--scene", "nowhere.toml"], "nowhere.toml"),
        ([], "needs at least 20 trials, not 16"),
    ],
)
def test_bad_input_is_one_sentence(words, sentence, recordings, tmp_path, refusal):
    data = [] if "--data" in words else ["--data", recordings]
    assert sentence in refusal("study", "--out", tmp_path / "out", *data, *words)
    assert not any((tmp_path / "out").iterdir())


def test_recordings_of_another_scene_are_refused():
    scene = scenes.load(SCENES / "demo.toml")
    touch = load_trials(demo.recordings()).trials[0]
    meta = {**touch.recording.meta, "simulation": {"seed": scene.seed}}
    for changed in ({}, {"source": "a robot"}, {"simulation": {"seed": -1}}):
        recording = replace(touch.recording, meta={**meta, **changed})
        trials = SimpleNamespace(trials=[replace(touch, recording=recording)])
        message = "was not simulated from the scene demo with seed"
        refused = pytest.raises(InputError, match=message)
        with refused if changed else nullcontext():
            require_scene(trials, scene)


def test_trials_of_one_class_are_nothing_to_study(make_touch, tmp_path, refusal):
    for seed in range(20):
        touch = make_touch(seed=seed, seconds=0.3, labels={"mobility": "fixed"})
        save(tmp_path / f"{seed:02d}.npz", touch)
    message = refusal("study", "--data", tmp_path, "--out", tmp_path / "out")
    assert (
        "every trial has the same mobility: there is nothing to distinguish" in message
    )
    assert not any((tmp_path / "out").iterdir())
