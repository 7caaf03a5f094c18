"""The contacts of recordings, and the trials that they are."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from edge.errors import InputError
from edge.features.names import measures
from edge.record.recording import Recording
from edge.touch.contact import Contact, FeatureSeries
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout, for_device
from edge.touch.track import ContactTracker
from train.data.cache import Contacts, contacts_of
from train.data.labels import completed, contradictory, labels_of

Named = tuple[Recording, Path]
"""A recording and its file."""


@dataclass(frozen=True)
class Trial:
    """One contact of a recording: its first, or each of them where the recording says
    so."""

    path: Path
    recording: Recording
    labels: dict[str, str]
    onset_s: float
    series: FeatureSeries


LabelledFile = tuple[Path, dict[str, str]]
"""A recording's file, and {task: label}."""


class NoContactFound(InputError):
    """No recording has a contact at the thresholds."""


@dataclass(frozen=True)
class Touched:
    """The contacts of recordings.

    Attributes:
        trials: one for each contact that has labels.
        untouched: files without a contact, with their labels.
        unused: files with more contacts than labels.
    """

    trials: tuple[Trial, ...]
    untouched: tuple[LabelledFile, ...]
    unused: tuple[Path, ...]

    @property
    def files(self) -> list[LabelledFile]:
        """The file and the labels of each trial, and of the untouched."""
        files = [(trial.path, trial.labels) for trial in self.trials]
        return [*files, *self.untouched]

    @property
    def labels(self) -> list[dict[str, str]]:
        """The labels of each trial, and of the untouched."""
        return [labels for _, labels in self.files]

    def completed(self) -> Touched:
        """The same contacts with the labels that follow from their others."""
        labels = iter(completed(self.labels))
        trials = [replace(trial, labels=next(labels)) for trial in self.trials]
        untouched = [(path, next(labels)) for path, _ in self.untouched]
        return Touched(tuple(trials), tuple(untouched), self.unused)

    def left_out(self, tasks: Sequence[str]) -> dict[str, tuple[Path, ...]]:
        """{what is lacking: the files that lack it, each once}: a label for a task, or a
        category that is no contradiction."""
        odd = contradictory(self.labels)
        lacking = {
            "a category that agrees with softness and mobility": [
                path for path, labels in self.files if labels in odd
            ]
        }
        for task in tasks:
            lacking[f"a label for {task}"] = [
                path for path, labels in self.files if task not in labels
            ]
        return {need: tuple(dict.fromkeys(paths)) for need, paths in lacking.items()}

    def labelled(self, tasks: Sequence[str], *, partial: bool) -> Touched:
        """The contacts that have a label for each task; `partial`, for some. Those with
        contradictory labels are left out.

        Raises:
            InputError: no trial has.
        """
        enough = any if partial else all
        odd = contradictory(self.labels)

        def suffices(labels: dict[str, str]) -> bool:
            return labels not in odd and enough(task in labels for task in tasks)

        trials = tuple(trial for trial in self.trials if suffices(trial.labels))
        if not trials:
            raise InputError(f"no recording has a label for each of {', '.join(tasks)}")
        untouched = tuple(file for file in self.untouched if suffices(file[1]))
        return Touched(trials, untouched, self.unused)


def collect(
    recordings: Sequence[Named],
    followed: Iterable[Followed],
    layout: SkinLayout,
) -> Touched:
    """The trials of recordings whose contacts were followed.

    Raises:
        NoContactFound: no recording has a contact.
    """
    trials: list[Trial] = []
    untouched = []
    unused = []
    for (recording, path), (touches, labels) in zip(recordings, followed, strict=True):
        if not touches:
            untouched.append((path, recording.labels))
        if len(touches) > len(labels):
            unused.append(path)
        for trial_labels, touch in zip(labels, touches, strict=False):
            trials.append(Trial(path, recording, trial_labels, *touch))
    if not trials:
        raise NoContactFound(
            f"no contact in any of {len(recordings)} recordings; lower the threshold "
            f"of {layout.threshold_counts} counts"
        )
    return Touched(tuple(trials), tuple(untouched), tuple(unused))


Followed = tuple[Contacts, list[dict[str, str]]]
"""The contacts of a recording, and the labels of those that are trials."""


def follow(
    recording: Recording,
    path: Path,
    layout: SkinLayout,
    features: Sequence[str],
    joints: int = 0,
    place: Path | None = None,
    **tracked: Any,
) -> Followed:
    """The contacts of a recording, and the labels of those that are trials; entries of
    the cache lie at a place, or nowhere."""
    try:
        layout = for_device(layout, recording.layout)

        def touched() -> Contacts:
            measured = measures(layout, features, joints)
            tracker = ContactTracker(layout, measures=measured, **tracked)
            tracker.outside = recording.meta.get("onset") is not None
            return contacts(recording, tracker)

        chain = tracked.get("chain")
        how = features, joints, chain and chain.to_dict(), tracked.get("horizon_s")
        touches = contacts_of(place, recording, layout, how, touched)
        return touches, labels_of(recording, len(touches))
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def contacts(frames: Iterable[Frame], tracker: ContactTracker) -> Contacts:
    """Onset in seconds and series of every contact of a recording, in their order."""
    followed: dict[int, Contact] = {}
    for frame in frames:
        followed |= {id(contact): contact for contact in tracker.push(frame)}
    return [(contact.onset_s, contact.series()) for contact in followed.values()]


def with_thresholds(
    layout: SkinLayout,
    threshold: int | None,
    onset: int | None,
) -> SkinLayout:
    """The skin with these thresholds; one that is None stays, or scales with the
    other."""
    if threshold is not None:
        ratio = layout.onset / layout.threshold_counts if layout.threshold_counts else 1
        begin = round(threshold * ratio) if onset is None else onset
        return replace(layout, threshold_counts=threshold, onset_counts=begin)
    return layout if onset is None else replace(layout, onset_counts=onset)
