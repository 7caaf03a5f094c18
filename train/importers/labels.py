"""The labels of trials: those of labels.csv, or else those that the files tell, by a
column of texts, by their names, or by their folders."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd

from edge.config import short_text
from edge.errors import InputError
from edge.record.labels import TABLE, LabelTable, Row, read_table
from train.importers.forms.file import inner
from train.importers.forms.long import plain
from train.importers.forms.text import is_number
from train.importers.options import TableOptions
from train.importers.table import Table

LABEL = re.compile(
    r"\A(?:labels?|class(?:[ _]?name)?|category|target|object|material)\Z", re.I
)
"""Names of a column that holds labels."""
NUMBERED = re.compile(r"(?:trial|rec|recording|run|take|sample|test)?[\s_.-]*\d+", re.I)
"""Names of folders that only count trials."""
LABEL_AND_ID = re.compile(r"[^.]*[^\W\d_][^.]*\.[\w.-]+")
"""A name of Edge Impulse: LABEL.ID, or LABEL.ID.MORE."""
COUNT = r"[\s_.-]*\(?\d+\)?$"
"""A number at the end of a name."""
NO_TEXT = "\0"
"""Stands for a text where a trial has no such column."""
FEWEST_ALONE = 3
"""Trials that may all have another label."""
NONE = "none, as the files' names only count"


@dataclass(frozen=True)
class Place:
    """What tells the labels of a trial.

    Attributes:
        name: of the trial.
        path: of its file, or folder of frames, from the folder of all.
        labels, label: that the file's own form tells, see `Table`.
        texts: {column: text} of those that hold one text in all rows; "" where a column
            of labels holds several.
    """

    name: str
    path: Path
    labels: Mapping[str, str] = field(default_factory=dict)
    label: str = ""
    texts: Mapping[str, str] = field(default_factory=dict)

    @property
    def stem(self) -> str:
        """The file's name without its suffix."""
        return inner(self.path).stem if self.path.suffix else self.path.name


@dataclass(frozen=True)
class Labels:
    """The labels of trials.

    Attributes:
        of: {task: label} of each trial, in their order.
        source: where they come from, in words.
        columns: of labels.
        slips: a sentence for each row of labels.csv, or trial, that has no partner.
        left_out: the names of trials that labels.csv leaves out.
    """

    of: Sequence[Mapping[str, str]]
    source: str
    columns: frozenset[str] = frozenset()
    slips: Sequence[str] = ()
    left_out: frozenset[str] = frozenset()

    @property
    def warning(self) -> str:
        """A sentence where each trial has a label of its own; else empty."""
        texts = [str(labels) for labels in self.of]
        if not FEWEST_ALONE < len(set(texts)) == len(texts):
            return ""
        return (
            f"each trial has a label of its own, by {self.source}; --label 1 takes the "
            "first word of each name, --label folder the folder's, and a file labels.csv "
            "(columns file and object) tells them one by one"
        )


def texts_in(table: Table) -> dict[str, str]:
    """The `texts` of a `Place`."""
    texts = {}
    for name, cells in table.data.items():
        is_text = not pd.api.types.is_numeric_dtype(cells)
        is_label = LABEL.fullmatch(str(name))
        filled = cells.dropna().unique() if is_text or is_label else []
        if len(filled) == 1:
            texts[str(name)] = plain(filled[0])
        elif len(filled) and is_text and is_label:
            texts[str(name)] = ""
    return texts


def labels_of(
    places: Sequence[Place], folder: Path, options: TableOptions, others: Iterable[str]
) -> Labels:
    """The labels of trials, by labels.csv where the folder has one.

    Args:
        places: of the trials.
        folder: of their files.
        options: of the command.
        others: names of the files that are no trials.

    Raises:
        InputError: labels.csv is damaged or names none of the trials, or an option
            names a column or word that is not there.
    """
    stated = _stated_labels(places, options)
    table = read_table(folder, "trial")
    if not table.contents:
        return stated
    rows = _by_trial(table)
    names = [place.name for place in places]
    if not set(names) & rows.keys():
        raise InputError(
            f"{table.path}: needs a column file with names such as {short_text(names)}"
        )
    labels = []
    for place in places:
        of_row = rows[place.name].labels if place.name in rows else {}
        merged = {**place.labels, **of_row}
        labels.append({task: label for task, label in merged.items() if label})
    left_out = frozenset(name for name, row in rows.items() if row.left_out)
    slips = _slips(table.path, rows, names, others)
    return Labels(labels, TABLE, slips=list(slips), left_out=left_out)


