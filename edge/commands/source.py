"""Opens the skin and the source of joint angles that a command's options name."""

from __future__ import annotations

import argparse
import logging
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from edge.errors import InputError
from edge.fake.clock import PacedClock, VirtualClock
from edge.fake.player import Playback, play, skin_file
from edge.model.model import Model, require_joints
from edge.recording import load
from edge.runtime import joint_stream
from edge.skin import file as skinfile
from edge.skin.loop import JointSource
from edge.skin.skin import SILENT_FRAMES, ChipStatus, Skin
from edge.touch.arm import Chain
from edge.touch.layout import for_device

if TYPE_CHECKING:
    from edge.runtime.page import Page

LOG = logging.getLogger(__name__)


def ending_signals() -> list[int]:
    """The signals that end a command after the current frame.

    SIGHUP, sent when an ssh session drops, is one unless it was ignored from the start, as under
    nohup.
    """
    signals: list[int] = [signal.SIGINT, signal.SIGTERM]
    if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:
        signals.append(signal.SIGHUP)
    return signals


def chip_event(status: ChipStatus, **more: Any) -> dict[str, Any]:
    """The event of a chip's state, with `more` keys."""
    event = {"event": "chip", **more, "bus": status.bus, "place": status.route}
    event["state"] = status.state
    return {**event, "error": status.error} if status.error else event


def skin_events(skin: Skin, t: float) -> list[dict[str, Any]]:
    """The events of buses that were lost or have come back, and of taxels that give no value."""
    events: list[dict[str, Any]] = [
        {"event": "bus", "t": t, "bus": name, "state": "lost" if lost else "back"}
        for name, lost in skin.bus_changes()
    ]
    silent = skin.silent_changes()
    if silent is not None:
        events.append({"event": "taxels", "t": t, "invalid": silent, "frames": SILENT_FRAMES})
    return events


@contextmanager
def open_page(arguments: argparse.Namespace, opened: Opened, **more: Any) -> Iterator[Page | None]:
    """The live page that `--web` asks for, or None; see `edge.runtime.page.Page`.

    Raises:
        InputError: the address cannot be used.
    """
    if arguments.web is None:
        yield None
        return
    from edge.runtime.page import Page  # a skin without a page needs no web server

    with Page(arguments.web, opened.skin.layout, title=opened.source, **more) as page:
        LOG.info(f"open {page.server.link} in a browser")
        yield page


@dataclass(frozen=True)
class Opened:
    """A skin that is being read.

    Attributes:
        skin: set up and ready to be read.
        lasts_s: how many seconds to read for.
        playback: the recording that a fake skin plays; None for a real skin.
        source: names the skin or the recording in messages and recordings.
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
        paced: play a recording at its original speed, whatever the options say.
        model: its contact threshold is used if it is lower than the skin's.
        arm: whose joint angles a recording must have; they are put into the arm's order.

    Raises:
        InputError: the options or the skin's file cannot be used.
        EdgeError: the skin cannot be read.
    """
    recording = playback = None
    if arguments.fake is not None:
        recording = load(arguments.fake)
        if arm is not None:
            recording = recording.for_joints(arm.names, arguments.fake)
    elif arguments.loop or arguments.real_time:
        raise InputError("--loop and --real-time need --fake, a recording to play")
    if arguments.skin is not None:
        file = skinfile.load(arguments.skin)
    elif recording is not None:
        file = skin_file(recording.layout)
    else:
        raise InputError("give --skin skin.toml, or --fake REC.npz to use no hardware")
    touch = None if model is None else for_device(model.info.layout, file.layout).threshold_counts
    lasts_s, source = arguments.seconds, arguments.skin
    if recording is None:
        skin = Skin.open(file, calibrated=calibrated, touch_counts=touch)
    else:
        clock = PacedClock() if paced or arguments.real_time else VirtualClock()
        skin, playback = play(file, recording, loop=arguments.loop, clock=clock, touch_counts=touch)
        lasts_s, source = min(playback.ends, lasts_s), f"fake {arguments.fake}"
    with skin:
        for status in skin.status():
            if status.error:
                LOG.warning(f"{status.error}; left out for now")
        LOG.debug(
            f"{source}: {file.layout.rows} x {file.layout.cols} taxels, {len(file.chips)} chips on "
            f"{len(file.buses)} buses at {file.reading.rate_hz:g} Hz"
        )
        yield Opened(skin, lasts_s, playback, source)


@contextmanager
def open_joints(
    arguments: argparse.Namespace,
    opened: Opened,
    arm: Chain | None,
    dof: int | None = None,
) -> Iterator[JointSource | None]:
    """The source of joint angles that the options name, or else the recording being played.

    Args:
        arguments: with the options of `options.add_joints`.
        opened: the skin that is being read.
        arm: whose joint angles are wanted, or None if it is unknown.
        dof: how many angles a line must then have.

    Raises:
        InputError: the options contradict each other.
    """
    if arguments.joints is None:
        yield opened.playback if opened.playback is not None and opened.playback.dof else None
        return
    dof = dof if arm is None else arm.dof
    if dof is None:
        raise InputError("the model uses no joint angles; leave --joints out")
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
                LOG.warning(f"--joints: ignored {count} datagrams from a second sender, {name}")
        if stream.malformed:
            LOG.warning(
                f"--joints: unusable lines: {stream.malformed}; the last one: {stream.problem}"
            )


def check_joints(model: Model, arguments: argparse.Namespace, opened: Opened) -> None:
    """Refuse a source of frames without the joint angles that the model needs.

    Raises:
        InputError: it has none, or a different number of them.
    """
    if arguments.joints is None:
        dof = None if opened.playback is None else opened.playback.dof
        require_joints(model, dof, opened.source)
