"""Opens the skin that a command's options name, and reads it."""

from __future__ import annotations

import argparse
import math
import signal
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from edge.app.output import LOG, Output
from edge.app.sinks.event_writer import Lines
from edge.app.sinks.sink import Event, Fault, Sink
from edge.errors import InputError
from edge.touch.frame import Frame
from edge.touch.joint_stream import open_joints
from edge.touch.layout import for_device
from edge.wire.skin import file as skinfile
from edge.wire.skin.loop import Loop, Stop, stop_on
from edge.wire.skin.skin import SILENT_FRAMES, ChipStatus, Skin

if TYPE_CHECKING:
    from edge.app.sinks.page import Page
    from edge.decide.model import Model
    from edge.touch.arm import Chain
    from edge.touch.joint_stream import Joints
    from edge.wire.fake.player import Playback


def ending_signals() -> list[int]:
    """The signals that end a command after the current frame.

    SIGHUP, sent when an ssh session drops, is one unless it was ignored from the start,
    as under nohup.
    """
    signals: list[int] = [signal.SIGINT, signal.SIGTERM]
    if signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:
        signals.append(signal.SIGHUP)
    return signals


def chip_event(status: ChipStatus, **more: Any) -> dict[str, Any]:
    """The event of a chip's state, with `more` keys."""
    event = {
        "event": "chip",
        **more,
        "bus": status.bus,
        "route": status.spec.route,
        "state": status.state,
    }
    if status.error:
        event["error"] = status.error
    return event


@dataclass(frozen=True)
class Opened:
    """A skin that has been opened.

    Attributes:
        skin: set up and ready to be read.
        lasts_s: how many seconds to read for.
        source: names the skin or the recording in messages and recordings.
        playback: the recording that a fake skin plays; None for a real skin.
        virtual: time is virtual, so that the loop may wait for a slow reader.
    """

    skin: Skin
    lasts_s: float
    source: str
    playback: Playback | None = None
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
    joint_names: Sequence[str] | None = None,
    real_time: bool = False,
) -> Iterator[Opened]:
    """The skin that the options name, closed at the end of the block.

    Args:
        arguments: with the options of `options.add_skin`.
        calibrated: refuse a real skin that has no calibration.
        model: its contact threshold is used if it is lower than the skin's.
        joint_names: the joint angles that a recording must have; they are put into
            this order.
        real_time: play a recording at its original speed.

    Raises:
        InputError: the options or the skin's file cannot be used.
        EdgeError: the skin cannot be read.
    """
    if arguments.fake is not None:
        opened = _played(arguments, joint_names, real_time)
    elif arguments.loop:
        raise InputError("--loop works only with --fake REC.npz")
    elif arguments.skin is None:
        raise InputError("give --skin skin.toml, or --fake REC.npz to use no hardware")
    else:
        skin = Skin.open(arguments.skin, calibrated=calibrated)
        opened = Opened(skin, math.inf, arguments.skin)
    with opened.skin as skin:
        if model is not None:
            threshold_counts = for_device(
                model.info.layout, skin.layout
            ).threshold_counts
            skin.touch_counts = min(skin.touch_counts, threshold_counts)
        for status in skin.status():
            if status.error:
                LOG.warning(f"{status.error}; skipped for now")
        yield opened


def _played(
    arguments: argparse.Namespace, joint_names: Sequence[str] | None, real_time: bool
) -> Opened:
    """The recording of --fake, played onto fake chips."""
    from edge.wire.fake.player import play_file  # a robot has a skin

    file = None if arguments.skin is None else skinfile.load(arguments.skin)
    skin, playback = play_file(
        arguments.fake,
        file,
        joint_names=joint_names,
        loop=arguments.loop,
        real_time=real_time,
    )
    name = f"fake {arguments.fake}"
    return Opened(skin, playback.ends, name, playback, virtual=not real_time)


