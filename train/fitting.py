"""Recordings to a fitted model: settings are chosen, and their accuracy measured."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from joblib import cpu_count
from scipy.spatial.distance import cdist

from edge.arrays import Floats
from edge.errors import InputError
from edge.recording import Recording
from edge.tools.slips import slips
from edge.touch.arm import Chain
from edge.touch.features import SAMPLES, WINDOW_S
from train.choose.candidates import Candidate, Fixed, candidates, features_of
from train.choose.choose import Choosing
from train.choose.decision_points import MOST_TRIALS, usual_points
from train.choose.settings import Chosen, Settings
from train.data import thresholds
from train.data.dataset import (
    DataSet,
    Measurement,
    Recordings,
    Untouched,
    load_trials,
    read,
)
from train.data.groups import LEAVE_OUT, Divisions, kinds_of
from train.data.vectors import Labels, Vectors
from train.model.pipeline import Choice, ContactClassifier
from train.model.stopping import FEWEST, Early, SequentialClassifier

LEAK = 0.5
"""Warn of a leak if a nearest neighbour on the first frame beats the majority class by
more than this share of the remainder."""
FEWEST_TRIALS = 3
LONG_TOUCHES = 2.0
"""Longer windows are tried where half of the touches last so many windows."""
LONG_SHARE = 0.9
"""Share of the touches that may end before the longest window."""
LONGEST_WINDOW_S = 60.0
LAST_RATIO = 1.2
"""The longest window is tried where it is so much longer than the one before it."""


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
    X: Floats = field(repr=False)
    chosen: dict[str, Chosen]
    candidates: tuple[Candidate, ...]
    classifier: ContactClassifier
    sequential: SequentialClassifier | None = None
    notes: tuple[str, ...] = ()

    @property
    def early(self) -> Early | None:
        """Settings of the decision points before the full window, where these have
        their own."""
        return None if self.sequential is None else self.sequential.early

    def selection(self, choices: Iterable[Choice]) -> tuple[DataSet, Vectors]:
        """The trials, and their vectors, with the features and labels that some
        settings of the tasks take."""
        tasks = set(self.chosen)
        features: list[str] = []
        for choice in choices:
            tasks.update(choice.targets)
            features += choice.features
        dataset = self.measured.of(features)
        y = {task: dataset.labels(task) for task in tasks}
        return dataset, dataset.vectors(self.window_s, self.samples, y)


@dataclass(frozen=True, kw_only=True)
class FitOptions(Fixed):
    """The settings that a fit holds fixed; it chooses the others. See `fit`."""

    window_s: float | None = None
    samples: int = SAMPLES
    tasks: Sequence[str] | None = None
    leave_out: str = LEAVE_OUT
    decision_points_s: Sequence[float] | None = None
    threshold: int | None = None
    onset: int | None = None
    arm: Chain | None = None
    quick: bool = False
    jobs: int | None = None
    progress: bool = False

    @property
    def processes(self) -> int:
        """Number of processes."""
        return self.jobs or cpu_count()

    @property
    def fixed_window_s(self) -> float | None:
        """The window that is asked for; None where it is to be chosen."""
        if self.window_s is None and self.decision_points_s:
            return self.decision_points_s[-1]
        return self.window_s

    def candidates_for(
        self,
        dataset: DataSet,
        y: Labels,
        *,
        drawn: bool,
    ) -> list[Candidate]:
        """The candidates for some trials."""
        joints = dataset.joints > 0
        shear = dataset.layout.axes is not None
        return candidates(
            y,
            self,
            joints=joints,
            shear=shear,
            drawn=drawn,
            quick=self.quick,
        )

    def choosing(self, dataset: DataSet, y: Labels, *, drawn: bool) -> Choosing:
        """The choice of the settings of some trials.

        Raises:
            InputError: `k` is not possible where some of them are left out.
        """
        divisions = Divisions.of(dataset, y, self.leave_out, self.quick)
        most = divisions.fewest_left
        if self.k is not None and not 1 <= self.k <= most:
            raise InputError(
                f"k must be 1 to {most}, the trials that remain of "
                f"{len(divisions.folds)} where some are left out, not {self.k}"
            )
        return Choosing(
            dataset,
            y,
            self.candidates_for(dataset, y, drawn=drawn),
            divisions,
            self.samples,
            self.processes,
            self.progress,
        )


@dataclass(frozen=True)
class Loaded:
    """The trials of a fit.

    Attributes:
        dataset: with the features of every candidate.
        windows: that may be chosen, the usual one first.
        notes: sentences that a user should read.
    """

    dataset: DataSet
    windows: tuple[float, ...]
    notes: list[str]


def fit(data: DataSet | str | Path | Sequence[str | Path], **options: Any) -> Fitted:
    """Choose and fit every task of some recordings.

    Options you pass are held fixed. The others are chosen for each task among the
    candidates of `train.choose.choose`: the features and projection of the smallest model
    within one standard error of the best in cross-validation, with the scaling,
    shrinkage, components and k that are best there.

    Args:
        data: recordings, folders of them, or a data set that was loaded for the
            features.
        features: names of sets and of single features.
        projection: `pca` or `lda`.
        scaling: one of `train.model.scaling.SCALINGS`.
        components: principal components.
        k: neighbours.
        window_s: seconds from onset. Where None it is `WINDOW_S`, or twice that and so
            on where touches last so long and accuracy rises enough
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
        InputError: the recordings cannot be used, or an option is not possible with
            them.

    Example:
        >>> import train
        >>> fitted = train.fit(touches, features=["paper"], quick=True)
        >>> fitted.chosen["category"].accuracy.accuracy > 0.5
        True
    """
    fixed = FitOptions(**options)
    loaded = load(data, fixed)
    y = _labels(loaded.dataset, fixed.tasks)
    labels = [trial.labels for trial in loaded.dataset.trials]
    doubts = [f"warning: probably a slip: {sentence}" for sentence in slips(labels)]
    _check_size(len(loaded.dataset.trials))
    settings = choose(loaded, y, fixed)
    measured = loaded.dataset.with_kernels(settings.window_s)
    notes = [*doubts, *_lacking(loaded.dataset, fixed.tasks), *loaded.notes]
    notes += [*settings.notes, *_leaks(measured, y)]
    points = _decision_points(measured, settings, fixed, notes)
    if len(points) < 2:
        settings = replace(settings, early=None)
    dataset = measured.of(sorted(settings.features()))
    vectors = dataset.vectors(settings.window_s, fixed.samples, y)
    sequential = None
    if points:
        sequential, of_known = calibrate(measured, y, points, settings, fixed)
        classifier = sequential.decision_points_[-1]
        notes += of_known
    else:
        classifier = ContactClassifier.of(settings.choices, vectors)
    return Fitted(
        dataset=dataset,
        measured=measured,
        window_s=settings.window_s,
        samples=fixed.samples,
        X=vectors.X,
        chosen=settings.chosen,
        candidates=tuple(settings.candidates),
        classifier=classifier,
        sequential=sequential,
        notes=tuple(notes),
    )


def load(
    data: DataSet | str | Path | Sequence[str | Path], options: FitOptions
) -> Loaded:
    """The trials, with the features of every candidate and suitable thresholds."""
    windows: tuple[float, ...] = (options.fixed_window_s or WINDOW_S,)
    if isinstance(data, DataSet):
        return Loaded(data, windows, [])
    paths = [data] if isinstance(data, str | Path) else data
    recordings = read(paths, progress=options.progress)
    if options.fixed_window_s is None and not options.quick:
        seconds = [float(r.t[-1] - r.t[0]) for r in recordings.recordings]
        windows = windows_of(seconds)
    loaded = trials_of(recordings, windows, options)
    return replace(loaded, notes=[*_copies(recordings), *loaded.notes])


def _copies(recordings: Recordings) -> list[str]:
    """A warning where some recordings are others' copies, by which they are told."""
    originals: dict[bytes, Path] = {}
    copies = []
    for path, recording in zip(recordings.paths, recordings.recordings, strict=True):
        sha = hashlib.sha256(recording.t.tobytes())
        sha.update(recording.frames.tobytes())
        original = originals.get(sha.digest())
        if original is None:
            originals[sha.digest()] = path
        elif recording.frames.any():
            copies.append(f"{path} of {original}")
    if not copies:
        return []
    return [
        f"warning: {len(copies)} of {len(recordings.paths)} recordings are copies, such "
        f"as {copies[0]}; a copy is told by its original, so the accuracy is too high: "
        "leave copies out"
    ]


