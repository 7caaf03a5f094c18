"""Trials as `record` saves them: safe names, two recorders in one folder, angles where
known."""

import io
import signal
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from edge import demo
from edge.app import review
from edge.app.commands.record import Recorder, trial_path
from edge.app.sinks.event_writer import Lines
from edge.app.source import ending_signals
from edge.app.trials import Segmenter
from edge.record.recording import load
from edge.record.saving import save
from edge.touch.frame import Frame
from edge.wire.fake import player
from edge.wire.fake.clock import VirtualClock
from tests.conftest import ROOT, in_a_row


def test_a_label_becomes_a_name_that_every_folder_takes_and_no_listing_hides(tmp_path):
    for label in (".box", "..", "a/b\0c", "x" * 500, "\U0001f4e6" * 300, ""):
        path = trial_path(tmp_path, {"object": label})
        assert path.parent == tmp_path
        assert not path.name.startswith(".")
        path.write_bytes(b"")


@contextmanager
def recorder(folder, *, page=None, **options):
    with closing(Lines(io.StringIO())) as lines:
        options = {"names": None, "page": page, **options}
        yield Recorder(folder, {"object": "box"}, {}, lines=lines, **options)


def frames(*poses):
    counts = np.zeros((2, 2), np.uint16)
    valid = np.ones((2, 2), bool)
    return [Frame(i / 100, counts, valid, joints=pose) for i, pose in enumerate(poses)]


def test_recorders_side_by_side_save_every_trial_under_a_name_of_its_own(tmp_path):
    def record(_):
        with recorder(tmp_path) as writer:
            for _ in range(20):
                writer.save(frames(None), complete=True)

    with ThreadPoolExecutor(2) as threads:
        list(threads.map(record, range(2)))
    assert len(list(tmp_path.glob("box-*.npz"))) == 40


def test_a_trial_keeps_its_joints_names_where_some_frames_have_no_pose(
    tmp_path, caplog
):
    with recorder(tmp_path, names=("shoulder", "elbow")) as writer:
        writer.save(frames(np.array([0.1, 0.2]), None), complete=True)
    trial = load(tmp_path / "box-001.npz")
    assert trial.joint_names == ("shoulder", "elbow")
    assert trial.joints[0].tolist() == [0.1, 0.2]
    assert caplog.messages[-1:] == [
        f"{tmp_path}/box-001.npz: 1 of 2 frames have no joint angles"
    ]


@pytest.fixture
def trials(tmp_path):
    """The folder to record into."""
    return tmp_path / "trials"


@pytest.fixture
def record(edge, recordings, trials):
    """Record a touch, labelled object=foam, into a folder."""

    def run(*options, fake=recordings / "soft_1.npz", out=trials):
        words = ("--fake", fake, "--label", "object=foam", "--out", out)
        return edge("record", *words, *options)

    return run


@pytest.fixture
def brief(make_touch, tmp_path):
    """The path of a touch of 0.2 s."""
    save(tmp_path / "brief.npz", make_touch(seconds=0.2))
    return tmp_path / "brief.npz"


def test_record_saves_a_trial_with_its_lead_in(record, recordings):
    source = load(recordings / "soft_1.npz")
    options = ("--label", "category=soft-fixed", "--length", 0.3, "--trials", 1)
    status, (event,), _ = record(*options)
    assert status == 0
    assert event["complete"]
    assert event["joints"]
    trial = load(event["file"])
    assert trial.labels == {"object": "foam", "category": "soft-fixed"}
    assert Path(event["file"]).name == "foam-soft-fixed-001.npz"
    # Onset is at frame 20: 20 frames of lead-in, and 30 from onset on, the last
    # included.
    np.testing.assert_array_equal(trial.frames, source.frames[:51])
    np.testing.assert_array_equal(trial.joints, source.joints[:51])
    np.testing.assert_allclose(trial.t, np.arange(51) * 0.01, atol=1e-9)
    assert trial.layout == source.layout
    assert trial.valid is None


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_record_saves_the_trial_that_has_begun_when_it_is_told_to_end(
    record,
    recordings,
    monkeypatch,
    number,
):
    push = Segmenter.push
    pushed = []

    def interrupted(trials, frame):
        pushed.append(frame)
        if len(pushed) == 31:
            signal.raise_signal(number)
        return push(trials, frame)

    monkeypatch.setattr(Segmenter, "push", interrupted)
    before = signal.signal(number, signal.SIG_DFL)  # nohup, for one, has SIGHUP ignored
    try:
        status, (event,), _ = record()
    finally:
        signal.signal(number, before)
    assert status == 0
    assert not event["complete"]
    assert len(pushed) == 31
    # Onset is at frame 20.
    source = load(recordings / "soft_1.npz").frames
    np.testing.assert_array_equal(load(event["file"]).frames, source[:31])


def test_a_hangup_is_ignored_where_it_was_ignored_at_the_start():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        assert signal.SIGHUP not in ending_signals()
    finally:
        signal.signal(signal.SIGHUP, before)


def test_record_without_any_of_the_joint_angles_that_it_was_to_have_fails(
    record, monkeypatch
):
    clocks = []

    class Paced(player.PacedClock):
        def __init__(self):
            super().__init__()
            clocks.append(self)

    monkeypatch.setattr(player, "PacedClock", Paced)
    arm = ("--arm", ROOT / "edge/arms/cody.toml")
    status, (event,), err = record("--joints", "udp:0", *arm, "--seconds", 0.5)
    assert status == 1
    assert not event["joints"]
    assert "--joints gave no angles at the times of the frames" in err
    assert len(clocks) == 1  # it plays in real time, as angles come in real time


