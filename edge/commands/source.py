"""Opens the skin that a command's options name, and reads it with all that they put
beside it."""

from __future__ import annotations

import argparse
import signal
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from edge.commands.output import LOG, Output, event_text
from edge.errors import InputError
from edge.events import Event
from edge.fake.clock import PacedClock, VirtualClock
from edge.fake.player import Playback, play, skin_file
from edge.model.model import Model, require_joints
from edge.output.event_writer import Lines, LineWriter
from edge.recording import load
from edge.skin import file as skinfile
from edge.skin.loop import JointSource, Loop, Stop, stop_on
from edge.skin.skin import SILENT_FRAMES, ChipStatus, Skin
from edge.touch.arm import Chain
from edge.touch.frame import Frame
from edge.touch.joint_stream import Joints, joint_source
from edge.touch.layout import for_device

if TYPE_CHECKING:
    from edge.tools.page import Page


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
        playback: the recording that a fake skin plays; None for a real skin.
        source: names the skin or the recording in messages and recordings.
    """

    skin: Skin
    lasts_s: float
    playback: Playback | None
    source: str

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
    touch = (
        None
        if model is None
        else for_device(model.info.layout, file.layout).threshold_counts
    )
    lasts_s, source = arguments.seconds, arguments.skin
    if recording is None:
        skin = Skin.open(file, calibrated=calibrated, touch_counts=touch)
    else:
        clock = PacedClock() if arguments.real_time else VirtualClock()
        # Without a skin file nobody calibrates, and the chips serve the recording as it
        # is.
        noise = 0.0 if arguments.skin is None else arguments.noise
        skin, playback = play(
            file, recording, loop=arguments.loop, clock=clock, noise_counts=noise,
            touch_counts=touch,
        )  # fmt: skip
        lasts_s, source = min(playback.ends, lasts_s), f"fake {arguments.fake}"
    with skin:
        for status in skin.status():
            if status.error:
                LOG.warning(f"{status.error}; left out for now")
        yield Opened(skin, lasts_s, playback, source)


@dataclass(frozen=True)
class Reading(Opened):
    """A skin that is being read, with its loop, page and output.

    Attributes:
        loop: gives the frames with their joint angles.
        stop: ends the loop.
        page: the live page, or None.
        output: text or JSON.
    """

    loop: Loop
    stop: Stop
    page: Page | None
    output: Output

    def frames(self) -> Iterator[tuple[Frame, list[dict[str, Any]]]]:
        """Each frame, with the events of buses, taxels and chips that fail or
        recover."""
        skin = self.skin
        for frame in self.loop.frames():
            events: list[dict[str, Any]] = [
                {
                    "event": "bus",
                    "t": frame.t,
                    "bus": name,
                    "state": "lost" if lost else "back",
                }
                for name, lost in skin.bus_changes()
            ]
            if (silent := skin.silent_changes()) is not None:
                taxels = {"event": "taxels", "t": frame.t, "invalid": silent}
                events.append({**taxels, "frames": SILENT_FRAMES})
            events += [chip_event(status, t=frame.t) for status in skin.changes()]
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

    def lines(self, udp: str | None = None, more: Sequence[LineWriter] = ()) -> Lines:
        """The events' way out; in virtual time it waits for a slow reader of stdout."""
        virtual = self.playback is not None and not isinstance(
            self.skin.clock, PacedClock
        )
        return Lines(
            udp=udp,
            form=self.output.line,
            patient=lambda: virtual and not self.stop.asked,
            more=more,
        )


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
        arm, dof = model.info.chain, model.info.dof
    if arguments.fake is not None and (real_time or arguments.web is not None):
        arguments.real_time = True
    played = arm if arguments.joints is None else None
    with ExitStack() as stack:
        opened = stack.enter_context(open_skin(arguments, model=model, arm=played))
        # Before this point a signal ends the program at once, as nothing can be lost.
        stop = stack.enter_context(stop_on(*ending_signals()))
        joints: JointSource | None = opened.playback if opened.dof else None
        if arguments.joints is not None:
            if dof is None:
                raise InputError("the model uses no joint angles; leave --joints out")
            clock = opened.skin.clock
            now = clock.real if isinstance(clock, PacedClock) else clock.now
            source = stack.enter_context(joint_source(arguments.joints))
            names = None if arm is None else arm.names
            joints = stack.enter_context(
                closing(Joints(source, dof=dof, names=names, now=now))
            )
        elif model is not None and needs_joints:
            require_joints(model, opened.dof, opened.source)
        loop = Loop(opened.skin, joints=joints, lasts_s=opened.lasts_s, stop=stop)
        live = None
        if arguments.web is not None:
            from edge.tools.page import Page  # few runs show one

            live = Page(arguments.web, opened.skin.layout, title=opened.source, **page)
            stack.callback(live.server.close)
            LOG.info(f"open {live.server.link} in a browser")
        yield Reading(
            **vars(opened), loop=loop, stop=stop, page=live, output=Output.of(arguments)
        )
