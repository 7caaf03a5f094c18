"""`edge-classify run`: reads the skin and decides, live."""

from __future__ import annotations

import argparse
import logging
import signal
import time
from contextlib import ExitStack
from typing import Any

from edge.classifier import Classifier
from edge.commands.options import add_error, add_joints, add_skin, check_error
from edge.commands.output import Output
from edge.commands.source import check_joints, open_joints, open_skin
from edge.model.model import Model
from edge.runtime.event_writer import Lines
from edge.runtime.systemd import Notifier
from edge.runtime.touch_map import events_on_map, map_writer
from edge.skin.loop import Loop, Schedule, stop_on
from edge.skin.skin import ChipStatus
from edge.touch.track import MAX_CONTACTS

LOG = logging.getLogger(__name__)


HELP = "read the skin and decide, live"
DESCRIPTION = (
    "Reads the skin and reports contacts, decisions, and chips that fail or "
    "recover. Ctrl-C or SIGTERM ends it cleanly after the current frame; a second signal "
    "terminates it at once. Under systemd it reports that it is ready and alive."
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument("--model", required=True, help="model.onnx")
    add_error(parser)
    add_skin(parser)
    add_joints(parser)
    parser.add_argument(
        "--without-joints",
        choices=("flag", "skin"),
        default="flag",
        help="if joint angles are missing at a contact's onset: flag the decision missing_pose "
        "(flag, the default), or measure that contact's motion on the skin and flag the decision "
        "skin_motion (skin)",
    )
    parser.add_argument(
        "--udp",
        metavar="HOST:PORT",
        help="also send each event there, as a datagram of one JSON line",
    )
    parser.add_argument(
        "--map",
        metavar="FILE",
        help="follow several contacts at once, and append each with its position to FILE",
    )


def chip_event(status: ChipStatus, t: float) -> dict[str, Any]:
    """A chip that failed or recovered, as an event."""
    event = {
        "event": "chip",
        "t": t,
        "bus": status.bus,
        "place": status.route,
        "state": status.state,
    }
    return {**event, "error": status.error} if status.error else event


def end_event(schedule: Schedule, frames: int, lost: dict[str, int]) -> dict[str, Any]:
    """How well the loop kept its period, and the lines that were lost on the way, as an event."""
    return {
        "event": "end",
        "frames": frames,
        "missed_ticks": schedule.missed,
        "period_ms": {
            f"p{p:g}": round(schedule.periods.percentile(p) * 1e3, 2) for p in (50, 99, 99.9)
        }
        if schedule.periods.n
        else {},
        **({"lost": lost} if lost else {}),
    }


def run(arguments: argparse.Namespace) -> int:
    """Read, decide and print until the recording, the user or the service manager ends it."""
    model = Model(arguments.model)
    check_error(model, arguments.error)
    chain, dof = model.info.chain, model.info.dof
    with ExitStack() as stack:
        notifier = stack.enter_context(Notifier(now=time.monotonic))
        opened = stack.enter_context(open_skin(arguments, model=model, arm=chain))
        virtual = opened.playback is not None and not arguments.real_time
        lines = Lines(
            udp=arguments.udp,
            form=Output.of(arguments).line,
            patient=lambda: virtual and not stop.asked,
        )
        # Until here a signal ends the program at once: there is nothing to lose yet.
        stop = stack.enter_context(stop_on(signal.SIGINT, signal.SIGTERM))
        stack.enter_context(lines)
        on_skin = arguments.without_joints == "skin"
        if not on_skin:
            check_joints(model, arguments, opened)
        skin = opened.skin
        joints = stack.enter_context(open_joints(arguments, opened, chain, dof))
        classifier = Classifier(
            model,
            skin.layout,
            error=arguments.error,
            max_contacts=1 if arguments.map is None else MAX_CONTACTS,
            motion_on_skin=on_skin,
        )
        touch_map = None if arguments.map is None else map_writer(arguments.map, model.info)
        if touch_map is not None:
            lines.add(touch_map)
        loop = Loop(
            skin,
            joints=joints if dof is not None else None,
            lasts_s=opened.lasts_s,
            stop=stop,
        )

        def emit(events: list[dict[str, Any]]) -> None:
            lines.write(events)
            if touch_map is not None:
                for line in events_on_map(events):
                    touch_map.put(line)
            if lines.unheard:
                stop.asked = True

        notifier.ready(f"reading {opened.source}")
        frames = 0
        for frame in loop.frames():
            frames += 1
            notifier.alive()
            emit([chip_event(status, frame.t) for status in skin.changes()])
            emit([event.to_dict() for event in classifier.push(frame)])
        notifier.stopping()
        emit([event.to_dict() for event in classifier.finish()])
        emit([end_event(loop.schedule, frames, lines.lost)])
    return 0
