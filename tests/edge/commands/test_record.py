"""Trials as `record` saves them: safe names, two recorders in one folder, angles where known."""

import io
import threading
from contextlib import contextmanager

import numpy as np

from edge.commands.record import Recorder, recording, trial_path
from edge.recording import load, save
from edge.runtime.event_writer import Lines
from edge.touch.frame import Frame


def test_a_label_becomes_a_name_that_every_folder_takes_and_no_listing_hides(tmp_path):
    for label in (".box", "..", "a/b\0c", "x" * 500, "\U0001f4e6" * 300, ""):
        path = trial_path(str(tmp_path), {"object": label})
        assert path.parent == tmp_path
        assert not path.name.startswith(".")
        path.write_bytes(b"")


@contextmanager
def recorder(folder, *, names=None, posed=False):
    with Lines(io.StringIO()) as lines:
        yield Recorder(str(folder), {"object": "box"}, {}, names, lines, posed)


def frames(*poses):
    return [
        Frame(i / 100, np.zeros((2, 2), np.uint16), joints=pose) for i, pose in enumerate(poses)
    ]


def test_recorders_side_by_side_save_every_trial_under_a_name_of_its_own(tmp_path):
    def record():
        with recorder(tmp_path) as mine:
            for _ in range(20):
                mine.save(frames(None), complete=True)

    recorders = [threading.Thread(target=record) for _ in range(2)]
    for one in recorders:
        one.start()
    for one in recorders:
        one.join()
    assert len(list(tmp_path.glob("box-*.npz"))) == 40


def test_a_trial_keeps_its_joints_names_where_some_frames_have_no_pose(tmp_path, caplog):
    with recorder(tmp_path, names=("shoulder", "elbow"), posed=True) as mine:
        mine.save(frames(np.array([0.1, 0.2]), None), complete=True)
    trial = load(tmp_path / "box-001.npz")
    assert trial.joint_names == ("shoulder", "elbow")
    assert trial.joints[0].tolist() == [0.1, 0.2]
    assert caplog.messages == [f"{tmp_path}/box-001.npz: 1 of 2 frames have no joint angles"]


def test_a_skin_without_an_arm_is_not_warned_of(tmp_path, caplog):
    with recorder(tmp_path) as mine:
        mine.save(frames(None, None), complete=True)
    assert load(tmp_path / "box-001.npz").joints is None
    assert caplog.messages == []


def test_a_frame_without_a_pose_keeps_the_angles_of_the_others(tmp_path):
    poses = [np.array([0.1, 0.2]), None, np.array([0.3, 0.4])]
    save(tmp_path / "a.npz", recording(frames(*poses), {}))
    back = load(tmp_path / "a.npz")
    assert np.isnan(back.joints).tolist() == [[False] * 2, [True] * 2, [False] * 2]
    assert [None if f.joints is None else f.joints.tolist() for f in back] == [
        [0.1, 0.2],
        None,
        [0.3, 0.4],
    ]


def test_frames_of_which_none_has_a_pose_have_no_angles():
    assert recording(frames(None, None, None), {}).joints is None
