"""Recordings to a fitted model: the choice of what it is made of, and its honest accuracy."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from edge.errors import InputError
from edge.touch.arm import Chain
from edge.touch.feature_sets import expand
from edge.touch.features import SAMPLES, WINDOW_S
from train.candidates import Candidate, candidates
from train.choosing import LEAVE_OUT, Choosing, Chosen, without_folds
from train.crossval import jobs_here
from train.dataset import DataSet, load_trials, read
from train.pipeline import Choice, ContactClassifier
from train.stopping import FEWEST, SequentialClassifier

STEPS_S = (0.1, 0.2, 0.3, 0.4, 0.6)
"""Between decision points: the shortest with which the weights stay below `LARGEST_BYTES`. 0.1 s
decides 30 to 40 ms sooner than 0.2 s at the same error (cody18, household)."""
FIRST_S = 0.2
"""The first decision point."""
MOST_TRIALS = 2000
"""Trials beyond which calibration takes minutes, and must be asked for."""
LARGEST_BYTES = 950_000
"""Most weights of a model below 1 MB with decision points that nobody asked for."""
LEAK = 0.5
"""Share of the trials that do not have the most frequent label: where more of them are recognised
before any contact, the data leak."""
FEWEST_TRIALS = 3
LONG_TOUCHES = 3.0
"""Windows that half of the touches go on for, from which on longer ones are tried."""


@dataclass(frozen=True)
class Fitted:
    """A fitted model, with all that its file says of it.

    Attributes:
        dataset: the trials it was fitted on, with the features that it takes.
        measured: the same with those of every candidate.
        window_s: of the full decision.
        samples: values of a feature.
        X: (n, p) feature vectors at the full window.
        chosen: {task: what it is fitted with}.
        candidates: what was chosen among.
        classifier: at the full window.
        sequential: at all decision points, where it was calibrated.
        notes: sentences on what a user should know.
    """

    dataset: DataSet
    measured: DataSet
    window_s: float
    samples: int
    X: NDArray[np.float64] = field(repr=False)
    chosen: dict[str, Chosen]
    candidates: tuple[Candidate, ...]
    classifier: ContactClassifier
    sequential: SequentialClassifier | None = None
    notes: tuple[str, ...] = ()


def fit(
    data: DataSet | str | Path | Sequence[str | Path],
    *,
    features: Sequence[str] | None = None,
    projection: str | None = None,
    scaling: str | None = None,
    components: int | None = None,
    k: int | None = None,
    window_s: float | None = None,
    samples: int = SAMPLES,
    tasks: Sequence[str] | None = None,
    leave_out: str = LEAVE_OUT,
    decision_points_s: Sequence[float] | None = None,
    threshold: int | None = None,
    onset: int | None = None,
    arm: Chain | None = None,
    quick: bool = False,
    jobs: int | None = None,
    progress: bool = False,
) -> Fitted:
    """Choose and fit every task of some recordings.

    What is None is chosen per task among `train.candidates`: the features and projection of the
    fewest weights that are not worse than the best by more than a standard error, on trials that
    their fits had not seen, with the scaling, shrinkage, components and k that are best there.

    Args:
        data: recordings, folders of them, or a data set that was loaded for the features.
        features: names of sets and of single features.
        projection: `pca` or `lda`.
        scaling: one of `train.scaling.SCALINGS`.
        components: principal components.
        k: neighbours.
        window_s: seconds from onset; where None `WINDOW_S`, or two, four or eight times that where
            touches last for long and it tells so much more (`Choosing.window`).
        samples: values of a feature.
        tasks: keys of the labels; all that the recordings share where None.
        leave_out: label of which whole groups are left out to choose and to score a task, where
            each of its classes has several of them; `trial` for none.
        decision_points_s: windows at which decisions are calibrated, rising, the last of them
            `window_s`; empty for none; every 0.1 s, or 0.2 s, where None and the number of trials
            and the size of the model allow it.
        threshold: counts above which a taxel is in contact.
        onset: counts above which a contact begins.
        arm: of recordings with joint angles that name none.
        quick: fewer candidates and folds.
        jobs: processes; all cores where None.
        progress: show progress bars on stderr.

    Raises:
        InputError: the recordings cannot be used, or an argument is not possible with them.

    Example:
        >>> import train
        >>> fitted = train.fit(touches, features=["paper"], quick=True)
        >>> fitted.chosen["category"].accuracy.accuracy > 0.5
        True
    """
    jobs = jobs or jobs_here()
    if window_s is None and decision_points_s:
        window_s = decision_points_s[-1]
    windows: tuple[float, ...] = (window_s or WINDOW_S,)
    if isinstance(data, DataSet):
        dataset = data
    else:
        raw = read([data] if isinstance(data, str | Path) else data, progress=progress)
        every = candidates({}, joints=raw.joints, features=features, quick=quick)
        if window_s is None and not quick:
            windows = _windows([float(r.t[-1] - r.t[0]) for r in raw.recordings])
        dataset = load_trials(
            raw,
            threshold=threshold,
            onset=onset,
            horizon_s=windows[-1],
            features=expand([name for one in every for name in one.sets]),
            arm=arm,
            progress=progress,
        )
    y = {task: dataset.labels(task) for task in _tasks(dataset, tasks)}
    if len(dataset.trials) < FEWEST_TRIALS:
        raise InputError(f"{len(dataset.trials)} trials are too few to fit; record more")
    if k is not None and not 1 <= k <= len(dataset.trials) - 1:
        raise InputError(
            f"k must be 1 to {len(dataset.trials) - 1} with {len(dataset.trials)} trials, not {k}"
        )
    found = candidates(
        y,
        joints=dataset.joints > 0,
        features=features,
        projection=projection,
        scaling=scaling,
        components=components,
        k=k,
        quick=quick,
    )
    choosing = Choosing(dataset, y, found, samples, leave_out, quick, jobs, progress)
    lasting = [float(trial.recording.t[-1]) - trial.onset_s for trial in dataset.trials]
    windows = windows if len(windows) == 1 else _windows(lasting)
    window_s, notes = choosing.window(windows)
    chosen, trials = choosing.choose(window_s)
    measured = dataset
    dataset = dataset.of([name for one in chosen.values() for name in one.choice.features])
    names = dataset.names
    X = dataset.features(window_s, samples)
    widths = dataset.widths(samples)
    choices = {task: one.choice for task, one in chosen.items()}
    notes += _leaks(measured, y)
    points = _decision_points(dataset, choices, decision_points_s, window_s, samples, notes)
    sequential = None
    if points:
        without = without_folds(trials, measured, samples, chosen)
        used = [choice for by_task in (choices, *without) for choice in by_task.values()]
        seen = measured.of([name for choice in used for name in choice.features])
        at_points = np.stack([seen.features(s, samples) for s in points])
        sequential = SequentialClassifier(
            choices, points, seen.names, jobs=jobs, widths=seen.widths(samples)
        ).fit(at_points, y, trials.folds, without)
        classifier = sequential.decision_points_[-1]
    else:
        classifier = ContactClassifier(choices, names, widths).fit(X, y)
    return Fitted(
        dataset,
        measured,
        window_s,
        samples,
        X,
        chosen,
        tuple(found),
        classifier,
        sequential,
        tuple(notes),
    )


def _tasks(dataset: DataSet, wanted: Sequence[str] | None) -> tuple[str, ...]:
    if wanted is None:
        return dataset.tasks
    missing = [task for task in wanted if task not in dataset.tasks]
    if missing:
        raise InputError(
            f"not every recording has a label {missing[0]!r}; all have {', '.join(dataset.tasks)}"
        )
    return tuple(wanted)


def _windows(seconds: Sequence[float]) -> tuple[float, ...]:
    """The windows to try for touches that last for so many seconds each."""
    median = float(np.median(seconds))
    if median < LONG_TOUCHES * WINDOW_S:
        return (WINDOW_S,)
    return tuple(WINDOW_S * times for times in (1, 2, 4, 8) if WINDOW_S * times <= median)


def _leaks(dataset: DataSet, y: Mapping[str, NDArray[np.str_]]) -> list[str]:
    """Sentences on what tells labels before anything is touched: then the recording tells them."""
    first = [trial.recording.frames[0].reshape(-1) for trial in dataset.trials]
    X = np.stack(first).astype(np.float64)
    squares = cdist(X, X, "sqeuclidean")
    np.fill_diagonal(squares, np.inf)
    notes = []
    for task, labels in y.items():
        share = float((labels[squares.argmin(axis=1)] == labels).mean())
        usual = float(np.unique(labels, return_counts=True)[1].max() / len(labels))
        if share > usual + LEAK * (1.0 - usual):
            notes.append(
                f"warning: the first frame alone tells {task} in {share:.0%} of the trials, before "
                "anything is felt: the accuracy holds only where the same is so; "
                "`python -m train import --zero` subtracts the first frames"
            )
    return notes


def _decision_points(
    dataset: DataSet,
    choices: Mapping[str, Choice],
    wanted: Sequence[float] | None,
    window_s: float,
    samples: int,
    notes: list[str],
) -> tuple[float, ...]:
    """The decision points asked for, or the default ones where they can be calibrated."""
    if wanted is not None:
        return tuple(wanted)
    n = len(dataset.trials)
    if not FEWEST <= n <= MOST_TRIALS:
        notes.append(
            f"no decision points before the full window: {n} trials are not the {FEWEST} "
            f"to {MOST_TRIALS} that are calibrated by default"
        )
        return ()
    widths = dict(zip(dataset.names, dataset.widths(samples), strict=True))
    each = 0
    for task, choice in choices.items():
        columns = sum(widths[name] for name in choice.features)
        c = min(choice.components, len(set(dataset.labels(task).tolist())) * 2, n)
        each += c * (4 * columns + 8 * n)
    points: list[float] = []
    for every in STEPS_S:
        # As many of a long window as of the usual one.
        step = every * max(window_s / WINDOW_S, 1.0)
        rising = (round(max(FIRST_S, step) + i * step, 6) for i in itertools.count())
        points = [*itertools.takewhile(lambda s: s < window_s, rising), window_s]
        if len(points) * each <= LARGEST_BYTES:
            if every > STEPS_S[0]:
                notes.append(
                    f"{len(points)} decision points, one every {step:g} s, so that the model stays "
                    "below 1 MB; --decision-points asks for more"
                )
            return tuple(points)
    notes.append(
        f"no decision points before the full window: they would make the model about "
        f"{len(points) * each / 1e6:.1f} MB; --decision-points asks for them"
    )
    return ()
