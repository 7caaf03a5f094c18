"""Logs of ROS 1 (`.bag`) or ROS 2 (a folder, `.mcap` or `.db3`): one recording each; see
train/importers/topics.py.

Needs the dependency group `ros`, which `make venv` installs: pip install --group ros
"""

import argparse
import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path

from edge.errors import InputError
from edge.files import open_regular, parsing
from edge.touch.arm import Chain
from train.importers import ImportedTrial
from train.importers.forms import unread
from train.importers.options import LogOptions
from train.importers.table import needs
from train.importers.topics import Log
from train.importers.topics import add_options as add_options

MAGIC = b"\x89MCAP0\r\n"
PROFILE = b"\4\0\0\0ros2"
"""What stands behind the magic, a code and a length in a file of ROS 2."""
OTHERS = re.compile(
    rb"([\w./:-]+)[\1-\x20]\0\0\0(protobuf|flatbuffer|jsonschema|ros1msg)"
)
"""A schema's name and its encoding, each behind its length (https://mcap.dev/spec)."""
LOOKED_AT = 1 << 20
"""Bytes at each end of a file, where its schemas stand."""


def trials(
    path: Path,
    arm: Chain | None,
    arguments: argparse.Namespace,
) -> Iterator[ImportedTrial]:
    """The one trial of the bag."""
    with needs("rosbags", "this"):
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    _require_bag(path)
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
    yield ImportedTrial(path.stem, log.recording())


def _require_bag(path: Path) -> None:
    """Refuse what is no bag by its name.

    Raises:
        InputError: it is none, or its messages are not those of ROS 2.
    """
    bags = unread.UNREAD[unread.LOG]
    if path.is_dir():
        is_bag = (path / "metadata.yaml").exists()
    else:
        is_bag = path.suffix in bags
    if not is_bag:
        raise InputError(
            f"{path}: is no bag, which is a file {', '.join(bags)} or a folder with "
            "metadata.yaml; `import csv` reads tables"
        )
    if not path.is_dir():
        _require_messages_of_ros(path)


def _require_messages_of_ros(path: Path) -> None:
    """Refuse an MCAP file whose messages are not those of ROS 2; one that is damaged is
    left to its reader.

    Raises:
        InputError: it is one; the sentence names an encoding and its schema.
    """
    with open_regular(path, sys.maxsize) as file:  # a FIFO would be waited for
        start = file.read(LOOKED_AT)
        file.seek(max(0, file.seek(0, os.SEEK_END) - LOOKED_AT))
        end = file.read()
    if not (start.startswith(MAGIC) and end[len(MAGIC) :].endswith(MAGIC)):
        return
    kinds = [f"{encoding} ({name})" for name, encoding in _others(start + end).items()]
    if kinds or start[17:25] != PROFILE:
        raise InputError(
            f"{path}: its messages are {', '.join(kinds) or 'of another profile'}, which "
            "are not read; write the values as a table, for `import csv` (in Python the "
            "package mcap reads them), or record it anew with ros2 bag"
        )


def _others(data: bytes) -> dict[str, str]:
    """{schema: encoding} of those that are not of ROS 2."""
    return {name.decode(): code.decode() for name, code in OTHERS.findall(data)}
