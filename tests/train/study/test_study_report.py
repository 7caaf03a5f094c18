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
from tests.conftest import save_touches
from train.__main__ import main
from train.data.dataset import load_trials
from train.simulate import scene as scenes
from train.study.paper import HEADLINES, PAPER, comparison, difference
from train.study.run import require_scene

SCENES = Path(scenes.__file__).parents[1] / "scenes"

KEYS = [*zip(PAPER.table, PAPER.setting, PAPER.task, strict=True)]
PAPERS = dict(zip(KEYS, PAPER.percent, strict=True))


def test_the_papers_numbers_are_46_shares_of_140_trials():
    assert Counter(PAPER.table) == {"I": 10, "II": 18, "III": 18}
    assert len(PAPERS) == 46
    right = 1.4 * PAPER.percent
    assert right.to_numpy() == pytest.approx(right.round().to_numpy(), abs=0.008)


def test_predictions_are_counted_without_the_numbers_that_a_scene_was_fitted_to():
    replication = dict.fromkeys(PAPERS, 100.0)
    replication |= {key: PAPERS[key] for key in PAPERS if key[1] == HEADLINES[key[0]]}
    section = comparison([replication], 140)
    assert "agrees with 8 of them" in section.text[0]
    assert "Of the other 38, 0 agree." in section.text[1]
    assert [row["headline"] for row in section.tables[0].rows].count("yes") == 8


def test_a_perfect_replication_differs_by_the_chance_of_both_samples():
    """Of pairs of samples of one accuracy one in twenty lies outside."""
    rng = np.random.default_rng(0)
    paper, replication = rng.binomial(140, 0.8, (2, 2000)) / 1.4
    pairs = np.transpose([paper, replication])
    low, high = np.transpose([difference(*pair, 140) for pair in pairs])
    out = np.mean((low > 0.0) | (high < 0.0))
    assert 0.03 < out < 0.07


@pytest.fixture(scope="module")
def studied(tmp_path_factory):
    folder = tmp_path_factory.mktemp("touches")
    save_touches(folder, 10, seconds=1.3, rate=25.0)
    out = tmp_path_factory.mktemp("study")
    words = ["--data", ".", "--out", str(out), "--jobs", "1"]
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert main(["study", *words]) == 0
    return out


@pytest.mark.slow
def test_every_number_of_the_report_is_in_a_csv(studied):
    text = (studied / "report.html").read_text()
    links = re.findall(r'(?:src|srcset|href)="(?!data:image/png)([^"]*)"', text)
    tables = {path.name for path in studied.glob("*.csv")}
    assert {*links} == tables
    assert tables == {
        "scaling.csv",
        "resolution.csv",
        "features.csv",
    }


@pytest.mark.slow
def test_equal_scalings_are_equal(studied):
    """Methods I and II, and none and III, differ by what centring takes away."""
    rows = pd.read_csv(studied / "scaling.csv", keep_default_na=False)
    scaled = rows.pivot(index="task", columns="scaling", values="accuracy %")
    assert list(scaled.index) == ["category", "object"]
    assert (scaled["I"] == scaled["II"]).all()
    assert (scaled["none"] == scaled["III"]).all()


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
