"""The settings that a fit holds fixed, and the trials that it then measures."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

from joblib import cpu_count

from edge.errors import InputError
from edge.features.vector import SAMPLES
from edge.touch.arm import Chain
from train.choose.candidates import CHOOSE_ALL, Fixed, candidates, features_of
from train.choose.choose import SECOND_WORTH, Choosing
from train.data import pieces, thresholds
from train.data.contacts import Untouched
from train.data.dataset import DataSet, Measurement, Recordings, load_trials
from train.data.groups import LEAVE_OUT, Divisions, are_drawn, kinds_of
from train.data.tasks import labels_of_tasks
from train.data.vectors import Labels


@dataclass(frozen=True, kw_only=True)
class FitOptions(Fixed):
    """The settings that a fit holds fixed; it chooses the others."""

    window_s: float | None = None
    second_worth: float = SECOND_WORTH
    samples: int = SAMPLES
    tasks: Sequence[str] | None = None
    leave_out: str = LEAVE_OUT
    decision_points_s: Sequence[float] | None = None
    threshold: int | None = None
    onset: int | None = None
    release: float | None = None
    arm: Chain | None = None
    dead: Sequence[tuple[int, int]] = ()
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
        tried = candidates(
            y,
            self,
            joints=dataset.joints > 0,
            shear=dataset.layout.axes is not None,
            drawn=drawn,
            quick=self.quick,
        )
        return Choosing(
            dataset,
            y,
            tried,
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


def features_tried(
    recordings: Recordings, fixed: Fixed = CHOOSE_ALL, *, quick: bool
) -> tuple[str, ...]:
    """The features of all candidates for recordings."""
    usual = candidates(
        {},
        fixed,
        joints=recordings.mostly_have("joints"),
        shear=recordings.mostly_have("shear"),
        drawn=kinds_of(recordings.recordings) is not None,
        quick=quick,
    )
    return features_of(usual)


def trials_of(
    recordings: Recordings,
    windows: tuple[float, ...],
    options: FitOptions,
) -> Loaded:
    """The trials of recordings, up to the last of some windows, by thresholds that are
    given, saved, proposed or chosen."""
    features = features_tried(recordings, options, quick=options.quick)
    measurement = Measurement(features, windows[-1], arm=options.arm, dead=options.dead)

    def by(
        threshold: int | None,
        onset: int | None,
        release_s: float | None = options.release,
    ) -> DataSet:
        return load_trials(
            recordings,
            replace(measurement, threshold=threshold, onset=onset, release_s=release_s),
            partial=True,
            progress=options.progress,
            jobs=options.processes,
        )

    def accuracy(trials: DataSet) -> float:
        hasty = replace(options, quick=True, progress=False)
        y = labels_of_tasks(trials, options.tasks)
        choosing = hasty.choosing(trials, y, drawn=are_drawn(trials))
        return max(map(choosing.accuracy, {windows[0], windows[-1]}))

    notes: list[str] = []
    if options.threshold is not None or options.onset is not None:
        dataset = by(options.threshold, options.onset)
    else:
        dataset, notes = _by_noise(recordings, by)
        if not any("simulation" in r.meta for r in recordings.recordings):
            dataset, lower = thresholds.chosen(dataset, by, accuracy)
            notes += lower
    if options.release is None:
        layout = dataset.layout
        longer = partial(by, layout.threshold_counts, layout.onset)
        dataset, across = pieces.joined(dataset, longer, accuracy)
        notes += across
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
