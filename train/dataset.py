"""Recordings to feature vectors, by the edge's own path."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from edge.errors import InputError
from edge.recording import Recording, find, load
from edge.touch import measures
from edge.touch.arm import Chain
from edge.touch.contact import FeatureSeries
from edge.touch.features import FEATURES, SAMPLES, WINDOW_S, feature_vector
from edge.touch.layout import SkinLayout, for_device
from edge.touch.track import ContactTracker, TrackSettings, first_contact


@dataclass(frozen=True)
class Trial:
    """One recording's first contact."""

    path: Path
    recording: Recording
    onset_s: float
    series: FeatureSeries

    @property
    def labels(self) -> dict[str, str]:
        """{task: label}."""
        return self.recording.labels


@dataclass(frozen=True)
class DataSet:
    """Trials of one skin.

    Attributes:
        trials: in the order of the files' names.
        layout: the skin, with the thresholds that all trials were followed with.
        tracking: how contacts were followed.
        chain: the arm, where every trial has joint angles and a feature calls for them; motion
            is then in the world's frame.
        names: the features that were measured, by default the paper's three.
        untouched: recordings in which no contact was found.
        digest: SHA-256 over the recordings' bytes.
    """

    trials: tuple[Trial, ...]
    layout: SkinLayout
    tracking: TrackSettings
    chain: Chain | None
    untouched: tuple[Path, ...]
    digest: str
    names: tuple[str, ...] = FEATURES
    joints: int = 0
    """Joint angles of a frame, where a feature is made of them."""

    @property
    def tasks(self) -> tuple[str, ...]:
        """The keys that all trials' labels share, sorted."""
        shared = set.intersection(*(set(trial.labels) for trial in self.trials))
        return tuple(sorted(shared))

    def labels(self, task: str) -> NDArray[np.str_]:
        """(n,) the trials' labels for a task."""
        return np.array([trial.labels[task] for trial in self.trials])

    def features(
        self,
        window_s: float = WINDOW_S,
        samples: int = SAMPLES,
        names: Sequence[str] | None = None,
    ) -> NDArray[np.float64]:
        """(n, features * samples) feature vectors (see `edge.touch.features.feature_vector`).

        Args:
            window_s: seconds from onset.
            samples: times per feature.
            names: some of the features measured; all where None.
        """
        names = self.names if names is None else tuple(names)
        return np.stack([feature_vector(t.series, window_s, samples, names) for t in self.trials])

    @property
    def units(self) -> dict[str, str]:
        """Of each feature."""
        return {name: measures.feature(name).unit(self.layout) for name in self.names}


def arm_of(recording: Recording, where: str, unnamed: Chain | None = None) -> Chain | None:
    """The recording's arm: its `meta.arm`, else `unnamed`, else Cody's where it has five angles.

    None without joint angles.
    """
    if recording.joints is None:
        return None
    dof = recording.joints.shape[1]
    arm = recording.meta.get("arm")
    if "arm" in recording.meta and arm is None:
        return None  # the joints are not those of an arm that carries the skin
    if arm is not None:
        chain = Chain.from_dict(arm, where=f"{where}: meta.arm")
    elif unnamed is not None:
        chain = unnamed
    else:
        chain = Chain.cody()
        if dof != chain.dof or recording.joint_names not in (None, chain.names):
            raise InputError(f"{where}: has {dof} joint angles and names no arm; give --arm")
    if recording.joint_names is not None:
        recording.for_joints(chain.names, where)
    elif dof != chain.dof:
        raise InputError(f"{where}: has {dof} joint angles, its arm takes {chain.dof}")
    return chain


