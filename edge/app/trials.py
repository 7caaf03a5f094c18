"""Trials that are cut out of a stream of frames, one for each contact."""

import math
from collections import deque
from typing import Any

import numpy as np

from edge.app.source import Opened
from edge.arrays import Array, Floats
from edge.record.recording import Recording
from edge.touch.arm import Chain
from edge.touch.contact import Contact
from edge.touch.frame import Frame
from edge.touch.track import DEBOUNCE, ContactTracker
from edge.wire.skin.skin import Skin

LEAD_S = 0.2
"""Time that a trial keeps from before its onset."""


class Segmenter:
    """Cuts a stream of frames into trials, one per contact.

    A trial lasts from the lead-in before onset to the end of the contact, or to
    `length_s` after onset. No other trial begins while a saved contact continues.
    """

    def __init__(self, skin: Skin, length_s: float) -> None:
        self._tracker = ContactTracker(skin.layout, horizon_s=length_s)
        self._length = length_s
        self._before: deque[Frame] = deque(
            maxlen=round(LEAD_S / skin.period_s) + DEBOUNCE
        )
        self._frames: list[Frame] | None = None
        self._saved: Contact | None = None
        self._onset_s = -math.inf

    def push(self, frame: Frame) -> list[Frame] | None:
        """Take in a frame; returns the frames of a trial that this frame completes."""
        contact = next(iter(self._tracker.push(frame)), None)
        if self._frames is not None:
            self._frames.append(frame)
        else:
            self._before.append(frame)
            if contact is None or contact is self._saved:
                return None
            self._saved = contact
            self._onset_s = contact.onset_s
            self._frames = list(self._before)
        over = contact is None or contact.ended
        return self.rest() if over or frame.t - self._onset_s >= self._length else None

    @property
    def under_way(self) -> bool:
        """Whether the frames of a trial are being collected."""
        return self._frames is not None

    def rest(self) -> list[Frame] | None:
        """End the trial that is under way, if any, and return its frames."""
        frames = self._frames
        self._frames = None
        self._before.clear()
        return frames


def recording(frames: list[Frame], meta: dict[str, Any]) -> Recording:
    """A recording of the frames, with NaN for joint angles that were not known."""
    # A skin's frames always say which taxels are valid.
    valid = _stacked(frames, "valid")
    return Recording(
        t=_stacked(frames, "t") - frames[0].t,
        frames=_stacked(frames, "counts"),
        joints=_angles(frames),
        valid=None if valid.all() else valid,
        meta=meta,
        shear=None if frames[0].shear is None else _stacked(frames, "shear"),
    )


def _stacked(frames: list[Frame], field: str) -> Array:
    """A field of all frames, along the first axis."""
    return np.array([getattr(frame, field) for frame in frames])


def _angles(frames: list[Frame]) -> Floats | None:
    """(n, dof) joint angles; None where no frame has any."""
    measured = [frame.joints for frame in frames if frame.joints is not None]
    if not measured:
        return None
    unknown = np.full(len(measured[0]), np.nan)
    return np.array([unknown if f.joints is None else f.joints for f in frames])


def shared_meta(opened: Opened, arm: Chain | None) -> dict[str, Any]:
    """The metadata that all trials of a skin share."""
    file = opened.skin.file
    meta = {
        "skin": file.layout.to_dict(),
        "skin_name": file.name,
        "source": opened.source,
        "rate_hz": file.reading.rate_hz,
    }
    return meta if arm is None else {**meta, "arm": arm.to_dict()}
