"""Recordings in folders: written, found, and changed by one program at a time.

A change of labels, or a deletion, is noted in a journal in each folder, then carried out.
Whatever reads a folder finishes it. In the end the journal becomes the note by which the
change is taken back.
"""

import json
import logging
import os
import shutil
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from edge.arrays import Array
from edge.errors import InputError, about
from edge.files import parsing, read_text, refusing
from edge.labels import Labels
from edge.recording import KEYS, Recording, checked, load, warn_of_another_unit
from edge.touch.thresholds import doubt
from edge.writing import lock, remove_leftovers, write_whole

LOG = logging.getLogger(__name__)
JOURNAL = ".edge-classify-labels.json"
"""The journal of a change that is not finished."""
UNDO = ".edge-classify-undo.json"
"""The note of the last change."""
DELETED = ".edge-classify-deleted"
"""The folder of recordings that were deleted last."""
LOOK_S = 0.02
LOOKS = 250
"""How often to look whether another program has ended."""


Pair = tuple[Labels | None, Labels | None]
"""The labels of a recording before and after a change; None where it is deleted."""


@dataclass(frozen=True)
class Change:
    """What changes in a folder: the labels of files, and whether this takes the last
    change back."""

    labels: dict[str, Pair] = field(default_factory=dict)
    undo: bool = False


def save(
    path: str | os.PathLike[str],
    recording: Recording,
    *,
    scale: float | None = None,
    overwrite: bool = True,
    lasting: bool = True,
) -> None:
    """Write a recording, whole or not at all; the same recording gives the same bytes.

    >>> import edge, numpy as np, tempfile
    >>> recording = edge.Recording(
    ...     np.array([0.0]), np.zeros((1, 16, 24), np.uint16), meta={"labels": {"object": "cup"}}
    ... )
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     edge.save(f"{folder}/cup.npz", recording)
    ...     edge.load(f"{folder}/cup.npz").labels
    {'object': 'cup'}

    Args:
        path: of the `.npz`.
        recording: frames of whole numbers of any type; flat ones (n, rows * cols) where
            `meta.skin` says the rows and columns.
        scale: counts of a unit of `frames` that are no counts; it is kept in
            `meta.scale`. Give all recordings of a data set the same.
        overwrite, lasting: see `write_whole`.

    A warning comes for times that do not seem to be in seconds, and names thresholds
    for a recording that has none, or whose first frame is above its onset.

    Raises:
        InputError: the recording breaks the contract, `path` cannot be written, or it
            exists and `overwrite` is False.
    """
    name = os.fspath(path)
    recording = checked(name, recording, scale)
    warn_of_another_unit(name, recording.t)
    skin = recording.meta.get("skin", {})
    why = doubt(recording.t, recording.frames, skin, recording.layout.onset)
    if why is not None and not recording.onsets_s:
        LOG.warning(f"{name}: {why}")
    if recording.shear is not None and "simulation" not in recording.meta:
        from edge.touch import shear  # few skins have three axes

        still = shear.doubt(recording.shear)
        if still is not None:
            LOG.warning(f"{name}: {still}")
    fields = {key: getattr(recording, key) for key in KEYS if key != "meta"}
    arrays = {key: array for key, array in fields.items() if array is not None}
    save_arrays(name, arrays, recording.meta, overwrite=overwrite, lasting=lasting)


def save_arrays(
    path: str | os.PathLike[str],
    arrays: dict[str, Array],
    meta: dict[str, Any],
    *,
    overwrite: bool = True,
    lasting: bool = True,
    compress: bool = False,
) -> None:
    """Write arrays and their JSON metadata as one `.npz`, whole or not at all."""
    try:
        text = json.dumps(meta, sort_keys=True, allow_nan=False, ensure_ascii=False)
    except (TypeError, ValueError, RecursionError) as error:
        raise InputError(
            f"{os.fspath(path)}: meta cannot be written as JSON: {error}"
        ) from None
    write = np.savez_compressed if compress else np.savez
    with write_whole(path, overwrite=overwrite, lasting=lasting) as file:
        write(file, meta=np.array(text), **arrays)  # type: ignore[arg-type]


def find(paths: Iterable[str]) -> list[Path]:
    """The `.npz` files named, and those in the folders named (sorted, folders within
    too), each once, after interrupted changes are finished.

    Raises:
        InputError: a folder holds no recording, or a change cannot be finished.
    """
    files: dict[Path, None] = {}
    for path in map(Path, paths):
        # Path.is_dir raises for a name that is too long.
        is_folder = os.path.isdir(path)
        parents = path.rglob(JOURNAL) if is_folder else [path]
        finish_interrupted({file.parent for file in parents})
        inside = recordings_in(path) if is_folder else [path]
        if not inside:
            raise InputError(f"{path}: no .npz recording in this folder")
        files |= dict.fromkeys(inside)
    return list(files)


