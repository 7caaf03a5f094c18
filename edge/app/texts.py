"""The events of a command as text for a person."""

import shutil
import textwrap
from collections.abc import Callable, Mapping
from typing import Any

from edge.decide.events import json_line
from edge.errors import places_text

LONGEST_LINE = 80
Line = Mapping[str, Any]


def wrapped(text: str, indent: str = "") -> list[str]:
    """The text in lines as wide as the terminal, and at most `LONGEST_LINE`."""
    columns = min(shutil.get_terminal_size().columns, LONGEST_LINE)
    return textwrap.wrap(text, columns, initial_indent=indent, subsequent_indent=indent)


def labels_text(labels: Mapping[str, str], between: str = ", ") -> str:
    """The labels of a trial.

    >>> labels_text({"object": "box", "mobility": "fixed"})
    'object=box, mobility=fixed'
    """
    return between.join(f"{task}={label}" for task, label in labels.items())


def event_text(line: Line) -> str:
    """An event as text for a person.

    >>> event_text({"event": "onset", "onset_s": 0.25})
    '   0.250 s  contact'
    """
    text = TEXTS.get(line["event"], json_line)
    return text(line)


def _at(seconds: float, text: str) -> str:
    return f"{seconds:8.3f} s  {text}"


def _contact(line: Line) -> str:
    """The number of a contact, where several are followed."""
    return f" {line['contact']}" if "contact" in line else ""


def _onset(line: Line) -> str:
    return _at(line["onset_s"], f"contact{_contact(line)}")


def _decision(line: Line) -> str:
    """The time of a decision, its task, label or why it has none, confidence and
    flags."""
    label = line["label"]
    if label is None:
        label = "unknown" if "unknown" in line["flags"] else "out of range"
    notes = [", ".join(line["flags"])] if line["flags"] else []
    if "unusual" in line:
        notes.append(line["unusual"])
    if "strongest" in line:
        share = f"{line['strongest']:.0%}"
        notes.append(f"the strongest taxel came to {share} of the onset")
    if line.get("expected", line["label"]) != line["label"]:
        notes.append(f"labelled {line['expected']}")
    time = line["onset_s"] + line["window_s"]
    number = _contact(line)
    contact = number and f"{number}:"
    text = f"{time:8.3f} s {contact} {line['task']:<10} {label:<16}"
    if line["confidence"]:
        text += f" {line['confidence']:4.0%}"
    return f"{text}  ({'; '.join(notes)})" if notes else text


def _release(line: Line) -> str:
    duration = line["released_s"] - line["onset_s"]
    return _at(line["released_s"], f"released{_contact(line)} after {duration:.2f} s")


def _chip(line: Line) -> str:
    error = f": {line['error']}" if line.get("error") else ""
    return _at(line["t"], f"{line['bus']}, {line['route']} is {line['state']}{error}")


def _bus(line: Line) -> str:
    lost = line["state"] == "lost"
    retried = "; it is opened again until it answers" if lost else ""
    return _at(line["t"], f"{line['bus']} is {line['state']}{retried}")


def _taxels(line: Line) -> str:
    if not line["invalid"]:
        return _at(line["t"], "all taxels are valid again")
    silent = f"taxels without a valid value for {line['frames']} frames"
    return _at(line["t"], f"{silent}: {line['invalid']}")


def _broken(line: Line) -> str:
    if not line["taxels"]:
        return _at(line["t"], "all taxels are trusted again")
    places = places_text(line["taxels"])
    remedy = "free them, or list broken ones under dead in [signal]"
    return _at(line["t"], f"ignored: taxels {places}; {remedy}")


def _end(line: Line) -> str:
    text = f"{line['frames']} frames"
    period = line["period_ms"]
    if period:
        text += f", one every {period['p50']:g} ms (99 % within {period['p99']:g})"
    return f"{text}, {line['missed_ticks']} missed"


def _saved(line: Line) -> str:
    labels = labels_text(line["labels"])
    text = f"{line['seconds']:g} s, {line['frames']} frames, {labels}"
    if not line["complete"]:
        text += "; incomplete: reading stopped before the contact's end"
    return f"{line['file']}: {text}"


TEXTS: dict[str, Callable[[Line], str]] = {
    "onset": _onset,
    "decision": _decision,
    "release": _release,
    "chip": _chip,
    "bus": _bus,
    "taxels": _taxels,
    "broken": _broken,
    "end": _end,
    "saved": _saved,
    "no_contact": "no contact".format_map,
}
"""The text of each event; that of any other is its JSON."""
