"""Turn another lab's data into recordings.

Writes one recording for each trial; existing files of the same name are replaced. Data
without thresholds get those that `python -m train thresholds` proposes. To add a
format, see train/importers/__init__.py.
"""

import argparse
import logging
import os
import re
import sys
from collections import Counter
from collections.abc import Iterator, Sequence, Set
from dataclasses import replace
from importlib import import_module
from pathlib import Path

from edge.errors import InputError, printable
from edge.recording import Recording, load
from edge.saving import save
from edge.tools.trial_options import add_arm, open_arm
from edge.touch.arm import Chain
from edge.writing import remove_leftovers
from train import former_recordings
from train.data.broken import BrokenTaxels
from train.data.thresholds import count_felt, proposed
from train.importers import Refused, Trial, names
from train.progress import bar, say

LOG = logging.getLogger(__name__)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add a command for each format, and its options."""
    formats = parser.add_subparsers(title="formats", metavar="FORMAT", required=True)
    for name in names():
        module = import_module(f"train.importers.{name}")
        headline, _, more = (module.__doc__ or name).partition("\n\n")
        command = formats.add_parser(
            name,
            help=headline,
            description=f"{headline}\n\n{more}",
        )
        command.add_argument("file", type=Path, help="the file or folder")
        command.add_argument(
            "--out",
            required=True,
            type=Path,
            help="folder for the recordings",
        )
        add_arm(command, "to select and order a log's joint angles by name")
        if hasattr(module, "add_options"):
            module.add_options(command)
        command.set_defaults(importer=module)


def run(arguments: argparse.Namespace) -> int:
    """Write the recordings."""
    arm = open_arm(arguments)
    # Path.exists raises for a name that is too long.
    if not os.path.exists(arguments.file):
        raise InputError(f"{arguments.file}: no such file or folder")
    if arguments.file.name in ("", ".."):  # a bag is a folder, perhaps the current one
        arguments.file = arguments.file.resolve()
    remove_leftovers(arguments.out)
    importer = arguments.importer
    options = (arguments,) if hasattr(importer, "add_options") else ()
    first = FirstOfEachKind()
    handlers = logging.getLogger("edge").handlers
    for handler in handlers:
        handler.addFilter(first)
    try:
        return write(importer.trials(arguments.file, arm, *options), arm, arguments)
    finally:
        for handler in handlers:
            handler.removeFilter(first)
        if first.withheld:
            LOG.warning(f"{first.withheld} more warnings like these")


class FirstOfEachKind(logging.Filter):
    """Lets the first through of the warnings that differ in names and numbers alone."""

    def __init__(self) -> None:
        super().__init__()
        self._kinds: Counter[str] = Counter()

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether no warning of its kind came before."""
        without_name = record.getMessage().rpartition(": ")[2]
        kind = re.sub(r"[\d.e+-]*\d", "#", without_name)
        self._kinds[kind] += 1
        return self._kinds[kind] == 1

    @property
    def withheld(self) -> int:
        """Number of warnings that were not let through."""
        return self._kinds.total() - len(self._kinds)


def write(
    trials: Iterator[Trial | Refused],
    arm: Chain | None,
    arguments: argparse.Namespace,
) -> int:
    """Write the recordings of an importer; the exit status."""
    without_threshold: list[tuple[Path, Recording]] = []
    taxels = BrokenTaxels()
    paths: set[Path] = set()
    skipped: list[str] = []
    for result in bar(trials, desc="importing", unit=" trials"):
        if isinstance(result, Refused):
            skipped.append(result.sentence)
            continue
        name, recording = result
        _require_joints(recording, arm, arguments.file)
        try:
            path = _path(arguments, name, paths)
        except InputError as error:
            if getattr(arguments, "strict", True):
                raise
            skipped.append(str(error))
            continue
        paths.add(path)
        taxels.add(recording)
        if "threshold_counts" in recording.meta["skin"]:
            save(path, recording)
        else:
            without_threshold.append((path, recording))
    if skipped and not paths:
        raise InputError(skipped[0])
    if without_threshold:
        print(set_thresholds(without_threshold))
    for warning in taxels.notes(load(min(paths)).layout) if paths else ():
        say(warning)
    print(f"recordings written to {arguments.out}: {len(paths)}")
    return _status(arguments.out, paths, skipped)


def _status(folder: Path, paths: Set[Path], skipped: Sequence[str]) -> int:
    """Say what else the folder holds, and what was left out; 1 if anything was."""
    for warning in former_recordings.warnings(folder, paths):
        say(warning)
    for sentence in skipped:
        print(printable(f"skipped: {sentence}"), file=sys.stderr)
    return int(bool(skipped))


def _require_joints(recording: Recording, arm: Chain | None, file: Path) -> None:
    if arm is not None and recording.joints is None:
        raise InputError(f"{file}: holds no joint angles; leave --arm out")


def _path(arguments: argparse.Namespace, name: str, paths: Set[Path]) -> Path:
    """The file of a trial, which is none of those before it.

    Raises:
        InputError: the name is impossible, or taken.
    """
    path: Path = arguments.out / f"{name}.npz"
    if not name or path.parent != arguments.out:
        raise InputError(
            f"{arguments.file}: the trial {name!r} needs a name that a file can have"
        )
    if path in paths:
        raise InputError(
            f"{arguments.file}: two trials are named {name}; rename one of them"
        )
    return path


def set_thresholds(trials: Sequence[tuple[Path, Recording]]) -> str:
    """Save trials with the thresholds that their noise suggests; returns a report."""
    recordings = [recording for _, recording in trials]
    proposal = proposed(recordings)
    threshold = proposal.threshold
    onset = proposal.onset
    for path, recording in trials:
        skin = {"threshold_counts": threshold, "onset_counts": onset}
        meta = {**recording.meta, "skin": {**recording.meta["skin"], **skin}}
        save(path, replace(recording, meta=meta))
    touched = count_felt(recordings, onset)
    return (
        f"threshold {threshold} and onset {onset} counts, from "
        f"{proposal.source}: {touched} of {len(trials)} have a contact; "
        "`python -m train thresholds` compares other thresholds"
    )
