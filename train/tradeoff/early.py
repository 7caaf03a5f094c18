"""Early decisions with certified error rates, of known objects and of unseen ones.

The rules, their certified errors and their mean times are those of the export of all
contacts, which its file keeps. How often they decide rightly is tested on contacts, and
on entire objects, by exports without them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from edge.arrays import Booleans, Integers
from edge.decide.early import fastest
from edge.decide.info import Stopping
from train.choose.evaluate import NestedAccuracy, Result
from train.data.dataset import DataSet
from train.data.folds import finest, stratified_folds
from train.data.groups import LEAVE_OUT, TRIAL, groups_of
from train.fitting import fit
from train.model.rules import TimeSeries
from train.report.work import Workers

FOLDS = 5
ERRORS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3)


@dataclass(frozen=True)
class EarlyDecisions:
    """Decisions with an error rate that an export certifies.

    Attributes:
        error: the requested rate.
        mean_s: mean time to decision, which the exported model promises.
        right: (n,) whether each contact is decided rightly by a model without it. An
            object that is unknown gets no name, which counts as wrong.
        unseen: (m,) whether each contact is decided rightly by a model without its
            object; None where no objects could be held out.
    """

    error: float
    mean_s: float
    right: Booleans
    unseen: Booleans | None = None

    @property
    def result(self) -> Result:
        """The accuracy."""
        return NestedAccuracy(int(self.right.sum()), len(self.right))


def certified(
    dataset: DataSet,
    decision_points_s: Sequence[float],
    *,
    quick: bool = True,
    jobs: int = 1,
) -> dict[str, list[EarlyDecisions]]:
    """{task: its decisions at each error rate that an export certifies}.

    Args:
        dataset: the trials.
        decision_points_s: windows.
        quick: whether the export tries few candidates.
        jobs: processes.
    """
    y = {task: dataset.labels(task) for task in dataset.tasks}
    options = {
        "leave_out": TRIAL,
        "decision_points_s": decision_points_s,
        "tasks": tuple(y),
        "quick": quick,
    }
    model = fit(dataset, **options, jobs=jobs).sequential
    assert model is not None
    folds = stratified_folds(y[finest(y)], FOLDS)
    of_trials = held_out_decisions(dataset, folds, options, jobs)
    unseen: dict[str, TimeSeries] = {}
    groups = groups_of(dataset, y, LEAVE_OUT, quick=True)
    if groups is not None:
        by_task = held_out_decisions(dataset, groups.folds, options, jobs)
        unseen = {task: by_task[task] for task in groups.tasks}
    return {
        task: at_errors(stopping, of_trials[task], unseen.get(task))
        for task, stopping in model.stopping_.items()
    }


def held_out_decisions(
    dataset: DataSet, folds: Integers, options: Mapping[str, Any], jobs: int
) -> dict[str, TimeSeries]:
    """{task: decisions of the trials of each fold (n,) by an export of the others}.

    Args:
        dataset: the trials.
        folds: of trials, or of entire groups of them.
        options: of the export.
        jobs: processes.
    """
    cases = [(dataset, folds == fold, options) for fold in np.unique(folds)]
    of_folds = Workers(jobs).map("deciding early", _without, cases)
    return {
        task: _joined([of_fold[task] for of_fold in of_folds]) for task in of_folds[0]
    }


def _without(
    dataset: DataSet, test: Booleans, options: Mapping[str, Any]
) -> dict[str, TimeSeries]:
    """{task: the decisions of some trials by an export of the others}."""
    fitted = fit(dataset.part(~test), **options, jobs=1)
    model = fitted.sequential
    assert model is not None
    test_set = replace(dataset.part(test), kernels=fitted.dataset.kernels)
    names = fitted.dataset.names
    points = model.decision_points_s
    new = np.stack([test_set.features(s, fitted.samples, names) for s in points])
    truth = {task: test_set.labels(task) for task in model.choices}
    return model.judged(new, truth)[2]


def _joined(series: Sequence[TimeSeries]) -> TimeSeries:
    """The decisions of several folds together."""
    confidences = zip(*(time_series.confidences for time_series in series), strict=True)
    wrong = zip(*(time_series.wrong for time_series in series), strict=True)
    withheld = [
        time_series.withheld
        for time_series in series
        if time_series.withheld is not None
    ]
    return TimeSeries(
        confidences=list(map(np.hstack, confidences)),
        wrong=list(map(np.hstack, wrong)),
        unusual=np.hstack([time_series.unusual for time_series in series]),
        withheld=np.hstack(withheld) if withheld else None,
    )


def at_errors(
    stopping: Stopping, known: TimeSeries, unseen: TimeSeries | None = None
) -> list[EarlyDecisions]:
    """The decisions at each error rate that a model certifies; one rule that serves
    several rates stands at the smallest.

    Args:
        stopping: the model's rules.
        known: decisions of known objects.
        unseen: those of objects that were held out.
    """
    rules = {fastest(stopping, error): error for error in reversed(ERRORS)}
    decisions = []
    for rule, error in reversed(rules.items()):
        if rule is None:
            continue
        _, wrong = known.under(rule)
        right = None
        if unseen is not None:
            wrong_when_unseen = unseen.under(rule)[1]
            right = ~wrong_when_unseen
        decisions.append(EarlyDecisions(error, rule.mean_s, ~wrong, right))
    return decisions
