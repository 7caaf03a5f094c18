"""List the labels of recordings, or change them.

Without --set, --unset, --accept and --delete, prints each recording's labels and
decisions, how many recordings have each label, and which are probably slips. With
them, shows what would change, and with --yes writes the changed recordings anew, each
whole or not at all, if all of them can be read. --undo takes the last change back. The next
`make export` trains on the new labels.
"""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from edge.commands.output import Output, counted
from edge.commands.texts import labels_text
from edge.errors import InputError
from edge.recording import Recording, load
from edge.saving import alone, change_all, find, take_back
from edge.tools import review
from edge.tools.slips import counts_text, slips
from edge.tools.trial_options import task_label


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
            str,
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
        "--yes": "change the recordings, which else are only shown",
    }.items():
        parser.add_argument(option, action="store_true", help=text)


def run(arguments: argparse.Namespace) -> int:
    """Print the labels, or change those that are to be changed."""
    output = Output.of(arguments)
    if arguments.undo:
        return undo(arguments.data, output)
    tasks = {*arguments.unset, *dict(arguments.set)}
    if len(tasks) < len(arguments.unset + arguments.set):
        raise InputError("--set and --unset name a task twice; name it once")
    paths = find(arguments.data)
    changes = any((arguments.accept, arguments.set, arguments.unset, arguments.delete))
    # Nobody else changes what is changed here, from its reading on.
    with alone(path.parent for path in paths if changes):
        recordings = []
        for path in paths:
            recording = load(path)
            if review.selected(recording.meta, arguments.only):
                recordings.append((path, recording))
        if not recordings:
            output.text(f"none of {counted(len(paths), 'recording')} is of this kind")
            return 1
        if changes:
            return _change(arguments, output, recordings)
        _print(output, recordings)
        return 0


def _change(
    arguments: argparse.Namespace,
    output: Output,
    recordings: Sequence[tuple[Path, Recording]],
) -> int:
    """Show what becomes of recordings, and change them.

    Raises:
        InputError: --yes is missing.
    """
    changes: dict[Path, dict[str, str] | None] = {}
    for path, recording in recordings:
        after = None
        if not arguments.delete:
            after = changed(
                str(path),
                recording.meta,
                dict(arguments.set),
                arguments.unset,
                accepts=arguments.accept,
            )
        if recording.labels != after:
            changes[path] = after
            becomes = "is deleted" if after is None else f"becomes {_text(after)}"
            output.text(f"{path}: {_text(recording.labels)} {becomes}")
    if not changes:
        output.text(f"none of {counted(len(recordings), 'recording')} would change")
        return 0
    number = counted(len(changes), "recording")
    if not arguments.yes:
        raise InputError(f"{number} would change, as shown; add --yes to do it")
    change_all(changes)
    if arguments.delete:
        output.text(f"{number} deleted; --undo brings them back")
    else:
        _print(output, [(path, load(path)) for path, _ in recordings])
    return 0


def undo(data: Sequence[str], output: Output) -> int:
    """Take the last change of labels, or the last deletion, in some folders back.

    Raises:
        InputError: there is nothing to take back, or no such folder.
    """
    folders = sorted({Path(name) for name in data})
    for folder in folders:
        if not folder.is_dir():
            raise InputError(f"{folder}: --undo takes the folder of the recordings")
    with alone(folders):
        paths = take_back(folders)
    if not paths:
        where = ", ".join(map(str, folders))
        raise InputError(f"{where}: there is no change to take back")
    for path in paths:
        output.text(f"{path}: is as it was before")
    return 0


def _text(labels: Mapping[str, str]) -> str:
    return labels_text(labels, " ") or "no label"


def _decided_text(decided: Mapping[str, Mapping[str, Any]]) -> str:
    """The decisions of a kept touch, with their confidence and flags."""
    answers = []
    for task, answer in decided.items():
        confidence = answer["confidence"]
        notes = [] if confidence is None else [f"{confidence:.0%}"]
        notes += answer["flags"]
        answers.append(f"{task}={answer['label']} {', '.join(notes)}".strip())
    return "; ".join(answers)


def _print(output: Output, recordings: Sequence[tuple[Path, Recording]]) -> None:
    """Print each recording's labels, how many have each label, and probable slips."""
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
        text = f"{path!s:<{width}}  {_text(recording.labels)}"
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
    *,
    accepts: bool = False,
) -> dict[str, str]:
    """A recording's labels after a change.

    Args:
        name: of the recording.
        meta: its metadata.
        labels: {task: its new label}.
        without: tasks whose label is taken away.
        accepts: the other tasks that lack a label get that of their decision.

    Raises:
        InputError: its contacts have their own labels.
    """
    before = meta.get("labels", {})
    after = {**before, **labels}
    if accepts:
        after |= review.accepted({**meta, "labels": after})
    for task in without:
        after.pop(task, None)
    if meta.get("contacts") and after != before:
        raise InputError(
            f"{name}: its contacts have labels of their own; change meta.contacts"
        )
    return after
