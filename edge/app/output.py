"""Output of a command: text for a person, JSON lines for a program, messages."""

import argparse
import logging
import sys
from collections.abc import Mapping
from typing import Any, Self

from edge.app.texts import event_text
from edge.decide.events import json_line
from edge.errors import printable

LOG = logging.getLogger("edge.app")
"""For messages, which are printed to stderr (see `edge.app.cli.dispatch`)."""


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
            text: the same for a person; None takes that of `edge.app.texts`.
        """
        print(self.line(line, text), flush=True)

    def line(self, line: Mapping[str, Any], text: str | None = None) -> str:
        """The text that `event` prints, without control characters but line breaks."""
        if self.as_json:
            return json_line(line)
        if text is None:
            text = event_text(line)
        return _printable_lines(text)

    def text(self, text: str) -> None:
        """Write text that no program reads; to stderr if stdout is for JSON."""
        stream = sys.stderr if self.as_json else sys.stdout
        print(_printable_lines(text), file=stream, flush=True)


def _printable_lines(text: str) -> str:
    """The text without control characters but line breaks."""
    return "\n".join(map(printable, text.split("\n")))
