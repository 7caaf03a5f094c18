"""Recordings written: files of one trial each."""

import json
import logging
import os
from typing import Any

import numpy as np

from edge.arrays import Array
from edge.errors import InputError
from edge.recording import KEYS, Recording, checked, warn_of_another_unit
from edge.touch.thresholds import doubt
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
    if why is not None:
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
