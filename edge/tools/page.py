"""The live page of a skin: its pictures, and the actions that a person can take
there."""

import logging
import math
import os
import tempfile
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from edge.errors import InputError
from edge.events import Decided, Event, Onset
from edge.recording import Recording, load
from edge.saving import alone, change_all, finish_interrupted, take_back
from edge.skin.loop import Schedule
from edge.tools import review
from edge.tools.label import changed
from edge.tools.slips import doubts
from edge.tools.web import WebServer
from edge.touch.contact import Contact
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from edge.touch.track import ContactTracker

Json = dict[str, Any]
"""A JSON object."""
LOG = logging.getLogger(__name__)
PICTURE_S = 0.1
"""Between two pictures."""
LAST_TRIALS = 200
LAST_NOTICES = 8
CURVE_S = 5.0
"""Of a contact, the page draws so many seconds from its onset."""
LONGEST_LABEL = 80


class Page:
    """The pictures and the actions of a live page.

    Attributes:
        server: serves the page; `server.link` opens it.
        labels: {task: label} of the trials that are recorded next.
        recording: whether contacts are to be saved.
    """

    def __init__(
        self,
        address: str,
        layout: SkinLayout,
        *,
        title: str,
        folder: Path | None = None,
        labels: dict[str, str] | None = None,
        choices: Mapping[str, Sequence[str]] | None = None,
        decides: bool = False,
    ) -> None:
        """Serve a page.

        Args:
            address: HOST:PORT, as `WebServer` takes it.
            layout: the skin, with its thresholds.
            title: names the skin.
            folder: of the trials that are recorded or kept; None if none are.
            labels: of the first trials; without any, recording waits for a person to
                give some.
            choices: {task: the labels that it can have}, which the page offers as
                buttons.
            decides: a model decides on the contacts, so that none are recorded.

        Raises:
            InputError: the address cannot be used, or a trial in the folder cannot be
                read.
        """
        self._folder = folder
        self.labels = dict(labels or {})
        self.recording = bool(self.labels)
        self._trials: dict[str, Json] = {}
        self._notices: deque[str] = deque(maxlen=LAST_NOTICES)
        self._version = 0
        """Number of changes of the list of trials, and of the labels."""
        self._undo: list[str] = []
        """The files that the last action changed or deleted."""
        self.look()
        self._tracker = ContactTracker(layout, horizon_s=CURVE_S)
        self._contact: Contact | None = None
        self._decisions: dict[str, Json] = {}
        self._due = -float("inf")
        self._scale = layout.counts_per_newton or 1.0
        self._fixed = {
            "title": title,
            **{key: getattr(layout, key) for key in ("rows", "cols", "wraps", "dead")},
            "threshold": layout.threshold_counts,
            "scale": self._scale,
            "units": {"force": layout.force_unit, "motion": layout.length_unit},
            "folder": None if folder is None else str(folder),
            "choices": choices or {},
            "decides": decides,
        }
        self.server = WebServer(address, self._act)

    def push(
        self,
        frame: Frame,
        events: Sequence[Event] = (),
        schedule: Schedule | None = None,
    ) -> None:
        """Take in a frame and the events that came with it; now and then, show a
        picture."""
        for event in events:
            if isinstance(event, Onset):
                self._decisions = {}
            elif isinstance(event, Decided):
                self._decisions[event.task] = _decision(event)
        if not self.server.watched:
            return
        self._contact = next(iter(self._tracker.push(frame)), self._contact)
        if frame.t < self._due:
            return
        # The times of frames are rounded.
        self._due = frame.t + PICTURE_S * (1.0 - 1e-6)
        valid = True if frame.valid is None else frame.valid
        picture = {
            **self._fixed,
            "t": frame.t,
            "counts": frame.counts.ravel().tolist(),
            "invalid": np.flatnonzero(np.logical_not(valid)).tolist(),
            "contact": self._curves(),
            "decisions": list(self._decisions.values()),
            "labels": dict(self.labels),
            "recording": self.recording,
            "trials": self._version,
            "notices": list(self._notices),
            "undo": self._undo,
        }
        if frame.shear is not None:
            picture["shear"] = frame.shear.reshape(-1, 2).tolist()
        if schedule is not None:
            picture["missed"] = schedule.missed_ticks
            picture["rate_hz"] = round(1.0 / schedule.periods.percentile(50), 1)
        self.server.show(picture)

    def notice(self, text: str) -> None:
        """Show a sentence, such as the state of a chip."""
        self._notices.append(text)

    def saved(self, path: Path, trial: Recording) -> None:
        """Add a trial that has been recorded."""
        self._trials[path.name] = {
            "labels": trial.labels,
            "seconds": round(float(np.ptp(trial.t)), 2),
            "curve": review.curve(trial),
            "decided": review.decisions(trial.meta),
            "accepted": review.accepted(trial.meta),
            "kinds": review.kinds(trial.meta),
        }
        self._version += 1

    def _show_trial(self, path: Path) -> None:
        """Add a trial of the folder; a damaged one is named and left out."""
        try:
            self.saved(path, load(path))
        except InputError as error:
            sentence = f"{error}; the list skips it"
            if sentence not in self._notices:
                self.notice(sentence)

    def _curves(self) -> Json | None:
        """The last contact: its taxels, and its features since onset."""
        contact = self._contact
        if contact is None:
            return None
        region = self._tracker.region
        series = contact.series()
        return {
            "ended": contact.ended,
            "taxels": [] if region is None else np.flatnonzero(region.mask).tolist(),
            "t": series.t.round(4).tolist(),
            "force": (series.peak / self._scale).round(4).tolist(),
            "area": series.area.tolist(),
            "motion": [
                None if math.isnan(metres) else round(metres, 5)
                for metres in series.motion.tolist()
            ],
        }

    def look(self) -> None:
        """Add the touches that have come into the folder, and leave out those that have
        gone."""
        if self._folder is None:
            return
        finish_interrupted([self._folder])
        paths = sorted(self._folder.glob("[!.]*.npz"))[-LAST_TRIALS:]
        present = {path.name for path in paths}
        for name in set(self._trials) - present:
            del self._trials[name]
            self._version += 1
        for path in paths:
            if path.name not in self._trials:
                self._show_trial(path)

    def _act(self, action: Json) -> Json | None:
        """Carry out an action of the page; the list of trials where it asks for it, with
        what is doubtful about their labels and about those of the next one.

        Raises:
            InputError: it is none, it is not possible here, or a trial cannot be read.
        """
        kind = action.get("do")
        if self._folder is None:
            raise InputError("this page records nothing; start it with `record --web`")
        if kind == "trials":
            if self._fixed["decides"]:
                self.look()
            return self._list()
        if kind == "labels":
            self.labels = {**self.labels, **_labels(action)}
        elif kind == "unlabel":
            labels = dict(self.labels)
            labels.pop(str(action.get("task")), None)
            self.labels = labels
            self.recording &= bool(labels)
        elif kind == "record":
            self._switch(bool(action.get("on")))
        elif kind == "undo":
            self._take_back(self._folder)
        elif kind in ("relabel", "accept", "delete"):
            self._change(self._folder, action)
        else:
            raise InputError(f"{kind!r} is no action")
        self._version += 1
        return None

    def _list(self) -> Json:
        """The trials and the labels of the next one, with what is doubtful about each."""
        # Another thread adds to the trials.
        trials = [{"file": file, **trial} for file, trial in list(self._trials.items())]
        labels = (trial["labels"] for trial in trials)
        return {"trials": trials, "doubts": doubts([*labels, self.labels])}

    def _switch(self, on: bool) -> None:
        """Begin or stop saving trials.

        Raises:
            InputError: they would have no label.
        """
        if on and not self.labels:
            raise InputError("give a label first; a trial without one teaches nothing")
        self.recording = on

    def _change(self, folder: Path, action: Json) -> None:
        """Label or delete trials, so that it can be taken back.

        Raises:
            InputError: the page does not show all of them, one cannot be read or
                written, or the labels are no names.
        """
        files = action.get("files") or [None]
        if not set(self._trials).issuperset(files):
            raise InputError(f"{files} are none of the trials that this page shows")
        with alone([folder]):
            paths = [folder / name for name in files]
            changes: dict[Path, dict[str, str] | None] = dict.fromkeys(paths)
            if action["do"] != "delete":
                accepts = action["do"] == "accept"
                labels = {} if accepts else _labels(action)
                for path in paths:
                    meta = load(path).meta
                    changes[path] = changed(str(path), meta, labels, accepts=accepts)
            change_all(changes)
            for path, after in changes.items():
                if after is None:
                    del self._trials[path.name]
                else:
                    self._show_trial(path)
        self._undo = files

    def _take_back(self, folder: Path) -> None:
        """Bring back what the last action changed or deleted."""
        if not self._undo:
            raise InputError("there is nothing to undo")
        with alone([folder]):
            for path in take_back([folder]):
                self._show_trial(path)
        self._undo = []


