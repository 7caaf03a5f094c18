"""CSV frames, bags and MCAP files, made here and imported through the command."""

import argparse
import json

import numpy as np
import pytest
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Bag1
from rosbags.rosbag2 import Writer as Bag2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from edge.errors import InputError
from edge.recording import load
from train.__main__ import main
from train.importers.topics import Log

N = 12
ROWS = 4
COLS = 6
DOF = 5
RNG = np.random.default_rng(8)
FRAMES = RNG.integers(0, 65536, (N, ROWS, COLS)).astype(np.uint16)
T = 100.0 + np.arange(N) / 100
JOINT_T = 99.99 + np.arange(8) / 50
JOINTS = RNG.uniform(-1, 1, (8, DOF))
BESIDE = {"labels": {"object": "cup"}, "skin": {"threshold_counts": 50, "wraps": True}}
NAMES = tuple(f"j{i}" for i in range(DOF))
OPTIONS = argparse.Namespace(axes=None, flip=None, field=None, shape=None)
STORES = {1: get_typestore(Stores.ROS1_NOETIC), 2: get_typestore(Stores.ROS2_HUMBLE)}


def nanoseconds(t):
    return round(t * 1e9)


def header(types, t):
    stamp = types.types["builtin_interfaces/msg/Time"](
        sec=nanoseconds(t) // 10**9, nanosec=nanoseconds(t) % 10**9
    )
    more = (
        {"seq": 0}
        if "seq" in types.types["std_msgs/msg/Header"].__annotations__
        else {}
    )
    return types.types["std_msgs/msg/Header"](stamp=stamp, frame_id="", **more)


def image(types, t, frame, *, big=False, padding=3):
    raw = frame.astype(">u2" if big else "<u2").view(np.uint8).reshape(ROWS, -1)
    lines = np.pad(raw, ((0, 0), (0, padding)))
    return types.types["sensor_msgs/msg/Image"](
        header=header(types, t),
        height=ROWS,
        width=COLS,
        encoding="mono16",
        is_bigendian=int(big),
        step=lines.shape[1],
        data=lines.reshape(-1),
    )


def array(types, frame, *, dims=True):
    dimension = types.types["std_msgs/msg/MultiArrayDimension"]
    shape = [
        dimension(label=n, size=s, stride=0)
        for n, s in (("rows", ROWS), ("cols", COLS))
    ]
    layout = types.types["std_msgs/msg/MultiArrayLayout"](
        dim=shape if dims else [], data_offset=0
    )
    return types.types["std_msgs/msg/UInt16MultiArray"](
        layout=layout, data=frame.reshape(-1)
    )


def images(version=2, *, big=False):
    return [
        image(STORES[version], t, frame, big=big)
        for t, frame in zip(T, FRAMES, strict=True)
    ]


def arrays(*, dims=True):
    return [array(STORES[2], frame, dims=dims) for frame in FRAMES]


def joint_state(types, t, q, names=NAMES):
    empty = np.zeros(0)
    q = np.asarray(q, dtype=np.float64)
    names = list(names)
    return types.types["sensor_msgs/msg/JointState"](
        header=header(types, t), name=names, position=q, velocity=empty, effort=empty
    )


def write_bag(path, version, frames, *, joints=True, topics=("/skin",), states=None):
    """A bag whose messages are logged 7 ms after their stamps; `states` are (t, names,
    q)."""
    types = STORES[version]
    serialize = types.serialize_ros1 if version == 1 else types.serialize_cdr
    with Bag1(path) if version == 1 else Bag2(path, version=9) as bag:
        for topic in topics:
            kind = frames[0].__msgtype__
            connection = bag.add_connection(topic, kind, typestore=types)
            for t, message in zip(T, frames, strict=True):
                bag.write(connection, nanoseconds(t + 0.007), serialize(message, kind))
        if joints:
            kind = "sensor_msgs/msg/JointState"
            connection = bag.add_connection("/joint_states", kind, typestore=types)
            for t, names, q in states or [
                (t, NAMES, q) for t, q in zip(JOINT_T, JOINTS, strict=True)
            ]:
                message = serialize(joint_state(types, t, q, names), kind)
                bag.write(connection, nanoseconds(t + 0.007), message)
    return path


