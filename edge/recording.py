"""One trial, one `.npz`: what the skin (and the arm) gave, with what is known about it."""

from __future__ import annotations

import json
import os
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from edge.config import parse_json, shown
from edge.errors import InputError
from edge.files import open_regular, parsing, write_whole
from edge.touch.arm import joint_columns
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout

LARGEST_BYTES = 1 << 27
"""Arrays that claim to be larger together are taken for a damaged file: an hour of 384 taxels at
40 Hz has 111 MB, two minutes of 64 x 62 at 100 Hz have 95."""
MOST_COUNTS = 65535
KEYS = ("t", "frames", "joints", "valid", "meta")


@dataclass(frozen=True)
class Recording:
    """One trial; iterating over it gives its frames as the live skin would have.

    >>> import edge, numpy as np
    >>> recording = edge.Recording(np.array([0.0, 0.01]), np.zeros((2, 16, 24), np.uint16))
    >>> [frame.t for frame in recording]
    [0.0, 0.01]

    Attributes:
        t: (n,) seconds, never going back; of frames at equal times the last one counts.
        frames: (n, rows, cols) counts above baseline.
        joints: (n, dof) radians, NaN in a frame whose pose was not known; or None.
        valid: (rows, cols) or (n, rows, cols), taxels that could be read, or None for all.
        meta: `labels` {task: label}, `skin` (see `SkinLayout`), `joint_names` [name of each
            column of `joints`], `source`, `trial`, and more.
    """

    t: NDArray[np.float64]
    frames: NDArray[np.uint16]
    joints: NDArray[np.float64] | None = None
    valid: NDArray[np.bool_] | None = None
    meta: dict[str, Any] = field(default_factory=dict)

    @property
    def labels(self) -> dict[str, str]:
        """{task: label}; empty where the trial is not labelled."""
        return dict(self.meta.get("labels", {}))

    @property
    def layout(self) -> SkinLayout:
        """The skin that the trial was recorded with."""
        skin = {"rows": self.frames.shape[1], "cols": self.frames.shape[2]}
        return SkinLayout.from_dict({**skin, **self.meta.get("skin", {})})

    @property
    def joint_names(self) -> tuple[str, ...] | None:
        """The joint of each column of `joints`, or None where it is not known."""
        names = self.meta.get("joint_names")
        return None if names is None else tuple(names)

    def for_joints(self, names: Sequence[str], where: str = "recording") -> Recording:
        """The recording with the angles of these joints, in this order.

        The recording itself where it does not name its joints.

        Raises:
            InputError: it has no angle of one of them; the sentence names `where`.
        """
        if self.joints is None or self.joint_names in (None, tuple(names)):
            return self
        try:
            columns = joint_columns(self.joint_names or (), names)
        except InputError as error:
            raise InputError(f"{where}: {error}") from None
        meta = {**self.meta, "joint_names": list(names)}
        return replace(self, joints=self.joints[:, columns], meta=meta)

    def __iter__(self) -> Iterator[Frame]:
        """The frames as the live skin would give them."""
        for i, t in enumerate(self.t.tolist()):
            valid = self.valid
            if valid is not None and valid.ndim == 3:
                valid = valid[i]
            joints = None if self.joints is None else self.joints[i]
            if joints is not None and np.isnan(joints[0]):
                joints = None
            yield Frame(t=t, counts=self.frames[i], valid=valid, joints=joints)