def _decision(event: Decided) -> Json:
    """A decision for the page, with the nearest training trials."""
    decision = event.decision
    distances = [] if decision is None else decision.distances.round(3).tolist()
    neighbours = list(zip(event.nearest, distances, strict=True))
    return {**event.to_dict(), "neighbours": neighbours}


def _labels(action: Json) -> dict[str, str]:
    """The labels of an action.

    Raises:
        InputError: they are not names with names.
    """
    labels = action.get("labels")
    if not isinstance(labels, dict) or not labels:
        raise InputError("give labels, each as TASK=LABEL")
    for text in (*labels, *labels.values()):
        printable = isinstance(text, str) and text.strip().isprintable()
        if not printable or not 0 < len(text.strip()) <= LONGEST_LABEL:
            raise InputError(
                f"{text!r} is no label; give 1 to {LONGEST_LABEL} printable characters"
            )
    return {task.strip(): label.strip() for task, label in labels.items()}


@contextmanager
def open_page(address: str, layout: SkinLayout, **options: Any) -> Iterator[Page]:
    """A page with its link on stderr, closed at the end of the block; see `Page`."""
    page = Page(address, layout, **options)
    try:
        LOG.info(_way_to(page.server.link))
        yield page
    finally:
        page.server.close()


def _way_to(link: str) -> str:
    """A sentence with the page's link; the journal, which others read, gets a file's
    name instead."""
    if "JOURNAL_STREAM" not in os.environ:
        return f"open {link} in a browser"
    folder = os.environ.get("RUNTIME_DIRECTORY") or os.environ.get("XDG_RUNTIME_DIR")
    descriptor, name = tempfile.mkstemp(prefix="edge-classify-link-", dir=folder)
    with os.fdopen(descriptor, "w") as file:  # which its owner alone can read
        file.write(f"{link}\n")
    return f"the page's link is in {name}"
