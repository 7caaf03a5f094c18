"""Labels of contacts, and those that follow from others."""

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import chain, permutations
from typing import Any

from edge.errors import InputError
from edge.recording import Recording
from edge.tools.teaching import JOINED, joined

NO_CONTACT = "none"
"""The label of a recording in which nothing is touched."""
ALIKE = "alike"
"""`meta.contacts` of a recording whose contacts all have its labels."""
ENOUGH = 10
"""Trials with a label that make a task of what most trials lack, and that choose a
weight."""


def labels_of(recording: Recording, count: int) -> list[dict[str, str]]:
    """The labels of those of a recording's `count` contacts that are trials."""
    contacts = recording.meta.get("contacts")
    if contacts is None:
        return [recording.labels]
    if contacts == ALIKE:
        return [recording.labels] * count
    if not isinstance(contacts, list) or not all(
        isinstance(labels, dict) for labels in contacts
    ):
        raise InputError(
            f'meta.contacts must be "{ALIKE}" or a list of labels, one a contact'
        )
    if len(contacts) != count:
        raise InputError(
            f"meta.contacts labels {len(contacts)} contacts, {count} are found; "
            "correct the labels or the threshold"
        )
    return [{**recording.labels, **_as_texts(labels)} for labels in contacts]


def _as_texts(labels: Mapping[str, Any]) -> dict[str, str]:
    """A contact's labels; those that are whole numbers become text."""
    texts = {
        task: str(label) if type(label) is int else label
        for task, label in labels.items()
    }
    if not all(isinstance(name, str) and name for name in chain(*texts.items())):
        raise InputError("meta.contacts must map task names to labels, both text")
    return texts


def completed(trials: Sequence[Mapping[str, str]]) -> list[dict[str, str]]:
    """Each trial's {task: label}, with the labels that follow from its others.

    Where a task's labels are those of two others joined by a hyphen, `soft-fixed`
    follows from `soft` and `fixed`, and the reverse. This is so for `JOINED`, and for
    tasks for which it holds in every trial that has all three. No task is added that no
    trial has.
    """
    tasks = set().union(*trials)
    out = [dict(labels) for labels in trials]
    for triple in permutations(sorted(tasks | set(JOINED)), 3):
        if _holds(triple, trials):
            out = [joined(labels, triple) for labels in out]
    return [
        {task: label for task, label in labels.items() if task in tasks}
        for labels in out
    ]


def _holds(triple: tuple[str, ...], trials: Sequence[Mapping[str, str]]) -> bool:
    """Whether the first task's labels are those of the two others in every trial that
    has all three; where none has, whether the triple is `JOINED`."""
    product, *factors = triple
    complete = [labels for labels in trials if labels.keys() >= set(triple)]
    names = ["-".join(labels[factor] for factor in factors) for labels in complete]
    if names != [labels[product] for labels in complete]:
        return False
    return bool(complete) or triple == JOINED


def shared_tasks(
    trials: Sequence[Mapping[str, str]], *, partial: bool = False
) -> tuple[str, ...]:
    """The tasks that most trials have a label for; `partial`, also those that `ENOUGH`
    have.

    Raises:
        InputError: there is none.
    """
    counts = Counter(chain(*trials))
    tasks = sorted(
        task
        for task, count in counts.items()
        if 2 * count > len(trials) or (partial and count >= ENOUGH)
    )
    if not tasks:
        raise InputError(
            "the recordings share no label; give every one the same keys under "
            "meta.labels"
        )
    return tuple(tasks)
