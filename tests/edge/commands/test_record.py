"""Trials as `record` saves them: safe names, two recorders in one folder, angles where known."""

import threading

import numpy as np

from edge.commands.record import recording, trial_path
from edge.files import NameTaken
from edge.recording import Recording, load, save
from edge.touch.frame import Frame


def test_a_label_becomes_a_name_that_every_folder_takes_and_no_listing_hides(tmp_path):
    for label in (".box", "..", "a/b\0c", "x" * 500, "\U0001f4e6" * 300, ""):
        path = trial_path(str(tmp_path), {"object": label})
        assert path.parent == tmp_path
        assert not path.name.startswith(".")
        path.write_bytes(b"")


def test_recorders_side_by_side_save_every_trial_under_a_name_of_its_own(tmp_path):
    trial = Recording(np.array([0.0]), np.zeros((1, 2, 2), np.uint16))

    def record():
        for _ in range(20):
            while True:
                try:
                    save(trial_path(str(tmp_path), {"object": "box"}), trial, overwrite=False)
                    break
                except NameTaken:
                    continue

    recorders = [threading.Thread(target=record) for _ in range(2)]
    for recorder in recorders:
        recorder.start()
    for recorder in recorders:
        recorder.join()
    assert len(list(tmp_path.glob("box-*.npz"))) == 40


def test_a_frame_without_a_pose_keeps_the_angles_of_the_others(tmp_path):
    counts = np.zeros((2, 2), np.uint16)
    poses = [np.array([0.1, 0.2]), None, np.array([0.3, 0.4])]
    frames = [Frame(i / 100, counts, joints=pose) for i, pose in enumerate(poses)]
    save(tmp_path / "a.npz", recording(frames, {}))
    back = load(tmp_path / "a.npz")
    assert np.isnan(back.joints).tolist() == [[False] * 2, [True] * 2, [False] * 2]
    assert [None if f.joints is None else f.joints.tolist() for f in back] == [
        [0.1, 0.2],
        None,
        [0.3, 0.4],
    ]


def test_frames_of_which_none_has_a_pose_have_no_angles():
    frames = [Frame(i / 100, np.zeros((2, 2), np.uint16)) for i in range(3)]
    assert recording(frames, {}).joints is None
