"""Wait for contacts and save each as a labelled trial.

Waits for a contact, saves it with a short lead-in as one .npz file, and waits for the
next one. Existing files are never overwritten. With --joints, --fake plays at the
original speed. The exit status is 1 if nothing was saved, or if --joints gave no
angles.
"""

from __future__ import annotations

import argparse
import os
import re
from collections.abc import Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from edge.app.options import (
    add_arm,
    add_file,
    add_reading,
    open_arm,
    task_label,
    within,
)
from edge.app.output import LOG
from edge.app.review import decisions_of
from edge.app.sinks.event_writer import Lines
from edge.app.sinks.sink import Event
from edge.app.source import Opened, reading
from edge.app.trials import Segmenter, recording, shared_meta
from edge.decide.classifier import Classifier
from edge.decide.events import Decided
from edge.decide.model import Model
from edge.errors import InputError
from edge.files import refusing
from edge.record.labels import Row, read_table
from edge.record.saving import save
from edge.touch.arm import Chain
from edge.touch.frame import Frame
from edge.wire.fake.player import frame_rate
from edge.wire.skin import file as skinfile
from edge.wire.skin.skin import Skin
from edge.writing import NameTaken, check_writable

if TYPE_CHECKING:
    from edge.app.sinks.page import Page

LONGEST_STEM = 60
"""Most characters of a file's name that come from labels. A name has at most 255 bytes,
a character at most 4."""
LENGTH_S = 2.0
"""The paper decides 1.2 s after onset; the rest leaves room for longer windows."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add_reading(parser, "; labels are given and corrected there")
    parser.add_argument(
        "--label",
        action="append",
        default=[],
        type=task_label,
        metavar="TASK=LABEL",
        help="label of the touches, such as object=box; repeat it for several tasks, "
        "and with --web for several labels of a task, which the page then offers",
    )
    parser.add_argument(
        "--out",
        type=Path,
        default="recordings",
        metavar="FOLDER",
        help="a folder for numbered trials (default: %(default)s)",
    )
    text = "a model, whose decisions are shown beside the labels and kept in each trial"
    add_file(parser, "model", text)
    parser.add_argument(
        "--trials",
        type=within(int, 1, 1e9),
        help="number of trials after which to stop",
    )
    parser.add_argument(
        "--length",
        type=within(float, 0.1, 600.0),
        default=LENGTH_S,
        metavar="SECONDS",
        help="longest time to keep after onset (default: %(default)s)",
    )
    add_arm(parser, "to be stored in each trial (without it, training assumes Cody's)")


def trial_path(folder: Path, labels: dict[str, str]) -> Path:
    """The file for the next trial: the first free number in a folder.

    Raises:
        InputError: the folder's name is impossible.
    """
    # Searches of a folder omit names that begin with a dot.
    plain = re.sub(r"[^\w.-]+", "_", "-".join(labels.values())).lstrip(".")
    stem = plain[:LONGEST_STEM] or "trial"
    rows: Mapping[str, Row] = {}
    with suppress(InputError):  # a touch is worth more than a damaged table
        rows = read_table(folder).rows
    names = (f"{stem}-{number:03}.npz" for number in count(1))
    with refusing(f"{folder}: cannot be written"):  # a name of 300 characters, for one
        return next(
            folder / name
            for name in names
            # What a row says of a trial that is gone is not true of the next one.
            if name not in rows and not os.path.lexists(folder / name)
        )


def run(arguments: argparse.Namespace) -> int:
    """Wait for contacts and save them; 1 if there was none."""
    labels = _labels(arguments)
    model = None if arguments.model is None else Model(arguments.model)
    arm = _arm(arguments, model)
    check_writable(arguments.out)
    with (
        # Angles go by the real clock.
        reading(
            arguments,
            model=model,
            needs_joints=False,
            arm=arm,
            real_time=arguments.joints is not None,
            folder=arguments.out,
            labels=labels,
            choices=_choices(arguments, model),
        ) as live,
        closing(live.lines()) as lines,
    ):
        wire_s = round(1.0 / frame_rate(live.skin.file), 6)
        recorder = Recorder(
            arguments.out,
            {task: label for task, label in labels.items() if label},
            {**shared_meta(live.opened, arm), "wire_s": wire_s},
            _joint_names(arguments, live.opened, arm),
            lines,
            live.page,
        )
        LOG.info("waiting for a contact")
        trials = Segmenter(live.skin, arguments.length)
        classifier = None if model is None else Classifier(model, live.skin.layout)
        for frame, faults in live.frames():
            events = faults + ([] if classifier is None else classifier.push(frame))
            for sink in (lines, *live.sinks):
                sink.push(frame, events)
            recorder.follow(trials, events)
            recorder.save(trials.push(frame), complete=True)
            if recorder.count == arguments.trials:
                break
        recorder.save(trials.rest(), complete=False)
    return _status(arguments, recorder, live.skin)


def _arm(arguments: argparse.Namespace, model: Model | None) -> Chain | None:
    """The arm that the options name, or that of the model.

    Raises:
        InputError: both are given, or --joints without either.
    """
    arm = open_arm(arguments)
    if model is not None and model.info.chain is not None:
        if arm is not None:
            raise InputError(
                f"{model.path} brings the arm that it needs: leave --arm out"
            )
        return model.info.chain
    if arm is None and model is None and arguments.joints is not None:
        raise InputError("--joints needs --arm, the arm whose angles they are")
    return arm


def _labels(arguments: argparse.Namespace) -> dict[str, str | None]:
    """{task: label} of the first trial; None where a person is to choose one.

    Raises:
        InputError: there is none, and none can be given later; or a task has two.
    """
    labels: dict[str, str | None] = {}
    for task, label in arguments.label:
        labels[task] = None if task in labels else label
    if arguments.web is not None:
        return labels
    if not labels:
        raise InputError(
            "give --label TASK=LABEL; a trial without a label teaches nothing"
        )
    if None in labels.values():
        raise InputError(
            "--label names a task twice; only on the page, with --web, does a person "
            "choose the label"
        )
    return labels


def _choices(
    arguments: argparse.Namespace, model: Model | None
) -> dict[str, list[str]]:
    """{task: the labels that a person may choose from}: those of the model and of the
    skin file, and those of --label where a task has several."""
    choices: dict[str, list[str]] = {}
    if model is not None:
        choices = {name: list(task.labels) for name, task in model.info.tasks.items()}
    if arguments.skin is not None:
        for task, names in skinfile.load(arguments.skin).labels.items():
            choices[task] = list(names)
    for task, label in arguments.label:
        names = choices.setdefault(task, [])
        if label not in names:
            names.append(label)
    return {task: names for task, names in choices.items() if len(names) > 1}


def _joint_names(
    arguments: argparse.Namespace,
    opened: Opened,
    arm: Chain | None,
) -> Sequence[str] | None:
    """The names of the joints; None if they are unknown.

    Raises:
        InputError: the source lacks the arm's angles.
    """
    if arguments.joints is not None:
        return None if arm is None else arm.names
    if arm is not None and opened.dof != arm.dof:
        raise InputError(
            f"{opened.source} gives {opened.dof or 'no'} joint angles, but "
            f"{arguments.arm or arguments.model} has {arm.dof} joints; name another "
            "source with --joints"
        )
    return None if opened.playback is None else opened.playback.recording.joint_names


def _status(arguments: argparse.Namespace, recorder: Recorder, skin: Skin) -> int:
    """The exit status, with a message where nothing was saved as it should be."""
    if not recorder.count:
        silent = int((skin.invalid_for > 0).sum())
        where = f"; taxels without a valid value: {silent}" if silent else ""
        LOG.warning(f"no contact was saved{where}")
        return 1
    if arguments.joints is not None and not recorder.any_joints:
        LOG.error("--joints gave no angles at the times of the frames")
        return 1
    return 0


@dataclass
class Recorder:
    """Saves trials under the next free names, with their shared metadata.

    Attributes:
        folder: of the trials.
        labels: {task: label} of the touch under way, which are those of its beginning,
            or of the next one.
        meta: further metadata of every trial.
        names: the joints' names, or None if they are unknown.
        lines: where the `saved` events go.
        page: the live page, which then gives the labels and says whether to save; or
            None.
        paths: the trials saved so far.
        recording: whether the touch under way, or the next one, is to be saved.
        decided: the model's decisions about it.
        any_joints: whether a saved frame had joint angles.
    """

    folder: Path
    labels: dict[str, str]
    meta: dict[str, Any]
    names: Sequence[str] | None
    lines: Lines
    page: Page | None = None
    paths: list[Path] = field(default_factory=list)
    recording: bool = True
    decided: list[Decided] = field(default_factory=list)
    any_joints: bool = False

    @property
    def count(self) -> int:
        """Trials that have been saved, are still there, and are not left out on the
        page."""
        paths = [path for path in self.paths if path.exists()]
        return len(paths) - (0 if self.page is None else self.page.left_out(paths))

    def follow(self, trials: Segmenter, events: Sequence[Event] = ()) -> None:
        """Take over the page's labels, and the decisions about the touch under way,
        which keeps the labels of its beginning."""
        self.decided += [event for event in events if isinstance(event, Decided)]
        if trials.under_way:
            return
        if self.page is not None:
            self.labels = self.page.labels
            self.recording = self.page.recording

    def save(self, frames: list[Frame] | None, *, complete: bool) -> None:
        """Save the frames of a trial, if there is one and it is to be saved."""
        if frames is None:
            return
        if self.recording:
            self._save(frames, complete)
        elif self.page is not None and self.page.recording:
            sentence = (
                "recording was switched on during the touch, whose onset is missing: "
                "it is not saved"
            )
            LOG.warning(sentence)
            self.page.notice(sentence)

    def _save(self, frames: list[Frame], complete: bool) -> None:
        """Save the frames of a trial under the next free name."""
        meta = {**self.meta, "labels": self.labels, "complete": complete}
        first = frames[0].t
        decided = [event for event in self.decided if event.onset_s >= first]
        if decided:
            meta["decided"] = decisions_of(decided)
        self.decided.clear()
        trial = recording(frames, meta)
        unposed = sum(frame.joints is None for frame in frames)
        posed = unposed < len(frames)
        if posed and self.names is not None:
            meta["joint_names"] = list(self.names)
        while True:
            path = trial_path(self.folder, self.labels)
            meta["trial"] = path.stem
            with suppress(NameTaken):  # another recorder in this folder was faster
                save(path, trial, overwrite=False)
                break
        self.paths.append(path)
        self.any_joints |= posed
        event = {
            "event": "saved",
            "file": str(path),
            "labels": self.labels,
            "frames": len(frames),
            "seconds": round(float(trial.t[-1]), 3),
            "joints": posed,
            "missing_taxels": trial.valid is not None,
            "complete": complete,
        }
        if 0 < unposed < len(frames):
            LOG.warning(
                f"{path}: {unposed} of {len(frames)} frames have no joint angles"
            )
        self.lines.write([event])
        if self.page is not None:
            self.page.saved()
