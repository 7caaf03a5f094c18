"""The choice of `make export`, made at each window and for changed recordings."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from edge.features.vector import WINDOW_S
from edge.touch.layout import SkinLayout
from train.choose.options import FitOptions
from train.choose.settings import Chosen
from train.data.dataset import DataSet, Measurement, Recordings, load_trials
from train.data.feature_sets import expand
from train.data.groups import TRIAL
from train.fitting import fit
from train.report.score import paired
from train.report.work import Workers
from train.tune import Loaded, features_tried, trials_of, windows_of

WINDOWS_S = tuple(round(0.1 * i, 1) for i in range(2, 13))
"""Decision points of the report's early decisions."""
CHOSEN_S = (0.2, 0.4, 0.6, 0.8, 0.9, 1.0, 1.1, 1.2)
"""Windows of the report, closer where most objects begin to move."""
FIRST_S = (0.6, WINDOW_S)
"""Those that are measured whatever the curve, beside the shortest and the longest."""
Points = Mapping[float, Mapping[str, Chosen]]
"""{window: {task: the choice at that window}}."""


def prepared(raw: Recordings, *, quick: bool, jobs: int) -> Loaded:
    """The trials of recordings as export takes them, and the windows of the report:
    `CHOSEN_S`, and the longer ones that export tries."""
    options = FitOptions(quick=quick, jobs=jobs, progress=True)
    if quick:
        return trials_of(raw, CHOSEN_S, options)
    seconds = [float(r.t[-1] - r.t[0]) for r in raw.recordings]
    loaded = trials_of(raw, (*CHOSEN_S, windows_of(seconds)[-1]), options)
    trials = loaded.dataset.trials
    windows = windows_of([float(t.recording.t[-1]) - t.onset_s for t in trials])
    longer = tuple(window for window in windows if window > CHOSEN_S[-1])
    return replace(loaded, windows=(*CHOSEN_S, *longer))


def followed(
    raw: Recordings,
    features: Sequence[str] = (),
    *,
    quick: bool = True,
    like: SkinLayout | None = None,
) -> DataSet:
    """The trials of recordings, with the features of all candidates and further ones by
    name.

    Args:
        raw: the recordings.
        features: names of further ones.
        quick: the candidates of a quick choice.
        like: a skin whose thresholds are taken; those of the recordings where None.
    """
    measurement = Measurement(
        expand([*features_tried(raw, FitOptions(quick=quick)), *features]),
        WINDOWS_S[-1],
        threshold=None if like is None else like.threshold_counts,
        onset=None if like is None else like.onset,
    )
    return load_trials(raw, measurement)


def chosen(
    dataset: DataSet,
    window_s: float = WINDOW_S,
    **options: Any,
) -> dict[str, Chosen]:
    """Each task's choice, as `python -m export --window` makes it with options; by
    default a quick one."""
    usual = {"quick": True, "decision_points_s": (), "jobs": 1}
    return fit(dataset, window_s=window_s, **{**usual, **options}).chosen


def choices_at(
    dataset: DataSet,
    windows: Sequence[float],
    task: str,
    workers: Workers,
    *,
    quick: bool,
) -> Points:
    """The choice at the first windows, and at one in the middle between each two at
    which a task's accuracies differ by more than chance."""
    points: dict[float, dict[str, Chosen]] = {}
    ends = {windows[0], windows[-1]}
    times_s = [w for w in windows if w in ends or w in FIRST_S]
    while times_s:
        cases = [(dataset, window_s) for window_s in times_s]
        results = workers.map("windows", partial(chosen, quick=quick), cases)
        points |= dict(zip(times_s, results, strict=True))
        accuracies = {w: points[w][task] for w in sorted(points)}
        times_s = _between(windows, accuracies)
    return dict(sorted(points.items()))


def _between(windows: Sequence[float], made: Mapping[float, Chosen]) -> list[float]:
    """The middle one of the windows between each two, with a task's choices, that
    differ."""
    middles = []
    for before_s, after_s in pairwise(made):
        between = [w for w in windows if before_s < w < after_s]
        if between and differ(made[before_s], made[after_s]):
            middles.append(between[(len(between) - 1) // 2])
    return middles


def differ(before: Chosen, after: Chosen) -> bool:
    """Whether the accuracies of two choices for a task differ by more than chance."""
    hits_before = np.asarray(before.by_trial.hits)
    hits_after = np.asarray(after.by_trial.hits)
    _, low, high = paired(hits_before, hits_after)
    return low > 0.0 or high < 0.0


def unseen(choice: Chosen) -> float | None:
    """The accuracy on unseen objects; None if no objects could be held out."""
    return None if choice.held_out == TRIAL else choice.accuracy.accuracy
