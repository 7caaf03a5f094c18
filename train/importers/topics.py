"""Topics of frames and joint angles in a robot's log, turned into one recording.

Frames are `sensor_msgs/Image` (`mono16`, `16UC1`, `mono8` or `8UC1`), an array of
`std_msgs` (`UInt16MultiArray`, `Int16MultiArray`, `Float32MultiArray` and so on). A
sensor's own message is read by the definition that the log carries: `--field forces.z`
names the values in it, and with `--axes` the field whose parts are x, y and z. Joint
angles are `sensor_msgs/JointState`. A message may carry its own time (`header.stamp`);
otherwise the time at which it was logged is used. Where the clocks of frames and angles
never meet, both are taken by the time of logging.

Joints are identified by name, in any order, and several messages may share them. With
an arm, its joints are selected in the arm's order, and a warning names the others.
Without an arm, all joints with angles are kept. Angles are not known across a gap.

A JSON file beside the log, `NAME.json`, may complete it: `labels` {task: label}, `skin`
(see `edge.touch.layout.SkinLayout`), `arm`, and, if there are several topics of a kind,
the ones to use: `frames_topic` and `joints_topic`. Other topics are not read.
"""

import argparse
import logging
from collections import defaultdict
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from edge.commands.output import counted
from edge.config import short_text
from edge.errors import InputError
from edge.recording import Recording
from edge.touch.arm import Chain
from edge.touch.joint_angles import joint_columns
from edge.touch.layout import RELEASE_S
from train.importers import clock, counts
from train.importers.axes import Axes
from train.importers.counts import Trial, rest_of, skin_shape
from train.json_files import json_table
from train.progress import say

LOG = logging.getLogger(__name__)

IMAGE = "sensor_msgs/msg/Image"
ARRAYS = tuple(
    f"std_msgs/msg/{name}MultiArray"
    for name in "UInt8 Int8 UInt16 Int16 UInt32 Int32 Float32 Float64".split()
)
JOINTS = "sensor_msgs/msg/JointState"
FRAMES = (IMAGE, *ARRAYS)
CLOCKS = ["stamp", "logged"]
"""Seconds by a message's own clock, or by logging where it has none; and by logging."""
ENCODINGS = {"mono16": 2, "16UC1": 2, "mono8": 1, "8UC1": 1}
"""Bytes of a pixel."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add options for the values in a log."""
    parser.add_argument(
        "--field",
        metavar="NAME",
        help="the values in a sensor's own message, such as data or taxels.force",
    )
    counts.add_options(parser)


class Unusable(ValueError):
    """A message from which no frame can be read."""


