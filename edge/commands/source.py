"""Opening the skin and the joint angles that a command's options name, real or fake."""

from __future__ import annotations

import argparse
import logging
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any

from edge.errors import InputError
from edge.fake.clock import PacedClock, VirtualClock
from edge.fake.player import Playback, play, skin_file
from edge.model.model import Model, require_joints
from edge.recording import load
from edge.runtime import joint_stream
from edge.skin import file as skinfile
from edge.skin.file import SkinFile
from edge.skin.loop import JointSource
from edge.skin.skin import Skin
from edge.touch.arm import Chain
from edge.touch.layout import for_device

LOG = logging.getLogger(__name__)


def touch_counts(model: Model | None, file: SkinFile) -> int | None:
    """The model's threshold in the counts of a skin.

    Raises:
        InputError: the model was made for another skin.
    """
    if model is None:
        return None
    return for_device(model.info.layout, file.layout).threshold_counts


@dataclass(frozen=True)
class Opened:
    """A skin that is being read.

    Attributes:
        skin: started.
        lasts_s: for how many seconds there is something to read.
        playback: the recording that is being played, where the skin is fake.
        source: names the skin or the recording in events and recordings.
    """

    skin: Skin
    lasts_s: float
    playback: Playback | None
    source: str


@contextmanager
def open_skin(
    arguments: argparse.Namespace,
    *,
    calibrated: bool = True,
    paced: bool = False,
    model: Model | None = None,
    arm: Chain | None = None,
) -> Iterator[Opened]:
    """The skin that the options name, closed at the end of the block.

    Args:
        arguments: with the options of `options.add_skin`.
        calibrated: refuse a real skin that has no calibration.
        paced: play a recording no faster than it was recorded, whatever the options say.
        model: a taxel above its threshold counts as touched, if that is lower than the skin's.
        arm: whose joint angles a recording must give, in the order of its joints.

    Raises:
        InputError: the options or the skin's file cannot be used.
        EdgeError: the skin cannot be read.
    """
    with ExitStack() as stack:
        if arguments.fake is not None:
            recording = load(arguments.fake)
            if arm is not None:
                recording = recording.for_joints(arm.names, arguments.fake)
            if arguments.skin is None:
                file = skin_file(recording.layout)
            else:
                file = skinfile.load(arguments.skin)
            clock = PacedClock() if paced or arguments.real_time else VirtualClock()
            touch = touch_counts(model, file)
            skin, playback = play(
                file, recording, loop=arguments.loop, clock=clock, touch_counts=touch
            )
            stack.enter_context(skin)
            lasts = min(playback.ends, arguments.seconds)
            opened = Opened(skin, lasts, playback, f"fake {arguments.fake}")
        else:
            if arguments.loop or arguments.real_time:
                raise InputError("--loop and --real-time need --fake, a recording to play")
            if arguments.skin is None:
                raise InputError("give --skin skin.toml, or --fake REC.npz to use no hardware")
            file = skinfile.load(arguments.skin)
            touch = touch_counts(model, file)
            skin = stack.enter_context(Skin.open(file, calibrated=calibrated, touch_counts=touch))
            opened = Opened(skin, arguments.seconds, None, arguments.skin)
        for status in skin.status():
            if status.error:
                LOG.warning("%s; left out for now", status.error)
        LOG.debug(
            "%s: %d x %d taxels, %d chips on %d buses at %g Hz",
            opened.source,
            *file.layout.shape,
            len(file.chips),
            len(file.buses),
            file.reading.rate_hz,
        )
        yield opened


@contextmanager
def open_joints(
    arguments: argparse.Namespace,
    opened: Opened,
    arm: Chain | None,
    dof: int | None = None,
) -> Iterator[JointSource | None]:
    """The source of joint angles that the options name; a fake skin has its recording's.

    Args:
        arguments: with the options of `options.add_joints`.
        opened: the skin that is being read.
        arm: whose joint angles are wanted, or None.
        dof: how many angles a line must have where the arm is not known.

    Raises:
        InputError: the options contradict each other.
    """
    if arguments.joints is None:
        yield opened.playback if opened.playback is not None and opened.playback.dof else None
        return
    dof = dof if arm is None else arm.dof
    if dof is None:
        raise InputError("--joints: the model measures motion without joint angles; leave it out")
    kind, _, address = arguments.joints.partition(":")
    source: Any
    listener: Any = None
    if kind == "stdin" and not address:
        source = joint_stream.from_file(sys.stdin.fileno())
    elif kind == "udp":
        source, listener = joint_stream.from_udp(address)
    else:
        raise InputError(f"--joints: give stdin or udp:[HOST:]PORT, not {arguments.joints!r}")
    clock = opened.skin.clock
    stream = joint_stream.Joints(
        source,
        dof=dof,
        names=None if arm is None else arm.names,
        now=clock.real if isinstance(clock, PacedClock) else clock.now,
        oldest_s=arguments.joints_oldest,
        shared_clock=arguments.joints_shared_clock,
    )
    try:
        yield stream
    finally:
        if listener is not None:
            listener.close()
            for name, count in source.others.items():
                LOG.warning(
                    "--joints: %d datagrams of a second sender, %s, were ignored", count, name
                )
        if stream.malformed:
            LOG.warning(
                "--joints: %d lines could not be used; of the last: %s",
                stream.malformed,
                stream.problem,
            )


def check_joints(model: Model, arguments: argparse.Namespace, opened: Opened) -> None:
    """Refuse a source without the joint angles that the model needs.

    Raises:
        InputError: it has none, or a different number of them.
    """
    if arguments.joints is None:
        playback = opened.playback
        require_joints(model, None if playback is None else playback.dof, opened.source)
