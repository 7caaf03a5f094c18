"""Tables of values: a file for each trial, or one long table; text, arrays or Parquet.

A folder holds a file for each trial: a row a frame, a column a taxel, and if you like
columns of time and joint angles. Taxels are the columns whose names share a stem with
running numbers (s1 to s16, taxel_0_3), all columns of a file without a header, or those
that --taxels names; the columns used and ignored are printed. The label is the
name of the folder that the file lies in (or of the one above folders that only count
trials), or else its own name without the number at the end; `labels.csv`, with the
column `trial` and one for each task, replaces it. A single file with a column `trial`
holds all trials; its columns of text that stay the same within a trial are labels, and
that of the task. Any file has such rows, or a row for each value in the columns `taxel`
(or `sensor_id`) and `value`. COLS are names, ranges or numbers from 1, such as
`s1-s9,force` or `3-5`. `skin.json` in the folder is the `skin` of the recordings. With
`--frames`, a folder holds a folder for each trial, with a file for each frame: a line a
row. A file that cannot be used is named and skipped. Taxels of three axes are columns
such as s1_x, s1_y, s1_z, or three arrays: see --axes.
"""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from statistics import mode
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from edge.config import ConfigTable
from edge.errors import InputError
from edge.touch.arm import Chain
from edge.touch.layout import RELEASE_S
from train.importers import Refused, Trial, clock
from train.importers.axes import parted
from train.importers.columns import Meaning, meaning, times_of
from train.importers.counts import Samples, rest_of, skin_shape
from train.importers.options import TableOptions, add_table_options
from train.importers.sources import SKIN, SUFFIXES, Source, sources_in, tried
from train.json_files import json_table
from train.progress import say

FEWEST_ROWS = 8
"""Rows of a trial from which on a column is seen to count them."""
FEWEST_ALONE = 3
"""Trials that may all have another label."""
FIRST_WORDS = (
    "this line, run in their folder, takes the first word of each name: (echo trial,%s; "
    'for f in *_*; do echo "${f%%.*},${f%%%%_*}"; done) > labels.csv'
)
PANDAS = """\
Where no option helps, five lines of pandas make a recording of a table:
import edge, pandas
table = pandas.read_csv("cup_1.csv")  # sep=";", decimal=",", thousands="."
frames = table[["s1", "s2"]].round().astype(int).to_numpy()  # from 0 to 65535
meta = {"skin": {"rows": 1, "cols": frames.shape[1]}, "labels": {"object": "cup"}}
edge.save("cup_1.npz", edge.Recording(table["t"].to_numpy(), frames, meta=meta))"""
"""What is printed where no table is clear."""
add_options = add_table_options


@dataclass(frozen=True)
class Measured:
    """A trial whose columns are understood.

    Attributes:
        name, labels, label: as those of its source.
        form: of its table.
        meaning: of the columns.
        samples: the numbers of the trial.
    """

    name: str
    labels: dict[str, str]
    label: str
    form: tuple[str, ...]
    meaning: Meaning
    samples: Samples


def trials(
    path: Path,
    arm: Chain | None,
    arguments: argparse.Namespace,
) -> Iterator[Trial | Refused]:
    """One recording for each file of a folder, or for each trial of a long table.

    Prints the columns used and ignored.

    Raises:
        InputError: there is no file, or one cannot be used with `--strict`.
    """
    options = TableOptions.of(arguments)
    understood = partial(_understood, options=options)
    results = list(tried(sources_in(path, options), understood, options.strict))
    yield from (result for result in results if isinstance(result, Refused))
    measured = [result for result in results if isinstance(result, Measured)]
    if measured:
        yield from _recorded(path, arm, measured, options)
    elif results:
        for line in PANDAS.splitlines():
            say(line)
    else:
        files = f"file {', '.join(SUFFIXES)}, or folder of them with --frames"
        raise InputError(f"{path}: holds no {files}; give a folder of trials")


