"""Topics of frames and joint angles in a robot's log, turned into one recording.

Frames are `sensor_msgs/Image` (`mono16`, `16UC1`, `mono8` or `8UC1`),
`std_msgs/UInt16MultiArray` (with two dimensions in its layout, or with the skin's rows
and columns in the JSON file), or JSON `{"counts": [[...], ...]}`. Joint angles are
`sensor_msgs/JointState`, or JSON `{"q": [...]}`, optionally with `"names": [...]`. A
message may carry its own time (`header.stamp`, `"t"`); otherwise the time at which it
was logged is used.

Joints are identified by name, in any order, and several messages may share them. With
an arm, its joints are selected in the arm's order, and a warning names the others.
Without an arm, all joints are kept.

A JSON file beside the log, `NAME.json`, may complete it: `labels` {task: label}, `skin`
(see `edge.touch.layout.SkinLayout`), `arm`, and, if there are several topics of a kind,
the ones to use: `frames_topic` and `joints_topic`.
"""

from __future__ import annotations

import logging
import math
from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.config import ConfigTable, parse_json, read_json, shown
from edge.errors import InputError
from edge.files import parsing
from edge.recording import Recording
from edge.touch.arm import Chain, joint_columns
from edge.touch.joint_stream import OLDEST_S

LOG = logging.getLogger(__name__)

FRAMES = ("sensor_msgs/msg/Image", "std_msgs/msg/UInt16MultiArray")
JOINTS = ("sensor_msgs/msg/JointState",)


@contextmanager
def needs(package: str) -> Iterator[None]:
    """Name the package to install if an import in the block fails."""
    try:
        yield
    except ImportError:
        raise InputError(
            f"this needs {package}; install it with `pip install {package}`"
        ) from None


