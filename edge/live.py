"""Frames in, events out: the one path that live reading, replay, the demo and the tests share."""

from __future__ import annotations

import time
from typing import Any

from edge.errors import InputError
from edge.features import feature_vector
from edge.frame import Frame
from edge.layout import SkinLayout
from edge.model import Model
from edge.track import Contact, Tracker, for_device

Event = dict[str, Any]
"""One JSON object; `event` says which."""


class Watcher:
    """Watches a stream of frames and decides what each contact touches.

    `push` and `finish` return events in the order in which they came about:

    - `onset`: `onset_s`;
    - `decision`, one a task: `task`, `label`, `confidence`, `window_s`, `onset_s`,
      `latency_ms` (from the frame that completed the window to the decision) and `flags`;
    - `release`: `onset_s`, `release_s`.

    Flags of a decision: `tie` (another label had as many votes), `short` (the stream ended
    inside the window; its last values held), `missing_taxels` (taxels could not be read),
    `missing_pose` (joint angles were absent in part of the window), `skin_motion` (motion was
    measured on the skin, though the model's is in the world: see `run --without-joints`),
    `out_of_range` (`label` is
    None: the features are too large to be measured against the training rows).
    """

    def __init__(self, model: Model, layout: SkinLayout | None = None) -> None:
        """Watch with a model.

        Args:
            model: what decides.
            layout: the skin that gives the frames; the model's own where None.

        Raises:
            InputError: the skin is not the one that the model was made for.
        """
        info = model.info
        self.model = model
        self.layout = for_device(info.layout, layout or info.layout)
        self.tracker = Tracker(
            self.layout,
            info.tracking,
            chain=info.chain,
            horizon_s=info.window_s,
            features=info.features,
        )
        self._waiting: list[Contact] = []
        self._current: Contact | None = None
        self._last_s: float | None = None

    def push(self, frame: Frame) -> list[Event]:
        """Take in a frame.

        Raises:
            InputError: the frame's shape is not the skin's, or its time goes back.
        """
        began = time.perf_counter()
        events: list[Event] = []
        contact = self.tracker.push(frame)
        self._last_s = frame.t
        if contact is not None:
            if contact is not self._current:
                self._current = contact
                self._waiting.append(contact)
                events.append({"event": "onset", "onset_s": contact.onset_s})
            if contact.ended:
                events.append(
                    {"event": "release", "onset_s": contact.onset_s, "release_s": frame.t}
                )
        if self._waiting:
            window = self.model.info.window_s
            for waiting in [c for c in self._waiting if frame.t - c.onset_s >= window]:
                self._waiting.remove(waiting)
                events += self._decide(waiting, began, short=False)
        return events

    def finish(self) -> list[Event]:
        """The stream has ended: decide what is still waiting, flagged `short`."""
        began = time.perf_counter()
        waiting, self._waiting = self._waiting, []
        return [event for c in waiting for event in self._decide(c, began, short=True)]

    def _decide(self, contact: Contact, began: float, *, short: bool) -> list[Event]:
        info = self.model.info
        vector = feature_vector(contact.series(), info.window_s, info.samples, info.features)
        flags = [
            flag
            for flag, raised in (
                ("short", short),
                ("missing_taxels", contact.missing_taxels),
                ("missing_pose", contact.missing_pose),
                ("skin_motion", contact.chain is None and info.chain is not None),
            )
            if raised
        ]
        common = {"event": "decision", "window_s": info.window_s, "onset_s": contact.onset_s}
        try:
            decisions = self.model.decide(vector)
        except InputError:
            latency = (time.perf_counter() - began) * 1e3
            return [
                {
                    **common,
                    "task": task,
                    "label": None,
                    "confidence": 0.0,
                    "latency_ms": round(latency, 3),
                    "flags": [*flags, "out_of_range"],
                }
                for task in info.tasks
            ]
        latency = (time.perf_counter() - began) * 1e3
        return [
            {
                **common,
                "task": task,
                "label": decision.label,
                "confidence": decision.confidence,
                "latency_ms": round(latency, 3),
                "flags": [*flags, "tie"] if decision.tie else list(flags),
            }
            for task, decision in decisions.items()
        ]


def require_joints(model: Model, dof: int | None, where: str) -> None:
    """Refuse a source whose joint angles are not what the model's motion is measured with.

    Raises:
        InputError: the sentence names `where`.
    """
    chain = model.info.chain
    if chain is None:
        return
    if dof is None:
        raise InputError(
            f"{where}: has no joint angles, the model measures motion with {chain.dof}; "
            "record them, or export a model without joints"
        )
    if dof != chain.dof:
        raise InputError(f"{where}: has {dof} joint angles, the model's arm has {chain.dof}")
