"""Logs of ROS 1 (`.bag`) or ROS 2 (a folder, `.mcap` or `.db3`): one recording each; see
train/importers/topics.py.

Needs the dependency group `ros`, which `make venv` installs: pip install --group ros
"""

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

from edge.files import open_regular, parsing
from edge.touch.arm import Chain
from train.importers import Trial
from train.importers.options import LogOptions
from train.importers.table import needs
from train.importers.topics import Log
from train.importers.topics import add_options as add_options


def trials(
    path: Path,
    arm: Chain | None,
    arguments: argparse.Namespace,
) -> Iterator[Trial]:
    """The one trial of the bag."""
    with needs("rosbags", "this"):
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    if not path.is_dir():
        with open_regular(path, sys.maxsize):  # a FIFO would be waited for
            pass
    log = Log(path, arm, LogOptions.of(arguments))
    # ROS 2 bags from before 2024 do not contain the definitions of their types.
    types = get_typestore(Stores.ROS2_HUMBLE)
    with (
        parsing(str(path), "a readable bag", "; copy it again"),
        AnyReader([path], default_typestore=types) as reader,
    ):
        connections = [c for c in reader.connections if log.takes(c.topic, c.msgtype)]
        # With an empty list, AnyReader would give every message of the bag.
        messages = reader.messages(connections) if connections else ()
        for connection, logged_ns, raw in messages:
            message = reader.deserialize(raw, connection.msgtype)
            log.add(connection.topic, connection.msgtype, message, logged_ns * 1e-9)
    yield Trial(path.stem, log.recording())