@dataclass(frozen=True)
class Live:
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

    @property
    def sinks(self) -> list[Sink]:
        """The page, if there is one."""
        return [] if self.page is None else [self.page]

    def frames(self) -> Iterator[tuple[Frame, list[Event]]]:
        """Each frame, with the events of buses, taxels and chips that fail or return."""
        for frame in self.loop.frames():
            yield frame, [Fault(line) for line in self._faults(frame.t)]

    def _faults(self, t: float) -> Iterator[dict[str, Any]]:
        for name, lost in self.skin.bus_changes():
            state = "lost" if lost else "back"
            yield {"event": "bus", "t": t, "bus": name, "state": state}
        silent = self.skin.silent_changes()
        if silent is not None:
            taxels = {"invalid": silent, "frames": SILENT_FRAMES}
            yield {"event": "taxels", "t": t, **taxels}
        broken = self.skin.broken_changes()
        if broken is not None:
            yield {"event": "broken", "t": t, "taxels": broken}
        for status in self.skin.changes():
            yield chip_event(status, t=t)

    def may_wait(self) -> bool:
        """Whether to wait for a slow reader: only in virtual time, until the end."""
        return self.opened.virtual and not self.stop.asked

    def lines(self) -> Lines:
        """The events' way out; in virtual time it waits for a slow reader of stdout."""
        return Lines(form=self.output.line, patient=self.may_wait)


@contextmanager
def reading(
    arguments: argparse.Namespace,
    *,
    model: Model | None = None,
    arm: Chain | None = None,
    needs_joints: bool = True,
    real_time: bool = False,
    **page: Any,
) -> Iterator[Live]:
    """Read the skin that the options name, until a signal comes.

    Args:
        arguments: with the options of `options.add_reading`.
        model: decides on the contacts; its arm and its angles are wanted, if no others.
        arm: whose angles are wanted.
        needs_joints: refuse a source without the angles that the model needs.
        real_time: play a recording at its original speed, as with a page.
        page: further arguments of `edge.app.sinks.page.Page`.

    Raises:
        InputError: the options cannot be used.
        EdgeError: the skin cannot be read.
    """
    names = None
    dof = None
    if arm is None and model is not None:
        arm = model.info.chain
        dof = _angles(model)
    if arm is not None:
        names = arm.names
        dof = arm.dof
    real_time |= arguments.web is not None
    played_names = names if arguments.joints is None else None
    with ExitStack() as stack:
        opening = open_skin(
            arguments, model=model, joint_names=played_names, real_time=real_time
        )
        opened = stack.enter_context(opening)
        # Before this point a signal ends the program at once, as nothing can be lost.
        stop = stack.enter_context(stop_on(*ending_signals()))
        if model is not None and needs_joints and arguments.joints is None:
            model.require_joints(opened.dof, opened.source)
        joints = stack.enter_context(_joints(arguments.joints, opened, dof, names))
        loop = Loop(
            opened.skin,
            joints=joints,
            onsets=_onsets(model, joints, opened),
            lasts_s=min(opened.lasts_s, arguments.seconds),
            stop=stop,
        )
        live = stack.enter_context(_page(arguments.web, opened, loop, page))
        yield Live(opened, loop, stop, live, Output.of(arguments))


def _page(
    address: str | None,
    opened: Opened,
    loop: Loop,
    options: Mapping[str, Any],
) -> AbstractContextManager[Page | None]:
    """The live page, where one is asked for."""
    if address is None:
        return nullcontext()
    from edge.app.sinks.page import open_page  # few runs have a page

    layout = opened.skin.layout
    return open_page(address, layout, loop.schedule, title=opened.source, **options)


def _angles(model: Model) -> int | None:
    """The joint angles that a line must have: none in a stream of onsets alone."""
    return 0 if model.info.dof is None and model.info.onset else model.info.dof


def _onsets(
    model: Model | None, joints: Joints | Playback | None, opened: Opened
) -> Joints | Playback | None:
    """What tells the onsets of a model whose touches begin by an event.

    Raises:
        InputError: nothing does.
    """
    if model is None or not model.info.onset:
        return None
    source = joints or opened.playback
    if source is None:
        raise InputError(
            "the model's touches begin by an event: give --joints stdin or udp:PORT, "
            'with a line {"onset": true} for each'
        )
    return source


def _joints(
    option: str | None,
    opened: Opened,
    dof: int | None,
    names: Sequence[str] | None,
) -> AbstractContextManager[Joints | Playback | None]:
    """The joint angles that another program sends, or those of a played recording."""
    if option is None:
        return nullcontext(opened.playback if opened.dof else None)
    return open_joints(option, dof, names, opened.skin.clock.real)
