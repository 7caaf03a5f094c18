"""What a decision costs by its model's size, measured, and read again for the report."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from edge.errors import InputError
from edge.recording import save
from export import prices as measured
from train.dataset import load_trials
from train.tradeoff import arithmetic, prices


@pytest.fixture(scope="module")
def written(recordings, tmp_path_factory):
    """prices.json of 16 recordings, models of 16 and 1000 rows."""
    path = tmp_path_factory.mktemp("prices") / "prices.json"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(measured, "ROWS", (1000,))
        given = ["--data", str(recordings), "--out", str(path), "--calls", "3"]
        assert measured.main(given) == 0
    return path


def test_one_number_is_varied_at_a_time(written):
    found = json.loads(written.read_text())["decisions"]
    sizes = [(one["rows"], one["components"], one["k"]) for one in found]
    assert sizes[:4] == [(16, 1, 2), (16, 2, 2), (16, 5, 2), (16, 10, 2)]
    assert sizes[4:] == [(16, 5, 1), (16, 5, 5), (1000, 5, 2), (16, 5, 2)]
    assert [one["operators"] for one in found][-2:] == ["ours, float64", "skl2onnx's own"]
    assert all(one["us"] > 0.0 for one in found)
    by_rows = {one["rows"]: one["kilobytes"] for one in found if one["components"] == 5}
    assert by_rows[1000] > by_rows[16]


def test_rows_beyond_the_recorded_ones_are_like_them_and_the_same_every_time():
    X = np.random.default_rng(0).normal(size=(5, 120))
    more = measured.grown(X, 12)
    assert (measured.grown(X, 5) == X).all()
    assert (measured.grown(X, 12) == more).all()
    assert np.abs(more[5:10] / X - 1.0).max() < 0.01
    assert len(np.unique(more, axis=0)) == 12


def test_prices_are_medians_in_microseconds(monkeypatch):
    """Each decision puts the clock forward by its cost, every fourth time by ten times that."""
    now, calls = 0, 0

    def decision(ns):
        def decide():
            nonlocal now, calls
            calls += 1
            now += ns * (10 if calls % 4 == 0 else 1)

        return decide

    monkeypatch.setattr(measured.time, "perf_counter_ns", lambda: now)
    assert measured.medians_us([decision(1500), decision(64000)], 60) == [1.5, 64.0]


def test_the_report_sets_accuracy_beside_the_price(written, recordings):
    dataset = load_trials([recordings], horizon_s=1.2)
    measured = SimpleNamespace(
        prices=prices.read(written, dataset.digest),
        dataset=dataset,
        main="category",
        y={"category": dataset.labels("category")},
    )
    sizes, learning = arithmetic.sizes(measured).tables
    accuracy = [row["accuracy %"] for row in sizes.rows]
    assert accuracy[-2] == ""  # nothing is known of rows that were never recorded
    assert 0.0 < accuracy[2] <= 100.0
    assert sizes.timed == ("decision us",)
    assert learning.rows[-1]["trials"] == 16


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda text: text[:40], "not a prices file"),
        (lambda text: text.replace("data_digest", "digest"), "not a prices file"),
        (lambda text: text.replace('"data_digest": "', '"data_digest": "0'), "other recordings"),
    ],
)
def test_a_file_that_is_none_is_one_sentence(written, recordings, tmp_path, change, said):
    path = tmp_path / "prices.json"
    path.write_text(change(written.read_text()))
    digest = json.loads(written.read_text())["data_digest"]
    with pytest.raises(InputError, match=said):
        prices.read(path, digest)


@pytest.mark.parametrize(
    "change",
    [
        lambda found: found.update(decisions=[]),
        lambda found: found["decisions"][0].update(components=0),
        lambda found: found["decisions"][0].update(us=float("nan")),
    ],
)
def test_a_price_that_makes_no_sense_is_refused(written, tmp_path, change):
    found = json.loads(written.read_text())
    change(found)
    path = tmp_path / "prices.json"
    path.write_text(json.dumps(found))
    with pytest.raises(InputError, match="not a prices file"):
        prices.read(path, found["data_digest"])


def test_too_few_trials_are_one_sentence(make_touch, tmp_path, capsys):
    save(tmp_path / "one.npz", make_touch())
    out = ["--out", str(tmp_path / "prices.json")]
    assert measured.main(["--data", str(tmp_path / "one.npz"), *out]) == 2
    assert "prices need at least 10 trials, not 1" in capsys.readouterr().err
    assert not (tmp_path / "prices.json").exists()
