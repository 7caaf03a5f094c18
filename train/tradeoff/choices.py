"""The choice of `make export`, made at each window and for changed recordings."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from edge.features.vector import WINDOW_S
from edge.touch.layout import SkinLayout
from train.choose.options import FitOptions
from train.choose.settings import Chosen
from train.data.dataset import DataSet, Measurement, Recordings, load_trials
from train.data.groups import TRIAL
from train.fitting import fit
from train.tune import Loaded, features_tried, trials_of, windows_of

WINDOWS_S = tuple(round(0.1 * i, 1) for i in range(2, 13))
"""Decision points of the report's early decisions."""
CHOSEN_S = (0.2, 0.4, 0.6, 0.8, 0.9, 1.0, 1.1, 1.2)
"""Windows of the report, closer where most objects begin to move."""
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


def followed(raw: Recordings, *, like: SkinLayout | None = None) -> DataSet:
    """The trials of recordings, with the features of a quick choice.

    Args:
        raw: the recordings.
        like: a skin whose thresholds are taken; those of the recordings where None.
    """
    measurement = Measurement(
        features_tried(raw, FitOptions(quick=True)),
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


def unseen(choice: Chosen) -> float | None:
    """The accuracy on unseen objects; None if no objects could be held out."""
    return None if choice.held_out == TRIAL else choice.accuracy.accuracy
