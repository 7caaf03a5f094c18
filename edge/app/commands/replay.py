"""Decide on recordings, frame by frame.

Decides on recordings as `edge-classify run` decides live. Files that cannot be used are
named on stderr and skipped; the exit status is then 2.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from edge.app.options import add_engine, add_error, apart, check_error
from edge.app.output import LOG, Output, counted
from edge.decide.classifier import Classifier, suited
from edge.decide.info import Task
from edge.decide.model import Model
from edge.decide.statistics import paired, wilson
from edge.decide.verify import first_series
from edge.errors import InputError, about, printable
from edge.record.labels import read_table
from edge.record.recording import Recording, load
from edge.record.saving import find
from edge.touch.contact import FeatureSeries

UNDECIDED = "(none)"
"""The column of trials without a decision."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument(
        "--model",
        action="append",
        default=[],
        metavar="model.onnx",
        help="the model; may stand without --model; repeat it to compare several on the "
        "same recordings",
    )
    parser.add_argument(
        "--summary",
        action="store_true",
        help="print each task's accuracy and confusion matrix, for labelled recordings",
    )
    add_engine(parser)
    add_error(parser)
    parser.add_argument(
        "recordings",
        nargs="+",
        metavar="REC",
        help=".npz files or folders, and models",
    )


def contact_of(model: Model, recording: Recording, name: str) -> FeatureSeries:
    """The series of a recording's first contact.

    Raises:
        InputError: the recording does not suit the model, or holds no contact.
    """
    recording = suited(model, recording, name)
    with about(name):
        contact = first_series(recording, model)
        if contact is None:
            raise InputError(
                "holds no contact; leave it out, or record the touch again"
            )
    return contact[1]


def decide(
    model: Model,
    recording: Recording,
    name: str,
    error: float | None = None,
) -> list[dict[str, Any]]:
    """All events of one recording as JSON objects, with early decisions if `error` is
    given.

    Raises:
        InputError: the recording does not suit the model; the message begins with
            `name`.
    """
    recording = suited(model, recording, name)
    with about(name):
        classifier = Classifier(model, recording.layout, error=error)
        events = [event.to_dict() for event in classifier.classify(recording)]
    if not any(event["event"] == "onset" for event in events):
        events.append({"event": "no_contact"})
    return events


def run(arguments: argparse.Namespace) -> int:
    """Print the events; 2 if a file could not be used."""
    files, recordings = apart(arguments.recordings, *arguments.model)
    models = [Model(path, arguments.engine) for path in files]
    if not models or not recordings:
        raise InputError("give a model.onnx, and recordings to replay")
    output = Output.of(arguments)
    paths = find(recordings)
    summaries = []
    failed = 0
    for model in models:
        check_error(model, arguments.error)
        if len(models) > 1 and not output.as_json:
            output.text(f"{model.path}:")
        summary = Summary(model.info.tasks)
        failed += _replay(model, paths, arguments.error, output, summary)
        summaries.append(summary)
        if arguments.summary:
            output.text(summary.text())
    for model, summary in zip(models[1:], summaries[1:], strict=True):
        output.text(compared(models[0].path, summaries[0], model.path, summary))
    return 2 if failed else 0


def _replay(
    model: Model,
    paths: Iterable[Path],
    error: float | None,
    output: Output,
    summary: Summary,
) -> int:
    """Print a model's events of recordings; the number of files it could not use."""
    failed = 0
    table_of = cache(read_table)
    for path in paths:
        try:
            recording = load(path, table_of=table_of)
            events = decide(model, recording, str(path), error)
        except InputError as problem:
            failed += 1
            LOG.error("%s", problem)
            continue
        labels = recording.labels
        if not output.as_json:
            named = [f"{task}: {label}" for task, label in sorted(labels.items())]
            output.text(", ".join([str(path), *named]))
        for event in events:
            line = {"source": str(path), **event}
            if event["event"] == "decision" and event["task"] in labels:
                line["expected"] = labels[event["task"]]
            output.event(line)
        summary.add(labels, events, str(path))
    return failed


