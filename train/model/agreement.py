"""Which tasks' labels are the pairs of two others', as the training labels show."""

from itertools import combinations

import numpy as np

from train.data.folds import finest
from train.data.groups import LEAVE_OUT
from train.data.vectors import Labels, Strings


def joint_tasks(y: Labels) -> dict[str, tuple[str, str]]:
    """{task: two other tasks whose labels together determine its own, and follow from
    it}.

    Neither of the two determines the task alone, and neither names objects: `object`,
    or the task with most labels. Of several pairs the one is taken whose labels the
    task's words are made of, as `rigid-fixed` is, or else the one with the fewest
    labels.
    """
    pairs: dict[str, tuple[str, str]] = {}
    names_objects = {LEAVE_OUT, finest(y)}
    for task, labels in y.items():
        factors = []
        for factor in sorted(y.keys() - {task} - names_objects):
            follows = _determines(labels, y[factor])
            if follows and not _determines(y[factor], labels):
                factors.append(factor)
        possible = []
        for a, b in combinations(factors, 2):
            joined = np.char.add(np.char.add(y[a], "\0"), y[b])
            if _determines(joined, labels):
                count = len({*y[a].tolist()}) + len({*y[b].tolist()})
                possible.append((not _are_words(y[a], y[b], labels), count, (a, b)))
        if possible:
            *_, pairs[task] = min(possible)
    return pairs


def _are_words(a: Strings, b: Strings, labels: Strings) -> bool:
    """Whether each label is made of those of two tasks, as the words of `rigid-fixed`
    are."""
    labelled = (a != "") & (b != "") & (labels != "")
    rows = zip(a[labelled], b[labelled], labels[labelled], strict=True)
    return all(
        name in (f"{one}-{other}", f"{other}-{one}") for one, other, name in rows
    )


def _determines(a: Strings, b: Strings) -> bool:
    """Whether the labels b follow from the labels a."""
    labelled = (a != "") & (b != "")
    names = a[labelled].tolist()
    pairs = set(zip(names, b[labelled].tolist(), strict=True))
    return len(pairs) == len(set(names))


def factors_of(y: Labels) -> dict[str, dict[str, tuple[int, ...]]]:
    """{joint task: its `edge.decide.agreement.Factors`}.

    No task belongs to two joint tasks.
    """
    joint_tasks_of: dict[str, dict[str, tuple[int, ...]]] = {}
    used_tasks: set[str] = set()
    for task, factors in joint_tasks(y).items():
        tasks = (task, *factors)
        rows = set(zip(*(y[t].tolist() for t in tasks), strict=True))
        pairs = sorted(filter(all, rows))
        names = [sorted({*y[factor].tolist()} - {""}) for factor in factors]
        columns = [[pair[i] for pair in pairs] for i in (1, 2)]
        # A factor's label may be that of trials without a label of the joint task.
        paired = [sorted({*column}) for column in columns] == names
        if paired and used_tasks.isdisjoint(tasks):
            used_tasks.update(tasks)
            joint_tasks_of[task] = {}
            for factor, labels, column in zip(factors, names, columns, strict=True):
                joint_tasks_of[task][factor] = tuple(map(labels.index, column))
    return joint_tasks_of


def families(y: Labels) -> list[tuple[str, ...]]:
    """The tasks that are decided together: a joint task and its two factors each."""
    return [(task, *factors) for task, factors in factors_of(y).items()]
