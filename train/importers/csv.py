"""Tables of values: a file for each trial, or one long table; text, arrays or Parquet.

A folder holds a file for each trial: a row a frame, a column a taxel, and if you like
columns of time and joint angles. Taxels are the columns whose names share a stem with
running numbers (s1 to s16, taxel_0_3), all columns of a file without a header, or those
that --taxels names; the columns used and ignored are printed. Labels come from
`labels.csv` (a column `file`, and one for each task), or else from a column of texts,
from the folder, or from the file's name; --label says which. A single file with a column
`trial` holds all trials; its columns of text that stay the same within a trial are
labels, and that of the task. Any file has such rows, or a row for each value in the
columns `taxel` (or `sensor_id`) and `value`. COLS are names, ranges or numbers from 1,
such as `s1-s9,force` or `3-5`. `skin.json` in the folder is the `skin` of the
recordings. With `--frames`, a folder holds a folder for each trial, with a file for each
frame: a line a row. A file that cannot be used is named and skipped. Taxels of three
axes are columns such as s1_x, s1_y, s1_z, or three arrays: see --axes. The forms of
files are those of train/importers/forms.
"""

import argparse
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import mode
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from edge.config import ConfigTable
from edge.errors import InputError
from edge.record.labels import TABLE
from edge.touch.arm import Chain
from edge.touch.layout import RELEASE_S
from train.data.scratch import Scratch
from train.importers import ImportedTrial, Refused, clock
from train.importers.axes import parted
from train.importers.columns import Meaning, meaning, onsets_of, quoted, times_of
from train.importers.counts import Samples, rest_of, skin_shape
from train.importers.forms import SUFFIXES, frames, tables_in, unread
from train.importers.forms.file import inner
from train.importers.labels import Labels, Place, labels_of, texts_in
from train.importers.options import TableOptions, add_table_options
from train.importers.table import Table
from train.json_files import json_table
from train.progress import say

SKIN = "skin.json"
FEWEST_ROWS = 8
"""Rows of a trial from which on a column is seen to count them."""
PANDAS = """\
Where no option helps, five lines of pandas make a recording of a table:
import edge, pandas
table = pandas.read_csv("cup_1.csv")  # sep=";", decimal=",", thousands="."
frames = table[["s1", "s2"]].round().astype(int).to_numpy()  # from 0 to 65535
meta = {"skin": {"rows": 1, "cols": frames.shape[1]}, "labels": {"object": "cup"}}
edge.save("cup_1.npz", edge.Recording(table["t"].to_numpy(), frames, meta=meta))"""
"""Lines to print where no table is clear."""
add_options = add_table_options


@dataclass(frozen=True)
class Measured:
    """A trial whose columns are understood.

    Attributes:
        place: what tells its labels.
        form: of its table.
        meaning: of the columns.
        samples: the numbers of the trial.
        onsets: seconds at which touches begin, where an option tells them.
    """

    place: Place
    form: tuple[str, ...]
    meaning: Meaning
    samples: Samples
    onsets: list[float]


class OnDisk(list[Samples]):
    """Numbers in temporary files, of which the memory holds one trial's at a time."""

    def __init__(self, scratch: Scratch, trials: Sequence[Measured]) -> None:
        super().__init__(trial.samples for trial in trials)
        self._scratch = scratch

    def __iter__(self) -> Iterator[Samples]:
        for samples in super().__iter__():
            yield samples
            self._scratch.release()


def trials(
    path: Path,
    arm: Chain | None,
    arguments: argparse.Namespace,
) -> Iterator[ImportedTrial | Refused]:
    """One recording for each file of a folder, or for each trial of a long table.

    Prints the columns used and ignored. The numbers of trials wait in temporary files
    until all tables were looked at.

    Raises:
        InputError: there is no file, or most lack an option.
    """
    options = TableOptions.of(arguments)
    folder = path if path.is_dir() else path.parent
    scratch = Scratch()
    measured: list[Measured] = []
    for file in _files(path, options):
        for result in _tried(_measured(file, folder, options)):
            if isinstance(result, Refused):
                yield result
                continue
            samples = scratch.put_fields(result.samples)
            measured.append(replace(result, samples=samples))
    if not measured:
        for line in PANDAS.splitlines():
            say(line)
        return
    kind = mode(trial.meaning.kind for trial in measured)
    yield from _odd(measured, kind)
    alike = [trial for trial in measured if trial.meaning.kind == kind]
    samples = OnDisk(scratch, alike)
    yield from _recorded(path, arm, alike, samples, options)