def compared(name: str, first: Summary, second_name: str, second: Summary) -> str:
    """Gains and losses of a second model on the same labelled recordings, by task."""
    lines = [f"{second_name} compared with {name}:"]
    for task in first.hits.keys() & second.hits.keys():
        shared = first.hits[task].keys() & second.hits[task].keys()
        if not shared:
            continue
        changes = Counter(
            second.hits[task][path] - first.hits[task][path] for path in shared
        )
        gained = changes[1]
        lost = changes[-1]
        n = len(shared)
        low, high = paired(gained, lost, n)
        lines.append(
            f"{printable(task)}: {gained} gained, {lost} lost of {n}: "
            f"{100.0 * (gained - lost) / n:+.1f} points (95 % interval "
            f"{100.0 * low:+.1f} to {100.0 * high:+.1f})"
        )
    favoured = [
        f"{path} was fitted on {summary.as_trained} of these recordings, which favours it"
        for path, summary in ((name, first), (second_name, second))
        if summary.as_trained
    ]
    return "\n".join([lines[0], *sorted(lines[1:]), *favoured])


class Summary:
    """Compares each recording's first decision for each task with its label."""

    def __init__(self, tasks: Mapping[str, Task]) -> None:
        self._pairs: dict[str, Counter[tuple[str, str]]] = {
            task: Counter() for task in tasks
        }
        self.hits: dict[str, dict[str, bool]] = {task: {} for task in tasks}
        """{task: {recording: whether it is decided right}}."""
        self.recordings = 0
        self.as_trained = 0
        """Recordings whose features equal those of a training trial."""

    def add(
        self,
        labels: Mapping[str, str],
        events: Iterable[Mapping[str, Any]],
        name: str = "",
    ) -> None:
        """Take in the events of one recording and its labels."""
        self.recordings += 1
        # Of several decisions for a task, the first one stays.
        first: dict[str, str] = {}
        flags: set[str] = set()
        for event in events:
            if event["event"] == "decision":
                flags |= set(event["flags"])
                first.setdefault(event["task"], printable(event["label"] or UNDECIDED))
        self.as_trained += "as_trained" in flags
        for task in self._pairs.keys() & labels:
            truth = printable(labels[task])
            decided = first.get(task, UNDECIDED)
            self._pairs[task][truth, decided] += 1
            self.hits[task][name] = truth == decided

    def right(self, task: str) -> tuple[int, int]:
        """The number of right decisions, and of labelled recordings, of a task."""
        hits = self.hits[task]
        return sum(hits.values()), len(hits)

    def text(self) -> str:
        """One table for each task: a row for each true label, a column for each decided
        one."""
        recordings = counted(self.recordings, "recording")
        paragraphs = [recordings]
        if self.as_trained:
            paragraphs.append(
                f"{self.as_trained} of {recordings} match a training trial to the last "
                "bit, so they are most likely training data, and the accuracy below "
                "does not apply to new touches. The nested accuracy, which `make "
                "export` and `edge-classify info` print, does."
            )
        for task, pairs in self._pairs.items():
            name = printable(task)
            right, total = self.right(task)
            if total == 0:
                paragraphs.append(f"{name}: no recording has a label")
                continue
            low, high = wilson(right, total)
            paragraphs.append(
                f"{name}: {right} of {total} right, {right / total:.2%} (95 % interval "
                f"{low:.1%} to {high:.1%})\n" + _matrix(pairs)
            )
        return "\n\n".join(paragraphs)


def _matrix(pairs: Counter[tuple[str, str]]) -> str:
    truths = sorted({truth for truth, _ in pairs})
    decided = sorted({*truths, *(label for _, label in pairs)})
    width = max(map(len, truths))
    widths = [max(len(label), 3) for label in decided]
    lines = [" " * width + _cells(decided, widths)]
    for truth in truths:
        counts = [pairs[truth, label] for label in decided]
        lines.append(f"{truth:<{width}}{_cells(counts, widths)}")
    return "\n".join(lines)


def _cells(values: Sequence[str | int], widths: Sequence[int]) -> str:
    """Texts or counts in columns of some widths; a dot for 0."""
    columns = zip(values, widths, strict=True)
    return "".join(f"  {value or '.':>{width}}" for value, width in columns)
