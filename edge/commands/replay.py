"""Decide on recordings, frame by frame.

Decides on recordings as `edge-classify run` decides live. Files that cannot be used are named on
stderr and skipped; the exit status is then 2.
"""

from __future__ import annotations

import argparse
import logging
from typing import Any

from edge.classifier import Classifier, suited
from edge.commands.options import add_error, check_error
from edge.commands.output import Output
from edge.commands.summary import Summary
from edge.errors import InputError
from edge.model.model import Model
from edge.model.verify import first_series
from edge.recording import Recording, find, load
from edge.touch.contact import FeatureSeries

LOG = logging.getLogger(__name__)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument("--model", required=True, help="model.onnx")
    parser.add_argument(
        "--summary",
        action="store_true",
        help="print each task's accuracy and confusion matrix, for labelled recordings",
    )
    add_error(parser)
    parser.add_argument("recordings", nargs="+", metavar="REC", help=".npz files or folders")


def contact_of(model: Model, recording: Recording, name: str) -> FeatureSeries:
    """The series of a recording's first contact.

    Raises:
        InputError: the recording does not suit the model, or holds no contact.
    """
    contact = first_series(suited(model, recording, name), model)
    if contact is None:
        raise InputError(f"{name}: holds no contact")
    return contact[1]


def decide(
    model: Model, recording: Recording, name: str, error: float | None = None
) -> list[dict[str, Any]]:
    """All events of one recording as JSON objects, with early decisions if `error` is given.

    Raises:
        InputError: the recording does not suit the model; the message begins with `name`.
    """
    recording = suited(model, recording, name)
    try:
        classifier = Classifier(model, recording.layout, error=error)
        events = [event.to_dict() for event in classifier.classify(recording)]
    except InputError as problem:
        raise InputError(f"{name}: {problem}") from None
    if not any(event["event"] == "onset" for event in events):
        events.append({"event": "no_contact"})
    return events


def run(arguments: argparse.Namespace) -> int:
    """Print the events; 2 if a file could not be used."""
    model = Model(arguments.model)
    check_error(model, arguments.error)
    summary, output = Summary(model.info.tasks), Output.of(arguments)
    failed = 0
    for path in find(arguments.recordings):
        try:
            recording = load(path)
            events = decide(model, recording, str(path), arguments.error)
        except InputError as error:
            failed += 1
            LOG.error("%s", error)
            continue
        labels = recording.labels
        if not output.as_json:
            output.text(f"{path}" + "".join(f", {k}: {v}" for k, v in sorted(labels.items())))
        for event in events:
            line = {"source": str(path), **event}
            if event["event"] == "decision" and event["task"] in labels:
                line["expected"] = labels[event["task"]]
            output.event(line)
        summary.add(labels, events)
    if arguments.summary:
        output.text(summary.text())
    return 2 if failed else 0
