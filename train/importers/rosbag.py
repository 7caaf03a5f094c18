"""A bag of ROS 1 (`.bag`) or ROS 2 (its folder): one recording; see train/importers/topics.py.

Needs the dependency group `ros`, which `make venv` installs: pip install --group ros
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from edge.errors import InputError
from edge.recording import Recording
from edge.touch.arm import Chain
from train.importers.topics import FRAMES, JOINTS, Log


def trials(path: Path, arm: Chain | None = None) -> Iterator[tuple[str, Recording]]:
    """The bag's one trial."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise InputError("bags need rosbags; install it with `pip install rosbags`") from None
    log = Log.of(path, arm)
    # A ROS 2 bag of before 2024 does not carry its types' definitions.
    types = get_typestore(Stores.ROS2_HUMBLE)
    try:
        with AnyReader([path], default_typestore=types) as reader:
            wanted = [c for c in reader.connections if c.msgtype in (*FRAMES, *JOINTS)]
            # AnyReader gives every message of the bag where it is asked for none.
            for connection, logged_ns, raw in reader.messages(wanted) if wanted else ():
                message = reader.deserialize(raw, connection.msgtype)
                log.ros(connection.topic, connection.msgtype, message, logged_ns * 1e-9)
    except InputError:
        raise
    except Exception as error:  # of the bag's parts, of its compression and of SQLite
        reason = str(error)[:200] or type(error).__name__
        raise InputError(f"{path}: not a bag that can be read: {reason}") from None
    yield path.stem, log.recording()