def imported(tmp_path, kind, path, *options):
    out = ["--out", str(tmp_path / "out")]
    assert main(["import", kind, str(path), *out, *map(str, options)]) == 0
    (file,) = (tmp_path / "out").glob("*.npz")
    return load(file)


def differences(recording, *, joints=True):
    """What of the recording is not as it was written into the log."""
    angles = np.transpose([np.interp(T, JOINT_T, column) for column in JOINTS.T])
    same = {
        "frames": np.array_equal(recording.frames, FRAMES),
        "t": recording.t == pytest.approx(T - T[0], abs=1e-6),
        "joints": recording.joints
        == (pytest.approx(angles, abs=1e-4) if joints else None),
    }
    return [name for name, equal in same.items() if not equal]


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize("big", [False, True])
def test_a_bag_of_images_with_joint_states(tmp_path, version, big):
    name = "grasp.bag" if version == 1 else "grasp"
    path = write_bag(tmp_path / name, version, images(version, big=big))
    (tmp_path / "grasp.json").write_text(json.dumps(BESIDE))
    recording = imported(tmp_path, "rosbag", path)
    assert differences(recording) == []
    assert recording.labels == {"object": "cup"}
    assert recording.layout.threshold_counts == 50
    assert recording.layout.wraps
    assert recording.joint_names == NAMES


ARM = "".join(f'[[joint]]\nname = "{name}"\naxis = [0, 0, 1]\n' for name in NAMES)


@pytest.fixture
def arm(tmp_path):
    (tmp_path / "arm.toml").write_text(ARM)
    return "--arm", tmp_path / "arm.toml"


def bag_of(tmp_path, states):
    return write_bag(tmp_path / "grasp", 2, images(), states=states)


def every(names, columns, t=JOINT_T):
    """A joint state at each time, of these columns under these names."""
    return [(at, names, q[columns]) for at, q in zip(t, JOINTS, strict=True)]


@pytest.mark.parametrize(
    "states",
    [
        every(NAMES[::-1], [4, 3, 2, 1, 0]),
        every(("wheel_left", *NAMES, "finger"), [0, 0, 1, 2, 3, 4, 1]),
        every(NAMES[:2], [0, 1]) + every(NAMES[2:], [2, 3, 4]),
    ],
    ids=["backwards", "among others", "of two publishers"],
)
def test_angles_are_told_apart_by_the_names_of_their_joints(
    tmp_path, arm, capsys, states
):
    path = bag_of(tmp_path, sorted(states, key=lambda state: state[0]))
    recording = imported(tmp_path, "rosbag", path, *arm)
    assert differences(recording) == []
    assert recording.joint_names == NAMES
    assert [j["name"] for j in recording.meta["arm"]["joint"]] == list(NAMES)
    others = "/joint_states: joints outside the arm: wheel_left, finger\n"
    assert (others in capsys.readouterr().err) == (len(states[0][1]) == 7)


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (
            ("a", *NAMES[1:]),
            "has no angle of the arm's joint j0; there are a, j1, j2, j3, j4",
        ),
        (("j0", *NAMES[:-1]), "names a joint twice"),
        (NAMES[:3], "names are 3 and angles 5"),
    ],
)
def test_joints_that_do_not_suit_the_arm(tmp_path, arm, refusal, names, said):
    path = bag_of(tmp_path, every(names, list(range(DOF))))
    assert said in refusal("import", "rosbag", path, "--out", tmp_path / "out", *arm)


def test_angles_without_names_are_taken_in_the_arms_order(tmp_path, arm):
    path = bag_of(tmp_path, every((), list(range(DOF))))
    assert differences(imported(tmp_path, "rosbag", path, *arm)) == []