class Log:
    """The messages of one log, collected by topic.

    Attributes:
        path: of the log.
        beside: the JSON file beside it.
        arm: whose joint angles are wanted, or None for all.
        options: of the command.
        axes: of the taxels; None for one.
    """

    def __init__(
        self,
        path: Path,
        arm: Chain | None,
        options: argparse.Namespace,
    ) -> None:
        """Read the JSON file beside a log; `arm` has precedence over the file's.

        Raises:
            InputError: the file is not a JSON object.
        """
        file = path.with_name(path.stem + ".json")
        self.path = path
        self.beside = json_table(file)
        if arm is None and self.beside.has("arm"):
            arm = Chain.from_dict(self.beside.get("arm"), where=f"{file}: arm")
        self.arm = arm
        self.options = options
        self.axes = Axes.of(options)
        self._frames: dict[str, list[Any]] = defaultdict(list)
        """{topic: (stamp, time of logging, values) of each message}; the stamp is the
        time of logging where a message has none."""
        self._joints: dict[str, list[Any]] = defaultdict(list)
        """{topic: (stamp, time of logging, name of a joint or else its place, its
        angle)}"""
        self._left_out: dict[str, list[str]] = defaultdict(list)
        """{topic: why no frame can be read from each of some messages}."""
        self._topics: dict[str, set[str]] = defaultdict(set)
        """{`frames` or `joints`: all topics of such a kind}."""

    def takes(self, topic: str, kind: str) -> bool:
        """Whether messages of a kind on a topic are wanted; others are never read."""
        if kind == JOINTS:
            self._topics["joints"].add(topic)
            return bool(self.beside.get("joints_topic", topic) == topic)
        if kind in FRAMES:
            self._topics["frames"].add(topic)
        if self.beside.has("frames_topic"):
            return bool(self.beside.get("frames_topic") == topic)
        return kind in FRAMES or self.options.field is not None

    def ros(self, topic: str, kind: str, message: Any, logged_s: float) -> None:
        """Take in a ROS message that is wanted."""
        stamp = getattr(getattr(message, "header", None), "stamp", None)
        # Some drivers leave the stamp empty, which is the time 0.
        t = (0.0 if stamp is None else stamp.sec + stamp.nanosec * 1e-9) or logged_s
        times = (t, logged_s)
        if kind == JOINTS:
            angles = np.asarray(message.position, dtype=np.float64)
            self._pose(topic, times, list(message.name), angles)
        else:
            self._frame(topic, times, kind, message)

    def leave_out(self, topic: str, reason: str) -> None:
        """Note why a message of a topic that may hold frames is not read."""
        if self.beside.get("frames_topic", topic) == topic:
            self._left_out[topic].append(reason)

    def _frame(
        self,
        topic: str,
        times: tuple[float, float],
        kind: str,
        message: Any,
    ) -> None:
        """Take in a message's values, or leave it out where it has none."""
        try:
            values = self._values(kind, message)
        except Unusable as reason:
            self.leave_out(topic, str(reason))
        else:
            self._frames[topic].append((*times, values))

    def _pose(
        self,
        topic: str,
        times: tuple[float, float],
        names: list[str],
        angles: NDArray[np.float64],
    ) -> None:
        """Take in a message's angles.

        A message without positions, and an angle that is not finite, tell nothing.
        """
        if not angles.size:
            return
        where = f"{self.path}: a message of {topic}"
        if angles.ndim != 1 or (names and len(names) != len(angles)):
            raise InputError(
                f"{where}: its names are {len(names)} and angles {angles.size}"
            )
        if len(set(names)) < len(names):
            raise InputError(f"{where} names a joint twice")
        keys: Sequence[str | int] = names or range(len(angles))
        for name, angle in zip(keys, angles.tolist(), strict=True):
            if np.isfinite(angle):
                self._joints[topic].append((*times, name, angle))

    def _values(self, kind: str, message: Any) -> NDArray[np.float64]:
        """The values of a message, in the shape that it tells.

        Raises:
            Unusable: it has none.
        """
        if kind == IMAGE:
            return image_values(message)
        if kind in ARRAYS:
            return array_values(message)
        name = self.options.field
        if name is None:
            raise Unusable(f"is {kind}; give --field, the name of the values in it")
        if self.axes is None:
            return field_values(message, name)
        for axes in (".x .y .z", "x y z", "X Y Z"):
            with suppress(Unusable):
                values = [field_values(message, name + axis) for axis in axes.split()]
                return np.stack(values, axis=-1)
        return field_values(message, name)

    def recording(self) -> Recording:
        """The frames in the order of the log, from 0, with joint angles at the frames'
        times.

        Raises:
            InputError: the log has no topic of frames or several, or the frames' shapes
                or times cannot be used.
        """
        name = self._topic("frames", self._frames)
        if name is None:
            raise InputError(f"{self.path}: {self._why_empty()}")
        frames = self._frames_of(name)
        topic = self._topic("joints", self._joints)
        poses = self._joints.get(topic or "", [])
        angles = pd.DataFrame(poses, columns=[*CLOCKS, "joint", "angle"])
        t = self._clock(frames, angles)
        values = np.stack(frames["values"])
        where = f"{self.path}: {name}"
        trial = Trial.of(where, frames[t].to_numpy(), values, self.axes)
        trial = trial.in_order("message")
        meta: dict[str, Any] = {
            "labels": dict(self.beside.table("labels", {}).raw),
            "source": f"{self.path.name} {name}",
            "skin": self.beside.table("skin", {}).raw,
        }
        if self.arm is not None:
            meta["arm"] = self.arm.to_dict()
        if topic is not None:
            names = self._joint_names(topic, angles["joint"].unique().tolist())
            angles = angles.rename(columns={t: "t"})
            joints = self._joints_at(trial.t, topic, angles, names)
            trial = replace(trial, joints=joints)
            if isinstance(names[0], str):
                meta["joint_names"] = names
        if self.axes is not None:
            say(self.axes.text)
        shape = skin_shape(trial, self._stated_shape(values.shape[1:]), self.options)
        return rest_of([trial], self.options).recording(trial, shape, meta)

    def _frames_of(self, name: str) -> pd.DataFrame:
        """The frames of a topic, with their times; says what is left out."""
        frames = pd.DataFrame(self._frames[name], columns=[*CLOCKS, "values"])
        for topic, reasons in self._left_out.items():
            part = f"{topic},"
            if topic == name:
                count = len(reasons)
                messages = f"{count + len(frames)} messages of {topic}"
                part = f"{count} of {messages}, the first of"
            elif topic in self._joints:
                part = f"{counted(len(reasons), 'message')} of {topic}, the first of"
            say(f"{self.path}: left out {part} which {reasons[0]}")
        shapes = {values.shape for values in frames["values"]}
        if len(shapes) > 1:
            raise InputError(
                f"{self.path}: frames of {name} have the shapes {sorted(shapes)}"
            )
        return frames

    def _why_empty(self) -> str:
        """The sentence for a log without frames."""
        for topic, reasons in self._left_out.items():
            return f"holds no frames: {topic} {reasons[0]}"
        return (
            f"holds no frames; they must be {IMAGE}, {ARRAYS[2]} or another array, or a "
            "message of a sensor's own with --field"
        )

    def _stated_shape(self, shape: tuple[int, ...]) -> tuple[int, ...]:
        """The rows and columns that frames of a shape tell, or the file beside the log.

        Raises:
            InputError: neither does, nor --shape.
        """
        if self.axes is not None:
            shape = shape[:-1]
        if len(shape) == 2 or self.options.shape is not None:
            return shape
        skin = self.beside.table("skin", {})
        if skin.has("rows") and skin.has("cols"):
            return skin.whole("rows"), skin.whole("cols")
        raise InputError(
            f"{self.path}: its frames do not state their rows and columns; give --shape "
            'ROWSxCOLS, or put them as {"skin": {"rows": ..., "cols": ...}} into '
            f"{self.path.stem}.json beside it"
        )

    def _clock(self, frames: pd.DataFrame, joints: pd.DataFrame) -> str:
        """The clock of the times: that of the stamps; but that of logging, which is
        said, where the stamps of frames and angles are of clocks that never meet."""
        first, last = frames["stamp"].agg(["min", "max"])
        stamps = joints["stamp"]
        if not (stamps.min() > last or stamps.max() < first):
            return "stamp"
        say(
            f"{self.path}: the clocks of frames (from {frames['stamp'][0]:.3f} s) and joint "
            f"angles (from {stamps[0]:.3f} s) never meet; both are taken by the "
            "time at which they were logged"
        )
        return "logged"

    def _joints_at(
        self,
        t: NDArray[np.float64],
        topic: str,
        angles: pd.DataFrame,
        names: Sequence[str | int],
    ) -> NDArray[np.float64]:
        """(n, dof) angles of some joints at the frames' times."""
        release_s = self.beside.table("skin", {}).number("release_s", RELEASE_S)
        columns = []
        for name in names:
            rows = angles.loc[angles["joint"] == name, ["t", "angle"]].to_numpy()
            order = clock.order(rows[:, 0], f"{self.path}: {topic}", "message")
            rows = rows[order.kept]
            columns.append(clock.angles_at(t, rows[:, 0], rows[:, 1:], release_s))
        at_frames = np.hstack(columns)
        unknown = ~np.isfinite(at_frames).all(axis=1)
        at_frames[unknown] = np.nan
        if unknown.all():
            raise InputError(
                f"{self.path}: {topic} has no joint angle at the time of any frame; "
                "record both with one clock"
            )
        if unknown.any():
            say(
                f"{self.path}: {topic} lacks joint angles for {int(unknown.sum())} of "
                f"{len(t)} frames, where they are unknown"
            )
        return at_frames

    def _joint_names(self, topic: str, logged: list[str | int]) -> list[str | int]:
        """The joints whose angles are taken, in their order."""
        if self.arm is None:
            return logged
        names = [name for name in logged if isinstance(name, str)]
        if not names:
            if len(logged) != self.arm.dof:
                raise InputError(
                    f"{self.path}: {topic} has {len(logged)} angles without names, but "
                    f"the arm has {self.arm.dof} joints"
                )
            return logged
        try:
            joint_columns(names, self.arm.names)
        except InputError as error:
            raise InputError(f"{self.path}: {topic} has {error}") from None
        outside = [name for name in names if name not in self.arm.names]
        if outside:
            LOG.warning(
                f"{self.path}: {topic}: joints outside the arm: {', '.join(outside)}"
            )
        return list(self.arm.names)

    def _topic(self, kind: str, topics: Mapping[str, Any]) -> str | None:
        """The topic of a kind that the JSON file names, or else the only one; None
        where there is none."""
        name = self.beside.get(f"{kind}_topic", None)
        if name is None and len(topics) > 1:
            raise InputError(
                f"{self.path}: {kind} are on {', '.join(sorted(topics))}; name one of "
                f'them as "{kind}_topic" in {self.path.stem}.json beside it'
            )
        if name is None:
            return next(iter(topics), None)
        if not (isinstance(name, str) and name in topics):
            reasons = self._left_out.get(str(name))
            why = f"; it {reasons[0]}" if reasons else ""
            raise InputError(
                f"{self.path}: {kind}_topic in {self.path.stem}.json must be one of "
                f"{sorted(self._topics[kind])}, not {short_text(name)}{why}"
            )
        return name


