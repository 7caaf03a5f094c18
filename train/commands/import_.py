"""Turn another lab's data into recordings.

Writes one recording for each trial; existing files of the same name are replaced. Data
without thresholds get those that `edge-classify thresholds` proposes. To add a
format, see train/importers/__init__.py.
"""

import argparse
import logging
import os
import re
import sys
from collections import Counter
from collections.abc import Collection, Iterator, Sequence, Set
from dataclasses import replace
from importlib import import_module
from pathlib import Path

from edge.app.options import add_arm, open_arm
from edge.errors import InputError, printable
from edge.record.recording import Recording
from edge.record.saving import save
from edge.touch.arm import Chain
from edge.writing import remove_leftovers
from train import former_recordings
from train.data.broken import BrokenTaxels
from train.data.scratch import Scratch
from train.data.thresholds import proposed
from train.importers import ImportedTrial, Refused, names
from train.importers.look import contacts_in, rows_of
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
            type=Path,
            help="folder for the recordings",
        )
        command.add_argument(
            "--preview",
            action="store_true",
            help="show what was taken and five rows as understood, and write nothing",
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
    if not arguments.preview:
        if arguments.out is None:
            raise InputError("--out DIR is missing, the folder for the recordings")
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
    trials: Iterator[ImportedTrial | Refused],
    arm: Chain | None,
    arguments: argparse.Namespace,
) -> int:
    """Show a part of the recordings of an importer and write all of them; the exit
    status."""
    recordings: dict[str, Recording] = {}
    taxels = BrokenTaxels()
    scratch = Scratch()
    skipped: list[str] = []
    for result in bar(trials, desc="importing", unit=" trials"):
        if isinstance(result, Refused):
            skipped.append(result.sentence)
            continue
        name, recording = result
        _require_joints(recording, arm, arguments.file)
        try:
            _check_name(arguments.file, name, recordings)
        except InputError as error:
            skipped.append(str(error))
            continue
        taxels.add(recording)
        recordings[name] = scratch.put_fields(recording)
    if skipped and not recordings:
        raise InputError(skipped[0])
    _say_look(recordings, taxels)
    if arguments.preview:
        print("a preview: nothing is written")
        return _status(None, set(), skipped)
    paths = set()
    for name, recording in recordings.items():
        path = arguments.out / f"{name}.npz"
        save(path, recording)
        paths.add(path)
    print(f"recordings written to {arguments.out}: {len(paths)}")
    return _status(arguments.out, paths, skipped)


def _say_look(recordings: dict[str, Recording], taxels: BrokenTaxels) -> None:
    """Show rows of the first recording, thresholds and contacts, and broken taxels."""
    first = next(iter(recordings.values()))
    for line in rows_of(first):
        say(line)
    print(with_thresholds(recordings))
    for warning in taxels.notes(first.layout):
        say(warning)


def _status(folder: Path | None, paths: Set[Path], skipped: Sequence[str]) -> int:
    """Say what else the folder holds, and what was left out; 1 if anything was."""
    if folder is not None:
        for warning in former_recordings.warnings(folder, paths):
            say(warning)
    for sentence in skipped:
        print(printable(f"skipped: {sentence}"), file=sys.stderr)
    return int(bool(skipped))


def _require_joints(recording: Recording, arm: Chain | None, file: Path) -> None:
    if arm is not None and recording.joints is None:
        raise InputError(f"{file}: holds no joint angles; leave --arm out")


def _check_name(file: Path, name: str, names: Collection[str]) -> None:
    """Refuse the name of a trial that no file can have, or another trial has."""
    if not name or Path(name).name != name:
        raise InputError(
            f"{file}: the trial {name!r} needs a name that a file can have"
        )
    if name in names:
        raise InputError(f"{file}: two trials are named {name}; rename one of them")


def with_thresholds(recordings: dict[str, Recording]) -> str:
    """Give recordings without thresholds those that their noise suggests; a report on
    thresholds and contacts."""
    without = {
        name: recording
        for name, recording in recordings.items()
        if "threshold_counts" not in recording.meta["skin"]
    }
    report = ""
    if without:
        proposal = proposed(list(without.values()))
        report = (
            f"threshold {proposal.threshold} and onset {proposal.onset} counts, from "
            f"{proposal.source}: "
        )
        if not proposal.threshold:
            report = (
                f"threshold 0, so that any count is a contact: {proposal.source}; "
                "record from before the touch, or give import --onset first, or "
                "threshold_counts in skin.json; "
            )
        skin = {
            "threshold_counts": proposal.threshold,
            "onset_counts": proposal.onset,
        }
        for name, recording in without.items():
            meta = {**recording.meta, "skin": {**recording.meta["skin"], **skin}}
            recordings[name] = replace(recording, meta=meta)
    return report + contacts_in(list(recordings.values()))