def trials_of(
    recordings: Recordings,
    windows: tuple[float, ...],
    options: FitOptions,
) -> Loaded:
    """The trials of recordings, up to the last of some windows, by thresholds that are
    given, saved, proposed or chosen."""
    usual = candidates(
        {},
        options,
        joints=recordings.joints,
        shear=recordings.shear,
        drawn=kinds_of(recordings.recordings) is not None,
        quick=options.quick,
    )
    measurement = Measurement(features_of(usual), windows[-1], arm=options.arm)

    def by(threshold: int | None, onset: int | None) -> DataSet:
        return load_trials(
            recordings,
            replace(measurement, threshold=threshold, onset=onset),
            partial=True,
            progress=options.progress,
            jobs=options.processes,
        )

    def accuracy(trials: DataSet) -> float:
        hasty = replace(options, quick=True, progress=False)
        y = _labels(trials, options.tasks)
        choosing = hasty.choosing(trials, y, drawn=_are_drawn(trials))
        return choosing.accuracy(windows[0])

    if options.threshold is not None or options.onset is not None:
        return Loaded(by(options.threshold, options.onset), windows, [])
    dataset, notes = _by_noise(recordings, by)
    if not any("simulation" in r.meta for r in recordings.recordings):
        dataset, lower = thresholds.chosen(dataset, by, accuracy)
        notes += lower
    return Loaded(dataset, windows, notes)


