"""What the commands that read a skin share: its options, and opening it."""

from __future__ import annotations

import argparse
import math
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
from edge.runtime import joint_stream as joints
from edge.runtime.loop import JointSource
from edge.skin import file as skinfile
from edge.skin.file import SkinFile
from edge.skin.skin import Skin
from edge.touch.track import for_device


def add_skin(parser: argparse.ArgumentParser, *, joint_options: bool = False) -> None:
    """Add the options that say which skin, real or fake, and where joint angles come from."""
    parser.add_argument("--skin", metavar="skin.toml", help="the skin's file")
    parser.add_argument(
        "--fake",
        metavar="REC.npz",
        help="no hardware: play a recording onto fake chips, in virtual time; without --skin "
        "they are laid out as its frames call for",
    )
    parser.add_argument(
        "--real-time",
        action="store_true",
        help="play it no faster than it was recorded (a terminal's view always does)",
    )
    parser.add_argument("--loop", action="store_true", help="play the recording over and over")
    parser.add_argument(
        "--seconds", type=_seconds, default=math.inf, help="stop after so long (default: never)"
    )
    if joint_options:
        parser.add_argument(
            "--joints",
            metavar="stdin|udp:[HOST:]PORT",
            help='joint angles as JSON lines {"t": seconds, "q": [radians]}; a port without '
            "a host is bound to loopback",
        )
        parser.add_argument(
            "--joints-oldest",
            type=_seconds,
            default=joints.OLDEST_S,
            metavar="SECONDS",
            help="a pose older than this is not used (default: %(default)s)",
        )
        parser.add_argument(
            "--joints-shared-clock",
            action="store_true",
            help="the lines' times are of this machine's monotonic clock",
        )


def _seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not 0.0 < seconds < math.inf:
        raise argparse.ArgumentTypeError(f"must be a number of seconds above 0, not {text!r}")
    return seconds


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
        lasts_s: how long there is something to read.
        playback: what plays where it is fake.
        source: what it is, for events and recordings.
    """

    skin: Skin
    lasts_s: float
    playback: Playback | None
    source: str


@contextmanager
def open_skin(
    arguments: argparse.Namespace, *, calibrated: bool = True, model: Model | None = None
) -> Iterator[Opened]:
    """The skin that the options name, closed at the end of the block.

    Args:
        arguments: parsed.
        calibrated: refuse a real skin that has no calibration.
        model: its threshold says when a taxel is being touched, where it is the lower one.

    Raises:
        InputError: the options or the skin's file cannot be used.
        EdgeError: the skin cannot be read.
    """
    with ExitStack() as stack:
        if arguments.fake is not None:
            recording = load(arguments.fake)
            if arguments.skin is None:
                file = skin_file(recording.layout)
            else:
                file = skinfile.load(arguments.skin)
            clock = PacedClock() if arguments.real_time else VirtualClock()
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
                raise InputError("give --skin skin.toml, or --fake REC.npz for no hardware")
            file = skinfile.load(arguments.skin)
            touch = touch_counts(model, file)
            skin = stack.enter_context(Skin.open(file, calibrated=calibrated, touch_counts=touch))
            opened = Opened(skin, arguments.seconds, None, arguments.skin)
        for status in skin.status():
            if status.error:
                print(f"edge-classify: {status.error}; left out for now", file=sys.stderr)
        yield opened


@contextmanager
def open_joints(
    arguments: argparse.Namespace, opened: Opened, dof: int | None
) -> Iterator[JointSource | None]:
    """Where the options say that joint angles come from; a fake has its recording's.

    Raises:
        InputError: the options make no sense together.
    """
    if arguments.joints is None:
        yield opened.playback if opened.playback is not None and opened.playback.dof else None
        return
    if dof is None:
        raise InputError("--joints: the model measures motion without joint angles; leave it out")
    kind, _, address = arguments.joints.partition(":")
    listener: Any = None
    if kind == "stdin" and not address:
        source = joints.from_file(sys.stdin.fileno())
    elif kind == "udp":
        source, listener = joints.from_udp(address)
    else:
        raise InputError(f"--joints: give stdin or udp:[HOST:]PORT, not {arguments.joints!r}")
    stream = joints.Joints(
        source,
        dof=dof,
        now=opened.skin.clock.now,
        oldest_s=arguments.joints_oldest,
        shared_clock=arguments.joints_shared_clock,
    )
    try:
        yield stream
    finally:
        if listener is not None:
            listener.close()
        if stream.malformed:
            print(
                f"edge-classify: --joints: {stream.malformed} lines could not be used, "
                f"the last because {stream.problem}",
                file=sys.stderr,
            )


def check_joints(model: Model, arguments: argparse.Namespace, opened: Opened) -> None:
    """Refuse a source without the joint angles that the model needs.

    Raises:
        InputError: it has none, or another number of them.
    """
    if arguments.joints is None:
        playback = opened.playback
        require_joints(model, None if playback is None else playback.dof, opened.source)