def recordings_in(folder: Path) -> list[Path]:
    """The `.npz` files in a folder and in those within it, but for hidden ones, such as
    deleted recordings; sorted."""
    files = []
    for path in folder.rglob("*.npz"):
        names = path.relative_to(folder).parts
        if not any(name.startswith(".") for name in names):
            files.append(path)
    return sorted(files)


def finish_interrupted(folders: Iterable[Path]) -> None:
    """Wait for changes in folders that are under way, and finish interrupted ones.

    Raises:
        InputError: a change takes long, or cannot be finished.
    """
    with alone(folder for folder in folders if os.path.lexists(folder / JOURNAL)):
        pass


@contextmanager
def alone(folders: Iterable[Path]) -> Iterator[None]:
    """Let no other program change the folders' recordings during the block, and finish
    interrupted changes first.

    Raises:
        InputError: another program changes them, or a change cannot be finished.
    """
    with ExitStack() as stack:
        for folder in sorted({folder.resolve() for folder in folders}):
            with suppress(OSError):  # Windows opens no folder; others name what fails
                handle = os.open(folder, os.O_RDONLY)
                stack.callback(os.close, handle)
                _lock(handle, folder)
            remove_leftovers(folder)
            with about(f"{folder}: a change of labels was interrupted"):
                finished = len(_finish(folder))
            if finished:
                LOG.warning(
                    f"{folder}: finished a change of labels that was interrupted; "
                    f"recordings: {finished}"
                )
        yield


def _lock(handle: int, folder: Path) -> None:
    """Wait for other programs, and lock a folder.

    Raises:
        InputError: another program takes long.
    """
    for _ in range(LOOKS):
        with suppress(BlockingIOError):
            return lock(handle)
        time.sleep(LOOK_S)
    raise InputError(
        f"{folder}: another program is changing labels here; try again when it has ended"
    )


def _noted(note: Path) -> Change:
    """The change that a file tells of; an empty one without the file.

    Raises:
        InputError: the file is damaged.
    """
    if not note.is_file():
        return Change()
    text = read_text(note)
    with parsing(str(note), "a change of labels", "; delete it"):
        change = Change(**json.loads(text))
        labels = {}
        for file, (before, after) in change.labels.items():
            labels[Path(file).name] = before and dict(before), after and dict(after)
    return replace(change, labels=labels)


def _finish(folder: Path) -> list[Path]:
    """Do what a folder's journal says, if there is one, as far as it is not done yet;
    the recordings that changed."""
    changed = []
    journal = folder / JOURNAL
    change = _noted(journal)
    for file, (before, after) in change.labels.items():
        path = folder / file
        way = [path, folder / DELETED / file]
        source, goal = reversed(way) if before is None else way
        if not source.is_file():
            continue
        if before is None or after is None:
            goal.parent.mkdir(exist_ok=True)
            source.rename(goal)
            changed.append(path)
            continue
        recording = load(path)
        if recording.labels != after:
            save(path, replace(recording, meta={**recording.meta, "labels": after}))
            changed.append(path)
    if change.undo:
        (folder / UNDO).unlink(missing_ok=True)
        journal.unlink()
    elif change.labels:
        journal.replace(folder / UNDO)
    return changed


def _begin(changes: Mapping[Path, Change]) -> list[Path]:
    """Note what changes in each folder, and carry it out; the recordings that changed."""
    with ExitStack() as stack:  # all journals get their names one just after another
        for folder, change in changes.items():
            file = stack.enter_context(write_whole(folder / JOURNAL))
            file.write(json.dumps(vars(change)).encode())
    return [path for folder in changes for path in _finish(folder)]


def change_all(changes: Mapping[Path, Labels | None]) -> None:
    """Give recordings new labels, or delete those that get None: all of them, or a later
    start does.

    Call it in a block of `alone`.

    Raises:
        InputError: a recording cannot be read or written.
    """
    of_folder: dict[Path, Change] = {}
    for path in changes:
        change = of_folder.setdefault(path.parent, Change())
        change.labels[path.name] = load(path).labels, changes[path]
    for folder, change in of_folder.items():
        with refusing(f"{folder}: its recordings cannot be changed"):
            (folder / UNDO).unlink(missing_ok=True)
            shutil.rmtree(folder / DELETED, ignore_errors=True)
            if any(after is None for _, after in change.labels.values()):
                (folder / DELETED).mkdir()
    _begin(of_folder)


def take_back(folders: Iterable[Path]) -> list[Path]:
    """Take the last change in each folder back; the recordings that changed.

    Call it in a block of `alone`.

    Raises:
        InputError: by now, another recording has the name of a deleted one.
    """
    back: dict[Path, Change] = {}
    for folder in folders:
        labels = {}
        for file, (before, after) in _noted(folder / UNDO).labels.items():
            labels[file] = after, before
            if after is None and (folder / file).exists():
                raise InputError(
                    f"{folder / file}: exists again; rename it, and undo then"
                )
        if labels:
            back[folder] = Change(labels, undo=True)
    return _begin(back)
