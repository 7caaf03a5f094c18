"""An MCAP file of ROS 2 or JSON messages: one recording; see train/importers/topics.py.

Needs the dependency group `ros`, which `make venv` installs: pip install --group ros
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from edge.errors import InputError
from edge.recording import Recording
from edge.touch.arm import Chain
from train.importers.topics import FRAMES, JOINTS, Log


def trials(path: Path, arm: Chain | None = None) -> Iterator[tuple[str, Recording]]:
    """The file's one trial."""
    try:
        from mcap.reader import make_reader
    except ImportError:
        raise InputError("MCAP files need mcap; install it with `pip install mcap`") from None
    log = Log.of(path, arm)
    types = None
    try:
        with path.open("rb") as file:
            for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
                logged_s = message.log_time * 1e-9
                kind = "" if schema is None else schema.name
                if channel.message_encoding == "json":
                    log.json(channel.topic, message.data, logged_s)
                elif channel.message_encoding == "cdr" and kind in (*FRAMES, *JOINTS):
                    types = types or _types()
                    log.ros(
                        channel.topic, kind, types.deserialize_cdr(message.data, kind), logged_s
                    )
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    except InputError:
        raise
    except Exception as error:  # of the file's parts and of its compression: a dozen kinds
        reason = str(error)[:200] or type(error).__name__
        raise InputError(f"{path}: not a whole MCAP file ({reason}); copy it again") from None
    yield path.stem, log.recording()


def _types() -> Any:
    try:
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise InputError(
            "MCAP files of ROS messages need rosbags; install it with `pip install rosbags`"
        ) from None
    return get_typestore(Stores.ROS2_HUMBLE)
