"""Logs of ROS that tests make: messages of a skin and of joint angles, in bags."""

import numpy as np
from rosbags.rosbag1 import Writer as Bag1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Bag2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

N = 12
ROWS = 4
COLS = 6
DOF = 5
RNG = np.random.default_rng(8)
FRAMES = RNG.integers(0, 65536, (N, ROWS, COLS)).astype(np.uint16)
T = 100.0 + np.arange(N) / 100
JOINT_T = 99.99 + np.arange(8) / 50
JOINTS = RNG.uniform(-1, 1, (8, DOF))
NAMES = tuple(f"j{i}" for i in range(DOF))
STORES = {1: get_typestore(Stores.ROS1_NOETIC), 2: get_typestore(Stores.ROS2_HUMBLE)}

SENSOR = """std_msgs/Header header
xela/Taxel[] taxels
================================================================================
MSG: xela/Taxel
int16 x
int16 y
int16 z
"""
"""A sensor's own messages, as its maker defines them."""
SENSOR_KIND = "xela/msg/Stream"
STORES[2].register(
    get_types_from_msg(
        SENSOR.replace("xela/Taxel", "xela/msg/Taxel").replace(
            "std_msgs/Header", "std_msgs/msg/Header"
        ),
        SENSOR_KIND,
    )
)


def message_of(kind, version=2, **fields):
    """A message, such as "std_msgs/Header"."""
    return STORES[version].types[kind.replace("/", "/msg/")](**fields)


def nanoseconds(t):
    return round(t * 1e9)


def header(t, version=2):
    seconds, rest = divmod(nanoseconds(t), 10**9)
    stamp = message_of("builtin_interfaces/Time", version, sec=seconds, nanosec=rest)
    sequence = {"seq": 0} if version == 1 else {}
    return message_of("std_msgs/Header", version, stamp=stamp, frame_id="", **sequence)


def image(t, frame, version=2, *, big=False, padding=3):
    raw = frame.astype(">u2" if big else "<u2").view(np.uint8).reshape(ROWS, -1)
    lines = np.pad(raw, ((0, 0), (0, padding)))
    return message_of(
        "sensor_msgs/Image",
        version,
        header=header(t, version),
        height=ROWS,
        width=COLS,
        encoding="mono16",
        is_bigendian=int(big),
        step=lines.shape[1],
        data=lines.reshape(-1),
    )


def array(values, version=2, kind="UInt16", dims=()):
    """An array with so many rows and columns in its layout."""
    dimensions = [
        message_of(
            "std_msgs/MultiArrayDimension",
            version,
            label="",
            size=size,
            stride=0,
        )
        for size in dims
    ]
    layout = message_of(
        "std_msgs/MultiArrayLayout",
        version,
        dim=dimensions,
        data_offset=0,
    )
    name = f"std_msgs/{kind}MultiArray"
    return message_of(name, version, layout=layout, data=values.reshape(-1))


def joint_state(t, q, names=NAMES, version=2):
    empty = np.zeros(0)
    return message_of(
        "sensor_msgs/JointState",
        version,
        header=header(t, version),
        name=list(names),
        position=np.asarray(q, dtype=np.float64),
        velocity=empty,
        effort=empty,
    )


def skin(messages=None, topic="/skin", t=T, version=2, **options):
    """The topic of the frames, as images unless there are other messages."""
    if messages is None:
        pairs = zip(t, FRAMES, strict=True)
        messages = [image(at, frame, version, **options) for at, frame in pairs]
    return topic, list(zip(t, messages, strict=True))


def joints(names=NAMES, columns=slice(None), version=2):
    """The topic of the joint angles: these columns under these names."""
    return "/joint_states", [
        (t, joint_state(t, q[columns], names, version))
        for t, q in zip(JOINT_T, JOINTS, strict=True)
    ]


def camera():
    """Colour images, which are no frames."""
    picture = image(T[0], FRAMES[0])
    picture.encoding = "rgb8"
    return "/camera", [(T[0], picture)]


def damaged(topic="/other"):
    """Images of which the fourth has lines that are too short."""
    name, messages = skin(topic=topic)
    messages[3][1].step = 1
    return name, messages


def sensor():
    """Messages whose taxels have x and y beside the counts of `FRAMES`, cut to 15
    bits."""
    messages = []
    for t, frame in zip(T, FRAMES >> 1, strict=True):
        taxels = [
            message_of("xela/Taxel", x=z // 4, y=-(z // 8), z=z)
            for z in frame.reshape(-1).tolist()
        ]
        messages.append(message_of("xela/Stream", header=header(t), taxels=taxels))
    return skin(messages, "/xela")


def write_bag(path, *topics, version=2, storage=StoragePlugin.SQLITE3):
    """A bag of topics, whose messages are logged 7 ms after their times."""
    types = STORES[version]
    serialize = types.serialize_ros1 if version == 1 else types.serialize_cdr
    is_first = version == 1
    bag = Bag1(path) if is_first else Bag2(path, version=9, storage_plugin=storage)
    with bag:
        for topic, messages in topics:
            kind = messages[0][1].__msgtype__
            connection = bag.add_connection(topic, kind, typestore=types)
            for t, message in messages:
                bag.write(connection, nanoseconds(t + 0.007), serialize(message, kind))
    return path


def write_mcap(path, *topics):
    """The file in a bag of topics that is stored as MCAP."""
    folder = write_bag(path.with_suffix(".bag2"), *topics, storage=StoragePlugin.MCAP)
    (file,) = folder.glob("*.mcap")
    return file.rename(path)
