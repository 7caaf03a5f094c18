"""Output of a command: text for a person, JSON lines for a program, and messages on
stderr."""

import argparse
import logging
import shutil
import sys
import textwrap
from collections.abc import Mapping
from typing import Any, Self

from edge.errors import printable
from edge.events import json_line

LOG = logging.getLogger("edge.commands")
"""For messages, which are printed to stderr (see `edge.cli.dispatch`)."""
BAR = 10
"""Width in characters of a bar that shows a share."""
LONGEST_LINE = 80


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
        """The text that `event` prints; it has no control characters but line
        breaks."""
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
    """A number of things.

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
    kind = line["event"]
    contact = f" {line['contact']}" if "contact" in line else ""
    if kind == "onset":
        return f"{line['onset_s']:8.3f} s  contact{contact}"
    if kind == "decision":
        return decision_text(line, contact and f"{contact}:")
    if kind == "release":
        duration = line["release_s"] - line["onset_s"]
        return f"{line['release_s']:8.3f} s  released{contact} after {duration:.2f} s"
    if kind == "chip":
        error = f": {line['error']}" if line.get("error") else ""
        return f"{line['t']:8.3f} s  {line['bus']}, {line['place']} is {line['state']}{error}"
    if kind == "bus":
        again = (
            "; it is opened again until it answers" if line["state"] == "lost" else ""
        )
        return f"{line['t']:8.3f} s  {line['bus']} is {line['state']}{again}"
    if kind == "taxels":
        silent = f"taxels without a valid value for {line['frames']} frames: {line['invalid']}"
        return f"{line['t']:8.3f} s  {silent if line['invalid'] else 'all taxels are valid again'}"
    if kind == "end":
        period = line["period_ms"]
        median = f", one every {period['p50']:g} ms (99 % within {period['p99']:g})"
        return f"{line['frames']} frames{median if period else ''}, {line['missed_ticks']} missed"
    if kind == "saved":
        labels = ", ".join(f"{task}={label}" for task, label in line["labels"].items())
        cut = (
            ""
            if line["complete"]
            else "; incomplete: reading stopped before the contact's end"
        )
        return f"{line['file']}: {line['seconds']:g} s, {line['frames']} frames, {labels}{cut}"
    if kind == "unknown_touches":
        return f"{line['unknown']} of the last {line['touches']} touches are unknown to the model"
    if kind == "deleted":
        return f"{line['file']} is deleted"
    return "no contact" if kind == "no_contact" else json_line(line)


def decision_text(line: Mapping[str, Any], contact: str = "") -> str:
    """A decision as text: its time, task, label, confidence and flags."""
    label = "out of range" if line["label"] is None else line["label"]
    notes = [", ".join(line["flags"])] if line["flags"] else []
    if "strongest" in line:
        notes.append(
            f"the strongest taxel came to {line['strongest']:.0%} of the onset"
        )
    if "expected" in line and line["expected"] != line["label"]:
        notes.append(f"labelled {line['expected']}")
    time = line["onset_s"] + line["window_s"]
    confidence = f"{bar(line['confidence'])} {line['confidence']:4.0%}"
    text = f"{time:8.3f} s {contact} {line['task']:<10} {label:<16} {confidence}"
    return text + (f"  ({'; '.join(notes)})" if notes else "")
