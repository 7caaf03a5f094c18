"""Recordings are read back as they were written, and a wrong file gets one sentence."""

import io
import zipfile
from dataclasses import replace
from resource import RUSAGE_SELF, getrusage

import numpy as np
import pytest

from edge.errors import InputError
from edge.record.npz import LARGEST_BYTES
from edge.record.recording import Recording, load
from edge.record.saving import find, save


def test_what_is_saved_is_loaded(make_touch, tmp_path):
    recording = make_touch()
    valid = np.ones(recording.frames.shape, dtype=bool)
    valid[3, 4, 5] = False
    full = replace(recording, valid=valid)
    save(tmp_path / "a.npz", full)
    back = load(tmp_path / "a.npz")
    for name in ("t", "frames", "joints", "valid"):
        assert getattr(back, name).tobytes() == getattr(full, name).tobytes()
    assert back.meta == recording.meta
    assert back.labels == {"category": "rigid-fixed", "object": "hard 0"}
    assert [f.t for f in back] == recording.t.tolist()
    assert not list(back)[3].valid[4, 5]


def test_named_joints_are_given_in_the_order_asked_for(make_touch):
    touch = make_touch()
    names = {"joint_names": ["wheel", "elbow", "shoulder"]}
    recording = replace(touch, joints=touch.joints[:, :3], meta=names)
    picked = recording.for_joints(["shoulder", "elbow"], "a.npz")
    np.testing.assert_array_equal(picked.joints, recording.joints[:, [2, 1]])
    assert picked.joint_names == ("shoulder", "elbow")
    with pytest.raises(
        InputError, match=r"a.npz: no angle of the arm's joint wrist; there are w"
    ):
        recording.for_joints(["wrist", "elbow"], "a.npz")
    assert touch.for_joints(["a", "b"]) is touch


def test_the_same_recording_gives_the_same_bytes(make_touch, tmp_path):
    save(tmp_path / "a.npz", make_touch())
    save(tmp_path / "b.npz", make_touch())
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_a_recording_that_is_wrong_is_not_written(make_touch, tmp_path):
    recording = make_touch()
    with pytest.raises(InputError, match="time goes back at frame 1"):
        save(tmp_path / "a.npz", Recording(recording.t[::-1], recording.frames))
    assert not list(tmp_path.iterdir())


FLAT = np.ones((180, 384), np.uint16)
WRONG = [
    ({"t": None}, "t is missing"),
    ({"frames": np.ones((180, 16, 24), complex)}, "frames must be uint16"),
    (
        {"frames": FLAT, "meta": '{"skin": {"rows": -16, "cols": -24}}'},
        'give their "rows" and "cols"',
    ),
    ({"frames": lambda frames: frames[:0], "t": np.ones(0)}, "frames are empty"),
    ({"t": lambda t: t[1:]}, r"t must be float64 \(180,\)"),
    ({"t": lambda t: np.append(t[1:], 0.0)}, "time goes back at frame 179"),
    ({"t": lambda t: t * np.nan}, "t of frame 0 is not finite"),
    (
        {"joints": lambda q: np.where(np.arange(180)[:, None] == 7, np.inf, q)},
        "joint angle of frame 7 is not finite",
    ),
    ({"valid": np.ones((2, 2), bool)}, "valid must be bool"),
    ({"meta": 3}, "meta must be one JSON text"),
    ({"meta": "{"}, "meta: not JSON"),
    ({"meta": '{"labels": {"a": true}}'}, "meta.labels and meta.contacts must map"),
    (
        {"meta": '{"joint_names": ["a"]}'},
        "number of meta.joint_names is 1, of joint angles 5",
    ),
    (
        {"meta": '{"joint_names": ["a", "b", "c", "d", "a"]}'},
        "meta.joint_names must be a list of different names",
    ),
    ({"meta": '{"skin": {"rows": 3}}'}, "frames are 16 x 24"),
    ({"meta": np.array([None])}, "Object arrays cannot be loaded"),
]
"""Arrays to replace, to change or, where None, to leave out, and the sentence."""


