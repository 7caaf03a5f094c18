"""Simulated trials beside the owner's: how much each counts, chosen on the owner's
trials.

The settings of a task are chosen on the simulated trials, of which there are many. On
the owner's, of which there may be ten, only the weight is chosen: by trials, or
objects, that are left out in turn, while the simulated ones are always there. A weight
is how often a trial counts in scaling and projection, in whole numbers. As a neighbour,
each votes once.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError
from train.choose import (
    FEWEST_GROUPS,
    TRIAL,
    Chosen,
    decided_together,
    fold_count,
    promised,
)
from train.dataset import DataSet
from train.evaluate import AnswerTable, Labels, evaluate, group_folds, stratified_folds
from train.labels import ENOUGH
from train.pipeline import Choice
from train.search import SearchGrid

FEWEST_OWN = 3
"""The owner's trials with a label for a task from which on it is fitted."""
ALONE, SIMULATED, ONCE = (0, 1), (1, 0), (1, 1)
"""Weights of the simulated trials and of the owner's."""


def mix(
    dataset: DataSet,
    y: Labels,
    own: NDArray[np.bool_],
    settings: Callable[[DataSet, Labels], dict[str, Chosen]],
    features: NDArray[np.float64],
    samples: int,
    leave_out: str,
    *,
    quick: bool = False,
    jobs: int = 1,
) -> tuple[dict[str, Chosen], NDArray[np.int64], list[dict[str, Choice]], list[str]]:
    """Choose the weights of each task.

    Args:
        dataset: all trials.
        y: {task: (n,) labels}.
        own: (n,) whether a trial is the owner's.
        settings: chooses the settings of tasks on some of the trials.
        features: (n, p) of the data set's, at the full window.
        samples: values of a feature.
        leave_out: label whose groups are left out where the owner's trials have several
            of them.
        quick: fewer folds.
        jobs: processes.

    Returns:
        {task: its settings, with the weights}, whose accuracies are those on the
        owner's trials; (n,) the fold of each of the owner's trials, -1 for simulated
        ones; [fold]{task: the choice made without the fold's trials}; and sentences
        that say how much the simulated trials help.

    Raises:
        InputError: the owner's trials are too few, or have no label.
    """
    labelled = {task: int((labels[own] != "").sum()) for task, labels in y.items()}
    few = [task for task in y if labelled[task] < FEWEST_OWN]
    y = {task: labels for task, labels in y.items() if task not in few}
    if not y:
        raise InputError(
            f"{int(own.sum())} of the trials are no simulated ones; record at least "
            f"{FEWEST_OWN} "
            "with a label, or export the simulated ones alone"
        )
    shared = [t for t in y if set(y[t][own].tolist()) & set(y[t][~own].tolist()) - {""}]
    chosen: dict[str, Chosen] = {}
    for tasks, trials in ((shared, ~own), ([t for t in y if t not in shared], own)):
        if tasks:
            chosen |= settings(dataset.part(trials), {t: y[t][trials] for t in tasks})
    half = max(round((~own).sum() / own.sum()), 1)
    weights = tuple(dict.fromkeys((ONCE, (1, half), ALONE, SIMULATED)))
    grids = [
        _grid(task, chosen[task].choice, each, labelled[task])
        for task in y
        for each in (weights if task in shared else (ALONE,))
    ]

    def answers(folds: NDArray[np.int64]) -> AnswerTable:
        everyone = np.full(len(own), -1)
        everyone[own] = folds
        return evaluate(
            features,
            y,
            everyone,
            grids,
            features=dataset.names,
            widths=dataset.widths(samples),
            jobs=jobs,
            own=own,
        )

    finest = max(y, key=lambda task: len(set(y[task][own].tolist())))
    count = fold_count(int(own.sum()), quick)
    by_trial = by_group = answers(stratified_folds(y[finest][own], count))
    group_count = 0
    groups = None if leave_out == TRIAL else dataset.part(own).groups(leave_out)
    if groups is not None and len(set(groups.tolist())) >= FEWEST_GROUPS:
        by_group, group_count = (
            answers(group_folds(groups, count)),
            len(set(groups.tolist())),
        )
    plans: dict[str, tuple[NDArray[np.int64], list[dict[str, Choice]]]] = {
        left_out: (table.folds, [{} for _ in range(int(table.folds.max()) + 1)])
        for left_out, table in ((leave_out, by_group), (TRIAL, by_trial))
    }
    notes = [
        f"{int(own.sum())} of your own trials beside {int((~own).sum())} simulated "
        "ones, on which "
        "the settings are chosen (the table); the other accuracies are those on your "
        "own"
    ]
    if few:
        notes.append(
            f"not fitted, as fewer than {FEWEST_OWN} of your own have it: "
            f"{', '.join(few)}"
        )
    for task, settled in chosen.items():
        table = by_trial if task == leave_out else by_group
        # The first within a standard error of the best, as ten trials hardly tell them
        # apart; fewer than that choose nothing.
        rank = np.arange(len(table.choices[task]))
        rule = rank, (rank[:1] if labelled[task] < ENOUGH else None)
        best = table.choices[task][table.chosen(task, *rule)]
        for left_out, each in ((leave_out, by_group), (TRIAL, by_trial)):
            for by_task, place in zip(
                plans[left_out][1], each.by_fold(task, *rule), strict=True
            ):
                by_task[task] = each.choices[task][place]
        chosen[task] = replace(
            settled,
            choice=best,
            accuracy=promised(
                table.nested(task, *rule),
                groups=0 if table is by_trial else group_count,
            ),
            by_trial=promised(by_trial.nested(task, *rule)),
            left_out=TRIAL if table is by_trial else leave_out,
            folds=table.folds,
        )
        names = {
            ONCE: "both",
            (1, half): f"both, yours counted {half} times (half of the weight)",
            ALONE: "your own alone",
            SIMULATED: "simulated alone",
        }
        answers_of = table.held_out(task)[:, table.tested[task]].mean(axis=1)
        shares = {
            c.weights: s for c, s in zip(table.choices[task], answers_of, strict=True)
        }
        by_weights = ", ".join(
            f"{names[each]} {share:.1%}" for each, share in shares.items()
        )
        notes.append(f"{task}: {by_weights}; taken: {names[best.weights]}")
        if task in shared and shares[ALONE] == max(shares.values()):
            notes.append(
                f"simulated trials no longer help {task}: export your own alone, which "
                "also "
                "chooses the features by them"
            )
    form = dataset.names, dataset.widths(samples)
    return (
        decided_together(chosen, features, y, plans, *form, own, jobs),
        *plans[TRIAL],
        notes,
    )


def _grid(task: str, choice: Choice, weights: tuple[int, int], own: int) -> SearchGrid:
    """The one candidate of a task with some weights."""
    return SearchGrid(
        choice.scaling,
        choice.projection,
        choice.features,
        (choice.components,),
        choice.components,
        (choice.shrinkage,),
        (min(choice.k, max(own // 2, 1)) if weights == ALONE else choice.k,),
        choice.targets,
        (task,),
        weights,
    )
