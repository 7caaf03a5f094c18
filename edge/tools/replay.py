"""Decide on recordings, frame by frame.

Decides on recordings as `edge-classify run` decides live. Files that cannot be used are
named on stderr and skipped; the exit status is then 2.
"""

import argparse
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

from edge.classifier import Classifier, suited
from edge.commands.options import add_engine, add_error, check_error
from edge.commands.output import LOG, Output, counted
from edge.errors import InputError, about, printable
from edge.model.info import Task
from edge.model.model import Model
from edge.model.verify import first_series
from edge.policy import AS_TRAINED
from edge.recording import Recording, find, load
from edge.statistics import wilson
from edge.touch.contact import FeatureSeries

UNDECIDED = "(none)"
"""The column of trials without a decision."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument("--model", required=True, help="model.onnx")
    parser.add_argument(
        "--summary",
        action="store_true",
        help="print each task's accuracy and confusion matrix, for labelled recordings",
    )
    add_engine(parser)
    add_error(parser)
    parser.add_argument(
        "recordings", nargs="+", metavar="REC", help=".npz files or folders"
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
    model: Model, recording: Recording, name: str, error: float | None = None
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
    model = Model(arguments.model, arguments.engine)
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
            output.text(
                f"{path}" + "".join(f", {k}: {v}" for k, v in sorted(labels.items()))
            )
        for event in events:
            line = {"source": str(path), **event}
            if event["event"] == "decision" and event["task"] in labels:
                line["expected"] = labels[event["task"]]
            output.event(line)
        summary.add(labels, events)
    if arguments.summary:
        output.text(summary.text())
    return 2 if failed else 0


class Summary:
    """Compares each recording's first decision for each task with its label."""

    def __init__(self, tasks: Mapping[str, Task]) -> None:
        self._pairs: dict[str, Counter[tuple[str, str]]] = {
            task: Counter() for task in tasks
        }
        self.recordings = 0
        self.as_trained = 0
        """Recordings whose features equal those of a training trial."""

    def add(
        self, labels: Mapping[str, str], events: Iterable[Mapping[str, Any]]
    ) -> None:
        """Take in the events of one recording and its labels."""
        self.recordings += 1
        decisions = [event for event in events if event["event"] == "decision"]
        self.as_trained += any(
            AS_TRAINED in decision["flags"] for decision in decisions
        )
        # Of several decisions for a task, the first one stays.
        first = {
            d["task"]: printable(d["label"] or UNDECIDED) for d in reversed(decisions)
        }
        for task in self._pairs.keys() & labels:
            self._pairs[task][printable(labels[task]), first.get(task, UNDECIDED)] += 1

    def right(self, task: str) -> tuple[int, int]:
        """The number of right decisions, and of labelled recordings, of a task."""
        pairs = self._pairs[task]
        right = sum(n for (truth, decided), n in pairs.items() if truth == decided)
        return right, pairs.total()

    def text(self) -> str:
        """One table for each task: a row for each true label, a column for each decided
        one."""
        recordings = counted(self.recordings, "recording")
        paragraphs = [recordings]
        if self.as_trained:
            paragraphs.append(
                f"{self.as_trained} of {recordings} match a training "
                "trial to the last bit, so they are most likely training data, and the "
                "accuracy "
                "below does not apply to new touches. The nested accuracy, which `make "
                "export` "
                "and `edge-classify info` print, does."
            )
        for task, pairs in self._pairs.items():
            name, (right, total) = printable(task), self.right(task)
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
    decided = sorted({label for _, label in pairs} | set(truths))
    # The columns of a wide matrix are numbered, so that 36 objects fit on a screen.
    numbered = sum(len(label) + 2 for label in decided) > 100
    heads = [str(i + 1) for i in range(len(decided))] if numbered else decided
    names = [f"{decided.index(t) + 1:>3}  {t}" if numbered else t for t in truths]
    width = max(map(len, names))
    rows = [[str(pairs[truth, label] or ".") for label in decided] for truth in truths]
    return "\n".join(
        f"{name:<{width}}"
        + "".join(
            f"  {cell:>{max(len(h), 3)}}" for cell, h in zip(cells, heads, strict=True)
        )
        for name, cells in zip(["", *names], [heads, *rows], strict=True)
    )
