"""Onsets from outside: recorded, trained on, and taken from another program."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

import edge
from edge.app import source
from edge.errors import InputError
from tests.conftest import export, save_touches
from tests.edge.decide.test_classifier import decided

EARLY_S = 0.1
"""From the event to the touch, which begins at 0.2 s."""


def with_onset(recording):
    onset = {"source": "event", "times_s": [float(recording.t[0]) + EARLY_S]}
    return replace(recording, meta={**recording.meta, "onset": onset})


@pytest.fixture(scope="module")
def of_events(tmp_path_factory):
    """A model of touches that begin by an event, and the folder of their recordings."""
    folder = tmp_path_factory.mktemp("events")
    save_touches(folder, 8)
    for path in folder.glob("*.npz"):
        edge.save(path, with_onset(edge.load(path)))
    options = ("--features", "paper", "--projection", "pca", "--quick")
    return edge.Model(export(folder / "out", "--data", folder, *options) / "model.onnx")


def test_a_decision_counts_from_the_event(of_events, make_touch):
    assert of_events.info.onset == "event"
    events = decided(of_events, with_onset(make_touch(seed=99)))
    assert [event.onset_s for event in events] == pytest.approx([EARLY_S] * 2)
    assert events[0].label
    assert "late" not in events[0].flags
    with pytest.raises(InputError, match="has no onset"):
        decided(of_events, make_touch(seed=99))


def test_a_model_of_cut_recordings_takes_their_first_frame(of_events, make_touch):
    of_events.info = replace(of_events.info, onset="first")
    touch = make_touch(seed=99, lead_s=0.0)
    events = decided(of_events, touch)
    assert {event.onset_s for event in events} == {touch.t[0]}
    assert "late" not in events[0].flags
    of_events.info = replace(of_events.info, onset="event")


def test_several_contacts_cannot_have_one_event(of_events):
    with pytest.raises(InputError, match="--contacts 1"):
        edge.Classifier(of_events, max_contacts=2)


def test_a_run_takes_the_event_of_the_recording_that_it_plays(
    of_events, make_touch, tmp_path, edge
):
    from edge.record.saving import save

    path = tmp_path / "touch.npz"
    save(path, with_onset(make_touch(seed=99)))
    _, events, _ = edge("run", "--model", of_events.path, "--fake", path)
    onsets = [event["onset_s"] for event in events if event["event"] == "onset"]
    assert onsets == [pytest.approx(EARLY_S, abs=0.02)]


@pytest.mark.parametrize(
    "onset", ["now", {"source": "who", "times_s": []}, {"source": "event"}]
)
def test_an_onset_that_is_none_is_refused(make_touch, tmp_path, onset):
    touch = make_touch()
    touch.meta["onset"] = onset
    with pytest.raises(InputError, match="meta.onset"):
        edge.save(tmp_path / "a.npz", touch)


def test_a_run_without_a_source_of_events_is_refused(of_events):
    opened = SimpleNamespace(playback=None)
    with pytest.raises(InputError, match="--joints stdin"):
        source._onsets(of_events, None, opened)
    assert source._onsets(None, None, opened) is None
    of_skin = SimpleNamespace(info=SimpleNamespace(dof=None, onset="event"))
    assert source._angles(of_skin) == 0
