"""Opens the skin that a command's options name, and reads it."""

from __future__ import annotations

import argparse
import os
import signal
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from edge.commands.output import LOG, Output, event_text
from edge.errors import InputError
from edge.events import Event
from edge.output.event_writer import Lines, LineWriter
from edge.skin import file as skinfile
from edge.skin.loop import JointSource, Loop, Stop, stop_on
from edge.skin.skin import SILENT_FRAMES, ChipStatus, Skin
from edge.touch.frame import Frame
from edge.touch.layout import for_device

if TYPE_CHECKING:
    from edge.fake.player import Playback
    from edge.model.model import Model
    from edge.tools.page import Page
    from edge.touch.arm import Chain


def ending_signals() -> list[int]:
    """The signals that end a command after the current frame.

    SIGHUP, sent when an ssh session drops, is one unless it was ignored from the start,
    as under nohup.
    """
    hangup = (
        [] if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN else [signal.SIGHUP]
    )
    return [signal.SIGINT, signal.SIGTERM, *hangup]


def chip_event(status: ChipStatus, **more: Any) -> dict[str, Any]:
    """The event of a chip's state, with `more` keys."""
    event = {"event": "chip", **more, "bus": status.bus, "place": status.spec.route}
    event["state"] = status.state
    return {**event, "error": status.error} if status.error else event


@dataclass(frozen=True)
class Opened:
    """A skin that has been opened.

    Attributes:
        skin: set up and ready to be read.
        lasts_s: how many seconds to read for.
        source: names the skin or the recording in messages and recordings.
        playback: the recording that a fake skin plays; None for a real skin.
        now: the time on the skin's clock at which another program's line arrives.
        virtual: time is virtual, so that the loop may wait for a slow reader.
    """

    skin: Skin
    lasts_s: float
    source: str
    playback: Playback | None
    now: Callable[[], float]
    virtual: bool = False

    @property
    def dof(self) -> int | None:
        """Number of joint angles in the recording that is played; None without any."""
        return None if self.playback is None else self.playback.recording.dof


@contextmanager
def open_skin(
    arguments: argparse.Namespace,
    *,
    calibrated: bool = True,
    model: Model | None = None,
    arm: Chain | None = None,
) -> Iterator[Opened]:
    """The skin that the options name, closed at the end of the block.

    Args:
        arguments: with the options of `options.add_skin`.
        calibrated: refuse a real skin that has no calibration.
        model: its contact threshold is used if it is lower than the skin's.
        arm: whose joint angles a recording must have; they are put into the arm's
            order.

    Raises:
        InputError: the options or the skin's file cannot be used.
        EdgeError: the skin cannot be read.
    """
    if arguments.fake is not None:
        opened = _played(arguments, model, arm)
    elif arguments.loop or arguments.real_time:
        raise InputError("--loop and --real-time work only with --fake REC.npz")
    elif arguments.skin is None:
        raise InputError("give --skin skin.toml, or --fake REC.npz to use no hardware")
    else:
        file = skinfile.load(arguments.skin)
        touch_counts = _touch_counts(model, file)
        skin = Skin.open(file, calibrated=calibrated, touch_counts=touch_counts)
        lasts_s = arguments.seconds
        opened = Opened(skin, lasts_s, arguments.skin, None, skin.clock.now)
    with opened.skin:
        for status in opened.skin.status():
            if status.error:
                LOG.warning(f"{status.error}; left out for now")
        yield opened


def _touch_counts(model: Model | None, file: skinfile.SkinFile) -> int | None:
    """The counts above which a taxel is touched, by the model."""
    if model is None:
        return None
    return for_device(model.info.layout, file.layout).threshold_counts


def _played(
    arguments: argparse.Namespace, model: Model | None, arm: Chain | None
) -> Opened:
    """The recording of --fake, played onto fake chips."""
    from edge.fake.clock import PacedClock, VirtualClock
    from edge.fake.player import play, skin_file
    from edge.recording import load

    recording = load(arguments.fake)
    if arm is not None:
        recording = recording.for_joints(arm.names, arguments.fake)
    noise_counts = 0.0
    if arguments.skin is None:
        # Nobody calibrates, and the chips serve the recording as it is.
        file = skin_file(recording.layout)
    else:
        file = skinfile.load(arguments.skin)
        noise_counts = arguments.noise
    clock = PacedClock() if arguments.real_time else VirtualClock()
    skin, playback = play(
        file,
        recording,
        loop=arguments.loop,
        clock=clock,
        noise_counts=noise_counts,
        touch_counts=_touch_counts(model, file),
    )
    return Opened(
        skin,
        min(playback.ends, arguments.seconds),
        f"fake {arguments.fake}",
        playback,
        now=clock.real,
        virtual=not arguments.real_time,
    )


