"""Recordings to a fitted model: load, choose, calibrate, fit."""

import logging
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from edge.errors import InputError
from edge.features.vector import WINDOW_S
from edge.record.saving import listed
from edge.record.slips import slips, too_few
from train.choose.decision_points import decision_points, has_early_points
from train.choose.options import FitOptions, described
from train.choose.rows import fewest
from train.choose.settings import Settings
from train.data.broken import BrokenTaxels
from train.data.dataset import DataSet, read
from train.data.folds import representative
from train.data.groups import TRIAL, are_drawn
from train.data.leaks import leaks, without_copies
from train.data.tasks import labels_of_tasks, lacking
from train.data.vectors import Labels, Vectors
from train.fitted import Fitted
from train.model.pipeline import ContactClassifier
from train.model.prototypes import counts_tried, divided
from train.model.stopping import SequentialClassifier
from train.notes import warnings
from train.progress import Stage, announce, stages
from train.tune import Loaded, choosing_of, trials_of, window, windows_of

LOG = logging.getLogger(__name__)
FEWEST_TRIALS = 3
MOST_CHOSEN = 1000
"""Trials that settings are chosen by; the model has all. Accuracy on unseen objects does
not grow with more of them."""

PROGRAM_BYTES = 3.1e8
CHOSEN_BYTES = 1.5e5
TRIAL_BYTES = 15.5e3
MATRICES = 2.8
"""Memory of the program, of a trial that settings are chosen by, and of the facts of any
trial, and how many matrices of the vectors of a decision point there are at once: measured
with 140 to 100,000 trials."""


def memory_bytes(trials: int, columns: int) -> float:
    """About how much memory the largest process of a fit takes at most, by the columns
    of a vector."""
    chosen = CHOSEN_BYTES * min(trials, MOST_CHOSEN)
    return PROGRAM_BYTES + chosen + trials * (TRIAL_BYTES + MATRICES * 8 * columns)


