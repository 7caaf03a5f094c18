"""`edge-classify run`: live decisions."""

from __future__ import annotations

import argparse
import json
import signal
import sys
from typing import Any

from edge.commands.source import add_skin, check_joints, open_joints, open_skin
from edge.live import Event, Watcher
from edge.loop import Loop, Schedule, stop_on
from edge.model import Model
from edge.skin import ChipStatus


def add_parser(commands: Any) -> None:
    """Add the command to the command line."""
    parser: argparse.ArgumentParser = commands.add_parser(
        "run",
        help="read the skin and decide, live",
        description="Reads the skin and prints one JSON object a line: contacts, decisions, "
        "chips that fail and come back. Ctrl-C ends it after the line at hand.",
    )
    parser.add_argument("--model", required=True, help="model.onnx")
    add_skin(parser, joint_options=True)
    parser.add_argument(
        "--without-joints",
        choices=("flag", "skin"),
        default="flag",
        help="when angles are missing at a contact's onset: flag the decision missing_pose "
        "(default), or measure that contact's motion on the skin and flag it skin_motion",
    )
    parser.set_defaults(run=run)


def chip_event(status: ChipStatus, t: float) -> Event:
    """A chip that failed or came back, as a line."""
    event = {
        "event": "chip",
        "t": t,
        "bus": status.bus,
        "place": status.place,
        "state": status.state,
    }
    return {**event, "error": status.error} if status.error else event


def end_event(schedule: Schedule, frames: int) -> Event:
    """How the loop kept its period."""
    return {
        "event": "end",
        "frames": frames,
        "missed_ticks": schedule.missed,
        "period_ms": {
            f"p{p:g}": round(schedule.periods.percentile(p) * 1e3, 2) for p in (50, 99, 99.9)
        }
        if schedule.periods.n
        else {},
    }


def emit(events: list[Event]) -> None:
    """Print events, a line each, at once."""
    for event in events:
        sys.stdout.write(json.dumps(event, ensure_ascii=False) + "\n")
    if events:
        sys.stdout.flush()


def run(arguments: argparse.Namespace) -> int:
    """Read, watch, print, until the recording or the user ends it."""
    model = Model(arguments.model)
    chain = model.info.chain
    with stop_on(signal.SIGINT) as stop, open_skin(arguments) as opened:
        on_skin = arguments.without_joints == "skin"
        if not on_skin:
            check_joints(model, arguments, opened)
        skin = opened.skin
        dof = None if chain is None else chain.dof
        with open_joints(arguments, opened, dof) as joints:
            watcher = Watcher(model, skin.layout)
            # The model's threshold counts where it is the lower one.
            skin.touch_counts = min(skin.touch_counts, watcher.layout.threshold_counts)
            loop = Loop(
                skin,
                joints=joints if chain is not None else None,
                lasts_s=opened.lasts_s,
                stop=stop,
            )
            frames = 0
            for frame in loop.frames():
                frames += 1
                emit([chip_event(status, frame.t) for status in skin.changes()])
                if on_skin:
                    # A contact keeps the chain that it finds at its first frame.
                    watcher.tracker.chain = None if frame.joints is None else chain
                emit(watcher.push(frame))
            emit(watcher.finish())
            emit([end_event(loop.schedule, frames)])
    return 0