@pytest.mark.parametrize(("changes", "sentence"), WRONG)
def test_what_is_wrong_is_said_in_one_sentence_that_names_the_file(
    changes,
    sentence,
    make_touch,
    tmp_path,
):
    path = tmp_path / "wrong.npz"
    touch = make_touch()
    arrays = {"t": touch.t, "frames": touch.frames, "joints": touch.joints}
    arrays["meta"] = "{}"
    for key, change in changes.items():
        arrays[key] = change(arrays[key]) if callable(change) else change
        if change is None:
            del arrays[key]
    np.savez(path, **arrays)
    with pytest.raises(InputError, match=sentence) as caught:
        load(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("kind", [np.int64, np.float32, ">u2"])
def test_whole_numbers_of_any_type_and_taxels_in_a_row_are_counts(kind, tmp_path):
    counts = np.arange(2 * 12).reshape(2, 12)
    meta = {"labels": {"object": np.int64(3)}, "skin": {"rows": 3, "cols": 4}}
    recording = Recording(
        np.array([0.0, 0.5], np.float32),
        counts.astype(kind),
        meta=meta,
    )
    save(tmp_path / "a.npz", recording)
    back = load(tmp_path / "a.npz")
    assert back.frames.dtype == np.dtype(np.uint16)
    assert back.t.dtype == np.dtype(np.float64)
    assert (back.frames == counts.reshape(2, 3, 4)).all()
    assert back.labels == {"object": "3"}
    text = '{"labels": {"object": 3}, "skin": {"rows": 3, "cols": 4}}'
    np.savez(tmp_path / "b.npz", t=back.t, frames=recording.frames, meta=text)
    flat = load(tmp_path / "b.npz")
    assert (flat.frames == back.frames).all()
    assert flat.labels == back.labels


@pytest.mark.parametrize(
    ("factor", "warning"),
    [
        (1.0, ""),
        (1e3, "has a median of 0.1 frames a second; t is in seconds"),
        (1e-3, "has a median of 100000 frames a second; t is in seconds"),
        (0.0, "t is in seconds"),
    ],
)
def test_times_that_do_not_seem_to_be_in_seconds_are_named(
    make_touch,
    tmp_path,
    caplog,
    factor,
    warning,
):
    recording = make_touch()
    save(tmp_path / "a.npz", replace(recording, t=recording.t * factor))
    assert warning in caplog.text
    assert bool(caplog.text) == bool(warning)
    messages = caplog.messages.copy()
    load(tmp_path / "a.npz")
    assert caplog.messages == 2 * messages


def test_a_folder_without_recordings_is_named(tmp_path):
    with pytest.raises(InputError, match="no .npz recording in this folder"):
        find([str(tmp_path)])


def test_a_header_that_claims_more_than_the_file_holds_takes_no_memory(tmp_path):
    path = tmp_path / "huge.npz"
    for kind, shape in (
        ("<u2", (10**9, 16, 24)),
        ("<U500000000", (1,)),
    ):
        header = io.BytesIO()
        claim = {"descr": kind, "fortran_order": False, "shape": shape}
        np.lib.format.write_array_header_1_0(header, claim)
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("frames.npy", header.getvalue())
        before = getrusage(RUSAGE_SELF).ru_maxrss
        with pytest.raises(InputError, match="huge.npz: not a readable .npz file"):
            load(path)
        assert getrusage(RUSAGE_SELF).ru_maxrss - before < 50_000  # kB


def test_arrays_that_unpack_to_more_than_the_limit_are_refused(tmp_path):
    path = tmp_path / "bomb.npz"
    np.savez_compressed(path, frames=np.zeros(LARGEST_BYTES, np.uint8))
    with pytest.raises(
        InputError, match="claims arrays of more than 134217728 bytes; split it"
    ):
        load(path)


def sheared(recording: Recording) -> Recording:
    """The recording of a skin of three axes, whose shear is a quarter of its counts."""
    quarter = (recording.frames // 4).astype(np.int16)
    return replace(recording, shear=np.stack([quarter, -quarter], axis=3))


def test_shear_is_saved_and_each_frame_has_its_own(make_touch, tmp_path):
    touch = sheared(make_touch())
    save(tmp_path / "a.npz", touch)
    back = load(tmp_path / "a.npz")
    assert back.shear.dtype == np.int16
    assert back.shear.tobytes() == touch.shear.tobytes()
    assert back.layout.axes == 3
    assert list(back)[5].shear.tobytes() == touch.shear[5].tobytes()


def test_a_skin_of_three_axes_without_shear_is_refused(make_touch, tmp_path):
    wrong = replace(make_touch(), meta={"skin": {"axes": 3}})
    with pytest.raises(InputError, match="axes = 3, but shear is missing"):
        save(tmp_path / "a.npz", wrong)


def test_an_axis_that_never_changes_is_said(make_touch, tmp_path, caplog):
    touch = sheared(make_touch())
    still = touch.shear.copy()
    still[..., 1] = 0
    save(tmp_path / "a.npz", replace(touch, shear=still))
    assert "a.npz: its shear never changes along an axis" in caplog.text


def test_a_part_whose_name_is_damaged_or_unknown_is_refused_and_not_ignored(
    tmp_path, make_touch
):
    path = tmp_path / "a.npz"
    save(path, make_touch())
    content = path.read_bytes()
    at = content.rindex(b"joints.npy")
    for place in range(at, at + len("joints.npy")):
        path.write_bytes(
            content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :]
        )
        with pytest.raises(InputError, match="a.npz: .*copy or record it again"):
            load(path)
    path.write_bytes(content)
    with zipfile.ZipFile(path, "a") as archive, pytest.warns(match="Duplicate"):
        archive.writestr("joints.npy", archive.read("joints.npy"))
    with pytest.raises(InputError, match="has a part 'joints.npy', which no recording"):
        load(path)
