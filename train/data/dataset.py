"""Recordings to feature vectors, with the code that runs on the board."""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from itertools import compress
from operator import not_
from pathlib import Path
from typing import Any

import numpy as np
from joblib import delayed
from numpy.typing import NDArray

from edge.arrays import Floats
from edge.errors import InputError
from edge.features.kernels import KernelTable, kernel_channels
from edge.features.names import Feature, feature, feature_types
from edge.features.quantities import KERNELS
from edge.features.vector import FEATURES, SAMPLES, WINDOW_S, feature_vectors, widths
from edge.files import read_bytes
from edge.record.labels import read_table
from edge.record.npz import LARGEST_BYTES
from edge.record.recording import Recording, load
from edge.record.saving import find
from edge.touch.arm import Chain
from edge.touch.layout import SkinLayout
from train.data.arms import arm_of, joint_angles
from train.data.cache import prepared
from train.data.contacts import (
    LabelledFile,
    Named,
    Trial,
    collect,
    follow,
    with_thresholds,
)
from train.data.feature_sets import axes, moves, unit
from train.data.kernels import MOST_TOUCHES, kernel_table
from train.data.labels import shared_tasks
from train.data.scratch import Scratch
from train.data.vectors import Labels, Strings, Vectors
from train.progress import bar
from train.threads import in_processes


@dataclass(frozen=True)
class Recordings:
    """Recordings as read from their files.

    Attributes:
        paths: of the files, in their order.
        recordings: one a file.
        digest: SHA-256 over the files' bytes, and over labels that a table gives.
        damaged: a sentence on each file that could not be read.
        scratch: of their counts.
    """

    paths: tuple[Path, ...]
    recordings: tuple[Recording, ...]
    digest: str
    damaged: tuple[str, ...] = ()
    scratch: Scratch = field(default_factory=Scratch, compare=False, repr=False)

    def each(self) -> Iterator[Recording]:
        """The recordings, a few of them in memory at once."""
        return self.scratch.each(self.recordings)

    @property
    def of_owner(self) -> tuple[Recording, ...]:
        """Those that are not simulated; all where all are."""
        recordings = tuple(r for r in self.recordings if "simulation" not in r.meta)
        return recordings or self.recordings

    def mostly_have(self, part: str) -> bool:
        """Whether most of the owner's have `joints` or `shear`."""
        has = [getattr(recording, part) is not None for recording in self.of_owner]
        return bool(np.mean(has) > 0.5)

    def split(self, part: str) -> tuple[Recordings, tuple[Path, ...]]:
        """The recordings that have `joints` or `shear`, and the files of the others."""
        has = [getattr(recording, part) is not None for recording in self.recordings]
        return self.part(has), tuple(compress(self.paths, map(not_, has)))

    def part(self, mask: Sequence[bool]) -> Recordings:
        """Some of them, by a mask (n,)."""
        paths = tuple(compress(self.paths, mask))
        return replace(
            self, paths=paths, recordings=tuple(compress(self.recordings, mask))
        )