def _slips(
    path: Path, rows: Mapping[str, Row], names: Sequence[str], others: Iterable[str]
) -> Iterator[str]:
    """A sentence for each row of labels.csv whose name no file has, and for each trial
    that has no row."""
    files = {*names, *others}
    for name, row in rows.items():
        if name not in files:
            yield f"{path}, line {row.line}: {name} names no file"
    for name in names:
        if name not in rows:
            yield f"{path}: has no row for {name}, which has no label"


def _by_trial(table: LabelTable) -> dict[str, Row]:
    """{name of the trial: its row} of a labels.csv, whose files may have suffixes.

    Raises:
        InputError: a trial has two rows.
    """
    rows = {}
    for file, row in table.rows.items():
        name = re.sub(r"\.(?:npz|csv|txt|json|npy|mat)$", "", file).replace("/", "_")
        if name in rows:
            raise InputError(f"{table.path}: {name} has two rows; remove one of them")
        rows[name] = row
    return rows


def _stated_labels(places: Sequence[Place], options: TableOptions) -> Labels:
    """The labels that the files tell."""
    if options.label:
        return _stated(places, options.label, options.task)
    if any(place.label for place in places):
        return Labels([place.labels for place in places], places[0].label)
    texts = pd.DataFrame([dict(place.texts) for place in places], dtype=object)
    columns = [name for name in texts if _is_label(name, texts[name], places)]
    if not columns:
        return _by_name(places, options.task)
    table = texts[columns]
    table = table.rename(columns=lambda name: LABEL.sub(options.task, name))
    of = [row.dropna().to_dict() for _, row in table.iterrows()]
    return Labels(of, f"column {', column '.join(columns)}", frozenset(columns))


def _is_label(name: str, column: pd.Series, places: Sequence[Place]) -> bool:
    """Whether a column of texts is one of labels: it is called so, or some of its texts
    are those of several trials.

    Raises:
        InputError: it is called so, and changes within a trial.
    """
    texts = [*column.fillna(NO_TEXT)]
    different = set(texts)
    is_called = bool(LABEL.fullmatch(name))
    if "" in different:
        raise InputError(
            f"{places[texts.index('')].path}: column {name} changes within the file; part "
            "it there, or tell labels otherwise, such as by --label 1 or --label folder"
        )
    if all(text == NO_TEXT or is_number(text) for text in texts):
        return is_called and len(different) > 1
    return is_called or 1 < len(different) < len(texts)


def _stated(places: Sequence[Place], label: str, task: str) -> Labels:
    """The labels that `--label` tells: a word of the names, a folder, or a column."""
    of = []
    for place in places:
        words = re.split(r"[\s_.-]+", place.stem)
        text = place.texts.get(label)
        if label == "folder":
            text = place.path.parent.name
        elif label.isdigit() and text is None:
            text = dict(enumerate(words, 1)).get(int(label))
        if not text:
            raise InputError(
                f"{place.path}: has no label by --label {label}: the words of its name "
                f"are {short_text(words)}, its texts {short_text(dict(place.texts))}"
            )
        of.append({task: text})
    kind = {"folder": "the folder's name"}.get(label, f"column {label}")
    kind = f"word {label} of the file's name" if label.isdigit() else kind
    return Labels(of, kind, frozenset([label]))


def _by_name(places: Sequence[Place], task: str) -> Labels:
    """The labels that the names of files and folders tell."""
    counting = _counting([place.path for place in places])
    are_ids = all(LABEL_AND_ID.fullmatch(place.stem) for place in places)
    named = [_name(place, counting, are_ids) for place in places]
    name, source = named[0]
    of = [{task: label} if label else {} for label, _ in named]
    return Labels(of, f'{source}, such as "{name}"' if name else NONE)


def _name(place: Place, counting: set[str], has_id: bool) -> tuple[str, str]:
    """The label that a name tells, or an empty one, and the part of the name that
    tells it."""
    folders = [part for part in place.path.parts[:-1] if part not in counting]
    if folders:
        return folders[-1], "the folder's name"
    if has_id:
        return place.stem.partition(".")[0], "the file's name before the first dot"
    name = re.sub(COUNT, "", place.stem)
    return name, "the file's name without the number at its end"


def _counting(paths: Sequence[Path]) -> set[str]:
    """The names of folders that only count trials: words such as trial_1, and on each
    level below the first, names that differ in their numbers alone."""
    counting = set()
    for level in range(max(len(path.parts) for path in paths)):
        names = {path.parts[level] for path in paths if path.parts[level + 1 :]}
        stems = {re.sub(r"[\d\W_]+$", "", name) for name in names}
        if level and len(stems) == 1 and stems.isdisjoint(names):
            counting |= names
        counting |= set(filter(NUMBERED.fullmatch, names))
    return counting
