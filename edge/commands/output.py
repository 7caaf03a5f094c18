"""Output of a command: text for a person, JSON lines for a program, messages."""

import argparse
import logging
import shutil
import sys
import textwrap
from collections.abc import Callable, Mapping
from typing import Any, Self

from edge.errors import printable
from edge.events import json_line

LOG = logging.getLogger("edge.commands")
"""For messages, which are printed to stderr (see `edge.cli.dispatch`)."""
BAR = 10
"""Width in characters of a bar that shows a share."""
LONGEST_LINE = 80
MOST_PLACES = 6
"""Taxels that a line names."""


class Output:
    """Writes events to stdout, as JSON lines or as text."""

    def __init__(self, as_json: bool) -> None:
        self.as_json = as_json

    @classmethod
    def of(cls, arguments: argparse.Namespace) -> Self:
        """JSON if `--json` is given or stdout is no terminal, otherwise text."""
        return cls(arguments.json or not sys.stdout.isatty())

    def event(self, line: Mapping[str, Any], text: str | None = None) -> None:
        """Write an event at once.

        Args:
            line: the event, for JSON.
            text: the same for a person; None takes that of `event_text`.
        """
        print(self.line(line, text), flush=True)

    def line(self, line: Mapping[str, Any], text: str | None = None) -> str:
        """The text that `event` prints, without control characters but line breaks."""
        if self.as_json:
            return json_line(line)
        lines = (event_text(line) if text is None else text).split("\n")
        return "\n".join(map(printable, lines))

    def text(self, text: str) -> None:
        """Write text that no program reads; to stderr if stdout is for JSON."""
        text = "\n".join(map(printable, text.split("\n")))
        print(text, file=sys.stderr if self.as_json else sys.stdout, flush=True)


def bar(share: float) -> str:
    """A bar that shows a share from 0 to 1.

    >>> bar(0.72)
    '███████···'
    """
    full = round(min(max(share, 0.0), 1.0) * BAR)
    return "█" * full + "·" * (BAR - full)


def counted(count: int, noun: str) -> str:
    """A count with its noun: "1 chip", "2 chips".

    >>> counted(1, "chip"), counted(2, "chip")
    ('1 chip', '2 chips')
    """
    return f"{count} {noun}{'s' * (count != 1)}"


def wrapped(text: str, indent: str = "") -> list[str]:
    """The text in lines as wide as the terminal, and at most `LONGEST_LINE`."""
    columns = min(shutil.get_terminal_size().columns, LONGEST_LINE)
    return textwrap.wrap(text, columns, initial_indent=indent, subsequent_indent=indent)


def event_text(line: Mapping[str, Any]) -> str:
    """An event as text for a person.

    >>> event_text({"event": "onset", "onset_s": 0.25})
    '   0.250 s  contact'
    """
    text = TEXTS.get(line["event"], json_line)
    return text(line)


def _contact(line: Mapping[str, Any]) -> str:
    """The number of a contact, where several are followed."""
    return f" {line['contact']}" if "contact" in line else ""


def _onset(line: Mapping[str, Any]) -> str:
    return f"{line['onset_s']:8.3f} s  contact{_contact(line)}"


def decision_text(line: Mapping[str, Any]) -> str:
    """A decision as text: its time, task, label, confidence and flags."""
    label = "out of range" if line["label"] is None else line["label"]
    notes = [", ".join(line["flags"])] if line["flags"] else []
    if "unusual" in line:
        notes.append(line["unusual"])
    if "strongest" in line:
        share = f"{line['strongest']:.0%}"
        notes.append(f"the strongest taxel came to {share} of the onset")
    if "expected" in line and line["expected"] != line["label"]:
        notes.append(f"labelled {line['expected']}")
    time = line["onset_s"] + line["window_s"]
    number = _contact(line)
    contact = number and f"{number}:"
    text = f"{time:8.3f} s {contact} {line['task']:<10} {label:<16}"
    if line["confidence"] is not None:
        text += f" {bar(line['confidence'])} {line['confidence']:4.0%}"
    return f"{text}  ({'; '.join(notes)})" if notes else text


def _release(line: Mapping[str, Any]) -> str:
    duration = line["release_s"] - line["onset_s"]
    contact = _contact(line)
    return f"{line['release_s']:8.3f} s  released{contact} after {duration:.2f} s"


def _chip(line: Mapping[str, Any]) -> str:
    error = f": {line['error']}" if line.get("error") else ""
    place = f"{line['bus']}, {line['place']}"
    return f"{line['t']:8.3f} s  {place} is {line['state']}{error}"


def _bus(line: Mapping[str, Any]) -> str:
    lost = line["state"] == "lost"
    retried = "; it is opened again until it answers" if lost else ""
    return f"{line['t']:8.3f} s  {line['bus']} is {line['state']}{retried}"


def _taxels(line: Mapping[str, Any]) -> str:
    if not line["invalid"]:
        return f"{line['t']:8.3f} s  all taxels are valid again"
    silent = f"taxels without a valid value for {line['frames']} frames"
    return f"{line['t']:8.3f} s  {silent}: {line['invalid']}"


def _aside(line: Mapping[str, Any]) -> str:
    taxels = line["taxels"]
    if not taxels:
        return f"{line['t']:8.3f} s  all taxels are followed again"
    places = ", ".join(f"({row}, {col})" for row, col in taxels[:MOST_PLACES])
    more = " ..." if len(taxels) > MOST_PLACES else ""
    return f"{line['t']:8.3f} s  set aside as still: taxels {places}{more}"


def _end(line: Mapping[str, Any]) -> str:
    text = f"{line['frames']} frames"
    period = line["period_ms"]
    if period:
        text += f", one every {period['p50']:g} ms (99 % within {period['p99']:g})"
    return f"{text}, {line['missed_ticks']} missed"


def _saved(line: Mapping[str, Any]) -> str:
    labels = ", ".join(f"{task}={label}" for task, label in line["labels"].items())
    text = f"{line['seconds']:g} s, {line['frames']} frames, {labels}"
    if not line["complete"]:
        text += "; incomplete: reading stopped before the contact's end"
    return f"{line['file']}: {text}"


def _unknown_touches(line: Mapping[str, Any]) -> str:
    touches = f"{line['unknown']} of the last {line['touches']} touches"
    return f"{touches} are unknown to the model"


def _deleted(line: Mapping[str, Any]) -> str:
    return f"{line['file']} is deleted"


def _no_contact(_: Mapping[str, Any]) -> str:
    return "no contact"


TEXTS: dict[str, Callable[[Mapping[str, Any]], str]] = {
    "onset": _onset,
    "decision": decision_text,
    "release": _release,
    "chip": _chip,
    "bus": _bus,
    "taxels": _taxels,
    "aside": _aside,
    "end": _end,
    "saved": _saved,
    "unknown_touches": _unknown_touches,
    "deleted": _deleted,
    "no_contact": _no_contact,
}
"""The text of each event; that of any other is its JSON."""
