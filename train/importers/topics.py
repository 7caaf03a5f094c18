"""Topics of frames and joint angles, as robots log them, to one recording.

Of frames: `sensor_msgs/Image` (`mono16`, `16UC1` or `mono8`), `std_msgs/UInt16MultiArray`
(two dimensions in its layout, or the skin's rows and columns beside the file), or JSON
`{"counts": [[...], ...]}`. Of joint angles: `sensor_msgs/JointState`, or JSON `{"q": [...]}`.
Both may have a time of their own (`header.stamp`, `"t"`); else the log's is taken.

What a log does not say stands in a JSON file beside it, `NAME.json`, all keys optional:
`labels` {task: label}, `skin` (see `edge.touch.layout.SkinLayout`), `arm`, and the topics to take
where there are several, `frames_topic` and `joints_topic`.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError
from edge.recording import Recording

FRAMES = ("sensor_msgs/msg/Image", "std_msgs/msg/UInt16MultiArray")
JOINTS = ("sensor_msgs/msg/JointState",)


@dataclass
class Log:
    """Messages of one log, sorted out by topic as they are read.

    Attributes:
        path: the log, for sentences.
        beside: what the JSON file beside it says.
    """

    path: Path
    beside: dict[str, Any]
    _frames: dict[str, list[tuple[float, NDArray[np.uint16]]]] = field(default_factory=dict)
    _joints: dict[str, list[tuple[float, NDArray[np.float64]]]] = field(default_factory=dict)

    @classmethod
    def of(cls, path: Path) -> Log:
        """A log with what stands beside it.

        Raises:
            InputError: the file beside it is not a JSON object.
        """
        beside = path.with_name(path.stem + ".json")
        if not beside.is_file():
            return cls(path, {})
        try:
            said = json.loads(beside.read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError) as error:
            raise InputError(f"{beside}: cannot be read as JSON: {error}") from None
        if not isinstance(said, dict):
            raise InputError(f"{beside}: must be a JSON object with labels, skin, arm")
        return cls(path, said)

    def ros(self, topic: str, kind: str, message: Any, logged_s: float) -> None:
        """Take in a ROS message; kinds that are neither frames nor joint angles are left out."""
        stamp = getattr(getattr(message, "header", None), "stamp", None)
        t = logged_s if stamp is None else stamp.sec + stamp.nanosec * 1e-9
        if t == 0.0:  # a driver that does not fill in its stamp
            t = logged_s
        if kind in JOINTS:
            self._joints.setdefault(topic, []).append(
                (t, np.asarray(message.position, dtype=np.float64))
            )
        elif kind == FRAMES[0]:
            self._frames.setdefault(topic, []).append((t, self._image(topic, message)))
        elif kind == FRAMES[1]:
            self._frames.setdefault(topic, []).append((t, self._array(topic, message)))

    def json(self, topic: str, data: bytes, logged_s: float) -> None:
        """Take in a JSON message."""
        try:
            message = json.loads(data)
            t = float(message.get("t", logged_s))
            if "q" in message:
                q = np.asarray(message["q"], dtype=np.float64)
                self._joints.setdefault(topic, []).append((t, q))
            elif "counts" in message:
                counts = self._counts(topic, np.asarray(message["counts"]))
                self._frames.setdefault(topic, []).append((t, counts))
        except InputError:
            raise
        except (AttributeError, TypeError, ValueError, RecursionError) as error:
            raise InputError(f"{self.path}: a message of {topic} cannot be used: {error}") from None

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
        joints = self._angles(t)
        meta: dict[str, Any] = {
            key: self.beside[key] for key in ("labels", "skin", "arm") if key in self.beside
        }
        rows, cols = shapes.pop()
        meta["skin"] = {"rows": rows, "cols": cols, **meta.get("skin", {})}
        meta["source"] = f"{self.path.name} {name}"
        return Recording(
            t=t - t[0],
            frames=np.stack([picture for _, picture in frames]),
            joints=joints,
            meta=meta,
        )

    def _angles(self, t: NDArray[np.float64]) -> NDArray[np.float64] | None:
        name, angles = self._only("joints", self._joints)
        if not angles:
            return None
        angles = sorted(angles, key=lambda entry: entry[0])
        if len({q.shape for _, q in angles}) > 1 or angles[0][1].ndim != 1:
            raise InputError(f"{self.path}: messages of {name} differ in the number of joints")
        at = np.array([time for time, _ in angles])
        q = np.stack([pose for _, pose in angles])
        return np.stack([np.interp(t, at, column) for column in q.T], axis=1)

    def _only(self, what: str, topics: dict[str, list[Any]]) -> tuple[str, list[Any]]:
        wanted = self.beside.get(f"{what}_topic")
        if wanted is not None:
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
        return next(iter(topics.items()), ("", []))