@pytest.mark.parametrize("dims", [True, False])
def test_a_bag_of_arrays_takes_the_shape_from_the_layout_or_from_beside(tmp_path, dims):
    path = write_bag(tmp_path / "grasp", 2, arrays(dims=dims), joints=False)
    if not dims:
        beside = {"skin": {"rows": ROWS, "cols": COLS}}
        (tmp_path / "grasp.json").write_text(json.dumps(beside))
    assert differences(imported(tmp_path, "rosbag", path), joints=False) == []


def test_a_bag_may_be_the_current_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(write_bag(tmp_path / "grasp", 2, arrays(), joints=False))
    imported(tmp_path, "rosbag", ".")
    assert (tmp_path / "out" / "grasp.npz").exists()


def test_of_two_topics_of_frames_one_must_be_named(tmp_path, refusal):
    path = write_bag(tmp_path / "grasp", 2, arrays(), topics=("/left", "/right"))
    for beside, said in (
        ("{}", 'frames are on /left, /right; name one of them as "frames_topic"'),
        (
            '{"frames_topic": {}}',
            "frames_topic in grasp.json must be one of ['/left', '/right']",
        ),
    ):
        (tmp_path / "grasp.json").write_text(beside)
        assert said in refusal("import", "rosbag", path, "--out", tmp_path / "out")
    (tmp_path / "grasp.json").write_text('{"frames_topic": "/left"}')
    assert np.array_equal(imported(tmp_path, "rosbag", path).frames, FRAMES)


@pytest.mark.parametrize(
    ("beside", "sentence"),
    [
        ("[]", "grasp.json: the file must be a table, not []"),
        ('{"labels": 5}', "grasp.json: labels must be a table, not 5"),
        ('{"skin": [1]}', "grasp.json: skin must be a table, not [1]"),
        ('{"arm": 5}', "grasp.json: arm must be a table, not 5"),
    ],
)
def test_a_file_beside_the_log_that_cannot_be_used_is_one_sentence(
    tmp_path, refusal, beside, sentence
):
    path = write_bag(tmp_path / "grasp", 2, arrays(), joints=False)
    (tmp_path / "grasp.json").write_text(beside)
    assert sentence in refusal("import", "rosbag", path, "--out", tmp_path / "out")


def write_mcap(path, *, cdr, protobuf=(), **options):
    types = STORES[2]

    def data(kind, message, fields):
        return (
            types.serialize_cdr(message, kind) if cdr else json.dumps(fields).encode()
        )

    frames = [
        data("sensor_msgs/msg/Image", message, {"counts": frame.tolist()})
        for message, frame in zip(images(), FRAMES, strict=True)
    ]
    poses = [
        data("sensor_msgs/msg/JointState", joint_state(types, t, q), {"q": q.tolist()})
        for t, q in zip(JOINT_T, JOINTS, strict=True)
    ]
    with path.open("wb") as file:
        writer = McapWriter(file, **options)
        writer.start()
        for topic, kind, times, messages in (
            ("/skin", "Image", T, frames),
            ("/joints", "JointState", JOINT_T, poses),
        ):
            encoding = ("ros2msg", "cdr") if cdr else ("jsonschema", "json")
            schema = writer.register_schema(
                f"sensor_msgs/msg/{kind}", encoding[0], b"{}"
            )
            channel = writer.register_channel(topic, encoding[1], schema)
            for t, message in zip(times, messages, strict=True):
                writer.add_message(
                    channel, nanoseconds(t), bytes(message), nanoseconds(t)
                )
        for topic in protobuf:
            channel = writer.register_channel(topic, "protobuf", 0)
            writer.add_message(channel, nanoseconds(T[0]), b"", nanoseconds(T[0]))
        writer.finish()
    return path


@pytest.mark.parametrize("cdr", [True, False])
def test_an_mcap_file_of_ros_or_json_messages(tmp_path, cdr):
    path = write_mcap(tmp_path / "grasp.mcap", cdr=cdr)
    assert differences(imported(tmp_path, "mcap", path)) == []


