"""Labels of trials: the table beside the recordings, labels of a file made printable,
and tasks whose labels are made of two others' labels, as a category is softness by
mobility.
"""

import csv
import io
import logging
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from edge.errors import InputError, about
from edge.files import parsing, read_bytes

LOG = logging.getLogger(__name__)

Labels = Mapping[str, str]
"""{task: label} of a trial."""


def plain(labels: Labels, path: str) -> dict[str, str]:
    """Labels of a file without blanks at their ends, and with _ for what cannot be
    printed; a warning says so."""
    texts = []
    for text in (*labels, *labels.values()):
        letters = [c if c.isprintable() else "_" for c in text.strip()]
        texts.append("".join(letters) or "_")
    read = dict(zip(texts, texts[len(labels) :], strict=False))
    LOG.warning(f"{path}: the labels {dict(labels)} are read as {read}")
    return read


@dataclass(frozen=True)
class JointTask:
    """A task whose labels are those of its two factors, joined by a hyphen.

    Attributes:
        task: the joint task, such as category.
        factors: the two tasks, in the order of their labels in the joint task's.
    """

    task: str
    factors: tuple[str, str]

    def label(self, labels: Labels) -> str | None:
        """The joint task's label that follows from a trial's labels of both factors;
        None where it lacks one.

        >>> CATEGORY.label({"softness": "soft", "mobility": "fixed"})
        'soft-fixed'
        """
        if not labels.keys() >= set(self.factors):
            return None
        return "-".join(labels[factor] for factor in self.factors)

    def completed(self, labels: Labels) -> dict[str, str]:
        """A trial's labels, with those of the joint task or of its factors that follow
        from the others.

        >>> CATEGORY.completed({"category": "soft-fixed"})
        {'softness': 'soft', 'mobility': 'fixed', 'category': 'soft-fixed'}
        """
        implied: dict[str, str] = {}
        joined = self.label(labels)
        if labels.get(self.task, "").count("-") == 1:
            names = labels[self.task].split("-")
            implied = dict(zip(self.factors, names, strict=True))
        elif joined is not None:
            implied = {self.task: joined}
        return {**implied, **labels}

    def contradiction(self, labels: Labels) -> str:
        """A sentence on a trial whose label of the joint task is another than that of
        its factors; empty elsewhere."""
        implied = self.label(self.completed(labels))
        label = labels.get(self.task, implied)
        if implied is None or label == implied:
            return ""
        return (
            f"{self.task}={label!r} contradicts {' and '.join(self.factors)}, which say "
            f"{implied!r}"
        )


CATEGORY = JointTask("category", ("softness", "mobility"))
"""The paper's categories."""


TABLE = "labels.csv"
"""The table beside the recordings of a folder."""
FILE = "file"
LEFT_OUT = "left_out"
ANSWERS = {"": False, "no": False, "false": False, "0": False}
ANSWERS |= {"yes": True, "true": True, "x": True, "1": True}
"""What a cell of `left_out` may say, in capitals or not."""


class Standing(NamedTuple):
    """How a recording stands: {task: label}, and whether it is left out."""

    labels: dict[str, str]
    left_out: bool = False


class Row(NamedTuple):
    """What a table says of a recording: {task: label} for every column, empty where it
    has none; whether it is left out; and the line."""

    labels: dict[str, str]
    left_out: bool
    line: int