def _recorded(
    path: Path,
    arm: Chain | None,
    measured: Sequence[Measured],
    options: TableOptions,
) -> Iterator[Trial | Refused]:
    """The recordings of trials, without those whose columns are not those of most of
    them; prints the columns used and ignored."""
    kind = mode(trial.meaning.kind for trial in measured)
    usable = [trial for trial in measured if trial.meaning.kind == kind]
    folder = path if path.is_dir() else path.parent
    skin = json_table(folder / SKIN)
    if usable[0].meaning.are_all:
        _require_taxels(usable)
    shape = _announced(usable, skin, options)
    rest = rest_of([trial.samples for trial in usable], options)

    def recorded(trial: Measured) -> Trial:
        if trial.meaning.kind != kind:
            raise InputError(
                f"{trial.samples.where}: has {trial.meaning.kind:.80}, and most have "
                f"{kind:.80}; see --taxels and --time-unit"
            )
        meta: dict[str, Any] = {
            "skin": skin.raw,
            "labels": trial.labels,
            "source": path.name,
            "trial": trial.name,
        }
        if trial.samples.joints is not None:
            meta["arm"] = arm and arm.to_dict()
        return Trial(trial.name, rest.recording(trial.samples, shape, meta))

    yield from tried(measured, recorded, options.strict)


def _announced(
    usable: Sequence[Measured],
    skin: ConfigTable,
    options: TableOptions,
) -> tuple[int, int]:
    """The rows and columns of the skin; prints the columns used and ignored, once for
    all files."""
    first = usable[0]
    taxels = len(first.meaning.taxels)
    in_skin = skin.whole("rows", 1), skin.whole("cols", taxels)
    shape = skin_shape(first.samples, first.meaning.shape or in_skin, options)
    say("; ".join([first.meaning.text(first.label, shape), *first.form]))
    if options.axes is not None:
        say(options.axes.text)
    if len({str(trial.labels) for trial in usable}) == len(usable) > FEWEST_ALONE:
        say(f"each trial has a label of its own; {FIRST_WORDS % options.task}")
    return shape


def _require_taxels(measured: Sequence[Measured]) -> None:
    """Refuse columns without a name of which some count the rows or time, or tell the
    trials apart.

    Raises:
        InputError: there is one.
    """
    values = [pd.DataFrame(trial.samples.values[..., 0]) for trial in measured]
    if min(map(len, values)) < FEWEST_ROWS:
        return
    trials = pd.concat(values, keys=range(len(values))).groupby(level=0)
    steps = trials.diff().dropna()
    tells_apart = trials.first().nunique() > 1
    doubtful = (steps > 0.0).all() | ((steps == 0.0).all() & tells_apart)
    if doubtful.any() and not doubtful.all():
        first = measured[0]
        raise InputError(
            f"{first.samples.where}: column {first.meaning.taxels[doubtful.argmax()]} "
            "counts up, or tells the trials apart; name the taxels by --taxels"
        )


def _understood(source: Source, options: TableOptions) -> Measured:
    """The numbers of a trial."""
    axes = options.axes
    table = source.table if axes is None else parted(source.table, axes.normal)
    sense = meaning(table, options)
    t = times_of(table, sense, options)
    samples = Samples.of(table.where, t, table.values(sense.taxels), axes)
    if np.isnan(samples.values[..., 0]).all():
        raise InputError(f"{table.where}: none of its values is a finite number")
    rows = table.data.index
    if sense.joints:
        unit = np.pi / 180.0 if options.degrees else 1.0
        angles = unit * table.numbers(sense.joints)
        samples, rows = _with_joints(samples, rows, angles)
    # Without the table, which would fill the memory a second time where it is long.
    return Measured(
        source.name,
        source.labels,
        source.label,
        source.table.form,
        sense,
        samples.in_order(str(rows.name), rows),
    )


def _with_joints(
    samples: Samples, rows: pd.Index, angles: NDArray[np.float64]
) -> tuple[Samples, pd.Index]:
    """The frames and their rows, with joint angles that may stand in rows of their
    own."""
    where = samples.where
    known = np.isfinite(angles).all(axis=1)
    if known.all() or not known.any():
        return replace(samples, joints=clock.complete(angles, where)), rows
    felt = np.isfinite(samples.values).any(axis=(1, 2))
    t = samples.t[felt]
    at_frames = clock.angles_at(
        t,
        samples.t[known],
        angles[known],
        RELEASE_S,
        where,
        str(rows.name),
        rows[known],
    )
    joints = clock.complete(at_frames, where)
    return Samples(where, t, samples.values[felt], joints), rows[felt]