def test_a_json_message_that_is_no_table_is_named_with_its_topic(tmp_path):
    with pytest.raises(
        InputError, match=r"grasp: a message of /skin must be a table, not \[\]"
    ):
        Log.of(tmp_path / "grasp", None, OPTIONS).json("/skin", b"[]", 0.0)


def add_topic(bag, types, topic, kind, messages):
    """Write messages, (t, message), on a further topic of an open bag."""
    connection = bag.add_connection(topic, kind, typestore=types)
    for t, message in messages:
        data = types.serialize_cdr(message, kind)
        bag.write(connection, nanoseconds(t + 0.007), data)


def skin_and(path, *others, frames=None, joints=True):
    """A bag of the skin, its arm's joints, and further (topic, kind, messages)."""
    types = STORES[2]
    with Bag2(path, version=9) as bag:
        skin = frames or list(zip(T, images(), strict=True))
        add_topic(bag, types, "/skin", skin[0][1].__msgtype__, skin)
        if joints:
            states = [
                (t, joint_state(types, t, q))
                for t, q in zip(JOINT_T, JOINTS, strict=True)
            ]
            add_topic(bag, types, "/joints", "sensor_msgs/msg/JointState", states)
        for topic, kind, messages in others:
            add_topic(bag, types, topic, kind, messages)
    return path


def camera():
    """Colour images, which are no frames."""
    types = STORES[2]
    picture = types.types["sensor_msgs/msg/Image"](
        header=header(types, T[0]),
        height=2,
        width=2,
        encoding="rgb8",
        is_bigendian=0,
        step=6,
        data=np.zeros(12, np.uint8),
    )
    return "/camera", "sensor_msgs/msg/Image", [(T[0], picture)]


def test_a_colour_camera_beside_the_skin_is_left_out_and_said(tmp_path, capsys):
    path = skin_and(tmp_path / "grasp", camera())
    assert differences(imported(tmp_path, "rosbag", path)) == []
    assert (
        "left out /camera, which is rgb8; frames are mono16" in capsys.readouterr().out
    )


def test_a_damaged_frame_is_left_out_and_counted(tmp_path, capsys):
    frames = list(images())
    frames[3].step = 1
    skin = list(zip(T, frames, strict=True))
    path = skin_and(tmp_path / "grasp", frames=skin)
    assert len(imported(tmp_path, "rosbag", path).t) == len(T) - 1
    said = f"left out 1 of {len(T)} messages of /skin, the first of which has an image"
    assert said in capsys.readouterr().out


def test_an_encoding_that_is_not_read_is_said(tmp_path, capsys):
    path = write_mcap(tmp_path / "grasp.mcap", cdr=True, protobuf=("/tf",))
    assert differences(imported(tmp_path, "mcap", path)) == []
    said = capsys.readouterr().out
    assert "left out /tf, in the encoding 'protobuf'; cdr and json are read" in said


def test_a_topic_that_is_not_named_is_never_read(tmp_path, capsys):
    broken = image(STORES[2], T[0], FRAMES[0])
    broken.step = 1
    other = ("/other", "sensor_msgs/msg/Image", [(T[0], broken)])
    path = skin_and(tmp_path / "grasp", camera(), other)
    (tmp_path / "grasp.json").write_text('{"frames_topic": "/skin"}')
    assert differences(imported(tmp_path, "rosbag", path)) == []
    assert "left out" not in capsys.readouterr().out


def test_a_camera_alone_is_no_skin(tmp_path, refusal):
    types = STORES[2]
    with Bag2(tmp_path / "grasp", version=9) as bag:
        add_topic(bag, types, *camera())
    said = refusal("import", "rosbag", tmp_path / "grasp", "--out", tmp_path / "out")
    assert "holds no frames: /camera is rgb8; frames are mono16" in said


