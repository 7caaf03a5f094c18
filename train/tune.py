"""Threshold, release and window, each by one search above the choice of settings."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from edge.errors import InputError
from edge.features.vector import WINDOW_S
from edge.touch.layout import LONGEST_RELEASE_S
from train.choose.candidates import candidates, features_of
from train.choose.choose import Choosing
from train.choose.options import FitOptions
from train.data import thresholds
from train.data.contacts import NoContactFound
from train.data.dataset import DataSet, Measurement, Recordings, load_trials
from train.data.groups import Divisions, are_drawn, kinds_of
from train.data.labels import NO_CONTACT
from train.data.tasks import labels_of_tasks
from train.data.vectors import Labels

LOWER = (0.5, 0.25, 0.0)
"""Parts of the recorded thresholds that are tried where touches are missed."""
RELEASES_S = (1.0, 3.0)
"""Seconds that a contact may be away and go on. They are tried where touches are
fragmented, and so is the duration of the longest recording."""
MANY_FRAGMENTED = 0.1
"""Share of the trials with further contacts from which on longer releases are tried."""
FEWEST_GAINED = 1.5
"""Recordings that must be decided right more often."""
LONG_TOUCHES = 2.0
"""Longer windows are tried where half of the touches last so many windows."""
LONG_SHARE = 0.9
"""Share of the touches that may end before the longest window."""
LONGEST_WINDOW_S = 60.0
LAST_RATIO = 1.2
"""The longest window is tried where it is so much longer than the one before it."""
Value = TypeVar("Value")


@dataclass(frozen=True)
class Tuned(Generic[Value]):
    """The value that is taken, its accuracy, and that of the first value."""

    value: Value
    accuracy: float
    first: float


def tune(
    values: Sequence[Value],
    accuracy: Callable[[Value], float],
    recordings: int | None = None,
) -> Tuned[Value]:
    """The first value that decides about as many recordings right as the best.

    Args:
        values: in the order of preference.
        accuracy: of decisions with a value.
        recordings: the number that is decided. The first value stays where the others
            gain less than a standard error or a single recording; where None, any gain
            counts.
    """
    shares = np.array([accuracy(value) for value in values])
    first = float(shares[0])
    place = int(shares.argmax())
    if recordings is not None:
        gaps = recordings * (shares.max() - shares)
        error = np.sqrt(recordings * first * (1.0 - first))
        stays = gaps[0] <= max(error, FEWEST_GAINED)
        place = 0 if stays else int(np.argmax(gaps <= FEWEST_GAINED))
    return Tuned(values[place], float(shares[place]), first)


class Levels(NamedTuple):
    """What begins and ends a contact: counts, and seconds that it may be away; those of
    the skin where None."""

    threshold: int | None
    onset: int | None
    release_s: float | None


Load = Callable[[Levels], DataSet]
Accuracy = Callable[[Levels], float]


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


def features_tried(recordings: Recordings, options: FitOptions) -> tuple[str, ...]:
    """The features of all candidates for recordings."""
    settings = candidates(
        {},
        options,
        joints=recordings.mostly_have("joints"),
        shear=recordings.mostly_have("shear"),
        drawn=kinds_of(recordings.recordings) is not None,
    )
    return features_of(settings)


def choosing_of(dataset: DataSet, y: Labels, options: FitOptions) -> Choosing:
    """The choice of the settings of some trials.

    Raises:
        InputError: `k` is not possible where some of them are held out.
    """
    divisions = Divisions.of(dataset, y, options.leave_out, options.quick)
    most = divisions.fewest_left
    if options.k is not None and not 1 <= options.k <= most:
        raise InputError(
            f"k must be 1 to {most}, the trials that remain of "
            f"{len(divisions.folds)} where some are held out, not {options.k}"
        )
    settings = candidates(
        y,
        options,
        joints=dataset.joints > 0,
        shear=dataset.layout.axes is not None,
        drawn=are_drawn(dataset),
    )
    return Choosing(
        dataset,
        y,
        settings,
        divisions,
        options.samples,
        options.processes,
        options.progress,
    )


def trials_of(
    recordings: Recordings,
    windows: tuple[float, ...],
    options: FitOptions,
) -> Loaded:
    """The trials of recordings, up to the last of some windows, by thresholds that are
    given, saved, proposed or tuned."""
    measurement = Measurement(
        features_tried(recordings, options),
        windows[-1],
        arm=options.arm,
        dead=options.dead,
    )
    hasty = replace(options, quick=True, progress=False)

    @cache
    def load(levels: Levels) -> DataSet:
        return load_trials(
            recordings,
            replace(measurement, **levels._asdict()),
            partial=True,
            progress=options.progress,
            jobs=options.processes,
            cached=True,
        )

    def accuracy(levels: Levels) -> float:
        trials = load(levels)
        y = labels_of_tasks(trials, options.tasks)
        choosing = choosing_of(trials, y, hasty)
        return max(map(choosing.accuracy, {windows[0], windows[-1]}))

    levels = Levels(options.threshold, options.onset, options.release)
    notes: list[str] = []
    if options.threshold is None and options.onset is None:
        levels, notes = by_noise(recordings, levels, load)
        if not any("simulation" in r.meta for r in recordings.recordings):
            levels, lower = lower_thresholds(levels, load, accuracy)
            notes += lower
    if options.release is None:
        levels, longer = longer_release(levels, load, accuracy)
        notes += longer
    return Loaded(load(levels), windows, notes)


def by_noise(
    recordings: Recordings, levels: Levels, load: Load
) -> tuple[Levels, list[str]]:
    """The thresholds that the skin was saved with, or else those that its noise
    suggests, and the warning of these."""
    reason = "the skin was saved without thresholds"
    if "threshold_counts" in recordings.of_owner[0].meta.get("skin", {}):
        try:
            load(levels)
        except NoContactFound:
            reason = "no recording has a contact at its own thresholds"
        else:
            return levels, []
    proposal = thresholds.proposed(recordings.of_owner)
    warning = (
        f"warning: {reason}; a threshold of {proposal.threshold} and an onset of "
        f"{proposal.onset} counts come from {proposal.source}"
    )
    proposed = Levels(proposal.threshold, proposal.onset, levels.release_s)
    return proposed, [warning]


def lower_thresholds(
    levels: Levels, load: Load, accuracy: Accuracy
) -> tuple[Levels, list[str]]:
    """The most accurate thresholds, and sentences that say so. Lower ones are tried
    where a recording that is labelled with a touch shows none; they find a contact in
    any noise."""
    dataset = load(levels)
    threshold = dataset.layout.threshold_counts
    onset = dataset.layout.onset
    unfelt = sum(NO_CONTACT not in labels.values() for _, labels in dataset.untouched)
    if not unfelt or onset == 0:
        return levels, []
    lower = [
        Levels(round(part * threshold), round(part * onset), levels.release_s)
        for part in LOWER
    ]
    values = list(dict.fromkeys([levels, *lower]))
    tuned = tune(values, accuracy, _recordings(dataset))
    if tuned.value == levels:
        return levels, []
    return tuned.value, [
        f"the threshold is {tuned.value.threshold} and the onset {tuned.value.onset} "
        f"counts: at {threshold} and {onset} counts, {unfelt} recordings show no "
        f"contact; in cross-validation {tuned.accuracy:.1%} against {tuned.first:.1%} "
        "(--threshold and --onset set them)"
    ]


def longer_release(
    levels: Levels, load: Load, accuracy: Accuracy
) -> tuple[Levels, list[str]]:
    """The shortest release that decides about as many touches right as the best, and
    sentences that say so. Longer ones are tried where many touches are fragmented. A
    board that runs the model follows contacts alike."""
    dataset = load(levels)
    release_s = dataset.layout.release_s
    fragmented = len(dataset.unused)
    n = len(dataset.trials)
    if fragmented < MANY_FRAGMENTED * n:
        return levels, []
    times = (trial.recording.t for trial in dataset.each())
    longest_s = max(float(t[-1] - t[0]) for t in times)
    end_s = min(round(longest_s + 0.05, 1), LONGEST_RELEASE_S)
    longer_s = [s for s in sorted({*RELEASES_S, end_s}) if release_s < s <= end_s]
    values = [levels, *(levels._replace(release_s=s) for s in longer_s)]
    tuned = tune(values, accuracy, _recordings(dataset))
    if tuned.value == levels:
        return levels, []
    return tuned.value, [
        f"a contact lasts across gaps of up to {tuned.value.release_s:g} s, as "
        f"{fragmented} of {n} touches are fragmented: in cross-validation "
        f"{tuned.accuracy:.1%} against {tuned.first:.1%} with {release_s:g} s "
        "(--release sets it); on the robot let go for longer between two touches"
    ]


def _recordings(dataset: DataSet) -> int:
    return len(dataset.trials) + len(dataset.untouched)


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


def window(
    choosing: Choosing, windows: Sequence[float], second_worth: float
) -> tuple[float, list[str]]:
    """The window with the best mean accuracy of the tasks in plain cross-validation,
    less what the wait is worth.

    Args:
        choosing: gives the accuracies.
        windows: in seconds, rising.
        second_worth: accuracy that is worth a second of waiting.

    Returns:
        The window in seconds, and sentences that say why, and what a longer one gains.
    """
    if len(windows) == 1:
        return windows[0], []
    by_window = {seconds: choosing.shares(seconds) for seconds in windows}

    def worth(seconds: float) -> float:
        mean = float(np.mean(list(by_window[seconds].values())))
        return mean - second_worth * seconds

    window_s = tune(windows, worth).value
    accuracies = []
    gains = []
    for task, share in by_window[window_s].items():
        of_task = {seconds: by_window[seconds][task] for seconds in windows}
        listed = ", ".join(f"{a:.0%} at {s:g} s" for s, a in of_task.items())
        accuracies.append(f"{task} {listed}")
        best_s = max(windows, key=of_task.__getitem__)
        if best_s > window_s:
            gains.append(
                f"--window {best_s:g}: {task} {of_task[best_s]:.0%} instead of "
                f"{share:.0%} in cross-validation"
            )
    note = (
        f"the window is {window_s:g} s: a second of waiting counts as "
        f"{100 * second_worth:g} points of accuracy; in cross-validation "
    )
    return window_s, [f"{note}{'; '.join(accuracies)} (--window sets it)", *gains]