def test_record_saves_one_trial_a_contact_and_never_overwrites(record, brief, trials):
    options = ("--loop", "--label", "kind=a b/c", "--trials")
    assert [len(record(*options, n, fake=brief)[1]) for n in (2, 1)] == [2, 1]
    names = sorted(path.name for path in trials.iterdir())
    assert names == [f"foam-a_b_c-00{n}.npz" for n in (1, 2, 3)]


def test_record_names_a_broken_taxel_which_is_not_valid_in_its_trials(
    record, make_touch, tmp_path
):
    touches = in_a_row(*[make_touch(seed=seed) for seed in (0, 1)], rest=60)
    flickers = 500 * (np.random.default_rng(0).random(len(touches.t)) < 0.5)
    touches.frames[:, 15, 8] += flickers.astype(np.uint16)
    save(tmp_path / "flickers.npz", touches)
    _, events, _ = record(fake=tmp_path / "flickers.npz")
    (broken,) = (event for event in events if event["event"] == "broken")
    assert broken["taxels"] == [[15, 8]]
    trial = load([event["file"] for event in events if event["event"] == "saved"][-1])
    assert not trial.valid[:, 15, 8].any()
    assert not trial.frames[:, 15, 8].any()


def test_record_without_contact_saves_nothing(record, quiet, trials):
    status, events, err = record("--seconds", 0.3, fake=quiet)
    assert status == 1
    assert events == []
    assert "no contact was saved" in err
    assert not list(trials.iterdir())


TOO_LONG = "cannot be written: File name too long"
LABEL = ["--label", "a=b"]


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ([], "give --label TASK=LABEL"),
        ([*LABEL, "--label", "a=c"], "--label names a task twice"),
        ([*LABEL, "--out", "a" * 300], TOO_LONG),
        ([*LABEL, "--joints", "stdin"], "--joints needs --arm"),
    ],
)
def test_record_says_what_it_needs(options, sentence, refused):
    assert sentence in refused("record", "--fake", demo.recordings()[0], *options)


@pytest.fixture
def record_with_page(edge, brief, trials, monkeypatch):
    """Record with a page, as fast as the machine can; returns status and events."""
    monkeypatch.setattr("edge.wire.fake.clock.PacedClock", VirtualClock)
    words = ("--fake", brief, "--web", "127.0.0.1:0", "--out", trials)
    return lambda: edge("record", *words)[:2]


def test_a_page_may_give_the_labels(record_with_page, monkeypatch):
    """Until the page has given a label and records, contacts are not saved."""

    def push(page, frame, *_):
        page.labels = {"object": "from the page"}
        page.recording = True

    monkeypatch.setattr("edge.app.sinks.page.Page.push", push)
    status, (event,) = record_with_page()
    assert status == 0
    assert event["event"] == "saved"
    assert event["labels"] == {"object": "from the page"}


def test_a_contact_that_the_end_cuts_off_is_not_saved_while_the_page_does_not_record(
    record_with_page, trials
):
    assert record_with_page() == (1, [])
    assert list(trials.iterdir()) == []


def test_a_trial_has_the_labels_that_held_when_its_touch_began(tmp_path):
    begun = SimpleNamespace(under_way=False)
    page = SimpleNamespace(recording=True, saved=lambda: None)
    page.labels = {"object": "box"}
    with recorder(tmp_path, page=page) as writer:
        writer.follow(begun)
        begun.under_way = True
        page.labels = {"object": "pillow"}
        writer.follow(begun)
        writer.save(frames(None), complete=True)
        begun.under_way = False
        writer.follow(begun)
        writer.save(frames(None), complete=True)
    names = sorted(path.name for path in tmp_path.glob("*.npz"))
    assert names == ["box-001.npz", "pillow-001.npz"]


def test_the_page_says_of_a_touch_that_its_onset_was_not_recorded(tmp_path):
    notices = []
    page = SimpleNamespace(labels={}, recording=False, notice=notices.append)
    with recorder(tmp_path, page=page) as writer:
        writer.follow(SimpleNamespace(under_way=False))
        page.recording = True
        writer.follow(SimpleNamespace(under_way=True))
        writer.save(frames(None), complete=True)
    assert list(tmp_path.iterdir()) == []
    (notice,) = notices
    assert "whose onset is missing: it is not saved" in notice


PILLOW = demo.FOLDER / "pillow-movable.npz"
WITH_MODEL = ("record", "--model", demo.MODEL, "--label", "object=cushion")


def test_a_trial_keeps_what_a_model_said_of_its_touch(edge, tmp_path):
    options = ("--fake", PILLOW, "--out", tmp_path)
    status, events, _ = edge(*WITH_MODEL, *options)
    assert status == 0
    kinds = [event["event"] for event in events]
    assert kinds.index("decision") < kinds.index("saved")
    trial = load(tmp_path / "cushion-001.npz")
    assert trial.labels == {"object": "cushion"}
    assert trial.meta["decided"]["object"]["label"] == "pillow"
    assert "arm" in trial.meta
    assert "wrong" in review.kinds(trial.meta, trial.labels)


def test_a_model_brings_the_arm_that_it_needs(refused, tmp_path):
    command = (*WITH_MODEL, "--out", tmp_path, "--fake")
    arm = ROOT / "edge/arms/cody.toml"
    assert "leave --arm out" in refused(*command, PILLOW, "--arm", arm)
    unposed = tmp_path / "unposed.npz"
    save(unposed, replace(load(PILLOW), joints=None))
    message = refused(*command, unposed)
    assert f"no joint angles, but {demo.MODEL} has 5 joints" in message
