"""List the labels of recordings, or change them.

Without --set and --rename, prints each recording's labels, and how many recordings have
each. With them, writes the changed recordings anew, each whole or not at all, if all of
them can be read. The next `make export` trains on the new labels.
"""

import argparse
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from edge.commands.options import task_label
from edge.commands.output import Output
from edge.errors import InputError
from edge.recording import find, load, save


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


def run(arguments: argparse.Namespace) -> int:
    """Print the labels, after changing those that are to be changed."""
    output = Output.of(arguments)
    names, labels = dict(arguments.rename), dict(arguments.set)
    paths = find(arguments.data)
    metas = [changed(str(path), load(path).meta, names, labels) for path in paths]
    counts: Counter[tuple[str, str]] = Counter()
    width = max(len(str(path)) for path in paths)
    for path, meta in zip(paths, metas, strict=True):
        if names or labels:
            save(path, replace(load(path), meta=meta))
        current = meta.get("labels", {})
        counts.update(current.items())
        text = (
            " ".join(f"{task}={label}" for task, label in current.items()) or "no label"
        )
        event = {"event": "labels", "file": str(path), "labels": current}
        output.event(event, f"{path!s:<{width}}  {text}")
    for (task, label), count in sorted(counts.items()):
        output.text(f"{count:>6} of {len(paths)}  {task}={label}")
    return 0


def changed(
    name: str,
    meta: Mapping[str, Any],
    names: Mapping[str, str],
    labels: Mapping[str, str],
) -> dict[str, Any]:
    """A recording's metadata with tasks renamed (`names`), and with new labels.

    Raises:
        InputError: the recording has a task of the new name, or its contacts have their
            own labels.
    """
    current = meta.get("labels", {})
    for old, new in names.items():
        if old in current and new in current:
            raise InputError(
                f"{name}: has a label for {new} already; {old} cannot take its name"
            )
    if meta.get("contacts") and (names or labels):
        raise InputError(
            f"{name}: its contacts have labels of their own; `python -m train split` "
            "makes a "
            "recording of each"
        )
    renamed = {names.get(task, task): label for task, label in current.items()}
    return {**meta, "labels": {**renamed, **labels}}
