"""Logs of ROS, made here and imported through the command."""

import json
import shutil
import struct
from types import SimpleNamespace

import numpy as np
import pytest

from edge.record.recording import load
from tests.train.importers.ros import (
    COLS,
    FRAMES,
    JOINT_T,
    JOINTS,
    NAMES,
    ROWS,
    N,
    T,
    array,
    camera,
    damaged,
    image,
    joint_state,
    joints,
    sensor,
    skin,
    write_bag,
    write_mcap,
)
from train.__main__ import main
from train.importers import rosbag
from train.importers.axes import Axes
from train.importers.options import LogOptions
from train.importers.topics import values_of

SHAPE = ("--shape", f"{ROWS}x{COLS}")
BESIDE = {"labels": {"object": "cup"}, "skin": {"threshold_counts": 50, "wraps": True}}


@pytest.fixture
def bag(tmp_path):
    """The function that writes a bag of topics, with the file beside it."""

    def write(*topics, beside=None, name="grasp", **options):
        if beside is not None:
            (tmp_path / "grasp.json").write_text(json.dumps(beside))
        return write_bag(tmp_path / name, *topics, **options)

    return write


@pytest.fixture
def arm(tmp_path):
    tables = [f'[[joint]]\nname = "{name}"\naxis = [0, 0, 1]\n' for name in NAMES]
    (tmp_path / "arm.toml").write_text("".join(tables))
    return "--arm", tmp_path / "arm.toml"


@pytest.fixture
def imported(tmp_path):
    """The function that imports a log and gives its recording."""

    def run(path, *options):
        out = tmp_path / "out"
        words = ["import", "rosbag", path, "--out", out, *options]
        assert main([*map(str, words)]) == 0
        (file,) = out.glob("*.npz")
        return load(file)

    return run


def differences(recording, *, with_joints=True):
    """What of the recording is not as it was written into the log."""
    angles = np.transpose([np.interp(T, JOINT_T, column) for column in JOINTS.T])
    expected = pytest.approx(angles, abs=1e-4) if with_joints else None
    same = {
        "frames": np.array_equal(recording.frames, FRAMES),
        "t": recording.t == pytest.approx(T - T[0], abs=1e-6),
        "joints": recording.joints == expected,
    }
    return [name for name, equal in same.items() if not equal]


@pytest.mark.parametrize(("version", "big"), [(1, False), (2, True)])
def test_a_bag_of_images_with_joint_states(bag, imported, capsys, version, big):
    name = "grasp.bag" if version == 1 else "grasp"
    topics = skin(version=version, big=big), joints(version=version)
    recording = imported(bag(*topics, name=name, beside=BESIDE, version=version))
    assert differences(recording) == []
    line = "frames: /skin, joint angles: /joint_states, time: of the messages"
    assert line in capsys.readouterr().out
    assert recording.labels == {"object": "cup"}
    assert recording.layout.threshold_counts == 50
    assert recording.layout.wraps
    assert recording.joint_names == NAMES


def on_two_topics():
    """Two publishers that share the joints."""
    topic, first = joints(NAMES[:2], [0, 1])
    _, second = joints(NAMES[2:], [2, 3, 4])
    return topic, sorted(first + second, key=lambda message: message[0])


def beside_others():
    """Joints backwards, among others of which some have no angles."""
    topic, states = joints(("wheel", *NAMES[::-1], "x"), [0, 4, 3, 2, 1, 0, 1])
    base = joint_state(T[0], [], ("base_x", "base_y"))
    unknown = joint_state(T[1], [np.nan], ("wheel",))
    return topic, [*states, (T[0] + 0.001, base), (T[1] + 0.001, unknown)]


@pytest.mark.parametrize(
    ("states", "names"),
    [(on_two_topics(), NAMES), (beside_others(), NAMES), (joints(()), None)],
)
def test_angles_are_those_of_the_arms_joints_by_name(bag, imported, arm, states, names):
    recording = imported(bag(skin(), states), *arm)
    assert differences(recording) == []
    assert recording.joint_names == names
    assert [j["name"] for j in recording.meta["arm"]["joint"]] == list(NAMES)


@pytest.mark.parametrize(
    ("frames", "beside", "options"),
    [
        ([array(frame, dims=(ROWS, COLS)) for frame in FRAMES], {}, ()),
        (
            [array(frame) for frame in FRAMES],
            {"skin": {"rows": ROWS, "cols": COLS}},
            (),
        ),
        (
            [array(frame * np.float32(0.25), kind="Float32") for frame in FRAMES],
            {},
            (*SHAPE, "--scale", 4),
        ),
    ],
)
def test_arrays_are_frames(bag, imported, frames, beside, options):
    recording = imported(bag(skin(frames), beside=beside), *options)
    assert differences(recording, with_joints=False) == []


def test_what_is_no_frame_is_left_out_and_said(bag, imported, capsys, tmp_path):
    assert differences(imported(bag(skin(), joints(), camera()))) == []
    assert "skipped /camera, which is rgb8" in capsys.readouterr().out
    shutil.rmtree(tmp_path / "out")
    assert len(imported(bag(damaged("/skin"), name="b")).t) == N - 1
    assert f"1 of {N} messages" in capsys.readouterr().out
    shutil.rmtree(tmp_path / "out")
    (tmp_path / "c.json").write_text('{"frames_topic": "/skin"}')
    path = bag(skin(), joints(), camera(), damaged(), name="c")
    assert differences(imported(path)) == []
    assert "skipped" not in capsys.readouterr().out


def test_clocks_that_never_meet_are_joined_by_the_time_of_logging(
    bag, imported, capsys
):
    pairs = zip(JOINT_T, JOINTS, strict=True)
    states = [joint_state(t - 90.0, q) for t, q in pairs]
    assert differences(imported(bag(skin(), skin(states, "/joints", JOINT_T)))) == []
    assert "never meet" in capsys.readouterr().out


