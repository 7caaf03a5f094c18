"""Arrays in .npy, .npz, .mat and HDF5 files, as tables with a row for each frame."""

import io
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.io import loadmat, whosmat
from scipy.io.matlab import MatReadError

from edge.config import shown
from edge.errors import InputError
from edge.files import parsing, read_bytes
from train.importers.columns import TIME
from train.importers.reading import EMPTY, LARGEST_BYTES, Table

SUFFIXES = (".npy", ".npz", ".mat", ".h5", ".hdf5")
MOST_VALUES = LARGEST_BYTES // 8
"""Values of all arrays of a file."""
Arrays = dict[str, NDArray[Any]]


def read_arrays(path: Path) -> Arrays:
    """{name: array} of a file, which is "" in an .npy file.

    Raises:
        InputError: the file cannot be read, or is too large.
    """
    with parsing(str(path), "a table", "; save it as text"):
        data = read_bytes(path, LARGEST_BYTES)
        suffix = path.suffix.lower()
        if suffix == ".npy":
            return {"": _npy(path, io.BytesIO(data))}
        if suffix == ".npz":
            return _npz(path, data)
        if suffix == ".mat" and not data.startswith(b"MATLAB 7.3"):
            return _mat(path, data)
        return _hdf5(path, data)


def _npy(path: Path, file: Any) -> NDArray[Any]:
    version = np.lib.format.read_magic(file)
    read_header = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }.get(version)
    if read_header is not None:
        shape, _, _ = read_header(file)
        _check_size(path, int(np.prod(shape, dtype=object)))
    file.seek(0)
    array: NDArray[Any] = np.lib.format.read_array(file, allow_pickle=False)
    return array