def _by_noise(
    recordings: Recordings,
    by: Callable[[int | None, int | None], DataSet],
) -> tuple[DataSet, list[str]]:
    """The trials by the thresholds that the skin was saved with, or else by those that
    its noise suggests, and the warning of these."""
    reason = "the skin was saved without thresholds"
    if "threshold_counts" in recordings.of_owner[0].meta.get("skin", {}):
        try:
            return by(None, None), []
        except Untouched:
            reason = "no recording has a contact at its own thresholds"
    proposal = thresholds.proposed(recordings.of_owner)
    warning = (
        f"warning: {reason}; a threshold of {proposal.threshold} and an onset of "
        f"{proposal.onset} counts come from {proposal.source}"
    )
    return by(proposal.threshold, proposal.onset), [warning]


def _are_drawn(dataset: DataSet) -> bool:
    """Whether the trials are of things that a scene drew from kinds."""
    return kinds_of([trial.recording for trial in dataset.trials]) is not None


def _labels(dataset: DataSet, tasks: Sequence[str] | None) -> Labels:
    return {task: dataset.labels(task) for task in _tasks(dataset, tasks)}


def _check_size(trials: int) -> None:
    if trials < FEWEST_TRIALS:
        number = "1 trial is" if trials == 1 else f"{trials} trials are"
        raise InputError(f"{number} too few to fit; record at least {FEWEST_TRIALS}")


def choose(loaded: Loaded, y: Labels, options: FitOptions) -> Settings:
    """The settings of each task, and the window."""
    dataset = loaded.dataset
    choosing = options.choosing(dataset, y, drawn=_are_drawn(dataset))
    windows = loaded.windows
    if len(windows) > 1:
        windows = windows_of(
            [float(t.recording.t[-1]) - t.onset_s for t in dataset.trials]
        )
    window_s, notes = choosing.window(windows)
    settings = replace(choosing.choose(window_s), notes=notes)
    if options.quick or not _has_early_points(settings, options):
        return settings
    return replace(settings, early=choosing.early(window_s, settings.chosen))


def calibrate(
    measured: DataSet,
    y: Labels,
    points: tuple[float, ...],
    settings: Settings,
    options: FitOptions,
) -> tuple[SequentialClassifier, list[str]]:
    """A classifier for all decision points, with its stopping rules, and sentences that
    a user should read."""
    known = settings.of_known
    names = settings.features(folds=True) | known.features(folds=True)
    dataset = measured.of(sorted(names))
    at_points = np.stack([dataset.features(s, options.samples) for s in points])
    classifier = SequentialClassifier(
        settings.choices,
        points,
        dataset.names,
        jobs=options.processes,
        widths=dataset.widths(options.samples),
        early=None if settings.early is None else settings.early.settings,
    )
    classifier.fit(
        at_points,
        y,
        settings.folds,
        settings.without,
    )
    tasks = [
        task for task, c in settings.chosen.items() if c.choice_of_known is not None
    ]
    if options.quick or not tasks:
        return classifier, []
    instead = classifier.smallest_errors(
        at_points,
        y,
        known.without,
        None if known.early is None else known.early.settings,
    )
    return classifier, [_errors_of_known(tasks, classifier, instead)]


