"""MCAP files of ROS or JSON messages: one recording each; see
train/importers/topics.py.

Needs the dependency group `ros`, which `make venv` installs: pip install --group ros
"""

import argparse
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from edge.errors import InputError, printable
from edge.files import open_regular, parsing
from edge.recording import Recording
from edge.touch.arm import Chain
from train.importers.reading import needs
from train.importers.topics import Log, add_options
from train.progress import say

__all__ = ["add_options", "trials"]


def trials(
    path: Path,
    arm: Chain | None,
    options: argparse.Namespace,
) -> Iterator[tuple[str, Recording]]:
    """The one trial of the file."""
    with needs("mcap", "this"):
        from mcap.reader import make_reader
    with needs("rosbags", "this"):
        from rosbags.typesys import Stores, get_typestore
    log = Log(path, arm, options)
    unread: dict[str, set[str]] = defaultdict(set)
    types = get_typestore(Stores.ROS2_HUMBLE)
    with (
        parsing(str(path), "a complete MCAP file", "; copy it again"),
        open_regular(path, sys.maxsize) as file,
    ):
        for schema, channel, message in make_reader(
            file, validate_crcs=True
        ).iter_messages():
            logged_s = message.log_time * 1e-9
            kind = "" if schema is None else schema.name
            encoding = channel.message_encoding
            if encoding == "json":
                log.json(channel.topic, message.data, logged_s)
            elif encoding != "cdr":
                unread[encoding].add(channel.topic)
            elif log.takes(channel.topic, kind):
                try:
                    with parsing(f"is {kind}", "readable"):
                        define(types, schema)
                        data = types.deserialize_cdr(message.data, kind)
                except InputError as reason:
                    log.leave_out(channel.topic, str(reason))
                else:
                    log.ros(channel.topic, kind, data, logged_s)
    for encoding, topics in unread.items():
        say(
            f"{path}: left out {', '.join(sorted(topics))}, in the encoding "
            f"{printable(encoding)!r}; cdr and json are read"
        )
    yield path.stem, log.recording()


def define(types: Any, schema: Any) -> None:
    """Add the types that a schema defines, unless they are known."""
    from rosbags.typesys import get_types_from_msg

    if schema.name not in types.types:
        text = schema.data.decode()
        defined = get_types_from_msg(text, schema.name)
        new = {name: kind for name, kind in defined.items() if name not in types.types}
        types.register(new)
