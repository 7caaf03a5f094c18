"""List the labels of recordings, or change them.

Without --set, --unset, --accept and --delete, prints each recording's course
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
from dataclasses import replace
from pathlib import Path
from typing import Any

from edge.commands.output import LOG, Output, counted
from edge.commands.texts import labels_text
from edge.config import parse_json
from edge.errors import InputError
from edge.files import parsing, read_text, refusing
from edge.recording import Recording, load
from edge.saving import find, save
from edge.tools import review
from edge.tools.slips import counts_text, slips
from edge.tools.trial_options import task_label
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
            "give every recording named this label; repeat it for more tasks",
        ),
        (
            "--unset",
            "TASK",
            str,
            "take this task's label away; repeat it for more",
        ),
        (
            "--only",
            "WHICH",
            review.kind_or_task,
            "only recordings that are unsure, wrong or unlabelled, or that have a "
            "task; repeat it for recordings that are all of these",
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
        "--accept": "label kept touches as they were decided, in tasks without a label",
        "--delete": "delete the recordings",
        "--undo": "take the last change in a folder back",
        "--yes": "change the recordings without a question",
    }.items():
        parser.add_argument(option, action="store_true", help=text)


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
        return _delete(arguments, output, [path for path, _ in recordings])
    if arguments.accept or arguments.set or arguments.unset:
        return _relabel(arguments, output, recordings)
    _print(output, recordings)
    return 0


def _chosen(
    paths: Sequence[Path], kinds: Sequence[str]
) -> list[tuple[Path, Recording]]:
    """The recordings that are of all kinds, after interrupted changes are finished."""
    for folder in sorted({path.parent for path in paths}):
        finish_interrupted(folder)
    chosen = []
    for path in paths:
        recording = load(path)
        if review.selected(recording.meta, kinds):
            chosen.append((path, recording))
    return chosen


def _relabel(
    arguments: argparse.Namespace,
    output: Output,
    recordings: Sequence[tuple[Path, Recording]],
) -> int:
    """Show what labels become, ask, and change them."""
    changes = {}
    for path, recording in recordings:
        labels = review.accepted(recording.meta) if arguments.accept else {}
        labels |= arguments.set
        after = changed(
            str(path),
            recording.meta,
            labels,
            arguments.unset,
        )
        if recording.labels != after:
            changes[path] = after
    if not changes:
        output.text(f"none of {counted(len(recordings), 'recording')} would change")
        return 0
    for path, recording in recordings:
        if path in changes:
            old = _text(recording.labels)
            output.text(f"{path}: {old} becomes {_text(changes[path])}")
    if not _agreed(arguments, output, len(changes)):
        return 1
    change_all(changes)
    _print(output, [(path, load(path)) for path, _ in recordings])
    return 0


def _delete(
    arguments: argparse.Namespace,
    output: Output,
    paths: Sequence[Path],
) -> int:
    """Show what is deleted, ask, and delete it."""
    for path in paths:
        output.text(f"{path}: to be deleted")
    if not _agreed(arguments, output, len(paths)):
        return 1
    delete(paths)
    output.text(f"{counted(len(paths), 'recording')} deleted; --undo brings them back")
    return 0


def delete(paths: Sequence[Path]) -> None:
    """Delete recordings, so that `take_back` can bring them back.

    Raises:
        InputError: the system refuses it.
    """
    for folder in sorted({path.parent for path in paths}):
        with refusing(f"{folder}: its recordings cannot be deleted"):
            of_folder = [path for path in paths if path.parent == folder]
            # What cannot be deleted takes no former change away.
            for path in of_folder:
                path.lstat()
            shutil.rmtree(folder / DELETED, ignore_errors=True)
            (folder / DELETED).mkdir()
            (folder / UNDO).unlink(missing_ok=True)
            for path in of_folder:
                path.rename(folder / DELETED / path.name)


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
        brought += take_back(folder)
    if not brought:
        where = ", ".join(map(str, folders))
        raise InputError(f"{where}: there is no change to take back")
    for path in brought:
        output.text(f"{path}: is as it was before")
    return 0


def take_back(folder: Path) -> list[Path]:
    """Take the last change or deletion of recordings in a folder back; which they are.

    Raises:
        InputError: by now, another recording has the name of a deleted one.
    """
    deleted = sorted((folder / DELETED).glob("*.npz"))
    places = [folder / path.name for path in deleted]
    for place in places:
        if place.exists():
            raise InputError(f"{place}: exists again; rename it, and undo then")
    for path, place in zip(deleted, places, strict=True):
        path.rename(place)
    return [*places, *_carry_out(folder / UNDO)]


def _carry_out(journal: Path) -> list[Path]:
    """Give recordings the labels that a journal names, if there is one, and remove it.

    Returns:
        The recordings whose labels changed.

    Raises:
        InputError: the journal is damaged, or a recording cannot be written.
    """
    if not journal.is_file():
        return []
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
    journal.unlink()
    return relabelled


def change_all(changes: Mapping[Path, Mapping[str, str]]) -> None:
    """Give each recording its new labels: all of them, or a later start does.

    A journal beside the first file says what is to be done, until it is. Each folder
    keeps the former labels of its recordings.
    """
    former: dict[Path, dict[Path, Mapping[str, str]]] = {}
    for path in changes:
        former.setdefault(path.parent, {})[path] = load(path).labels
    for folder, labels in former.items():
        _note(folder / UNDO, labels)
        shutil.rmtree(folder / DELETED, ignore_errors=True)
    journal = next(iter(changes)).parent / JOURNAL
    _note(journal, changes)
    _carry_out(journal)


def _note(journal: Path, labels: Mapping[Path, Mapping[str, str]]) -> None:
    """Write a journal of the labels of recordings."""
    entries = [[str(path.absolute()), labels[path]] for path in labels]
    with write_whole(journal) as file:
        file.write(json.dumps(entries).encode())


def finish_interrupted(folder: Path) -> None:
    """Finish a change of labels that was interrupted, where a journal tells of one."""
    remove_leftovers(folder)
    if (folder / JOURNAL).is_file():
        finished = len(_carry_out(folder / JOURNAL))
        LOG.warning(
            f"{folder}: finished a change of labels that was interrupted: "
            f"{counted(finished, 'recording')}"
        )


def _agreed(arguments: argparse.Namespace, output: Output, count: int) -> bool:
    """Whether a person at the terminal agrees; a program has to say --yes.

    Raises:
        InputError: nobody can be asked.
    """
    recordings = counted(count, "recording")
    if arguments.yes:
        return True
    if output.as_json or not sys.stdin.isatty():
        raise InputError(f"{recordings} would change, as shown; add --yes to do it")
    if input(f"Change {recordings}? [y/N] ").lower() == "y":
        return True
    output.text("nothing is changed")
    return False


def _text(labels: Mapping[str, str]) -> str:
    return labels_text(labels, " ") or "no label"


def _decided_text(decided: Mapping[str, Mapping[str, Any]]) -> str:
    """The decisions of a kept touch, with their confidence and flags."""
    answers = []
    for task, answer in decided.items():
        sure = answer["confidence"]
        notes = [] if sure is None else [f"{sure:.0%}"]
        notes += answer["flags"]
        answers.append(f"{task}={answer['label']} {', '.join(notes)}".strip())
    return "; ".join(answers)


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


def changed(
    name: str,
    meta: Mapping[str, Any],
    labels: Mapping[str, str],
    without: Sequence[str] = (),
) -> dict[str, str]:
    """A recording's labels after a change.

    Args:
        name: of the recording.
        meta: its metadata.
        labels: {task: its new label}.
        without: tasks whose label is taken away.

    Raises:
        InputError: its contacts have their own labels.
    """
    if meta.get("contacts") and (labels or without):
        raise InputError(
            f"{name}: its contacts have labels of their own; `python -m train split` "
            "makes a recording of each"
        )
    after = {**meta.get("labels", {}), **labels}
    return {task: after[task] for task in after if task not in without}
