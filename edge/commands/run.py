"""Read the skin and decide, live.

Reads the skin and reports contacts, decisions, and chips that fail or recover. Ctrl-C, SIGTERM or
SIGHUP ends it cleanly after the current frame, a second one at once. It tells systemd when it is
ready and that it is alive.
"""

from __future__ import annotations

import argparse
import logging
import time
from contextlib import ExitStack
from typing import Any

from edge.classifier import Classifier
from edge.commands.options import add_error, add_joints, add_skin, add_web, check_error
from edge.commands.output import Output, event_text
from edge.commands.source import (
    check_joints,
    chip_event,
    ending_signals,
    open_joints,
    open_page,
    open_skin,
    skin_events,
)
from edge.model.model import Model
from edge.runtime.event_writer import Lines
from edge.runtime.systemd import Notifier
from edge.runtime.touch_map import events_on_map, map_writer
from edge.skin.loop import Loop, Schedule, stop_on
from edge.touch.track import MAX_CONTACTS

LOG = logging.getLogger(__name__)


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
        help="if joint angles are missing at a contact's onset: `flag` (the default) decides "
        "without them, flagged missing_pose; `skin` measures the contact's motion on the skin, "
        "flagged skin_motion",
    )
    parser.add_argument(
        "--udp",
        metavar="HOST:PORT",
        help="also send each event to this address, as a datagram of one JSON line",
    )
    add_web(parser, "")
    parser.add_argument(
        "--map",
        metavar="FILE",
        help="follow several contacts at once, and append each to FILE with its position",
    )


def end_event(schedule: Schedule, frames: int, lost: dict[str, int]) -> dict[str, Any]:
    """The last event: how well the loop kept its period, and how many lines were lost."""
    periods = schedule.periods
    percentiles = (50, 99, 99.9) if periods.n else ()
    return {
        "event": "end",
        "frames": frames,
        "missed_ticks": schedule.missed,
        "period_ms": {f"p{p:g}": round(periods.percentile(p) * 1e3, 2) for p in percentiles},
        **({"lost": lost} if lost else {}),
    }


def run(arguments: argparse.Namespace) -> int:
    """Read, decide and print until the recording ends, or the user or systemd stops it."""
    model = Model(arguments.model)
    check_error(model, arguments.error)
    arguments.real_time |= arguments.web is not None and arguments.fake is not None
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
        # Before this point a signal ends the program at once, as nothing can be lost.
        stop = stack.enter_context(stop_on(*ending_signals()))
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
        page = stack.enter_context(open_page(arguments, opened, decides=True))
        poses = None if dof is None else joints
        loop = Loop(skin, joints=poses, lasts_s=opened.lasts_s, stop=stop)

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
            faults = skin_events(skin, frame.t)
            faults += [chip_event(status, t=frame.t) for status in skin.changes()]
            decided = classifier.push(frame)
            emit([*faults, *(event.to_dict() for event in decided)])
            if page is not None:
                for fault in faults:
                    page.notice(event_text(fault).strip())
                page.push(frame, decided, loop.schedule)
        notifier.stopping()
        emit([event.to_dict() for event in classifier.finish()])
        emit([end_event(loop.schedule, frames, lines.lost)])
    return 0
