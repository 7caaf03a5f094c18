"""`edge-classify demo`: decisions without any hardware, model or recording of your own."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from edge import demo
from edge.classifier import Classifier
from edge.events import Decided, Event
from edge.fake.player import play, skin_file
from edge.model.model import Model
from edge.recording import Recording, load


def add_parser(commands: Any) -> None:
    """Add the command to the command line."""
    parser: argparse.ArgumentParser = commands.add_parser(
        "demo",
        help="decide on recorded touches that come with the program",
        description="Plays the recordings that come with the program onto fake chips, reads "
        "them with the real drivers, and decides with the model that comes with the program: "
        "everything runs as it would on a robot, except for the wires. The recordings are "
        "simulated. The exit status is 1 if a decision is wrong.",
    )
    parser.set_defaults(run=run)


def events(model: Model, recording: Recording) -> Iterator[Event]:
    """What `edge-classify run` would answer to a recording on fake chips."""
    skin, playback = play(skin_file(recording.layout), recording)
    with skin:
        yield from Classifier(model).watch(skin, joints=playback, lasts_s=playback.ends)


def run(arguments: argparse.Namespace) -> int:
    """Print the events; 1 if a decision differs from its recording's label."""
    model = Model(demo.MODEL)
    right = asked = 0
    for path in demo.recordings():
        right_here, asked_here = _show(model, path)
        right, asked = right + right_here, asked + asked_here
    print(f"edge-classify: {right} of {asked} decisions are right", file=sys.stderr)
    return 0 if asked and right == asked else 1


def _show(model: Model, path: Path) -> tuple[int, int]:
    recording = load(path)
    right = asked = 0
    for event in events(model, recording):
        line = {"source": path.stem, **event.to_dict()}
        if isinstance(event, Decided):
            line["expected"] = recording.labels[event.task]
            asked += 1
            right += line["expected"] == event.label
        print(json.dumps(line, ensure_ascii=False), flush=True)
    return right, asked
