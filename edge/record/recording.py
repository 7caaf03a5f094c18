"""A recording: the frames, joint angles and metadata of one trial, in one `.npz`
file."""

import logging
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, BinaryIO, Self

import numpy as np
from numpy.typing import NDArray

from edge.arrays import Array, Booleans, Counts, Floats
from edge.config import ConfigTable
from edge.errors import InputError, about
from edge.record.counts import as_counts, in_rows
from edge.record.labels import LabelTable, plain, read_table
from edge.record.npz import load_arrays, load_meta
from edge.touch.frame import ONSETS, Frame
from edge.touch.joint_angles import joint_columns
from edge.touch.layout import SkinLayout

SLOWEST_HZ = 2.0
FASTEST_HZ = 5000.0
"""Frame rates outside these limits are probably times in another unit."""
LOG = logging.getLogger(__name__)
KEYS = ("t", "frames", "joints", "valid", "shear", "meta")
PARTS = [f"{key}.npy" for key in KEYS]


@dataclass(frozen=True)
class Recording:
    """One trial; iterating over it gives its frames as the live skin would have.

    >>> import edge, numpy as np
    >>> recording = edge.Recording(np.array([0.0, 0.01]), np.zeros((2, 16, 24), np.uint16))
    >>> [frame.t for frame in recording]
    [0.0, 0.01]

    Attributes:
        t: (n,) seconds that never decrease; of several frames at one time, the last
            counts.
        frames: (n, rows, cols) counts above baseline.
        joints: (n, dof) radians, NaN in a frame whose pose was not known; None without
            an arm.
        valid: (rows, cols) or (n, rows, cols), True where a taxel could be read; None
            if all could.
        meta: `labels` {task: label}, `skin` (see `SkinLayout`), `joint_names` [name of
            each column of `joints`], `onset` {`source`: first or event, `times_s`:
            [seconds]} where the skin does not tell it, `source`, `trial`, and any other
            facts.
        shear: (n, rows, cols, 2) counts along the rows (elbow to wrist) and around the
            columns, of the scale of `frames`; None on a skin of one axis.
    """

    t: Floats
    frames: Counts
    joints: Floats | None = None
    valid: Booleans | None = None
    meta: dict[str, Any] = field(default_factory=dict)
    shear: NDArray[np.int16] | None = None

    @property
    def labels(self) -> dict[str, str]:
        """{task: label}; empty if the trial is not labelled."""
        return dict(self.meta.get("labels", {}))

    @property
    def layout(self) -> SkinLayout:
        """The skin with which the trial was recorded."""
        _, rows, cols = self.frames.shape
        skin = {"rows": rows, "cols": cols, **self.meta.get("skin", {})}
        if self.shear is not None:
            skin["axes"] = 3
        return SkinLayout.from_dict(skin)

    @property
    def joint_names(self) -> tuple[str, ...] | None:
        """The joint of each column of `joints`, or None if the names are unknown."""
        names = self.meta.get("joint_names")
        return None if names is None else tuple(names)

    @property
    def onsets_s(self) -> list[float]:
        """Seconds at which touches begin, where something other than the skin told it."""
        onset = self.meta.get("onset") or {"times_s": []}
        return list(onset["times_s"])

    @property
    def dof(self) -> int | None:
        """Number of joint angles in a frame, or None without any."""
        return None if self.joints is None else self.joints.shape[1]

    def for_joints(self, names: Sequence[str], where: str = "recording") -> Self:
        """The recording with the angles of these joints, in this order.

        A recording that does not name its joints is returned as it is.

        Raises:
            InputError: the recording lacks one of the joints; the message begins with
                `where`.
        """
        if self.joints is None or self.joint_names in (None, tuple(names)):
            return self
        with about(where):
            columns = joint_columns(self.joint_names or (), names)
        meta = {**self.meta, "joint_names": list(names)}
        return replace(self, joints=self.joints[:, columns], meta=meta)

    def __iter__(self) -> Iterator[Frame]:
        """Iterate over the frames as the live skin would give them."""
        onsets = set(np.searchsorted(self.t, self.onsets_s).tolist())
        for i, t in enumerate(self.t.tolist()):
            valid = self.valid
            if valid is not None and valid.ndim == 3:
                valid = valid[i]
            joints = None if self.joints is None else self.joints[i]
            if joints is not None and np.isnan(joints[0]):
                joints = None
            shear = None if self.shear is None else self.shear[i]
            yield Frame(
                t,
                self.frames[i],
                valid,
                joints=joints,
                shear=shear,
                onset=i in onsets,
            )


