"""The trials that are held out together to choose settings: folds of trials, and entire
groups of them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from edge.arrays import Integers
from edge.record.recording import Recording
from train.data.dataset import DataSet
from train.data.folds import FOLDS, SEED, finest, group_folds, stratified_folds
from train.data.vectors import Labels, Strings

FEWEST_GROUPS = 3
"""Objects that a class needs before entire objects can be held out."""
LEAVE_OUT = "object"
KIND = "kind"
"""Held out in place of an object where `kinds_of` names the kinds."""
TRIAL = "trial"
QUICK_FOLDS = 5
GROUP_FOLDS = 20
FEW = 300
MANY = 1000
"""Most folds of groups with at most `FEW` trials; with more trials there are ten folds,
and five from `MANY` on: four fifths of so many trials teach nearly as much as all."""
REPEATS = 3
FEW_TO_REPEAT = 200
"""How often the trials are divided into folds where there are fewer than
`FEW_TO_REPEAT`. The fits of more trials take longer, and their choice depends less on
the division."""


def kinds_of(recordings: Sequence[Recording]) -> Strings | None:
    """(n,) kind of object in each, where a scene drew several objects of some kind.

    A `[[family]]` of a scene names its objects by the kind and a number. Any other
    object is of a kind of its own. None without such a scene.
    """
    kinds = []
    objects_of_kind: dict[str, set[str]] = {}
    for recording in recordings:
        kind = name = recording.labels.get(LEAVE_OUT, "")
        if "simulation" in recording.meta:
            kind = re.sub(r" \d+$", "", name)
            objects_of_kind.setdefault(kind, set()).add(name)
        kinds.append(kind)
    several = any(len(objects) > 1 for objects in objects_of_kind.values())
    return np.array(kinds) if several else None


def are_drawn(dataset: DataSet) -> bool:
    """Whether the trials are of objects that a scene drew from kinds."""
    return kinds_of([trial.recording for trial in dataset.trials]) is not None


def groupable(labels: Strings, groups: Strings) -> bool:
    """Whether every class has enough groups that entire groups can be held out."""
    classes = set(labels.tolist())
    return len(classes) > 1 and all(
        len(set(groups[labels == label].tolist())) >= FEWEST_GROUPS for label in classes
    )


def fold_count(trials: int, quick: bool = False) -> int:
    """Folds for so many trials."""
    return QUICK_FOLDS if quick or trials >= MANY else FOLDS


@dataclass(frozen=True)
class Groups:
    """Trials that are held out together.

    Attributes:
        name: of the label that tells the groups.
        members: (n,) the group of each trial.
        tasks: those for which entire groups are held out.
        folds: (n,) of entire groups.
    """

    name: str
    members: Strings
    tasks: frozenset[str]
    folds: Integers

    def count(self, labels: Strings) -> int:
        """Number of groups among the trials that have a label (n,)."""
        return len(set(self.members[labels != ""].tolist()))


def groups_of(
    dataset: DataSet,
    y: Labels,
    leave_out: str,
    quick: bool,
) -> Groups | None:
    """The kinds of objects, or else the groups of a label, where some task has enough of
    them."""
    for name, members in _memberships(dataset, leave_out).items():
        tasks = [t for t in y if t != leave_out and groupable(y[t], members)]
        if tasks:
            count = fold_count(len(members), quick)
            if len(members) <= FEW and not quick:
                count = GROUP_FOLDS
            folds = group_folds(members, count)
            return Groups(name, members, frozenset(tasks), folds)
    return None


def _memberships(dataset: DataSet, leave_out: str) -> dict[str, Strings]:
    """{name: (n,) the group of each trial}, those that are held out first if they can
    be first."""
    if leave_out == TRIAL:
        return {}
    members_of = {leave_out: dataset.groups(leave_out)}
    if leave_out == LEAVE_OUT:
        kinds = kinds_of([trial.recording for trial in dataset.trials])
        members_of = {KIND: kinds, **members_of}
    return {name: groups for name, groups in members_of.items() if groups is not None}


@dataclass(frozen=True)
class Divisions:
    """The trials that are held out together, to choose and to measure.

    Attributes:
        folds: (n,) of single trials.
        further: other divisions, where there are few trials.
        groups: entire groups; None where no task has enough of them.
    """

    folds: Integers
    further: tuple[Integers, ...]
    groups: Groups | None

    @property
    def fewest_left(self) -> int:
        """The smallest number of trials that remain where a fold is held out."""
        divisions = [self.folds, *self.further]
        if self.groups is not None:
            divisions.append(self.groups.folds)
        largest = max(np.bincount(folds[folds >= 0]).max() for folds in divisions)
        return len(self.folds) - int(largest)

    @classmethod
    def of(
        cls,
        dataset: DataSet,
        y: Labels,
        leave_out: str = LEAVE_OUT,
        quick: bool = False,
    ) -> Divisions:
        """The divisions of some trials.

        Args:
            dataset: the trials.
            y: {task: (n,) labels}.
            leave_out: label whose groups are held out for a task, where each of its
                classes has several of them; `TRIAL` for none. In place of an object its
                entire kind is held out where `kinds_of` names the kinds: accuracy on
                other objects of the same kinds says nothing of how a simulator's model
                does elsewhere.
            quick: fewer folds.
        """
        labels = y[finest(y)]
        count = fold_count(len(labels), quick)
        repeats = 1 if quick or len(labels) >= FEW_TO_REPEAT else REPEATS
        folds, *further = (
            stratified_folds(labels, count, SEED + i) for i in range(repeats)
        )
        return cls(folds, tuple(further), groups_of(dataset, y, leave_out, quick))
