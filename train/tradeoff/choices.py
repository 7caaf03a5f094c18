"""The quick choice of `make export`, made at each window and for changed recordings."""

from collections.abc import Mapping, Sequence
from typing import Any

from edge.touch.features import WINDOW_S
from train.candidates import candidates
from train.choose import TRIAL, Chosen, kinds_of
from train.dataset import DataSet, Recordings, load_trials
from train.evaluate import Result
from train.feature_sets import expand
from train.fitting import fit

WINDOWS_S = tuple(round(0.1 * i, 1) for i in range(2, 13))
"""Windows of the report, which are also the decision points of its early decisions."""
Points = Mapping[float, Mapping[str, Chosen]]
"""{window: {task: the choice at that window}}."""


def followed(
    raw: Recordings,
    features: Sequence[str] = (),
    *,
    quick: bool = True,
    progress: bool = False,
) -> DataSet:
    """The trials of recordings, with the features of all candidates and further ones by
    name."""
    drawn = kinds_of(raw.recordings) is not None
    tried = candidates({}, joints=raw.joints, shear=raw.shear, drawn=drawn, quick=quick)
    sets = [name for candidate in tried for name in candidate.sets]
    return load_trials(
        raw,
        horizon_s=WINDOWS_S[-1],
        features=expand([*sets, *features]),
        progress=progress,
    )


def chosen(
    dataset: DataSet, window_s: float = WINDOW_S, **given: Any
) -> dict[str, Chosen]:
    """Each task's choice, as `python -m export --quick --window` makes it with options
    `given`."""
    form = {
        "window_s": window_s,
        "quick": True,
        "decision_points_s": (),
        "jobs": 1,
        **given,
    }
    return fit(dataset, **form).chosen


def unseen(choice: Chosen) -> Result | None:
    """The accuracy on objects never met; None if no objects could be left out."""
    return None if choice.left_out == TRIAL else choice.accuracy
