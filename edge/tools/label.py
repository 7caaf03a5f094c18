"""List the labels of recordings, or change them.

Without --set, --unset, --rename, --accept and --delete, prints each recording's course
of force, labels and decisions, how many recordings have each label, and which are
probably slips. With them, shows what would change, and with --yes writes the changed
recordings anew, each whole or not at all, if all of them can be read. --undo takes the
last change back. The next `make export` trains on the new labels.
"""

import argparse
import json
import shutil
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from edge.commands.options import task_label
from edge.commands.output import LOG, Output, counted
from edge.config import parse_json
from edge.errors import InputError
from edge.files import parsing, read_text, refusing
from edge.recording import Recording, load
from edge.saving import find, save
from edge.tools import review
from edge.tools.slips import counts_text, slips
from edge.writing import remove_leftovers, write_whole

JOURNAL = ".edge-classify-labels.json"
"""Beside recordings whose labels are being changed."""
UNDO = ".edge-classify-undo.json"
"""Beside the first of the recordings that were changed last: their former labels."""
LINE = 16
"""Characters of a recording's course."""
DELETED = ".edge-classify-deleted"
"""The folder of recordings that were deleted last."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument(
        "data", nargs="+", metavar="REC", help=".npz recordings or folders of them"
    )
    for option, metavar, text in (
        (
            "--set",
            "TASK=LABEL",
            "give every recording named this label; repeat it for more tasks",
        ),
        (
            "--rename",
            "OLD=NEW",
            "rename a task where a recording has it; repeat it for more",
        ),
    ):
        parser.add_argument(
            option,
            action="append",
            default=[],
            type=task_label,
            metavar=metavar,
            help=text,
        )
    parser.add_argument(
        "--unset",
        action="append",
        default=[],
        metavar="TASK",
        help="take this task's label away; repeat it for more",
    )
    parser.add_argument(
        "--only",
        action="append",
        default=[],
        type=review.kind_or_task,
        metavar="WHICH",
        help="only recordings that are unsure, wrong or unlabelled, or that have a task; "
        "repeat it for recordings that are all of these",
    )
    parser.add_argument(
        "--accept",
        action="store_true",
        help="label kept touches as they were decided",
    )
    parser.add_argument("--delete", action="store_true", help="delete the recordings")
    parser.add_argument(
        "--undo", action="store_true", help="take the last change in a folder back"
    )
    parser.add_argument(
        "--yes", action="store_true", help="change the recordings without a question"
    )


def run(arguments: argparse.Namespace) -> int:
    """Print the labels, or change those that are to be changed."""
    output = Output.of(arguments)
    if arguments.undo:
        return undo(arguments.data, output)
    every = find(arguments.data)
    recordings = _chosen(every, arguments.only)
    if not recordings:
        output.text(f"none of {counted(len(every), 'recording')} is of this kind")
        return 1
    if arguments.delete:
        paths = [path for path, _ in recordings]
        return _delete(output, paths, agreed=arguments.yes)
    if arguments.accept or arguments.rename or arguments.set or arguments.unset:
        return _relabel(arguments, output, recordings)
    _print(output, recordings)
    return 0


def _chosen(
    paths: Sequence[Path], kinds: Sequence[str]
) -> list[tuple[Path, Recording]]:
    """The recordings that are of all kinds, after interrupted changes are finished."""
    for folder in sorted({path.parent for path in paths}):
        finish_interrupted(folder)
    loaded = [(path, load(path)) for path in paths]
    return [
        (path, recording)
        for path, recording in loaded
        if review.selected(recording.meta, kinds)
    ]


def _relabel(
    arguments: argparse.Namespace,
    output: Output,
    recordings: Sequence[tuple[Path, Recording]],
) -> int:
    """Show what labels become, ask, and change them."""
    change = Change(dict(arguments.rename), dict(arguments.set), tuple(arguments.unset))
    differing = []
    for path, recording in recordings:
        meta = recording.meta
        labels = review.accepted(meta) if arguments.accept else {}
        relabelled = replace(change, labels={**labels, **change.labels})
        after = changed(str(path), meta, relabelled)
        if recording.labels != after.get("labels", {}):
            differing.append((path, after))
    if not differing:
        output.text("every recording has these labels already")
        return 0
    former = {path: recording.labels for path, recording in recordings}
    for path, after in differing:
        old = _text(former[path])
        output.text(f"{path}: {old} becomes {_text(after.get('labels', {}))}")
    if not (arguments.yes or _agreed(output, len(differing))):
        output.text("nothing is changed")
        return 1
    change_all(differing)
    _print(output, [(path, load(path)) for path, _ in recordings])
    return 0


def _delete(output: Output, paths: Sequence[Path], *, agreed: bool) -> int:
    """Delete recordings, so that they can be brought back."""
    for path in paths:
        output.text(f"{path}: is deleted")
    if not (agreed or _agreed(output, len(paths))):
        output.text("nothing is changed")
        return 1
    for folder in sorted({path.parent for path in paths}):
        bin_ = folder / DELETED
        with refusing(f"{folder}: its recordings cannot be deleted"):
            shutil.rmtree(bin_, ignore_errors=True)
            bin_.mkdir()
            for path in paths:
                if path.parent == folder:
                    path.rename(bin_ / path.name)
        (folder / UNDO).unlink(missing_ok=True)
    output.text(f"{counted(len(paths), 'recording')} deleted; --undo brings them back")
    return 0


def undo(data: Sequence[str], output: Output) -> int:
    """Take the last change of labels, or the last deletion, in some folders back.

    Raises:
        InputError: there is nothing to take back, or no such folder.
    """
    folders = sorted({Path(name) for name in data})
    brought = []
    for folder in folders:
        if not folder.is_dir():
            raise InputError(f"{folder}: --undo takes the folder of the recordings")
        brought += _brought_back(folder)
        brought += _labelled_back(folder / UNDO)
    if not brought:
        where = ", ".join(map(str, folders))
        raise InputError(f"{where}: there is no change to take back")
    for path in brought:
        output.text(f"{path}: is as it was before")
    return 0


def _brought_back(folder: Path) -> list[Path]:
    """Bring the deleted recordings of a folder back.

    Raises:
        InputError: another one has the name of one of them by now.
    """
    deleted = sorted((folder / DELETED).glob("*.npz"))
    places = [folder / path.name for path in deleted]
    for place in places:
        if place.exists():
            raise InputError(f"{place}: exists again; rename it, and undo then")
    for path, place in zip(deleted, places, strict=True):
        path.rename(place)
    return places


def _labelled_back(file: Path) -> list[Path]:
    """Give recordings the labels that a file of former ones holds, and remove it."""
    brought = _relabelled(file) if file.is_file() else []
    file.unlink(missing_ok=True)
    return brought


def _relabelled(journal: Path) -> list[Path]:
    """Give recordings the labels that a journal names; those that changed.

    Raises:
        InputError: the journal is damaged, or a recording cannot be written.
    """
    entries = parse_json(read_text(journal), str(journal))
    with parsing(str(journal), "a list of files and labels", "; delete it"):
        changes = [(Path(name), dict(labels)) for name, labels in entries]
    relabelled = []
    for path, labels in changes:
        if path.is_file():
            recording = load(path)
            if recording.labels != labels:
                meta = {**recording.meta, "labels": labels}
                save(path, replace(recording, meta=meta))
                relabelled.append(path)
    return relabelled


def change_all(metas: Sequence[tuple[Path, Mapping[str, Any]]]) -> None:
    """Write recordings anew with other metadata: all of them, or a later start does.

    A journal beside the first file says what is to be done, until it is.
    """
    journal = metas[0][0].parent / JOURNAL
    entries = [[str(path.absolute()), meta["labels"]] for path, meta in metas]
    with write_whole(journal) as file:
        file.write(json.dumps(entries).encode())
    former = []
    for path, meta in metas:
        recording = load(path)
        former.append([str(path.absolute()), recording.labels])
        save(path, replace(recording, meta=dict(meta)))
    with write_whole(journal.with_name(UNDO)) as file:
        file.write(json.dumps(former).encode())
    shutil.rmtree(journal.with_name(DELETED), ignore_errors=True)
    journal.unlink()


def finish_interrupted(folder: Path) -> None:
    """Finish a change of labels that was interrupted, where a journal tells of one."""
    remove_leftovers(folder)
    journal = folder / JOURNAL
    if not journal.is_file():
        return
    finished = len(_relabelled(journal))
    journal.unlink()
    LOG.warning(
        f"{folder}: finished a change of labels that was interrupted: "
        f"{counted(finished, 'recording')}"
    )


def _agreed(output: Output, count: int) -> bool:
    """Whether a person at the terminal agrees; a program has to say --yes.

    Raises:
        InputError: nobody can be asked.
    """
    if output.as_json or not sys.stdin.isatty():
        raise InputError(
            f"{counted(count, 'recording')} would change, as shown; add --yes to do it"
        )
    return input(f"Change {counted(count, 'recording')}? [y/N] ").lower() == "y"


def _text(labels: Mapping[str, str]) -> str:
    parts = (f"{task}={label}" for task, label in labels.items())
    return " ".join(parts) or "no label"


def _decided_text(decided: Mapping[str, Mapping[str, Any]]) -> str:
    """The decisions of a kept touch, with their confidence and flags."""
    parts = []
    for task, answer in decided.items():
        sure = answer["confidence"]
        notes = [] if sure is None else [f"{sure:.0%}"]
        notes += answer["flags"]
        parts.append(f"{task}={answer['label']} {', '.join(notes)}".strip())
    return "; ".join(parts)


def _print(output: Output, recordings: Sequence[tuple[Path, Recording]]) -> None:
    """Print each recording's course and labels, how many have each label, and probable
    slips."""
    width = max(len(str(path)) for path, _ in recordings)
    labels = [recording.labels for _, recording in recordings]
    for path, recording in recordings:
        decided = review.decisions(recording.meta)
        event: dict[str, Any] = {
            "event": "labels",
            "file": str(path),
            "labels": recording.labels,
            "kinds": review.kinds(recording.meta),
        }
        line = review.sparkline(review.curve(recording, LINE))
        text = f"{path!s:<{width}}  {line}  {_text(recording.labels)}"
        if decided:
            event["decided"] = decided
            text += f" (decided: {_decided_text(decided)})"
        output.event(event, text)
    for sentence in counts_text(labels):
        output.text(sentence)
    for sentence in slips(labels):
        output.text(f"probably a slip: {sentence}")


@dataclass(frozen=True)
class Change:
    """A change of labels.

    Attributes:
        names: {task: its new name}.
        labels: {task: its new label}.
        without: tasks whose label is taken away.
    """

    names: Mapping[str, str] = field(default_factory=dict)
    labels: Mapping[str, str] = field(default_factory=dict)
    without: Sequence[str] = ()


def changed(name: str, meta: Mapping[str, Any], change: Change) -> dict[str, Any]:
    """A recording's metadata with other labels.

    Raises:
        InputError: the recording has a task of the new name, or its contacts have their
            own labels.
    """
    current = meta.get("labels", {})
    names = change.names
    for old, new in names.items():
        if old in current and new in current:
            raise InputError(
                f"{name}: has a label for {new} already; {old} cannot take its name"
            )
    if meta.get("contacts") and (names or change.labels or change.without):
        raise InputError(
            f"{name}: its contacts have labels of their own; `python -m train split` "
            "makes a recording of each"
        )
    renamed = {names.get(task, task): label for task, label in current.items()}
    labels = {**renamed, **change.labels}
    for task in change.without:
        labels.pop(task, None)
    return {**meta, "labels": labels}
