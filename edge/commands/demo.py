"""`edge-classify demo`: decisions without any hardware, model or recording of your own."""

from __future__ import annotations

import argparse
import logging
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from edge import demo
from edge.classifier import Classifier
from edge.commands import terminal
from edge.commands.output import Output
from edge.events import Decided, Event
from edge.fake.player import play, skin_file
from edge.model.model import Model
from edge.recording import Recording, load
from edge.touch.region import find_regions

LOG = logging.getLogger(__name__)

LABEL_WIDTH = 24
WHAT_NEXT = "`edge-classify view --fake REC.npz` shows a touch as it happens."


HELP = "decide on recorded touches that come with the program"
DESCRIPTION = (
    "Plays the recordings that come with the program onto fake chips, reads "
    "them with the real drivers, and decides with the model that comes with the program: "
    "everything runs as it would on a robot, except for the wires. The recordings are "
    "simulated. The exit status is 1 if a decision is wrong."
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""


def events(model: Model, recording: Recording) -> Iterator[Event]:
    """What `edge-classify run` would answer to a recording on fake chips."""
    skin, playback = play(skin_file(recording.layout), recording)
    with skin:
        yield from Classifier(model).watch(skin, joints=playback, lasts_s=playback.ends)


def run(arguments: argparse.Namespace) -> int:
    """Print the events; 1 if a decision differs from its recording's label."""
    model, output = Model(demo.MODEL), Output.of(arguments)
    right = asked = 0
    for path in demo.recordings():
        right_here, asked_here = _show(model, path, output)
        right, asked = right + right_here, asked + asked_here
    if output.as_json:
        LOG.info("%d of %d decisions are right", right, asked)
    else:
        output.text("")
        output.text(_pictures(demo.recordings()))
        output.text(f"{right} of {asked} decisions are right; {WHAT_NEXT}")
    return 0 if asked and right == asked else 1


def _show(model: Model, path: Path, output: Output) -> tuple[int, int]:
    recording = load(path)
    right = asked = 0
    if not output.as_json:
        output.text(path.stem.replace("-", " "))
    for event in events(model, recording):
        line = {"source": path.stem, **event.to_dict()}
        if isinstance(event, Decided):
            line["expected"] = recording.labels[event.task]
            asked += 1
            right += line["expected"] == event.label
        output.event(line)
    return right, asked


def _pictures(paths: list[Path]) -> str:
    """The fullest frame of each recording, side by side as far as the terminal is wide."""
    shown = []
    for path in paths:
        recording = load(path)
        layout = recording.layout
        fullest = int(recording.frames.sum(axis=(1, 2), dtype=np.int64).argmax())
        frame = list(recording)[fullest]
        regions = find_regions(frame.counts, layout.threshold_counts, wraps=layout.wraps)
        colour = terminal.colours(
            frame, regions, layout.threshold_counts, int(recording.frames.max())
        )
        lines = terminal.picture(colour, wide=1).split("\n")
        width = max(layout.cols, LABEL_WIDTH)
        pad = " " * (width - layout.cols)
        shown.append([f"{path.stem:<{width}}", *(line + pad for line in lines)])
    width = max(layout.cols, LABEL_WIDTH) + 2
    fit = shutil.get_terminal_size().columns // width
    beside = next(n for n in (len(shown), 2, 1) if n <= fit or n == 1)
    blocks = [shown[i : i + beside] for i in range(0, len(shown), beside)]
    return "\n\n".join(
        "\n".join("  ".join(parts).rstrip() for parts in zip(*block, strict=True))
        for block in blocks
    )
