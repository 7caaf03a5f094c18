"""List the labels of recordings, or change them.

Prints each recording's labels and decisions, how many recordings have each label, and
which are probably slips. With --set, --unset, --accept, --leave-out or --put-back, shows
what would change, and with --yes writes it into labels.csv beside the recordings, which
wins over their own labels. Recordings stay as they are. --undo takes the last change
back. The next `make export` trains on the new labels.
"""

import argparse
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from edge.app import review
from edge.app.options import task_label
from edge.app.output import Output
from edge.app.review import Touch, changed
from edge.app.texts import labels_text
from edge.errors import InputError, counted
from edge.record.changes import FORMER, Change, change, former, now, undo
from edge.record.labels import LabelTable, Standing, read_table
from edge.record.recording import read_meta
from edge.record.saving import listed, warn_of_gone
from edge.record.slips import counts_text, slips

CHANGES = ("set", "unset", "accept", "leave_out", "put_back", "rows")
"""Options that change something."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument(
        "data",
        nargs="+",
        metavar="REC",
        help=".npz recordings or folders of them",
    )
    for option, metavar, kind, text in (
        (
            "--set",
            "TASK=LABEL",
            task_label,
            "label for every recording named; repeat it for more tasks",
        ),
        (
            "--unset",
            "TASK",
            str,
            "task whose label is taken away; repeat it for more",
        ),
        (
            "--only",
            "WHICH",
            str,
            "recordings that are unsure, wrong, unlabelled or left_out, that have a "
            "task, or a label (object=cupp); repeat it for those that are all of these",
        ),
    ):
        parser.add_argument(
            option,
            action="append",
            default=[],
            type=kind,
            metavar=metavar,
            help=text,
        )
    for option, text in {
        "--accept": "labels of kept touches as they were decided, in tasks without one",
        "--leave-out": "recordings named are left out by whatever reads the folder",
        "--put-back": "recordings that were left out are taken in again",
        "--rows": "a row for each recording, to go on in a spreadsheet",
        "--undo": "the last change in a folder is taken back",
        "--yes": "change of the labels, which else are only shown",
    }.items():
        parser.add_argument(option, action="store_true", help=text)


def run(arguments: argparse.Namespace) -> int:
    """Print the labels, or change those that are to be changed."""
    output = Output.of(arguments)
    if arguments.undo:
        return _undo(arguments.data, output)
    tasks = {*arguments.unset, *dict(arguments.set)}
    if len(tasks) < len(arguments.unset + arguments.set):
        raise InputError("--set and --unset name a task twice; name it once")
    table_of = cache(read_table)
    paths = listed(arguments.data)
    warn_of_gone(paths, table_of)
    touches = read(paths, table_of)
    selected = review.selected(touches, arguments.only)
    if not selected:
        output.text(f"none of {counted(len(touches), 'recording')} is of this kind")
        return 1
    if any(map(vars(arguments).get, CHANGES)):
        return _change(arguments, output, selected)
    _print(output, selected)
    return 0


def read(paths: Iterable[Path], table_of: Callable[[Path], LabelTable]) -> list[Touch]:
    """The recordings of some files."""
    return review.touches({path: read_meta(path) for path in paths}, table_of)


def _change(
    arguments: argparse.Namespace,
    output: Output,
    touches: Sequence[Touch],
) -> int:
    """Show what becomes of recordings, and change their labels.

    Raises:
        InputError: --yes is missing, or a recording has been changed meanwhile.
    """
    by_folder = _shown(arguments, output, touches)
    if not by_folder:
        output.text(f"none of {counted(len(touches), 'recording')} would change")
        return 0
    number = counted(sum(map(len, by_folder.values())), "recording")
    if not arguments.yes:
        raise InputError(f"{number} would change, as shown; add --yes to do it")
    when = now()
    tables = {}
    for folder, changes in by_folder.items():
        tables[folder] = change(folder, changes, when, arguments.command)
    paths = [folder / file for folder in by_folder for file in by_folder[folder]]
    _print(output, read(paths, tables.__getitem__))
    return 0


def _shown(
    arguments: argparse.Namespace, output: Output, touches: Sequence[Touch]
) -> dict[Path, dict[str, Change]]:
    """{folder: {file: what changes}}, which is shown."""
    by_folder: dict[Path, dict[str, Change]] = {}
    for touch in touches:
        path = touch.path
        before = touch.standing
        after = _after(arguments, touch)
        if after != before:
            output.text(f"{path}: {_text(before)} becomes {_text(after)}")
        if after != before or (arguments.rows and touch.place == str(path)):
            by_folder.setdefault(path.parent, {})[path.name] = Change(before, after)
    return by_folder


def _after(arguments: argparse.Namespace, touch: Touch) -> Standing:
    """How a recording stands after the change."""
    labels = changed(
        touch.meta,
        touch.standing.labels,
        dict(arguments.set),
        arguments.unset,
        accepts=arguments.accept,
    )
    left_out = touch.standing.left_out or arguments.leave_out
    return Standing(labels, left_out and not arguments.put_back)


def _undo(data: Sequence[str], output: Output) -> int:
    """Take the last change back, in all the folders in which it was made.

    Raises:
        InputError: there is nothing to take back, or no such folder.
    """
    places = []
    for name in data:
        if not os.path.isdir(name):
            raise InputError(f"{name}: --undo takes the folder of the recordings")
        places += [path.parent for path in Path(name).rglob(FORMER)]
    last = list(filter(None, map(former, places)))
    if not last:
        raise InputError(f"{', '.join(data)}: there is no change to take back")
    latest = max(table.time for table in last)
    for table in last:
        if table.time == latest:
            folder = undo(table)
            output.text(
                f"{folder}: is as before `{table.command}` of {latest[:19]} UTC"
            )
    return 0


def _text(standing: Standing) -> str:
    labels = labels_text(standing.labels, " ") or "no label"
    return f"{labels} (left out)" if standing.left_out else labels


def _decided_text(decided: Mapping[str, Mapping[str, Any]]) -> str:
    """The decisions of a kept touch, with their confidence and flags."""
    answers = []
    for task, answer in decided.items():
        confidence = answer["confidence"]
        notes = [] if confidence is None else [f"{confidence:.0%}"]
        notes += answer["flags"]
        answers.append(f"{task}={answer['label']} {', '.join(notes)}".strip())
    return "; ".join(answers)


def _print(output: Output, touches: Sequence[Touch]) -> None:
    """Print each recording's labels, how many have each label, and probable slips."""
    width = max(len(str(touch.path)) for touch in touches)
    for touch in touches:
        path, meta, standing, _ = touch
        decided = review.decisions(meta)
        event: dict[str, Any] = {
            "event": "labels",
            "file": str(path),
            "labels": standing.labels,
            "kinds": touch.kinds,
        }
        text = f"{path!s:<{width}}  {_text(standing)}"
        if decided:
            event["decided"] = decided
            text += f" (decided: {_decided_text(decided)})"
        output.event(event, text)
    in_use = [touch for touch in touches if not touch.standing.left_out]
    labels = [touch.standing.labels for touch in in_use]
    for sentence in counts_text(labels):
        output.text(sentence)
    for sentence in slips(labels, [touch.place for touch in in_use]):
        output.text(f"probably a slip: {sentence}")
