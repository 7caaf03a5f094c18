"""Arrays in .npy, .npz, .mat and HDF5 files, as tables with a row for each frame."""

import io
import math
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, BinaryIO

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.io import loadmat, whosmat

from edge.config import short_text
from edge.errors import InputError, about
from edge.files import parsing
from train.importers.columns import TIME
from train.importers.forms.file import File
from train.importers.options import TableOptions
from train.importers.table import EMPTY, Table, needs, numbered, require_unique

SUFFIXES = (".npy", ".npz", ".mat", ".h5", ".hdf5")
MOST_VALUES = 1 << 25
"""Values of all arrays of a file; on the way to counts each takes 37 bytes."""
Arrays = dict[str, Any]
Labelled = tuple[dict[str, str], Arrays]
"""The labels and the arrays of a trial."""


def is_form(file: File) -> bool:
    """Whether the suffix is that of arrays."""
    return file.suffix in SUFFIXES


def tables(file: File, options: TableOptions) -> Iterator[Table]:
    """The arrays as one trial, or as several with `--trials`.

    Raises:
        InputError: the arrays do not tell which axis is the time, or the trial.
    """
    where = str(file.path)
    stored = read_arrays(file)
    if not options.trials:
        with about(where):
            yield table_of(where, stored, options)
        return
    with about(where):
        trials = list(trials_of(stored, options.task))
    for number, (labels, arrays) in enumerate(trials):
        name = f"{file.path.stem}_{number:03}"
        trial = f"{where}: trial {name}"
        with about(trial):
            table = table_of(trial, arrays, options)
        label = "the arrays" if labels else ""
        yield replace(table, name=name, labels=labels, label=label)


def read_arrays(file: File) -> Arrays:
    """{name: array, or likewise a structure or group} of a file; an .npy file has one
    array, "".

    Raises:
        InputError: the file cannot be read, or is too large.
    """
    data = io.BytesIO(file.data)
    where = str(file.path)
    with parsing(where, "arrays", "; save them again"), about(where):
        if file.suffix == ".npy":
            array = np.lib.format.read_array(data)
            _check_size(array.size)
            return {"": array}
        if file.suffix == ".npz":
            return _npz(data)
        if file.suffix == ".mat" and not file.data.startswith(b"MATLAB 7.3"):
            return _mat(data)
        return _hdf5(data)


def _npz(file: BinaryIO) -> Arrays:
    values = 0
    with zipfile.ZipFile(file) as archive:
        for name in archive.namelist():
            with archive.open(name) as stream:
                np.lib.format.read_magic(stream)
                shape, *_ = np.lib.format.read_array_header_1_0(stream)
                values += math.prod(shape)
    _check_size(values)
    file.seek(0)
    return dict(np.load(file))


def _mat(file: BinaryIO) -> Arrays:
    _check_size(sum(math.prod(shape) for _, shape, _ in whosmat(file)))
    contents = loadmat(file, simplify_cells=True)
    return {name: value for name, value in contents.items() if name[:2] != "__"}


