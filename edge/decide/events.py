"""The events of a contact: its onset, its decisions and its release."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Self

from edge.decide.flags import in_order
from edge.decide.model import Decision


@dataclass(frozen=True)
class Onset:
    """A contact has begun.

    >>> import edge
    >>> edge.Onset(onset_s=1.25).to_dict()
    {'event': 'onset', 'onset_s': 1.25}

    Attributes:
        onset_s: when, on the frames' clock.
        contact: its number, counted from 1, if several are followed at once; else None.
    """

    onset_s: float
    contact: int | None = None

    def to_dict(self) -> dict[str, Any]:
        """The event as a JSON object."""
        return _line("onset", self)


@dataclass(frozen=True)
class Decided:
    """A task has been decided for a contact.

    >>> import edge
    >>> decided = edge.Decided("mobility", "fixed", 1.0, window_s=1.2, onset_s=0.2, latency_ms=0.3)
    >>> decided.label, decided.to_dict()["event"]
    ('fixed', 'decision')

    Attributes:
        task: the question.
        label: its answer; None if the object is unknown, or the features are too large
            to be compared with the training rows.
        confidence: the calibrated probability that the label is right, 0 to 1; None
            of a model without calibration.
        window_s: seconds from onset on which the decision is based.
        onset_s: when the contact began; without a contact, when the stream ended.
        latency_ms: from the frame that completed the window to the answer.
        flags: reasons for doubt, see `edge.decide.flags`.
        error: the certified error rate, if one was asked for.
        stopped_by: with an error rate, `confidence`, or `window` if the stopping rule's
            last decision point came first.
        contact: as in `Onset`.
        position: (x, y, z) of the contact's last position, if several are followed and
            it is known (see `edge.touch.contact.Contact.position`).
        model: name and version of the model, if it has a name.
        strongest: without a contact, the largest count of any taxel, as a part of the
            count at which a contact begins; else None.
        unusual: of an unusual contact, what is most unlike training, as a phrase.
        nearest: names of the nearest training trials, which voted, or their numbers in
            a model without names.
        decision: the model's own answer, with the votes and the nearest training
            trials; None without a label.
    """

    task: str
    label: str | None
    confidence: float | None
    window_s: float
    onset_s: float
    latency_ms: float
    flags: tuple[str, ...] = ()
    error: float | None = None
    stopped_by: str | None = None
    contact: int | None = None
    position: tuple[float, float, float] | None = None
    strongest: float | None = None
    model: str | None = None
    unusual: str | None = None
    nearest: tuple[str, ...] = field(default=(), compare=False, repr=False)
    decision: Decision | None = field(default=None, compare=False, repr=False)

    def flagged(self, **doubts: bool) -> Self:
        """The decision with the flags that hold, and without those that do not.

        Args:
            doubts: {flag: whether it holds}, of those in `edge.decide.flags`.
        """
        states = dict.fromkeys(self.flags, True) | doubts
        flags = in_order({flag for flag, holds in states.items() if holds})
        return replace(self, flags=flags)

    def to_dict(self) -> dict[str, Any]:
        """The event as a JSON object."""
        line = {**_line("decision", self), "window_s": self.window_s}
        if self.contact is not None:
            line["position"] = self.position and list(self.position)
        for key in ("task", "label", "confidence", "latency_ms"):
            line[key] = getattr(self, key)
        for key in ("strongest", "error", "stopped_by", "unusual", "model"):
            if getattr(self, key) is not None:
                line[key] = getattr(self, key)
        return {**line, "flags": list(self.flags)}


@dataclass(frozen=True)
class Release:
    """A contact has ended.

    >>> import edge
    >>> edge.Release(onset_s=1.25, released_s=3.5).to_dict()
    {'event': 'release', 'onset_s': 1.25, 'released_s': 3.5}

    Attributes:
        onset_s: when it began.
        released_s: when its end was certain.
        contact: as in `Onset`.
    """

    onset_s: float
    released_s: float
    contact: int | None = None

    def to_dict(self) -> dict[str, Any]:
        """The event as a JSON object."""
        return {**_line("release", self), "released_s": round(self.released_s, 6)}


Event = Onset | Decided | Release


def _line(name: str, event: Onset | Decided | Release) -> dict[str, Any]:
    """The keys that the lines of all events have."""
    contact = {} if event.contact is None else {"contact": event.contact}
    return {"event": name, **contact, "onset_s": round(event.onset_s, 6)}


def json_line(event: Mapping[str, Any]) -> str:
    """An event as one line of JSON, without the line break.

    It is ASCII, which every encoding of stdout has, so that no label can break the line
    or reach a terminal as an escape sequence. JSON has no NaN or infinity, so they
    become null.

    >>> json_line({"label": "Bär", "confidence": float("nan")})
    '{"label": "B\\\\u00e4r", "confidence": null}'
    """
    return json.dumps(_finite(event), allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return value