def _contents(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None


def _load_all(paths: list[Path], progress: bool) -> tuple[list[Recording], str]:
    digest = hashlib.sha256()
    recordings: list[Recording] = []
    bad: list[str] = []
    for path in tqdm(paths, desc="reading", unit=" trials", disable=not progress):
        try:
            contents = _contents(path)
            recordings.append(load(path, io.BytesIO(contents)))
            digest.update(contents)
        except InputError as error:
            bad.append(str(error))
    if bad:
        more = f" (and {len(bad) - 1} more files)" if len(bad) > 1 else ""
        raise InputError(f"{bad[0]}{more}; repair or remove it, nothing was fitted")
    return recordings, digest.hexdigest()


def load_trials(
    data: Sequence[str | Path],
    *,
    threshold: int | None = None,
    onset: int | None = None,
    tracking: TrackSettings | None = None,
    horizon_s: float = 2.0,
    features: Sequence[str] = FEATURES,
    arm: Chain | None = None,
    progress: bool = False,
) -> DataSet:
    """Read recordings and follow the first contact of each.

    Args:
        data: `.npz` files and folders of them.
        threshold: counts above which a taxel is in contact; the first recording's where None.
            One for all, as the board cannot know which object it touches.
        onset: counts above which a contact begins; scaled with the threshold where None.
        tracking: how contacts begin and end.
        horizon_s: seconds from onset that are kept of each contact.
        features: what is measured on each contact (see `edge.touch.measures`).
        arm: of recordings with joint angles that name none.
        progress: show progress bars on stderr.

    Raises:
        InputError: a file cannot be used, the skins differ, or nothing is labelled or touched.
    """
    names = tuple(feature.name for feature in measures.features(tuple(features)))
    moving = any(measures.feature(name).moves for name in names)
    paths = find([str(path) for path in data])
    if not paths:
        raise InputError("no recordings given; name .npz files or a folder of them")
    recordings, digest = _load_all(paths, progress)
    reference = recordings[0].layout
    if threshold is not None:
        begin = onset
        if begin is None:
            ratio = (
                reference.onset / reference.threshold_counts if reference.threshold_counts else 1
            )
            begin = round(threshold * ratio)
        reference = replace(reference, threshold_counts=threshold, onset_counts=begin)
    elif onset is not None:
        reference = replace(reference, onset_counts=onset)
    reference = replace(reference, dead=_dead(recordings))
    arms = [arm_of(r, str(p), arm) for r, p in zip(recordings, paths, strict=True)]
    recordings = [
        recording if of is None else recording.for_joints(of.names)
        for recording, of in zip(recordings, arms, strict=True)
    ]
    chain = arms[0] if moving and None not in arms else None
    if chain is not None:
        for other, path in zip(arms, paths, strict=True):
            if other is not None and other.to_dict() != chain.to_dict():
                raise InputError(f"{path}: its arm is not that of {paths[0]}; train on one arm")
    joints = 0
    if any(measures.feature(name).of_joints for name in names):
        joints = _joint_angles(recordings, paths)
    settings = tracking or TrackSettings()
    trials: list[Trial] = []
    untouched: list[Path] = []
    both = list(zip(recordings, paths, strict=True))
    for recording, path in tqdm(both, desc="following", unit=" trials", disable=not progress):
        try:
            layout = for_device(reference, recording.layout)
            tracker = ContactTracker(
                layout,
                settings,
                chain=chain,
                horizon_s=horizon_s,
                features=names,
                joints=joints,
            )
            found = first_contact(recording, tracker)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
        if found is None:
            untouched.append(path)
        else:
            trials.append(Trial(path, recording, *found))
    if not trials:
        raise InputError(
            f"no contact in any of {len(paths)} recordings; lower the threshold "
            f"of {reference.threshold_counts} counts"
        )
    dataset = DataSet(
        tuple(trials), reference, settings, chain, tuple(untouched), digest, names, joints
    )
    if not dataset.tasks:
        raise InputError(
            "the recordings share no label; give every one the same keys under meta.labels"
        )
    return dataset


def _joint_angles(recordings: list[Recording], paths: list[Path]) -> int:
    """How many every recording has."""
    counts = [0 if r.joints is None else r.joints.shape[1] for r in recordings]
    for count, path in zip(counts, paths, strict=True):
        if count == 0:
            raise InputError(f"{path}: has no joint angles; leave out the features made of them")
        if count != counts[0]:
            raise InputError(f"{path}: has {count} joint angles, {paths[0]} has {counts[0]}")
    return counts[0]


def _dead(recordings: list[Recording]) -> tuple[int, ...]:
    """Taxels that no frame of any recording could read."""
    shape = recordings[0].frames.shape[1:]
    alive = np.zeros(shape, dtype=bool)
    for recording in recordings:
        if recording.frames.shape[1:] != shape or recording.valid is None:
            return ()
        valid = recording.valid
        alive |= valid if valid.ndim == 2 else valid.any(axis=0)
    return tuple(np.flatnonzero(~alive).tolist())
