"""`edge-classify record`: saves each contact as a labelled trial."""

from __future__ import annotations

import argparse
import logging
import math
import re
import signal
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from edge.commands.options import add_arm, add_joints, add_skin, open_arm
from edge.commands.output import Output
from edge.commands.source import open_joints, open_skin
from edge.errors import InputError
from edge.files import NameTaken, check_writable
from edge.recording import Recording, save
from edge.runtime.event_writer import Lines
from edge.skin.loop import Loop, stop_on
from edge.touch.contact import Contact
from edge.touch.frame import Frame
from edge.touch.track import ContactTracker, TrackSettings

LOG = logging.getLogger(__name__)

LONGEST_STEM = 60
"""Characters of a file's name from its labels: with four bytes each, a name has at most 255."""
LEAD_S = 0.2
LENGTH_S = 2.0
"""The paper decides 1.2 s after onset; the rest allows longer windows to be tried."""


HELP = "wait for contacts and save each as a labelled trial"
DESCRIPTION = (
    "Waits for a contact, saves it with a short lead-in as one .npz file, and "
    "waits for the next. Existing files are never overwritten."
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add_skin(parser)
    add_joints(parser)
    parser.add_argument(
        "--label",
        action="append",
        default=[],
        type=_label,
        metavar="TASK=LABEL",
        help="what is being touched, such as object=box; repeat it to label several tasks",
    )
    parser.add_argument(
        "--out",
        default="recordings",
        metavar="FOLDER|FILE.npz",
        help="a folder for numbered trials (default: %(default)s), or the file for a single trial",
    )
    parser.add_argument("--trials", type=int, default=None, help="stop after this many trials")
    parser.add_argument(
        "--lead",
        type=float,
        default=LEAD_S,
        help="seconds to keep from before onset (default: %(default)s)",
    )
    parser.add_argument(
        "--length",
        type=float,
        default=LENGTH_S,
        help="seconds to keep from after onset, at most (default: %(default)s)",
    )
    parser.add_argument(
        "--dof",
        type=int,
        default=None,
        help="with --joints but no --arm: how many angles each line has",
    )
    add_arm(parser, "stored in each trial (default: Cody's)")


def _label(text: str) -> tuple[str, str]:
    task, equals, label = text.partition("=")
    if not (task.strip() and equals and label.strip()):
        raise argparse.ArgumentTypeError(f"must be TASK=LABEL, such as object=box, not {text!r}")
    return task.strip(), label.strip()


class Trials:
    """Cuts a stream of frames into trials, one per contact.

    `push` returns the frames of a trial when it is complete: from the lead-in before onset to
    the contact's end, or to `length_s` after onset. While a saved contact continues, no other
    trial begins.
    """

    def __init__(self, tracker: ContactTracker, *, lead_frames: int, length_s: float) -> None:
        self._tracker, self._length = tracker, length_s
        self._before: deque[Frame] = deque(maxlen=max(lead_frames, 0) + _DEBOUNCE)
        self._frames: list[Frame] | None = None
        self._saved: Contact | None = None

    def push(self, frame: Frame) -> list[Frame] | None:
        """Take in a frame."""
        contact = next(iter(self._tracker.push(frame)), None)
        if self._frames is None:
            self._before.append(frame)
            if contact is None or contact is self._saved:
                return None
            self._saved = contact
            self._frames = list(self._before)
        else:
            self._frames.append(frame)
        over = contact is None or contact.ended
        onset_s = math.inf if self._saved is None else self._saved.onset_s
        if over or frame.t - onset_s >= self._length:
            return self.rest()
        return None

    def rest(self) -> list[Frame] | None:
        """The frames so far of a trial that has begun; then wait for the next contact."""
        frames, self._frames = self._frames, None
        self._before.clear()
        return frames


_DEBOUNCE = TrackSettings().debounce


def recording(frames: list[Frame], meta: dict[str, Any]) -> Recording:
    """Frames as a recording; NaN for the joint angles of a frame in which they were not known."""
    valid = np.array(
        [np.ones(f.counts.shape, bool) if f.valid is None else f.valid for f in frames]
    )
    dof = next((len(f.joints) for f in frames if f.joints is not None), None)
    unknown = np.full(dof or 0, np.nan)
    joints = np.array([unknown if f.joints is None else f.joints for f in frames])
    return Recording(
        t=np.array([f.t - frames[0].t for f in frames]),
        frames=np.array([f.counts for f in frames]),
        joints=None if dof is None else joints,
        valid=None if valid.all() else valid,
        meta=meta,
    )


def trial_path(out: str, labels: dict[str, str]) -> Path:
    """The file for the next trial: `out` itself, or the first free number in that folder.

    Raises:
        InputError: `out` names a file that exists already.
    """
    path = Path(out)
    if path.suffix == ".npz":
        if path.exists():
            raise InputError(f"{path}: exists already; choose another name or remove it")
        return path
    # A name that begins with a dot is hidden, and a folder's listing passes over it.
    stem = re.sub(r"[^\w.-]+", "_", "-".join(labels.values())).lstrip(".")[:LONGEST_STEM] or "trial"
    taken = {p.name for p in path.glob(f"{stem}-*.npz")} if path.is_dir() else set()
    number = 1
    while f"{stem}-{number:03}.npz" in taken:
        number += 1
    return path / f"{stem}-{number:03}.npz"


def run(arguments: argparse.Namespace) -> int:
    """Wait for contacts and save them; 1 if there was none."""
    labels = dict(arguments.label)
    if not labels:
        raise InputError(
            "give --label TASK=LABEL: nothing can be learnt from a trial without a label"
        )
    if len(labels) < len(arguments.label):
        raise InputError("--label names a task twice")
    if not 0.0 <= arguments.lead <= 60.0 or not 0.1 <= arguments.length <= 600.0:
        raise InputError("--lead must be 0 to 60 seconds, --length 0.1 to 600")
    single = Path(arguments.out).suffix == ".npz"
    wanted = 1 if single else arguments.trials
    check_writable(trial_path(arguments.out, labels).parent)
    arm = open_arm(arguments)
    dof = arguments.dof if arm is None else arm.dof
    if arguments.dof not in (None, dof):
        raise InputError(f"--dof {arguments.dof}: {arguments.arm} has {dof} joints")
    if arguments.joints is not None and dof is None:
        raise InputError("--joints needs --arm, or --dof, the number of angles in each line")
    virtual = arguments.fake is not None and not arguments.real_time
    with (
        open_skin(arguments, arm=arm if arguments.joints is None else None) as opened,
        # Until here a signal ends the program at once: there is nothing to lose yet.
        stop_on(signal.SIGINT, signal.SIGTERM) as stop,
        open_joints(arguments, opened, arm, dof) as joints,
        Lines(
            form=Output.of(arguments).line,
            patient=lambda: virtual and not stop.asked,
        ) as lines,
    ):
        if arm is not None and arguments.joints is None:
            have = opened.playback.dof if opened.playback is not None else None
            if have != dof:
                raise InputError(
                    f"{opened.source} gives {have or 'no'} joint angles, but the arm of "
                    f"{arguments.arm} has {dof}; name their source with --joints"
                )
        names = None if arm is None else arm.names
        if arguments.joints is None and opened.playback is not None:
            names = opened.playback.joint_names
        skin = opened.skin
        meta = {
            "skin": skin.layout.to_dict(),
            "skin_name": skin.file.name,
            "source": opened.source,
            "rate_hz": skin.file.reading.rate_hz,
            **({} if arm is None else {"arm": arm.to_dict()}),
        }
        recorder = Recorder(arguments.out, labels, meta, names, lines, joints is not None)
        tracker = ContactTracker(skin.layout, TrackSettings(), horizon_s=0.0)
        lead = round(arguments.lead / skin.period_s)
        trials = Trials(tracker, lead_frames=lead, length_s=arguments.length)
        loop = Loop(skin, joints=joints, lasts_s=opened.lasts_s, stop=stop)
        LOG.info("waiting for a contact")
        for frame in loop.frames():
            recorder.save(trials.push(frame), complete=True)
            if recorder.saved == wanted:
                break
        else:
            recorder.save(trials.rest(), complete=False)
    if not recorder.saved:
        LOG.warning("there was no contact, so nothing was saved")
    return 0 if recorder.saved else 1


@dataclass
class Recorder:
    """Saves trials, with what they have in common.

    Attributes:
        out: the folder, or the file of a single trial.
        labels: {task: label} of every trial.
        meta: what else their metadata say.
        names: of the joints, where they are known.
        lines: where to say what was saved.
        posed: joint angles are expected; frames without them deserve a warning.
        saved: how many trials so far.
    """

    out: str
    labels: dict[str, str]
    meta: dict[str, Any]
    names: Sequence[str] | None
    lines: Lines
    posed: bool
    saved: int = 0

    def save(self, frames: list[Frame] | None, *, complete: bool) -> None:
        """Save the frames of a trial, if there is one."""
        if frames is None:
            return
        without = sum(frame.joints is None for frame in frames)
        meta = {**self.meta, "labels": self.labels, "complete": complete}
        if self.names is not None and without < len(frames):
            meta["joint_names"] = list(self.names)
        trial = recording(frames, meta)
        while True:
            path = trial_path(self.out, self.labels)
            meta["trial"] = path.stem
            try:
                save(path, trial, overwrite=False)
                break
            except NameTaken:
                # Another recorder in this folder was faster: the next name that is free.
                continue
        self.saved += 1
        if without and self.posed:
            LOG.warning("%s: %d of %d frames have no joint angles", path, without, len(frames))
        self.lines.write(
            [
                {
                    "event": "saved",
                    "file": str(path),
                    "labels": self.labels,
                    "frames": len(frames),
                    "seconds": round(frames[-1].t - frames[0].t, 3),
                    "joints": trial.joints is not None,
                    **({"frames_without_joints": without} if 0 < without < len(frames) else {}),
                    "missing_taxels": trial.valid is not None,
                    "complete": complete,
                }
            ]
        )