def checked(path: str, recording: Recording, scale: float | None = None) -> Recording:
    """The recording in the types of the contract.

    Whole numbers of any type become uint16 counts, flat frames get the skin's rows and
    columns, times and angles become float64, and labels that are whole numbers become
    text.

    Args:
        path: names the recording in errors.
        recording: to convert and check.
        scale: see `save`.

    Raises:
        InputError: the recording breaks the contract.
    """
    with about(path):
        meta = dict(recording.meta)
        if scale is not None and recording.frames.dtype.kind in "iuf":
            meta["scale"] = scale
        skin = meta.get("skin", {})
        if not isinstance(skin, dict):
            raise InputError("meta.skin must be an object")
        frames = _frames(recording.frames, skin, scale)
    rows, cols = frames.shape[1:]
    layout = SkinLayout.from_dict({"rows": rows, "cols": cols, **skin}, where=path)
    with about(path):
        if layout.shape != (rows, cols):
            raise InputError(
                f"meta.skin says {layout.rows} x {layout.cols} taxels, frames are "
                f"{rows} x {cols}"
            )
        t = _times(recording.t, len(frames))
        joints = _joints(recording.joints, len(frames))
        if recording.valid is not None:
            _typed("valid", recording.valid, np.bool_, (rows, cols), frames.shape)
        if recording.shear is not None:
            _typed("shear", recording.shear, np.int16, (*frames.shape, 2))
        elif layout.axes:
            raise InputError("meta.skin says axes = 3, but shear is missing")
        if "labels" in meta:
            meta["labels"] = read_labels(path, meta["labels"])
        _check_meta(meta, joints)
    return Recording(t, frames, joints, recording.valid, meta, recording.shear)


def _typed(
    name: str,
    values: Any,
    dtype: type,
    *shapes: tuple[int, ...],
) -> Array:
    """An array that must have a type and one of some shapes; floats become float64."""
    array: Array = np.asarray(values)
    if array.dtype.kind == "f":
        array = array.astype(np.float64)
    if array.dtype != dtype or array.shape not in shapes:
        expected = f"{np.dtype(dtype)} {' or '.join(map(str, shapes))}"
        raise InputError(f"{name} must be {expected}, not {array.dtype} {array.shape}")
    return array


def _frames(
    values: Any,
    skin: Mapping[str, Any],
    scale: float | None,
) -> Counts:
    """The counts (n, rows, cols) of at least one frame."""
    frames: Array = np.asarray(values)
    if frames.dtype.kind in "iuf" and (frames.dtype != np.uint16 or scale is not None):
        frames = as_counts(frames, scale)
    if frames.ndim == 2:
        frames = in_rows(frames, skin.get("rows"), skin.get("cols"))
    if frames.dtype != np.uint16 or frames.ndim != 3:
        raise InputError(
            f"frames must be uint16 counts (n, rows, cols), not {frames.dtype} "
            f"{frames.shape}"
        )
    if 0 in frames.shape:
        raise InputError(f"frames are empty {frames.shape}; record at least one frame")
    return frames


def _times(values: Any, frames: int) -> Floats:
    """Finite times (frames,) that never go back."""
    t = _typed("t", values, np.float64, (frames,))
    finite = np.isfinite(t)
    if not finite.all():
        raise InputError(
            f"t of frame {int(finite.argmin())} is not finite; repair the clock"
        )
    backwards = np.flatnonzero(t[1:] < t[:-1])
    if backwards.size:
        raise InputError(
            f"time goes back at frame {backwards[0] + 1}; sort the frames or split the "
            "recording"
        )
    return t