def test_joints_outside_the_arm_may_have_no_angles(tmp_path, arm):
    states = []
    for t, q in zip(JOINT_T, JOINTS, strict=True):
        states.append((t, (*NAMES, "wheel"), [*q, np.nan]))
        states.append((t + 0.001, ("base_x", "base_y"), []))
    path = write_bag(tmp_path / "grasp", 2, images(), states=states)
    assert differences(imported(tmp_path, "rosbag", path, *arm)) == []


def test_frames_whose_time_goes_back_are_refused_and_never_sorted_in(tmp_path, refusal):
    stamps = [*T[:6], *(T[:6] + 0.005)]
    frames = [
        (t, image(STORES[2], stamp, frame))
        for t, stamp, frame in zip(T, stamps, FRAMES, strict=True)
    ]
    path = skin_and(tmp_path / "grasp", frames=frames, joints=False)
    said = refusal("import", "rosbag", path, "--out", tmp_path / "out")
    assert "/skin: its time goes back by 0.045 s at message 7; split it there" in said


def test_angles_across_a_gap_are_unknown(tmp_path, capsys):
    t = np.concatenate([T[:6], T[6:] + 1.0])
    frames = [
        (at, image(STORES[2], at, frame)) for at, frame in zip(t, FRAMES, strict=True)
    ]
    path = skin_and(tmp_path / "grasp", frames=frames)
    recording = imported(tmp_path, "rosbag", path)
    assert np.isfinite(recording.joints[:6]).all()
    assert np.isnan(recording.joints[6:]).all()
    assert "lacks joint angles for 6 of 12 frames" in capsys.readouterr().out


def test_clocks_that_never_meet_are_joined_by_the_time_of_logging(tmp_path, capsys):
    types = STORES[2]
    states = [
        (t, joint_state(types, t - 90.0, q))
        for t, q in zip(JOINT_T, JOINTS, strict=True)
    ]
    with Bag2(tmp_path / "grasp", version=9) as bag:
        skin = list(zip(T, images(), strict=True))
        add_topic(bag, types, "/skin", "sensor_msgs/msg/Image", skin)
        add_topic(bag, types, "/joints", "sensor_msgs/msg/JointState", states)
    assert differences(imported(tmp_path, "rosbag", tmp_path / "grasp")) == []
    assert "never meet; both are taken by the time" in capsys.readouterr().out


