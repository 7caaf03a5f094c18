"""How the training touches were made, against which the board doubts others.

It compares frames that repeat, what tells the onset, the standstill of joints, and the
speed at which the arm came.
"""

from pathlib import Path
from typing import Any

import numpy as np

from edge.decide.doubts import frame_doubts, still_times
from edge.errors import InputError
from edge.touch.contact import FeatureSeries
from train.data.dataset import DataSet

OFTEN = 0.2
"""Frames that repeat are no doubt if they did in so many of the trials."""
SELDOM = 0.01
"""Share of the trials that may lie outside of a usual range, on one side."""
SLOWER = 0.97
"""Part of the least speed that is no doubt, as clocks and encoders err."""
FASTER = 1.15
"""Part of the greatest speed that is no doubt."""
RESTS = 0.01
"""Radians a second that the encoders of an arm at rest may show."""


def usual_touches(dataset: DataSet, window_s: float) -> dict[str, Any]:
    """{field of `edge.decide.info.ModelInfo`: what the training touches showed}."""
    usual: dict[str, Any] = {}
    frozen = []
    rests = []
    for trial in dataset.each():
        frozen.append(frame_doubts(trial.series, window_s)["frozen"])
        rests.append(_still_times(trial.series, window_s))
    usual["repeats"] = bool(np.mean(frozen) >= OFTEN)
    usual["onset"] = _onset(dataset)
    if any(rests):
        longest = np.quantile(rests, 1.0 - SELDOM, axis=0)
        usual["still_s"] = tuple(longest.tolist())
    speeds = np.array([trial.series.speed for trial in dataset.trials])
    if np.isfinite(speeds).any():
        low, high = np.nanquantile(speeds, (SELDOM, 1.0 - SELDOM))
        usual["speeds"] = SLOWER * float(low), FASTER * float(high) + RESTS
    return usual


def _onset(dataset: DataSet) -> str:
    """What tells the onsets of all trials, see `edge.decide.info.ModelInfo`.

    Raises:
        InputError: it differs among the recordings.
    """
    sources: dict[str, Path] = {}
    for trial in dataset.trials:
        onset = trial.recording.meta.get("onset") or {"source": ""}
        sources[onset["source"]] = trial.path
    if len(sources) > 1:
        first, second = list(sources.values())[:2]
        raise InputError(
            f"{first} and {second}: onsets come from {' and '.join(sorted(sources))}; "
            "import all recordings with the same --onset or --onset-column"
        )
    return next(iter(sources))


def _still_times(touch: FeatureSeries, window_s: float) -> list[float]:
    """The `still_times` of the joints within a window; none without joint angles."""
    if touch.joints is None:
        return []
    t = touch.t[touch.t <= window_s]
    return still_times(t, touch.joints[: len(t)])
