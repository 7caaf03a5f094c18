"""Logs of ROS 1 (`.bag`) or ROS 2 (a folder, `.mcap` or `.db3`): one recording each; see
train/importers/topics.py.

Needs the dependency group `ros`, which `make venv` installs: pip install --group ros
"""

import argparse
import io
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from edge.errors import InputError
from edge.files import open_regular, parsing
from edge.touch.arm import Chain
from train.importers import Trial
from train.importers.options import LogOptions
from train.importers.table import needs
from train.importers.topics import Log
from train.importers.topics import add_options as add_options

MAGIC = b"\x89MCAP0\r\n"
HEADER = 1
FOOTER_RECORD = 2
SCHEMA = 3
CHANNEL = 4
LARGEST_RECORD = 1 << 24
LARGEST_FILE = 1 << 48
FOOTER = 37
"""Bytes of the last record and of the magic behind it."""


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
        _require_messages_of_ros(path)
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


def _require_messages_of_ros(path: Path) -> None:
    """Refuse an MCAP file whose messages are not those of ROS 2, whose files name
    themselves; one that is damaged is left to its reader.

    Raises:
        InputError: it is one; the sentence names its encodings and schemas.
    """
    with open_regular(path, sys.maxsize) as file:  # a FIFO would be waited for
        if file.read(8) != MAGIC:
            return
        profile = next(_records(file), NOTHING)[1].string()
        file.seek(max(0, file.seek(0, os.SEEK_END) - FOOTER))
        footer = Content(file.read(FOOTER))
        if len(footer.getvalue()) < FOOTER or not footer.getvalue().endswith(MAGIC):
            return
        footer.seek(9)
        file.seek(min(footer.number(8), LARGEST_FILE) or len(MAGIC))
        others = _other_encodings(file)
    if others or profile != "ros2":
        kinds = [f"{encoding} ({of})" for encoding, of in others.items()]
        raise InputError(
            f"{path}: its messages are {', '.join(kinds) or 'of another profile'}, which "
            "are not read; write the values as a table, for `import csv` (in Python the "
            "package mcap reads them), or record it anew with ros2 bag"
        )


def _other_encodings(file: BinaryIO) -> dict[str, str]:
    """{encoding: a schema and its topic} of channels, but for that of ROS 2."""
    schemas = {0: "no schema"}
    others = {}
    for code, content in _records(file):
        number = content.number(2)
        if code == SCHEMA:
            schemas[number] = content.string()
        elif code == CHANNEL:
            schema = schemas.get(content.number(2), schemas[0])
            topic = content.string()
            encoding = content.string()
            if encoding != "cdr":
                others[encoding] = f"{schema} on {topic}"
    return others


class Content(io.BytesIO):
    """The content of a record of MCAP (https://mcap.dev/spec)."""

    def number(self, size: int) -> int:
        """A whole number of some bytes."""
        return int.from_bytes(self.read(size), "little")

    def string(self) -> str:
        """A text behind its length."""
        return self.read(self.number(4)).decode(errors="replace")


NOTHING = (0, Content())


def _records(file: BinaryIO) -> Iterator[tuple[int, Content]]:
    """The records of an MCAP file from where it stands to its footer."""
    while code := int.from_bytes(file.read(1), "little"):
        size = int.from_bytes(file.read(8), "little")
        if code in (HEADER, SCHEMA, CHANNEL):
            yield code, Content(file.read(min(size, LARGEST_RECORD)))
        elif code == FOOTER_RECORD or size > LARGEST_FILE - file.tell():
            return
        else:
            file.seek(size, os.SEEK_CUR)
