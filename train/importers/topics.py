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
import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from edge.config import short_text
from edge.errors import InputError
from edge.record.recording import Recording
from edge.touch.arm import Chain
from edge.touch.joint_angles import joint_columns
from edge.touch.layout import RELEASE_S
from train.importers import clock
from train.importers.counts import Samples, rest_of, skin_shape
from train.importers.options import LogOptions, add_value_options
from train.json_files import json_table
from train.progress import say

LOG = logging.getLogger(__name__)

IMAGE = "sensor_msgs/msg/Image"
ARRAYS = tuple(
    f"std_msgs/msg/{name}MultiArray"
    for name in (
        "UInt8",
        "Int8",
        "UInt16",
        "Int16",
        "UInt32",
        "Int32",
        "Float32",
        "Float64",
    )
)
JOINTS = "sensor_msgs/msg/JointState"
FRAMES = (IMAGE, *ARRAYS)
FRAME = ["stamp", "logged", "values"]
ANGLE = ["stamp", "logged", "joint", "angle"]
"""Columns of the tables of frames and of joint angles: seconds by a message's own clock,
or by logging where it has none; seconds by logging; and a joint by its name or else
its place."""
ENCODINGS = {"mono16": 2, "16UC1": 2, "mono8": 1, "8UC1": 1}
"""Bytes of a pixel."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add options for the values in a log."""
    parser.add_argument(
        "--field",
        metavar="NAME",
        help="the values in a sensor's own message, such as data or taxels.force",
    )
    add_value_options(parser)


class Unusable(ValueError):
    """A message from which no frame can be read."""


