"""Trials as `record` saves them: safe names, two recorders in one folder, angles where
known."""

import io
import json
import os
import signal
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from edge import demo
from edge.commands.source import ending_signals
from edge.fake.clock import VirtualClock
from edge.output.event_writer import Lines
from edge.recording import load
from edge.saving import save
from edge.tools import review, terminal
from edge.tools.record import Recorder, Trials, trial_path
from edge.touch.frame import Frame
from tests.conftest import ROOT, full_pipe, started


def test_a_label_becomes_a_name_that_every_folder_takes_and_no_listing_hides(tmp_path):
    for label in (".box", "..", "a/b\0c", "x" * 500, "\U0001f4e6" * 300, ""):
        path = trial_path(tmp_path, {"object": label})
        assert path.parent == tmp_path
        assert not path.name.startswith(".")
        path.write_bytes(b"")


@contextmanager
def recorder(folder, out=None, *, names=None):
    with closing(Lines(out or io.StringIO())) as lines:
        yield Recorder(folder, {"object": "box"}, {}, names, lines)


def frames(*poses):
    counts = np.zeros((2, 2), np.uint16)
    valid = np.ones((2, 2), bool)
    return [Frame(i / 100, counts, valid, joints=pose) for i, pose in enumerate(poses)]


def test_recorders_side_by_side_save_every_trial_under_a_name_of_its_own(tmp_path):
    def record(_):
        with recorder(tmp_path) as mine:
            for _ in range(20):
                mine.save(frames(None), complete=True)

    with ThreadPoolExecutor(2) as threads:
        list(threads.map(record, range(2)))
    assert len(list(tmp_path.glob("box-*.npz"))) == 40


def test_a_trial_keeps_its_joints_names_where_some_frames_have_no_pose(
    tmp_path, caplog
):
    out = io.StringIO()
    with recorder(tmp_path, out, names=("shoulder", "elbow")) as mine:
        mine.save(frames(np.array([0.1, 0.2]), None), complete=True)
    trial = load(tmp_path / "box-001.npz")
    assert trial.joint_names == ("shoulder", "elbow")
    assert json.loads(out.getvalue())["frames_without_joints"] == 1
    assert trial.joints[0].tolist() == [0.1, 0.2]
    assert caplog.messages[-1:] == [
        f"{tmp_path}/box-001.npz: 1 of 2 frames have no joint angles"
    ]


@pytest.fixture
def record(edge, recordings, tmp_path):
    """Record a touch, labelled object=foam, into a folder."""

    def run(*options, fake=recordings / "soft_1.npz", out=tmp_path / "trials"):
        return edge(
            "record",
            "--fake",
            fake,
            "--label",
            "object=foam",
            "--out",
            out,
            *options,
        )

    return run


def test_record_saves_a_trial_with_its_lead_in(record, recordings):
    source = load(recordings / "soft_1.npz")
    given = ("--label", "category=soft-fixed", "--length", 1.3)
    status, (event,), _ = record(*given)
    assert status == 0
    assert event["complete"]
    assert event["joints"]
    trial = load(event["file"])
    assert trial.labels == {"object": "foam", "category": "soft-fixed"}
    assert Path(event["file"]).name == "foam-soft-fixed-001.npz"
    # Onset is at frame 20: 20 frames of lead-in, and 130 from onset on, the last
    # included.
    np.testing.assert_array_equal(trial.frames, source.frames[:151])
    np.testing.assert_array_equal(trial.joints, source.joints[:151])
    np.testing.assert_allclose(trial.t, np.arange(151) * 0.01, atol=1e-9)
    assert trial.layout == source.layout
    assert trial.valid is None


def test_record_keeps_the_names_of_a_recordings_joints(record, recordings, tmp_path):
    source = load(recordings / "soft_1.npz")
    names = [f"joint {i}" for i in range(source.joints.shape[1])]
    path = tmp_path / "named.npz"
    save(path, replace(source, meta={**source.meta, "joint_names": names}))
    _, (event,), _ = record(fake=path)
    assert load(event["file"]).joint_names == tuple(names)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_record_saves_the_trial_that_has_begun_when_it_is_told_to_end(
    record,
    recordings,
    monkeypatch,
    number,
):
    push = Trials.push
    pushed = []

    def interrupted(trials, frame):
        pushed.append(frame)
        if len(pushed) == 61:
            signal.raise_signal(number)
        return push(trials, frame)

    monkeypatch.setattr(Trials, "push", interrupted)
    before = signal.signal(number, signal.SIG_DFL)  # nohup, for one, has SIGHUP ignored
    try:
        status, (event,), _ = record()
    finally:
        signal.signal(number, before)
    assert status == 0
    assert not event["complete"]
    assert len(pushed) == 61
    # Onset is at frame 20.
    source = load(recordings / "soft_1.npz").frames
    np.testing.assert_array_equal(load(event["file"]).frames, source[:61])