def _plain(path: str, recording: Recording, scale: float | None = None) -> Recording:
    """The recording as the contract says, where what it means leaves no doubt.

    Whole numbers of any type that are counts become uint16, taxels in a row the skin's rows and
    columns, times and angles float64, and labels that are whole numbers text.

    Args:
        scale: see `save`.
    """
    meta, frames = recording.meta, np.asarray(recording.frames)
    if frames.dtype.kind in "iuf" and (frames.dtype != np.uint16 or scale is not None):
        frames = _counts(path, frames, scale)
        meta = meta if scale is None else {**meta, "scale": scale}
    known = meta if isinstance(meta, dict) else {}  # what is none, `_check` refuses
    skin, labels = known.get("skin"), known.get("labels")
    if frames.ndim == 2 and isinstance(skin, dict):
        rows, cols = skin.get("rows"), skin.get("cols")
        if isinstance(rows, int) and isinstance(cols, int) and rows > 0 and cols > 0:
            frames = frames.reshape(-1, rows, cols) if rows * cols == frames.shape[1] else frames
    if isinstance(labels, dict) and any(map(_whole, labels.values())):
        text = {task: str(label) if _whole(label) else label for task, label in labels.items()}
        meta = {**meta, "labels": text}

    def double(values: NDArray[Any]) -> NDArray[Any]:
        return values.astype(np.float64) if values.dtype.kind == "f" else values

    joints = None if recording.joints is None else double(np.asarray(recording.joints))
    return Recording(double(np.asarray(recording.t)), frames, joints, recording.valid, meta)


def _whole(label: object) -> bool:
    return isinstance(label, int | np.integer) and not isinstance(label, bool)


def _counts(path: str, frames: NDArray[Any], scale: float | None) -> NDArray[Any]:
    """Frames of another type as uint16, times `scale` and rounded where it is given."""
    if scale is not None:
        if not 0.0 < scale < np.inf:
            raise InputError(f"{path}: the scale must be a number above 0, not {scale:g}")
        frames = np.rint(frames.astype(np.float64) * scale)
    if not frames.size:
        return frames.astype(np.uint16)
    if not np.isfinite(frames).all():
        raise InputError(
            f"{path}: frames hold what is not finite; set it to 0 and say in `valid` which taxels "
            "could be read"
        )
    low, high = frames.min(), frames.max()
    if low < 0:
        raise InputError(
            f"{path}: frames go down to {low:g}; counts are above baseline: subtract the frame "
            "before touch, then np.clip(frames, 0, None)"
        )
    fine = (frames != np.rint(frames)).any()
    if fine or high > MOST_COUNTS:
        # A power of ten, so that the factor is easily the same for all recordings of a set.
        factor = (scale or 1.0) * 10.0 ** np.floor(np.log10(MOST_COUNTS / high))
        raise InputError(
            f"{path}: frames are {frames.dtype} up to {high:g}"
            f"{' and no whole numbers' if fine else ''}; counts are whole numbers up to "
            f"{MOST_COUNTS}: edge.save(path, recording, scale={factor:g}), the same for all"
        )
    return frames.astype(np.uint16)


