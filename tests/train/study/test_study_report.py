"""The paper's numbers, the tables and the page; and the command, end to end on few
trials."""

import re
from collections import Counter

import numpy as np
import pytest

from edge.saving import save
from tests import browser
from tests.conftest import rows_of, save_touches
from train.__main__ import main
from train.evaluate import Result
from train.study import methods
from train.study.paper import (
    comparison,
    difference,
    entries,
    mean_of,
    negative_by_chance,
    right_despite_the_object,
)


def test_the_papers_numbers_are_46_and_whole_trials_of_140():
    numbers = entries()
    assert Counter(e.table for e in numbers) == {"I": 10, "II": 18, "III": 18}
    assert len({(e.table, e.setting, e.task) for e in numbers}) == 46
    for entry in numbers:
        right = entry.percent * 1.4
        assert abs(right - round(right)) < 0.008, entry
    plain = [e for e in numbers if (e.table, e.setting) == ("II", "none")]
    headline = {e.task: e.percent for e in plain}
    assert headline == {"category": 80.0, "mobility": 91.43, "object": 72.14}


def test_predictions_are_counted_without_the_numbers_that_a_scene_was_fitted_to():
    """The headlines of section IV-A stand in the tables eight times."""
    headlines = [e for e in entries() if e.headline]
    counts = Counter(e.task for e in headlines)
    assert counts == {"category": 3, "mobility": 2, "object": 3}
    assert {e.percent for e in headlines} == {80.0, 91.43, 72.14}
    ours = {(e.table, e.setting, e.task): 100.0 for e in entries()}
    ours |= {(e.table, e.setting, e.task): e.percent for e in headlines}
    section = comparison([ours], 140)
    assert "agrees with 8 of them" in section.text[0]
    assert "Of the other 38, 0 agree." in section.text[1]
    assert sum(row["headline"] == "yes" for row in section.tables[0].rows) == 8


def test_a_perfect_replication_differs_by_the_chance_of_both_samples():
    """Of pairs of samples of one accuracy one in twenty lies outside."""
    rng = np.random.default_rng(0)
    paper, ours = rng.binomial(140, 0.8, (2, 2000)) / 1.4
    pairs = np.transpose([paper, ours])
    low, high = np.transpose([difference(*pair, 140) for pair in pairs])
    out = np.mean((low > 0.0) | (high < 0.0))
    assert 0.03 < out < 0.07
    one = difference(80.0, 85.0, 140)
    eight = difference(80.0, 85.0, 8 * 140)
    assert one[0] < eight[0] < 5.0 < eight[1] < one[1]
    key = ("I", "1", "t")
    assert mean_of([{key: 80.0}, {key: 90.0}]) == {key: 85.0}


def test_an_order_stands_beside_the_data_sets_that_have_it_and_its_chance():
    paper = {(e.table, e.setting, e.task): e.percent for e in entries()}
    against = {key: 142.0 - percent for key, percent in paper.items()}
    section = comparison([paper, paper, against], 420)
    ranks = section.tables[1].rows
    assert len(ranks) == 8
    assert {row["rank correlation"] for row in ranks} == {1.0}
    assert {row["positive in data sets"] for row in ranks} == {"2 of 3"}
    below = {(row["table"], row["task"]): row["negative by chance %"] for row in ranks}
    # Mobility is within 6 points in Table II, category within 21.
    assert below["II", "mobility"] > 5.0 > 0.1 >= below["II", "category"]
    (backwards, *_) = comparison([against], 140).tables[1].rows
    assert backwards["table"] == "I"
    assert backwards["task"] == "category"
    assert backwards["rank correlation"] == -1.0
    assert backwards["positive in data sets"] == "0 of 1"
    # Equal settings are ordered by chance alone; ties count as no order.
    assert 40.0 < negative_by_chance([80.0] * 6, 1120) < 50.0


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
    save_touches(folder, 12, seconds=1.3, rate=25.0)
    out = tmp_path_factory.mktemp("study")
    words = ["--data", str(folder), "--out", str(out), "--jobs", "1"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(methods, "TREES", 10)
        assert main(["study", *words]) == 0
    return out


def test_every_number_of_the_report_is_in_a_csv(studied):
    text = (studied / "report.html").read_text()
    named = set(re.findall(r'(?:src|srcset|href)="(?!data:image/png)([^"]*)"', text))
    assert named == {path.name for path in studied.glob("*.csv")}
    tables = "methods window scaling features resolution"
    assert {f"{name}.csv" for name in tables.split()} < named
    assert 2 * len(list(studied.glob("*.png"))) == text.count("data:image/png")


def test_equal_scalings_are_equal(studied):
    """Methods I and II, and none and III, differ by what centring takes away."""
    rows = rows_of(studied / "scaling.csv")
    scaled = {(row["scaling"], row["task"]): row["accuracy %"] for row in rows}
    for task in ("category", "object"):
        assert scaled["I", task] == scaled["II", task]
        assert scaled["none", task] == scaled["III", task]


def test_easy_touches_are_recognised_and_the_findings_come_first(studied):
    text = (studied / "report.html").read_text()
    assert re.findall(r"<h2>([^<]+)", text)[0] == "Findings"
    compared = rows_of(studied / "methods.csv")
    assert {r["task"] for r in compared} == {"category", "object"}
    assert len({r["method"] for r in compared}) == len(methods.OURS) + 4
    category = [r["accuracy %"] for r in compared if r["task"] == "category"]
    assert max(map(float, category)) == 100.0


def test_the_findings_name_no_best_method_below_the_papers():
    """Whatever is better on trials, accuracy on objects never met stands beside it."""

    def sentence(papers, other):
        known = {methods.PAPER: papers, "b": other}
        unseen = {methods.PAPER: 41, "b": 42}
        results = (
            {name: {"softness": Result(right, 50)} for name, right in rights.items()}
            for rights in (known, unseen)
        )
        return methods.sentence("softness", *results)

    text = sentence(49, 47)
    assert "98 % of the contacts right (90 to 100; 82 % with objects never met)" in text
    assert "never met). No method" in text
    text = sentence(49, 50)
    assert "The best is b: 100 % of the contacts right (93 to 100; 84 %" in text


def test_in_a_browser_nothing_overflows_or_is_missing(studied):
    assert browser.faults(studied / "report.html") == []


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        (["--data", "nowhere"], "nowhere"),
        (["--jobs", "0"], "--jobs must be at least 1"),
        (["--scene", "nowhere.toml"], "nowhere.toml"),
        ([], "16 trials are too few to study"),
    ],
)
def test_bad_input_is_one_sentence(given, sentence, recordings, tmp_path, refusal):
    data = [] if "--data" in given else ["--data", recordings]
    assert sentence in refusal("study", "--out", tmp_path / "out", *data, *given)
    assert not any((tmp_path / "out").iterdir())


def test_trials_of_one_class_are_nothing_to_study(make_touch, tmp_path, refusal):
    for seed in range(20):
        touch = make_touch(
            seed=seed, seconds=0.3, rate=25.0, labels={"mobility": "fixed"}
        )
        save(tmp_path / f"{seed:02d}.npz", touch)
    said = refusal("study", "--data", tmp_path, "--out", tmp_path / "out")
    assert "every trial has the same mobility: there is nothing to distinguish" in said
    assert not any((tmp_path / "out").iterdir())