@dataclass(frozen=True)
class DataSet:
    """Trials of one skin.

    Attributes:
        trials: in the order of the files' names.
        layout: the skin, with the thresholds used for all trials.
        chain: the arm, where the trials have joint angles and a feature needs them;
            motion is then in the world's frame.
        untouched: recordings in which no contact was found, with their labels.
        digest: of the recordings, see `Recordings`.
        names: the features that were measured, by default the paper's three.
        joints: number of joint angles, where a feature is made of them; else 0.
        tasks: keys of the labels, sorted.
        left_out: {missing label or joint angles: recordings left out for lack of it}.
            Where each task is fitted on the trials that have it, those that lack it are
            left out of it alone.
        unused: recordings with more contacts than were used.
        kernels: {feature: its table} of the features that are made of kernels, see
            `with_kernels`.
        scratch: of the trials' series and features.
    """

    trials: tuple[Trial, ...]
    layout: SkinLayout
    chain: Chain | None
    untouched: tuple[LabelledFile, ...]
    digest: str
    names: tuple[str, ...]
    joints: int
    tasks: tuple[str, ...]
    left_out: dict[str, tuple[Path, ...]]
    unused: tuple[Path, ...]
    kernels: Mapping[str, KernelTable] = field(default_factory=dict)
    scratch: Scratch = field(default_factory=Scratch, compare=False, repr=False)

    def each(self) -> Iterator[Trial]:
        """The trials, the arrays of a few of them in memory at once."""
        return self.scratch.each(self.trials)

    def part(self, trials: NDArray[Any]) -> DataSet:
        """Some of the trials, by a mask (n,) or by their numbers."""
        numbers = np.arange(len(self.trials))[trials].tolist()
        # The same trials are the same tuple, so that features are measured once.
        if numbers == [*range(len(self.trials))]:
            return self
        return replace(self, trials=tuple(self.trials[i] for i in numbers))

    def untouched_labels(self, task: str) -> list[str]:
        """The labels for a task of the recordings in which no contact was found."""
        return [labels[task] for _, labels in self.untouched if task in labels]

    def groups(self, key: str) -> Strings | None:
        """(n,) each trial's value of a key in its labels or metadata; None where most
        lack it.

        Those that lack it are one group, as nobody knows which of them belong together.
        """
        values = [
            trial.labels.get(key, trial.recording.meta.get(key))
            for trial in self.trials
        ]
        if 2 * values.count(None) > len(values):
            return None
        return np.array(["" if value is None else str(value) for value in values])

    def widths(self, samples: int = SAMPLES) -> tuple[int, ...]:
        """Columns of each feature in `features`."""
        return widths(self.names, samples, self.layout, self.joints)

    def labels(self, task: str) -> Strings:
        """(n,) the trials' labels for a task; empty where a trial has none."""
        return np.array([trial.labels.get(task, "") for trial in self.trials])

    def features(
        self,
        window_s: float = WINDOW_S,
        samples: int = SAMPLES,
        names: Sequence[str] | None = None,
    ) -> Floats:
        """(n, features * samples) feature vectors (see
        `edge.features.vector.feature_vectors`), which may be in a file.

        Args:
            window_s: seconds from onset.
            samples: times per feature.
            names: some of the features measured; all where None.
        """
        names = self.names if names is None else tuple(names)
        keys = {
            name: (id(self.trials), window_s, samples, name, self.kernels.get(name))
            for name in names
        }
        tables = self.scratch.tables
        missing = [name for name in names if keys[name] not in tables]
        if missing:
            table: Floats = self.at_points((window_s,), samples, missing)[0]
            sizes = widths(missing, samples, self.layout, self.joints)
            columns = np.split(table, np.cumsum(sizes)[:-1], axis=1)
            # The trials stay beside their facts, so that no others get their id.
            for name, of_name in zip(missing, columns, strict=True):
                tables[keys[name]] = self.trials, of_name
            if missing == [*names]:
                return table
        return np.concatenate([tables[keys[name]][1] for name in names], axis=1)

    def at_points(
        self,
        points_s: Sequence[float],
        samples: int,
        names: Sequence[str] | None = None,
    ) -> Floats:
        """(points, n, p) feature vectors at several windows, in a file."""
        names = self.names if names is None else names
        size = sum(widths(names, samples, self.layout, self.joints))
        X = self.scratch.empty((len(points_s), len(self.trials), size))
        for i, trial in enumerate(self.each()):
            X[:, i] = feature_vectors(
                trial.series, points_s, samples, names, self.kernels
            )
        return X

    def vectors(self, window_s: float, samples: int, y: Labels) -> Vectors:
        """The feature vectors at a window, with the labels of some tasks."""
        X = self.features(window_s, samples)
        return Vectors(X, y, self.names, self.widths(samples))

    def with_kernels(self, window_s: float) -> DataSet:
        """The same trials with the tables that features of kernels need, for a window.

        A model has one table, of its full window, for all its decision points: at half
        of the window, tables of that window's own change the accuracy by less than its
        interval.
        """
        step = -(-len(self.trials) // MOST_TOUCHES)
        trials = self.trials[::step]
        tables = {
            name: kernel_table(
                [
                    kernel_channels(trial.series.felt(window_s), window_s, name)
                    for trial in self.scratch.each(trials)
                ],
                KERNELS[name],
                alike=name == "taxel_kernels",
            )
            for name in self.names
            if name in KERNELS
        }
        return replace(self, kernels=tables)

    def of(self, names: Sequence[str]) -> DataSet:
        """The same trials with some of the features measured, in the order of
        `self.names`."""
        measured_names = tuple(name for name in self.names if name in names)
        types = feature_types(measured_names)
        return replace(
            self,
            names=measured_names,
            layout=replace(self.layout, axes=axes(types)),
            chain=self.chain if any(map(moves, types)) else None,
            joints=self.joints if any(of.quantity.of_joints for of in types) else 0,
            kernels={
                name: table
                for name, table in self.kernels.items()
                if name in measured_names
            },
        )

    @property
    def units(self) -> dict[str, str]:
        """The unit of each feature."""
        return {name: unit(feature(name), self.layout) for name in self.names}


def read(
    data: Sequence[str | Path], *, progress: bool = False, skip_damaged: bool = False
) -> Recordings:
    """Read recordings, each file once.

    Args:
        data: `.npz` files and folders of them.
        progress: show a progress bar on stderr.
        skip_damaged: go on without the files that cannot be read.

    Raises:
        InputError: no file is named, or one cannot be used.
    """
    files = find([str(path) for path in data])
    if not files:
        raise InputError("no recordings given; name .npz files or a folder of them")
    digest = hashlib.sha256()
    paths: list[Path] = []
    recordings: list[Recording] = []
    damaged: list[str] = []
    scratch = Scratch()
    table_of = cache(read_table)
    for path in bar(files, desc="reading", disable=not progress):
        try:
            contents = read_bytes(path, LARGEST_BYTES)
            recording = load(path, io.BytesIO(contents), table_of)
        except InputError as error:
            if not skip_damaged:
                raise
            damaged.append(str(error))
            continue
        paths.append(path)
        recordings.append(scratch.put_fields(recording))
        digest.update(contents)
        if path.name in table_of(path.parent).rows:
            digest.update(json.dumps(recordings[-1].labels, sort_keys=True).encode())
    if not recordings:
        raise InputError(f"no recording can be used: {damaged[0]}")
    return Recordings(
        tuple(paths), tuple(recordings), digest.hexdigest(), tuple(damaged), scratch
    )


@dataclass(frozen=True)
class Measurement:
    """The measures that are taken of each contact.

    Attributes:
        features: names of the features (see `edge.features.names`).
        horizon_s: seconds from onset that are kept of each contact.
        threshold: counts above which a taxel is in contact; those of the first
            recording that is not simulated where None. All share it, as the board does
            not know which object it touches.
        onset: counts above which a contact begins; scaled with the threshold where
            None.
        release_s: seconds that a contact may be away and go on; those of the first
            recording where None.
        arm: for recordings with joint angles that name no arm.
        dead: (row, col) of taxels that are left out, beside those that no frame of any
            recording could read.
    """

    features: Sequence[str] = FEATURES
    horizon_s: float = 2.0
    threshold: int | None = None
    onset: int | None = None
    release_s: float | None = None
    arm: Chain | None = None
    dead: Sequence[tuple[int, int]] = ()

    @cached_property
    def types(self) -> tuple[Feature, ...]:
        """The features."""
        return feature_types(tuple(self.features))

    @property
    def moves(self) -> bool:
        """Whether a feature is measured in the world's frame."""
        return any(map(moves, self.types))

    @property
    def of_joints(self) -> bool:
        """Whether a feature is made of joint angles."""
        return any(of.quantity.of_joints for of in self.types)

    def layout(self, data: Recordings) -> SkinLayout:
        """The skin of recordings, as it is measured.

        Raises:
            InputError: a dead taxel lies outside of it.
        """
        skin = with_thresholds(data.of_owner[0].layout, self.threshold, self.onset)
        release_s = skin.release_s if self.release_s is None else self.release_s
        dead = set(_dead(data))
        for row, col in self.dead:
            if row >= skin.rows or col >= skin.cols:
                raise InputError(
                    f"--dead {row},{col} lies outside of the skin, which has "
                    f"{skin.rows} x {skin.cols} taxels, counted from 0"
                )
            dead.add(row * skin.cols + col)
        return replace(
            skin, dead=tuple(sorted(dead)), axes=axes(self.types), release_s=release_s
        )


USUAL = Measurement()
"""The paper's three features, at the recorded thresholds."""


def load_trials(
    data: Recordings | Sequence[str | Path],
    measurement: Measurement = USUAL,
    *,
    partial: bool = False,
    progress: bool = False,
    jobs: int = 1,
    cached: bool = False,
) -> DataSet:
    """Follow the contacts of recordings.

    A recording's first contact is a trial, with the recording's labels. Where
    `meta.contacts` is "alike", each of its contacts is a trial with these labels. Where
    it is a list of labels, they belong to the contacts in their order. Labels that
    follow from others are added (`train.data.labels.completed`). Recordings that lack a
    label, or joint angles that a feature needs, are left out and named in `left_out`,
    if most recordings have it; so are those whose labels contradict each other.

    Args:
        data: recordings, or `.npz` files and folders of them.
        measurement: of each contact.
        partial: keep trials that have a label for some task.
        progress: show progress bars on stderr.
        jobs: processes.
        cached: keep the contacts beside the recordings, for the next time.

    Raises:
        InputError: a file cannot be used, the skins differ, or nothing is labelled or
            touched.
    """
    recordings = data if isinstance(data, Recordings) else read(data, progress=progress)
    layout = measurement.layout(recordings)
    recordings, without_shear = with_shear(recordings, layout)
    posed = with_poses(recordings, measurement)
    names = tuple(feature.name for feature in measurement.types)
    tracked = {
        "chain": posed.chain,
        "horizon_s": measurement.horizon_s,
        "features": names,
        "joints": posed.joints,
    }
    places: dict[Path, Path] = {}
    if cached:
        places = prepared(path.parent for _, path in posed.recordings)
    work = [
        delayed(follow)(
            recording, path, layout, place=places.get(path.parent), **tracked
        )
        for recording, path in posed.recordings
    ]
    scratch = recordings.scratch
    trials = (
        ([(onset_s, scratch.put_fields(series)) for onset_s, series in touches], labels)
        for touches, labels in in_processes(jobs, work, "following" * progress)
    )
    touched = collect(posed.recordings, trials, layout).completed()
    tasks = shared_tasks(touched.labels, partial=partial)
    labelled = touched.labelled(tasks, partial=partial)
    left_out = touched.left_out(tasks)
    left_out |= {"joint angles": posed.without_joints, "shear": without_shear}
    return DataSet(
        trials=labelled.trials,
        layout=layout,
        chain=posed.chain,
        untouched=labelled.untouched,
        digest=recordings.digest,
        names=names,
        joints=posed.joints,
        tasks=tasks,
        left_out={need: paths for need, paths in left_out.items() if paths},
        unused=touched.unused,
        scratch=scratch,
    )


def with_shear(
    data: Recordings, layout: SkinLayout
) -> tuple[Recordings, tuple[Path, ...]]:
    """The recordings that have the shear that a layout asks for, and the other files.

    Raises:
        InputError: none has it.
    """
    if layout.axes is None:
        return data, ()
    sheared, without = data.split("shear")
    if not sheared.paths:
        raise InputError("no recording has shear, which the features need")
    return sheared, without


@dataclass(frozen=True)
class Posed:
    """The recordings that have the joint angles that the features need.

    Attributes:
        recordings: with their files; the angles are in the arm's order.
        chain: the arm, where motion is measured in its base's frame.
        joints: number of joint angles, where a feature is made of them.
        without_joints: files that are left out, as they have no angles.
    """

    recordings: list[Named]
    chain: Chain | None
    joints: int
    without_joints: tuple[Path, ...]


def with_poses(data: Recordings, measurement: Measurement) -> Posed:
    """Leave out recordings without joint angles, where most have them.

    Raises:
        InputError: the recordings have several arms.
    """
    without: tuple[Path, ...] = ()
    if data.mostly_have("joints") and (measurement.of_joints or measurement.moves):
        data, without = data.split("joints")
    named: list[Named] = []
    arms: list[Chain | None] = []
    for recording, path in zip(data.recordings, data.paths, strict=True):
        chain = arm_of(recording, str(path), measurement.arm)
        arms.append(chain)
        if chain is not None:
            recording = recording.for_joints(chain.names)
        named.append((recording, path))
    chain = arms[0] if measurement.moves and None not in arms else None
    if chain is not None:
        require_one_arm(named, arms, chain)
    joints = joint_angles(named) if measurement.of_joints else 0
    return Posed(named, chain, joints, without)


def require_one_arm(
    recordings: Sequence[Named],
    arms: Sequence[Chain | None],
    chain: Chain,
) -> None:
    """Refuse recordings of an arm that differs from the first one's.

    Raises:
        InputError: one does; the sentence names it.
    """
    for arm, (_, path) in zip(arms, recordings, strict=True):
        if arm is not None and arm.to_dict() != chain.to_dict():
            raise InputError(
                f"{path}: its arm is not that of {recordings[0][1]}; train on one arm"
            )


def _dead(data: Recordings) -> tuple[int, ...]:
    """Taxels that no frame of any recording could read."""
    shape = data.recordings[0].frames.shape[1:]
    alive = np.zeros(shape, dtype=bool)
    for recording in data.each():
        if recording.frames.shape[1:] != shape or recording.valid is None:
            return ()
        alive |= recording.valid.reshape(-1, *shape).any(axis=0)
    return tuple(np.flatnonzero(~alive).tolist())
