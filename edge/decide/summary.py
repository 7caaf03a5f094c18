"""Decisions on recordings, compared with their labels and with those of another
model."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from edge.decide.classifier import Classifier, suited
from edge.decide.info import Stopping, Task
from edge.decide.model import Model
from edge.decide.statistics import paired, wilson
from edge.decide.verify import first_series
from edge.errors import InputError, about, counted, printable
from edge.record.recording import Recording
from edge.touch.contact import FeatureSeries

MEASURED = (
    "Of touches of each {} that it has not met, {unknown:.0%} are called unknown, "
    "{unsure:.0%} are named with a confidence below 50 %, {sure:.0%} with more than "
    "90 %; of those that it knows {known:.0%} are called unknown."
)
UNMEASURED = (
    "How it answers for an unseen {} is not known: too few were in training for one to "
    "be held out."
)
UNDOUBTED = (
    "It names every touch without a doubt, also those of objects it has not met."
)


def doubt(stopping: Mapping[str, Stopping]) -> Iterator[str]:
    """A sentence on what a model's doubt about names is worth."""
    if not stopping:
        yield UNDOUBTED
    for task, of_task in stopping.items():
        if of_task.known_distance is not None:
            worth = of_task.known_distance.worth
            sentence = MEASURED if worth else UNMEASURED
            yield sentence.format(task, **worth)


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


UNDECIDED = "(none)"
"""The column of trials without a decision."""