def _check(path: str, recording: Recording) -> None:
    """Raise InputError with one sentence where the trial is not as the contract says."""
    t, frames, joints, valid = recording.t, recording.frames, recording.joints, recording.valid

    def fail(what: str) -> None:
        raise InputError(f"{path}: {what}")

    if frames.dtype != np.uint16 or frames.ndim != 3:
        fail(
            f"frames must be uint16 (n, rows, cols), not {frames.dtype} {frames.shape}; "
            + (
                'say in meta.skin how many "rows" and "cols" they have'
                if frames.ndim == 2
                else "store counts above baseline"
            )
        )
    n, rows, cols = frames.shape
    if n == 0 or rows == 0 or cols == 0:
        fail(f"frames are empty {frames.shape}; record at least one frame")
    if t.dtype != np.float64 or t.shape != (n,):
        fail(
            f"t must be float64 ({n},), a time in seconds a frame, not {t.dtype} {t.shape}; mend it"
        )
    if not np.isfinite(t).all():
        fail(f"t of frame {int(np.argmin(np.isfinite(t)))} is not finite; repair the clock")
    back = np.flatnonzero(t[1:] < t[:-1])
    if back.size:
        fail(f"time goes back at frame {int(back[0]) + 1}; sort the frames or split the recording")
    if joints is not None:
        if joints.dtype != np.float64 or joints.ndim != 2 or joints.shape[0] != n:
            fail(
                f"joints must be float64 ({n}, dof) for {n} frames, "
                f"not {joints.dtype} {joints.shape}; mend them"
            )
        if joints.shape[1] == 0:
            fail("joints have no column; leave them out where the arm is unknown")
        unknown = np.isnan(joints)
        odd = np.isinf(joints) | (unknown != unknown[:, :1])
        if odd.any():
            fail(
                f"a joint angle of frame {int(np.argmax(odd.any(axis=1)))} is not finite; where "
                "the pose was not known, all angles of a frame must be NaN"
            )
    if valid is not None and (
        valid.dtype != np.bool_ or valid.shape not in ((rows, cols), (n, rows, cols))
    ):
        fail(
            f"valid must be bool ({rows}, {cols}) or ({n}, {rows}, {cols}), "
            f"not {valid.dtype} {valid.shape}; mend it"
        )
    meta = recording.meta
    if not isinstance(meta, dict):
        fail("meta must be a JSON object")
    labels = meta.get("labels", {})
    if not isinstance(labels, dict) or not all(
        isinstance(k, str) and k and isinstance(v, str) and v for k, v in labels.items()
    ):
        fail("meta.labels must map task names to labels, both text")
    names = meta.get("joint_names")
    if names is not None:
        if not isinstance(names, list) or not all(isinstance(n, str) and n for n in names):
            fail("meta.joint_names must be a list of names")
        if len(set(names)) < len(names):
            fail("meta.joint_names has the same name twice")
        dof = 0 if joints is None else joints.shape[1]
        if len(names) != dof:
            fail(f"meta.joint_names has {len(names)} names for {dof} joint angles")
    skin = meta.get("skin", {})
    if not isinstance(skin, dict):
        fail("meta.skin must be an object")
    layout = SkinLayout.from_dict({"rows": rows, "cols": cols, **skin}, where=path)
    if layout.shape != (rows, cols):
        fail(f"meta.skin says {layout.rows} x {layout.cols} taxels, frames are {rows} x {cols}")


def _array(path: str, archive: zipfile.ZipFile, key: str) -> NDArray[Any]:
    """One array of the archive; its header is read before anything is allocated."""
    with archive.open(f"{key}.npy") as file:
        version = np.lib.format.read_magic(file)
        read = {
            (1, 0): np.lib.format.read_array_header_1_0,
            (2, 0): np.lib.format.read_array_header_2_0,
        }.get(version)
        if read is None:
            raise InputError(f"{path}: {key} is in an unknown npy version {version}")
        shape, _, dtype = read(file)
        if dtype.hasobject:
            raise InputError(f"{path}: {key} holds Python objects; store plain numbers")
        size = dtype.itemsize
        for extent in shape:
            size *= extent
        if size > archive.getinfo(f"{key}.npy").file_size:
            raise InputError(f"{path}: {key} claims {size} bytes, more than the file holds")
    with archive.open(f"{key}.npy") as file:
        return np.asarray(np.lib.format.read_array(file, allow_pickle=False))


def load_arrays(
    path: str | os.PathLike[str],
    file: BinaryIO | None = None,
    keys: Sequence[str] | None = None,
) -> dict[str, NDArray[Any]]:
    """Arrays of an `.npz`, without pickle.

    Args:
        path: of the file, which sentences name.
        file: its contents, where they have been read already.
        keys: those to read, as far as they are there; all where None.

    Raises:
        InputError: the file is missing, damaged, larger than `LARGEST_BYTES`, or holds something
            other than plain arrays.
    """
    name = os.fspath(path)
    with ExitStack() as stack:
        if file is None:
            file = stack.enter_context(open_regular(name, LARGEST_BYTES))
        stack.enter_context(parsing(name, "a readable .npz file", "; copy or record it again"))
        archive = stack.enter_context(zipfile.ZipFile(file))
        sizes = {
            member.filename.removesuffix(".npy"): member.file_size
            for member in archive.infolist()
            if member.filename.endswith(".npy")
        }
        wanted = [key for key in sizes if keys is None or key in keys]
        if sum(sizes[key] for key in wanted) > LARGEST_BYTES:
            raise InputError(f"{name}: claims arrays of more than {LARGEST_BYTES} bytes; split it")
        return {key: _array(name, archive, key) for key in wanted}