class Log:
    """The messages of one log: collected as a table for each topic, then read as
    frames, joint angles and a recording.

    Attributes:
        path: of the log.
        beside: the JSON file beside it.
        arm: whose joint angles are wanted, or None for all.
        options: of the command.
    """

    def __init__(self, path: Path, arm: Chain | None, options: LogOptions) -> None:
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
        self._frames: dict[str, list[Any]] = defaultdict(list)
        """{topic: a row of FRAME for each message}."""
        self._angles: dict[str, list[Any]] = defaultdict(list)
        """{topic: a row of ANGLE for each angle of a message}."""
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

    def add(self, topic: str, kind: str, message: Any, logged_s: float) -> None:
        """Collect a message that is wanted."""
        stamp = getattr(getattr(message, "header", None), "stamp", None)
        # Some drivers leave the stamp empty, which is the time 0.
        t = (0.0 if stamp is None else stamp.sec + stamp.nanosec * 1e-9) or logged_s
        if kind == JOINTS:
            angles = angles_of(message, f"{self.path}: a message of {topic}")
            rows = [(t, logged_s, joint, angle) for joint, angle in angles.items()]
            if rows:
                self._angles[topic] += rows
            return
        try:
            values = values_of(kind, message, self.options)
        except Unusable as reason:
            self._left_out[topic].append(str(reason))
        else:
            self._frames[topic].append((t, logged_s, values))

    def recording(self) -> Recording:
        """The frames in the order of the log, from 0, with joint angles at the frames'
        times.

        Raises:
            InputError: the log has no topic of frames or several, or the frames' shapes
                or times cannot be used.
        """
        topic, frames = self._table_of_frames()
        joints_topic = self._topic("joints", self._angles)
        angles = pd.DataFrame(self._angles.get(joints_topic or "", []), columns=ANGLE)
        times = self._clock(frames, angles)
        axes = self.options.axes
        values = np.stack(frames["values"])
        where = f"{self.path}: {topic}"
        samples = Samples.of(where, frames[times].to_numpy(), values, axes)
        samples = samples.in_order("message")
        meta: dict[str, Any] = {
            "labels": dict(self.beside.table("labels", {}).raw),
            "source": f"{self.path.name} {topic}",
            "skin": self.beside.table("skin", {}).raw,
        }
        if self.arm is not None:
            meta["arm"] = self.arm.to_dict()
        if joints_topic is not None:
            where = f"{self.path}: {joints_topic}"
            names = self._joint_names(where, angles["joint"].unique().tolist())
            angles = angles[[times, "joint", "angle"]]
            joints = self._joints_at(samples.t, where, angles, names)
            samples = replace(samples, joints=joints)
            if isinstance(names[0], str):
                meta["joint_names"] = names
        stamp = "as logged" if times == "logged" else "of the messages"
        say(
            f"frames: {topic}, joint angles: {joints_topic or 'none'}, time: {stamp}, "
            f"labels: {meta['labels'] or 'none'} of {self.path.stem}.json"
        )
        if axes is not None:
            say(axes.text)
        shape = skin_shape(samples, self._stated_shape(values.shape[1:]), self.options)
        return rest_of([samples], self.options).recording(samples, shape, meta)

    def _table_of_frames(self) -> tuple[str, pd.DataFrame]:
        """The topic of the frames, and its table; names the topics that are left out."""
        name = self._topic("frames", self._frames)
        if name is None:
            raise InputError(f"{self.path}: holds no frames{self._why_empty()}")
        frames = pd.DataFrame(self._frames[name], columns=FRAME)
        for topic, reasons in self._left_out.items():
            part = f"{topic},"
            if topic == name:
                count = len(reasons)
                messages = f"{count + len(frames)} messages of {topic}"
                part = f"{count} of {messages}, the first of"
            say(f"{self.path}: skipped {part} which {reasons[0]}")
        shapes = {values.shape for values in frames["values"]}
        if len(shapes) > 1:
            raise InputError(
                f"{self.path}: frames of {name} have the shapes {sorted(shapes)}"
            )
        return name, frames

    def _why_empty(self) -> str:
        """Why a log has no frames, behind a sentence."""
        for topic, reasons in self._left_out.items():
            return f": {topic} {reasons[0]}"
        return f"; they must be {IMAGE}, an array, or a sensor's own with --field"

    def _stated_shape(self, shape: tuple[int, ...]) -> tuple[int, ...]:
        """The rows and columns that frames of a shape tell, or else the file beside the
        log."""
        if self.options.axes is not None:
            shape = shape[:-1]
        skin = self.beside.table("skin", {})
        if len(shape) != 2 and skin.has("rows"):
            shape = (skin.whole("rows"), skin.whole("cols"))
        return shape

    def _clock(self, frames: pd.DataFrame, angles: pd.DataFrame) -> str:
        """The clock of the times: that of the stamps; but that of logging, which is
        said, where the stamps of frames and angles are of clocks that never meet."""
        stamps = frames["stamp"]
        joints_stamps = angles["stamp"]
        before = joints_stamps.max() < stamps.min()
        after = joints_stamps.min() > stamps.max()
        if not (before or after):
            return "stamp"
        say(
            f"{self.path}: the clocks of frames (from {stamps[0]:.3f} s) and joint "
            f"angles (from {joints_stamps[0]:.3f} s) never meet; both are taken by the "
            "time at which they were logged"
        )
        return "logged"

    def _joints_at(
        self,
        t: NDArray[np.float64],
        where: str,
        angles: pd.DataFrame,
        names: Sequence[str | int],
    ) -> NDArray[np.float64]:
        """(n, dof) angles of some joints at the frames' times, of a table of time,
        joint and angle."""
        release_s = self.beside.table("skin", {}).number("release_s", RELEASE_S)
        columns = []
        for name in names:
            joint = angles[angles["joint"] == name]
            joint_t = joint.iloc[:, 0].to_numpy()
            radians = joint[["angle"]].to_numpy()
            columns.append(clock.angles_at(t, joint_t, radians, release_s, where))
        return clock.complete(np.hstack(columns), where)

    def _joint_names(self, where: str, logged: list[str | int]) -> list[str | int]:
        """The joints whose angles are taken, in their order."""
        if self.arm is None:
            return logged
        names = [name for name in logged if isinstance(name, str)]
        if not names:
            if len(logged) != self.arm.dof:
                raise InputError(
                    f"{where} has {len(logged)} angles without names, but the arm has "
                    f"{self.arm.dof} joints"
                )
            return logged
        try:
            joint_columns(names, self.arm.names)
        except InputError as error:
            raise InputError(f"{where} has {error}") from None
        outside = [name for name in names if name not in self.arm.names]
        if outside:
            LOG.warning(f"{where}: joints outside the arm: {', '.join(outside)}")
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
            raise InputError(
                f"{self.path}: {kind}_topic in {self.path.stem}.json must be one of "
                f"{sorted(self._topics[kind])}, not {short_text(name)}"
            )
        return name


def angles_of(message: Any, where: str) -> dict[str | int, float]:
    """{joint, by its name or else its place: angle in radians} of a `JointState`.

    A message without positions, and an angle that is not finite, tell nothing.

    Raises:
        InputError: its names and angles do not belong together.
    """
    names = list(message.name)
    angles = message.position.tolist()
    if angles and names and len(names) != len(angles):
        raise InputError(
            f"{where}: its names are {len(names)} and angles {len(angles)}"
        )
    if angles and len(set(names)) < len(names):
        raise InputError(f"{where} names a joint twice")
    joints = zip(names or range(len(angles)), angles, strict=False)
    return {joint: angle for joint, angle in joints if math.isfinite(angle)}


def values_of(kind: str, message: Any, options: LogOptions) -> NDArray[np.float64]:
    """The values of a message, in the shape that it tells.

    Raises:
        Unusable: it has none.
    """
    if kind == IMAGE:
        return image_values(message)
    if kind in ARRAYS:
        return array_values(message)
    name = options.field
    if name is None:
        raise Unusable(f"is {kind}; give --field, the name of the values in it")
    if options.axes is not None:
        for axes in ((".x", ".y", ".z"), "xyz", "XYZ"):
            with suppress(Unusable):
                values = [field_values(message, name + axis) for axis in axes]
                return np.stack(values, axis=-1)
    return field_values(message, name)


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
    try:
        return np.atleast_1d(np.asarray(value, dtype=np.float64))
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