def test_a_hangup_is_ignored_where_it_was_ignored_at_the_start():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        assert signal.SIGHUP not in ending_signals()
    finally:
        signal.signal(signal.SIGHUP, before)


def test_record_without_any_of_the_joint_angles_that_it_was_to_have_fails(record):
    began = time.monotonic()
    status, (event,), err = record("--joints", "udp:0", "--dof", 5, "--seconds", 0.5)
    assert status == 1
    assert not event["joints"]
    assert "--joints gave no angles at the times of the frames" in err
    assert (
        time.monotonic() - began > 0.4
    )  # it plays in real time, as angles come in real time


def test_record_is_not_held_up_by_a_stdout_that_nobody_reads(parted, tmp_path):
    out = tmp_path / "trials"
    reading, writing = full_pipe()
    given = ("--fake", parted, "--loop", "--label", "object=a", "--out", out)
    process = started("record", *given, stdout=writing)
    while len(list(out.glob("a-*.npz"))) < 3:
        assert process.poll() is None
        time.sleep(0.02)
    process.send_signal(signal.SIGTERM)
    _, err = process.communicate(timeout=30)
    os.close(reading)
    os.close(writing)
    assert process.returncode == 0
    assert "lines could not be sent to stdout: nobody reads them" in err


def test_record_saves_one_trial_a_contact_and_never_overwrites(
    record,
    parted,
    tmp_path,
):
    options = ("--loop", "--label", "kind=a b/c", "--length", 1.2, "--trials")
    assert [len(record(*options, n, fake=parted)[1]) for n in (2, 1)] == [2, 1]
    names = sorted(p.name for p in (tmp_path / "trials").iterdir())
    assert names == [f"foam-a_b_c-00{n}.npz" for n in (1, 2, 3)]


def test_record_refuses_a_file_that_exists_before_it_waits(record, tmp_path):
    path = tmp_path / "one.npz"
    assert record(out=path)[0] == 0
    kept = path.read_bytes()
    status, _, err = record(out=path)
    assert status == 2
    assert f"{path}: exists already" in err
    assert path.read_bytes() == kept


def test_record_without_contact_saves_nothing(record, quiet, tmp_path):
    status, events, err = record(fake=quiet)
    assert status == 1
    assert events == []
    assert "no contact was saved" in err
    assert not list((tmp_path / "trials").iterdir())


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ([], "give --label TASK=LABEL"),
        (["--web", "127.0.0.1:0", "--out", "one.npz"], "give --label TASK=LABEL"),
        (["--label", "a=b", "--label", "a=c"], "--label names a task twice"),
        (
            ["--label", "a=b", "--out", "a" * 300 + ".npz"],
            "cannot be written: File name too long",
        ),
        (
            ["--label", "a=b", "--out", "a" * 300],
            "cannot be written: File name too long",
        ),
        (["--label", "a=b", "--joints", "stdin"], "--joints needs --arm, or --dof"),
    ],
)
def test_record_says_what_it_needs(quiet, options, said, refused):
    assert said in refused("record", "--fake", quiet, *options)


def test_a_contact_cut_off_by_the_end_is_saved_as_incomplete(record):
    status, (event,), _ = record("--seconds", 1.0)
    assert status == 0
    assert not event["complete"]
    assert event["seconds"] == 0.99


def test_a_page_may_give_the_labels(edge, parted, tmp_path, monkeypatch):
    """Until the page has given a label and records, contacts are not saved."""
    pushed = []

    def push(page, frame, *_):
        pushed.append(frame)
        if len(pushed) == 2:
            page.labels = {"object": "from the page"}
            page.recording = True

    monkeypatch.setattr("edge.tools.page.Page.push", push)
    monkeypatch.setattr("edge.fake.clock.PacedClock", VirtualClock)

    given = ("--web", "127.0.0.1:0", "--out", tmp_path)
    status, events, _ = edge("record", "--fake", parted, *given)
    assert status == 0
    saved = [event for event in events if event["event"] == "saved"]
    assert {event["labels"]["object"] for event in saved} == {"from the page"}