@dataclass(frozen=True)
class LabelTable:
    """The labels that stand beside recordings.

    Attributes:
        path: of the file.
        contents: its bytes; none without a file.
        delimiter: between its cells.
        rows: {file: what is said of it}.
    """

    path: Path
    contents: bytes = b""
    delimiter: str = ","
    rows: Mapping[str, Row] = field(default_factory=dict)

    def standing(self, file: str, meta: Mapping[str, Any]) -> Standing:
        """How a recording stands: its row wins over the labels in its metadata, for the
        tasks that have a column.

        Raises:
            InputError: its contacts have labels of their own, and the row has others.
        """
        recorded = meta.get("labels", {})
        row = self.rows.get(file)
        if row is None:
            return Standing(recorded)
        merged = {**recorded, **row.labels}
        labels = {task: label for task, label in merged.items() if label}
        if labels != recorded and isinstance(meta.get("contacts"), list):
            raise InputError(
                f"{self.path}: the contacts of {file} have labels of their own; change "
                "meta.contacts, and leave its labels in the table as they were recorded"
            )
        return Standing(labels, row.left_out)

    def encoded(self, standings: Mapping[str, Standing]) -> bytes:
        """A table of other rows, with the same delimiter, as a spreadsheet reads it.

        Raises:
            InputError: a task has the name of another column.
        """
        tasks = sorted(
            {task for standing in standings.values() for task in standing[0]}
        )
        for task in filter(_is_reserved, tasks):
            raise InputError(f"{self.path}: a task cannot be called {task}")
        text = io.StringIO()
        writer = csv.writer(text, delimiter=self.delimiter, lineterminator="\n")
        writer.writerow([FILE, *tasks, LEFT_OUT])
        for file, (labels, left_out) in sorted(standings.items()):
            cells = [labels.get(task, "") for task in tasks]
            writer.writerow([file, *cells, "yes" if left_out else ""])
        return text.getvalue().encode("utf-8-sig")


def read_table(folder: Path, column: str = FILE) -> LabelTable:
    """The table of a folder, UTF-8 as a spreadsheet writes it; an empty one where the
    folder has none.

    Args:
        folder: of the recordings.
        column: another name that the column of files may have.

    Raises:
        InputError: it is damaged, or has a file twice; the sentence names the line.
    """
    path = folder / TABLE
    if not os.path.lexists(path):
        return LabelTable(path)
    contents = read_bytes(path)
    kind = "a table of labels"
    with parsing(str(path), kind, "; save it as CSV in UTF-8, or undo the change"):
        text = contents.decode("utf-8-sig")
        head = text.partition("\n")[0]
        delimiter = max(",;\t", key=head.count)
        lines = csv.reader(
            io.StringIO(text, newline=""), delimiter=delimiter, strict=True
        )
        cells = [(lines.line_num, [cell.strip() for cell in line]) for line in lines]
    header = cells[0][1] if cells else []
    while header and not header[-1]:  # a spreadsheet may end lines with empty cells
        header.pop()
    with about(f"{path}, line 1"):
        _check_header(header, column)
    rows: dict[str, Row] = {}
    for line, values in cells[1:]:
        if any(values):
            with about(f"{path}, line {line}"):
                file, row = _row(header, column, values, line)
                if file in rows:
                    raise InputError(
                        f"{file} has line {rows[file].line} too; remove one of them"
                    )
            rows[file] = row
    return LabelTable(path, contents, delimiter, rows)


def _is_reserved(name: str) -> bool:
    """Whether a column's name is that of the files or of what is left out, perhaps
    misspelt."""
    return re.sub(r"[\W_]", "", name.casefold()) in ("file", "leftout")


def _check_header(header: Sequence[str], column: str) -> None:
    """Refuse columns that are missing, unknown or there twice."""
    if not {FILE, column} & set(header):
        raise InputError(f"has no column {column}")
    for name in header:
        if header.count(name) > 1:
            raise InputError(f"has the column {name!r} twice")
        if name not in (FILE, LEFT_OUT) and _is_reserved(name):
            raise InputError(
                f"the column {name!r} is unknown; write {FILE} or {LEFT_OUT}"
            )


def _row(
    header: Sequence[str], column: str, values: Sequence[str], line: int
) -> tuple[str, Row]:
    """The file of a line, and what the line says.

    Raises:
        InputError: a cell is missing, or has no column, or cannot be understood.
    """
    cells = dict(zip(header, values, strict=False))
    if len(values) < len(header) or any([*values[len(header) :], cells.pop("", "")]):
        raise InputError(f"has not the {len(header)} cells of the first line")
    file = cells.pop(FILE, "") or cells.pop(column, "")
    answer = cells.pop(LEFT_OUT, "")
    if not file:
        raise InputError("names no file")
    if answer.casefold() not in ANSWERS:
        raise InputError(f"{LEFT_OUT} is yes or empty, not {answer!r}")
    if not "".join([*cells, *cells.values()]).isprintable():
        raise InputError("has a label that cannot be printed")
    return file, Row(cells, ANSWERS[answer.casefold()], line)