def load_meta(name: str, arrays: dict[str, NDArray[Any]]) -> dict[str, Any]:
    """The JSON object under `meta`."""
    raw = arrays.get("meta")
    if raw is None:
        raise InputError(f"{name}: meta is missing; store a JSON object as text under it")
    if raw.dtype.kind != "U" or raw.size != 1:
        raise InputError(f"{name}: meta must be one JSON text, not {raw.dtype} {raw.shape}")
    meta = parse_json(str(raw.reshape(())[()]), f"{name}: meta")
    if not isinstance(meta, dict):
        raise InputError(f"{name}: meta must be a JSON object, not {shown(meta)}")
    return meta


def load(path: str | os.PathLike[str], file: BinaryIO | None = None) -> Recording:
    """Read a recording.

    >>> import edge
    >>> from edge import demo
    >>> recording = edge.load(demo.FOLDER / "pillow-movable.npz")
    >>> recording.labels["object"], recording.frames.shape[1:]
    ('pillow', (16, 24))

    Args:
        path: of the `.npz`, which sentences name.
        file: its contents, where they have been read already.

    Raises:
        InputError: the file is missing, damaged, or not as the contract says; the sentence
            names the file and what to do.
    """
    name = os.fspath(path)
    arrays = load_arrays(name, file, KEYS)
    for key in ("t", "frames"):
        if key not in arrays:
            raise InputError(f"{name}: {key} is missing; it holds {', '.join(arrays) or 'nothing'}")
    recording = Recording(
        t=arrays["t"],
        frames=arrays["frames"],
        joints=arrays.get("joints"),
        valid=arrays.get("valid"),
        meta=load_meta(name, arrays),
    )
    recording = _plain(name, recording)
    _check(name, recording)
    return recording


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
        scale: counts of a unit of `frames` that are no counts; it is kept in `meta.scale`. Give
            all recordings of a data set the same.
        overwrite, lasting: see `write_whole`.

    Raises:
        InputError: the recording is not as the contract says, `path` cannot be written, or
            it exists and `overwrite` is False.
    """
    name = os.fspath(path)
    recording = _plain(name, recording, scale)
    _check(name, recording)
    arrays: dict[str, NDArray[Any]] = {"t": recording.t, "frames": recording.frames}
    if recording.joints is not None:
        arrays["joints"] = recording.joints
    if recording.valid is not None:
        arrays["valid"] = recording.valid
    save_arrays(name, arrays, recording.meta, overwrite=overwrite, lasting=lasting)


def save_arrays(
    path: str | os.PathLike[str],
    arrays: dict[str, NDArray[Any]],
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
        raise InputError(f"{os.fspath(path)}: meta cannot be written as JSON: {error}") from None
    with write_whole(path, overwrite=overwrite, lasting=lasting) as file:
        if compress:
            np.savez_compressed(file, meta=np.array(text), **arrays)  # type: ignore[arg-type]
        else:
            np.savez(file, meta=np.array(text), **arrays)  # type: ignore[arg-type]


def find(paths: list[str]) -> list[Path]:
    """The `.npz` files named, and those in the folders named (sorted, folders within too).

    Raises:
        InputError: a path does not exist, or a folder holds no recording.
    """
    found: list[Path] = []
    for text in paths:
        path = Path(text)
        if path.is_dir():
            inside = sorted(p for p in path.rglob("*.npz") if not p.name.startswith("."))
            if not inside:
                raise InputError(f"{path}: no .npz recording in this folder")
            found += inside
        else:
            found.append(path)
    return found
