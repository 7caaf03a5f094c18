"""Touches that a run keeps, with their decisions."""

import numpy as np
import pytest

from edge import demo
from edge.app.sinks import keeper as keep
from edge.app.sinks.keeper import reasons, reasons_of
from edge.decide.events import Decided
from edge.errors import InputError
from edge.record.recording import Recording, load
from edge.record.saving import save
from tests.conftest import decided


def decision(confidence, *flags):
    return Decided("t", "a", confidence, 1.2, 0.2, 0.1, flags=flags)


@pytest.mark.parametrize(
    ("doubted", "expected"),
    [
        (decision(0.8), {"all"}),
        (decision(0.79), {"all", "unsure"}),
        (decision(None), {"all", "unsure"}),
        (decision(0.95, "forced"), {"all", "unsure"}),
        (decision(0.95, "unknown"), {"all", "unknown"}),
        (decision(0.95, "unusual", "tie"), {"all", "unusual"}),
    ],
)
def test_a_touch_is_kept_for_what_is_not_sure_of_it(doubted, expected):
    assert reasons_of([decision(1.0), doubted]) == expected


def test_reasons_are_a_list_of_names():
    assert reasons("unsure,all") == ("unsure", "all")
    with pytest.raises(
        InputError, match="--keep-if takes unsure, unknown, unusual, all"
    ):
        reasons("never")


def run(edge, folder, *words):
    touch = demo.FOLDER / "foam-block-fixed.npz"
    return edge("run", "--model", demo.MODEL, "--fake", touch, "--keep", folder, *words)


def test_a_kept_touch_has_the_decision_and_is_decided_again_as_it_was(edge, tmp_path):
    status, lines, err = run(edge, tmp_path / "kept", "--keep-if", "all")
    assert status == 0
    assert "1 recording kept" in err
    (path,) = (tmp_path / "kept").glob("kept-*.npz")
    touch = load(path)
    assert touch.labels == {}
    assert touch.joints is not None
    answers = touch.meta["decided"]
    assert list(answers) == decided(lines, "task")
    for key in ("label", "confidence", "flags"):
        assert [answer[key] for answer in answers.values()] == decided(lines, key)
    _, replayed, _ = edge("replay", "--model", demo.MODEL, path)
    assert decided(replayed, "label") == decided(lines, "label")


def test_what_is_sure_is_not_kept(edge, tmp_path):
    assert run(edge, tmp_path)[0] == 0
    assert list(tmp_path.iterdir()) == []


def save_touch(path, frames=1200, labels=None):
    """A recording of 0.8 kB a frame."""
    counts = np.zeros((frames, 20, 20), np.uint16)
    save(
        path, Recording(np.arange(float(frames)), counts, meta={"labels": labels or {}})
    )


@pytest.fixture
def little(monkeypatch):
    """Kept touches may take a megabyte."""
    monkeypatch.setattr(keep, "MOST_BYTES", 1_000_000)


def test_the_oldest_go_first(edge, tmp_path, little):
    for i in range(3):
        save_touch(tmp_path / f"kept-20200101T00000{i}-00000.npz", frames=500)
    foreign = tmp_path / "mine.npz"
    foreign.write_bytes(bytes(2_000_000))
    assert run(edge, tmp_path, "--keep-if", "all")[0] == 0
    names = sorted(path.name[5:20] for path in tmp_path.glob("kept-*.npz"))
    assert names[0] == "20200101T000001"
    assert len(names) == 3
    assert foreign.exists()


def after_the_clock_went_back(folder, labels):
    """A touch that was kept by a later clock, of nearly a megabyte."""
    path = folder / "kept-n000041-20990101T000000-000000.npz"
    save_touch(path, labels=labels)
    return path


def test_the_order_of_arrival_counts_and_not_the_clock(edge, tmp_path, little):
    later = after_the_clock_went_back(tmp_path, {})
    assert "1 recording kept" in run(edge, tmp_path, "--keep-if", "all")[2]
    (newest,) = tmp_path.glob("kept-*.npz")
    assert newest.name.startswith("kept-n000042-")
    assert not later.exists()


def test_labelled_touches_are_never_removed_and_a_full_folder_is_said(
    edge, tmp_path, little
):
    labelled = after_the_clock_went_back(tmp_path, {"object": "box"})
    _, _, err = run(edge, tmp_path, "--keep-if", "all")
    assert "0 recordings kept" in err
    assert "touches are no longer kept, as labelled or unreadable ones fill the" in err
    assert list(tmp_path.glob("kept-*.npz")) == [labelled]


def test_what_cannot_be_removed_ends_neither_the_run_nor_the_keeping(
    edge, tmp_path, little
):
    (tmp_path / "kept-20200101T000000-00000.npz").mkdir()
    unlabelled = tmp_path / "kept-20200101T000001-00000.npz"
    save_touch(unlabelled)
    unreadable = tmp_path / "kept-20200101T000002-00000.npz"
    unreadable.write_bytes(bytes(500_000))  # it may have been labelled
    status, _, err = run(edge, tmp_path, "--keep-if", "all")
    assert status == 0
    assert "Traceback" not in err
    assert "1 recording kept" in err
    assert not unlabelled.exists()
    assert unreadable.exists()
