"""What a person sees of a recorded touch: its curve, its decisions, and which touches
ask for a look."""

from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from edge.decide.events import Decided
from edge.errors import InputError
from edge.record.labels import CATEGORY, Labels, LabelTable, Standing
from edge.record.recording import Recording

UNKNOWN = "unknown"
"""The flag of an object that was never met; in former recordings its label too."""
UNSURE = 0.8
"""Confidence below which a decision is unsure."""
KINDS = ("unsure", "wrong", "unlabelled", "left_out")
CURVE = 32
"""Points of a small curve."""


def curve(recording: Recording) -> list[int]:
    """The largest count of a touch over time, in percent of its highest; the largest of
    each part of the recording."""
    peaks = recording.frames.reshape(len(recording.t), -1).max(axis=1)
    spans = np.array_split(peaks, min(CURVE, len(peaks)))
    highest = max(int(peaks.max()), 1)
    return [int(span.max()) * 100 // highest for span in spans]


def decisions_of(decided: Sequence[Decided]) -> dict[str, Any]:
    """{task: its answer} for the metadata of a kept touch."""
    return {
        decision.task: {
            "label": decision.label,
            "confidence": decision.confidence,
            "flags": list(decision.flags),
            "window_s": decision.window_s,
            "model": decision.model,
        }
        for decision in decided
    }


def decisions(meta: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """{task: its decision} of a kept touch; empty for other recordings."""
    decided = meta.get("decided")
    if not isinstance(decided, Mapping):
        return {}
    out = {}
    for task, answer in decided.items():
        if isinstance(answer, Mapping) and "label" in answer:
            full = {"confidence": None, "flags": [], **answer}
            if _is_decision(full):
                out[str(task)] = full
    return out


def _is_decision(answer: Mapping[str, Any]) -> bool:
    """Whether the label, the confidence and the flags are of their types."""
    flags = answer["flags"]
    return (
        isinstance(answer["label"], str | None)
        and isinstance(answer["confidence"], float | int | None)
        and isinstance(flags, list)
        and all(isinstance(flag, str) for flag in flags)
    )


def is_unsure(confidence: float | None, flags: Collection[str]) -> bool:
    """Whether a decision with this confidence and these flags is unsure."""
    return confidence is None or confidence < UNSURE or "forced" in flags


def kinds(meta: Mapping[str, Any], labels: Labels, left_out: bool = False) -> list[str]:
    """The kinds of touches that a recording belongs to.

    A touch is unsure if a decision about it was, or was unknown; it is wrong if its
    label is another than the decision; it is unlabelled if a task that was decided has
    no label, and none follows from others.
    """
    labels = CATEGORY.completed(labels)
    decided = decisions(meta)
    belongs = dict.fromkeys(KINDS, False)
    belongs["left_out"] = left_out
    belongs["unlabelled"] = not labels or not labels.keys() >= decided.keys()
    for task, answer in decided.items():
        belongs["unsure"] |= is_unsure(answer["confidence"], answer["flags"])
        belongs["unsure"] |= UNKNOWN in answer["flags"]
        belongs["wrong"] |= labels.get(task, answer["label"]) != answer["label"]
    return [kind for kind in KINDS if belongs[kind]]


def accepted(meta: Mapping[str, Any], labels: Labels) -> dict[str, str]:
    """{task: label} that accepts the decisions of a kept touch, where they name a label
    and nobody has given one yet, nor others from which another follows."""
    all_labels = CATEGORY.completed(labels)
    out = {
        task: answer["label"]
        for task, answer in decisions(meta).items()
        if task not in all_labels and answer["label"] not in (None, UNKNOWN)
    }
    if CATEGORY.contradiction({**labels, **out}):
        out.pop(CATEGORY.task, None)
    return out


class Touch(NamedTuple):
    """A recording, its metadata, how it stands, and the place that says so."""

    path: Path
    meta: Mapping[str, Any]
    standing: Standing
    place: str

    @property
    def kinds(self) -> list[str]:
        """The kinds of touches that it belongs to."""
        return kinds(self.meta, *self.standing)

    @property
    def words(self) -> set[str]:
        """What selects it: its kinds, its tasks and those that were decided, and its
        labels, such as `object=cup`."""
        labels = self.standing.labels
        return {
            *self.kinds,
            *labels,
            *decisions(self.meta),
            *map("=".join, labels.items()),
        }


def touches(
    metas: Mapping[Path, Mapping[str, Any]], table_of: Callable[[Path], LabelTable]
) -> list[Touch]:
    """How recordings stand.

    Args:
        metas: their metadata, with the labels that they were recorded with.
        table_of: gives a folder's table.

    Raises:
        InputError: a table is damaged, or labels contacts that have their own labels.
    """
    out = []
    for path, meta in metas.items():
        table = table_of(path.parent)
        row = table.rows.get(path.name)
        place = f"{path}, line {row.line} of {table.path.name}" if row else str(path)
        out.append(Touch(path, meta, table.standing(path.name, meta), place))
    return out


def selected(among: Sequence[Touch], words: Sequence[str]) -> list[Touch]:
    """The touches that all words select.

    Raises:
        InputError: one names no kind, no task, and no label of a task; the sentence
            lists these.
    """
    tasks = {t for it in among for t in (*it.standing.labels, *decisions(it.meta))}
    for word in words:
        if word not in {*KINDS, *tasks} and word.partition("=")[0] not in tasks:
            names = ", ".join([*KINDS, *sorted(tasks)])
            raise InputError(f"--only takes {names}, or TASK=LABEL, not {word!r}")
    return [touch for touch in among if not words or touch.words.issuperset(words)]


def changed(
    meta: Mapping[str, Any],
    before: Mapping[str, str],
    labels: Mapping[str, str],
    without: Sequence[str] = (),
    *,
    accepts: bool = False,
) -> dict[str, str]:
    """A recording's labels after a change.

    Args:
        meta: its metadata.
        before: its labels before.
        labels: {task: its new label}.
        without: tasks whose label is taken away.
        accepts: the other tasks that lack a label get that of their decision.
    """
    after = {**before, **labels}
    if accepts:
        after |= accepted(meta, after)
    return {task: label for task, label in after.items() if task not in without}
