"""Recordings to a fitted model: load, choose, calibrate, fit."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from edge.arrays import Floats
from edge.errors import InputError
from edge.features.vector import WINDOW_S
from edge.record.slips import slips, too_few
from train.choose.candidates import Candidate
from train.choose.decision_points import decision_points, has_early_points
from train.choose.options import FitOptions, Loaded, trials_of
from train.choose.settings import Chosen, Settings
from train.choose.windows import windows_of
from train.data.broken import BrokenTaxels
from train.data.dataset import DataSet, read
from train.data.groups import TRIAL, are_drawn
from train.data.leaks import leaks, without_copies
from train.data.tasks import labels_of_tasks, lacking
from train.data.vectors import Labels, Vectors
from train.model.pipeline import Choice, ContactClassifier
from train.model.stopping import Early, SequentialClassifier

FEWEST_TRIALS = 3


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

    @cached_property
    def _vectors(self) -> Vectors:
        """The trials with the features of every candidate."""
        return self.measured.vectors(self.window_s, self.samples, {})

    def selection(self, choices: Iterable[Choice]) -> tuple[DataSet, Vectors]:
        """The trials, and their vectors, with the features and labels that some
        settings of the tasks take."""
        tasks = set(self.chosen)
        features: list[str] = []
        for choice in choices:
            tasks.update(choice.targets)
            features += choice.features
        y = {task: self.measured.labels(task) for task in tasks}
        return self.measured.of(features), replace(self._vectors.of(features), y=y)


def fit(data: DataSet | str | Path | Sequence[str | Path], **options: Any) -> Fitted:
    """Choose and fit every task of some recordings.

    Options you pass are held fixed. The others are chosen among the candidates of
    `train.choose.candidates`, as `train.choose.protocols` says: for tasks whose groups
    are left out together, by the accuracy with trials and with groups left out; for
    others each the smallest model within one standard error of the best in
    cross-validation (the best where there are fewer than 200 trials).

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
        second_worth: accuracy that is worth a second of waiting.
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
        release: seconds that a contact may be away and go on. Where None they are the
            skin's, or more where that is more accurate (`train.data.pieces.joined`).
        arm: for recordings with joint angles that name no arm.
        dead: (row, col) of taxels that are left out.
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
    y = labels_of_tasks(loaded.dataset, fixed.tasks)
    labels = [trial.labels for trial in loaded.dataset.trials]
    places = [str(trial.path) for trial in loaded.dataset.trials]
    doubts = [f"warning: probably a slip: {text}" for text in slips(labels, places)]
    if len(labels) < FEWEST_TRIALS:
        raise InputError(
            f"a fit needs at least {FEWEST_TRIALS} trials, not {len(labels)}; record more"
        )
    settings = choose(loaded, y, fixed)
    measured = loaded.dataset.with_kernels(settings.window_s)
    notes = [*doubts, *lacking(loaded.dataset, fixed.tasks), *loaded.notes]
    notes += [*_of_unseen(settings, fixed), *leaks(measured, y)]
    points = decision_points(measured, settings, fixed, notes)
    notes += [*settings.notes, *too_few(labels)]
    if len(points) < 2:
        settings = replace(settings, early=None)
    dataset = measured.of(sorted(settings.features()))
    vectors = dataset.vectors(settings.window_s, fixed.samples, y)
    sequential = None
    if points:
        sequential = calibrate(measured, y, points, settings, fixed)
        classifier = sequential.decision_points_[-1]
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
    recordings, notes = without_copies(read(paths, progress=options.progress))
    if options.fixed_window_s is None and not options.quick:
        seconds = [float(r.t[-1] - r.t[0]) for r in recordings.recordings]
        windows = windows_of(seconds)
    loaded = trials_of(recordings, windows, options)
    taxels = BrokenTaxels()
    for recording in recordings.recordings:
        taxels.add(recording)
    notes += taxels.notes(loaded.dataset.layout)
    return replace(loaded, notes=[*notes, *loaded.notes])


def choose(loaded: Loaded, y: Labels, options: FitOptions) -> Settings:
    """The settings of each task, and the window."""
    dataset = loaded.dataset
    choosing = options.choosing(dataset, y, drawn=are_drawn(dataset))
    windows = loaded.windows
    if len(windows) > 1:
        windows = windows_of(
            [float(t.recording.t[-1]) - t.onset_s for t in dataset.trials]
        )
    window_s, notes = choosing.window(windows, options.second_worth)
    settings = replace(choosing.choose(window_s), notes=notes)
    if options.quick or not has_early_points(settings, options):
        return settings
    return replace(settings, early=choosing.early(window_s, settings.chosen))


def calibrate(
    measured: DataSet,
    y: Labels,
    points: tuple[float, ...],
    settings: Settings,
    options: FitOptions,
) -> SequentialClassifier:
    """A classifier for all decision points, with its stopping rules."""
    names = settings.features(folds=True)
    dataset = measured.of(sorted(names))
    at_points = np.stack([dataset.features(s, options.samples) for s in points])
    classifier = SequentialClassifier(
        settings.choices,
        points,
        dataset.names,
        jobs=options.processes,
        widths=dataset.widths(options.samples),
        early=settings.early,
        drawn=are_drawn(dataset),
        heading="calibrating" * options.progress,
    )
    grouped = [t for t, chosen in settings.chosen.items() if chosen.left_out != TRIAL]
    return classifier.fit(at_points, y, settings.folds, settings.without, grouped)


def _of_unseen(settings: Settings, options: FitOptions) -> list[str]:
    """How to choose settings for recorded objects instead, where they are chosen for
    others."""
    left_out = {chosen.left_out for chosen in settings.chosen.values()}
    if options.quick or left_out == {TRIAL}:
        return []
    return [
        "the settings are chosen for unseen objects; `--leave-out trial` chooses "
        "them for the recorded ones"
    ]