def _joints(values: Any, frames: int) -> Floats | None:
    """Joint angles (frames, dof), all NaN in a frame whose pose is not known."""
    if values is None:
        return None
    shape = np.shape(values)
    dof = max(shape[1], 1) if len(shape) == 2 else 1
    joints = _typed("joints", values, np.float64, (frames, dof))
    missing = np.isnan(joints)
    odd = (np.isinf(joints) | (missing != missing[:, :1])).any(axis=1)
    if odd.any():
        raise InputError(
            f"a joint angle of frame {int(np.argmax(odd))} is not finite; in a frame "
            "without a known pose, all angles must be NaN"
        )
    return joints


def _are_names(texts: Any) -> bool:
    return isinstance(texts, list) and all(
        isinstance(text, str) and text for text in texts
    )


def read_labels(path: str, values: Any) -> dict[str, str]:
    """{task: label} of a file's metadata; labels that are whole numbers become text.

    Raises:
        InputError: they are no names.
    """
    labels = dict(values) if isinstance(values, dict) else {"": ""}
    for task, label in labels.items():
        if type(label) is int or isinstance(label, np.integer):
            labels[task] = str(label)
    names = [*labels, *labels.values()]
    if not _are_names(names):
        raise InputError(
            "meta.labels and meta.contacts must map task names to labels, both text"
        )
    if not all(name.isprintable() and name == name.strip() for name in names):
        return plain(labels, path)
    return labels


def _check_meta(meta: Mapping[str, Any], joints: Floats | None) -> None:
    if meta.get("joint_names") is not None:
        _check_joint_names(meta["joint_names"], joints)
    if meta.get("onset") is not None:
        onset = ConfigTable(meta["onset"], "meta.onset")
        onset.choice("source", ONSETS)
        onset.numbers("times_s")


def _check_joint_names(names: Any, joints: Floats | None) -> None:
    if not _are_names(names) or len(set(names)) < len(names):
        raise InputError("meta.joint_names must be a list of different names")
    dof = 0 if joints is None else joints.shape[1]
    if len(names) != dof:
        raise InputError(
            f"the number of meta.joint_names is {len(names)}, of joint angles {dof}"
        )


def read_meta(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The metadata of a recording alone, with the labels that it was recorded with.

    Raises:
        InputError: as `load`.
    """
    name = os.fspath(path)
    meta = load_meta(name, load_arrays(name, keys=("meta",), allowed=PARTS))
    with about(name):
        return {**meta, "labels": read_labels(name, meta.get("labels", {}))}


def load(
    path: str | os.PathLike[str],
    file: BinaryIO | None = None,
    table_of: Callable[[Path], LabelTable] = read_table,
) -> Recording:
    """Read a recording, with the labels that the table beside it says.

    >>> import edge
    >>> from edge import demo
    >>> recording = edge.load(demo.FOLDER / "pillow-movable.npz")
    >>> recording.labels["object"], recording.frames.shape[1:]
    ('pillow', (16, 24))

    Times that do not seem to be in seconds give a warning.

    Args:
        path: of the `.npz`, which sentences name.
        file: its contents, where they have been read already.
        table_of: gives a folder's table; `cache(read_table)` reads each once.

    Raises:
        InputError: the file or the table beside it is damaged, or not as the contract
            says, or the file is missing; the sentence names it and the remedy.
    """
    name = os.fspath(path)
    arrays = load_arrays(name, file, allowed=PARTS)
    for key in ("t", "frames"):
        if key not in arrays:
            raise InputError(
                f"{name}: {key} is missing; it holds {', '.join(arrays) or 'nothing'}"
            )
    fields: dict[str, Any] = {**arrays, "meta": load_meta(name, arrays)}
    recording = checked(name, Recording(**fields))
    warn_of_another_unit(name, recording.t)
    folder, own_name = os.path.split(name)
    table = table_of(Path(folder))
    if own_name in table.rows:
        recording.meta["labels"] = table.standing(own_name, recording.meta).labels
    return recording


def warn_of_another_unit(name: str, t: Floats) -> None:
    """Warn of times that do not seem to be in seconds."""
    steps = np.diff(t)
    rate_hz = 1.0 / max(float(np.median(steps)), 1e-12) if steps.size else SLOWEST_HZ
    if not SLOWEST_HZ <= rate_hz <= FASTEST_HZ:
        LOG.warning(
            f"{name}: has a median of {rate_hz:g} frames a second; t is in seconds"
        )