def _odd(trials: Sequence[Measured], kind: str) -> Iterator[Refused]:
    """Why trials whose columns are not those of most are left out."""
    for trial in trials:
        if trial.meaning.kind != kind:
            yield Refused(
                f"{trial.samples.where}: has {trial.meaning.kind:.80}, and most have "
                f"{kind:.80}; see --taxels and --time-unit"
            )


def _tried(items: Iterator[Any]) -> Iterator[Any]:
    """Some items; if what makes them refuses to go on, in the end why."""
    try:
        yield from items
    except InputError as error:
        yield Refused(str(error))


def _files(path: Path, options: TableOptions) -> list[Path]:
    """The files, or with `--frames` the folders, of trials.

    Raises:
        InputError: there is none; the sentence says what there is instead.
    """
    if not path.is_dir() and not options.frames:
        return [path]
    visible = [
        place
        for place in sorted(path.rglob("*"))
        if not any(part.startswith(".") for part in place.relative_to(path).parts)
    ]
    is_trial = _has_files if options.frames else _may_be_table
    if files := list(filter(is_trial, visible)):
        return files
    for place in visible:
        if place.suffix.lower() in unread.KINDS:
            raise InputError(f"{place}: is {unread.kind_of(place.suffix)}")
    words = f"file {', '.join(SUFFIXES)}, or folder of them with --frames"
    raise InputError(f"{path}: holds no {words}; give a folder of trials")


def _has_files(place: Path) -> bool:
    return place.is_dir() and any(path.is_file() for path in place.iterdir())


def _may_be_table(place: Path) -> bool:
    is_known = inner(place).suffix.lower() in SUFFIXES
    return is_known and place.name not in (TABLE, SKIN, "info.labels")


def _name(place: Path) -> str:
    """The name of the trial in a file, by its path from the folder of all."""
    return "_".join(inner(place).with_suffix("").parts)


def _measured(path: Path, folder: Path, options: TableOptions) -> Iterator[Any]:
    """The trials in a file or folder of frames whose columns are understood, and why
    others are not."""
    place = path.relative_to(folder)
    name = "_".join(place.parts) if options.frames else _name(place)
    tables = frames.tables if options.frames else tables_in
    for table in tables(path, options):
        named = replace(table, name=table.name or name)
        yield from _tried(map(_understood, [named], [place], [options]))


def _understood(table: Table, place: Path, options: TableOptions) -> Measured:
    """The numbers of a trial."""
    where = table.where
    texts = texts_in(table)
    if options.axes is not None:
        table = parted(table)
    sense = meaning(table, options)
    t = times_of(table, sense, options)
    samples = Samples.of(where, t, table.values(sense.taxels), options.axes)
    if np.isnan(samples.values[..., 0]).all():
        raise InputError(f"{where}: none of its values is a finite number")
    onsets = onsets_of(table, options, t)
    rows = table.data.index
    if sense.joints:
        angles = _radians(table, sense.joints, options)
        samples, rows = _with_joints(samples, rows, angles)
    return Measured(
        Place(table.name, place, table.labels, table.label, texts),
        table.form,
        sense,
        samples.in_order(str(rows.name), rows),
        [onset - t[0] for onset in onsets],
    )


def _radians(
    table: Table, joints: Sequence[str], options: TableOptions
) -> NDArray[np.float64]:
    """(rows, joints) angles.

    Raises:
        InputError: they are beyond a turn, and nothing says that they are in degrees.
    """
    angles = table.numbers(joints)
    if options.degrees:
        return np.radians(angles)
    largest = np.fmax.reduce(np.abs(angles), axis=None, initial=0.0)
    if largest > 2.0 * math.pi:
        raise InputError(
            f"{table.where}: joint angles reach {largest:g}, beyond 2 pi: add --degrees, "
            "or name other columns by --joints"
        )
    return angles