def fit(data: DataSet | str | Path | Sequence[str | Path], **options: Any) -> Fitted:
    """Choose and fit every task of some recordings.

    Options you pass are held fixed. The others are chosen among the candidates of
    `train.choose.candidates`, as `train.choose.protocols` says: for tasks whose groups
    are held out together, by the accuracy with trials and with groups held out; for
    others each the smallest model within one standard error of the best in
    cross-validation (the best where there are fewer than 200 trials).

    Args:
        data: recordings, folders of them, or a data set that was loaded for the
            features.
        options: fields of `train.choose.options.FitOptions`, listed below.

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
    with stages(_seconds(data), fixed.progress) as stage:
        return _fitted(data, fixed, stage)


fit.__doc__ = f"{fit.__doc__}\nOptions:\n{described()}\n"


def _seconds(data: DataSet | str | Path | Sequence[str | Path]) -> dict[str, float]:
    """{stage of a fit: about how many seconds it takes of one processor}."""
    if isinstance(data, DataSet):
        count = len(data.trials)
    else:
        count = len(listed(map(str, [data] if isinstance(data, str | Path) else data)))
    return {
        "following": 2.0 + 0.03 * count,
        "choosing": 20.0 + 0.06 * min(count, MOST_CHOSEN),
        "calibrating": 15.0 + 0.02 * count,
    }


def _fitted(
    data: DataSet | str | Path | Sequence[str | Path], fixed: FitOptions, stage: Stage
) -> Fitted:
    """`fit`, stage by stage."""
    with stage("following"):
        loaded = load(data, fixed)
    y = labels_of_tasks(loaded.dataset, fixed.tasks)
    labels = [trial.labels for trial in loaded.dataset.trials]
    places = [str(trial.path) for trial in loaded.dataset.trials]
    if len(labels) < FEWEST_TRIALS:
        raise InputError(
            f"a fit needs at least {FEWEST_TRIALS} trials, not {len(labels)}; record more"
        )
    taught = representative(y, MOST_CHOSEN)
    few = {task: of_task[taught] for task, of_task in y.items()}
    untouched = loaded.dataset.untouched[:: len(labels) // len(taught)]
    sample = replace(loaded.dataset.part(taught), untouched=untouched)
    with stage("choosing"):
        settings, of_window = choose(replace(loaded, dataset=sample), few, fixed)
        settings = in_prototypes(settings, sample, y, fixed)
    settings = settings.with_others(taught, y)
    measured = loaded.dataset.with_kernels(settings.window_s)
    points, of_points = decision_points(measured, settings, fixed)
    if len(points) < 2:
        settings = replace(settings, early=None)
    dataset = measured.of(sorted(settings.features()))
    vectors = dataset.vectors(settings.window_s, fixed.samples, y)
    sequential = None
    if fixed.progress:
        of_folds = measured.of(sorted(settings.features(folds=True)))
        columns = sum(of_folds.widths(fixed.samples))
        needed = memory_bytes(len(labels), columns)
        announce(f"calibrating: about {needed / 1e9:.2g} GB of memory")
    with stage("calibrating"):
        if points:
            sequential = calibrate(measured, y, points, settings, fixed)
            classifier = sequential.decision_points_[-1]
        else:
            classifier = uncalibrated(vectors, settings)
    fitted = Fitted(
        dataset=dataset,
        measured=replace(sample, kernels=measured.kernels),
        window_s=settings.window_s,
        samples=fixed.samples,
        X=vectors.X,
        chosen=settings.chosen,
        candidates=tuple(settings.candidates),
        classifier=classifier,
        sequential=sequential,
    )
    notes = (
        *(f"warning: probably a slip: {text}" for text in slips(labels, places)),
        *lacking(loaded.dataset, fixed.tasks),
        *loaded.notes,
        *_of_unseen(settings, fixed),
        *leaks(sample, few),
        *of_points,
        *of_window,
        *too_few(labels),
        *warnings(fitted),
    )
    return replace(fitted, notes=notes)


def load(
    data: DataSet | str | Path | Sequence[str | Path], options: FitOptions
) -> Loaded:
    """The trials, with the features of every candidate and suitable thresholds."""
    windows: tuple[float, ...] = (options.fixed_window_s or WINDOW_S,)
    if isinstance(data, DataSet):
        return Loaded(data, windows, [])
    paths = [data] if isinstance(data, str | Path) else data
    readable = read(paths, progress=options.progress, skip_damaged=options.skip_damaged)
    recordings, notes = without_copies(readable)
    skipped = (f"warning: {error}; it is left out" for error in readable.damaged)
    notes = [*skipped, *notes]
    if options.fixed_window_s is None and not options.quick:
        seconds = [float(r.t[-1] - r.t[0]) for r in recordings.each()]
        windows = windows_of(seconds)
    loaded = trials_of(recordings, windows, options)
    taxels = BrokenTaxels()
    for recording in recordings.each():
        taxels.add(recording)
    notes += taxels.notes(loaded.dataset.layout)
    return replace(loaded, notes=[*notes, *loaded.notes])


def choose(
    loaded: Loaded, y: Labels, options: FitOptions
) -> tuple[Settings, list[str]]:
    """The settings of each task, and sentences on the window."""
    dataset = loaded.dataset
    choosing = choosing_of(dataset, y, options)
    windows = loaded.windows
    if len(windows) > 1:
        windows = windows_of(
            [float(t.recording.t[-1]) - t.onset_s for t in dataset.trials]
        )
    window_s, notes = window(choosing, windows, options.second_worth)
    settings = choosing.choose(window_s)
    if not options.quick and has_early_points(settings, options):
        early = choosing.early(window_s, settings.chosen)
        settings = replace(settings, early=early)
    return settings, notes


def in_prototypes(
    settings: Settings, sample: DataSet, y: Labels, options: FitOptions
) -> Settings:
    """The settings, with prototypes where a model of all trials would be large.

    Args:
        settings: chosen by a sample.
        sample: measured for every candidate.
        y: {task: (n,) labels} of all trials.
        options: of the fit.
    """
    counts = counts_tried(y)
    if not counts:
        return settings
    window_s = settings.window_s
    dataset = sample.with_kernels(window_s).of(sorted(settings.features()))
    points = 0.5 * window_s, window_s
    X = dataset.at_points(points, options.samples)
    few = {task: dataset.labels(task) for task in y}
    vectors = Vectors(X, few, dataset.names, dataset.widths(options.samples))
    early = {} if settings.early is None else settings.early.choices
    choices = [{**settings.choices, **early}, settings.choices]
    return settings.in_prototypes(fewest(choices, vectors, counts, options.processes))


def calibrate(
    measured: DataSet,
    y: Labels,
    points: tuple[float, ...],
    settings: Settings,
    options: FitOptions,
) -> SequentialClassifier:
    """A classifier for all decision points, with its stopping rules."""
    dataset = measured.of(sorted(settings.features(folds=True)))
    # Those of the model come first, so that they are no copy: see `Vectors.of`.
    exported = settings.features()
    names = sorted(dataset.names, key=lambda name: name not in exported)
    dataset = replace(dataset, names=tuple(names))
    at_points = dataset.at_points(points, options.samples)
    LOG.debug("calibrating by vectors (points, trials, columns) %s", at_points.shape)
    classifier = SequentialClassifier(
        settings.choices,
        points,
        dataset.names,
        jobs=options.processes,
        widths=dataset.widths(options.samples),
        early=settings.early,
        prototypes=settings.prototypes,
        drawn=are_drawn(dataset),
        heading="calibrating" * options.progress,
    )
    grouped = [t for t, chosen in settings.chosen.items() if chosen.held_out != TRIAL]
    return classifier.fit(at_points, y, settings.folds, settings.without, grouped)


def uncalibrated(vectors: Vectors, settings: Settings) -> ContactClassifier:
    """A classifier for the full window alone."""
    if settings.prototypes:
        at_end = replace(vectors, X=vectors.X[None])
        choices = [settings.choices]
        of_trials = divided(at_end, slice(None), choices, settings.prototypes, [{}])
        vectors = replace(vectors, prototypes=of_trials)
    return ContactClassifier.of(settings.choices, vectors)


def _of_unseen(settings: Settings, options: FitOptions) -> list[str]:
    """How to choose settings for recorded objects instead, where they are chosen for
    others."""
    held_out = {chosen.held_out for chosen in settings.chosen.values()}
    if options.quick or held_out == {TRIAL}:
        return []
    return [
        "the settings are chosen for unseen objects; `--leave-out trial` chooses "
        "them for the recorded ones"
    ]
