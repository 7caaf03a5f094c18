"""What a command answers: text for a person at a terminal, JSON lines for a program."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from typing import Any

from edge.errors import printable
from edge.events import json_line

BAR = 10
"""Characters of a bar that shows a share."""


class Output:
    """Writes to stdout in one of the two forms."""

    def __init__(self, as_json: bool) -> None:
        self.as_json = as_json

    @classmethod
    def of(cls, arguments: argparse.Namespace) -> Output:
        """JSON where `--json` asks for it or stdout is no terminal, else text."""
        return cls(arguments.json or not sys.stdout.isatty())

    def event(self, line: Mapping[str, Any], text: str | None = None) -> None:
        """Write an event as a line of JSON, or as the text that says it; at once.

        Args:
            line: the event.
            text: the same for a person; `event_text` says it where None.
        """
        print(self.line(line, text), flush=True)

    def line(self, line: Mapping[str, Any], text: str | None = None) -> str:
        """What `event` writes, without its end; nothing in it but its line breaks is a control."""
        if self.as_json:
            return json_line(line)
        lines = (event_text(line) if text is None else text).split("\n")
        return "\n".join(map(printable, lines))

    def text(self, text: str) -> None:
        """Write what no program needs, a picture or a table, without disturbing JSON lines."""
        print(text, file=sys.stderr if self.as_json else sys.stdout, flush=True)


def bar(share: float) -> str:
    """A share from 0 to 1 as a bar.

    >>> bar(0.72)
    '███████···'
    """
    full = round(min(max(share, 0.0), 1.0) * BAR)
    return "█" * full + "·" * (BAR - full)


def event_text(line: Mapping[str, Any]) -> str:
    """An event of a contact, a chip or the loop, as a person reads it.

    >>> event_text({"event": "onset", "onset_s": 0.25})
    '   0.250 s  contact'
    """
    kind = line["event"]
    which = f" {line['contact']}" if "contact" in line else ""
    if kind == "onset":
        return f"{line['onset_s']:8.3f} s  contact{which}"
    if kind == "decision":
        return decision_text(line, which and f"{which}:")
    if kind == "release":
        lasted = line["release_s"] - line["onset_s"]
        return f"{line['release_s']:8.3f} s  released{which} after {lasted:.2f} s"
    if kind == "chip":
        error = f": {line['error']}" if line.get("error") else ""
        return f"{line['t']:8.3f} s  {line['bus']}, {line['place']} is {line['state']}{error}"
    if kind == "end":
        period = line["period_ms"]
        kept = f", period {period['p50']:g} ms (p99 {period['p99']:g})" if period else ""
        return f"{line['frames']} frames{kept}, {line['missed_ticks']} missed"
    if kind == "saved":
        said = ", ".join(f"{task}={label}" for task, label in line["labels"].items())
        cut = "" if line["complete"] else "; cut short, as reading ended first"
        return f"{line['file']}: {line['seconds']:g} s, {line['frames']} frames, {said}{cut}"
    return "no contact" if kind == "no_contact" else json_line(line)


def decision_text(line: Mapping[str, Any], which: str = "") -> str:
    """A decision: when it fell, the task, the label, how confident, and what to know about it."""
    label = "out of range" if line["label"] is None else line["label"]
    notes = [", ".join(line["flags"])] if line["flags"] else []
    if "expected" in line and line["expected"] != line["label"]:
        notes.append(f"it was {line['expected']}")
    time = line["onset_s"] + line["window_s"]
    said = f"{time:8.3f} s {which} {line['task']:<10} {label:<16} {bar(line['confidence'])} "
    said += f"{line['confidence']:4.0%}"
    return said + (f"  ({'; '.join(notes)})" if notes else "")
