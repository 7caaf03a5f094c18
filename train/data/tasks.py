"""The tasks of a data set that are fitted."""

from collections.abc import Sequence

import numpy as np

from edge.errors import InputError
from train.data.dataset import DataSet
from train.data.vectors import Labels


def labels_of_tasks(dataset: DataSet, tasks: Sequence[str] | None) -> Labels:
    """{task: (n,) labels} of the tasks with these names, or of the usual ones.

    Raises:
        InputError: no recording has a label for one of them.
    """
    return {task: dataset.labels(task) for task in _tasks(dataset, tasks)}


def _is_usual(dataset: DataSet, task: str) -> bool:
    """Whether most trials have a label for a task, of those that no other task gives."""
    labels = dataset.labels(task)
    labelled = int(np.count_nonzero(labels))
    return 2 * labelled > len(labels)


def lacking(dataset: DataSet, tasks: Sequence[str] | None) -> list[str]:
    """A sentence for each task that most trials lack, and that is not named."""
    if tasks is not None:
        return []
    sentences = []
    for task in dataset.tasks:
        if not _is_usual(dataset, task):
            count = np.count_nonzero(dataset.labels(task))
            sentences.append(
                f"warning: task {task} is ignored: {count} of {len(dataset.trials)} "
                "trials have a label for it; --tasks names it where it is meant"
            )
    return sentences


def _tasks(dataset: DataSet, tasks: Sequence[str] | None) -> tuple[str, ...]:
    if tasks is None:
        return tuple(task for task in dataset.tasks if _is_usual(dataset, task))
    missing = [task for task in tasks if task not in dataset.tasks]
    if missing:
        raise InputError(
            f"not every recording has a label {missing[0]!r}; all have "
            f"{', '.join(dataset.tasks)}"
        )
    return tuple(tasks)
