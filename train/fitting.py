"""Recordings to a fitted model: its settings are chosen, and their accuracy is
measured."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
from joblib import cpu_count
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from edge.errors import InputError
from edge.touch.arm import Chain
from edge.touch.features import SAMPLES, WINDOW_S
from train import thresholds
from train.candidates import Candidate, candidates
from train.choose import LEAVE_OUT, Choosing, Chosen, kinds_of
from train.dataset import DataSet, load_trials, read
from train.evaluate import Labels
from train.feature_sets import expand
from train.mix import mix
from train.pipeline import Choice, ContactClassifier
from train.stopping import FEWEST, SequentialClassifier

STEPS_S = (0.1, 0.2, 0.3, 0.4, 0.6)
"""Steps between decision points. The first one that keeps the weights below
`LARGEST_BYTES` is taken. With 0.1 s decisions come 30 to 40 ms sooner than with 0.2 s,
at the same error (cody18, household)."""
FIRST_S = 0.2
"""The first decision point."""
MOST_TRIALS = 2000
"""With more trials calibration takes minutes, so decision points must be asked for."""
LARGEST_BYTES = 950_000
"""Bytes of weights with which a model stays below 1 MB."""
LEAK = 0.5
"""The data leak where the first frame recognises more than this share of the trials
that do not have the most frequent label."""
FEWEST_TRIALS = 3
LONG_TOUCHES = 2.0
"""Longer windows are tried where half of the touches last so many windows."""


@dataclass(frozen=True)
class Fitted:
    """A fitted model, with everything that its file says about it.

    Attributes:
        dataset: the trials it was fitted on, with the features that it takes.
        measured: the same trials with the features of every candidate.
        window_s: of the full decision.
        samples: values of a feature.
        X: (n, p) feature vectors at the full window.
        chosen: {task: its settings}.
        candidates: the candidates that they were chosen among.
        classifier: at the full window.
        sequential: at all decision points, where it was calibrated.
        notes: sentences that a user should read.
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

    Arguments you pass are held fixed. The others are chosen for each task among the
    candidates of `train.choose`: the features and projection of the smallest model
    within one standard error of the best in cross-validation, with the scaling,
    shrinkage, components and k that are best there.

    Args:
        data: recordings, folders of them, or a data set that was loaded for the
            features.
        features: names of sets and of single features.
        projection: `pca` or `lda`.
        scaling: one of `train.scaling.SCALINGS`.
        components: principal components.
        k: neighbours.
        window_s: seconds from onset. Where None it is `WINDOW_S`, or two, four or eight
            times that where touches last so long and accuracy rises enough
            (`Choosing.window`).
        samples: values of a feature.
        tasks: keys of the labels; all that the recordings share where None.
        leave_out: label whose groups are left out to choose the settings of a task and
            to measure its accuracy, where each of its classes has several groups;
            `trial` for single trials.
        decision_points_s: windows at which decisions are calibrated, rising, the last
            of them `window_s`; empty for none. Where None there is one every 0.1 s, or
            less often, if the number of trials and the size of the model allow it.
        threshold: counts above which a taxel is in contact.
        onset: counts above which a contact begins.
        arm: for recordings with joint angles that name no arm.
        quick: fewer candidates and folds.
        jobs: processes; all cores where None.
        progress: show progress bars on stderr.

    Raises:
        InputError: the recordings cannot be used, or an argument is not possible with
            them.

    Example:
        >>> import train
        >>> fitted = train.fit(touches, features=["paper"], quick=True)
        >>> fitted.chosen["category"].accuracy.accuracy > 0.5
        True
    """
    jobs = jobs or cpu_count()
    if window_s is None and decision_points_s:
        window_s = decision_points_s[-1]
    windows: tuple[float, ...] = (window_s or WINDOW_S,)
    notes: list[str] = []

    def choosing(
        of: DataSet, y: Labels, quick: bool, mixed: bool, shown: bool
    ) -> Choosing:
        drawn = mixed or kinds_of([trial.recording for trial in of.trials]) is not None
        fixed = (features, projection, scaling, components, k)
        tried = candidates(y, *fixed, joints=of.joints > 0, drawn=drawn, quick=quick)
        return Choosing(of, y, tried, samples, leave_out, quick, jobs, shown)

    if isinstance(data, DataSet):
        dataset = data
    else:
        raw = read([data] if isinstance(data, str | Path) else data, progress=progress)
        drawn = raw.mixed or kinds_of(raw.recordings) is not None
        every = candidates(
            {}, joints=raw.joints, drawn=drawn, features=features, quick=quick
        )
        if window_s is None and not (quick or raw.mixed):
            windows = _windows([float(r.t[-1] - r.t[0]) for r in raw.recordings])
        load = partial(
            load_trials,
            raw,
            horizon_s=windows[-1],
            features=expand([name for candidate in every for name in candidate.sets]),
            arm=arm,
            partial=True,
            progress=progress,
            jobs=jobs,
        )
        fixed = threshold is not None or onset is not None
        if not fixed and "threshold_counts" not in raw.own[0].meta.get("skin", {}):
            threshold, onset = thresholds.proposed(raw.own)
            notes.append(
                "warning: the skin was saved without thresholds; a threshold of "
                f"{threshold} and "
                f"an onset of {onset} counts come from the noise before contact"
            )
        dataset = load(threshold=threshold, onset=onset)
        if not (fixed or any("simulation" in r.meta for r in raw.recordings)):

            def accuracy(of: DataSet) -> float:
                y = {task: of.labels(task) for task in _tasks(of, tasks)}
                few = choosing(of, y, quick=True, mixed=False, shown=False)
                return few.accuracy(windows[0])

            dataset, lower = thresholds.chosen(
                dataset, lambda low, high: load(threshold=low, onset=high), accuracy
            )
            notes += lower
    y = {task: dataset.labels(task) for task in _tasks(dataset, tasks)}
    n = len(dataset.trials)
    if n < FEWEST_TRIALS:
        counted = "1 trial is" if n == 1 else f"{n} trials are"
        raise InputError(f"{counted} too few to fit; record at least {FEWEST_TRIALS}")
    if k is not None and not 1 <= k <= n - 1:
        raise InputError(f"k must be 1 to {n - 1} with {n} trials, not {k}")
    own = dataset.own
    if own is None:
        choice = choosing(dataset, y, quick, mixed=False, shown=progress)
        if len(windows) > 1:
            windows = _windows(
                [float(t.recording.t[-1]) - t.onset_s for t in dataset.trials]
            )
        window_s, why = choice.window(windows)
        chosen, folds, without = choice.choose(window_s)
        tried = choice.tried
    else:
        window_s = windows[0]
        X = dataset.with_kernels(window_s).features(window_s, samples)

        def settings(of: DataSet, y: Labels) -> dict[str, Chosen]:
            return choosing(of, y, quick, mixed=True, shown=progress).choose(
                windows[0]
            )[0]

        chosen, folds, without, why = mix(
            dataset, y, own, settings, X, samples, leave_out, quick=quick, jobs=jobs
        )
        y = {task: y[task] for task in chosen}
        tried = choosing(dataset, y, quick, mixed=True, shown=False).tried
    notes += why
    dataset = dataset.with_kernels(window_s)
    choices = {task: settings.choice for task, settings in chosen.items()}
    measured = dataset
    dataset = measured.of(
        [name for choice in choices.values() for name in choice.features]
    )
    X = dataset.features(window_s, samples)
    felt = np.ones(n, dtype=bool) if own is None else own
    notes += _leaks(
        measured.part(felt), {task: labels[felt] for task, labels in y.items()}
    )
    tested = int((folds >= 0).sum())
    points = _decision_points(
        dataset, choices, decision_points_s, window_s, samples, notes, tested
    )
    sequential = None
    if points:
        used = [
            choice for by_task in (choices, *without) for choice in by_task.values()
        ]
        seen = measured.of([name for choice in used for name in choice.features])
        at_points = np.stack([seen.features(s, samples) for s in points])
        sequential = SequentialClassifier(
            choices, points, seen.names, jobs=jobs, widths=seen.widths(samples)
        ).fit(at_points, y, folds, without, own)
        classifier = sequential.decision_points_[-1]
    else:
        classifier = ContactClassifier(choices, dataset.names, dataset.widths(samples))
        classifier.fit(X, y, own)
    settled = chosen, tuple(tried), classifier, sequential, tuple(notes)
    return Fitted(dataset, measured, window_s, samples, X, *settled)


def _tasks(dataset: DataSet, wanted: Sequence[str] | None) -> tuple[str, ...]:
    if wanted is None:
        return dataset.tasks
    missing = [task for task in wanted if task not in dataset.tasks]
    if missing:
        raise InputError(
            f"not every recording has a label {missing[0]!r}; all have "
            f"{', '.join(dataset.tasks)}"
        )
    return tuple(wanted)


def _windows(seconds: Sequence[float]) -> tuple[float, ...]:
    """The windows to try for touches that last so many seconds each."""
    median = float(np.median(seconds))
    if median < LONG_TOUCHES * WINDOW_S:
        return (WINDOW_S,)
    return tuple(
        WINDOW_S * times for times in (1, 2, 4, 8) if WINDOW_S * times <= median
    )


def _leaks(dataset: DataSet, y: Mapping[str, NDArray[np.str_]]) -> list[str]:
    """Warnings where the first frame gives labels away, or most recordings begin in
    contact."""
    untouched = np.array([t.onset_s > t.recording.t[0] for t in dataset.trials])
    if 2 * untouched.sum() < len(untouched):
        mend = "record from before the touch"
        recordings = [t.recording for t in dataset.trials]
        low, high = thresholds.proposed(recordings)
        felt, _ = thresholds.count_contacts(recordings, low, high)
        if felt >= (1.0 - thresholds.MISSED_SHARE) * len(recordings):
            mend += (
                f", or take --threshold {low} --onset {high}, by which it begins later"
            )
        return [
            f"warning: {(~untouched).mean():.0%} of the touches begin with their "
            "recording, so "
            f"their onset is not known; {mend}"
        ]
    X = np.stack([t.recording.frames[0].reshape(-1) for t in dataset.trials])[untouched]
    squares = cdist(X, X, "sqeuclidean")
    np.fill_diagonal(squares, np.inf)
    notes = []
    for task, every in y.items():
        labels = every[untouched]
        share = float((labels[squares.argmin(axis=1)] == labels).mean())
        usual = float(np.unique(labels, return_counts=True)[1].max() / len(labels))
        if share > usual + LEAK * (1.0 - usual):
            notes.append(
                f"warning: the first frame alone tells {task} in {share:.0%} of the "
                "trials, before "
                "anything is touched. The accuracy holds only where this is so in use "
                "too; "
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
    tested: int,
) -> tuple[float, ...]:
    """The decision points asked for, or the default ones where they can be
    calibrated."""
    if wanted is not None:
        return tuple(wanted)
    if not FEWEST <= tested <= MOST_TRIALS:
        notes.append(
            f"no decision points before the full window: {tested} trials are not the "
            f"{FEWEST} "
            f"to {MOST_TRIALS} that are calibrated by default"
        )
        return ()
    widths = dict(zip(dataset.names, dataset.widths(samples), strict=True))
    n, each = len(dataset.trials), 0
    for task, choice in choices.items():
        columns = sum(widths[name] for name in choice.features)
        c = min(choice.components, len(set(dataset.labels(task).tolist())) * 2, n)
        each += c * (4 * columns + 8 * n)
    points: list[float] = []
    for every in STEPS_S:
        # A long window has as many decision points as the usual one.
        step = every * max(window_s / WINDOW_S, 1.0)
        rising = (round(max(FIRST_S, step) + i * step, 6) for i in itertools.count())
        points = [*itertools.takewhile(lambda s: s < window_s, rising), window_s]
        if len(points) * each <= LARGEST_BYTES:
            if every > STEPS_S[0]:
                notes.append(
                    f"{len(points)} decision points, one every {step:g} s, so that the "
                    "model stays "
                    "below 1 MB; --decision-points asks for more"
                )
            return tuple(points)
    notes.append(
        f"no decision points before the full window: they would make the model about "
        f"{len(points) * each / 1e6:.1f} MB; --decision-points asks for them"
    )
    return ()
