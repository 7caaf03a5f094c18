"""Recordings in folders: written once, and found."""

import json
import logging
import os
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from edge.arrays import Array
from edge.errors import InputError
from edge.record.labels import LabelTable, read_table
from edge.record.recording import KEYS, Recording, checked, warn_of_another_unit
from edge.record.thresholds import doubt, shear_doubt
from edge.writing import write_whole

LOG = logging.getLogger(__name__)


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
        still = shear_doubt(recording.shear)
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


def listed(paths: Iterable[str]) -> list[Path]:
    """The `.npz` files named, and those in the folders named (sorted, folders within
    too), each once.

    Raises:
        InputError: a folder holds no recording.
    """
    files: dict[Path, None] = {}
    for path in map(Path, paths):
        # Path.is_dir raises for a name that is too long.
        inside = recordings_in(path) if os.path.isdir(path) else [path]
        if not inside:
            raise InputError(f"{path}: no .npz recording in this folder")
        files |= dict.fromkeys(inside)
    return list(files)


def find(paths: Iterable[str]) -> list[Path]:
    """The files of `listed` that no table leaves out.

    Warns of rows whose file is gone.

    Raises:
        InputError: a folder holds no recording, all are left out, or a table is damaged.
    """
    files = listed(paths)
    table_of = cache(read_table)
    out = []
    for file in files:
        row = table_of(file.parent).rows.get(file.name)
        if row is None or not row.left_out:
            out.append(file)
    if files and not out:
        raise InputError(
            f"{table_of(files[0].parent).path}: leaves every recording out"
        )
    warn_of_gone(files, table_of)
    return out


def warn_of_gone(files: Iterable[Path], table_of: Callable[[Path], LabelTable]) -> None:
    """Warn of rows in the tables of files whose own file is gone."""
    for folder in dict.fromkeys(file.parent for file in files):
        table = table_of(folder)
        gone = [file for file in table.rows if not os.path.lexists(folder / file)]
        if gone:
            others = f" (and {len(gone) - 1} more)" if len(gone) > 1 else ""
            LOG.warning(
                f"{table.path}, line {table.rows[gone[0]].line}: there is no {gone[0]} "
                f"here{others}; take the line out, or bring the file back"
            )


def recordings_in(folder: Path) -> list[Path]:
    """The `.npz` files in a folder and in those within it, but for hidden ones;
    sorted."""
    files = []
    for place, folders, names in os.walk(folder):
        folders[:] = [name for name in folders if not name.startswith(".")]
        files += [
            Path(place, name)
            for name in names
            if name.endswith(".npz") and not name.startswith(".")
        ]
    return sorted(files, key=lambda path: path.parts)