def multi_array(name, values):
    """A MultiArray message without a layout."""
    types = STORES[2]
    layout = types.types["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
    return types.types[f"std_msgs/msg/{name}"](layout=layout, data=values)


@pytest.mark.parametrize(
    ("name", "kind", "scale", "options"),
    [
        ("Float32MultiArray", np.float32, 0.25, ("--scale", 4)),
        ("Int16MultiArray", np.int16, 1, ()),
        ("UInt8MultiArray", np.uint8, 1, ()),
        ("Float64MultiArray", np.float64, 0.5, ("--scale", 2)),
    ],
)
def test_arrays_of_every_kind_are_frames(tmp_path, name, kind, scale, options):
    counts = FRAMES % 200
    frames = [
        (t, multi_array(name, (frame.reshape(-1) * scale).astype(kind)))
        for t, frame in zip(T, counts, strict=True)
    ]
    path = skin_and(tmp_path / "grasp", frames=frames, joints=False)
    shape = ("--shape", f"{ROWS}x{COLS}")
    recording = imported(tmp_path, "rosbag", path, *shape, *options)
    assert np.array_equal(recording.frames, counts)


SENSOR = """std_msgs/Header header
xela/Taxel[] taxels
================================================================================
MSG: xela/Taxel
int16 x
int16 y
int16 z
"""
SENSOR_KIND = "xela/msg/Stream"


def sensor_types():
    """A sensor's own messages, as its maker defines them."""
    types = get_typestore(Stores.ROS2_HUMBLE)
    text = SENSOR.replace("xela/Taxel", "xela/msg/Taxel")
    text = text.replace("std_msgs/Header", "std_msgs/msg/Header")
    types.register(get_types_from_msg(text, SENSOR_KIND))
    return types


def sensor_messages(types):
    """Messages whose taxels have x and y beside the counts of `FRAMES`, cut to 15
    bits."""
    taxel = types.types["xela/msg/Taxel"]
    stream = types.types[SENSOR_KIND]
    for t, frame in zip(T, FRAMES >> 1, strict=True):
        taxels = [taxel(x=z // 4, y=-(z // 8), z=z) for z in frame.reshape(-1).tolist()]
        yield t, stream(header=header(types, t), taxels=taxels)


def sensor_bag(tmp_path):
    types = sensor_types()
    with Bag2(tmp_path / "grasp", version=9) as bag:
        add_topic(bag, types, "/xela", SENSOR_KIND, sensor_messages(types))
    return "rosbag", tmp_path / "grasp"


def sensor_mcap(tmp_path):
    types = sensor_types()
    path = tmp_path / "grasp.mcap"
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start()
        schema = writer.register_schema(SENSOR_KIND, "ros2msg", SENSOR.encode())
        channel = writer.register_channel("/xela", "cdr", schema)
        for t, message in sensor_messages(types):
            data = bytes(types.serialize_cdr(message, SENSOR_KIND))
            writer.add_message(channel, nanoseconds(t), data, nanoseconds(t))
        writer.finish()
    return "mcap", path


@pytest.mark.parametrize("make", [sensor_bag, sensor_mcap])
def test_a_sensors_own_message_is_read_by_the_definition_in_the_log(tmp_path, make):
    kind, path = make(tmp_path)
    shape = ("--shape", f"{ROWS}x{COLS}")
    recording = imported(tmp_path, kind, path, "--field", "taxels.z", *shape)
    assert np.array_equal(recording.frames, FRAMES >> 1)
    assert recording.shear is None


@pytest.mark.parametrize("make", [sensor_bag, sensor_mcap])
def test_its_three_axes_are_shear(tmp_path, make):
    kind, path = make(tmp_path)
    options = ("--field", "taxels", "--axes", "xyz", "--flip", "y")
    shape = ("--shape", f"{ROWS}x{COLS}")
    recording = imported(tmp_path, kind, path, *options, *shape)
    counts = (FRAMES >> 1).astype(np.int16)
    assert np.array_equal(recording.frames, counts)
    assert np.array_equal(recording.shear[..., 0], counts // 4)
    assert np.array_equal(recording.shear[..., 1], counts // 8)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ((), "holds no frames"),
        (("--field", "forces"), "/xela has no field forces; it has header, taxels"),
        (("--field", "taxels.w"), "/xela has no field w; it has x, y, z"),
        (("--field", "taxels.z"), "do not state their rows and columns; give --shape"),
        (("--field", "taxels.z", "--shape", "5x5"), "24 values, not 5 x 5"),
    ],
)
def test_a_field_that_is_not_there_is_named(tmp_path, refusal, options, sentence):
    kind, path = sensor_bag(tmp_path)
    said = refusal("import", kind, path, "--out", tmp_path / "out", *options)
    assert sentence in said


def cut_mcap(tmp_path):
    path = write_mcap(tmp_path / "grasp.mcap", cdr=False)
    path.write_bytes(path.read_bytes()[:400])
    return "mcap", path


def empty_bag(tmp_path):
    with Bag2(tmp_path / "grasp", version=9) as bag:
        bag.add_connection("/chatter", "std_msgs/msg/String", typestore=STORES[2])
    return "rosbag", tmp_path / "grasp"


def not_a_bag(tmp_path):
    (tmp_path / "a.bag").write_bytes(b"hello")
    return "rosbag", tmp_path / "a.bag"


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (cut_mcap, "not a complete MCAP file"),
        (empty_bag, "holds no frames"),
        (lambda folder: ("rosbag", folder / "no"), "no: no such file or folder"),
        (not_a_bag, "not a readable bag"),
    ],
)
def test_what_cannot_be_used_is_one_sentence(tmp_path, refusal, make, sentence):
    kind, path = make(tmp_path)
    assert sentence in refusal("import", kind, path, "--out", tmp_path / "out")