def test_a_contact_that_the_end_cuts_off_is_not_saved_while_the_page_does_not_record(
    edge,
    parted,
    tmp_path,
    monkeypatch,
):
    monkeypatch.setattr("edge.fake.clock.PacedClock", VirtualClock)
    given = ("--web", "127.0.0.1:0", "--out", tmp_path / "trials", "--seconds", 1.0)
    assert edge("record", "--fake", parted, *given)[:2] == (1, [])
    assert list((tmp_path / "trials").iterdir()) == []


def test_keys_choose_the_label_and_delete_the_last_trial(
    edge,
    parted,
    tmp_path,
    monkeypatch,
):
    """The first of a task's labels holds until the number of another is pressed."""
    trials = tmp_path / "trials"
    script = [(1, "2"), (2, "d")]  # once there are so many files, this key

    @contextmanager
    def keys(stop):
        def typed():
            due = script and len(list(trials.glob("*.npz"))) == script[0][0]
            return script.pop(0)[1] if due else ""

        yield typed

    monkeypatch.setattr(terminal, "is_interactive", lambda: True)
    monkeypatch.setattr(terminal, "keys", keys)
    labels = ("--label", "touch=soft", "--label", "touch=hard", "--label", "hand=left")
    given = ("--fake", parted, "--loop", "--trials", 3, "--out", trials, *labels)
    status, events, err = edge("record", *given)
    assert status == 0
    assert [(e["event"], Path(e["file"]).name) for e in events] == [
        ("saved", "soft-left-001.npz"),
        ("saved", "hard-left-001.npz"),
        ("deleted", "hard-left-001.npz"),
        ("saved", "hard-left-002.npz"),
        ("saved", "hard-left-003.npz"),
    ]
    assert "next: touch=hard, hand=left" in err
    assert edge("label", trials, "--undo")[0] == 0
    assert (trials / "hard-left-001.npz").exists()


def test_a_trial_has_the_labels_that_held_when_its_touch_began(tmp_path):
    begun = SimpleNamespace(under_way=False)
    with recorder(tmp_path) as mine:
        mine.choices = [("object", "box"), ("object", "pillow")]
        mine.follow(begun)
        begun.under_way = True
        mine.press("2")
        mine.follow(begun)
        mine.save(frames(None), complete=True)
        begun.under_way = False
        mine.follow(begun)
        mine.save(frames(None), complete=True)
    assert sorted(path.name for path in tmp_path.glob("*.npz")) == [
        "box-001.npz",
        "pillow-001.npz",
    ]


def test_the_page_says_of_a_touch_that_its_onset_was_not_recorded(tmp_path):
    notices = []
    page = SimpleNamespace(labels={}, recording=False, notice=notices.append)
    with recorder(tmp_path) as mine:
        mine.page = page
        mine.follow(SimpleNamespace(under_way=False))
        page.recording = True
        mine.follow(SimpleNamespace(under_way=True))
        mine.save(frames(None), complete=True)
    assert list(tmp_path.iterdir()) == []
    (notice,) = notices
    assert "whose onset is missing: it is not saved" in notice


def test_a_trial_keeps_what_a_model_said_of_its_touch(edge, tmp_path):
    touch = demo.FOLDER / "pillow-movable.npz"
    given = ("--fake", touch, "--label", "object=cushion", "--out", tmp_path / "a.npz")
    status, events, _ = edge("record", "--model", demo.MODEL, *given)
    assert status == 0
    kinds = [event["event"] for event in events]
    assert kinds.index("decision") < kinds.index("saved")
    trial = load(tmp_path / "a.npz")
    assert trial.labels == {"object": "cushion"}
    assert trial.meta["decided"]["object"]["label"] == "pillow"
    assert "arm" in trial.meta
    assert "wrong" in review.kinds(trial.meta)


def test_a_model_brings_the_arm_that_it_needs(refused, tmp_path):
    touch = demo.FOLDER / "pillow-movable.npz"
    given = ("--fake", touch, "--label", "object=a", "--out", tmp_path / "a.npz")
    arm = tmp_path / "arm.toml"
    arm.write_text((ROOT / "edge/arms/cody.toml").read_text())
    said = refused("record", "--model", demo.MODEL, *given, "--arm", arm)
    assert "leave --arm out" in said
    save(tmp_path / "unposed.npz", replace(load(touch), joints=None))
    words = ("--fake", tmp_path / "unposed.npz", *given[2:])
    said = refused("record", "--model", demo.MODEL, *words)
    assert f"no joint angles, but {demo.MODEL} has 5 joints" in said