def _errors_of_known(
    tasks: Sequence[str],
    exported: SequentialClassifier,
    instead: Mapping[str, float],
) -> str:
    """What early decisions about recorded objects would gain by settings for these.

    Where groups are left out, settings are chosen for objects never met, though
    certificates are for recorded ones.
    """
    errors = []
    for task in tasks:
        smallest = exported.stopping_[task].smallest_error
        errors.append(f"{task} {smallest:.1%}, instead {instead[task]:.1%}")
    return (
        "the settings are chosen for objects never met; `--leave-out trial` chooses "
        "them for the recorded ones, whose smallest certified errors of early decisions "
        f"(--error) are: {'; '.join(errors)}"
    )


def _is_usual(dataset: DataSet, task: str) -> bool:
    """Whether most trials have a label for a task, of those that no other task gives."""
    labels = dataset.labels(task)
    labelled = int(np.count_nonzero(labels))
    return 2 * labelled > len(labels)


def _lacking(dataset: DataSet, tasks: Sequence[str] | None) -> list[str]:
    """A sentence for each task that most trials lack, and that is not named."""
    if tasks is not None:
        return []
    sentences = []
    for task in dataset.tasks:
        if not _is_usual(dataset, task):
            count = np.count_nonzero(dataset.labels(task))
            sentences.append(
                f"warning: task {task} is left out: {count} of {len(dataset.trials)} "
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


def windows_of(seconds: Sequence[float]) -> tuple[float, ...]:
    """The windows to try for touches that last so many seconds each.

    They reach the time that a tenth of the touches last; of shorter ones the last
    values are held.
    """
    if float(np.median(seconds)) < LONG_TOUCHES * WINDOW_S:
        return (WINDOW_S,)
    longest_s = min(float(np.quantile(seconds, LONG_SHARE)), LONGEST_WINDOW_S)
    windows = [WINDOW_S]
    while 2.0 * windows[-1] <= longest_s:
        windows.append(2.0 * windows[-1])
    if longest_s >= LAST_RATIO * windows[-1]:
        windows.append(round(longest_s, 1))
    return tuple(windows)


def _leaks(dataset: DataSet, y: Labels) -> list[str]:
    """Warnings where the first frame gives labels away, or most recordings begin in
    contact."""
    recordings = [t.recording for t in dataset.trials]
    untouched = np.array([t.onset_s > t.recording.t[0] for t in dataset.trials])
    if 2 * untouched.sum() < len(untouched):
        return [_late_recordings(recordings, float((~untouched).mean()))]
    X = np.stack([recording.frames[0].reshape(-1) for recording in recordings])
    squares = cdist(X[untouched], X[untouched], "sqeuclidean")
    np.fill_diagonal(squares, np.inf)
    notes = []
    for task, all_labels in y.items():
        labelled = np.flatnonzero(all_labels[untouched])
        if len(labelled) < 2:
            continue
        labels = all_labels[untouched][labelled]
        nearest = squares[np.ix_(labelled, labelled)].argmin(axis=1)
        share = float((labels[nearest] == labels).mean())
        _, counts = np.unique(labels, return_counts=True)
        usual = float(counts.max() / len(labels))
        if share > usual + LEAK * (1.0 - usual):
            notes.append(
                f"warning: the first frame alone tells {task} in {share:.0%} of the "
                "trials, before anything is touched. The accuracy holds only where "
                "this is so in use too; `python -m train import --zero` subtracts the "
                "first frames"
            )
    return notes


def _late_recordings(recordings: Sequence[Recording], share: float) -> str:
    """The warning that a share of the recordings begins in contact."""
    mend = "record from before the touch"
    proposal = thresholds.proposed(recordings)
    low = proposal.threshold
    high = proposal.onset
    with_contact, _ = thresholds.count_contacts(recordings, low, high)
    if with_contact >= (1.0 - thresholds.MISSED_SHARE) * len(recordings):
        mend += f", or take --threshold {low} --onset {high}, by which it begins later"
    return (
        f"warning: {share:.0%} of the touches begin with their recording, so their "
        f"onset is not known; {mend}"
    )


def _decision_points(
    measured: DataSet,
    settings: Settings,
    options: FitOptions,
    notes: list[str],
) -> tuple[float, ...]:
    """The decision points asked for, or the usual ones."""
    asked_s = options.decision_points_s
    if asked_s is None:
        return usual_points(measured, settings, options.samples, notes)
    if not asked_s:
        notes.append(
            "decisions carry no confidence, as the model has no decision points"
        )
    return tuple(asked_s)


def _has_early_points(settings: Settings, options: FitOptions) -> bool:
    """Whether decision points before the full window are asked for, or usual."""
    if options.decision_points_s is not None:
        return len(options.decision_points_s) > 1
    return FEWEST <= settings.tested <= MOST_TRIALS
