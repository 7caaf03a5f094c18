"""The live page of a skin: its pictures, and the actions that a person can take
there."""

import logging
import math
import os
import tempfile
from collections import Counter, deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from functools import cache
from itertools import starmap
from pathlib import Path
from typing import Any

import numpy as np

from edge.app import review
from edge.app.review import Touch, changed
from edge.app.sinks.sink import Event, Fault
from edge.app.sinks.web import WebServer
from edge.app.texts import event_text
from edge.decide.events import Decided, Onset
from edge.errors import InputError
from edge.files import parsing
from edge.record.changes import Change, change, former, now, undo
from edge.record.labels import Standing, read_table
from edge.record.recording import load, read_meta
from edge.record.slips import doubts, too_few
from edge.touch.contact import Contact
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from edge.touch.track import ContactTracker
from edge.wire.skin.loop import Schedule

Json = dict[str, Any]
"""A JSON object."""
LOG = logging.getLogger(__name__)
PICTURE_S = 0.1
"""Between two pictures."""
SHOWN = 50
"""Touches that the list shows at a time."""
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
        schedule: of the loop, whose rate is shown.
    """

    def __init__(
        self,
        address: str,
        layout: SkinLayout,
        *,
        title: str,
        folder: Path | None = None,
        labels: Mapping[str, str | None] | None = None,
        choices: Mapping[str, Sequence[str]] | None = None,
        decides: bool = False,
    ) -> None:
        """Serve a page.

        Args:
            address: HOST:PORT, as `WebServer` takes it.
            layout: the skin, with its thresholds.
            title: names the skin.
            folder: of the trials that are recorded or kept; None if none are.
            labels: of the first trials; without any, or where one is None, recording
                waits for a person to give it.
            choices: {task: the labels that it can have}, which the page offers as
                buttons.
            decides: a model decides on the contacts, so that none are recorded.

        Raises:
            InputError: the address cannot be used, or a trial in the folder cannot be
                read.
        """
        self.schedule: Schedule | None = None
        self._folder = folder
        tasks = dict(labels or {})
        self.labels = {task: label for task, label in tasks.items() if label}
        self._waits = tasks.keys() - self.labels.keys()
        self.recording = bool(self.labels) and not self._waits
        self._touches: dict[str, Touch] = {}
        """Those of the folder by file, the newest first."""
        self._time_series: dict[str, Json] = {}
        """The seconds and the curve of touches that have been shown."""
        self._notices: deque[str] = deque(maxlen=LAST_NOTICES)
        self._version = 0
        """Number of changes of the list or of the labels that this program has made."""
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

    def push(self, frame: Frame, events: Sequence[Event] = ()) -> None:
        """Take in a frame and the events that came with it; now and then, show a
        picture."""
        for event in events:
            if isinstance(event, Onset):
                self._decisions = {}
            elif isinstance(event, Decided):
                self._decisions[event.task] = _decision(event)
            elif isinstance(event, Fault):
                self.notice(event_text(event.line).strip())
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
            "waits": sorted(self._waits),
            "trials": self._version,
            "notices": list(self._notices),
        }
        if frame.shear is not None:
            picture["shear"] = frame.shear.reshape(-1, 2).tolist()
        if self.schedule is not None:
            picture["missed"] = self.schedule.missed_ticks
            picture["rate_hz"] = round(1.0 / self.schedule.periods.percentile(50), 1)
        self.server.show(picture)

    def close(self) -> None:
        """Stop serving."""
        self.server.close()

    def notice(self, text: str) -> None:
        """Show a sentence, such as the state of a chip."""
        self._notices.append(text)

    def saved(self) -> None:
        """Show that a touch has been recorded."""
        self._version += 1

    def left_out(self, paths: Sequence[Path]) -> int:
        """How many of these recordings are left out."""
        touches = [self._touches.get(path.name) for path in paths]
        return sum(it is not None and it.standing.left_out for it in touches)

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
        """Take in the touches that have come into the folder, those that have gone, and
        the labels that have changed; what cannot be read is named once."""
        if self._folder is None:
            return
        read = {touch.path: touch.meta for touch in self._touches.values()}
        metas = {}
        for path in sorted(self._folder.glob("[!.]*.npz")):
            with self._naming("; the list skips it"):
                metas[path] = read.get(path) or read_meta(path)
        with self._naming():
            touches = review.touches(metas, cache(read_table))
            touches.sort(key=lambda touch: touch.path.stat().st_mtime_ns)
            self._touches = {touch.path.name: touch for touch in reversed(touches)}

    @contextmanager
    def _naming(self, then: str = "") -> Iterator[None]:
        """Say once what cannot be read."""
        try:
            yield
        except (InputError, OSError) as error:
            if f"{error}{then}" not in self._notices:
                self.notice(f"{error}{then}")

    def _act(self, action: Json) -> Json | None:
        """Carry out an action of the page; the list of touches where it asks for it.

        Raises:
            InputError: it is none, it is not possible here, or a touch cannot be read.
        """
        kind = action.get("do")
        if self._folder is None:
            raise InputError("this page records nothing; start it with `record --web`")
        if kind == "trials":
            self.look()
            return self._list(self._folder, action)
        if kind == "labels":
            self.labels = {**self.labels, **_labels(action)}
            if self._waits and self._waits <= self.labels.keys():
                self._waits.clear()
                self.recording = True
        elif kind == "unlabel":
            labels = dict(self.labels)
            labels.pop(str(action.get("task")), None)
            self.labels = labels
            self.recording &= bool(labels)
        elif kind == "record":
            self._switch(bool(action.get("on")))
        elif kind == "undo":
            self._take_back(self._folder, action)
        elif kind in ("relabel", "accept", "leave_out", "put_back"):
            self._change(self._folder, action)
        else:
            raise InputError(f"{kind!r} is no action")
        self._version += 1
        return None

    def _list(self, folder: Path, action: Json) -> Json:
        """Some touches of those that a word selects, how many these are, the words with
        the number of their touches, and what is doubtful about the next one's
        labels."""
        touches = list(self._touches.values())
        labels = [touch.standing.labels for touch in touches]
        doubtful = doubts([*labels, self.labels])
        words: Counter[str] = Counter()
        rows = []
        for touch, sentences in zip(touches, doubtful, strict=False):
            words.update(touch.words)
            if action.get("only", "") in ("", *touch.words):
                rows.append((touch, sentences))
        start = str(action.get("start", 0))
        first = int(start) if start.isdecimal() else 0
        last = None
        with self._naming():
            last = former(folder)
        return {
            "trials": list(starmap(self._row, rows[first : first + SHOWN])),
            "total": len(rows),
            "all": len(touches),
            "words": sorted(words.items()),
            "doubts": doubtful[-1] + too_few(labels),
            "undo": last and {"time": last.time, "command": last.command},
        }

    def _row(self, touch: Touch, sentences: Sequence[str]) -> Json:
        """What the list says of a touch, with what is doubtful about its labels."""
        file = touch.path.name
        if file not in self._time_series:
            self._time_series[file] = {"seconds": 0.0, "curve": []}
            with self._naming():
                trial = load(touch.path)
                seconds = round(float(np.ptp(trial.t)), 2)
                self._time_series[file] = {
                    "seconds": seconds,
                    "curve": review.curve(trial),
                }
        return {
            "file": file,
            **touch.standing._asdict(),
            **self._time_series[file],
            "decided": review.decisions(touch.meta),
            "accepted": review.accepted(touch.meta, touch.standing.labels),
            "kinds": touch.kinds,
            "doubts": sentences,
        }

    def _switch(self, on: bool) -> None:
        """Begin or stop saving trials.

        Raises:
            InputError: they would have no label.
        """
        if on and (self._waits or not self.labels):
            what = " and ".join(sorted(self._waits)) or "a label"
            raise InputError(f"give {what} first; a trial without one teaches nothing")
        self.recording = on

    def _change(self, folder: Path, action: Json) -> None:
        """Label touches, leave them out, or put them back.

        Raises:
            InputError: one does not stand any more as the browser showed it, or is none
                of this page's, or the labels are no names.
        """
        kind = action["do"]
        labels = _labels(action) if kind == "relabel" else {}
        changes = {}
        for file, before in _seen(action).items():
            if file not in self._touches:
                raise InputError(f"{file!r} is none of the touches of this page")
            meta = self._touches[file].meta
            after = Standing(
                changed(meta, before.labels, labels, accepts=kind == "accept"),
                before.left_out
                if kind in ("relabel", "accept")
                else kind == "leave_out",
            )
            changes[file] = Change(before, after)
        what = next(iter(changes)) if len(changes) == 1 else f"{len(changes)} touches"
        words = [kind.replace("_", " "), what, *map("=".join, labels.items())]
        try:
            change(folder, changes, now(), " ".join(words))
        finally:
            self.look()

    def _take_back(self, folder: Path, action: Json) -> None:
        """Take the last change of labels back, if it is the one that the browser shows.

        Raises:
            InputError: it is another one, or there is none.
        """
        last = former(folder)
        try:
            if last is None or last.time != action.get("time"):
                raise InputError("the labels have been changed since; look again")
            undo(last)
        finally:
            self.look()


def _decision(event: Decided) -> Json:
    """A decision for the page, with the nearest training trials."""
    decision = event.decision
    distances = [] if decision is None else decision.distances.round(3).tolist()
    neighbours = list(zip(event.nearest, distances, strict=True))
    return {**event.to_dict(), "neighbours": neighbours}


def _seen(action: Json) -> dict[str, Standing]:
    """{file: how it stands} of the touches of an action, as the browser shows them.

    Raises:
        InputError: it names none.
    """
    with parsing("the action", "one of this page", "; load it again"):
        touches = action["touches"]
        return {it["file"]: Standing(it["labels"], it["left_out"]) for it in touches}


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
def open_page(
    address: str, layout: SkinLayout, schedule: Schedule, **options: Any
) -> Iterator[Page]:
    """A page with its link on stderr, closed at the end of the block; see `Page`."""
    page = Page(address, layout, **options)
    page.schedule = schedule
    with closing(page):
        LOG.info(_way_to(page.server.link))
        yield page


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
