"""Wait for contacts and save each as a labelled trial.

Waits for a contact, saves it with a short lead-in as one .npz file, and waits for the next one.
Existing files are never overwritten. With --joints, --fake plays at the original speed. The exit
status is 1 if nothing was saved, or if --joints gave no angles.
"""

from __future__ import annotations

import argparse
import logging
import math
import re
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from edge.commands.options import (
    add_arm,
    add_joints,
    add_skin,
    add_web,
    open_arm,
    task_label,
    within,
)
from edge.commands.output import Output
from edge.commands.source import ending_signals, open_joints, open_page, open_skin, skin_events
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
"""Most characters of a file's name that come from labels. A name has at most 255 bytes, a character
at most 4."""
LEAD_S = 0.2
LENGTH_S = 2.0
"""The paper decides 1.2 s after onset; the rest leaves room for longer windows."""
_DEBOUNCE = TrackSettings().debounce


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add_skin(parser)
    add_joints(parser)
    add_web(parser, "; labels are given, changed and corrected there, so --label may be left out")
    parser.add_argument(
        "--label",
        action="append",
        default=[],
        type=task_label,
        metavar="TASK=LABEL",
        help="what the skin touches, such as object=box; repeat it for several tasks",
    )
    parser.add_argument(
        "--out",
        default="recordings",
        metavar="FOLDER|FILE.npz",
        help="a folder for numbered trials (default: %(default)s), or a file for one trial",
    )
    parser.add_argument("--trials", type=within(int, 1, 1e9), help="stop after this many trials")
    parser.add_argument(
        "--lead",
        type=within(float, 0.0, 60.0),
        default=LEAD_S,
        metavar="SECONDS",
        help="time to keep from before onset (default: %(default)s)",
    )
    parser.add_argument(
        "--length",
        type=within(float, 0.1, 600.0),
        default=LENGTH_S,
        metavar="SECONDS",
        help="longest time to keep after onset (default: %(default)s)",
    )
    parser.add_argument(
        "--dof", type=int, help="the number of angles in each line of --joints, without --arm"
    )
    add_arm(parser, "to be stored in each trial (without it, training assumes Cody's)")


class Trials:
    """Cuts a stream of frames into trials, one per contact.

    A trial lasts from the lead-in before onset to the end of the contact, or to `length_s` after
    onset. No other trial begins while a saved contact continues.
    """

    def __init__(self, tracker: ContactTracker, *, lead_frames: int, length_s: float) -> None:
        self._tracker, self._length = tracker, length_s
        self._before: deque[Frame] = deque(maxlen=max(lead_frames, 0) + _DEBOUNCE)
        self._frames: list[Frame] | None = None
        self._saved: Contact | None = None

    def push(self, frame: Frame) -> list[Frame] | None:
        """Take in a frame; returns the frames of a trial that this frame completes."""
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
        """End the trial that is under way, if any, and return its frames."""
        frames, self._frames = self._frames, None
        self._before.clear()
        return frames


def recording(frames: list[Frame], meta: dict[str, Any]) -> Recording:
    """A recording of the frames, with NaN for joint angles that were not known."""
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
    """The file for the next trial: `out` itself, or a file with the first free number in `out`.

    Raises:
        InputError: `out` names a file that exists, or that no folder can hold.
    """
    path = Path(out)
    if path.suffix == ".npz":
        try:
            path.lstat()
        except FileNotFoundError:
            return path
        except (OSError, ValueError) as error:  # such as a name of 300 characters
            reason = getattr(error, "strerror", None) or error
            raise InputError(f"{path}: cannot be written: {reason}") from None
        raise InputError(f"{path}: exists already; choose another name or remove it")
    # A listing of the folder omits names that begin with a dot.
    stem = re.sub(r"[^\w.-]+", "_", "-".join(labels.values())).lstrip(".")[:LONGEST_STEM] or "trial"
    taken = {p.name for p in path.glob(f"{stem}-*.npz")} if path.is_dir() else set()
    number = 1
    while f"{stem}-{number:03}.npz" in taken:
        number += 1
    return path / f"{stem}-{number:03}.npz"