def _hdf5(file: BinaryIO) -> Arrays:
    with needs("h5py", "reading HDF5 and MATLAB 7.3"):
        import h5py
    arrays: Arrays = {}

    def value(item: Any) -> Any:
        kind = item.attrs.get("MATLAB_class")
        _check_size(math.prod(item.shape or ()))
        array = item[()]
        if kind is None or not isinstance(array, np.ndarray):
            return array
        if kind == b"char":
            return np.array("".join(map(chr, array.flat)))
        if kind == b"cell":
            cells = np.empty(array.size, object)
            for i, reference in enumerate(array.flat):
                cells[i] = value(stored[reference])
            return cells
        return array.T  # MATLAB stores columns one after another

    def collect(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and not name.startswith("#"):
            *groups, last = name.split("/")
            place = arrays
            for group in groups:
                place = place.setdefault(group, {})
            place[last] = value(item)

    with h5py.File(file, "r") as stored:
        stored.visititems(collect)
    return arrays


def _check_size(values: int) -> None:
    if values > MOST_VALUES:
        raise InputError(
            f"holds {values} values, more than the {MOST_VALUES} that are read; save it "
            "in parts"
        )


def table_of(where: str, arrays: Arrays, options: TableOptions) -> Table:
    """A row for each frame of some arrays, and a column for each of their other values.

    Args:
        where: names the file in errors.
        arrays: {name: array}; those without numbers are left out.
        options: `axis` is that of the time, from 1; if `taxels` are named, the other
            arrays that no option names are left out, but for the times and trials.

    Raises:
        InputError: no axis, or more than one, can be the time's.
    """
    numbers = _numbers(arrays, options)
    axis = None if options.axis is None else options.axis - 1
    frames = _frames(numbers, axis, options.time)
    names: list[str] = []
    blocks: list[NDArray[Any]] = []
    form: list[str] = []
    shape: tuple[int, ...] = ()
    for name, array in numbers.items():
        if array.size == 1 != frames:
            continue
        title = name or "the array"
        place = _time_axis(title, array, frames, axis)
        if array.ndim > 1:
            form.append(f"time is axis {place + 1} of {title}")
        time_first = np.moveaxis(array, place, 0)
        if array.ndim == 3:
            shape = time_first.shape[1:]
        block = time_first.reshape(frames, -1)
        blocks.append(block)
        is_column = name and block.shape[1] == 1
        names += [name] if is_column else numbered(name, block.shape[1])
    require_unique(names)
    data = pd.DataFrame(np.hstack(blocks), columns=names)
    return Table(where, data, named="" not in numbers, shape=shape, form=tuple(form))


def _numbers(arrays: Arrays, options: TableOptions) -> dict[str, NDArray[Any]]:
    """The arrays of numbers that are used, those of structures by their path.

    Raises:
        InputError: there is none.
    """
    flat = _flat(arrays)
    words = filter(None, (options.taxels, options.joints, options.time))
    named = set(",".join(words).split(",")) & set(flat)
    if not options.taxels or not named:
        named = set(flat)
    named.add("trial")
    numbers = {}
    for name, array in flat.items():
        is_used = name in named or TIME.fullmatch(name)
        if is_used and array.dtype.kind in "iufb" and array.size:
            numbers[name] = array.ravel() if _is_vector(array) else array
    if not numbers:
        raise InputError(f"{EMPTY}; where it holds cells or structures, give --trials")
    return numbers


def _flat(arrays: Arrays, stem: str = "") -> dict[str, NDArray[Any]]:
    """The arrays of structures within structures, by their path."""
    flat: dict[str, NDArray[Any]] = {}
    for name, value in arrays.items():
        if isinstance(value, dict):
            flat |= _flat(value, f"{stem}{name}.")
        elif isinstance(value, np.ndarray):
            flat[stem + name] = value
    return flat


def _is_vector(array: NDArray[Any]) -> bool:
    """Whether an array is a number, or a vector as MATLAB stores it: a matrix of one
    row or column."""
    return array.ndim == 0 or (array.ndim == 2 and 1 in array.shape)


def _frames(arrays: dict[str, NDArray[Any]], axis: int | None, time: str | None) -> int:
    """The number of frames: that of the times, or what all arrays share. A single array
    has its longest axis first."""
    for name, array in arrays.items():
        if array.ndim == 1 and (name == time or TIME.fullmatch(name)):
            return array.size
    largest = max(arrays.values(), key=np.size)
    if axis is not None:
        if axis >= largest.ndim:
            raise InputError(f"--axis must be 1 to {largest.ndim}")
        return int(largest.shape[axis])
    shared = set.intersection(*(set(array.shape) for array in arrays.values()))
    if len(arrays) == 1:
        shared = {largest.shape[0]} & {max(largest.shape)}
    if len(shared) != 1:
        raise _unclear(arrays)
    return int(shared.pop())


def _unclear(arrays: Mapping[str, NDArray[Any]]) -> InputError:
    sizes = {name or "the array": array.shape for name, array in arrays.items()}
    return InputError(
        f"which axis is the time? The arrays are {short_text(sizes)}; give --axis, or name "
        "those to be used by --taxels and --joints"
    )


def _time_axis(title: str, array: NDArray[Any], frames: int, axis: int | None) -> int:
    """The axis of an array that has so many entries."""
    places = [place for place, size in enumerate(array.shape) if size == frames]
    if axis in places:
        places = [axis]
    if len(places) != 1:
        raise InputError(
            f"which axis of {title} {array.shape} is the time of {frames} frames? Give "
            "--axis, or name the arrays to be used by --taxels and --joints"
        )
    if array.ndim > 3:
        raise InputError(
            f"{title} has {array.ndim} dimensions; give --trials where the first is the "
            "trial, or save frames x rows x columns"
        )
    return places[0]


def trials_of(stored: Arrays, task: str) -> Iterator[Labelled]:
    """The labels and arrays of each trial of a file that holds several.

    Trials are the groups or structures of the file, the entries of a cell array or of a
    structure, or the first axis that all arrays share. What is a text or a number for
    each trial is a label, named by its array; one that is called label or labels is the
    label of `task`.

    Raises:
        InputError: the arrays do not share an axis of trials.
    """
    for fields in _trials(stored):
        labels = {}
        arrays = {}
        for name, field in fields.items():
            value = np.asarray(field)
            if value.size > 1 and value.dtype.kind not in "US":
                arrays[name] = value
            elif value.size and not isinstance(value.item(), dict):
                is_label = name.lower() in ("label", "labels")
                labels[task if is_label else name] = _text(value.item())
        yield labels, arrays


def _trials(stored: Arrays) -> list[Arrays]:
    """The structures or groups of a file, or the entries of each of its arrays."""
    values = list(stored.values())
    while len(values) == 1 and isinstance(values[0], dict):
        stored = values[0]
        values = list(stored.values())
    if len(values) == 1 and np.asarray(values[0]).dtype.hasobject:
        values = list(values[0])
    keys = {frozenset(value) if isinstance(value, dict) else None for value in values}
    if len(values) > 1 and len(keys) == 1 and None not in keys:
        return values
    return _entries(stored)


def _entries(stored: Arrays) -> list[Arrays]:
    """The entries of each array, one for each trial."""
    lists = {name: list(np.atleast_1d(array)) for name, array in stored.items()}
    sizes = {name: len(entries) for name, entries in lists.items()}
    if not any(sizes.values()):
        raise InputError(EMPTY)
    if len(set(sizes.values())) != 1:
        raise InputError(
            f"its arrays have {short_text(sizes)} trials; leave out the arrays that do "
            "not have one entry for each trial"
        )
    rows = zip(*lists.values(), strict=True)
    return [dict(zip(lists, row, strict=True)) for row in rows]


def _text(value: Any) -> str:
    """A text or a number as a label; HDF5 gives texts as UTF-8 bytes."""
    return str(value, "utf-8", "replace") if isinstance(value, bytes) else str(value)
