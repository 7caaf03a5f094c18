"""The quick choice of `make export`, made again at each window and for changed recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.statistics import wilson
from edge.touch.features import WINDOW_S
from train.candidates import candidates
from train.choose import TRIAL, Chosen, kinds_of
from train.dataset import DataSet, Recordings, load_trials
from train.evaluate import Result
from train.feature_sets import expand
from train.fitting import fit

WINDOWS_S = tuple(round(0.1 * i, 1) for i in range(2, 13))
"""Windows of the report, and the decision points of its early decisions."""
VARIANCE = 2.0
"""Of the nested accuracy's difference from the exported model's on other trials, in binomial
variances: the folds' models differ from it, and the best windows are shown. `make risk` counts."""
Points = Mapping[float, Mapping[str, Chosen]]
"""{window: {task: the choice at that window}}."""


@dataclass(frozen=True)
class Promise(Result):
    """A nested accuracy, with an interval of the exported model's accuracy on other trials."""

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval: Wilson's of `VARIANCE` times fewer trials."""
        return wilson(self.right / VARIANCE, self.total / VARIANCE)


def followed(
    raw: Recordings, features: Sequence[str] = (), *, quick: bool = True, progress: bool = False
) -> DataSet:
    """The trials of some recordings, with the features of every candidate and those named."""
    drawn = kinds_of(raw.recordings) is not None
    tried = candidates({}, joints=raw.joints, drawn=drawn, quick=quick)
    sets = [name for candidate in tried for name in candidate.sets]
    return load_trials(
        raw, horizon_s=WINDOWS_S[-1], features=expand([*sets, *features]), progress=progress
    )


def trials_of(dataset: DataSet, rows: NDArray[np.int64]) -> DataSet:
    """The trials of these rows."""
    return replace(dataset, trials=tuple(dataset.trials[i] for i in rows))


def chosen(dataset: DataSet, window_s: float = WINDOW_S, **given: Any) -> dict[str, Chosen]:
    """Each task's choice, as `python -m export --quick --window` makes it; `given` is fixed."""
    form = {"window_s": window_s, "quick": True, "decision_points_s": (), "jobs": 1, **given}
    return promised(fit(dataset, **form).chosen)


def promised(choices: Mapping[str, Chosen]) -> dict[str, Chosen]:
    """The choices, with the intervals that the report shows and `make export FRONT=` promises."""
    return {
        task: replace(choice, by_trial=Promise(**vars(choice.by_trial)))
        for task, choice in choices.items()
    }


def unseen(choice: Chosen) -> Result | None:
    """The accuracy on objects never met; None where no objects could be left out."""
    return None if choice.left_out == TRIAL else choice.accuracy