def image_values(message: Any) -> NDArray[np.float64]:
    """(rows, columns) values of an image.

    Raises:
        Unusable: it is of another encoding, or damaged.
    """
    size = ENCODINGS.get(message.encoding)
    if size is None:
        raise Unusable(f"is {message.encoding}; frames are {', '.join(ENCODINGS)}")
    raw = np.asarray(message.data, dtype=np.uint8)
    wide = message.width * size
    if raw.size != message.height * message.step or message.step < wide:
        raise Unusable("has an image that does not have its stated size")
    lines = raw.reshape(message.height, message.step)[:, :wide]
    kind = f"{'>' if message.is_bigendian else '<'}u{size}"
    return np.ascontiguousarray(lines).view(kind).astype(np.float64)


def array_values(message: Any) -> NDArray[np.float64]:
    """Values of an array, in the shape of its layout where it has one.

    Raises:
        Unusable: its layout is not that of its data.
    """
    shape = [int(dimension.size) for dimension in message.layout.dim]
    values = np.asarray(message.data, dtype=np.float64)[message.layout.data_offset :]
    if len(shape) < 2:
        return values
    if values.size != np.prod(shape):
        raise Unusable(f"has a message of {values.size} values, not {shape}")
    return values.reshape(shape)


def field_values(message: Any, name: str) -> NDArray[np.float64]:
    """The numbers of a field of a message, such as `forces.z` of each of its forces.

    Raises:
        Unusable: the message has no such field, or no numbers in it.
    """
    value: Any = message
    for part in name.split("."):
        value = _part(value, part)
    return np.atleast_1d(numbers_in(value, name))


def numbers_in(value: Any, name: str) -> NDArray[np.float64]:
    """Numbers in lists of any depth.

    Raises:
        Unusable: they are no numbers, or of no shape; the sentence names them.
    """
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise Unusable(f"has no numbers in {name}") from None


def _part(value: Any, name: str) -> Any:
    """A field of a message, or of each message of a list."""
    if isinstance(value, list | tuple):
        return [_part(entry, name) for entry in value]
    try:
        return getattr(value, name)
    except AttributeError:
        fields = [key for key in vars(value) if not key.startswith("_")]
        raise Unusable(
            f"has no field {name}; it has {', '.join(fields) or 'none'}"
        ) from None
