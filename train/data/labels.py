"""Labels of contacts, and those that follow from others."""

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import chain, permutations

from edge.errors import InputError
from edge.record.labels import CATEGORY, JointTask
from edge.record.recording import Recording, read_labels

NO_CONTACT = "none"
"""The label of a recording in which nothing is touched."""
ALIKE = "alike"
"""`meta.contacts` of a recording whose contacts all have its labels."""
ENOUGH = 10
"""Trials with a label that make a task of what most trials lack."""


def labels_of(recording: Recording, count: int) -> list[dict[str, str]]:
    """The labels of those of a recording's `count` contacts that are trials."""
    contacts = recording.meta.get("contacts")
    if contacts is None:
        return [recording.labels]
    if contacts == ALIKE:
        return [recording.labels] * count
    if not isinstance(contacts, list):
        raise InputError(
            f'meta.contacts must be "{ALIKE}" or a list of labels, one a contact'
        )
    if len(contacts) != count:
        raise InputError(
            f"meta.contacts labels {len(contacts)} contacts, {count} are found; "
            "correct the labels or the threshold"
        )
    return [
        {**recording.labels, **read_labels("meta.contacts", labels)}
        for labels in contacts
    ]


def completed(trials: Sequence[Mapping[str, str]]) -> list[dict[str, str]]:
    """Each trial's {task: label}, with the labels that follow from its others.

    Where a task's labels are those of two others joined by a hyphen, `soft-fixed`
    follows from `soft` and `fixed`, and the reverse. This is so for `CATEGORY`, and for
    tasks for which it holds in every trial that has all three, but for `contradictory`
    ones. No task is added that no trial has.
    """
    tasks = set().union(*trials)
    odd = contradictory(trials)
    sound = [labels for labels in trials if labels not in odd]
    out = [dict(labels) for labels in trials]
    names = sorted(tasks | {CATEGORY.task, *CATEGORY.factors})
    for task, first, second in permutations(names, 3):
        joint = JointTask(task, (first, second))
        if _holds(joint, sound):
            out = [joint.completed(labels) for labels in out]
    return [
        {task: label for task, label in labels.items() if task in tasks}
        for labels in out
    ]


def contradictory(trials: Sequence[Mapping[str, str]]) -> list[Mapping[str, str]]:
    """The labels of trials whose category is another than that of their softness and
    mobility; none where most trials are, whose `category` is something else."""
    odd = [labels for labels in trials if CATEGORY.contradiction(labels)]
    return odd if 2 * len(odd) < len(trials) else []


def _holds(joint: JointTask, trials: Sequence[Mapping[str, str]]) -> bool:
    """Whether a joint task's labels are those of its factors in every trial that has
    all three; where none has, whether it is `CATEGORY`."""
    complete = {joint.task, *joint.factors}
    matches = [
        joint.label(labels) == labels[joint.task]
        for labels in trials
        if labels.keys() >= complete
    ]
    return all(matches) if matches else joint == CATEGORY


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