def _with_joints(
    samples: Samples, rows: pd.Index, angles: NDArray[np.float64]
) -> tuple[Samples, pd.Index]:
    """The frames and their rows, with joint angles that may stand in rows of their
    own."""
    where = samples.where
    has_angles = np.isfinite(angles).all(axis=1)
    if has_angles.all() or not has_angles.any():
        return replace(samples, joints=clock.complete(angles, where)), rows
    has_values = np.isfinite(samples.values).any(axis=(1, 2))
    t = samples.t[has_values]
    frame = str(rows.name)
    at_frames = clock.angles_at(
        t,
        samples.t[has_angles],
        angles[has_angles],
        RELEASE_S,
        where,
        frame,
        rows[has_angles],
    )
    joints = clock.complete(at_frames, where)
    return Samples(where, t, samples.values[has_values], joints), rows[has_values]


def _recorded(
    path: Path,
    arm: Chain | None,
    trials: Sequence[Measured],
    samples: OnDisk,
    options: TableOptions,
) -> Iterator[ImportedTrial | Refused]:
    """The recordings of trials of the same columns; prints the columns used and
    ignored."""
    folder = path if path.is_dir() else path.parent
    names = [_name(place.relative_to(folder)) for place in folder.rglob("*")]
    labels = labels_of([trial.place for trial in trials], folder, options, names)
    yield from map(Refused, labels.slips)
    skin = json_table(folder / SKIN)
    if trials[0].meaning.are_all:
        _require_taxels(samples, trials[0].meaning.taxels)
    shape = _announced(trials, skin, labels, options)
    # A recording that is cut at contact has no rest.
    counts = options.counts or options.onset is not None
    rest = rest_of(samples, replace(options, counts=counts))
    common = {"skin": skin.raw, "source": path.name}
    for trial, values, trial_labels in zip(trials, samples, labels.of, strict=True):
        name = trial.place.name
        meta = common | {"trial": name, "labels": dict(trial_labels)}
        meta |= _meta(trial, arm, options)
        if name not in labels.left_out:
            recordings = map(rest.recording, [values], [shape], [meta])
            yield from _tried(map(ImportedTrial, [name], recordings))


def _meta(trial: Measured, arm: Chain | None, options: TableOptions) -> dict[str, Any]:
    """What a recording says of its arm and its onsets."""
    meta: dict[str, Any] = {}
    if trial.samples.joints is not None:
        meta["arm"] = arm and arm.to_dict()
    if options.onset or options.onset_column:
        source = options.onset or "event"
        meta["onset"] = {"source": source, "times_s": trial.onsets}
    return meta


def _announced(
    trials: Sequence[Measured],
    skin: ConfigTable,
    labels: Labels,
    options: TableOptions,
) -> tuple[int, int]:
    """The rows and columns of the skin; prints the columns used and ignored, once for
    all files."""
    first = trials[0]
    taxels = len(first.meaning.taxels)
    in_skin = skin.whole("rows", 1), skin.whole("cols", taxels)
    shape = skin_shape(first.samples, first.meaning.shape or in_skin, options)
    ignored = [name for name in first.meaning.left_out if name not in labels.columns]
    phrases = [f"{first.meaning.text(shape)}, label: {labels.source}"]
    if ignored:
        phrases.append(f"ignored: {', '.join(map(quoted, ignored))}")
    if options.onset_column:
        count = sum(len(trial.onsets) for trial in trials)
        phrases.append(f"onset: column {options.onset_column}, {count} times")
    say("; ".join([*phrases, *first.form]))
    if options.axes is not None:
        say(options.axes.text)
    if labels.warning:
        say(labels.warning)
    return shape


def _require_taxels(trials: Sequence[Samples], taxels: Sequence[str]) -> None:
    """Refuse columns without a name of which some count the rows or time, or tell the
    trials apart.

    Raises:
        InputError: there is one.
    """
    if min(len(trial.t) for trial in trials) < FEWEST_ROWS:
        return
    rises = []
    stays = []
    starts = []
    for trial in trials:
        steps = np.diff(trial.values[..., 0], axis=0)
        rises.append((steps > 0.0).all(axis=0))
        stays.append((steps == 0.0).all(axis=0))
        starts.append(trial.values[0, :, 0])
    tells_apart = np.all(stays, axis=0) & (np.ptp(starts, axis=0) > 0.0)
    doubtful = np.all(rises, axis=0) | tells_apart
    likely = [
        taxel for taxel, is_odd in zip(taxels, doubtful, strict=True) if not is_odd
    ]
    if doubtful.any() and likely:
        raise InputError(
            f"{trials[0].where}: column {taxels[doubtful.argmax()]} counts up, or tells "
            f"the trials apart; name the taxels, such as --taxels {','.join(likely)}"
        )
