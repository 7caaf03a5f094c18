"""Read the skin and decide, live.

Reads the skin and reports contacts, decisions, and chips that fail or recover. Ctrl-C,
SIGTERM or SIGHUP ends it cleanly after the current frame, a second one at once. It
tells systemd when it is ready and that it is alive.
"""

import argparse
from collections.abc import Sequence
from contextlib import ExitStack, closing
from typing import Any

from edge.app.options import (
    add_engine,
    add_error,
    add_file,
    add_reading,
    check_error,
    within,
)
from edge.app.output import LOG
from edge.app.sinks import keeper, systemd
from edge.app.sinks.event_writer import Lines
from edge.app.sinks.sink import Sink
from edge.app.source import Live, reading
from edge.decide.classifier import Classifier
from edge.decide.model import Model
from edge.touch.layout import differences
from edge.touch.track import MAX_CONTACTS
from edge.wire.skin.loop import Schedule

SINKS: list[Any] = [keeper, systemd]
"""Modules with `add_options(parser)` and `open_sink(arguments, opened, model)`, which is
None where nothing asks for the sink."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add_file(parser, "model", "the model that decides", needed=True)
    add_engine(parser)
    add_error(parser)
    add_reading(parser)
    parser.add_argument(
        "--without-joints",
        choices=("flag", "skin"),
        default="flag",
        help="answer to joint angles that are missing at a contact's onset: `flag` (the "
        "default) decides without them, flagged missing_pose; `skin` measures the "
        "contact's motion on the skin, flagged skin_motion",
    )
    parser.add_argument(
        "--contacts",
        type=within(int, 1, MAX_CONTACTS),
        default=1,
        metavar="N",
        help="number of contacts that are followed at once; with more than 1, events have the "
        "contact's number, and decisions its position (default: %(default)s)",
    )
    for sink in SINKS:
        sink.add_options(parser)


def end_event(schedule: Schedule, frames: int, lost: int) -> dict[str, Any]:
    """The last event: the loop's periods and the number of lines that were lost."""
    periods = {}
    if schedule.periods.n:
        for percentage in (50, 99, 99.9):
            period_ms = schedule.periods.percentile(percentage) * 1e3
            periods[f"p{percentage:g}"] = round(period_ms, 2)
    event = {
        "event": "end",
        "frames": frames,
        "missed_ticks": schedule.missed_ticks,
        "period_ms": periods,
    }
    return {**event, "lost": {"stdout": lost}} if lost else event


def run(arguments: argparse.Namespace) -> int:
    """Read, decide and print until the recording ends, or someone stops it."""
    model = Model(arguments.model, arguments.engine)
    check_error(model, arguments.error)
    on_skin = arguments.without_joints == "skin"
    with reading(
        arguments,
        model=model,
        needs_joints=not on_skin,
        decides=True,
        folder=arguments.keep,
        choices={name: task.labels for name, task in model.info.tasks.items()},
        # Angles that another program writes go by the real clock.
        real_time=arguments.joints is not None,
    ) as live:
        if live.skin.layout != model.info.layout:
            for sentence in differences(model.info.layout, live.skin.layout):
                LOG.warning(f"{arguments.model}: {sentence}")
        classifier = Classifier(
            model,
            live.skin.layout,
            error=arguments.error,
            max_contacts=arguments.contacts,
            motion_on_skin=on_skin,
        )
        with closing(live.lines()) as lines, ExitStack() as stack:
            sinks: list[Sink] = [lines, *live.sinks]
            for module in SINKS:
                sink = module.open_sink(arguments, live.opened, model)
                if sink is not None:
                    sinks.append(stack.enter_context(closing(sink)))
            frames = _read(live, classifier, sinks, lines)
            lines.write(event.to_dict() for event in classifier.finish())
            lines.write([end_event(live.loop.schedule, frames, lines.lost)])
    return 0


def _read(
    live: Live, classifier: Classifier, sinks: Sequence[Sink], lines: Lines
) -> int:
    """Push every frame into the sinks, until nobody reads the lines; how many."""
    frames = 0
    for frame, faults in live.frames():
        frames += 1
        events = [*faults, *classifier.push(frame)]
        for sink in sinks:
            sink.push(frame, events)
        if lines.gone:
            break
    return frames