def run(arguments: argparse.Namespace) -> int:
    """Wait for contacts and save them; 1 if there was none."""
    labels = dict(arguments.label)
    if not labels and arguments.web is None:
        raise InputError("give --label TASK=LABEL; a trial without a label teaches nothing")
    if len(labels) < len(arguments.label):
        raise InputError("--label names a task twice")
    single = Path(arguments.out).suffix == ".npz"
    wanted = 1 if single else arguments.trials
    check_writable(trial_path(arguments.out, labels).parent)
    arm = open_arm(arguments)
    dof = arguments.dof if arm is None else arm.dof
    if arguments.joints is not None and dof is None:
        raise InputError("--joints needs --arm, or --dof, the number of angles in each line")
    if arguments.fake is not None and (arguments.joints or arguments.web):
        arguments.real_time = True  # angles, or a person, go by the real clock
    virtual = arguments.fake is not None and not arguments.real_time
    with (
        open_skin(arguments, arm=arm if arguments.joints is None else None) as opened,
        # Before this point a signal ends the program at once, as nothing can be lost.
        stop_on(*ending_signals()) as stop,
        open_joints(arguments, opened, arm, dof) as joints,
        open_page(
            arguments, opened, folder=None if single else Path(arguments.out), labels=labels
        ) as page,
        Lines(
            form=Output.of(arguments).line,
            patient=lambda: virtual and not stop.asked,
        ) as lines,
    ):
        if arm is not None and arguments.joints is None:
            given = opened.playback.dof if opened.playback is not None else None
            if given != dof:
                raise InputError(
                    f"{opened.source} gives {given or 'no'} joint angles, but {arguments.arm} has "
                    f"{dof} joints; name another source with --joints"
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
            lines.write(skin_events(skin, frame.t))
            frames = trials.push(frame)
            if page is not None:
                recorder.labels = page.labels
                frames = frames if page.recording else None
                page.push(frame, (), loop.schedule)
            saved = recorder.save(frames, complete=True)
            if page is not None and saved is not None:
                page.saved(*saved)
            if recorder.saved == wanted:
                break
        else:
            recorder.save(trials.rest(), complete=False)
    if not recorder.saved:
        silent = int((skin.invalid_for > 0).sum())
        where = f"; taxels without a valid value: {silent}" if silent else ""
        LOG.warning(f"there was no contact; nothing was saved{where}")
    elif arguments.joints is not None and not recorder.any_joints:
        LOG.error("--joints gave no angles at the times of the frames")
        return 1
    return 0 if recorder.saved else 1


@dataclass
class Recorder:
    """Saves trials under the next free names, with their shared metadata.

    Attributes:
        out: the folder, or the file for a single trial.
        labels: {task: label} of every trial.
        meta: further metadata of every trial.
        names: the joints' names, or None if they are unknown.
        lines: where the `saved` events go.
        posed: whether to warn about frames without joint angles.
        saved: the number of trials saved so far.
        any_joints: whether a saved frame had joint angles.
    """

    out: str
    labels: dict[str, str]
    meta: dict[str, Any]
    names: Sequence[str] | None
    lines: Lines
    posed: bool
    saved: int = 0
    any_joints: bool = False

    def save(self, frames: list[Frame] | None, *, complete: bool) -> tuple[Path, Recording] | None:
        """Save the frames of a trial, if there is one; returns its file and what it holds."""
        if frames is None:
            return None
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
            except NameTaken:  # another recorder in this folder was faster
                continue
        self.saved += 1
        self.any_joints |= trial.joints is not None
        if without and self.posed:
            LOG.warning(f"{path}: {without} of {len(frames)} frames have no joint angles")
        event = {
            "event": "saved",
            "file": str(path),
            "labels": self.labels,
            "frames": len(frames),
            "seconds": round(frames[-1].t - frames[0].t, 3),
            "joints": trial.joints is not None,
            **({"frames_without_joints": without} if 0 < without < len(frames) else {}),
            "missing_taxels": trial.valid is not None,
            "complete": complete,
            **({} if complete else {"reason": "reading stopped before the contact's end"}),
        }
        self.lines.write([event])
        return path, trial