@dataclass
class Log:
    """The messages of one log, collected by topic.

    Attributes:
        path: of the log.
        beside: the JSON file beside it.
        arm: whose joint angles are wanted, or None for all.
    """

    path: Path
    beside: ConfigTable
    arm: Chain | None = None
    _frames: dict[str, list[tuple[float, NDArray[np.uint16]]]] = field(
        default_factory=lambda: defaultdict(list)
    )
    _joints: dict[str, dict[str, list[tuple[float, float]]]] = field(
        default_factory=lambda: defaultdict(lambda: defaultdict(list))
    )
    """{topic: {joint: [(time, angle)]}}"""

    @classmethod
    def of(cls, path: Path, arm: Chain | None = None) -> Log:
        """A log with its JSON file; `arm` has precedence over the file's.

        Raises:
            InputError: the file is not a JSON object.
        """
        file = path.with_name(path.stem + ".json")
        beside = ConfigTable(read_json(file) if file.is_file() else {}, str(file))
        if arm is None and beside.has("arm"):
            arm = Chain.from_dict(beside.get("arm"), where=f"{file}: arm")
        return cls(path, beside, arm)

    def ros(self, topic: str, kind: str, message: Any, logged_s: float) -> None:
        """Take in a ROS message; kinds other than frames and joint angles are
        ignored."""
        stamp = getattr(getattr(message, "header", None), "stamp", None)
        # Some drivers leave the stamp empty, which is the time 0.
        t = (0.0 if stamp is None else stamp.sec + stamp.nanosec * 1e-9) or logged_s
        if kind in JOINTS:
            self._pose(topic, t, list(message.name), np.asarray(message.position))
        elif kind in FRAMES:
            read = self._image if kind == FRAMES[0] else self._array
            self._frames[topic].append((t, read(topic, message)))

    def json(self, topic: str, data: bytes, logged_s: float) -> None:
        """Take in a JSON message."""
        where = f"{self.path}: a message of {topic}"
        with parsing(where, "usable"):
            message = ConfigTable(parse_json(data, where), where)
            t = message.number("t", logged_s)
            if message.has("q"):
                q = np.asarray(message.get("q"), dtype=np.float64)
                self._pose(topic, t, list(map(str, message.get("names", ()))), q)
            elif message.has("counts"):
                counts = self._counts(topic, np.asarray(message.get("counts")))
                self._frames[topic].append((t, counts))

    def _pose(
        self, topic: str, t: float, names: list[str], q: NDArray[np.float64]
    ) -> None:
        """Take in a message's angles; joints without names get their positions as
        names."""
        where = f"{self.path}: a message of {topic}"
        if q.ndim != 1 or (names and len(names) != len(q)):
            raise InputError(f"{where}: its names are {len(names)} and angles {q.size}")
        if len(set(names)) < len(names):
            raise InputError(f"{where} names a joint twice")
        if not np.isfinite(q).all():
            raise InputError(f"{where} has an angle that is not finite")
        for name, angle in zip(
            names or map(str, range(len(q))), q.tolist(), strict=True
        ):
            self._joints[topic][name].append((t, angle))

    def _image(self, topic: str, message: Any) -> NDArray[np.uint16]:
        kinds = {"mono16": 2, "16UC1": 2, "mono8": 1, "8UC1": 1}
        size = kinds.get(message.encoding)
        if size is None:
            known = ", ".join(kinds)
            raise InputError(
                f"{self.path}: the images of {topic} are {message.encoding}; they must "
                f"be {known}"
            )
        raw = np.asarray(message.data, dtype=np.uint8)
        if (
            raw.size != message.height * message.step
            or message.step < message.width * size
        ):
            raise InputError(
                f"{self.path}: an image of {topic} does not have its stated size"
            )
        lines = raw.reshape(message.height, message.step)[:, : message.width * size]
        order = ">" if message.is_bigendian else "<"
        return np.ascontiguousarray(lines).view(f"{order}u{size}").astype(np.uint16)

    def _array(self, topic: str, message: Any) -> NDArray[np.uint16]:
        shape = [int(dimension.size) for dimension in message.layout.dim]
        values = np.asarray(message.data)[message.layout.data_offset :]
        if len(shape) != 2:
            skin = self.beside.table("skin", {})
            if not (skin.has("rows") and skin.has("cols")):
                raise InputError(
                    f"{self.path}: {topic} does not state its rows and columns; put "
                    "them as "
                    f'{{"skin": {{"rows": ..., "cols": ...}}}} into '
                    f"{self.path.stem}.json beside it"
                )
            shape = [skin.whole("rows"), skin.whole("cols")]
        if values.size != math.prod(shape):
            raise InputError(
                f"{self.path}: a message of {topic} has {values.size} values, not "
                f"{shape}"
            )
        return self._counts(topic, values.reshape(shape))

    def _counts(self, topic: str, counts: NDArray[Any]) -> NDArray[np.uint16]:
        if counts.ndim != 2 or counts.dtype.kind not in "iu":
            raise InputError(
                f"{self.path}: {topic} must hold whole numbers in rows and columns, "
                f"not {counts.dtype} {counts.shape}"
            )
        if counts.size and not 0 <= counts.min() <= counts.max() <= 65535:
            raise InputError(f"{self.path}: {topic} has counts outside 0 to 65535")
        return counts.astype(np.uint16)

    def recording(self) -> Recording:
        """The frames in the order of time, from 0, with joint angles at the frames'
        times.

        Raises:
            InputError: the log has no topic of frames or several, or the frames' shapes
                differ.
        """
        name, frames = self._topic("frames", self._frames)
        if not frames:
            raise InputError(
                f"{self.path}: holds no frames; they must be {' or '.join(FRAMES)}, or "
                "JSON "
                '{"counts": [[...]]}'
            )
        frames = sorted(frames, key=lambda entry: entry[0])
        shapes = {picture.shape for _, picture in frames}
        if len(shapes) > 1:
            raise InputError(
                f"{self.path}: frames of {name} have the shapes {sorted(shapes)}"
            )
        t = np.array([at for at, _ in frames])
        joints, names = self._angles(t)
        rows, cols = shapes.pop()
        meta: dict[str, Any] = {
            "labels": dict(self.beside.table("labels", {}).raw),
            "skin": {"rows": rows, "cols": cols, **self.beside.table("skin", {}).raw},
            **({} if names is None else {"joint_names": list(names)}),
            **({} if self.arm is None else {"arm": self.arm.to_dict()}),
            "source": f"{self.path.name} {name}",
        }
        pictures = np.stack([picture for _, picture in frames])
        return Recording(t=t - t[0], frames=pictures, joints=joints, meta=meta)

    def _angles(
        self, t: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64] | None, tuple[str, ...] | None]:
        """Angles (n, dof) at the frames' times, and the joints' names if the log has
        them."""
        topic, series = self._topic("joints", self._joints)
        if not series:
            return None, None
        logged = tuple(series)
        named = logged != tuple(map(str, range(len(logged))))
        wanted = logged
        if self.arm is not None and named:
            wanted = self.arm.names
            try:
                joint_columns(logged, wanted)
            except InputError as error:
                raise InputError(f"{self.path}: {topic} has {error}") from None
            others = [name for name in logged if name not in wanted]
            if others:
                LOG.warning(
                    f"{self.path}: {topic}: joints outside the arm: {', '.join(others)}"
                )
        elif self.arm is not None and len(logged) != self.arm.dof:
            raise InputError(
                f"{self.path}: {topic} has {len(logged)} angles without names, but the "
                "arm has "
                f"{self.arm.dof} joints"
            )
        first = max(min(series[name])[0] for name in wanted)
        last = min(max(series[name])[0] for name in wanted)
        gap_s = max(first - t[0], t[-1] - last)
        if gap_s > OLDEST_S:
            LOG.warning(
                f"{self.path}: {topic} lacks joint angles for up to {gap_s:.2f} s of "
                "the frames; "
                "the nearest ones are used"
            )
        angles = np.stack([_at(t, series[name]) for name in wanted], axis=1)
        return angles, wanted if named else None

    def _topic(self, kind: str, topics: Mapping[str, Any]) -> tuple[str, Any]:
        """The topic of a kind that the JSON file names, or else the only one, with its
        messages."""
        name = self.beside.get(f"{kind}_topic", None)
        if name is None and len(topics) > 1:
            raise InputError(
                f"{self.path}: {kind} are on {', '.join(sorted(topics))}; name one of "
                "them as "
                f'"{kind}_topic" in {self.path.stem}.json beside it'
            )
        if name is None:
            return next(iter(topics.items()), ("", ()))
        if not isinstance(name, str) or name not in topics:
            raise InputError(
                f"{self.path}: {kind}_topic in {self.path.stem}.json must be one of "
                f"{sorted(topics)}, not {shown(name)}"
            )
        return name, topics[name]


def _at(
    t: NDArray[np.float64], series: list[tuple[float, float]]
) -> NDArray[np.float64]:
    """A joint's angles at times `t`: linear between messages, constant before and after
    them.

    An angle that wraps at +-pi between two messages is taken to have gone the shorter
    way.
    """
    at, angle = np.array(sorted(series)).T
    angles: NDArray[np.float64] = np.interp(t, at, np.unwrap(angle))
    return angles