@dataclass(frozen=True)
class Reading:
    """A skin that is being read, with its loop, page and output.

    Attributes:
        opened: the skin.
        loop: gives the frames with their joint angles.
        stop: ends the loop.
        page: the live page, or None.
        output: text or JSON.
    """

    opened: Opened
    loop: Loop
    stop: Stop
    page: Page | None
    output: Output

    @property
    def skin(self) -> Skin:
        """The skin."""
        return self.opened.skin

    def frames(self) -> Iterator[tuple[Frame, list[dict[str, Any]]]]:
        """Each frame, with the events of buses, taxels and chips that fail or return."""
        skin = self.skin
        for frame in self.loop.frames():
            events: list[dict[str, Any]] = []
            for name, lost in skin.bus_changes():
                state = "lost" if lost else "back"
                events.append(
                    {"event": "bus", "t": frame.t, "bus": name, "state": state}
                )
            silent = skin.silent_changes()
            if silent is not None:
                taxels = {"event": "taxels", "t": frame.t, "invalid": silent}
                events.append({**taxels, "frames": SILENT_FRAMES})
            for status in skin.changes():
                events.append(chip_event(status, t=frame.t))
            yield frame, events

    def show(
        self,
        frame: Frame,
        faults: Sequence[dict[str, Any]],
        events: Sequence[Event] = (),
    ) -> None:
        """Show a frame on the page, if there is one."""
        if self.page is not None:
            for fault in faults:
                self.page.notice(event_text(fault).strip())
            self.page.push(frame, events, self.loop.schedule)

    def may_wait(self) -> bool:
        """Whether to wait for a slow reader: only in virtual time, until the end."""
        return self.opened.virtual and not self.stop.asked

    def lines(self, udp: str | None = None, more: Sequence[LineWriter] = ()) -> Lines:
        """The events' way out; in virtual time it waits for a slow reader of stdout."""
        return Lines(udp=udp, form=self.output.line, patient=self.may_wait, more=more)


@contextmanager
def reading(
    arguments: argparse.Namespace,
    *,
    model: Model | None = None,
    arm: Chain | None = None,
    dof: int | None = None,
    needs_joints: bool = True,
    real_time: bool = False,
    **page: Any,
) -> Iterator[Reading]:
    """Read the skin that the options name, until a signal comes.

    Args:
        arguments: with the options of `options.add_reading`.
        model: decides on the contacts; its arm and its angles are wanted.
        arm: whose angles are wanted, without a model.
        dof: how many angles are wanted, without a model.
        needs_joints: refuse a source without the angles that the model needs.
        real_time: play a recording at its original speed, whatever the options say, as
            a page always does.
        page: further arguments of `edge.tools.page.Page`.

    Raises:
        InputError: the options cannot be used.
        EdgeError: the skin cannot be read.
    """
    if model is not None:
        arm = model.info.chain
        dof = model.info.dof
    if arguments.fake is not None and (real_time or arguments.web is not None):
        arguments.real_time = True
    played_arm = arm if arguments.joints is None else None
    with ExitStack() as stack:
        opened = stack.enter_context(open_skin(arguments, model=model, arm=played_arm))
        # Before this point a signal ends the program at once, as nothing can be lost.
        stop = stack.enter_context(stop_on(*ending_signals()))
        if arguments.joints is not None:
            angles = _joints(arguments.joints, arm, dof, opened)
            joints: JointSource | None = stack.enter_context(angles)
        else:
            joints = _own_joints(opened, model if needs_joints else None)
        loop = Loop(opened.skin, joints=joints, lasts_s=opened.lasts_s, stop=stop)
        live = None
        if arguments.web is not None:
            live = stack.enter_context(_page(arguments.web, opened, page))
        yield Reading(opened, loop, stop, live, Output.of(arguments))


def _own_joints(opened: Opened, model: Model | None) -> JointSource | None:
    """The joint angles of a skin that no other program's are given for.

    Raises:
        InputError: the model needs others.
    """
    if model is not None:
        model.require_joints(opened.dof, opened.source)
    return opened.playback if opened.dof else None


@contextmanager
def _joints(
    address: str, arm: Chain | None, dof: int | None, opened: Opened
) -> Iterator[JointSource]:
    """The joint angles that another program sends."""
    from edge.touch.joint_stream import Joints, joint_source

    if dof is None:
        raise InputError("the model uses no joint angles; leave --joints out")
    names = None if arm is None else arm.names
    with joint_source(address) as source:
        joints = Joints(source, dof=dof, names=names, now=opened.now)
        try:
            yield joints
        finally:
            joints.close()


def _way_to(link: str) -> str:
    """A sentence with the page's link; the journal, which others read, gets a file's
    name instead."""
    if "JOURNAL_STREAM" not in os.environ:
        return f"open {link} in a browser"
    folder = os.environ.get("RUNTIME_DIRECTORY") or os.environ.get("XDG_RUNTIME_DIR")
    descriptor, name = tempfile.mkstemp(prefix="edge-classify-link-", dir=folder)
    with os.fdopen(descriptor, "w") as file:  # which its owner alone can read
        file.write(f"{link}\n")
    return f"the page's link is in {name}"


@contextmanager
def _page(address: str, opened: Opened, options: dict[str, Any]) -> Iterator[Page]:
    """The live page of a skin."""
    from edge.tools.page import Page

    page = Page(address, opened.skin.layout, title=opened.source, **options)
    try:
        LOG.info(_way_to(page.server.link))
        yield page
    finally:
        page.server.close()