def _npz(path: Path, data: bytes) -> Arrays:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        _check_size(path, sum(item.file_size for item in archive.infolist()) // 8)
        arrays = {}
        for name in archive.namelist():
            if name.endswith(".npy"):
                contents = io.BytesIO(archive.read(name))
                arrays[name.removesuffix(".npy")] = _npy(path, contents)
        return arrays


def _mat(path: Path, data: bytes) -> Arrays:
    try:
        sizes = whosmat(io.BytesIO(data))
    except (ValueError, MatReadError) as error:
        raise ValueError(str(error)) from None
    _check_size(path, sum(int(np.prod(shape, dtype=object)) for _, shape, _ in sizes))
    contents = loadmat(io.BytesIO(data))
    return {key: value for key, value in contents.items() if not key.startswith("__")}


def _hdf5(path: Path, data: bytes) -> Arrays:
    try:
        import h5py
    except ImportError:
        raise InputError(
            f"{path}: reading HDF5 and MATLAB 7.3 needs h5py; `pip install h5py`"
        ) from None
    arrays: Arrays = {}

    def collect(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            _check_size(path, int(np.prod(item.shape, dtype=object)))
            arrays[name.replace("/", ".")] = item[()]

    with h5py.File(io.BytesIO(data), "r") as file:
        file.visititems(collect)
    return arrays


def _check_size(path: Path, values: int) -> None:
    if values > MOST_VALUES:
        raise InputError(
            f"{path}: holds {values} values, more than the {MOST_VALUES} that are read; "
            "save it in parts"
        )


def _is_used(name: str, used: set[str]) -> bool:
    """Whether an array is among the named ones, or has the times or trials."""
    named = not used or name in used or name == "trial"
    return named or TIME.fullmatch(name) is not None


def table_of(
    path: Path, arrays: Mapping[str, NDArray[Any]], axis: int | None, used: set[str]
) -> Table:
    """A row for each frame of some arrays, and a column for each of their other values.

    Args:
        path: of the file.
        arrays: {name: array}; those without numbers are left out.
        axis: the axis of time of arrays with several, from 0; None where it is to be
            found.
        used: names that the user has given; empty for all.

    Raises:
        InputError: no axis, or more than one, can be the time's.
    """
    numbers = {
        name: _without_ones(np.atleast_1d(array))
        for name, array in arrays.items()
        if _is_numeric(array) and _is_used(name, used)
    }
    if not numbers:
        raise InputError(f"{path}: {EMPTY}")
    frames = _frames(path, numbers, axis)
    names: list[str] = []
    blocks: list[NDArray[Any]] = []
    form: list[str] = []
    shape: tuple[int, ...] = ()
    for name, array in numbers.items():
        place = _time_axis(path, name, array, frames, axis)
        if place is None:
            continue
        time_first = np.moveaxis(array, place, 0)
        if array.ndim > 1:
            form.append(f"time is axis {place + 1} of {name or 'the array'}")
        if time_first.ndim > 3:
            raise InputError(
                f"{path}: {name or 'the array'} has {time_first.ndim} dimensions; give "
                "--trials where the first is the trial, or save frames x rows x columns"
            )
        if time_first.ndim == 3:
            shape = time_first.shape[1:]
        block = time_first.reshape(frames, -1)
        names += _names(name, block.shape[1])
        blocks.append(block)
    data = pd.DataFrame(np.hstack(blocks), columns=names)
    return Table(path, data, named="" not in numbers, shape=shape, form=tuple(form))


def _is_numeric(array: Any) -> bool:
    if not isinstance(array, np.ndarray):
        return False
    return array.dtype.kind in "iufb" and array.size > 0


def _without_ones(array: NDArray[Any]) -> NDArray[Any]:
    """A vector that MATLAB stores as a matrix of one row or column."""
    return array.reshape(-1) if array.ndim == 2 and 1 in array.shape else array


def _names(name: str, columns: int) -> list[str]:
    if columns == 1 and name:
        return [name]
    return [f"{name}.{i}".strip(".") for i in range(1, columns + 1)]


def _frames(path: Path, arrays: Mapping[str, NDArray[Any]], axis: int | None) -> int:
    """The number of frames: that of the times, or what all arrays share."""
    for name, array in arrays.items():
        if TIME.fullmatch(name) and array.ndim == 1:
            return array.size
    if axis is not None:
        largest = max(arrays.values(), key=np.size)
        if not 0 <= axis < largest.ndim:
            raise InputError(f"{path}: --axis must be 1 to {largest.ndim}")
        return int(largest.shape[axis])
    if len(arrays) == 1:
        (array,) = arrays.values()
        return len(array)
    shared = set.intersection(*(set(array.shape) for array in arrays.values()))
    if len(shared) == 1:
        return int(shared.pop())
    sizes = {name: array.shape for name, array in arrays.items()}
    raise InputError(
        f"{path}: which axis is the time? The arrays are {shown(sizes)}; give --axis, "
        "or name those to be used by --taxels and --joints"
    )


def _time_axis(
    path: Path, name: str, array: NDArray[Any], frames: int, axis: int | None
) -> int | None:
    """The axis of an array that has so many entries; None of a constant."""
    places = [place for place, size in enumerate(array.shape) if size == frames]
    if axis is not None and axis in places:
        return axis
    if len(places) == 1:
        return places[0]
    if not places:
        if array.size == 1:
            return None
        raise InputError(
            f"{path}: {name or 'the array'} of {array.shape} has no axis of {frames} "
            "frames; name those to be used by --taxels and --joints, or give --axis"
        )
    raise InputError(
        f"{path}: which axis of {name or 'the array'} {array.shape} is the time? "
        "Give --axis"
    )


def trials_of(
    path: Path, arrays: Mapping[str, NDArray[Any]], task: str
) -> Iterator[tuple[str, dict[str, str], Arrays]]:
    """The name, labels and arrays of each trial of a file that holds several.

    Trials are the entries of a cell array or of a structure, or the first axis that all
    arrays share. What is a text or a number for each trial is a label, named by its
    array; one that is called label or labels is the label of `task`.

    Raises:
        InputError: the arrays do not share an axis of trials.
    """
    entries = _entries(path, arrays)
    count = len(next(iter(entries.values())))
    for i in range(count):
        labels: dict[str, str] = {}
        of_trial: Arrays = {}
        for name, values in entries.items():
            value = np.asarray(_plain(values[i]))
            if value.ndim == 0 or value.dtype.kind in "US":
                named = task if name.lower() in ("label", "labels") else name
                labels[named] = str(value.item() if value.size == 1 else value)
            else:
                of_trial[name] = value
        yield f"{path.stem}_{i:03}", labels, of_trial


def _entries(path: Path, arrays: Mapping[str, NDArray[Any]]) -> dict[str, list[Any]]:
    entries: dict[str, list[Any]] = {}
    for name, array in arrays.items():
        if not isinstance(array, np.ndarray):
            continue
        if array.dtype.names:
            for key in array.dtype.names:
                entries[key] = list(array[key].ravel())
        elif array.dtype == object or (array.ndim == 2 and 1 in array.shape):
            entries[name] = list(array.ravel())
        else:
            entries[name] = list(array)
    lengths = {len(values) for values in entries.values()}
    if len(lengths) != 1:
        sizes = {name: len(values) for name, values in entries.items()}
        raise InputError(
            f"{path}: its arrays have {shown(sizes)} trials; leave out the arrays "
            "that do not have one entry for each trial"
        )
    return entries


def _plain(value: Any) -> Any:
    """A cell's contents, without the array that MATLAB puts around it."""
    if isinstance(value, np.ndarray) and value.size == 1:
        return value.reshape(-1)[0]
    return value
