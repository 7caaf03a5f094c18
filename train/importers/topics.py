"""From the topics of frames and joint angles in a robot's log to one recording.

Frames are `sensor_msgs/Image` (`mono16`, `16UC1`, `mono8` or `8UC1`), `std_msgs/UInt16MultiArray`
(with two dimensions in its layout, or the skin's rows and columns beside the file), or JSON
`{"counts": [[...], ...]}`. Joint angles are `sensor_msgs/JointState`, or JSON `{"q": [...]}`,
optionally with `"names": [...]`. Each message may carry its own time (`header.stamp`, `"t"`);
otherwise the time at which it was logged is used.

Angles are told apart by the names of their joints, whatever their order in a message, and several
messages may share the joints between them. An arm's joints are selected by name, in the arm's
order; other joints are left out, and a warning names them. Without an arm, all joints are kept.

What a log does not say may stand in a JSON file beside it, `NAME.json`, with the optional keys
`labels` {task: label}, `skin` (see `edge.touch.layout.SkinLayout`), `arm`, and, if there are
several topics of a kind, the ones to use: `frames_topic` and `joints_topic`.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.config import parse_json, read_json
from edge.errors import InputError
from edge.recording import Recording
from edge.runtime.joint_stream import OLDEST_S
from edge.touch.arm import Chain, joint_columns

LOG = logging.getLogger(__name__)

FRAMES = ("sensor_msgs/msg/Image", "std_msgs/msg/UInt16MultiArray")
JOINTS = ("sensor_msgs/msg/JointState",)


@dataclass
class Log:
    """Messages of one log, sorted out by topic as they are read.

    Attributes:
        path: the log, for sentences.
        beside: what the JSON file beside it says.
        arm: whose joint angles are wanted, or None for all.
    """

    path: Path
    beside: dict[str, Any]
    arm: Chain | None = None
    _frames: dict[str, list[tuple[float, NDArray[np.uint16]]]] = field(default_factory=dict)
    _joints: dict[str, dict[str, list[tuple[float, float]]]] = field(default_factory=dict)
    """Times and angles, by topic and joint."""

    @classmethod
    def of(cls, path: Path, arm: Chain | None = None) -> Log:
        """A log with what stands beside it; `arm` is used rather than the one beside it.

        Raises:
            InputError: the file beside it is not a JSON object.
        """
        beside = path.with_name(path.stem + ".json")
        if not beside.is_file():
            return cls(path, {}, arm)
        said = read_json(beside)
        if not isinstance(said, dict):
            raise InputError(f"{beside}: must be a JSON object with labels, skin, arm")
        if arm is None and "arm" in said:
            arm = Chain.from_dict(said["arm"], where=f"{beside}: arm")
        return cls(path, said, arm)

    def ros(self, topic: str, kind: str, message: Any, logged_s: float) -> None:
        """Take in a ROS message; kinds that are neither frames nor joint angles are left out."""
        stamp = getattr(getattr(message, "header", None), "stamp", None)
        t = logged_s if stamp is None else stamp.sec + stamp.nanosec * 1e-9
        if t == 0.0:  # a driver that does not fill in its stamp
            t = logged_s
        if kind in JOINTS:
            self._pose(topic, t, list(message.name), np.asarray(message.position))
        elif kind == FRAMES[0]:
            self._frames.setdefault(topic, []).append((t, self._image(topic, message)))
        elif kind == FRAMES[1]:
            self._frames.setdefault(topic, []).append((t, self._array(topic, message)))

    def json(self, topic: str, data: bytes, logged_s: float) -> None:
        """Take in a JSON message."""
        try:
            message = parse_json(data, f"{self.path}: a message of {topic}")
            t = float(message.get("t", logged_s))
            if "q" in message:
                q = np.asarray(message["q"], dtype=np.float64)
                self._pose(topic, t, list(map(str, message.get("names", ()))), q)
            elif "counts" in message:
                counts = self._counts(topic, np.asarray(message["counts"]))
                self._frames.setdefault(topic, []).append((t, counts))
        except InputError:
            raise
        except (AttributeError, OverflowError, TypeError, ValueError) as error:
            raise InputError(f"{self.path}: a message of {topic} cannot be used: {error}") from None

    def _pose(self, topic: str, t: float, names: list[str], q: NDArray[np.float64]) -> None:
        """Take in a message's angles; joints without names are called by their positions."""
        if q.ndim != 1 or (names and len(names) != len(q)):
            raise InputError(
                f"{self.path}: a message of {topic} has {len(names)} names for {q.size} angles"
            )
        if len(set(names)) < len(names):
            raise InputError(f"{self.path}: a message of {topic} names a joint twice")
        if not np.isfinite(q).all():
            raise InputError(f"{self.path}: an angle of {topic} is not finite")
        joints = self._joints.setdefault(topic, {})
        for name, angle in zip(names or map(str, range(len(q))), q.tolist(), strict=True):
            joints.setdefault(name, []).append((t, angle))

    def _image(self, topic: str, message: Any) -> NDArray[np.uint16]:
        kinds = {"mono16": 2, "16UC1": 2, "mono8": 1, "8UC1": 1}
        size = kinds.get(message.encoding)
        if size is None:
            raise InputError(
                f"{self.path}: {topic} is of {message.encoding} images; give {', '.join(kinds)}"
            )
        raw = np.asarray(message.data, dtype=np.uint8)
        if raw.size != message.height * message.step or message.step < message.width * size:
            raise InputError(f"{self.path}: an image of {topic} has not the size that it claims")
        lines = raw.reshape(message.height, message.step)[:, : message.width * size]
        order = ">" if message.is_bigendian else "<"
        pixels = np.ascontiguousarray(lines).view(f"{order}u{size}")
        return pixels.astype(np.uint16)

    def _array(self, topic: str, message: Any) -> NDArray[np.uint16]:
        shape = [int(dimension.size) for dimension in message.layout.dim]
        values = np.asarray(message.data)[message.layout.data_offset :]
        if len(shape) != 2:
            skin = self.beside.get("skin", {})
            if "rows" not in skin or "cols" not in skin:
                raise InputError(
                    f"{self.path}: {topic} does not say its rows and columns; give them as "
                    f'{{"skin": {{"rows": ..., "cols": ...}}}} in {self.path.stem}.json beside it'
                )
            shape = [skin["rows"], skin["cols"]]
        if values.size != math.prod(shape):
            raise InputError(
                f"{self.path}: a message of {topic} has {values.size} values, not {shape}"
            )
        return self._counts(topic, values.reshape(shape))

    def _counts(self, topic: str, counts: NDArray[Any]) -> NDArray[np.uint16]:
        if counts.ndim != 2 or counts.dtype.kind not in "iu":
            raise InputError(
                f"{self.path}: {topic} must hold whole numbers in rows and columns, "
                f"not {counts.dtype} {counts.shape}"
            )
        if counts.size and not 0 <= counts.min() <= counts.max() <= 65535:
            raise InputError(f"{self.path}: {topic} has counts that are not 0 to 65535")
        return counts.astype(np.uint16)

    def recording(self) -> Recording:
        """All that was taken in, in the order of time from 0; joint angles at the frames' times.

        Raises:
            InputError: there is no topic of frames, or several, or their shapes differ.
        """
        name, frames = self._only("frames", self._frames)
        if not frames:
            raise InputError(
                f"{self.path}: holds no frames; they must be {' or '.join(FRAMES)}, or JSON "
                '{"counts": [[...]]}'
            )
        frames = sorted(frames, key=lambda entry: entry[0])
        shapes = {picture.shape for _, picture in frames}
        if len(shapes) > 1:
            raise InputError(f"{self.path}: frames of {name} have the shapes {sorted(shapes)}")
        t = np.array([at for at, _ in frames])
        meta: dict[str, Any] = {
            key: self.beside[key] for key in ("labels", "skin") if key in self.beside
        }
        joints, names = self._angles(t)
        if names is not None:
            meta["joint_names"] = list(names)
        if self.arm is not None:
            meta["arm"] = self.arm.to_dict()
        rows, cols = shapes.pop()
        meta["skin"] = {"rows": rows, "cols": cols, **meta.get("skin", {})}
        meta["source"] = f"{self.path.name} {name}"
        return Recording(
            t=t - t[0],
            frames=np.stack([picture for _, picture in frames]),
            joints=joints,
            meta=meta,
        )

    def _angles(
        self, t: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64] | None, tuple[str, ...] | None]:
        """Angles (n, dof) at the frames' times, and the joints' names where the log has them."""
        topic, series = self._only("joints", self._joints)
        if not series:
            return None, None
        found = tuple(series)
        named = found != tuple(map(str, range(len(found))))
        wanted = found
        if self.arm is not None and named:
            wanted = self.arm.names
            try:
                joint_columns(found, wanted)
            except InputError as error:
                raise InputError(f"{self.path}: {topic} has {error}") from None
            others = [name for name in found if name not in wanted]
            if others:
                LOG.warning("%s: %s: not of the arm: %s", self.path, topic, ", ".join(others))
        elif self.arm is not None and len(found) != self.arm.dof:
            raise InputError(
                f"{self.path}: {topic} has {len(found)} angles without names, but the arm has "
                f"{self.arm.dof} joints"
            )
        first = max(min(series[name])[0] for name in wanted)
        last = min(max(series[name])[0] for name in wanted)
        apart = max(first - t[0], t[-1] - last)
        if apart > OLDEST_S:
            LOG.warning(
                "%s: %s leaves up to %.2f s of the frames without joint angles; the nearest are "
                "held there",
                self.path,
                topic,
                apart,
            )
        return np.stack([_at(t, series[name]) for name in wanted], axis=1), (
            wanted if named else None
        )

    def _only(self, what: str, topics: Mapping[str, Any]) -> tuple[str, Any]:
        wanted = self.beside.get(f"{what}_topic")
        if wanted is not None:
            if not isinstance(wanted, str):
                raise InputError(
                    f"{self.path}: {what}_topic in {self.path.stem}.json must be a topic's name"
                )
            if wanted not in topics:
                raise InputError(
                    f"{self.path}: has no {what} on {wanted}; it has {sorted(topics) or 'none'}"
                )
            return wanted, topics[wanted]
        if len(topics) > 1:
            raise InputError(
                f"{self.path}: {what} are on {', '.join(sorted(topics))}; name one as "
                f'"{what}_topic" in {self.path.stem}.json beside it'
            )
        return next(iter(topics.items()), ("", ()))


def _at(t: NDArray[np.float64], series: list[tuple[float, float]]) -> NDArray[np.float64]:
    """A joint's angle at times `t`, linear between messages; held before the first and after the
    last. An angle that wraps at +-pi between two messages went the shorter way."""
    at, angle = np.array(sorted(series)).T
    angles: NDArray[np.float64] = np.interp(t, at, np.unwrap(angle))
    return angles