@pytest.mark.parametrize("axes", [(), ("--axes", "xyz", "--flip", "y")])
def test_a_sensors_own_message_is_read_by_the_definition_in_the_log(
    tmp_path, imported, axes
):
    log = write_mcap(tmp_path / "grasp.mcap", sensor())
    field = "taxels" if axes else "taxels.z"
    recording = imported(log, "--field", field, *axes, *SHAPE)
    counts = (FRAMES >> 1).astype(np.int16)
    assert np.array_equal(recording.frames, counts)
    shear = np.stack([counts // 4, counts // 8], axis=3)
    assert np.array_equal(recording.shear, shear) if axes else recording.shear is None


def test_a_bag_may_be_the_current_folder(bag, tmp_path, monkeypatch):
    monkeypatch.chdir(bag(skin()))
    out = str(tmp_path / "out")
    assert main(["import", "rosbag", ".", "--out", out]) == 0
    assert (tmp_path / "out" / "grasp.npz").exists()


def test_the_file_of_a_bag_is_read_without_its_folder(tmp_path, bag, imported):
    topics = skin(), joints()
    (stored,) = bag(*topics).glob("*.db3")
    assert differences(imported(stored)) == []
    shutil.rmtree(tmp_path / "out")
    assert differences(imported(write_mcap(tmp_path / "a.mcap", *topics))) == []


def test_axes_may_be_letters_at_the_end_of_fields():
    options = LogOptions(field="taxels.f", axes=Axes.of("xyz", None))
    message = SimpleNamespace(taxels=[SimpleNamespace(fx=1, fy=2, fz=3)])
    assert values_of("maker/msg/State", message, options).tolist() == [[1, 2, 3]]


def going_back():
    """Frames whose stamps begin anew in the middle of the log."""
    stamps = [*T[:6], *(T[:6] + 0.005)]
    return skin([image(t, frame) for t, frame in zip(stamps, FRAMES, strict=True)])


TWO = (skin(topic="/left"), skin(topic="/right"))


@pytest.mark.parametrize(
    ("topics", "beside", "options", "sentence"),
    [
        (TWO, {}, (), 'are on /left, /right; name one of them as "frames_topic"'),
        (TWO, {"frames_topic": {}}, (), "must be one of ['/left', '/right']"),
        ([skin()], [], (), "grasp.json: the file must be a table, not []"),
        ([camera()], {}, (), "no frames: /camera is rgb8; frames are mono16"),
        ([joints()], {}, (), "holds no frames; they must be sensor_msgs/msg/Image"),
        (
            [going_back()],
            {},
            (),
            "/skin: its time goes back by 0.045 s at message 7; split it there",
        ),
        (
            [sensor()],
            {},
            ("--field", "forces"),
            "/xela has no field forces; it has header, taxels",
        ),
        (
            [sensor()],
            {},
            ("--field", "taxels.z"),
            "24 values a frame are no known rows of taxels; give --shape",
        ),
    ],
)
def test_what_a_log_lacks_is_one_sentence(
    bag,
    refused,
    topics,
    beside,
    options,
    sentence,
):
    path = bag(*topics, beside=beside)
    assert sentence in refused("rosbag", path, *options)


@pytest.mark.parametrize(
    ("names", "sentence"),
    [
        (
            ("a", *NAMES[1:]),
            "has no angle of the arm's joint j0; there are a, j1, j2, j3, j4",
        ),
        (("j0", *NAMES[:-1]), "names a joint twice"),
        (NAMES[:3], "names are 3 and angles 5"),
    ],
)
def test_joints_that_do_not_suit_the_arm(bag, arm, refused, names, sentence):
    path = bag(skin(), joints(names))
    assert sentence in refused("rosbag", path, *arm)


@pytest.mark.parametrize(
    ("name", "contents", "sentence"),
    [
        ("a.mcap", b"\x89MCAP0\r\n", "a.mcap: not a readable bag"),
        ("a.bag", b"hello", "a.bag: not a readable bag"),
        ("no", None, "no: no such file or folder"),
        ("a.csv", b"1,2", "a.csv: is no bag"),
        (".", None, "is no bag"),
    ],
)
def test_what_is_no_log_is_one_sentence(tmp_path, refused, name, contents, sentence):
    path = tmp_path / name
    if contents is not None:
        path.write_bytes(contents)
    assert sentence in refused("rosbag", path)


def record(code, *contents):
    """A record of MCAP: numbers of two bytes, and texts behind their lengths."""
    data = b""
    for content in contents:
        is_text = isinstance(content, str)
        data += (
            struct.pack("<I", len(content)) + content.encode() if is_text else content
        )
    return struct.pack("<BQ", code, len(data)) + data


@pytest.mark.parametrize(
    ("profile", "encoding", "word"),
    [
        ("", "protobuf", "protobuf (maker.Skin)"),
        ("ros2", "flatbuffer", "flatbuffer"),
        ("", "cdr", "another profile"),
    ],
)
def test_messages_that_are_not_of_ros_2_are_named(
    tmp_path, refused, profile, encoding, word
):
    one = struct.pack("<H", 1)
    start = rosbag.MAGIC + record(1, profile, "me")
    summary = record(3, one, "maker.Skin", encoding, "") + record(
        4, one, one, "/skin", encoding, ""
    )
    footer = record(2, struct.pack("<QQI", len(start), 0, 0))
    (tmp_path / "a.mcap").write_bytes(start + summary + footer + rosbag.MAGIC)
    message = refused("rosbag", tmp_path / "a.mcap")
    assert word in message
    assert "copy it again" not in message
